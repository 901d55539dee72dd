"""``backend=``: results on devices, and errors for unavailable ones."""

import warnings

import numpy as np
import pytest

import isograd

POINTS = isograd.sample("torus", 2000).points.astype(np.float32)
GRID = isograd.Grid.fit(POINTS, 32)
OPTIONS = isograd.Options(surface="grid", walls="free")


def plan(backend, **changes):
    """A plan, or a skipped test where there is no such device."""
    try:
        return isograd.Reconstructor(GRID, OPTIONS, backend=backend, **changes)
    except RuntimeError as error:
        if "no Vulkan device" not in str(error) and "built without" not in str(error):
            raise
        pytest.skip(str(error))


def off(found, expected):
    """The largest difference, of the largest number."""
    return np.abs(found - expected).max() / np.abs(expected).max()


def test_the_cpu_is_the_default_and_says_so():
    result = isograd.reconstruct(POINTS, GRID, options=OPTIONS)
    assert result.backend == "cpu" and result.report["backend"] == "cpu"


def test_results_and_gradients_on_a_device_are_those_of_the_cpu():
    found, expected = plan("vulkan")(POINTS), plan("cpu")(POINTS)
    assert found.backend.startswith("vulkan: ") and found.report["backend"] == found.backend
    assert found.dtype == np.float32 and found.sdf.dtype == np.float32
    # What the kernels are allowed: docs/gpu.md.
    for name in ("sdf", "indicator", "iso_value", "normals", "areas"):
        assert off(getattr(found, name), getattr(expected, name)) < 2e-4, name
    assert off(found.mesh.vertices, expected.mesh.vertices) < 2e-4
    assert off(found.confidence, expected.confidence) < 1e-5
    # A sample at the very edge of a neighborhood.
    assert np.abs(found.neighbors.astype(int) - expected.neighbors.astype(int)).max() <= 1
    assert np.array_equal(found.mesh.faces, expected.mesh.faces)
    assert found.closest.shape == GRID.shape
    assert found.warnings == expected.warnings
    assert found.report["surface"]["closed"] and found.report["surface"]["euler"] == 0
    near = np.where(np.abs(expected.sdf) < 1.5 * GRID.spacing, expected.sdf, 0)
    vertices = np.cos(3 * expected.mesh.vertices)
    for bars in ({"sdf": near}, {"vertices": vertices}, {"areas": expected.areas, "iso_value": 2.0}):
        a, b = found.pullback(**bars), expected.pullback(**bars)
        assert off(a.points, b.points) < 2e-3, bars.keys()
        assert off(np.array(a.lower), np.array(b.lower)) < 5e-3, bars.keys()
        assert a.normals is None


def test_a_plan_on_a_device_is_used_again_and_follows_its_body():
    follow = plan("vulkan", orient="previous", checks=False)
    methods = [follow(growth * POINTS).report["orientation"]["method"] for growth in (1.0, 1.01, 1.02)]
    assert methods == ["auto", "previous", "previous"]


def test_given_normals_on_a_device_have_gradients():
    normals = isograd.sample("torus", 2000).normals.astype(np.float32)
    found, expected = (plan(b, orient="given")(POINTS, normals=normals) for b in ("vulkan", "cpu"))
    assert off(found.sdf, expected.sdf) < 2e-4
    near = np.where(np.abs(expected.sdf) < 1.5 * GRID.spacing, expected.sdf, 0)
    a, b = found.pullback(near), expected.pullback(near)
    assert off(a.points, b.points) < 2e-3 and off(a.normals, b.normals) < 2e-3


def test_attributes_are_extended_on_a_device_and_have_gradients():
    velocity = np.cross([0.4, -0.7, 1.1], POINTS) + [0.3, -0.2, 0.5]
    attributes = {"velocity": velocity.astype(np.float32), "one": np.ones(len(POINTS), np.float32)}
    found, expected = (plan(b)(POINTS, attributes=attributes) for b in ("vulkan", "cpu"))
    a, b = found.extend("velocity", band=2 * GRID.spacing), expected.extend("velocity", band=2 * GRID.spacing)
    assert off(a.vertices, b.vertices) < 2e-4
    # Where φ is a rounding error from the end of the band, one may have a cell that the other has not.
    both = np.intersect1d(a.cells, b.cells)
    assert len(both) > 0.999 * max(len(a.cells), len(b.cells)) and np.all(np.diff(a.cells) > 0)
    in_both = [e.values[np.isin(e.cells, both)] for e in (a, b)]
    assert off(*in_both) < 2e-4
    assert np.all(found.extend("one", band=2 * GRID.spacing).values == 1)
    bars = np.cos(5 * b.vertices)
    pulled = [r.pullback(extensions=[(e, bars, None)]) for r, e in ((found, a), (expected, b))]
    assert off(*(p.attributes["velocity"] for p in pulled)) < 2e-3
    assert off(*(p.points for p in pulled)) < 2e-3
    # The whole is linear in the attribute, at vertices and in the band.
    through = found.pullback(extensions=[(a, bars, a.values)]).attributes["velocity"]
    loss = np.sum(bars * a.vertices, dtype=float) + np.sum(a.values * a.values, dtype=float)
    assert abs(np.sum(through * velocity, dtype=float) - loss) < 1e-4 * abs(loss)
    with pytest.raises(ValueError, match="no attribute 'pressure'"):
        found.extend("pressure", band=2 * GRID.spacing)
    with pytest.raises(ValueError, match="a width of 0"):
        found.extend("one", band=0.0)


def gradient_on(backend, **changes):
    """What a plan gives: φ, and the gradient of Σ φ² near the surface."""
    result = plan(backend, **changes)(POINTS)
    return result.sdf, result.pullback(2 * near(result.sdf)).points


def near(sdf):
    return sdf * (abs(sdf) < 1.5 * GRID.spacing)


def test_jax_computes_on_a_device_inside_jit():
    sdf, gradient = gradient_on("vulkan")
    jax = pytest.importorskip("jax")
    import isograd.jax

    def loss(points):
        return (near(isograd.jax.signed_distance(points, GRID, options=OPTIONS, backend="vulkan")) ** 2).sum()

    def distance(points):
        return isograd.jax.signed_distance(points, GRID, options=OPTIONS, backend="vulkan")

    found = jax.jit(distance)(POINTS)
    assert np.array_equal(found, sdf)
    assert np.array_equal(jax.jit(jax.grad(loss))(POINTS), gradient)
    # The other targets, which look at the surface and at the fits of attributes.
    on_device, on_cpu = (
        jax.value_and_grad(lambda points: scene(jax, isograd.jax, points, backend))(POINTS)
        for backend in ("vulkan", "cpu")
    )
    assert off(on_device[0], on_cpu[0]) < 2e-4
    apart = np.abs(on_device[1] - on_cpu[1]).max(axis=1) / np.abs(on_cpu[1]).max()
    # A cell may have its closest point so near a corner that rounding takes the other side of a kink, which concerns
    # the samples around it.
    assert np.quantile(apart, 0.98) < 2e-3 and apart.max() < 0.1
    with pytest.raises(RuntimeError, match="no CUDA device|build it with"):
        isograd.jax.signed_distance(POINTS, GRID, backend="cuda:77")


def scene(jax, functions, points, backend):
    """A number that mesh, query and extension have a part in."""
    how = {"options": OPTIONS, "backend": backend}
    mesh = functions.mesh(points, GRID, max_vertices=20_000, max_faces=40_000, **how)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    volume = (a * jax.numpy.cross(b, c)).sum() / 6
    far = functions.query(points, GRID, 1.3 * POINTS[:50], **how).sum()
    extended = functions.extend(points, points[:, 0] ** 2, GRID, band=2 * GRID.spacing, **how)
    # Smooth, and 0 before the band ends: no cell comes or goes by rounding.
    window = jax.numpy.maximum(0, 1 - (extended.sdf / (1.5 * GRID.spacing)) ** 2) ** 2
    return volume + far + (extended.values * window).sum()


def test_torch_computes_on_a_device():
    sdf, gradient = gradient_on("vulkan")
    torch = pytest.importorskip("torch")
    import isograd.torch

    points = torch.tensor(POINTS, requires_grad=True)
    found = isograd.torch.signed_distance(points, GRID, options=OPTIONS, backend="vulkan")
    assert np.array_equal(found.detach().numpy(), sdf)
    (near(found) ** 2).sum().backward()
    assert off(points.grad.numpy(), gradient) < 1e-6
    with pytest.raises(RuntimeError, match="no CUDA device|build it with"):
        isograd.torch.signed_distance(points, GRID, backend="cuda:77")


def test_a_fit_is_made_on_a_device():
    plan("vulkan")
    grid = isograd.Grid.fit(isograd.sample("sphere", 500).points, 20, padding=0.3)
    fits = [
        isograd.fit(
            isograd.sample("sphere", 1000).points,
            grid,
            shape=isograd.Shape("sphere", radius=0.45),
            samples=800,
            epochs=2,
            backend=backend,
            options=isograd.Options(surface="grid"),  # the only cells of a device
        )
        for backend in ("vulkan", "cpu")
    ]
    assert fits[0].backend.startswith("vulkan: ") and fits[1].backend == "cpu"
    losses = [[epoch["loss"] for epoch in fit.history] for fit in fits]
    assert len(losses[0]) == 3 and off(*map(np.array, losses)) < 1e-6
    with pytest.raises(RuntimeError, match="no CUDA device|build it with"):
        isograd.fit(POINTS, GRID, points=POINTS, backend="cuda:77")


def test_what_can_not_be_is_said_as_on_the_cpu():
    with pytest.raises(ValueError, match="wall"):
        plan("vulkan")(POINTS + 10)


def test_a_backend_that_is_not_there_is_said_when_it_is_asked_for():
    with pytest.raises(ValueError, match="cpu, cuda"):
        isograd.Reconstructor(GRID, backend="gpu")
    with pytest.raises(TypeError, match="backend is a int"):
        isograd.Reconstructor(GRID, backend=1)
    try:
        isograd.Reconstructor(GRID, OPTIONS, backend="cuda:77")
    except RuntimeError as error:
        # Why, and what to do.
        assert "CUDA" in str(error) and ("build it with" in str(error) or "no CUDA device" in str(error))
    else:
        pytest.fail("there are 78 CUDA devices")


def test_auto_takes_a_gpu_or_says_why_not():
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        auto = isograd.Reconstructor(GRID, OPTIONS, backend="auto")
        results = [auto(POINTS), auto(POINTS)]
    texts = [str(warning.message) for warning in said if warning.category is RuntimeWarning]
    if results[0].backend == "cpu":
        assert len(texts) == 1 and texts[0].startswith("computed on the CPU: ")
        assert [w.filename for w in said if w.category is RuntimeWarning] == [__file__]
    else:
        assert texts == []


def test_jax_refuses_what_is_on_a_device():
    _xla = pytest.importorskip("isograd._xla", reason="JAX is not here", exc_type=ImportError)
    with pytest.raises(ValueError, match="ISOGRAD_JAX_CALLBACK=1"):
        _xla.refuse()


def test_jax_takes_the_refusal_on_devices():
    jax = pytest.importorskip("jax")
    import isograd.jax

    # As it is before the platform is known: one branch for the CPU, one for all others.
    text = str(jax.make_jaxpr(lambda points: isograd.jax.signed_distance(points, GRID))(POINTS))
    assert "isograd_forward" in text
    assert "refuse" in text and "_Callback" not in text


class OnDevice:
    """An array in a GPU's memory, as far as it can be told without one: DLPack's device 2 is CUDA."""

    shape = (4, 3)

    def __dlpack_device__(self):
        return (2, 0)

    def __array__(self, *args, **kwargs):
        raise AssertionError("it was copied")


def test_an_array_in_the_memory_of_a_gpu_is_never_copied_silently():
    with pytest.raises(TypeError, match="points is in the memory of a device"):
        isograd.reconstruct(OnDevice(), GRID)
