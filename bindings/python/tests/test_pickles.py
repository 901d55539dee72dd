"""Copies, pickles and other processes."""

import copy
import dataclasses
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

import isograd

SAMPLES = isograd.sample("torus", 1500)
POINTS = SAMPLES.points
GRID = isograd.Grid.fit(POINTS, 24)


def bits(array):
    return np.ascontiguousarray(array).tobytes()


def pickled(value):
    return pickle.loads(pickle.dumps(value))


COPIES = [pickled, copy.copy, copy.deepcopy]


def reconstructed(dtype=np.float64, **options):
    points = POINTS.astype(dtype)
    return isograd.reconstruct(points, GRID, attributes={"x": points[:, 0], "v": points}, **options)


def results(result):
    """Bits of everything that a reconstruction computes."""
    bar = np.cos(np.arange(result.sdf.size, dtype=result.dtype)).reshape(result.sdf.shape)
    extension = result.extend("v", 3 * GRID.spacing)
    gradient = result.pullback(bar, extensions=[(extension, None, np.ones_like(extension.values))])
    arrays = [
        getattr(result, name)
        for name in ("sdf", "indicator", "closest", "normals", "confidence", "areas", "outliers", "neighbors")
    ]
    arrays += [result.mesh.vertices, result.mesh.faces, result.closest_mesh.faces, extension.values]
    arrays += [gradient.points, gradient.attributes["v"], gradient.lower]
    facts = (result.grid, result.surface_grid, result.options, result.dtype, result.iso_value, result.report)
    return [bits(array) for array in arrays], facts, repr(result), result.backend, result.verdict


@pytest.mark.parametrize("duplicate", COPIES)
def test_values_are_equal_after_a_copy(duplicate):
    shape = isograd.Shape("fish", width1=0.04)
    for value in (GRID, isograd.Options(orient="signs", surface="2x"), shape, isograd.Outliers.KEEP):
        assert duplicate(value) == value and hash(duplicate(value)) == hash(value)
    for value in (SAMPLES, isograd.Cloud(POINTS, None, {"x": POINTS}), reconstructed().mesh):
        other = duplicate(value)
        assert type(other) is type(value)
        if dataclasses.is_dataclass(value):
            other, value = (dataclasses.astuple(v) for v in (other, value))
        assert bits(other[0]) == bits(value[0])


def test_shapes_are_equal_by_name_and_values():
    shape = isograd.Shape("fish")
    assert shape == isograd.Shape("fish", **shape.values) != isograd.Shape("fish", width1=0.04)
    assert shape != isograd.Shape("sphere") and shape != "fish"
    assert len({shape, isograd.Shape("fish"), isograd.Shape("sphere")}) == 2
    assert pickled(isograd.Shape("torus")).area == isograd.Shape("torus").area


@pytest.mark.parametrize("duplicate", COPIES)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_reconstruction_keeps_every_bit(duplicate, dtype):
    result = reconstructed(dtype)
    assert results(duplicate(result)) == results(result)


def test_normals_and_sensors_are_kept():
    for how in (
        {"orient": "given", "normals": SAMPLES.normals},
        {"orient": "sensors", "sensors": (0.0, 0.0, 9.0)},
        {"orient": "sensors", "sensors": 9.0 * POINTS},
    ):
        result = isograd.reconstruct(POINTS, GRID, **how, checks=False)
        other = pickled(pickled(result))
        assert bits(other.sdf) == bits(result.sdf)
        gradients = [r.pullback(vertices=np.ones_like(r.mesh.vertices)) for r in (other, result)]
        assert bits(gradients[0].points) == bits(gradients[1].points)
        if gradients[1].normals is not None:
            assert bits(gradients[0].normals) == bits(gradients[1].normals)


def test_a_mesh_without_attributes_is_saved_without_a_second_computation(tmp_path, monkeypatch):
    result = isograd.reconstruct(POINTS, GRID)
    other = pickled(result)
    result.save(tmp_path / "result.ply")
    monkeypatch.setattr("isograd._stored._core.Plan", None)
    other.save(tmp_path / "other.ply")
    assert (tmp_path / "other.ply").read_bytes() == (tmp_path / "result.ply").read_bytes()


def test_arrays_that_were_read_need_no_second_computation(monkeypatch):
    result = reconstructed()
    areas = result.areas
    other = pickled(result)
    monkeypatch.setattr("isograd._stored._core.Plan", None)
    for name in ("sdf", "normals", "confidence", "outliers"):
        assert bits(getattr(other, name)) == bits(getattr(result, name))
    assert bits(other.mesh.faces) == bits(result.mesh.faces) and bits(other.areas) == bits(areas)
    assert other.report == result.report and other.surface_grid == result.surface_grid
    with pytest.raises(TypeError):
        other.neighbors


def test_copies_do_not_share_arrays():
    result = reconstructed()
    expected = bits(result.sdf)
    other, again = copy.deepcopy(result), pickled(result)
    result.sdf[:] = 0
    assert bits(other.sdf) == bits(again.sdf) == expected
    # An array that was changed does not count as another result.
    assert len(pickled(result).neighbors) == len(POINTS)


def test_what_depends_on_earlier_calls_is_an_error_after_a_pickle():
    plan = isograd.Reconstructor(GRID, orient="previous", checks=False)
    first, second = pickled(plan(POINTS)), pickled(plan(POINTS))
    assert len(first.neighbors) == len(POINTS)
    assert second.sdf.shape == GRID.shape
    with pytest.raises(RuntimeError, match="depends on the calls before"):
        second.pullback(second.sdf)


def test_a_machine_with_other_bits_or_without_the_backend_is_an_error():
    result = reconstructed()
    result._requested = "vulkan:9"
    other = pickled(result)
    with pytest.raises(RuntimeError, match="vulkan"):
        other.pullback(other.sdf)
    state = result.__getstate__() | {"_requested": "cpu", "_checksum": "0"}
    other = object.__new__(isograd.Reconstruction)
    other.__dict__.update(state)
    with pytest.raises(RuntimeError, match="'cpu' of this machine gives other bits than 'cpu'"):
        other.neighbors
    assert other.sdf.shape == GRID.shape


def test_extensions_keep_their_arrays():
    result = reconstructed()
    extension = result.extend("x", 3 * GRID.spacing)
    other = pickled(extension)
    assert bits(other.dense()) == bits(extension.dense()) and bits(other.vertices) == bits(extension.vertices)
    assert other.name == "x" and other.grid == GRID
    with pytest.raises(RuntimeError, match="this extension was unpickled"):
        result.pullback(extensions=[(other, None, np.ones_like(other.values))])
    bars = [(e, None, np.ones_like(e.values)) for e in (extension, copy.deepcopy(extension))]
    gradients = [result.pullback(extensions=[bar]).points for bar in bars]
    assert bits(gradients[0]) == bits(gradients[1])


@pytest.mark.parametrize("duplicate", COPIES)
def test_a_plan_is_made_again(duplicate):
    plan = isograd.Reconstructor(GRID, level="mean", checks=False)
    other = duplicate(plan)
    assert (other.grid, other.options, other.backend) == (plan.grid, plan.options, plan.backend)
    assert bits(other(POINTS).sdf) == bits(plan(POINTS).sdf)


def test_results_come_from_other_processes():
    context = multiprocessing.get_context("spawn")
    plan = isograd.Reconstructor(GRID, checks=False)
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        result = pool.submit(plan, POINTS).result()
    expected = plan(POINTS)
    assert bits(result.sdf) == bits(expected.sdf)
    assert bits(result.pullback(result.sdf).points) == bits(expected.pullback(expected.sdf).points)
