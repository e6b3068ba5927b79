"""Every refusal of a NRRD header, by a file made for it, beside the nearest file that is taken."""

import bz2
import gzip

import numpy as np
import pytest

from dmc_cli.errors import (
    DamagedVolumeError,
    UnsupportedFormatError,
    VolumeError,
)
from dmc_cli.volume_io import data_files, values
from dmc_cli.volume_io.layout import FROM_END
from tests.volume_io.reading import counting, read

VALUES = counting((4, 3, 2))
FIELDS = {"type": "short", "dimension": "3", "sizes": "2 3 4", "encoding": "raw", "endian": "little"}


def nrrd(folder, content=None, **fields):
    """Return a NRRD file of the fields; None leaves one out, a name's underscores are blanks."""
    named = {key.replace("_", " "): value for key, value in fields.items()}
    lines = [f"{key}: {value}" for key, value in (FIELDS | named).items() if value is not None]
    text = "\n".join(["NRRD0005", *lines]) + "\n\n"
    (folder / "a.nrrd").write_bytes(text.encode() + (VALUES.tobytes() if content is None else content))
    return folder / "a.nrrd"


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"type": None}, "has no field 'type'"),
        ({"dimension": None}, "has no field 'dimension'"),
        ({"sizes": None}, "has no field 'sizes'"),
        ({"encoding": None}, "has no field 'encoding'"),
        ({"type": "block"}, "type 'block' found; expected integers, float or double"),
        ({"endian": "middle"}, "endian 'middle' found; expected little or big"),
        ({"encoding": "zrl"}, "encoding 'zrl' found; expected one of raw"),
        ({"dimension": "4"}, "dimension 4 found, but 3 sizes"),
        ({"sizes": "2 0 4"}, "sizes '2 0 4' found; expected positive"),
        ({"sizes": "2 x 4"}, "sizes '2 x 4' found in the header; expected numbers"),
        ({"dimension": "17", "sizes": "1 " * 14 + "2 3 4"}, "expected positive numbers"),
        ({"dimension": "2", "sizes": "6 4"}, "with 2 axes of space; expected three"),
        (
            {"dimension": "4", "sizes": "2 2 3 4", "kinds": "space list space time"},
            "expected three axes of space",
        ),
        ({"byte_skip": "-2"}, "byte skip '-2' found in the header; expected one number"),
        ({"byte_skip": "1 2"}, "expected one number"),
        ({"byte_skip": str(2**40 + 1)}, "expected one number"),
        ({"byte_skip": str(2**40)}, "bytes found"),
        ({"data_file": "s%d.raw 1 100001 1"}, "data file pattern"),
        ({"data_file": "s%d.raw 1 100000 1"}, "data file 's1.raw' is not there"),
        ({"data_file": "LIST\n" + "x\n" * 100_001}, "100001 data files found; expected at most 100000"),
        ({"data_file": "LIST\n" + "x\n" * 100_000}, "data file 'x' is not there"),
        ({"line_skip": "-1"}, "line skip '-1' found"),
        ({"line_skip": "9"}, "fewer or longer lines found than the 9 to skip"),
        ({"data_file": ""}, "empty data file field"),
        ({"data_file": "LIST 1"}, "data file LIST 1 found; expected slices of 2 axes"),
        ({"data_file": "LIST"}, "empty list of data files"),
        ({"data_file": "none.raw"}, "data file 'none.raw' is not there"),
        ({"data_file": "s%s.raw 0 3 1"}, "data file pattern 's%s.raw' with range '0 3 1'"),
        ({"data_file": "s%d.raw 0 x 1"}, "data file pattern"),
        ({"data_file": "s%d.raw 0 3 0"}, "data file pattern"),
        ({"data_file": "s%d.raw 3 0 1"}, "data file pattern"),
        ({"space": "left-up", "space_directions": "(1,0,0) (0,1,0) (0,0,1)"}, "space 'left-up' found"),
        ({"space_directions": "(1,0,0) (0,1,0)"}, "2 space directions found"),
        ({"kinds": "domain domain"}, "2 kinds found, but 3 axes"),
        ({"labels": '"z" "y" "x" "t"'}, "4 labels found, but 3 axes"),
        ({"spacings": "1 2"}, "2 spacings found, but 3 axes"),
        ({"spacings": "1 2 3", "units": '"mm" "mm" "mm" "s"'}, "4 units found, but 3 axes"),
        ({"axis_mins": "1"}, "1 axis mins found, but 3 axes"),
        ({"centerings": "cell cell cell cell"}, "4 centerings found, but 3 axes"),
        ({"space_directions": "(1,0) (0,1) (1,1)"}, "without three coordinates"),
        ({"space_directions": "(1,0,0,0,0) (0,1,0,0,0) (0,0,1,0,0)"}, "without three coordinates"),
        ({"space_directions": "(1,0,0) (0,1,0) (0,0,1)", "space_origin": "(1,2)"}, "three coordinates"),
        ({"space_directions": "(1,0,0) (0,1,x) (0,0,1)"}, "vector '(0,1,x)' found"),
        ({"spacings": "1 x 1"}, "spacings '1 x 1' found in the header; expected numbers"),
        ({"sizes": "2 3 4\nnonsense"}, "header line 'nonsense' found"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_nrrd_headers(tmp_path, fields, told):
    with pytest.raises(VolumeError) as caught:
        read(nrrd(tmp_path, **fields))
    assert told in str(caught.value)
    assert caught.value.exit_status == 3


@pytest.mark.parametrize(
    "fields",
    [
        {"dimension": "16", "sizes": "2 3 4" + " 1" * 13},
        {"byte_skip": "0"},
        {"byte_skip": "-1"},
        {"line_skip": "0"},
        {"type": "  Signed   Short INT "},
        {"data_file": "./a.raw"},
        {"data_file": "LIST 2\ns0\ns1\ns2\ns3"},
        {"data_file": "LIST 3\na.raw"},
        {"data_file": "s%d 0 3 1"},
        {"data_file": "s%d 0 3 1 2"},
        {"kinds": "domain domain domain"},
        {"kinds": ""},
        {"dimension": "4", "sizes": "2 1 3 4", "kinds": "space list space space"},
        {"dimension": "4", "sizes": "2 3 4 1", "kinds": "space space space space"},
        {"sizes": "2 3 4\n# " + "x" * ((1 << 20) - 200)},
        {"space": "3D-left-handed", "space_directions": "(1,0,0) (0,1,0) (0,0,1)"},
        {"space": "RAST", "space_directions": "(1,0,0,0) (0,1,0,0) (0,0,1,0)", "space_origin": "(0,0,0,0)"},
    ],
    ids=lambda value: str(value)[:40],
)
def test_nrrd_headers_that_are_taken(tmp_path, fields):
    (tmp_path / "a.raw").write_bytes(VALUES.tobytes())
    for k, plane in enumerate(VALUES):
        (tmp_path / f"s{k}").write_bytes(plane.tobytes())
    np.testing.assert_array_equal(read(nrrd(tmp_path, **fields)).values, VALUES)


def test_a_list_of_slices_backwards(tmp_path):
    for k, plane in enumerate(VALUES):
        (tmp_path / f"s{k}").write_bytes(plane.tobytes())
    np.testing.assert_array_equal(read(nrrd(tmp_path, data_file="s%d 3 0 -1")).values, VALUES[::-1])


def test_a_pattern_of_too_many_files(tmp_path, monkeypatch):
    monkeypatch.setattr(data_files, "MAX_FILES", 4)
    for k in range(5):
        (tmp_path / f"s{k}").write_bytes(VALUES[0].tobytes())
    assert read(nrrd(tmp_path, data_file="s%d 0 3 1")).shape == (2, 3, 4)
    with pytest.raises(DamagedVolumeError, match="data file pattern"):
        read(nrrd(tmp_path, sizes="2 3 5", data_file="s%d 0 4 1"))
    with pytest.raises(DamagedVolumeError, match="5 data files found; expected at most 4"):
        read(nrrd(tmp_path, sizes="2 3 5", data_file="LIST\n" + "\n".join(f"s{k}" for k in range(5))))


def test_a_header_without_an_end(tmp_path):
    path = nrrd(tmp_path, sizes="2 3 4\n# " + "x" * (1 << 20))
    with pytest.raises(DamagedVolumeError, match="no end of the header"):
        read(path)
    with pytest.raises(UnsupportedFormatError, match="no NRRD file"):
        (tmp_path / "b.nrrd").write_bytes(b"NRRD00x5\n")
        read(tmp_path / "b.nrrd")


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"encoding": "gzip", "byte_skip": "-1"}, r"byte skip -1 found with encoding gzip; expected raw"),
        ({"data_file": "LIST" + "\nbig" * 5}, r"5 data files named for 48 bytes of values"),
        ({"data_file": "LIST" + "\nbig" * 16}, r"16 data files do not share 24 values evenly"),
        (
            {"dimension": "4", "sizes": "2 3 2 2", "data_file": "LIST 3" + "\nbig" * 3},
            r"3 data files found for 2 volumes; expected the same number",
        ),
    ],
)
def test_files_that_do_not_share_the_values(tmp_path, fields, told):
    (tmp_path / "big").write_bytes(bytes(100))
    with pytest.raises(DamagedVolumeError, match=told):
        read(nrrd(tmp_path, gzip.compress(VALUES.tobytes()), **fields), volume_index=0)


def test_the_files_of_the_chosen_volume_are_read(tmp_path):
    for k, plane in enumerate(VALUES):
        (tmp_path / f"s{k}").write_bytes(plane.tobytes())
    path = nrrd(tmp_path, dimension="4", sizes="2 3 2 2", data_file="LIST 3\ns0\ns1\ns2\ns3")
    for volume in (0, 1):
        np.testing.assert_array_equal(
            read(path, volume_index=volume).values, VALUES[2 * volume : 2 * volume + 2]
        )


@pytest.mark.parametrize("text", ["1 2 3", "0 " * 23, "x " * 24, "1" * 65 + " 0" * 23, "40000 " * 24])
def test_text_that_is_no_24_numbers(tmp_path, text):
    with pytest.raises(DamagedVolumeError):
        read(nrrd(tmp_path, text.encode(), encoding="ascii"))


def test_text_with_commas_tabs_and_long_numbers(tmp_path):
    text = ",\t\n".join(f"{n:064d}" for n in range(24))
    np.testing.assert_array_equal(read(nrrd(tmp_path, text.encode(), encoding="ascii")).values, VALUES)


@pytest.mark.parametrize("packer", [gzip.compress, bz2.compress])
def test_a_stream_that_ends_before_its_checksum(tmp_path, packer):
    packed = packer(VALUES.tobytes())
    encoding = "gzip" if packer is gzip.compress else "bzip2"
    changed = packed[:-6] + bytes([packed[-6] ^ 1]) + packed[-5:]
    with pytest.raises(DamagedVolumeError, match=r"damaged|decoded"):
        read(nrrd(tmp_path, changed, encoding=encoding))


def test_the_lines_that_are_skipped_are_not_endless(tmp_path, monkeypatch):
    monkeypatch.setattr(values, "MAX_LINE", 10)
    path = nrrd(tmp_path, b"123456789\n" + VALUES.tobytes(), line_skip="1")
    np.testing.assert_array_equal(read(path).values, VALUES)
    with pytest.raises(DamagedVolumeError, match="fewer or longer lines"):
        read(nrrd(tmp_path, b"1234567890\n" + VALUES.tobytes(), line_skip="1"))


def test_values_from_the_end_of_a_file(tmp_path):
    assert FROM_END == -1
    path = nrrd(tmp_path, b"whatever" + VALUES.tobytes(), byte_skip="-1")
    np.testing.assert_array_equal(read(path).values, VALUES)


def test_lines_that_take_what_the_values_need(tmp_path):
    path = nrrd(tmp_path, b"x" * 29 + b"\n" + VALUES.tobytes()[:30], line_skip="1")
    with pytest.raises(
        DamagedVolumeError, match=r"30 bytes of values found, 48 expected for 2 x 3 x 4 values"
    ):
        read(path)


@pytest.mark.parametrize(("kept", "found"), [(24, 0), (23, 0), (30, 6)])
def test_a_stream_that_ends_before_the_chosen_volume(tmp_path, kept, found):
    packed = gzip.compress(VALUES.tobytes()[:kept])
    path = nrrd(tmp_path, packed, dimension="4", sizes="2 3 2 2", encoding="gzip")
    with pytest.raises(DamagedVolumeError, match=rf"{found} bytes of values found, 24 expected"):
        read(path, volume_index=1)


def test_a_file_that_cannot_be_mapped_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(values, "map_file", lambda file: None)
    found = read(nrrd(tmp_path)).values
    np.testing.assert_array_equal(found, VALUES)
    assert found.base is None or not isinstance(found.base, memoryview)
