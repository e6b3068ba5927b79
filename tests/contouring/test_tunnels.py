"""Where the trilinear surface has tunnels that dual marching cubes closes, against ground truth."""

import numpy as np
import pytest

from dmc_cli.contouring.extraction import connect_faces, extract_surface, list_flips, list_tunnels
from dmc_cli.errors import SettingsError
from dmc_cli.field.field import upload_volume
from dmc_cli.measures.topology import measure_topology
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import SurfaceSettings
from tests.fields import volume_of, white_noise
from tests.oracle.faces import decide_faces
from tests.oracle.grid import cut_grid
from tests.reference import table


@pytest.fixture(scope="module")
def device():
    return select_device("cpu", 2)


def chosen(method, **more):
    return SurfaceSettings(isovalue=0.0, method=method, **more)


def random_values(row):
    n = int(row["n"])
    return np.random.default_rng(int(row["seed"])).uniform(-1, 1, (n, n, n)).astype(np.float32)


def test_the_cells_with_a_tunnel_are_those_of_the_reference(device):
    """All cells of the table in one volume, apart from each other: the list names those with a tunnel."""
    rows = table("mc33_cells.csv")
    across = 11
    values = np.full((4, 3 * across + 1, 3 * across + 1), -1.0)
    expected = []
    for n, row in enumerate(rows):
        i, j = 1 + 3 * (n % across), 1 + 3 * (n // across)
        values[1:3, j : j + 2, i : i + 2] = np.array([float(row[f"f{c}"]) for c in range(8)]).reshape(2, 2, 2)
        if row["tunnel"] == "1":
            expected.append([i, j, 1])
    assert len(expected) > 20
    starts = {(1 + 3 * (n % across), 1 + 3 * (n // across), 1) for n in range(len(rows))}
    for border in ("open", "closed"):
        found = list_tunnels(upload_volume(volume_of(values), device), chosen("tmc", border=border))
        assert {tuple(cell) for cell in found.tolist()} & starts == {tuple(cell) for cell in expected}


def test_random_volumes_have_as_many_tunnels_as_the_reference_says(device):
    for row in table("betti_random.csv"):
        values = random_values(row)
        if row["border"] == "closed":
            values = np.pad(values, 1, constant_values=-1)
        volume = upload_volume(volume_of(values), device)
        found = list_tunnels(volume, chosen("tmc"))
        assert len(found) == int(row["tunnel_cells"]), row
        assert len(np.unique(found, axis=0)) == len(found)


def test_what_dual_marching_cubes_closes_is_what_its_euler_characteristic_is_off(device):
    """On closed surfaces each closed tunnel, inside a cell or through two, adds 2: exact, row by row."""
    flipped = 0
    for row in table("betti_random.csv"):
        if row["border"] == "open":
            continue
        volume = upload_volume(volume_of(np.pad(random_values(row), 1, constant_values=-1)), device)
        surface = connect_faces(extract_surface(volume, chosen("dmc")))
        tunnels, flips = list_tunnels(volume, chosen("tmc")), list_flips(volume, chosen("dmc"))
        assert len(flips) == surface.counts.flipped_faces
        found = measure_topology(surface.mesh).euler_characteristic if surface.mesh.face_count else 0
        assert found == int(row["euler"]) + 2 * (len(tunnels) + len(flips)), row
        flipped += len(flips)
    assert flipped > 100


@pytest.mark.parametrize("border", ["open", "closed"])
def test_flipped_faces_are_ambiguous_ones_of_the_volume(device, border):
    volume, settings = white_noise(14), chosen("dmc", border=border)
    flips = list_flips(upload_volume(volume, device), settings)
    grid = cut_grid(volume, settings)
    layer = int(border == "closed")
    ambiguous = decide_faces(grid)
    assert len(flips) > 100
    assert len(np.unique(flips, axis=0)) == len(flips)
    for i, j, k, axis in flips.tolist():
        lowest = np.array([i, j, k]) + layer
        lowest[axis] += 1
        assert (axis, *lowest.tolist()) in ambiguous


def test_a_method_that_leaves_faces_as_they_are_flips_none(device):
    volume = upload_volume(white_noise(8), device)
    for method in ("mc", "tmc", "nets"):
        assert list_flips(volume, chosen(method)).shape == (0, 4)
    assert list_flips(volume, chosen("dmc", topology="asymptotic")).shape == (0, 4)
    with pytest.raises(SettingsError, match="expected one that does: tmc"):
        list_tunnels(volume, chosen("mc"))


def test_without_special_cells_nothing_is_listed(device):
    volume = upload_volume(volume_of(np.linspace(-1, 1, 27).reshape(3, 3, 3)), device)
    assert list_tunnels(volume, chosen("tmc")).shape == (0, 3)
    assert list_flips(volume, chosen("dmc")).shape == (0, 4)
