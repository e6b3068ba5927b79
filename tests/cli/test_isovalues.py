"""Several isovalues of one input: read once, a file for each, or one file with groups."""

import json

import numpy as np
import pytest

from dmc_cli.app import conversion, read_ahead
from dmc_cli.cli.parameters import Isovalues
from dmc_cli.mesh_io import read_mesh

TORUS = ["convert", "synth:torus:24"]


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("-5", [-5.0]),
        ("1e3", [1000.0]),
        ("100:900:400", [100.0, 500.0, 900.0]),
        ("0:0.35:0.1", [0.0, 0.1, 0.2, 0.3]),
        ("-0.3:0.3:0.3", [-0.3, 0.0, 0.3]),
        ("7:7:1", [7.0]),
    ],
)
def test_an_isovalue_is_a_number_or_several_in_decimal_steps(text, numbers):
    assert list(Isovalues().convert(text, None, None)) == numbers


@pytest.mark.parametrize("text", ["", "a", "1:2", "1:2:3:4", "2:1:1", "1:2:0", "1:2:-1", "0:1:1e-9", "1:b:1"])
def test_what_is_no_isovalue_is_refused(run, tmp_path, text):
    result = run(*TORUS, tmp_path / "{isovalue}.ply", "-i", text)
    assert result.exit_code == 2
    assert "-i" in result.stderr
    assert not any(tmp_path.iterdir())


def test_each_isovalue_has_the_file_that_it_has_alone(run, tmp_path):
    for isovalue in ("-0.05", "0", "0.05"):
        run(*TORUS, tmp_path / f"alone_{isovalue}.ply", "-i", isovalue)
    result = run(*TORUS, tmp_path / "{stem}_{isovalue}.ply", "-i", "-0.05:0.05:0.05")
    assert result.exit_code == 0
    for isovalue in ("-0.05", "0", "0.05"):
        found = (tmp_path / f"synth_torus_24_{isovalue}.ply").read_bytes()
        assert found == (tmp_path / f"alone_{isovalue}.ply").read_bytes()


def test_the_input_is_read_once_by_convert_and_batch(run, tmp_path, monkeypatch):
    calls = []
    read = read_ahead.read_volume
    monkeypatch.setattr(read_ahead, "read_volume", lambda *given: calls.append(given) or read(*given))
    assert run(*TORUS, tmp_path / "a_{isovalue}.ply", "-i", 0, "-i", 0.05, "-i", 0.1).exit_code == 0
    assert len(calls) == 1
    words = ["batch", "synth:torus:16", "synth:sphere:16", "-i", 0, "-i", 0.05]
    assert run(*words, "-o", tmp_path / "b_{stem}_{isovalue}.ply").exit_code == 0
    assert len(calls) == 3


def test_one_isovalue_is_filled_in_as_well(run, tmp_path):
    assert run(*TORUS, tmp_path / "t_{isovalue:.2f}.ply", "-i", 0.05).exit_code == 0
    assert [path.name for path in tmp_path.iterdir()] == ["t_0.05.ply"]


def test_a_name_with_other_braces_stays_as_it_is(run, tmp_path):
    assert run(*TORUS, tmp_path / "{t}.ply", "-i", 0).exit_code == 0
    assert [path.name for path in tmp_path.iterdir()] == ["{t}.ply"]


def test_obj_has_a_group_for_each_isovalue(run, tmp_path):
    reports = tmp_path / "{isovalue}.json"
    result = run(*TORUS, tmp_path / "all.obj", "-i", 0, "-i", 0.05, "--report", reports)
    assert result.exit_code == 0
    text = (tmp_path / "all.obj").read_text()
    groups = text.split("\ng ")[1:]
    assert [group.split("\n")[0] for group in groups] == ["isovalue_0", "isovalue_0.05"]
    counts = [json.loads((tmp_path / f"{name}.json").read_text())["mesh"] for name in ("0", "0.05")]
    assert [group.count("\nf ") for group in groups] == [count["quads"] for count in counts]
    mesh = read_mesh(str(tmp_path / "all.obj"))
    parts = []
    for name in ("0", "0.05"):
        run(*TORUS, tmp_path / f"{name}.obj", "-i", name)
        parts.append(read_mesh(str(tmp_path / f"{name}.obj")))
    np.testing.assert_array_equal(mesh.points, np.concatenate([part.points for part in parts]))
    faces = [parts[0].faces, parts[1].faces + len(parts[0].points)]
    np.testing.assert_array_equal(mesh.faces, np.concatenate(faces))


def test_groups_go_to_standard_output_as_well(run, run_process, tmp_path):
    words = [*TORUS[1:], "-i", "0", "-i", "0.05"]
    assert run(TORUS[0], words[0], tmp_path / "all.obj", *words[1:]).exit_code == 0
    result = run_process("convert", words[0], "-", "--output-format", "obj", *words[1:])
    assert result.returncode == 0
    assert result.stdout == (tmp_path / "all.obj").read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["{}/a.ply"], "a format that has groups (obj)"),
        (["{}/a_{{index}}.ply"], "a format that has groups (obj)"),
        (["-", "--output-format", "ply"], "a format that has groups (obj)"),
        (["-", "--output-format", "obj", "--report", "-"], "report is -"),
        (["{}/a_{{isovalue}}.ply", "--report", "{}/r.json"], "expected one file an item"),
        (["{}/a_{{isovalue}}.ply", "--report", "-"], "report is -"),
        (["{}/a_{{isovalue}}_{{nothing}}.ply"], "cannot be filled in"),
        (["{}/a_{{isovalue:.0f}}.ply"], "more digits"),
    ],
)
def test_files_that_cannot_be_told_apart_are_refused(run, tmp_path, words, message):
    words = [word.format(tmp_path) for word in words]
    result = run(*TORUS, *words, "-i", 0, "-i", 0.05)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())
    assert not any(tmp_path.iterdir())


def test_meshes_before_one_that_fails_stay_and_are_told_but_of_groups_none(run, tmp_path):
    result = run(*TORUS, tmp_path / "a_{isovalue}.ply", "-i", 0, "-i", 99)
    assert result.exit_code == 5
    assert "isovalue 0" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["a_0.ply"]
    assert run(*TORUS, tmp_path / "b.obj", "-i", 0, "-i", 99).exit_code == 5
    assert not (tmp_path / "b.obj").exists()


def test_what_is_true_of_the_volume_is_told_once(run, tmp_path):
    np.save(tmp_path / "a.npy", np.random.default_rng(0).random((8, 8, 8), np.float32))
    result = run("convert", tmp_path / "a.npy", tmp_path / "a_{isovalue}.ply", "-i", "0.3:0.7:0.2")
    assert result.stderr.count("warning: ") == 1
    assert result.stderr.count("8 x 8 x 8") == 1
    assert result.stderr.count("isovalue ") == 3


def test_kernels_of_the_index_are_those_of_several_isovalues_alone(run, tmp_path, monkeypatch):
    loaded = set()
    load = conversion.load_kernels
    monkeypatch.setattr(
        conversion,
        "load_kernels",
        lambda device, modules, progress: (
            loaded.update(module.__name__.rpartition(".")[2] for module in modules),
            load(device, modules, progress),
        ),
    )
    run(*TORUS, tmp_path / "a.ply", "-i", 0)
    assert "indexed_classification" not in loaded
    run(*TORUS, tmp_path / "a_{isovalue}.ply", "-i", 0, "-i", 0.05)
    assert "indexed_classification" in loaded
