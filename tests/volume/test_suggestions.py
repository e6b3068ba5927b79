"""What a volume is said to be, and the isovalues that are chosen of it."""

import numpy as np
import pytest

from dmc_cli.errors import SettingsError
from dmc_cli.volume import Suggestions, Volume


def suggestions(values, **given):
    return Suggestions(Volume(values=np.asarray(values), affine=np.eye(4), space="none", **given))


@pytest.fixture
def scan():
    rng = np.random.default_rng(0)
    return rng.integers(0, 4096, (8, 16, 16)).astype(np.int16)


def hounsfield(scan):
    return suggestions(scan, intercept=-1024.0, modality="CT", value_unit="HU")


def test_what_two_values_are_is_a_mask_and_half_of_it_is_chosen():
    mask = np.zeros((4, 4, 4), np.uint8)
    mask[1:3] = 255
    for values in (mask, mask.astype(np.float32)):
        found = suggestions(values)
        assert found.kind == "mask"
        assert (found.choose(None).isovalue, found.choose(None).reason) == (127.5, "half of a mask")
        assert [one.isovalue for one in found.suggested()] == [127.5]
    mask = mask.astype(np.float32)
    mask[0, 0, 0] = 0.01  # in the bin of 0
    assert suggestions(mask).kind == "field"


def test_kinds(scan):
    assert hounsfield(scan).kind == "CT in HU"
    assert suggestions(scan, modality="MR").kind == "MR"
    assert suggestions(scan).kind == "field"
    labels = np.kron(scan[:2, :4, :4] % 20, np.ones((4, 8, 8), np.int16))
    assert suggestions(labels).kind == "label map"
    assert suggestions(labels.astype(np.float32)).kind == "field"


def test_presets_are_hounsfield_units_and_bone_is_the_default_of_ct(scan):
    found = hounsfield(scan)
    assert found.choose("bone").isovalue == found.choose(None).isovalue == 300.0
    assert found.choose("SKIN").isovalue == -300.0
    assert [one.choice for one in found.suggested(counts=False)] == [
        *("bone", "soft", "fat", "skin", "lung", "air")
    ]


def test_a_ct_without_bone_is_parted_by_its_histogram(scan):
    found = suggestions(scan % 600, intercept=-1024.0, modality="CT", value_unit="HU")
    assert found.choose(None).choice == "otsu"


@pytest.mark.parametrize("given", [{}, {"modality": "CT"}, {"modality": "NM", "value_unit": "CNTS"}])
def test_presets_of_values_that_are_not_told_to_be_in_hu_are_refused(scan, given):
    with pytest.raises(SettingsError, match=r"\(HU\), but the values are .*, from .* to 409\d; .*-i 300"):
        suggestions(scan, **given).choose("bone")


def test_a_share_is_one_of_the_range_of_values(scan):
    scan[0, 0, :2] = 0, 4000
    scan = np.minimum(scan, 4000)
    assert suggestions(scan).choose("20%").isovalue == pytest.approx(800.0)
    assert suggestions(scan, slope=-2.0).choose("20%").isovalue == pytest.approx(-6400.0)


def test_several_classes_are_counted_upwards():
    values = np.repeat([0, 100, 200, 900], 16).astype(np.int16).reshape(4, 4, 4)
    found = suggestions(values)
    assert [found.choose(f"otsu:3:{k}").isovalue for k in (1, 2, 3)] == [50.0, 150.0, 550.0]
    assert found.choose("otsu:3").isovalue == 550.0
    assert found.choose("otsu").isovalue == found.choose("otsu:1:1").isovalue == 550.0
    with pytest.raises(SettingsError, match="only 4 different values; expected more than 4"):
        found.choose("otsu:4")


NO_CHOICES = (
    *(
        "",
        "otsu:",
        "otsu:0",
        "otsu:9",
        "otsu:2:3",
        "otsu:1:1:1",
        "-5%",
        "0%",
        "100%",
        "nan%",
        "band:2:1",
        "band:1",
    ),
    *("band:a:1", "band:1:inf", "bones", "5"),
)


@pytest.mark.parametrize("text", NO_CHOICES)
def test_what_is_no_choice_is_refused(text):
    with pytest.raises(SettingsError, match=r"isovalue is .*expected"):
        suggestions(np.arange(8.0).reshape(2, 2, 2)).choose(text)


def test_a_constant_volume_and_one_without_data_suggest_nothing():
    for value in (3.0, np.nan):
        found = suggestions(np.full((2, 2, 2), value))
        assert list(found.suggested()) == []
        assert np.isfinite(found.choose(None).isovalue)
