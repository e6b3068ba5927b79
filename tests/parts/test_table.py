"""A table under a body is cut, and nothing of the body; where there is no table nothing changes."""

import json

import numpy as np
import pytest

from dmc_cli.field import upload_volume
from dmc_cli.parts import cut_table
from dmc_cli.runtime import select_device
from dmc_cli.volume import Volume

LEVEL = -300.0


def scene(gap):
    """Return a body with an ear on a curved table top with a bottom, its values and which nodes are which."""
    z, y, x = np.indices((40, 110, 120))
    body = ((x - 60) / 40) ** 2 + ((y - 45) / 28) ** 2 < 1
    body |= (abs(x - 60) < 3) & (abs(y - 14) < 8) & (abs(z - 20) < 4)
    table = (abs(y - (74 + gap + 0.002 * (x - 60) ** 2)) < 2) & (abs(x - 60) < 52) & ~body
    table |= (abs(y - 95) < 2) & (abs(x - 60) < 52)
    values = np.full(z.shape, -1000, np.int16)
    values[body], values[table] = 40, 200
    return values, body, table


def volume_of(values):
    return Volume(values=values, affine=np.diag([2.0, 2.0, 3.0, 1.0]), space="LPS")


@pytest.mark.parametrize(("gap", "left"), [(3, 0.0), (0, 0.1)])
def test_a_table_is_cut_and_the_body_stays(gap, left):
    values, _, table = scene(gap)
    found, told = cut_table(upload_volume(volume_of(values), select_device("cpu")), LEVEL)
    after = found.volume.values
    np.testing.assert_array_equal(after[~table], values[~table])
    assert (after[table] >= LEVEL).mean() <= left
    assert told["nodes"] == np.count_nonzero(after != values)
    assert told["volume"] == pytest.approx(12.0 * told["nodes"])


@pytest.mark.parametrize("drift", [0.0, 1.0])
def test_an_ear_that_touches_a_rail_stays(drift):
    """Slices that move against each other, as a tilted gantry's do, are followed along the scanner's axis."""
    z, y, x = np.indices((40, 150, 120))
    y = y - drift * z
    body = ((x - 55) / 40) ** 2 + ((y - 45) / 28) ** 2 < 1
    rail = (abs(x - 112) < 2) & (abs(y - 45) < 25)
    ear = (abs(y - 45) < 3) & (abs(z - 20) < 5) & (x > 90) & ~rail & ~body & (x < 112)
    values = np.where(body | rail | ear, 40, -1000).astype(np.int16)
    affine = np.diag([2.0, 2.0, 3.0, 1.0])
    affine[1, 2] = -2.0 * drift
    source = Volume(values=values, affine=affine, space="LPS")
    found, _ = cut_table(upload_volume(source, select_device("cpu")), LEVEL)
    after = found.volume.values >= LEVEL
    assert after[body].all()
    assert after[ear].mean() >= 0.9
    assert after[rail].mean() <= 0.05


def test_without_a_table_nothing_changes():
    values, _, table = scene(3)
    values[table] = -1000
    source = upload_volume(volume_of(values), select_device("cpu"))
    found, told = cut_table(source, LEVEL)
    assert found is source
    assert told == {"components": 0, "nodes": 0, "volume": 0.0}


def test_the_command_cuts_before_it_chooses_an_isovalue(run, tmp_path):
    values, body, _ = scene(3)
    np.save(tmp_path / "a.npy", values)
    words = ["convert", tmp_path / "a.npy", tmp_path / "a.ply", "--spacing", "2,2,3", "--border", "closed"]
    result = run(*words, "--cut-table", "-i", "otsu", "--report", tmp_path / "a.json")
    assert result.exit_code == 0, result.stderr
    report = json.loads((tmp_path / "a.json").read_text())
    assert report["topology"]["components"] == 1
    assert report["mesh"]["volume"] == pytest.approx(12.0 * body.sum(), rel=0.05)
    assert "part      table: 2 piece(s) cut" in result.stderr
