"""Templates of a batch's outputs: known fields, harmless formats, and no way out of a folder."""

from pathlib import Path

import pytest

from dmc_cli.cli.conversions import _name, _stem
from dmc_cli.cli.templates import fill_template, name_part
from dmc_cli.errors import SettingsError

FIELDS = {"stem": "scan", "name": "scan.nrrd", "parent": Path("in"), "isovalue": 0.25, "index": 7}


def filled(template, base=Path(), **fields):
    return fill_template("output", template, FIELDS | fields, base)


@pytest.mark.parametrize(
    ("template", "path"),
    [
        ("{stem}_{isovalue}.ply", "scan_0.25.ply"),
        ("{name}.ply", "scan.nrrd.ply"),
        ("{index:03d}-{isovalue:.1f}.obj", "007-0.2.obj"),
        ("{index:4}|{isovalue:8.3e}", "   7|2.500e-01"),
        ("{{stem}}{stem}", "{stem}scan"),
        ("plain.ply", "plain.ply"),
    ],
)
def test_fields_and_the_formats_of_numbers(template, path):
    assert filled(template) == path


@pytest.mark.parametrize(
    "template",
    [
        "{isovalue.real}",
        "{isovalue.x}",
        "{stem.__class__}",
        "{name[0]}",
        "{index!z}",
        "{index!r}",
        "{stem:>99999999999}",
        "{index:99999999999d}",
        "{index:100d}",
        "{isovalue:.999f}",
        "{isovalue:,}",
        "{stem:{index}}",
        "{index:{index}}",
        "{parent:s}",
        "{}",
        "{0}",
        "{stm}",
        "{stem",
        "stem}",
    ],
)
def test_anything_else_is_refused_with_what_is_known(template):
    with pytest.raises(SettingsError) as caught:
        filled(template)
    assert "expected {stem}, {name}, {parent}, {isovalue}, {index}" in str(caught.value)
    assert template in str(caught.value)


@pytest.mark.parametrize(
    "template", ["{isovalue.x}.ply", "{index!z}.ply", "{stem:>99999999999}.ply", "{0}.ply"]
)
def test_a_template_that_is_refused_ends_with_status_2(run, tmp_path, template):
    result = run("batch", "synth:sphere:8", "-i", 0, "-o", tmp_path / "a.ply", "--report", template)
    assert (result.exit_code, result.stdout) == (2, "")
    assert "{stem}, {name}, {parent}, {isovalue}, {index}" in " ".join(result.stderr.split())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("source", "stem"),
    [
        ("in/...nrrd", "__"),
        ("in/...nii.gz", "__"),
        ("in/..zip", "_"),
        ("in/.nrrd", ".nrrd"),
        ("in/a\\b.nrrd", "a_b"),
        ("synth:../../x:8", "synth_.._.._x_8"),
        ("synth:..", "synth_.."),
        ("in/a b.nrrd", "a b"),
    ],
)
def test_what_stands_for_an_input_is_one_part_of_a_path(source, stem):
    assert name_part(_stem(source)) == stem
    for part in (name_part(_stem(source)), name_part(_name(source))):
        assert Path("out", part).name == part
        assert part not in ("", ".", "..")


@pytest.mark.parametrize("text", ["", ".", "..", "...", "a/b", "/", "\0", "..\\.."])
def test_a_part_of_a_path_stays_in_its_folder(text):
    part = name_part(text)
    assert part.strip(".")
    assert not set(part) & set("/\\\0")


def test_the_name_of_the_folder_that_dots_mean(tmp_path, monkeypatch):
    (tmp_path / "ct" / "inner").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "ct" / "inner")
    assert [_stem("."), _stem(".."), _name("..")] == ["inner", "ct", "ct"]


@pytest.mark.parametrize(
    ("parent", "template", "path"),
    [
        ("in", "{parent}/{stem}.ply", "in/scan.ply"),
        ("../in", "{parent}/{stem}.ply", "../in/scan.ply"),
        ("/data/in", "{parent}/{stem}.ply", "/data/in/scan.ply"),
        ("a{b}c", "{parent}/{stem}.ply", "a{b}c/scan.ply"),
        (".", "out/{parent}/{stem}.ply", "out/scan.ply"),
        ("in/a", "out/{parent}/{stem}.ply", "out/in/a/scan.ply"),
        ("../in", "out/{parent}/{stem}.ply", "out/in/scan.ply"),
        ("../../in/../a", "out/{parent}/{stem}.ply", "out/in/a/scan.ply"),
        ("/data/in", "out/{parent}/{stem}.ply", "out/data/in/scan.ply"),
        ("in/a", "{parent}_{stem}.ply", "a_scan.ply"),
        ("in/a", "{stem}_{parent}.ply", "scan_a.ply"),
        ("/", "out_{parent}.ply", "out__.ply"),
    ],
)
def test_the_folder_of_an_input(parent, template, path):
    assert Path(filled(template, parent=Path(parent))) == Path(path)


def test_the_parent_as_a_name_is_looked_up_from_the_outputs_folder(tmp_path):
    (tmp_path / "study").mkdir()
    found = filled("{parent}_{stem}.ply", tmp_path / "study", parent=Path())
    assert found == str(tmp_path / "study" / "study_scan.ply")


@pytest.mark.parametrize("name", ["...nrrd", "{stem}.nrrd", "{{.nrrd", "100%.nrrd", "a\nb.nrrd"])
def test_odd_names_of_inputs_stay_in_the_outputs_folder(run, tmp_path, monkeypatch, name):
    inputs = tmp_path / "{in}"
    (inputs / "out").mkdir(parents=True)
    run("synth", "sphere", tmp_path / "s.nrrd", "-n", 8)
    (tmp_path / "s.nrrd").rename(inputs / name)
    before = set(tmp_path.rglob("*"))
    monkeypatch.chdir(tmp_path)
    result = run("batch", f"{{in}}/{name}", "-i", 0, "-o", "{parent}/out/{stem}.ply")
    assert result.exit_code == 0, result.output
    (made,) = set(tmp_path.rglob("*")) - before
    assert made.parent == inputs / "out"


@pytest.mark.parametrize("key", ["inputs", "output", "report", "halfedges"])
def test_nul_in_a_file_of_a_batch_is_a_usage_error(run, tmp_path, key):
    table = {"inputs": "synth:sphere:8", "isovalue": "0", "output": "a.ply"} | {key: "a\\u0000/b.npz"}
    text = "".join(f'{name} = "{value}"\n' for name, value in table.items())
    (tmp_path / "study.toml").write_text(text.replace('"0"', "0"))
    result = run("batch", tmp_path / "study.toml")
    assert result.exit_code == 2
    assert "expected a path without the character NUL" in result.stderr
