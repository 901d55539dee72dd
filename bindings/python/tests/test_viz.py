"""isograd.viz, drawn without a screen: what is in the picture is what was asked for."""

import numpy as np
import pytest

from isograd import Grid, Mesh, viz

RADIUS = 0.5
GRID = Grid(lower=(-0.8, -0.8, -0.8), spacing=0.1, shape=(16, 17, 18))
TETRAHEDRON = Mesh(
    vertices=np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    faces=np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
)


def sphere():
    return np.linalg.norm(GRID.centers(), axis=-1) - RADIUS


@pytest.fixture
def pyplot():
    matplotlib = pytest.importorskip("matplotlib", reason="matplotlib is not here: no slices are drawn")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    yield pyplot
    pyplot.close("all")


def test_each_slice_shows_the_field_in_colors_symmetric_about_zero(pyplot):
    phi = sphere()
    figure = viz.slices(phi, GRID)
    panels = figure.axes[:3]
    expected = [phi[8], phi[:, 8], phi[:, :, 9]]
    largest = max(np.abs(plane).max() for plane in expected)
    for panel, plane, names in zip(panels, expected, ["yz", "xz", "xy"]):
        (image,) = panel.get_images()
        assert np.array_equal(image.get_array(), plane.T)
        assert image.get_clim() == (-largest, largest)
        assert panel.get_xlabel() + panel.get_ylabel() == names
        low, high = (["xyz".index(name) for name in names], GRID.upper)
        left, right, bottom, top = image.get_extent()
        assert (left, bottom) == tuple(GRID.lower[axis] for axis in low)
        assert (right, top) == tuple(high[axis] for axis in low)


def test_the_line_on_a_slice_is_the_surface(pyplot):
    figure = viz.slices(sphere(), GRID, at=(0.0, 0.0, 0.0))
    for panel in figure.axes[:3]:
        (contour,) = [child for child in panel.collections if len(child.get_paths())]
        line = contour.get_paths()[0].vertices
        # The slice passes half a cell from the center at most; linear between cells.
        radius = np.linalg.norm(line, axis=1)
        assert len(line) > 20
        assert np.abs(radius - RADIUS).max() < 0.02


def test_slices_pass_through_the_place_that_is_asked_for(pyplot):
    phi = sphere()
    figure = viz.slices(phi, GRID, at=(-0.8, 0.05, 1.0), limit=0.25, title="a sphere")
    shown = [panel.get_images()[0] for panel in figure.axes[:3]]
    # The first and the last cell take the borders of the grid.
    for image, plane in zip(shown, [phi[0], phi[:, 8], phi[:, :, 17]]):
        assert np.array_equal(image.get_array(), plane.T)
        assert image.get_clim() == (-0.25, 0.25)
    assert figure.get_suptitle() == "a sphere"


def test_only_points_near_a_slice_are_drawn_on_it(pyplot):
    points = np.array([[0.05, 0.3, 0.2], [0.7, 0.0, 0.0]])
    figure = viz.slices(sphere(), GRID, at=(0.05, 0.05, 0.05), points=points)
    (dots,) = [line for line in figure.axes[0].lines if line.get_marker() == "."]
    assert dots.get_xydata().tolist() == [[0.3, 0.2]]


@pytest.mark.parametrize("value", [0.0, 3.0, np.nan, np.inf])
def test_a_field_without_a_surface_is_drawn_as_well(pyplot, tmp_path, value):
    figure = viz.slices(np.full(GRID.shape, value, dtype=np.float32), GRID)
    figure.savefig(tmp_path / "slices.png")
    assert (tmp_path / "slices.png").stat().st_size > 1000


def test_slices_of_what_does_not_fit_are_refused(pyplot):
    with pytest.raises(ValueError, match=r"phi has the shape .* and must have \(16, 17, 18\)"):
        viz.slices(sphere()[1:], GRID)
    with pytest.raises(TypeError, match="grid is a tuple"):
        viz.slices(sphere(), (16, 17, 18))
    with pytest.raises(ValueError, match="outside the grid"):
        viz.slices(sphere(), GRID, at=(0, 0, 9))
    with pytest.raises(ValueError, match="limit is 0"):
        viz.slices(sphere(), GRID, limit=0)


def test_a_scene_shows_the_surface_and_its_points(pyvista):
    points = TETRAHEDRON.vertices
    plotter = viz.scene(TETRAHEDRON, points, normals=points + 1.0, off_screen=True)
    try:
        left, right, *_ = plotter.bounds
        assert left <= 0.0 and right >= 1.0
        drawn = [actor for actor in plotter.actors.values() if isinstance(actor, pyvista.Actor)]
        assert len(drawn) == 3
        assert all(actor.mapper.dataset.n_points > 0 for actor in drawn)
        picture = plotter.screenshot(return_img=True)
        assert picture.ndim == 3 and picture.std() > 1
    finally:
        plotter.close()


def test_values_at_the_vertices_are_the_colors(pyvista):
    values = np.arange(4.0)
    plotter = viz.scene(TETRAHEDRON, values=values, label="height", opacity=0.5, off_screen=True)
    try:
        assert plotter.mesh.active_scalars_name == "height"
        assert sorted(set(plotter.mesh["height"])) == values.tolist()
        assert "height" in plotter.scalar_bars
    finally:
        plotter.close()


def test_a_scene_of_what_can_t_be_drawn_is_refused(pyvista):
    vertices, faces = TETRAHEDRON.vertices, TETRAHEDRON.faces
    with pytest.raises(ValueError, match="no faces"):
        viz.scene((vertices, faces[:0]))
    with pytest.raises(ValueError, match="face 1 names vertex 3, but there are only 3"):
        viz.scene((vertices[:3], faces))
    with pytest.raises(ValueError, match="not finite"):
        viz.scene((vertices * np.nan, faces))
    with pytest.raises(ValueError, match="normals need points"):
        viz.scene(TETRAHEDRON, normals=vertices)
    with pytest.raises(ValueError, match="opacity is 2"):
        viz.scene(TETRAHEDRON, opacity=2)
    with pytest.raises(ValueError, match=r"values has the shape \(3,\)"):
        viz.scene(TETRAHEDRON, values=[1.0, 2.0, 3.0])
