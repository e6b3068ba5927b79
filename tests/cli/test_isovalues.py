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
        (["{}/a.ply"], "a format that has groups (obj, glb"),
        (["{}/a_{{index}}.ply"], "a format that has groups (obj, glb"),
        (["-", "--output-format", "ply"], "a format that has groups (obj, glb"),
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


def told(run, tmp_path, *words):
    """Return the summary and the report's section on the surface of a conversion."""
    result = run("convert", *words, "--force", "--report", tmp_path / "told.json")
    assert result.exit_code == 0, result.stderr
    return result.stderr, json.loads((tmp_path / "told.json").read_text())["surface"]


def test_without_an_isovalue_bone_of_ct_is_taken_and_told(run, tmp_path, sample_data):
    summary, surface = told(run, tmp_path, sample_data / "dicom/head_ct", tmp_path / "a.ply")
    assert surface["isovalue"] == 300.0
    assert surface["choice"]["asked"] is None
    assert "bone is the default, of a CT in HU; others by -i: soft (-30)" in summary
    run("convert", sample_data / "dicom/head_ct", tmp_path / "b.ply", "-i", 300)
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()


def test_without_an_isovalue_half_of_a_mask_is_taken_and_otsu_of_what_else_there_is(run, tmp_path):
    mask = np.zeros((9, 9, 9), np.uint8)
    mask[2:6, 2:6, 2:6] = 1
    np.save(tmp_path / "mask.npy", mask)
    _, surface = told(run, tmp_path, tmp_path / "mask.npy", tmp_path / "a.ply")
    assert (surface["isovalue"], surface["choice"]["chosen"]) == (0.5, "50%")
    summary, surface = told(run, tmp_path, "synth:torus:16", tmp_path / "a.ply")
    assert surface["choice"]["chosen"] == "otsu"
    assert "otsu is the default, by the histogram; others by -i: otsu:2:1" in summary


def test_several_choices_are_several_files_or_groups(run, tmp_path):
    words = ["-i", "otsu", "-i", "30%", "-i", 0]
    assert run(*TORUS, tmp_path / "{isovalue}.ply", *words).exit_code == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0.ply", "30%.ply", "otsu.ply"]
    assert run(*TORUS, tmp_path / "all.obj", *words).exit_code == 0
    groups = [line for line in (tmp_path / "all.obj").read_text().split("\n") if line.startswith("g ")]
    assert [name.rpartition("_")[0] for name in groups] == ["g isovalue_otsu", "g isovalue_30%", "g isovalue"]
    result = run(*TORUS, tmp_path / "{isovalue}.ply", "-i", "otsu", "-i", "otsu", "--force")
    assert (result.exit_code, "isovalue otsu was given 2 times" in result.stderr) == (2, True)


def test_a_preset_of_values_that_are_not_told_to_be_in_hu_is_refused(run, tmp_path, sample_data):
    result = run("convert", sample_data / "nrrd/tooth.nrrd", tmp_path / "a.ply", "-i", "bone")
    assert result.exit_code == 2
    message = " ".join(result.stderr.split())
    assert "of nrrd without a word of HU, from 0 to 1300; expected a file that says HU itself" in message
    assert "-i 300" in message
    assert not any(tmp_path.iterdir())


def test_info_tells_kind_and_isovalues_and_draws_them(run, sample_data):
    result = run("info", sample_data / "dicom/head_ct")
    assert "kind      CT in HU" in result.stdout
    assert "◄ bone 300" in result.stdout
    description = json.loads(run("info", sample_data / "nrrd/tooth.nrrd", "--json").stdout)
    assert description["kind"] == "field"
    assert description["suggested_isovalues"][0] == {"choice": "otsu", "isovalue": 654.5}
    assert sum(description["histogram"]["counts"]) == 103 * 94 * 161
    listed = run("info", "synth:torus:16", "--isovalues", "-i", "30%", "-i", 0, "--json")
    assert [row["isovalue"] for row in json.loads(listed.stdout)["isovalues"]][1] == 0.0
    assert run("info", "synth:torus:16", "--isovalues", "-i", "band:0:1").exit_code == 2
