"""Files with known right answers that lie beside a checkout; without them the tests that need them skip."""

import pytest

from tests.conftest import ROOT

CASES = ROOT.parent / "shared" / "cases"


def case(name):
    """Return the path of a file or folder of the cases."""
    path = CASES / name
    if not path.exists():
        pytest.skip(f"../shared/cases/{name} is not there")
    return path
