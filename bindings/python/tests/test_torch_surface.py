"""`isograd.torch.surface`: the results and gradients of `isograd.jax.surface`, as operators of PyTorch."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="SKIPPED: PyTorch is not installed")

import isograd  # noqa: E402
import isograd.torch as it  # noqa: E402

FACES = ((1.0, 0.5, 0.5), (0.5, 1.0, 0.5), (0.5, 0.5, 1.0))
GRID = isograd.Grid((-1.4, -1.4, -1.4), 0.14, (20, 20, 20))
OPTIONS = isograd.Options(radius=0.5, orient="given")
RNG = np.random.default_rng(18)


def ball(count=800, dtype=torch.float64):
    points = isograd.sample("sphere", count).points
    return torch.from_numpy(points / np.linalg.norm(points, axis=1, keepdims=True)).to(dtype)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_results_of_a_sphere_are_those_of_its_closed_form(dtype):
    points = ball(2000, dtype)
    parts = it.surface(points, GRID, FACES, values=points, band="full")
    for axis, part in enumerate(parts):
        x = torch.from_numpy(GRID.centers()).to(dtype)
        x[..., axis] += 0.5 * GRID.spacing
        radius = x.norm(dim=-1)
        assert part.sdf.shape == GRID.shape and part.sdf.dtype == dtype
        assert (part.sdf - radius + 1).abs().max() < 0.006
        away = radius > 0.3
        assert (part.closest - x / radius[..., None]).abs()[away].max() < 0.1
        assert (part.values - part.closest).abs().max() < 0.006
        assert ((part.normal * x).sum(dim=-1) / radius)[away].min() > 0.99
    cells = it.surface(points, GRID, values=points[:, 0])
    torch.testing.assert_close(cells.values.shape, cells.sdf.shape)
    phi = it.signed_distance(points, GRID)
    near = phi < 4 * GRID.spacing
    assert torch.equal(cells.sdf[near], phi[near]) and (cells.sdf[~near] == 4 * GRID.spacing).all()
    deep = phi < -4 * GRID.spacing
    band = it.surface(points, GRID, values=points, fill="band")
    assert deep.sum() > 50 and not band.values[deep].any() and cells.values[deep].abs().max() > 0.5


@pytest.mark.parametrize("places", ["cells", "list"])
def test_gradients_agree_with_differences(places):
    points = ball().requires_grad_()
    normals = ball().requires_grad_()
    values = torch.from_numpy(RNG.standard_normal((len(points), 2))).requires_grad_()
    where = torch.from_numpy(RNG.uniform(-1.2, 1.2, (200, 3))).requires_grad_() if places == "list" else None
    inputs = [x for x in (points, normals, values, where) if x is not None]
    weights = [torch.from_numpy(RNG.standard_normal((8000 if where is None else 200, k))) for k in (1, 3, 3, 2)]

    def loss(points, normals, values, where=None):
        found = it.surface(points, GRID, where, values=values, normals=normals, options=OPTIONS, band="full")
        sdf = found.sdf.reshape(-1, 1)
        # Deeper inside, cells may lie between two parts of the surface as close as each other.
        clear = (sdf.abs() > 0.03) & (sdf > -0.3)
        return sum((w * part.reshape(len(w), -1) * clear).sum() for w, part in zip(weights, found)) / 100

    slopes = torch.autograd.grad(loss(*inputs), inputs)
    for k, slope in enumerate(slopes):
        way = torch.from_numpy(RNG.standard_normal(inputs[k].shape))
        sides = [loss(*[x + s * 1e-7 * way if i == k else x for i, x in enumerate(inputs)]) for s in (1, -1)]
        difference = ((sides[0] - sides[1]) / 2e-7).item()
        assert abs(difference) > 1e-3
        # Differences of a loss of order 1 over 1e-7 have 9 digits less than the loss.
        assert abs((slope * way).sum().item() - difference) < 1e-6 * max(1, abs(difference)), k


def test_bits_are_those_of_jax():
    jax = pytest.importorskip("jax", reason="SKIPPED: JAX is not installed")
    import isograd.jax as ij

    points = ball(dtype=torch.float32).requires_grad_()

    def total(parts):
        return sum((x * x).sum() for part in parts for x in part)

    total(it.surface(points, GRID, FACES, values=points)).backward()
    array = points.detach().numpy()
    for mine, other in zip(
        it.surface(points, GRID, FACES, values=points), ij.surface(array, GRID, FACES, values=array)
    ):
        for a, b in zip(mine, other):
            np.testing.assert_array_equal(a.detach().numpy(), b)
    slope = jax.grad(lambda p: total(ij.surface(p, GRID, FACES, values=p)))(array)
    # Sums of some thousand terms of float32.
    np.testing.assert_allclose(points.grad, slope, atol=2e-4 * np.abs(slope).max())


def test_operators_obey_the_rules_of_pytorch():
    points = ball(300).requires_grad_()
    found = it.surface(points, GRID, values=points)
    (slope,) = torch.autograd.grad(found.sdf.square().sum(), points, create_graph=True)
    with pytest.raises(RuntimeError, match="once"):
        torch.autograd.grad(slope.sum(), points)
    batch = torch.stack([ball(300), 0.9 * ball(300)])
    together = torch.vmap(lambda p: it.surface(p, GRID, values=p).values)(batch)
    alone = torch.stack([it.surface(p, GRID, values=p).values for p in batch])
    assert torch.equal(together, alone)


def test_bad_arguments_are_refused():
    points = ball(300)
    bad = (ValueError, TypeError)
    for places in ((1, 2), "here", points[:, :2], np.zeros((3, 3))):
        with pytest.raises(bad, match="places"):
            it.surface(points, GRID, places)
    for values in (points[1:], points[:, :0], points[None], 1.0):
        with pytest.raises(bad, match="values"):
            it.surface(points, GRID, values=values)
    with pytest.raises(ValueError, match="fill"):
        it.surface(points, GRID, fill="all")
    with pytest.raises(ValueError, match="trim and sheet"):
        it.surface(points, GRID, options=isograd.Options(trim=0.5))
