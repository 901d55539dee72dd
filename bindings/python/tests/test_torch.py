"""isograd.torch: the numbers are those of isograd._core, and PyTorch's own checks pass."""

import numpy as np
import pure
import pytest

from isograd import Grid, Options, _settings

torch = pytest.importorskip("torch", reason="PyTorch is not here: its tests are left out", exc_type=ImportError)

from isograd.torch import _signed_distance, signed_distance  # noqa: E402

# "auto" takes a radius from the points and holds it fixed, which differences don't.
SMOOTH = Options(radius=0.5, checks=False)
GIVEN = Options(radius=0.5, orient="given", checks=False)


def sphere(n=60, dtype=torch.float64, seed=0):
    """Points near a sphere of radius 0.5, spread by the golden angle and moved a little."""
    i = np.arange(n) + 0.5
    z, turn = 1 - 2 * i / n, np.pi * (1 + 5**0.5) * i
    ring = np.sqrt(1 - z * z)
    points = 0.5 * np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
    points += 0.01 * np.random.default_rng(seed).standard_normal(points.shape)
    return torch.from_numpy(points).to(dtype)


GRID = Grid.fit(sphere().numpy(), 12)


def weights(dtype=torch.float64):
    return torch.randn(GRID.shape, dtype=dtype, generator=torch.Generator().manual_seed(1))


def gradient(points, **arguments):
    points = points.clone().requires_grad_()
    (signed_distance(points, GRID, **arguments) * weights(points.dtype)).sum().backward()
    return points.grad


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_phi_and_its_gradient_are_the_core_s_bit_for_bit(dtype):
    points, settings = sphere(dtype=dtype), _settings.encode(GRID, Options(checks=False))
    saved = pure.forward(settings, points.numpy())
    (expected,) = pure.pullback(settings, points.numpy(), None, saved, weights(dtype).numpy())
    phi = signed_distance(points, GRID)
    assert phi.dtype == dtype and phi.shape == GRID.shape
    assert np.array_equal(phi.numpy(), saved[0])
    assert phi.min() < 0 < phi.max()
    assert np.array_equal(gradient(points).numpy(), expected)


def test_gradcheck_passes_in_the_points():
    points = sphere().requires_grad_()
    near = signed_distance(points.detach(), GRID, options=SMOOTH).abs() < GRID.spacing
    assert near.sum() > 100
    # φ is piecewise smooth: differences over 1e-6 agree to 1e-5 away from its creases.
    assert torch.autograd.gradcheck(
        lambda points: signed_distance(points, GRID, options=SMOOTH)[near], points, eps=1e-6, atol=1e-5
    )


def test_gradcheck_passes_in_the_given_normals():
    points = sphere()
    normals = torch.nn.functional.normalize(points, dim=1).requires_grad_()

    def near_surface(normals):
        phi = signed_distance(points, GRID, normals=normals, options=GIVEN)
        return phi[near]

    phi = signed_distance(points, GRID, normals=normals.detach(), options=GIVEN)
    near = phi.abs() < GRID.spacing
    assert torch.autograd.gradcheck(near_surface, normals, eps=1e-6, atol=1e-5)
    near_surface(normals).sum().backward()
    assert normals.grad.abs().max() > 0


def test_opcheck_passes_for_both_operators():
    points = sphere()
    normals = torch.nn.functional.normalize(points, dim=1).requires_grad_()
    for given, options in ((None, SMOOTH), (normals, GIVEN)):
        how = (_settings.encode(GRID, options), 0.0, False)
        torch.library.opcheck(_signed_distance, (points.clone().requires_grad_(), None, given, *how, []))
        given = None if given is None else given.detach()
        # φ, closest faces, normals.
        saved = _signed_distance(points, None, given, *how, [])
        pullback = torch.ops.isograd.signed_distance_pullback
        torch.library.opcheck(pullback, (points, None, given, *saved, weights(), *how))


def test_a_compiled_loss_has_the_same_gradient():
    def loss(points, grid):
        return (signed_distance(2.0 * points, grid) ** 2).sum()

    compiled = torch.compile(loss, backend="aot_eager", fullgraph=True)
    # Another grid must not meet what was compiled for the first.
    for grid in (GRID, Grid.fit(sphere().numpy(), 16), GRID):
        gradients = []
        for function in (loss, compiled):
            points = (0.5 * sphere()).requires_grad_()
            function(points, grid).backward()
            gradients.append(points.grad)
        assert torch.equal(*gradients) and gradients[0].abs().max() > 0


def test_vmap_over_clouds_equals_the_loop():
    clouds = torch.stack([sphere(seed=seed) for seed in range(4)])
    batch = clouds.clone().requires_grad_()
    (torch.vmap(lambda points: signed_distance(points, GRID))(batch) * weights()).sum().backward()
    assert torch.equal(batch.grad, torch.stack([gradient(cloud) for cloud in clouds]))
    # The clouds along another axis than the first, and normals for all of them.
    normals = torch.nn.functional.normalize(sphere(), dim=1)

    def oriented(points):
        return signed_distance(points, GRID, normals=normals, options=GIVEN)

    alone = torch.stack([oriented(cloud) for cloud in clouds])
    assert torch.equal(torch.vmap(oriented, in_dims=2)(clouds.movedim(0, 2)), alone)


def test_the_order_of_the_memory_does_not_matter():
    points = sphere()
    expected = gradient(points)
    transposed = points.t().contiguous().t()
    every_second = points.repeat_interleave(2, dim=0)[::2]
    negated = torch.complex(torch.zeros_like(points), -points).conj().imag
    for same in (transposed, every_second, negated):
        assert torch.equal(same, points)
        assert not same.is_contiguous() or same.is_neg()
        assert torch.equal(gradient(same), expected)
        assert torch.equal(signed_distance(same, GRID), signed_distance(points, GRID))


@pytest.mark.parametrize("dtype", [torch.float16, torch.bfloat16])
def test_half_precision_becomes_float32(dtype):
    points = sphere().to(dtype).requires_grad_()
    phi = signed_distance(points, GRID)
    assert torch.equal(phi, signed_distance(points.detach().float(), GRID))
    phi.sum().backward()
    assert points.grad.dtype == dtype


def test_a_second_derivative_is_refused_not_zero():
    points = sphere().requires_grad_()
    phi = signed_distance(points, GRID)
    (first,) = torch.autograd.grad((phi**2).sum(), points, create_graph=True)
    with pytest.raises(RuntimeError, match="differentiated once, not twice"):
        first.sum().backward()


def test_forward_mode_is_refused_not_zero():
    points = sphere()
    with pytest.raises(NotImplementedError, match="points has a tangent"):
        torch.func.jvp(lambda p: signed_distance(p, GRID), (points,), (points,))
    with torch.autograd.forward_ad.dual_level():
        dual = torch.autograd.forward_ad.make_dual(points, points)
        with pytest.raises(NotImplementedError, match="use backward"):
            signed_distance(dual, GRID)


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        (lambda p: p.numpy(), TypeError, "points is a ndarray; give a torch.Tensor"),
        (lambda p: p.to("meta"), ValueError, r"points is on meta; .*pass points.cpu\(\)"),
        (lambda p: p.to_sparse(), ValueError, r"points.to_dense\(\)"),
        (lambda p: p.long(), TypeError, "points is of torch.int64; give float32 or float64"),
        (lambda p: p.to(torch.complex128), TypeError, "torch.complex128"),
        (lambda p: p[:, :2], ValueError, r"\(60, 2\) and must have \(N, 3\)"),
        (lambda p: p[None, None], ValueError, r"\(1, 1, 60, 3\)"),
        (lambda p: p[:0], ValueError, "point"),
        (lambda p: p * torch.nan, ValueError, "point"),
    ],
)
def test_points_that_can_t_be_used_are_refused(change, error, words):
    with pytest.raises(error, match=words):
        signed_distance(change(sphere()), GRID)


def test_other_arguments_that_can_t_be_used_are_refused():
    with pytest.raises(TypeError, match="grid is a int"):
        signed_distance(sphere(), 12)
    with pytest.raises(TypeError, match="options is a dict"):
        signed_distance(sphere(), GRID, options={})
    with pytest.raises(ValueError, match="59 normals|normals.* 59"):
        signed_distance(sphere(), GRID, normals=sphere(59), options=GIVEN)
    with pytest.raises(ValueError, match="there are no normals"):
        signed_distance(sphere(), GRID, options=GIVEN)
    with pytest.raises(ValueError, match="empty batch"):
        torch.vmap(lambda points: signed_distance(points, GRID))(torch.zeros((0, 60, 3)))
