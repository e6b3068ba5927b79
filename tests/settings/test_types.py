"""Settings from the Python API are taken as annotated, or refused in words."""

from typing import get_args

import numpy as np
import pytest

from dmc_cli.errors import SettingsError
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import (
    ConvertSettings,
    Inside,
    MeasureSettings,
    MeshSettings,
    OutputSettings,
    ReadSettings,
    ReproduceSettings,
    SurfaceSettings,
    SynthSettings,
)


def converting(**changes):
    surface, output = SurfaceSettings(isovalue=1.0), OutputSettings(path="a.ply")
    return ConvertSettings(**{"input": "a.nii", "surface": surface, "output": output, **changes})


REFUSED = [
    *[(SurfaceSettings, {"isovalue": given}, "expected a") for given in ("0", 1j, 10**400, True, [1])],
    (SurfaceSettings, {"isovalue": np.array([1.0, 2.0])}, "expected a number"),
    (SurfaceSettings, {"isovalue": 1.0, "inside": "upper"}, f"one of {', '.join(get_args(Inside))}"),
    (SurfaceSettings, {"isovalue": 1.0, "border": []}, "one of open, closed"),
    *[(MeshSettings, {"relax": given}, "a whole number") for given in ("5", 1.5, True, None, np.float64(2))],
    (MeshSettings, {"remesh": None}, "a whole number"),
    (MeshSettings, {"project": 1}, "True or False"),
    *[
        (converting, {"threads": given}, "threads is .*; expected a whole number")
        for given in (1.5, "2", True)
    ],
    (converting, {"input": 5}, "a text"),
    (converting, {"surface": 5}, "expected SurfaceSettings"),
    (converting, {"device": "gpu"}, "expected auto, cpu, cuda or cuda:N"),
    (ReadSettings, {"shape": (3, 4)}, "3 values"),
    (ReadSettings, {"shape": (3, 4, 5.0)}, "a whole number"),
    (ReadSettings, {"spacing": "123"}, "a tuple"),
    (ReadSettings, {"spacing": 1.0}, "a tuple"),
    (ReadSettings, {"series": 3}, "a text"),
    (ReadSettings, {"input_format": "jpeg"}, "one of dicom, nrrd, nifti"),
    (OutputSettings, {"path": "a", "require": "closed"}, "a tuple"),
    (OutputSettings, {"path": "a", "require": ("shut",)}, "one of manifold, closed"),
    (OutputSettings, {"path": None}, "a text"),
    (OutputSettings, {"path": "a", "memory": 1e9}, "a whole number"),
    (SynthSettings, {"path": "a", "field": "cube"}, "one of genus_two"),
    (MeasureSettings, {"mesh": "a", "volume": "b", "isovalue": "1"}, "a number"),
    (ReproduceSettings, {"table": ("1",)}, "one of 2, 3"),
]


@pytest.mark.parametrize(("make", "given", "told"), REFUSED)
def test_a_setting_of_another_type_is_refused(make, given, told):
    name = list(given)[-1]
    with pytest.raises(SettingsError, match=rf"^{name} is .*expected .*") as caught:
        make(**given)
    assert caught.match(told)


def test_scalars_and_sequences_of_numpy_become_plain_ones():
    surface = SurfaceSettings(isovalue=np.float32(3))
    mesh = MeshSettings(relax=np.int64(2), project=np.True_)
    read = ReadSettings(shape=np.array([3, 4, 5]), spacing=[np.float64(1), 2, 3], series=np.str_("1"))
    found = [surface.isovalue, mesh.relax, mesh.project, *read.shape, *read.spacing, read.series]
    assert found == [3.0, 2, True, 3, 4, 5, 1.0, 2.0, 3.0, "1"]
    assert [type(value) for value in found] == [float, int, bool, int, int, int, float, float, float, str]


def test_whole_numbers_are_real_ones_too():
    assert type(SurfaceSettings(isovalue=300).isovalue) is float


@pytest.mark.parametrize("name", ["gpu", "cpu:0", "", "cuda:", "cuda:-1", "cuda:\u0663", None, 0])
def test_what_is_no_device_is_refused(name):
    with pytest.raises(SettingsError, match=r"^device is .*; expected auto, cpu, cuda or cuda:N"):
        select_device(name)


@pytest.mark.parametrize("threads", [-1, 0, 1.5, "2", True])
def test_what_is_no_number_of_threads_is_refused(threads):
    with pytest.raises(SettingsError, match=r"^threads is .*; expected 1 or more, a whole number"):
        select_device("cpu", threads)
    assert select_device("cpu", np.int64(2)).threads == 2
