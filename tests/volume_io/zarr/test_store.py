import zipfile

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.reading import counting, read

zarr = pytest.importorskip("zarr", minversion="3")

VALUES = counting((6, 16, 20), "<u2")


def write(path, values, version=3):
    array = zarr.create_array(
        path, shape=values.shape, chunks=(4,) * values.ndim, dtype=values.dtype, zarr_format=version
    )
    array[...] = values
    return path


@pytest.mark.parametrize("version", [2, 3])
def test_an_array_in_both_versions_of_the_format(tmp_path, version):
    volume = read(write(tmp_path / "a.zarr", VALUES, version), spacing=(1, 2, 3))
    np.testing.assert_array_equal(volume.values, VALUES)
    assert volume.spacing == (1, 2, 3)


def ome(path, values, version=3):
    group = zarr.open_group(path, mode="w", zarr_format=version)
    for level, step in enumerate((1, 2)):
        write(path / str(level), values[..., ::step, ::step, ::step], version)
    names = "tczyx"[-values.ndim :]
    axes = [{"name": n, "type": "space", "unit": "micrometer"} if n in "zyx" else {"name": n} for n in names]
    scale = [1.0] * (values.ndim - 3) + [3.0, 2.0, 0.5]
    shift = [0.0] * (values.ndim - 3) + [30.0, 20.0, 10.0]
    datasets = [
        {
            "path": str(level),
            "coordinateTransformations": [
                {"type": "scale", "scale": [s * 2**level for s in scale]},
                {"type": "translation", "translation": shift},
            ],
        }
        for level in (0, 1)
    ]
    multiscales = [{"axes": axes, "datasets": datasets, "version": "0.5"}]
    group.attrs.update(
        {"ome": {"multiscales": multiscales}} if version == 3 else {"multiscales": multiscales}
    )
    return path


@pytest.mark.parametrize("version", [2, 3])
def test_the_finest_level_of_an_ome_image_with_its_scale(tmp_path, version):
    volume = read(ome(tmp_path / "a.zarr", VALUES, version))
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.spacing, (0.0005, 0.002, 0.003))
    np.testing.assert_allclose(volume.affine[:3, 3], (0.01, 0.02, 0.03))


@pytest.mark.parametrize("version", [2, 3])
def test_a_coarse_level_is_read_by_its_path(tmp_path, version):
    path = ome(tmp_path / "a.zarr", VALUES, version)
    volume = read(path / "1")
    np.testing.assert_array_equal(volume.values, VALUES[::2, ::2, ::2])
    np.testing.assert_allclose(volume.spacing, (0.001, 0.004, 0.006))
    assert volume.warnings == ()
    assert read(path / "0").spacing == read(path).spacing


@pytest.mark.parametrize("folder", ["", "a.zarr/"])
@pytest.mark.parametrize("version", [2, 3])
def test_a_zipped_store_is_read(tmp_path, version, folder):
    store = ome(tmp_path / "a.zarr", VALUES, version)
    with zipfile.ZipFile(tmp_path / "a.ome.zarr.zip", "w") as archive:
        for path in store.rglob("*"):
            archive.write(path, folder + str(path.relative_to(store)))
    volume = read(tmp_path / "a.ome.zarr.zip")
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.spacing, (0.0005, 0.002, 0.003))


def test_channels_are_chosen_by_index(tmp_path):
    path = ome(tmp_path / "a.zarr", counting((1, 3, 6, 16, 20), "<u2"))
    with pytest.raises(AmbiguousVolumeError, match="3 volumes"):
        read(path)
    np.testing.assert_array_equal(read(path, volume_index=2).values, counting((1, 3, 6, 16, 20), "<u2")[0, 2])


def test_groups_without_an_image_and_broken_stores_are_refused(tmp_path):
    zarr.open_group(tmp_path / "group.zarr", mode="w")
    with pytest.raises(UnsupportedFormatError, match="without an OME image"):
        read(tmp_path / "group.zarr")
    path = write(tmp_path / "a.zarr", VALUES)
    (path / "zarr.json").write_text("{not json")
    with pytest.raises(VolumeError, match="cannot be read"):
        read(path)


def test_a_store_is_one_entry(tmp_path):
    (entry,) = list_volumes(str(write(tmp_path / "a.zarr", VALUES)), ReadSettings())
    assert entry.size == (20, 16, 6)
