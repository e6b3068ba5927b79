import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, UnsupportedFormatError, VolumeError
from tests.volume.reading import counting, read

tifffile = pytest.importorskip("tifffile")

VALUES = counting((6, 16, 20), "<u2")


@pytest.mark.parametrize("options", [{}, {"compression": "zlib"}, {"bigtiff": True}, {"byteorder": ">"}])
@pytest.mark.parametrize("dtype", ["u1", "u2", "i2", "f4"])
def test_pages_are_slices(tmp_path, options, dtype):
    values = VALUES.astype(dtype)
    tifffile.imwrite(tmp_path / "a.tif", values, photometric="minisblack", **options)
    volume = read(tmp_path / "a.tif", spacing=(1, 2, 3))
    np.testing.assert_array_equal(volume.values, values)
    assert volume.values.dtype == np.dtype(dtype)
    assert volume.spacing == (1, 2, 3)
    assert volume.space == "none"


def test_spacing_of_imagej(tmp_path):
    tifffile.imwrite(
        tmp_path / "a.tif",
        VALUES,
        imagej=True,
        resolution=(1 / 0.25, 1 / 0.5),
        metadata={"spacing": 2.0, "unit": "um", "axes": "ZYX"},
    )
    np.testing.assert_allclose(read(tmp_path / "a.tif").spacing, (0.00025, 0.0005, 0.002))


def test_spacing_of_ome(tmp_path):
    metadata = {"axes": "ZYX", "PhysicalSizeX": 0.5, "PhysicalSizeY": 0.25, "PhysicalSizeZ": 3}
    metadata |= {"PhysicalSizeZUnit": "mm", "PhysicalSizeXUnit": "mm"}
    tifffile.imwrite(tmp_path / "a.ome.tif", VALUES, metadata=metadata)
    np.testing.assert_allclose(read(tmp_path / "a.ome.tif").spacing, (0.5, 0.00025, 3))


def test_without_spacing_there_is_a_warning(tmp_path):
    tifffile.imwrite(tmp_path / "a.tif", VALUES, photometric="minisblack")
    assert "--spacing" in read(tmp_path / "a.tif").warnings[0]


def test_a_folder_of_slices_in_the_order_of_their_numbers(tmp_path):
    for k, plane in enumerate(VALUES):
        tifffile.imwrite(tmp_path / f"s{k + 7}.tif", plane)
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values, VALUES)
    assert volume.files[3].name == "s10.tif"


def test_several_volumes_are_chosen_by_index(tmp_path):
    values = counting((2, 6, 16, 20), "<u2")
    tifffile.imwrite(tmp_path / "a.tif", values, imagej=True, metadata={"axes": "TZYX", "spacing": 1})
    with pytest.raises(AmbiguousVolumeError, match="--volume-index"):
        read(tmp_path / "a.tif")
    np.testing.assert_array_equal(read(tmp_path / "a.tif", volume_index=1).values, values[1])


def test_single_and_colour_images_are_refused(tmp_path):
    tifffile.imwrite(tmp_path / "one.tif", VALUES[0])
    tifffile.imwrite(tmp_path / "rgb.tif", np.zeros((16, 20, 3), "u1"), photometric="rgb")
    for name in ("one.tif", "rgb.tif"):
        with pytest.raises(UnsupportedFormatError, match="stack of grey slices"):
            read(tmp_path / name)


@pytest.mark.parametrize("kept", [4, 100, 3000])
def test_truncated_files_are_refused(tmp_path, kept):
    tifffile.imwrite(tmp_path / "a.tif", VALUES, photometric="minisblack", compression="zlib")
    (tmp_path / "a.tif").write_bytes((tmp_path / "a.tif").read_bytes()[:kept])
    with pytest.raises(VolumeError) as caught:
        read(tmp_path / "a.tif")
    assert caught.value.exit_status == 3


def test_slices_of_different_sizes_are_refused(tmp_path):
    for k in range(3):
        tifffile.imwrite(tmp_path / f"{k}.tif", VALUES[k][: 16 - k])
    with pytest.raises(DamagedVolumeError, match=r"1\.tif: .*as in 0\.tif"):
        read(tmp_path)
