"""Meshes of small volumes after each stage are what they have always been, to the bit.

Numbers that were chosen, a weight or a limit, show nowhere else. `python -m tests.mesh.test_golden` prints
the table anew; a change of it is a change of meshes.
"""

import hashlib
import platform

import numpy as np
import pytest

from dmc_cli.mesh.more import simplify_more
from dmc_cli.mesh.relax import relax
from dmc_cli.settings import SurfaceSettings
from tests.fields import smooth_noise, volume_of, white_noise
from tests.mesh.meshes import colored
from tests.surface.agreement import as_arrays, extract_on

MIRRORED = np.array([[0.5, 0.1, 0, -3], [0, -2, 0, 4], [0.2, 0, 1.25, 7], [0, 0, 0, 1.0]])


def with_holes():
    values = smooth_noise(16, 1.0, seed=3).values.copy()
    values[np.random.default_rng(4).random(values.shape) < 0.02] = np.nan
    return volume_of(values)


def uneven():
    depths = np.cumsum(np.random.default_rng(5).uniform(0.5, 2.0, 16))
    return volume_of(smooth_noise(16, 1.0, seed=6).values, slice_positions=depths - depths[0])


def whole_numbers():
    values = np.random.default_rng(7).integers(0, 5, (14, 14, 14)).astype(np.uint8)
    return volume_of(values, affine=MIRRORED)


VOLUMES = {
    "white": (lambda: white_noise(12, seed=1), {"border": "closed"}),
    "open": (lambda: smooth_noise(16, 1.0, seed=2), {"border": "open"}),
    "holes": (with_holes, {"border": "closed"}),
    "uneven": (uneven, {"border": "closed", "inside": "below"}),
    "whole numbers": (whole_numbers, {"isovalue": 2.0, "border": "closed", "orientation": "gradient"}),
}
KNOWN = {
    "white": {
        "paper": "1a28012475ba",
        "safe": "700ff14da02d",
        "relaxed": "27991aae6f2b",
        "more": "40e9afb9ffed",
    },
    "open": {
        "paper": "770b21c98ee3",
        "safe": "577af010e760",
        "relaxed": "964454ec02e2",
        "more": "df1fe3ebc2a1",
    },
    "holes": {
        "paper": "1db32dc17c71",
        "safe": "90833d32a0e0",
        "relaxed": "6cf9546b0594",
        "more": "86e4cd5a1146",
    },
    "uneven": {
        "paper": "bb5b23649590",
        "safe": "f5025b507d72",
        "relaxed": "76d3401064db",
        "more": "405adc5e2614",
    },
    "whole numbers": {
        "paper": "32d56e223da2",
        "safe": "6565400a9efe",
        "relaxed": "88dd6f385f00",
        "more": "41d6d8e0073b",
    },
}


def stages(name):
    """The mesh of a volume after each stage."""
    make, settings = VOLUMES[name]
    surface = extract_on("cpu", make(), SurfaceSettings(**{"isovalue": 0.0, **settings}), threads=2)
    paper = colored(extract_on("cpu", make(), SurfaceSettings(**{"isovalue": 0.0, **settings})))
    yield "paper", paper.simplified(simplify_rules="paper", project=False).surface
    safe = colored(surface).simplified()
    yield "safe", safe.surface
    yield "relaxed", relax(safe.surface, safe.halfedges, 3)
    yield "more", simplify_more(safe.surface, safe.halfedges, 5, safe.color, safe.color24).surface


def digest(surface):
    found = hashlib.sha256()
    for array in as_arrays(surface).values():
        found.update(np.ascontiguousarray(array).tobytes())
    return found.hexdigest()[:12]


@pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64"),
    reason="the hashes are those of x86-64 with fused multiply-add",
)
@pytest.mark.parametrize("name", VOLUMES)
def test_meshes_are_what_they_have_always_been(name):
    assert {stage: digest(surface) for stage, surface in stages(name)} == KNOWN[name]


if __name__ == "__main__":
    for each in VOLUMES:
        print(f"    {each!r}: { {stage: digest(surface) for stage, surface in stages(each)}!r},")
