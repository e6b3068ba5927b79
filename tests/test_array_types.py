"""Arrays have the names of `dmc_cli/array_types.py` everywhere, and what is written of them is true."""

import numpy as np

from dmc_cli import array_types
from tests.conftest import ROOT


def test_types_of_arrays_are_spelled_out_in_one_place():
    paths = [path for path in (ROOT / "dmc_cli").rglob("*.py") if "ndarray[" in path.read_text("utf-8")]
    assert [path.name for path in paths] == ["array_types.py"]


def test_a_name_says_what_is_in_it():
    names = [name for name in vars(array_types) if name.endswith("Array") and name != "AnyArray"]
    assert len(names) == 8
    for name in names:
        (dtype,) = getattr(array_types, name).__args__[1].__args__
        said = name.removesuffix("Array").lower()
        kind = {"byte": np.uint8, "int": np.signedinteger, "float": np.floating, "bool": np.bool_}.get(said)
        assert getattr(dtype, "__origin__", dtype) is (kind or getattr(np, said))
