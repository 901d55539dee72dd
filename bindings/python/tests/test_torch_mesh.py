"""`query`, `mesh`, `extend`, `orient` and batches of `isograd.torch`: results and gradients are those of NumPy's functions."""

import functools

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="SKIPPED: PyTorch is not installed")

import isograd  # noqa: E402
import isograd.torch as it  # noqa: E402
from isograd import _torch_mesh  # noqa: E402

POINTS = torch.from_numpy(isograd.sample("torus", 600).points)
GRID = isograd.Grid.fit(POINTS, 20)
GIVEN = isograd.Options(radius=0.5, orient="given", checks=False)
NORMALS = torch.from_numpy(isograd.sample("torus", 600).normals)
RNG = np.random.default_rng(5)
QUERIES = torch.from_numpy(RNG.uniform(-0.6, 0.6, (50, 3)))
VALUES = torch.from_numpy(RNG.normal(size=(600, 2)))
CLOUDS = torch.stack([POINTS, 0.98 * POINTS, 1.01 * POINTS])


def of_numpy(points=POINTS, **how):
    return isograd.reconstruct(points.numpy(), GRID, **{"checks": False, **how})


def leaf(tensor):
    return tensor.detach().clone().requires_grad_()


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_queries_are_those_of_the_mesh(dtype):
    points, queries = leaf(POINTS.to(dtype)), leaf(QUERIES)
    result = of_numpy(POINTS.to(dtype))
    distance = it.query(points, GRID, queries)
    expected = isograd.signed_distance(result.mesh, QUERIES.numpy())
    assert distance.dtype == dtype and np.array_equal(distance.detach().numpy(), expected)
    distance.square().sum().backward()
    vertices_bar, queries_bar = isograd.query_pullback(result.mesh, QUERIES.numpy(), 2 * expected)
    points_bar = result.pullback(vertices=vertices_bar).points
    torch.testing.assert_close(points.grad, torch.from_numpy(points_bar))
    torch.testing.assert_close(queries.grad, torch.from_numpy(queries_bar).double())


def test_the_mesh_is_that_of_numpy_in_its_own_size_and_in_fixed_sizes():
    result = of_numpy()
    points = leaf(POINTS)
    mesh = it.mesh(points, GRID)
    counts = [len(result.mesh.vertices), len(result.mesh.faces)]
    assert [int(mesh.vertex_count), int(mesh.face_count)] == counts
    assert np.array_equal(mesh.vertices.detach().numpy(), result.mesh.vertices)
    assert mesh.faces.dtype == torch.int64 and np.array_equal(mesh.faces.numpy(), result.mesh.faces)
    bar = torch.from_numpy(RNG.normal(size=mesh.vertices.shape))
    (mesh.vertices * bar).sum().backward()
    assert np.array_equal(points.grad.numpy(), result.pullback(vertices=bar.numpy()).points)
    wide = it.mesh(POINTS, GRID, max_vertices=counts[0] + 9, max_faces=counts[1] + 9)
    assert torch.equal(wide.vertices[: counts[0]], mesh.vertices) and not wide.vertices[counts[0] :].any()
    assert torch.equal(wide.faces[: counts[1]], mesh.faces) and not wide.faces[counts[1] :].any()
    short = it.mesh(POINTS, GRID, max_vertices=7, max_faces=5)
    assert len(short.vertices) == 7 and len(short.faces) == 5
    assert [int(short.vertex_count), int(short.face_count)] == counts


def test_a_surface_that_is_larger_than_expected_is_whole():
    grid = isograd.Grid.fit(POINTS, 16, padding=0.05)
    mesh = it.mesh(POINTS, grid, options=isograd.Options(surface="16x"))
    result = isograd.reconstruct(POINTS, grid, surface="16x", checks=False)
    assert len(result.mesh.vertices) > 8 * sum(a * b for a, b in zip(grid.shape, grid.shape[1:] + grid.shape[:1]))
    assert np.array_equal(mesh.vertices.numpy(), result.mesh.vertices)
    assert np.array_equal(mesh.faces.numpy(), result.mesh.faces)


@pytest.mark.parametrize("fill", ["inside", "band"])
def test_extended_values_are_those_of_numpy(fill):
    result = of_numpy(attributes={"v": VALUES.numpy()})
    extension = result.extend("v", 3 * GRID.spacing, fill=fill)
    points, values = leaf(POINTS), leaf(VALUES)
    found = it.extend(points, values, GRID, fill=fill)
    assert np.array_equal(found.values.detach().numpy(), extension.dense())
    assert np.array_equal(found.sdf.detach().numpy(), result.sdf)
    bar = torch.from_numpy(RNG.normal(size=found.values.shape))
    ((found.values * bar).sum() + found.sdf.square().sum()).backward()
    rows = bar.numpy().reshape(-1, 2)[extension.cells]
    expected = result.pullback(2 * result.sdf, extensions=[(extension, None, rows)])
    torch.testing.assert_close(points.grad, torch.from_numpy(expected.points))
    torch.testing.assert_close(values.grad, torch.from_numpy(expected.attributes["v"]))
    scalar = it.extend(POINTS, VALUES[:, 0], GRID, fill=fill)
    assert torch.equal(scalar.values, found.values[..., 0])


def test_normals_keep_the_sides_of_the_step_before():
    found = it.orient(leaf(POINTS), NORMALS)
    expected = isograd.orient(POINTS, normals=NORMALS.numpy(), orient="signs").normals
    assert np.array_equal(found.numpy(), expected) and not found.requires_grad
    assert torch.equal(it.orient(POINTS, -NORMALS), -found)


def test_opcheck_passes_for_every_operator():
    points, normals, settings = leaf(POINTS), leaf(NORMALS), _torch_mesh.prepare(POINTS, GRID, NORMALS, GIVEN, "cpu")[2]
    for operator, other, sizes in (
        (_torch_mesh._query, leaf(QUERIES), []),
        (_torch_mesh._mesh, None, [900, 2000]),
        (_torch_mesh._extend, leaf(VALUES), []),
    ):
        torch.library.opcheck(operator, (points, other, normals, settings, 0.2, False, sizes))


CALLS = {
    "signed_distance": lambda points, **how: [it.signed_distance(points, GRID, **how)],
    "query": lambda points, **how: [it.query(points, GRID, QUERIES, **how)],
    "mesh": lambda points, **how: [it.mesh(points, GRID, max_vertices=900, max_faces=2000, **how).vertices],
    "surface": lambda points, **how: it.surface(points, GRID, **how)[:3],
    "surfaces": lambda points, **how: it.surface(points, GRID, ((1.0, 0.5, 0.5), (0.5, 0.5, 0.5)), **how)[0][:3],
}


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize("given", [False, True])
def test_a_batch_is_the_stack_of_its_clouds(name, given):
    how = {"normals": NORMALS, "options": GIVEN} if given else {}
    batch, alone = leaf(CLOUDS), leaf(CLOUDS)
    found = CALLS[name](batch, **how)
    expected = [torch.stack(parts) for parts in zip(*(CALLS[name](cloud, **how) for cloud in alone))]
    for one, other in zip(found, expected, strict=True):
        assert torch.equal(one, other)
    for results in (found, expected):
        sum(part.square().sum() for part in results).backward()
    assert torch.equal(batch.grad, alone.grad) and batch.grad.any()


@pytest.mark.parametrize("name", ["signed_distance", "query", "mesh", "extend"])
def test_a_batch_of_cotangents_is_pulled_back_one_by_one(name):
    points = leaf(POINTS)
    found = it.extend(points, VALUES, GRID).values if name == "extend" else CALLS[name](points)[0]
    bars = torch.stack([torch.ones_like(found), found.detach()])
    pull = functools.partial(torch.autograd.grad, found, points, retain_graph=True)
    alone = torch.stack([pull(bar)[0] for bar in bars])
    assert torch.equal(pull(bars, is_grads_batched=True)[0], alone) and alone.any()
    assert torch.equal(torch.vmap(lambda bar: pull(bar)[0])(bars), alone)


@pytest.mark.parametrize("name", CALLS)
def test_the_order_of_the_memory_does_not_matter(name):
    gradients = []
    for points in (POINTS, POINTS.t().contiguous().t()):
        points = leaf(points)
        sum(part.square().sum() for part in CALLS[name](points)).backward()
        gradients.append(points.grad)
    assert not points.is_contiguous() and torch.equal(*gradients)


def test_a_batch_has_values_queries_and_normals_of_its_own():
    values, queries, normals = torch.stack([VALUES] * 3), torch.stack([QUERIES] * 3), torch.stack([NORMALS] * 3)
    values[1] *= 2
    queries[2] += 0.1
    found = it.extend(CLOUDS, values, GRID, normals=normals, options=GIVEN)
    assert found.sdf.shape == (3, *GRID.shape) and found.values.shape == (3, *GRID.shape, 2)
    alone = it.extend(CLOUDS[1], values[1], GRID, normals=NORMALS, options=GIVEN)
    assert torch.equal(found.values[1], alone.values)
    distance = it.query(CLOUDS, GRID, queries)
    assert torch.equal(distance[2], it.query(CLOUDS[2], GRID, queries[2]))
    assert torch.equal(it.orient(CLOUDS, normals)[1], it.orient(CLOUDS[1], NORMALS))
    assert it.extend(CLOUDS, values[..., 0], GRID).values.shape == (3, *GRID.shape)


def test_a_compiled_loss_has_the_same_gradient():
    def loss(points):
        mesh = it.mesh(points, GRID, max_vertices=900, max_faces=2000)
        return it.query(2 * points / 2, GRID, QUERIES).square().sum() + mesh.vertices.square().sum()

    gradients = []
    for function in (loss, torch.compile(loss, backend="aot_eager", fullgraph=True)):
        points = leaf(POINTS)
        function(points).backward()
        gradients.append(points.grad)
    torch.testing.assert_close(*gradients)


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda: it.query(POINTS, GRID, QUERIES.numpy()), TypeError, "queries is a ndarray"),
        (lambda: it.query(POINTS, GRID, QUERIES[:, :2]), ValueError, r"queries has the shape \(50, 2\)"),
        (lambda: it.mesh(POINTS, GRID, max_faces=9), ValueError, "both max_vertices and max_faces"),
        (lambda: it.mesh(POINTS, GRID, max_vertices=0, max_faces=9), ValueError, "max_vertices is 0"),
        (lambda: it.mesh(POINTS, GRID, max_vertices=True, max_faces=9), ValueError, "max_vertices is True"),
        (lambda: it.mesh(CLOUDS, GRID), ValueError, "give max_vertices and max_faces"),
        (lambda: it.extend(POINTS, None, GRID), ValueError, "values is None"),
        (lambda: it.extend(POINTS, VALUES[:9], GRID), ValueError, "one row for each point"),
        (lambda: it.extend(POINTS, VALUES, GRID, band=-1), ValueError, "band is -1"),
        (lambda: it.extend(POINTS, VALUES, GRID, fill="all"), ValueError, "fill is 'all'"),
        (lambda: it.extend(CLOUDS, VALUES, GRID), ValueError, "values has the shape .* in a batch of 3 clouds"),
        (lambda: it.orient(POINTS, NORMALS[:9]), ValueError, "before has the shape"),
        (lambda: it.signed_distance(CLOUDS[:0], GRID), ValueError, "one cloud or more"),
        (lambda: it.signed_distance(CLOUDS, GRID, backend="cpu:3"), (ValueError, RuntimeError), "cpu:3"),
    ],
)
def test_bad_arguments_are_refused_with_a_reason(call, error, text):
    with pytest.raises(error, match=text):
        call()


def test_a_second_derivative_is_refused_not_zero():
    points = leaf(POINTS)
    distance = it.query(points, GRID, QUERIES)
    (first,) = torch.autograd.grad(distance.square().sum(), points, create_graph=True)
    with pytest.raises(RuntimeError, match="isograd.torch.query can be differentiated once"):
        first.sum().backward()
