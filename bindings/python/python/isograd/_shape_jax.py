"""Material points of a shape as a JAX function of its parameters and the time."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ._shapes import Coordinates, Shape

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from jax.typing import ArrayLike

# Steps of the central differences: of the time, in its unit, and of the surface coordinates, which run from 0 to 1.
TIME_STEP, COORDINATE_STEP = 1e-4, 1e-5


class Material(NamedTuple):
    """Material points of a shape at one time, each ``(N, 3)``."""

    points: jax.Array
    """Positions."""
    normals: jax.Array
    """Outward unit normals."""
    velocity: jax.Array
    """Velocity of each point; 0 for shapes that don't move."""


def function(
    shape: Shape, coordinates: Coordinates, free: Sequence[str]
) -> Callable[..., Material]:
    """See :meth:`isograd.Shape.jax`."""
    body = _Body(shape, coordinates, tuple(free))
    count = len(coordinates.patch)

    def call(
        host: Callable[..., tuple[np.ndarray, ...]], shapes: list[tuple[int, ...]], *arrays: jax.Array
    ) -> list[jax.Array]:
        results = [jax.ShapeDtypeStruct(shape, arrays[0].dtype) for shape in shapes]
        return list(jax.pure_callback(host, results, *arrays, vmap_method="sequential"))

    @jax.custom_vjp
    def material(values: jax.Array, time: jax.Array) -> Material:
        return Material(*call(body.forward, [(count, 3)] * 3, values, time))

    def forward(values: jax.Array, time: jax.Array) -> tuple[Material, tuple[jax.Array, jax.Array]]:
        return material(values, time), (values, time)

    def backward(inputs: tuple[jax.Array, jax.Array], bars: Material) -> tuple[jax.Array, ...]:
        return tuple(call(body.pullback, [inputs[0].shape, ()], *inputs, *bars))

    material.defvjp(forward, backward)

    def checked(values: ArrayLike, time: ArrayLike = 0.0) -> Material:
        values = jnp.asarray(values, jnp.result_type(float))
        if values.shape != (len(free),):
            raise ValueError(f"the values have the shape {values.shape}; give one for each of {', '.join(free) or 'none'}")
        return material(values, jnp.asarray(time, values.dtype))

    return checked


class _Body:
    """The same function and its pullback, in double precision on the host."""

    def __init__(self, shape: Shape, coordinates: Coordinates, free: tuple[str, ...]) -> None:
        described = shape.parameters
        for name in free:
            if name not in described or name == "time" or described[name].whole:
                able = [key for key, parameter in described.items() if key != "time" and not parameter.whole]
                raise ValueError(f"{name!r} can't be free; give some of {', '.join(able)}")
        if len(set(free)) != len(free):
            raise ValueError(f"a parameter is named twice in {free}")
        self.shape, self.coordinates, self.free = shape, coordinates, free
        self.moves = "time" in described
        shape.points_at(coordinates)  # refuses coordinates of another shape now

    def at(self, values: np.ndarray, time: float) -> Shape:
        moved = {"time": float(time)} if self.moves else {}
        return self.shape.replace(**{name: float(value) for name, value in zip(self.free, values)}, **moved)

    def forward(self, values: np.ndarray, at_time: np.ndarray) -> tuple[np.ndarray, ...]:
        time = float(at_time)
        points, normals = self.at(values, time).points_at(self.coordinates)
        velocity = np.zeros_like(points)
        for sign in (1, -1) if self.moves else ():
            place, _ = self.at(values, time + sign * TIME_STEP).points_at(self.coordinates)
            velocity += sign * place / (2 * TIME_STEP)
        return tuple(array.astype(np.asarray(values).dtype) for array in (points, normals, velocity))

    def pullback(
        self, values: np.ndarray, at_time: np.ndarray, points_bar: np.ndarray, normals_bar: np.ndarray, velocity_bar: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        dtype = np.asarray(values).dtype
        time = float(at_time)
        values, points_bar, normals_bar, velocity_bar = (
            np.asarray(x, np.float64) for x in (values, points_bar, normals_bar, velocity_bar)
        )
        found = np.zeros(len(self.free) + 1)

        def add(time: float, coordinates: Coordinates, bar: np.ndarray) -> None:
            pulled = self.at(values, time).pullback(coordinates, bar)
            found[:] += [pulled.get(name, 0.0) for name in (*self.free, "time")]

        add(time, self.coordinates, points_bar)
        if self.moves and velocity_bar.any():
            for sign in (1, -1):
                add(time + sign * TIME_STEP, self.coordinates, sign * velocity_bar / (2 * TIME_STEP))
        if normals_bar.any():
            for coordinates, bar in self.tangents_bar(self.at(values, time), normals_bar):
                add(time, coordinates, bar)
        return tuple(x.astype(dtype) for x in (found[:-1], found[-1]))

    def tangents_bar(self, shape: Shape, normals_bar: np.ndarray) -> list[tuple[Coordinates, np.ndarray]]:
        """Cotangents of the points beside each coordinate, whose differences are tangents: normals are their cross product."""
        patch, uv = self.coordinates
        ends = []
        for axis in (0, 1):
            low, high = uv.copy(), uv.copy()
            low[:, axis] = np.maximum(uv[:, axis] - COORDINATE_STEP, 0.0)
            high[:, axis] = np.minimum(uv[:, axis] + COORDINATE_STEP, 1.0)
            ends.append((Coordinates(patch, low), Coordinates(patch, high)))
        first, second = (shape.points_at(high)[0] - shape.points_at(low)[0] for low, high in ends)
        cross = np.cross(first, second)
        size = np.linalg.norm(cross, axis=1, keepdims=True)
        unit = np.divide(cross, size, out=np.zeros_like(cross), where=size > 0)
        side = np.sign(np.sum(unit * shape.points_at(self.coordinates)[1], axis=1, keepdims=True))
        along = normals_bar - unit * np.sum(normals_bar * unit, axis=1, keepdims=True)
        cross_bar = np.divide(side * along, size, out=np.zeros_like(cross), where=size > 0)
        bars = np.cross(second, cross_bar), np.cross(cross_bar, first)
        return [(end, sign * bar) for (low, high), bar in zip(ends, bars) for end, sign in ((high, 1), (low, -1))]
