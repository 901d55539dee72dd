"""``backend=``: where it is computed, and what is said where that can't be."""

import warnings

import numpy as np
import pytest

import isograd

POINTS = isograd.sample("torus", 2000).points.astype(np.float32)
GRID = isograd.Grid.fit(POINTS, 32)
OPTIONS = isograd.Options()


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
    for name in ("confidence", "neighbours"):
        assert np.array_equal(getattr(found, name), getattr(expected, name)), name
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


def test_what_devices_do_not_have_is_named():
    result = plan("vulkan")(POINTS, attributes={"a": POINTS})
    with pytest.raises(ValueError, match="not for devices yet"):
        result.extend("a", band=3.0)
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
