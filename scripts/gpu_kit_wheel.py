"""The wheel of the kit on the first NVIDIA device: arrays of NumPy, and of PyTorch and JAX where they are here with CUDA."""

import os

import numpy as np

import isograd

# JAX would take most of the device's memory.
os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")

points = np.random.default_rng(1).normal(size=(5000, 3)).astype(np.float32)
points /= np.linalg.norm(points, axis=1, keepdims=True)
normals = points.copy()
points *= np.float32([1, 0.7, 0.5])
grid = isograd.Grid.fit(points, 48)
# As devices have them.
settings = {"surface": "grid", "walls": "free", "checks": False}
options = isograd.Options(**settings)


def numpy_arrays() -> tuple[np.ndarray, np.ndarray]:
    """φ and the gradient of Σ φ² by the device, after comparison with the CPU's."""
    cpu = isograd.Reconstructor(grid, options)(points)
    plan = isograd.Reconstructor(grid, options, backend="cuda")
    device = plan(points)
    print(device.backend)
    assert np.allclose(device.sdf, cpu.sdf, atol=1e-4)
    gradient = device.pullback(sdf=2 * device.sdf).points
    assert np.isfinite(gradient).all()
    assert np.array_equal(plan(points).sdf, device.sdf), "other bits the second time"
    return device.sdf, gradient


def torch_tensors(sdf: np.ndarray, gradient: np.ndarray) -> None:
    """Tensors on the device give the bits of arrays of the CPU, in another stream too."""
    import torch

    import isograd.torch

    if not torch.cuda.is_available():
        raise ImportError("PyTorch has no CUDA device")
    there = torch.tensor(points, device="cuda", requires_grad=True)
    found = isograd.torch.signed_distance(there, grid, options=options, backend="cuda")
    (found**2).sum().backward()
    assert found.is_cuda and np.array_equal(found.detach().cpu(), sdf)
    assert there.grad is not None and np.array_equal(there.grad.cpu(), gradient)
    stream = torch.cuda.Stream()
    with torch.cuda.stream(stream):
        again = isograd.torch.signed_distance(there.detach() * 1, grid, options=options, backend="cuda")
    stream.synchronize()
    assert torch.equal(again, found)
    vertices = isograd.torch.mesh(there.detach(), grid, options=options, backend="cuda").vertices
    assert vertices.is_cuda and len(vertices) > 1000

    def at_faces(device: str) -> list[np.ndarray]:
        cloud = torch.tensor(points, device=device, requires_grad=True)
        field = isograd.torch.surface(cloud, grid, (1.0, 0.5, 0.5), values=cloud * 2)
        (field.sdf + (field.values * field.normal).sum(-1)).sum().backward()
        return [array.detach().cpu().numpy() for array in (field.sdf, field.values, cloud.grad)]

    for found, wanted in zip(at_faces("cuda"), at_faces("cpu")):
        assert np.allclose(found, wanted, rtol=0, atol=1e-4 * abs(wanted).max())
    try:
        isograd.torch.signed_distance(there, grid, options=options)
        raise AssertionError("copied without being asked")
    except ValueError as error:
        assert 'backend="cuda"' in str(error), error


def jax_arrays(sdf: np.ndarray) -> None:
    """Arrays on the device inside ``jit``, and ten steps of a descent without a field in the host's memory."""
    import jax
    import jax.numpy as jnp

    import isograd.immersed
    import isograd.jax

    if jax.devices()[0].platform != "gpu":
        raise ImportError("JAX has no CUDA device")
    found = jax.jit(lambda x: isograd.jax.signed_distance(x, grid, options=options, backend="cuda"))(points)
    assert found.devices() == {jax.devices()[0]} and np.array_equal(found, sdf)
    signs = isograd.Options(orient="signs", **settings)

    def loss(scale: jax.Array) -> jax.Array:
        phi = isograd.jax.signed_distance(
            jnp.asarray(points) * scale, grid, normals=jnp.asarray(normals), options=signs, backend="cuda"
        )
        return jnp.mean((phi - found) ** 2)

    step = jax.value_and_grad(loss)
    start = jnp.float32([0.95, 1.0, 0.98])
    (end, losses) = jax.jit(
        lambda start: jax.lax.scan(lambda x, _: ((v := step(x)) and x - 0.5 * v[1], v[0]), start, length=10)
    )(start)
    assert losses[-1] < losses[0] / 2, losses

    @jax.jit
    def at_faces(cloud: jax.Array) -> tuple[jax.Array, ...]:
        def total(cloud: jax.Array) -> tuple[jax.Array, jax.Array]:
            body = isograd.immersed.staggered(cloud, 2 * cloud, grid)
            return sum(jnp.sum(sdf) + jnp.sum(u) for sdf, u in zip(body.sdf, body.velocity)), body.sdf[0]

        (_, sdf), slope = jax.value_and_grad(total, has_aux=True)(cloud)
        return sdf, slope, isograd.jax.orient(cloud, cloud)

    there, here = (at_faces(jax.device_put(points, jax.devices(name)[0])) for name in ("gpu", "cpu"))
    assert there[0].devices() == {jax.devices()[0]}
    for found, wanted in zip(there, here):
        assert np.allclose(found, wanted, rtol=0, atol=1e-4 * abs(wanted).max())


def main() -> None:
    sdf, gradient = numpy_arrays()
    for name, check in [("PyTorch", lambda: torch_tensors(sdf, gradient)), ("JAX", lambda: jax_arrays(sdf))]:
        try:
            check()
            print(f"{name}: passed")
        except ImportError as error:
            print(f"{name}: SKIPPED: {error}")


main()
