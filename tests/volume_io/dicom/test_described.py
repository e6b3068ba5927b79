"""How volumes of one series are described: by what tells them apart, in words."""

import itertools

import numpy as np
import pytest

from dmc_cli.volume_io.dicom.labels import described, sort_key
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save, save_stack
from tests.volume_io.dicom.test_factors import listed, save_factors
from tests.volume_io.reading import read


def test_values_are_told_in_words():
    assert described("echo time", "4.9") == "echo time 4.9 ms"
    assert described("image type", "ORIGINAL/PRIMARY/P/FFE") == "image type ORIGINAL/PRIMARY/P/FFE (phase)"
    assert described("gradient direction", "") == ""
    assert sorted(["10", "9", "", "B", "-1", "0.5 2", "0.5 -1"], key=sort_key) == [
        "", "-1", "0.5 -1", "0.5 2", "9", "10", "B",
    ]  # fmt: skip


def test_an_image_without_a_direction_is_a_volume_of_its_own(tmp_path):
    save_stack(tmp_path / "b0", axial(), DiffusionBValue=0.0)
    for n, direction in enumerate(([1, 0, 0], [0, 1, 0])):
        elements = {"DiffusionBValue": 1000.0, "DiffusionGradientOrientation": direction}
        save_stack(tmp_path / str(n), axial(), **elements)
    assert [text.split("(")[1] for text in listed(tmp_path)] == [
        "b-value 0 s/mm2)",
        "b-value 1000 s/mm2, gradient direction 0 1 0)",
        "b-value 1000 s/mm2, gradient direction 1 0 0)",
    ]


@pytest.mark.parametrize(
    ("keyword", "values", "words"),
    [
        ("SeriesDescription", ("CT 0%", "CT 50%"), ["series description CT 0%", "series description CT 50%"]),
        ("ImageComments", ("in", "out"), ["comments in", "comments out"]),
        ("SeriesNumber", ("9", "10"), ["series number 9", "series number 10"]),
        ("ProtocolName", ("a", "b"), ["protocol a", "protocol b"]),
        ("ContentDate", ("20200101", "20200102"), ["content date 20200101", "content date 20200102"]),
        ("ScanOptions", ("FS", "MT"), ["scan options FS", "scan options MT"]),
        ("ContrastBolusAgent", (None, "x"), ["no contrast agent", "contrast agent x"]),
    ],
)
def test_texts_that_differ_at_one_place_are_factors(tmp_path, keyword, values, words):
    volumes = save_factors(tmp_path, {keyword: values})
    assert [text.split("(")[1][:-1] for text in listed(tmp_path)] == words
    np.testing.assert_array_equal(read(tmp_path, series="2").values, volumes[1])


def test_indices_of_pet_count_the_slices_of_one_time_after_the_other(tmp_path):
    for n, place in itertools.product(range(2), range(3)):
        elements = {"ImageIndex": 3 * n + place + 1, "NumberOfSlices": 3, "InstanceNumber": None}
        dataset = make_slice((0, 0, 2.0 * place), place, values=plane_values(place + 10 * n), **elements)
        save(dataset, tmp_path / f"{n}{place}")
    assert [text.split("(")[1] for text in listed(tmp_path)] == ["time slice 1)", "time slice 2)"]
    np.testing.assert_array_equal(read(tmp_path, series="2").values[0], plane_values(10))


def test_volumes_are_described_by_what_differs_beside_their_factor(tmp_path):
    told = [("0", None), ("1000", [1, 0, 0]), ("1000", [0, 1, 0])]
    for n, (b_value, direction) in enumerate(told):
        elements = {"DiffusionBValue": float(b_value), "DiffusionGradientOrientation": direction}
        save_stack(tmp_path / str(n), axial(), AcquisitionNumber=str(n + 1), **elements)
    assert [text.split("(")[1] for text in listed(tmp_path)] == [
        "acquisition 1, b-value 0 s/mm2)",
        "acquisition 2, b-value 1000 s/mm2, gradient direction 1 0 0)",
        "acquisition 3, b-value 1000 s/mm2, gradient direction 0 1 0)",
    ]
