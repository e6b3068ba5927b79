import pytest

from tests.conftest import ROOT


@pytest.fixture(scope="session")
def cases():
    """The folder of situations that people met, which lies beside the checkout on some machines."""
    path = ROOT.parent / "shared" / "cases"
    if not path.is_dir():
        pytest.skip(f"{path} is not on this machine")
    return path
