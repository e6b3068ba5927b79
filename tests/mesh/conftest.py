"""How the tests of the mesh stages get their surfaces."""

import pytest

from dmc_cli.settings import SurfaceSettings
from tests.surface.agreement import extract_on


@pytest.fixture
def extract(device):
    """Extract a surface on each device: `extract(volume, isovalue, threads=..., **settings)`."""

    def run(volume, isovalue=0.0, *, threads=1, **settings):
        return extract_on(device, volume, SurfaceSettings(isovalue=isovalue, **settings), threads=threads)

    return run
