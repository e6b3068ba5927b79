"""The forecast counts every stage's arrays, is held against the right limit, and says what is short."""

from dataclasses import replace

import numpy as np
import pytest

from dmc_cli.app import memory_budget as memory
from dmc_cli.app.memory_budget import (
    MeshForecast,
    Sizes,
    forecast,
    reserve_cells,
    reserve_values,
    words_of,
)
from dmc_cli.contouring import extract_surface
from dmc_cli.errors import MemoryBudgetError
from dmc_cli.field import upload_volume
from dmc_cli.memory_limits import Available
from dmc_cli.mesh_io.text import CHUNK_ROWS
from dmc_cli.methods import Cost, method_named
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import ConvertSettings, MemoryShare, MeshSettings, OutputSettings, SurfaceSettings
from dmc_cli.volume.volume import Volume

CELLS = method_named("dmc").memory.cells
MIB = 1 << 20
SIZES = Sizes(values=1600, words=10, near=5, cells=100, vertices=1000, faces=1000)


def settings_of(mesh=None, border="open", share=None, **output):
    return ConvertSettings(
        input="scan.nii",
        surface=SurfaceSettings(isovalue=0, border=border),
        output=OutputSettings(**({"path": "out.ply"} | output)),
        mesh=mesh or MeshSettings(),
        share=share or MemoryShare(),
    )


def volume_of(dtype=np.float32, shape=(64, 64, 64)):
    return Volume(values=np.zeros(shape, dtype), affine=np.eye(4), space="none")


def kept(count):
    """Return bytes with the sixteenth that may be kept beside them."""
    return count + count // 16


@pytest.mark.parametrize(
    ("settings", "even", "stages"),
    [
        (settings_of(), True, {"surface": 48_000 + 4900 + 200, "write": 48_000 + 12_000 + 3000}),
        (settings_of(normals=False), True, {"write": 48_000 + 3000}),
        (settings_of(), False, {"surface": 48_000 + 12_000 + 4900 + 200}),
        (
            settings_of(check=True),
            True,
            {
                "halfedges": 48_000 + 25_000 + 3600 + 200 + 80,
                "normals": 48_000 + 25_000 + 12_000,
                "report": 48_000 + 25_000 + 12_000 + 15_000,
                "check": 48_000 + 25_000 + 12_000 + 21_000,
            },
        ),
        (settings_of(halfedges="h.npz", normals=False), True, {"normals": 48_000 + 25_000 + 12_000 + 2000}),
        (
            settings_of(MeshSettings(simplify_rules="paper"), report="r"),
            True,
            {"halfedges": 48_000 + 25_000 + 3600 + 200 + 80},
        ),
        (settings_of(MeshSettings(simplify="3x3y")), True, {"simplify": 48_000 + 25_000 + 10_000}),
        (settings_of(MeshSettings(simplify="all"), report="r"), True, {"simplify": 48_000 + 25_000 + 38_000}),
        (
            settings_of(MeshSettings(simplify="all", simplify_rules="paper")),
            True,
            {"simplify": 48_000 + 25_000 + 12_000},
        ),
        (
            settings_of(MeshSettings(remesh=20)),
            True,
            {"remesh": 48_000 + 25_000 + 19_000 + 39_000 + 88_000},
        ),
        (
            settings_of(MeshSettings(quads=10)),
            True,
            {"size": 48_000 + 25_000 + 19_000 + 137_000 + 73_000},
        ),
        (
            settings_of(MeshSettings(quads=10), report="r"),
            True,
            {"size": 48_000 + 25_000 + 19_000 + 137_000 + 73_000 + 28_000},
        ),
        (
            settings_of(MeshSettings(max_error=1.0)),
            True,
            {"size": 48_000 + 25_000 + 19_000 + 137_000 + 73_000 + 28_000 + 73_000 + 6000 + 38_000},
        ),
        (settings_of(MeshSettings(relax=1)), True, {"relax": 48_000 + 25_000 + 39_000 + 44_000}),
        (settings_of(MeshSettings(relax=2)), True, {"relax": 48_000 + 25_000 + 39_000 + 88_000}),
        (settings_of(MeshSettings(relax=2)), True, {"repair": 48_000 + 25_000 + 38_000 + 16_000}),
    ],
)
def test_each_stage_counts_what_is_alive_in_it(settings, even, stages):
    found = forecast(SIZES, settings, even_slices=even)
    assert {name: found[name] for name in stages} == {
        name: SIZES.values + kept(size) for name, size in stages.items()
    }


def test_a_stage_that_does_not_run_takes_nothing():
    assert list(forecast(SIZES, settings_of(normals=False))) == ["surface", "write"]
    mesh = MeshSettings(remesh=20, relax=3)
    everything = settings_of(mesh, check=True, halfedges="h.npz")
    names = [
        "surface",
        "halfedges",
        "simplify",
        "remesh",
        "relax",
        "repair",
        "normals",
        "report",
        "check",
        "write",
    ]
    assert list(forecast(SIZES, everything)) == names


@pytest.mark.parametrize(
    ("output", "is_text"),
    [
        ({}, False),
        ({"ascii": True}, True),
        ({"path": "a.OBJ"}, True),
        ({"path": "a.off"}, True),
        ({"path": "-", "output_format": "ply"}, False),
        ({"path": "a.ply", "output_format": "obj"}, True),
        ({"halfedges": "h.npz"}, False),
        ({"halfedges": "h.NPZ"}, False),
        ({"halfedges": "h.txt"}, True),
        ({"ascii": True, "dry_run": True}, False),
    ],
)
def test_text_takes_some_rows_more(output, is_text):
    output = output | {"normals": True}
    few = forecast(SIZES, settings_of(**output))["write"]
    binary = {"path": "a.ply", "output_format": None, "ascii": False}
    halfedges = "h.npz" if "halfedges" in output else None
    plain = forecast(SIZES, settings_of(**(output | binary | {"halfedges": halfedges})))["write"]
    assert few - plain == is_text * memory.TEXT_ROW * 1000
    many = replace(SIZES, faces=10**7)
    assert forecast(many, settings_of(ascii=True))["write"] - forecast(many, settings_of())["write"] == (
        memory.TEXT_ROW * CHUNK_ROWS
    )


@pytest.mark.parametrize(
    ("shape", "border", "words"),
    [
        ((32, 3, 4), "open", 12 + 3),
        ((33, 3, 4), "open", 24 + 6),
        ((30, 3, 4), "closed", 5 * 6 + 5),
        ((31, 3, 4), "closed", 2 * (5 * 6 + 5)),
    ],
)
def test_rows_of_nodes_are_whole_words_and_a_layer_more(shape, border, words):
    assert words_of(shape, settings_of(border=border)) == words


@pytest.mark.parametrize(
    ("dtype", "times"), [(np.int16, 1), (np.float64, 1), (np.int64, 1.5), (np.uint64, 1.5)]
)
def test_long_integers_are_there_twice(dtype, times):
    volume = volume_of(dtype)
    assert memory.sizes_of(volume, settings_of()).values == times * volume.values.nbytes


def test_only_words_near_the_surface_have_ranks():
    far, near = (replace(SIZES, words=10_000, near=words) for words in (10_000, 1000))
    few = forecast(near, settings_of(report="r"))
    for stage, found in forecast(far, settings_of(report="r")).items():
        cost = {"surface": 8, "halfedges": 24}.get(stage, 0)
        assert found - few[stage] == pytest.approx(kept(cost * 9000), abs=1)


@pytest.mark.parametrize(
    ("near", "expected"), [(None, 3), (0, 0), (1, 1), (1 << 17, 1), (131073, 2), (9 << 17, 3)]
)
def test_ranks_lie_in_huge_pages(near, expected, monkeypatch):
    found = []
    words = 3 << 17
    monkeypatch.setattr(memory, "words_of", lambda *_: words)
    monkeypatch.setattr(memory, "forecast", lambda sizes, *_, **__: found.append(sizes) or {"surface": 0})
    MeshForecast(volume_of(), settings_of(), near=near).hold(1, 1)
    assert found[0].near == expected << 17
    assert found[0].words == words


def test_words_from_the_first_quad_to_the_last_are_near():
    values = np.zeros((60, 64, 64), np.float32)
    values[20:30, 20:40, 20:40] = 1
    volume = Volume(values=values, affine=np.eye(4), space="none")
    found = []
    device = select_device("cpu", 1)
    settings = SurfaceSettings(isovalue=0.5)

    def reserve(vertices, faces, *, near=None, cells=None):
        found.append((vertices, faces, near, cells))

    extract_surface(upload_volume(volume, device), settings, reserve=reserve)
    (ordinary, quads, near, special), last = found
    assert last == (1602, quads, None, None)
    assert quads == 2 * 400 + 4 * 200
    assert ordinary + special == 1602
    layer = 2 * 64
    assert 9 * layer + 2 * (layer + 2) < near < 13 * layer + 2 * (layer + 2)
    found.clear()
    nowhere = SurfaceSettings(isovalue=7)
    extract_surface(upload_volume(volume, device), nowhere, reserve=reserve)
    assert found == [(0, 0, 0, 0), (0, 0, None, None)]


def test_the_mesh_is_held_against_the_budget_as_it_becomes_known():
    volume = volume_of()
    sizes = replace(memory.sizes_of(volume, settings_of()), cells=1000, vertices=5000, faces=6000)
    needed = max(forecast(sizes, settings_of()).values())
    for budget, fits in ((needed, True), (needed - 1, False)):
        held = MeshForecast(volume, settings_of(memory=budget))
        held.hold(4000, 6000, cells=1000)
        if fits:
            held.hold(5000, 6000)
        else:
            with pytest.raises(MemoryBudgetError, match="the volume and a mesh of 6000 quads need"):
                held.hold(5000, 6000)


def test_cells_that_cannot_fit_are_refused_before_they_are_traced():
    held = MeshForecast(volume_of(), settings_of(memory=3 * MIB))
    with pytest.raises(MemoryBudgetError, match="a mesh of 3 quads"):
        held.hold(0, 3, cells=1 << 20)


@pytest.fixture
def free(monkeypatch):
    """Set what is free, and what limits it."""

    def set_free(size, limit=""):
        monkeypatch.setattr(memory, "available_bytes", lambda: size)
        monkeypatch.setattr(memory, "available_memory", lambda: Available(size, limit))

    return set_free


def test_what_is_free_is_held_against_what_is_not_taken_yet(free):
    volume = volume_of()
    cells = memory.sizes_of(volume, settings_of()).bytes_of(CELLS) - volume.values.nbytes
    free(cells)
    reserve_cells(volume, settings_of())
    free(cells - 1, "the limit that ulimit -v set")
    told = r"need 0\.2 MiB more, but 0\.2 MiB of memory are free \(the limit that ulimit -v set\); raise that"
    with pytest.raises(MemoryBudgetError, match=told):
        reserve_cells(volume, settings_of())
    reserve_cells(volume, settings_of(memory=2 * MIB))  # who gives a budget knows better


def test_before_the_values_are_read_they_and_the_cells_must_fit(free):
    words = words_of((64, 64, 64), settings_of())
    needed = Sizes(MIB, words, words).bytes_of(Cost(word=24))
    free(needed)
    reserve_values((64, 64, 64), MIB, settings_of())
    free(needed - 1)
    with pytest.raises(MemoryBudgetError, match=r"the volume and its cells need 1\.2 MiB, but 1\.2 MiB"):
        reserve_values((64, 64, 64), MIB, settings_of())
    free(MIB)
    with pytest.raises(MemoryBudgetError, match="the volume and its cells need"):
        reserve_values((64, 64, 64), MIB, settings_of())
    free(MIB - 1)
    with pytest.raises(
        MemoryBudgetError, match=r"the volume needs 1\.0 MiB, but 1\.0 MiB.*; end other programs"
    ):
        reserve_values((64, 64, 64), MIB, settings_of())


def test_each_of_several_jobs_has_its_share_of_all(free):
    volume = volume_of()
    needed = memory.sizes_of(volume, settings_of()).bytes_of(CELLS)
    free(0)  # what the others have taken does not count
    reserve_cells(volume, settings_of(share=MemoryShare(jobs=3, free=3 * needed)))
    with pytest.raises(MemoryBudgetError, match=r"for each of 3 jobs; .*take fewer --jobs"):
        reserve_cells(volume, settings_of(share=MemoryShare(jobs=3, free=3 * needed - 1)))
    reserve_cells(volume, settings_of(memory=3 * needed, share=MemoryShare(jobs=3)))
    with pytest.raises(MemoryBudgetError, match="that each of 3 jobs has of the"):
        reserve_cells(volume, settings_of(memory=3 * needed - 1, share=MemoryShare(jobs=3)))


def test_where_nothing_is_told_all_the_memory_counts(free, monkeypatch):
    volume = volume_of()
    needed = memory.sizes_of(volume, settings_of()).bytes_of(CELLS)
    monkeypatch.setattr(memory, "available_bytes", lambda: None)
    monkeypatch.setattr(memory, "available_memory", lambda: None)
    monkeypatch.setattr(memory, "total_memory", lambda: needed)
    reserve_cells(volume, settings_of())
    monkeypatch.setattr(memory, "total_memory", lambda: needed - 1)
    with pytest.raises(MemoryBudgetError, match="but this machine has"):
        reserve_cells(volume, settings_of())
    with pytest.raises(MemoryBudgetError, match="for each of 2 jobs; take fewer --jobs"):
        reserve_cells(volume, settings_of(share=MemoryShare(jobs=2)))
    monkeypatch.setattr(memory, "total_memory", lambda: None)
    reserve_cells(volume, settings_of())


@pytest.mark.parametrize(
    ("size", "text"), [(1 << 28, "0.25 GiB"), ((1 << 28) - 1, "256.0 MiB"), (0, "0.0 MiB")]
)
def test_sizes_are_readable(size, text):
    assert memory._readable(size) == text
