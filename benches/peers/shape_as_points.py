"""Samples and normals to the indicator and back: isograd's splat, solve and level against the algorithm of
Shape As Points (Peng et al., NeurIPS 2021), written plainly in JAX."""

import jax
import jax.numpy as jnp
import numpy as np

import torus
from case import Case, peer
from stage import stages, write_input

# Width of the Gaussian of the spectral filter in cells, as the paper's optimization has it.
SIGMA = 2.0


def case(stack, program, folder, count: int, cells: int, threads: int) -> Case:
    """Each entry gets points, normals and a cotangent of χ less its mean at the samples, and returns that
    field and the cotangents of points and normals."""
    folder = folder / f"indicator-{count}-{cells}"
    points, normals = (a.astype(np.float32) for a in torus.samples(count))
    bar = np.random.default_rng(2).standard_normal([cells] * 3).astype(np.float32)
    arrays = {"points": points, "normals": normals, "bar": bar}
    write_input(folder, torus.grid(cells), **arrays)
    entries = [stage.entry("chi") for stage in stages(stack, program, "indicator", folder, threads)]
    # XLA uses all cores.
    entries.append(peer("Shape As Points in JAX", "float32", threads, sap(**arrays)))
    inside = torus.distance(torus.centers(cells)) < 0

    def check() -> list[str]:
        fields = [(e.name, e.result()) for e in (entries[0], entries[-1])]
        fields = [(name, f[0] if isinstance(f, tuple) else f) for name, f in fields]
        return [f"{name}: {shown(np.ravel(field), inside)}" for name, field in fields]

    title = f"Indicator and its gradient, {count:,} points, {cells}³ cells"
    what = (
        "points and normals to χ less its mean at the samples, and a cotangent of that back to points and "
        "normals. Shape As Points: trilinear splat, Fourier transforms with a Gaussian, periodic walls"
    )
    return Case(title, what, ("run", 1), entries, check)


def sap(points, normals, bar):
    cells = bar.shape[0]
    places = (points + torus.HALF) * (cells / (2 * torus.HALF)) - 0.5

    @jax.jit
    def run(places, normals, bar):
        field, pull = jax.vjp(indicator(cells), places, normals)
        return field, *pull(bar)

    arrays = [jax.device_put(a) for a in (places, normals, bar)]
    return lambda: tuple(np.asarray(out) for out in run(*arrays))


def indicator(cells: int):
    """Places in cells and normals → χ less its mean at the samples."""
    frequency = 2 * jnp.pi * jnp.fft.fftfreq(cells)
    last = 2 * jnp.pi * jnp.fft.rfftfreq(cells)
    u = jnp.meshgrid(frequency, frequency, last, indexing="ij")
    square = sum(x * x for x in u).at[0, 0, 0].set(1.0)
    gaussian = jnp.exp(-0.5 * SIGMA**2 * square).at[0, 0, 0].set(0.0)
    # ∇²χ = ∇·V, with χ rising outward as V points outward.
    filters = [-1j * x * gaussian / square for x in u]

    def corners(places):
        """The eight cells around each place, and their trilinear weights."""
        low = jnp.floor(places)
        fraction = places - low
        for corner in np.ndindex(2, 2, 2):
            cell = (low.astype(jnp.int32) + np.array(corner)) % cells
            weight = jnp.prod(jnp.where(np.array(corner) == 1, fraction, 1 - fraction), axis=1)
            yield tuple(cell.T), weight

    def run(places, normals):
        field = jnp.zeros((3, cells, cells, cells), places.dtype)
        for (i, j, k), weight in corners(places):
            field = field.at[:, i, j, k].add((weight[:, None] * normals).T)
        spectrum = sum(f * jnp.fft.rfftn(v) for f, v in zip(filters, field))
        chi = jnp.fft.irfftn(spectrum, s=(cells,) * 3).astype(places.dtype)
        at_samples = sum(weight * chi[cell] for cell, weight in corners(places))
        return chi - at_samples.mean()

    return run


def shown(field: np.ndarray, inside: np.ndarray) -> str:
    """Share of cells whose sign differs from the exact one."""
    wrong = np.mean((field < 0) != inside)
    return f"{100 * wrong:.3f} % of all cells on the wrong side"
