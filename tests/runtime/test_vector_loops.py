"""The loops over sixteen lanes that `docs/design.md` counts on are vector code: clang says so itself."""

import json
import platform
import subprocess
import sys

import pytest

from tests.conftest import ROOT

CONTOURING = "dmc_cli.contouring"
METHOD = f"{CONTOURING}.dual_marching_cubes"

LOOPS = {
    f"{METHOD}.placement.exact_simd": {
        "find_block_cells": 8,
        "gather_corners": 8,
        "place_lanes": 16,
        "world_lanes": 16,
        "store_points": 16,
    },
    f"{METHOD}.cells": {"find_candidates": 16},
    f"{METHOD}.quads": {"quad_edges": 16, "surely_ordinary": 16},
    f"{CONTOURING}.stages.edge_ranks": {"count_rows": 16},
    f"{CONTOURING}.stages.edge_vertices": {"edge_words": 16, "place_rows": 16},
    f"{CONTOURING}.stages.cell_triangles": {"connect_rows": 16},
    f"{CONTOURING}.macet.surface_steps": {"settle_rows": 16},
    f"{CONTOURING}.macet.moved_triangles": {"connect_moved": 16},
    f"{CONTOURING}.dual_grid.active_cells": {"find_candidates": 16, "quad_edges": 16, "cells_of_edges": 16},
    f"{CONTOURING}.dual_grid.cell_quads": {"quad_edges": 16, "store_plain_quads": 16},
    f"{CONTOURING}.surface_nets.mean_crossings": {
        "gather_corners": 8,
        "mean_lanes": 16,
        "world_lanes": 16,
        "store_points": 16,
    },
    f"{CONTOURING}.dual_contouring.placement": {"find_block_cells": 8, "world_lanes": 16, "store_points": 16},
    "dmc_cli.processing.patterns.masks": {"word_3x3y": 16, "word_3333": 16, "flagged": 16},
}
"""Functions that need a loop of so many lanes at least: eight where they are doubles."""


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in {"x86_64", "AMD64"}, reason="the flags are those of x86-64")
@pytest.mark.parametrize("module", LOOPS, ids=lambda name: name.rpartition(".")[2])
def test_loops_over_lanes_are_vector_code(module, tmp_path):
    words = [sys.executable, "-m", "tests.runtime.vector_loops", module, str(tmp_path)]
    run = subprocess.run(words, cwd=ROOT, capture_output=True, encoding="utf-8", check=True, timeout=300)
    found = json.loads(run.stdout.splitlines()[-1])
    widest = {name: max(found.get(name, [0])) for name in LOOPS[module]}
    assert {name: widest[name] for name, least in LOOPS[module].items() if widest[name] < least} == {}
