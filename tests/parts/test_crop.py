"""A box of nodes has the same mesh as there is in it of the whole."""

import json

import numpy as np
import pytest

from dmc_cli.errors import SettingsError
from dmc_cli.mesh_io import read_mesh
from dmc_cli.parts import crop_volume
from dmc_cli.volume import Volume


def volume_of(affine=None, **given):
    values = np.random.default_rng(0).random((11, 21, 41)).astype(np.float32)
    return Volume(values=values, affine=np.eye(4) if affine is None else affine, space="LPS", **given)


@pytest.mark.parametrize(
    ("crop", "kept"),
    [
        ("3:20,:,:", (slice(None), slice(None), slice(3, 21))),
        (":5,7:,2:8", (slice(2, 9), slice(7, None), slice(0, 6))),
        ("25%:75%,0%:50%,:", (slice(None), slice(0, 11), slice(10, 31))),
        ("3:4mm,2.5:9mm,-5:50mm", (slice(None), slice(3, 10), slice(3, 5))),
        ("3.2:6.7,:,1:9mm", (slice(1, 10), slice(None), slice(4, 7))),
    ],
)
def test_nodes_of_a_box_stay_where_they_were(crop, kept):
    source = volume_of()
    found = crop_volume(source, crop)
    np.testing.assert_array_equal(found.values, source.values[kept])
    starts = [part.indices(n)[0] for part, n in zip(reversed(kept), source.shape, strict=True)]
    np.testing.assert_allclose(found.affine[:3, 3], starts)


def test_a_box_in_mm_is_along_the_axes_of_the_space():
    turned = np.array([[0.0, -2.0, 0, 10], [2.0, 0, 0, -30], [0, 0, 1.5, 5], [0, 0, 0, 1]])
    found = crop_volume(volume_of(turned), "-20:0,-10:20,:mm")
    place = found.affine[:3, 3]
    assert found.shape == (16, 11, 11)
    np.testing.assert_allclose(place, [0.0, -10.0, 5.0])


def test_uneven_slices_stay_where_they_were():
    positions = np.cumsum([0.0, 1, 1, 2, 1, 1, 3, 1, 1, 1, 1])
    affine = np.diag([1.0, 1.0, positions[-1] / 10, 1.0])
    source = volume_of(affine, slice_positions=positions)
    found = crop_volume(source, ":,:,3:8")
    depths = found.affine[2, 3] + found.slice_positions / found.spacing[2] * found.affine[2, 2]
    np.testing.assert_allclose(depths, positions[3:9])


@pytest.mark.parametrize("crop", ["0:41,:,:", "50:60,:,:", "3:3,:,:", "100:200,:,:mm", "3.2:3.8mm,:,:"])
def test_a_box_without_a_cell_of_the_volume_is_refused_with_what_there_is(crop):
    with pytest.raises(SettingsError, match=r"it has the nodes 0:40,0:20,0:10, from 0:40, 0:20, 0:10 mm"):
        crop_volume(volume_of(), crop)


def test_bounds_in_mm_and_in_nodes_are_not_mixed():
    with pytest.raises(SettingsError, match="expected one kind"):
        crop_volume(volume_of(), "1:5mm,1:5,:")


def test_the_mesh_in_the_box_is_that_of_the_whole(run, tmp_path, sample_data):
    tooth = sample_data / "nrrd/tooth.nrrd"
    assert run("convert", tooth, tmp_path / "whole.ply", "-i", 700).exit_code == 0
    words = ["--crop", "20:80,:,30%:70%", "--report", tmp_path / "a.json"]
    assert run("convert", tooth, tmp_path / "part.ply", "-i", 700, *words).exit_code == 0
    whole, part = (read_mesh(str(tmp_path / name)).points for name in ("whole.ply", "part.ply"))
    low, high = np.array([22, 2, 50]), np.array([78, 91, 110])
    inner = [
        {tuple(p) for p in points[((points > low) & (points < high)).all(axis=1)]} for points in (whole, part)
    ]
    assert inner[0] == inner[1]
    assert len(inner[0]) > 1000
    report = json.loads((tmp_path / "a.json").read_text())
    assert report["part"]["crop"] == {"shape": [61, 94, 65], "origin": [20.0, 0.0, 48.0]}
    assert report["input"]["shape"] == [103, 94, 161]
