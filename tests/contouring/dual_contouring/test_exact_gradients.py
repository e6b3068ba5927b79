"""Exact crossings and normals (Hermite data) keep sharp edges; what a program's functions may return."""

import numpy as np
import pytest

from dmc_cli.contouring import extract_surface
from dmc_cli.contouring.dual_contouring.hermite_data import hermite_data
from dmc_cli.contouring.dual_grid import CellContext
from dmc_cli.errors import CallError, SettingsError
from dmc_cli.field import upload_volume
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import ReadSettings, SurfaceSettings
from dmc_cli.volume.volume import Volume
from dmc_cli.volume_io.read import read_volume
from dmc_cli.volume_io.sharp_fields import HALF, HOLE, TURN, box, box_gradient, holed_box
from tests.fields import volume_of
from tests.oracle.cube import CORNERS, EDGES
from tests.oracle.dual import cell_crossings
from tests.oracle.grid import cut_grid

NODES = 64
STEP = 2 / (NODES - 1)


def index_positions(surface):
    """The vertices in node indices of the volume, float64."""
    grid = surface.placement.frame.grid
    index = np.stack(grid.lowest_nodes(surface.placement.cell.numpy()), axis=1) - grid.border
    return index + surface.placement.local.numpy().astype(np.float64)


def distances_to_edges(points):
    """The distance of points to the box's nearest edge, in cells."""
    own, found = np.abs(points @ TURN), []
    for k in range(3):
        a, b = (other for other in range(3) if other != k)
        beyond = np.maximum(own[:, k] - HALF[k], 0.0)
        found.append(np.sqrt((own[:, a] - HALF[a]) ** 2 + (own[:, b] - HALF[b]) ** 2 + beyond**2))
    return np.min(found, axis=0) / STEP


def feature_cells(extract):
    """Cells whose crossings lie on several faces of the box: those that the full solution tells apart."""
    volume = read_volume(f"synth:box:{NODES}", ReadSettings())
    surface = extract(volume, method="dc")
    cells = surface.placement.cell.numpy()
    points = cell_crossings(cut_grid(volume, SurfaceSettings(isovalue=0.0, method="dc")), cells)
    axes = [int(np.flatnonzero(np.subtract(CORNERS[a], CORNERS[b]))[0]) for a, b in EDGES]
    linear = np.stack([points[:, edge, axis] for edge, axis in enumerate(axes)], axis=1)
    frame, device = surface.placement.frame, select_device("cpu")
    context = CellContext(frame.field, frame.grid, None, device, upload_volume(volume, device), None)
    found = hermite_data(cells, np.where(np.isnan(linear), -1.0, linear), context)
    normals = np.where(found.crossings[..., None] >= 0, found.normals, np.nan)
    return (np.nanmax(normals, axis=1) - np.nanmin(normals, axis=1)).max(axis=1) > 1e-6


FIGURES = [
    ({"method": "nets"}, 0.446, 0.708),
    ({"method": "dc", "gradients": "exact", "placement": "paper"}, 0.167, 0.690),
    ({"method": "dc", "gradients": "exact"}, 0.036, 0.220),
    ({"method": "dc", "gradients": "exact", "placement": "particle", "steps": 10}, 0.215, 0.425),
    ({"method": "dc", "gradients": "exact", "placement": "particle", "steps": 20}, 0.123, None),
    ({"method": "dc", "gradients": "exact", "placement": "particle", "steps": 50}, 0.045, None),
    ({"method": "dc", "gradients": "exact", "placement": "particle", "steps": 100}, 0.027, None),
    ({"method": "dc", "gradients": "exact", "placement": "particle", "steps": 300}, 0.021, None),
    ({"method": "dc", "placement": "paper"}, 0.459, None),
    ({"method": "dc"}, 0.202, None),
    ({"method": "dc", "placement": "particle", "steps": 10}, 0.334, None),
    ({"method": "dc", "placement": "particle", "steps": 50}, 0.225, None),
]
"""Mean distance of the vertices of feature cells from the box's edges, and what 95 % are below, in cells.

Of another box, turned otherwise, by an independent implementation.
"""


def test_sharp_edges_of_a_turned_box(extract):
    volume = read_volume(f"synth:box:{NODES}", ReadSettings())
    is_feature = feature_cells(extract)
    assert 400 < is_feature.sum() < 650
    for chosen, mean, most in FIGURES:
        points = -1.0 + STEP * index_positions(extract(volume, threads=2, **chosen))
        found = distances_to_edges(points[is_feature])
        assert found.mean() == pytest.approx(mean, rel=0.15), chosen
        assert most is None or np.quantile(found, 0.95) == pytest.approx(most, rel=0.1), chosen


def test_vertices_that_are_not_drawn_in_lie_on_the_box(extract):
    volume = read_volume(f"synth:box:{NODES}", ReadSettings())
    surface = extract(volume, method="dc", gradients="exact")
    local = surface.placement.local.numpy()
    is_free = ((local > 0) & (local < 1)).all(axis=1)
    points = -1.0 + STEP * index_positions(surface)[is_free]
    assert is_free.mean() > 0.9
    off = np.abs(box(*points.T)) / STEP
    assert off.max() < 1e-6
    corners = np.array(np.meshgrid(*[(-h, h) for h in HALF])).reshape(3, -1).T @ TURN.T
    nearest = np.linalg.norm(corners[:, None] - points, axis=2).min(axis=1) / STEP
    assert nearest.min() < 1e-6  # two corners of the box have a cell that sees all three faces


def test_the_round_edges_of_a_hole(extract):
    volume = read_volume(f"synth:csg:{NODES}", ReadSettings())
    rim = np.linspace(0, 2 * np.pi, 4000)
    circle = np.stack([HOLE * np.cos(rim), HOLE * np.sin(rim), np.full_like(rim, HALF[2])], axis=1) @ TURN.T

    def distance(**chosen):
        points = -1.0 + STEP * index_positions(extract(volume, threads=2, **chosen))
        return np.array([np.linalg.norm(points - p, axis=1).min() for p in circle[::40]]).mean() / STEP

    exact, differences, nets = (
        distance(method="dc", gradients="exact"),
        distance(method="dc"),
        distance(method="nets"),
    )
    assert exact < 0.6 * nets
    assert exact < differences
    points = -1.0 + STEP * index_positions(extract(volume, method="dc", gradients="exact"))
    assert np.quantile(np.abs(holed_box(*points.T)), 0.95) / STEP < 0.05


@pytest.mark.parametrize("placement", ["qef", "paper", "particle"])
def test_a_smooth_field_gets_nearer_to_itself(extract, placement):
    volume = read_volume("synth:genus_two:48", ReadSettings())
    chosen = {"method": "dc", "placement": placement}
    exact, plain = (extract(volume, gradients=gradients, **chosen) for gradients in ("exact", "differences"))
    off = []
    for surface in (exact, plain):
        points = -1.0 + 2 / 47 * index_positions(surface)
        off.append(np.abs(volume.formula(points)).mean())
    assert off[0] < off[1]
    np.testing.assert_array_equal(exact.mesh.faces.numpy(), plain.mesh.faces.numpy())


def ball(**changes):
    """A ball of radius 3.3 about the middle of 9 nodes an axis, its values and gradient known."""
    affine = np.array([[0.5, 0.1, 0, -3], [0, -2, 0, 4], [0.2, 0, 1.25, 7], [0, 0, 0, 1.0]])
    middle = affine @ [4, 4, 4, 1]

    def formula(points):
        return 3.3 - np.linalg.norm((points - middle[:3]) / (0.5, 2.0, 1.25), axis=1)

    def gradient(points):
        outwards = (points - middle[:3]) / np.square((0.5, 2.0, 1.25))
        return -outwards / np.linalg.norm(outwards, axis=1, keepdims=True)

    k, j, i = np.indices((9, 9, 9))
    nodes = np.stack([i, j, k, np.ones_like(i)], axis=-1) @ affine.T
    values = formula(nodes[..., :3].reshape(-1, 3)).reshape(9, 9, 9)
    given = {"affine": affine, "formula": formula, "gradient": gradient, **changes}
    return Volume(values=values.astype(np.float32), space="none", **given)


def test_a_programs_function_is_asked_in_millimetres(extract):
    affine = ball().affine
    middle = (affine @ [4, 4, 4, 1])[:3]
    faces = np.array([[0.9, 0.1, 0.2], [-0.6, 0.2, 0.5]])

    def roof(points):
        return ((points - middle) @ faces.T).min(axis=1)

    def gradient(points):
        return faces[((points - middle) @ faces.T).argmin(axis=1)]

    k, j, i = np.indices((9, 9, 9))
    nodes = (np.stack([i, j, k, np.ones_like(i)], axis=-1) @ affine.T)[..., :3]
    values = roof(nodes.reshape(-1, 3)).reshape(9, 9, 9)
    volume = Volume(values=values, affine=affine, space="none", formula=roof, gradient=gradient)
    surface = extract(volume, method="dc", gradients="exact")
    local = surface.placement.local.numpy()
    is_free = ((local > 0) & (local < 1)).all(axis=1)
    points = surface.mesh.positions.numpy().astype(np.float64)[is_free]
    assert len(points) > 50
    assert np.abs(roof(points)).max() < 1e-5
    assert np.abs(roof(extract(volume, method="dc").mesh.positions.numpy().astype(np.float64))).max() > 0.01


def test_without_a_formula_crossings_are_those_of_the_values(extract):
    linear = ball(formula=None)
    surface = extract(linear, method="dc", gradients="exact", placement="particle", steps=0)
    mean = extract(linear, method="nets")
    np.testing.assert_allclose(surface.placement.local.numpy(), mean.placement.local.numpy(), atol=2e-6)


def test_uneven_slices_are_where_the_function_is_asked(extract):
    depths = np.array([0.0, 0.7, 1.5, 2.0, 3.1, 4.0, 4.4, 5.6])

    def gradient(points):
        return np.tile([0.3, 0.2, -1.0], (len(points), 1))

    def formula(points):
        return points @ [0.3, 0.2, -1.0] + 1.9

    k = depths[:, None, None] * 1.0
    values = (0.3 * np.arange(7) + 0.2 * np.arange(6)[:, None] - k + 1.9).astype(np.float64)
    volume = Volume(
        values=values,
        affine=np.eye(4),
        space="none",
        slice_positions=depths,
        gradient=gradient,
        formula=formula,
    )
    points = extract(volume, method="dc", gradients="exact").mesh.positions.numpy().astype(np.float64)
    assert len(points) > 5
    assert np.abs(formula(points)).max() < 1e-5


@pytest.mark.parametrize("inside", ["above", "below"])
def test_caps_of_a_closed_border_stay_flat(extract, inside):
    values = read_volume("synth:box:12", ReadSettings())
    flipped = volume_of(values.values, affine=values.affine)
    half = Volume(
        values=flipped.values[:, :, :6],
        affine=values.affine,
        space="none",
        gradient=box_gradient,
        formula=lambda points: box(*points.T),
    )
    surface = extract(half, method="dc", gradients="exact", border="closed", inside=inside)
    x = index_positions(surface)[:, 0]
    assert np.isclose(x.max(), 5.5, atol=1e-6)
    assert ((surface.placement.local.numpy() >= 0) & (surface.placement.local.numpy() <= 1)).all()


def test_a_volume_without_a_gradient_is_refused(extract, run, tmp_path):
    with pytest.raises(SettingsError, match="gradients is 'exact', but the volume holds values alone"):
        extract(volume_of(ball().values), method="dc", gradients="exact")
    words = ("-i", 0, "--method", "dc", "--gradients", "exact")
    result = run("convert", "synth:noise:8", tmp_path / "a.ply", *words)
    assert result.exit_code == 2
    assert "synth:noise:8 holds values alone; expected a synthetic field other than noise" in result.stderr
    assert list(tmp_path.iterdir()) == []
    assert run("convert", "synth:csg:12", tmp_path / "a.ply", *words, "--check").exit_code == 0


@pytest.mark.parametrize(
    ("returned", "found"),
    [
        (lambda points: points[:, 0], r"gradient returned float64 of shape \([0-9]+,\)"),
        (lambda points: points.astype(str), "gradient returned <U"),
        (lambda points: None, "gradient returned object of shape"),
    ],
)
def test_a_function_that_returns_no_gradients_is_named(extract, returned, found):
    with pytest.raises(CallError, match=found):
        extract(ball(gradient=returned), method="dc", gradients="exact")


def test_normals_that_are_no_numbers_count_for_nothing(extract):
    volume = ball(gradient=lambda points: np.full(points.shape, np.nan), formula=None)
    surface = extract(volume, method="dc", gradients="exact")
    mean = extract(volume, method="nets")
    np.testing.assert_allclose(surface.placement.local.numpy(), mean.placement.local.numpy(), atol=2e-6)


@pytest.mark.parametrize("threads", [2, 3])
def test_the_same_bytes_on_any_number_of_threads(threads):
    uploaded = [upload_volume(ball(), select_device("cpu", n)) for n in (1, threads)]
    chosen = SurfaceSettings(isovalue=0.0, method="dc", gradients="exact")
    one, several = (extract_surface(volume, chosen).mesh.positions.numpy() for volume in uploaded)
    assert one.tobytes() == several.tobytes()
