"""What is kept stays where it was, what is dropped is gone, what is filled is closed; the report says so."""

import json

import numpy as np
import pytest
from scipy import ndimage

from dmc_cli.contouring import extract_surface
from dmc_cli.errors import EmptySurfaceError, SettingsError
from dmc_cli.field import upload_volume
from dmc_cli.methods import METHODS
from dmc_cli.parts import select_part
from dmc_cli.parts.flips import flip_nodes
from dmc_cli.runtime import select_device
from dmc_cli.settings import PartSettings, SurfaceSettings
from dmc_cli.volume import Volume


def volume_of(values, **given):
    return Volume(values=values, affine=np.eye(4), space="none", **given)


def smooth(seed, shape=(24, 26, 40), sigma=1.2):
    return ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=shape), sigma).astype(np.float32)


def selected(values, surface, **part):
    on_device = upload_volume(values, select_device("cpu"))
    volume, told = select_part(on_device, surface, PartSettings(**part))
    return volume, told


def crossings(values, isovalue):
    """Return the ends of crossed edges along each axis with the values at both."""
    found = set()
    for axis in range(3):
        low, high = (np.moveaxis(values, axis, 0)[part] for part in (slice(None, -1), slice(1, None)))
        crossed = (low >= isovalue) != (high >= isovalue)
        found |= {
            (axis, *place, float(a), float(b))
            for place, a, b in zip(np.argwhere(crossed).tolist(), low[crossed], high[crossed], strict=True)
        }
    return found


@pytest.mark.parametrize("inside", ["above", "below"])
def test_the_largest_component_stays_where_it_was_and_all_others_are_gone(inside):
    values = smooth(0)
    isovalue = float(np.quantile(values, 0.88 if inside == "above" else 0.12))
    surface = SurfaceSettings(isovalue=isovalue, inside=inside)
    volume, told = selected(volume_of(values), surface, keep="largest")
    found = volume.volume.values
    side = values >= isovalue if inside == "above" else values < isovalue
    labels, count = ndimage.label(side)
    largest = labels == 1 + np.argmax(np.bincount(labels.ravel())[1:])
    assert told["dropped"]["components"] == count - 1 > 3
    assert told["dropped"]["nodes"] == (side & ~largest).sum()
    np.testing.assert_array_equal(found >= isovalue if inside == "above" else found < isovalue, largest)
    np.testing.assert_array_equal(found[largest | ~side], values[largest | ~side])
    assert crossings(found, isovalue) <= crossings(values, isovalue)


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", "int32", "int64", "float32", "float64"])
@pytest.mark.parametrize("slope", [1.0, -0.5])
@pytest.mark.parametrize("isovalue", [50.0, 50.3])
def test_a_flipped_node_is_on_the_other_side_and_flipped_again_where_it_was(dtype, slope, isovalue):
    rng = np.random.default_rng(0)
    values = rng.integers(30, 71, (3, 4, 40)).astype(dtype)
    volume = volume_of(values, slope=slope, intercept=0.0 if slope > 0 else 75.0)
    chosen = rng.random(values.shape) < 0.4
    bits = np.zeros((12, 8), np.uint8)
    bits[:, :5] = np.packbits(chosen, axis=-1, bitorder="little").reshape(12, 5)
    changed = values.copy()
    assert flip_nodes(volume, changed, isovalue, bits.view(np.uint32)) == chosen.sum()
    inside = slope * values.astype(np.longdouble) + volume.intercept >= isovalue
    after = slope * changed.astype(np.longdouble) + volume.intercept >= isovalue
    np.testing.assert_array_equal(after, inside ^ chosen)
    np.testing.assert_array_equal(changed[~chosen], values[~chosen])


def test_values_at_the_ends_of_their_type_are_flipped():
    for dtype, cut in (("uint8", 10.0), ("int8", -100.0), ("uint16", 60000.0), ("int64", 7.0)):
        limits = np.iinfo(dtype)
        values = np.array([limits.min, limits.max] * 4, dtype).reshape(2, 2, 2)
        changed = values.copy()
        flip_nodes(volume_of(values), changed, cut, np.full((4, 1), 3, np.uint32))
        np.testing.assert_array_equal(changed >= cut, values < cut)


@pytest.mark.parametrize("method", METHODS)
def test_one_component_without_cavities_has_a_mesh_of_one_piece(method):
    values = smooth(5, (30, 30, 30), 0.9)
    surface = SurfaceSettings(isovalue=0.05, method=method, border="closed")
    volume, told = selected(volume_of(values), surface, keep="largest", fill_cavities="all")
    assert told["filled"]["components"] > 0
    from dmc_cli.measures import measure_topology
    from dmc_cli.mesh import connect

    mesh = extract_surface(volume, surface).mesh
    topology = measure_topology(connect(mesh))
    pieces = {"dmc": 1, "mc": 1, "tmc": 1, "macet": 1}.get(method)
    assert pieces is None or topology.components == pieces


def test_cavities_are_filled_up_to_a_volume_and_what_is_open_is_not():
    values = np.ones((12, 12, 40), np.uint8)
    values[3:5, 3:5, 3:5] = 0  # 8 nodes
    values[6:9, 6:9, 10:13] = 0  # 27 nodes
    values[0:3, 8, 20] = 0  # reaches the end
    surface = SurfaceSettings(isovalue=0.5)
    for limit, filled in (("all", 35), ("8", 8), ("7.9", 0)):
        volume, told = selected(volume_of(values), surface, fill_cavities=limit)
        assert told["filled"]["nodes"] == filled
        assert (volume.volume.values == 0).sum() == 38 - filled


def test_components_are_kept_by_number_and_by_volume():
    values = np.zeros((8, 8, 40), np.uint8)
    for n, at in enumerate((2, 8, 14, 20)):
        values[2:4, 2:4, at : at + n + 1] = 1
    surface = SurfaceSettings(isovalue=0.5)
    for part, left in (({"keep": 2}, 28), ({"min_volume": 8.0}, 36), ({"keep": "3", "min_volume": 12.5}, 16)):
        volume, told = selected(volume_of(values), surface, **part)
        assert volume.volume.values.sum() == left
        assert told["components"]["count"] == 4
        assert [one["nodes"] for one in told["components"]["listed"]] == [16, 12, 8, 4]
    with pytest.raises(EmptySurfaceError, match="the largest of 4 has 16 mm3; expected one of at least 17"):
        selected(volume_of(values), surface, min_volume=17.0)


@pytest.mark.parametrize(
    "given",
    [{"keep": "0"}, {"keep": "some"}, {"min_volume": 0.0}, {"fill_cavities": "-1"}, {"fill_cavities": "nan"}]
    + [
        {"crop": text}
        for text in ("1:2", "1:2,3:4,5", "a:b,:,:", "5:1,:,:", "-1:5,:,:", "0%:101%,:,:", "1.5:3,:,:")
    ],
)
def test_what_is_no_part_is_refused(given):
    with pytest.raises(SettingsError, match="expected"):
        PartSettings(**given)


def test_the_command_tells_what_it_dropped(run, tmp_path, sample_data):
    words = ["convert", sample_data / "dicom/head_ct", tmp_path / "a.ply", "-i", "bone", "--border", "closed"]
    words += ["--keep", "largest", "--fill-cavities", "--report", tmp_path / "a.json", "--require", "closed"]
    result = run(*words, "--check")
    assert result.exit_code == 0, result.stderr
    report = json.loads((tmp_path / "a.json").read_text())
    assert report["topology"]["components"] == 1
    assert report["part"]["components"]["count"] == 220
    assert report["settings"]["keep"] == "largest"
    assert "part      219 component(s) dropped" in result.stderr
    assert f"{report['part']['filled']['components']} cavities filled" in result.stderr


def test_components_are_listed_by_info_and_specks_told_by_convert(run, tmp_path):
    values = np.zeros((30, 30, 30), np.uint8)
    values[2:25, 2:25, 2:25] = 200
    values[27, 27, 27] = 200
    np.save(tmp_path / "a.npy", values)
    result = run("convert", tmp_path / "a.npy", tmp_path / "a.ply")
    assert "2 components, 1 of them specks under 12.2 mm³; --keep largest" in result.stderr
    (found,) = json.loads(run("info", tmp_path / "a.npy", "--components", "--json").stdout)["components"]
    assert (found["count"], found["specks"]) == (2, 1)
    assert found["listed"][1] == {"nodes": 1, "volume": 1.0, "bounds": [[27.0] * 3, [27.0] * 3]}
    assert "2 component(s) at or above 50" in run("info", tmp_path / "a.npy", "--components", "-i", 50).stdout


def test_a_run_at_a_number_looks_for_no_components(run, tmp_path, monkeypatch):
    from dmc_cli.app import conversion

    loaded = set()
    load = conversion.load_kernels
    monkeypatch.setattr(
        conversion,
        "load_kernels",
        lambda device, modules, progress: (
            loaded.update(module.__name__ for module in modules),
            load(device, modules, progress),
        ),
    )
    run("convert", "synth:torus:16", tmp_path / "a.ply", "-i", 0)
    assert not any("parts" in name for name in loaded)
    run("convert", "synth:torus:16", tmp_path / "b.ply", "-i", 0, "--keep", 1)
    assert any("parts" in name for name in loaded)
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()
