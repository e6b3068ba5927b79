"""Units of OME-Zarr: each name of the specification, and what is told of others."""

import json

import numpy as np
import pytest

from dmc_cli.errors import UnsupportedFormatError
from tests.cases import case
from tests.volume_io.reading import counting, read

VALUES = counting((3, 4, 5), "<i2")

CASES = {
    "picometer": 1e-9, "angstrom": 1e-7, "nanometer": 1e-6, "micrometer": 1e-3, "millimeter": 1,
    "centimeter": 10, "inch": 25.4, "nounit": 1,
}  # fmt: skip
"""The stores of shared/cases/zarr_units, with the length of their unit in mm (from the list of OME-Zarr)."""


def store(folder, units, steps=({"type": "scale", "scale": [3.0, 2.0, 0.5]},)):
    """Write VALUES with units along z, y, x, None for an axis without one."""
    pytest.importorskip("numcodecs")
    path = folder / "a.zarr"
    (path / "0").mkdir(parents=True)
    array = {"zarr_format": 2, "shape": [3, 4, 5], "chunks": [3, 4, 5], "dtype": "<i2", "fill_value": 0}
    array |= {"compressor": None, "order": "C", "filters": None}
    axes = [
        {"name": name, "type": "space"} | ({} if unit is None else {"unit": unit})
        for name, unit in zip("zyx", units, strict=True)
    ]
    image = {"axes": axes, "datasets": [{"path": "0", "coordinateTransformations": list(steps)}]}
    (path / ".zgroup").write_text('{"zarr_format": 2}')
    (path / ".zattrs").write_text(json.dumps({"multiscales": [image]}))
    (path / "0/.zarray").write_text(json.dumps(array))
    (path / "0/0.0.0").write_bytes(VALUES.tobytes())
    return path


@pytest.mark.parametrize("unit", CASES)
def test_the_units_of_the_cases(unit):
    pytest.importorskip("numcodecs")
    volume = read(case(f"zarr_units/{unit}.zarr"))
    np.testing.assert_allclose(volume.spacing, np.array([4, 4, 8]) * CASES[unit], rtol=1e-12)
    assert [notice.is_about_meaning for notice in volume.warnings] == [True] * (unit == "nounit")


def test_a_case_in_nanometres_has_the_right_volume(tmp_path, run):
    pytest.importorskip("numcodecs")
    report = tmp_path / "r.json"
    path = case("zarr_units/nanometer.zarr")
    assert run("convert", path, tmp_path / "a.ply", "-i", 0, "--report", report).exit_code == 0
    # 1.37776e-13 mm3 by marching cubes; quads of so coarse a ball hold 1.4 % less
    assert json.loads(report.read_text())["mesh"]["volume"] == pytest.approx(1.37776e-13, rel=0.02)


@pytest.mark.parametrize(
    ("units", "spacing", "codes"),
    [
        (("nanometer",) * 3, (0.5e-6, 2e-6, 3e-6), []),
        (("inch", "foot", "angstrom"), (0.5e-7, 609.6, 76.2), []),
        ((None,) * 3, (0.5, 2, 3), ["W-UNIT-MISSING"]),
        ((None, "micrometer", "micrometer"), (0.0005, 0.002, 3), ["W-UNIT-MISSING"]),
        (("pixel",) * 3, (0.5, 2, 3), ["W-UNIT-UNKNOWN"]),
        (("ell", "micrometer", "micrometer"), (0.0005, 0.002, 3), ["W-UNIT-UNKNOWN"]),
    ],
)
def test_units_of_axes(tmp_path, units, spacing, codes):
    path = store(tmp_path, units)
    volume = read(path)
    np.testing.assert_allclose(volume.spacing, spacing, rtol=1e-12)
    assert [notice.code for notice in volume.warnings] == codes
    assert all("--spacing" in sentence for sentence in volume.sentences)
    given = read(path, spacing=(1, 2, 3))
    if codes:
        assert (given.spacing, given.warnings) == ((1, 2, 3), ())
    else:
        assert given.sentences == ("--spacing has no effect: the store tells its own",)


def test_where_units_are_missing_the_origin_goes_with_the_spacing(tmp_path):
    steps = [
        {"type": "scale", "scale": [3.0, 2.0, 0.5]},
        {"type": "translation", "translation": [30, 20, 10]},
    ]
    volume = read(store(tmp_path, (None,) * 3, steps), spacing=(0.05, 0.2, 0.3))
    np.testing.assert_allclose(volume.affine[:3, 3], (1, 2, 3))


def test_an_image_without_a_scale_is_told(tmp_path):
    volume = read(store(tmp_path, ("micrometer",) * 3, ()))
    np.testing.assert_allclose(volume.spacing, (0.001,) * 3)
    assert [notice.code for notice in volume.warnings] == ["W-SPACING-MISSING"]


def test_a_time_is_no_length(tmp_path):
    path = store(tmp_path, ("second", "micrometer", "micrometer"))
    with pytest.raises(UnsupportedFormatError, match=r"axis z of space found in 'second', a unit of time"):
        read(path)
