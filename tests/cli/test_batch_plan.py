"""A batch is planned from the tables of its file and from options before them, inputs and output names."""

import os

import click
import pytest

from dmc_cli.cli import dmc
from dmc_cli.cli.batch_plan import plan_batch
from dmc_cli.errors import SettingsError

NOT_IN_FILES = {"jobs", "junit", "quiet", "verbose", "help"}


@pytest.fixture
def plan(tmp_path, monkeypatch):
    """Plan as the command does, in a folder of its own; `files` are written there first."""
    monkeypatch.chdir(tmp_path)

    def call(*words, **files):
        for name, text in files.items():
            (tmp_path / name.replace("__", "/")).parent.mkdir(exist_ok=True)
            (tmp_path / name.replace("__", "/")).with_suffix(".toml").write_text(text)
        command = dmc.commands["batch"].load()
        with command.make_context("batch", [str(word) for word in words]) as ctx:
            values = {name: value for name, value in ctx.params.items() if name not in ("inputs", "jobs")}
            del values["quiet"], values["verbose"]
            return plan_batch(ctx, ctx.params["inputs"], values)

    return call


def paths(items):
    return [item.output.path for item in items]


def test_options_become_settings_of_every_item(plan):
    words = ["synth:torus:8", "synth:sphere:8", "-i", 0, "-i", 1, "--border", "closed", "--seed", 3]
    items = plan(
        *words,
        "--relax",
        2,
        "--threads",
        2,
        "--require",
        "closed",
        "--device",
        "cpu",
        "-o",
        "{index}-{isovalue}.obj",
    )
    assert [item.input for item in items] == ["synth:torus:8"] * 2 + ["synth:sphere:8"] * 2
    assert [item.surface.isovalue for item in items] == [0, 1, 0, 1]
    assert paths(items) == ["1-0.obj", "1-1.obj", "2-0.obj", "2-1.obj"]
    for item in items:
        assert (item.surface.border, item.read.seed, item.mesh.relax, item.threads) == ("closed", 3, 2, 2)
        assert (item.read.threads, item.output.require, item.device) == (2, ("closed",), "cpu")
        assert (item.output.report, item.output.halfedges) == (None, None)


def test_all_outputs_of_an_item_are_templates(plan):
    (item,) = plan("synth:torus:8", "-i", 0, "--report", "{stem}.json", "--halfedges", "{stem}.npz")
    assert item.output.path == "synth_torus_8_0.ply"
    assert (item.output.report, item.output.halfedges) == ("synth_torus_8.json", "synth_torus_8.npz")


@pytest.mark.parametrize("name", ["study.toml", "study.TOML"])
def test_paths_of_a_file_are_relative_to_it_and_an_output_of_the_command_line_is_not(plan, tmp_path, name):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / name).write_text(
        'inputs = ["a.nrrd", "synth:torus:8"]\nisovalue = 0\noutput = "{stem}.ply"\nreport = "{stem}.json"\n'
    )
    items = plan(f"in/{name}")
    assert [item.input for item in items] == ["in/a.nrrd", "synth:torus:8"]
    assert paths(items) == ["in/a.ply", "in/synth_torus_8.ply"]
    assert items[0].output.report == "in/a.json"
    assert paths(plan(f"in/{name}", "-o", "{stem}.obj")) == ["a.obj", "synth_torus_8.obj"]


def test_options_of_the_command_line_go_before_a_file_and_items_before_what_is_common(plan):
    text = 'inputs = "a"\nisovalue = 1\nborder = "closed"\noutput = "{stem}{isovalue}{index}.ply"\n'
    text += '[[items]]\nborder = "open"\n[[items]]\ninput = "b"\nisovalues = [2, 3]\ninside = "below"\n'
    items = plan("study.toml", study=text)
    assert [
        (item.input, item.surface.isovalue, item.surface.border, item.surface.inside) for item in items
    ] == [
        ("a", 1, "open", "above"),
        ("b", 2, "closed", "below"),
        ("b", 3, "closed", "below"),
    ]
    assert paths(items) == ["a11.ply", "b21.ply", "b31.ply"]
    changed = plan("study.toml", "--border", "closed", "-i", 9, study=text)
    assert {(item.surface.border, item.surface.isovalue) for item in changed} == {("closed", 9)}


def test_what_is_common_comes_first_where_every_item_has_inputs_of_its_own(plan):
    text = 'inputs = "a"\nisovalue = 1\n[[items]]\ninputs = "b"\n[[items]]\ninputs = "c"\n'
    assert [item.input for item in plan("study.toml", study=text)] == ["a", "b", "c"]


def test_a_file_without_items_and_values_as_options_take_them(plan):
    text = 'inputs = ["a"]\nisovalue = [0.5]\nspacing = [1, 2, 3.5]\nshape = [4, 5, 6]\nmemory = "2K"\n'
    text += 'require = ["closed", "manifold"]\nno-data = 1\n'
    with pytest.raises(SettingsError, match="'no_data' is no option of dmc batch"):
        plan("study.toml", study=text)
    (item,) = plan("study.toml", study=text.replace("no-data = 1", "input-format = 'raw'"))
    assert (item.read.spacing, item.read.shape) == ((1.0, 2.0, 3.5), (4, 5, 6))
    assert (item.output.memory, item.output.require) == (2048, ("closed", "manifold"))
    assert item.read.input_format == "raw"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("inputs = 'a'\nisovalue = 1\nisovalues = [2]", "'isovalues' gives isovalue a second time"),
        ("inputs = 'a'\ninput = 'b'\nisovalue = 1", "gives inputs a second time in one table"),
        (
            "inputs = 'a'\nisovalue = 1\njobs = 2",
            "'jobs' is no option of a file, give it on the command line",
        ),
        ("inputs = 'a'\nisovalue = 1\nquiet = true", "'quiet' is no option of a file"),
        ("inputs = 'a'\nisovalue = 1\nverbose = 2", "'verbose' is no option of a file"),
        ("inputs = 'a'\nisovalue = 1\nhelp = true", "'help' is no option of a file"),
        ("items = [1]", "items is no list of tables"),
        ("items = 'a'", "items is no list of tables"),
        ("inputs = 'a'\nisovalue = 'otsu:9'", "otsu:N:K, the Kth of N isovalues"),
        ("inputs = 'a'\nisovalue = 'x'", "isovalue is \\['x'\\]; 'x' is no isovalue"),
        ("inputs = 'no*such'\nisovalue = 1", "no file matches no\\*such"),
        ("inputs = ''\nisovalue = 1", "an input's name is empty"),
        ("inputs = 'a\\u0000'\nisovalue = 1".replace("'", '"'), r"inputs is 'a\\x00'; .*without .* NUL"),
        ("inputs = '\\u0000/..'\nisovalue = 1".replace("'", '"'), r"inputs is '\\x00/..'; .*without .* NUL"),
        ("inputs = []\nisovalue = 1", "no input was given"),
        ("isovalue = 1", "no input was given"),
        ("items = []\nisovalue = 1", "no input was given"),
        ("isovalue = 1\n[[items]]\ninputs = 'synth:iwp:8'\n[[items]]", "no input was given"),
        ("inputs = 'a'\nisovalue = " + "[" * 100_000, "is no TOML file: .*(nested|recursion)"),
        (
            "inputs = 'a'\nisovalue = 1\nrelax." + "a." * 2000 + "a = 1",
            "relax is .*; expected a text or a number|is no TOML file",
        ),
        ("inputs = 'a'\nisovalue = 0x" + "f" * 9000, "digits.*; expected a shorter number"),
        ("#" + "x" * (4 << 20), "is longer than 4 MiB"),
    ],
)
def test_a_file_that_cannot_be_meant_is_refused(plan, text, message):
    with pytest.raises(SettingsError, match=message):
        plan("study.toml", study=text)


def test_a_file_of_four_mebibytes_is_not_too_long(plan):
    text = "inputs = 'synth:iwp:8'\nisovalue = 1\n#"
    assert len(plan("study.toml", study=text + "x" * ((4 << 20) - len(text)))) == 1


def test_a_message_shows_the_first_200_characters_of_a_value(plan):
    text = "0123456789" * 30
    with pytest.raises(SettingsError) as caught:
        plan("study.toml", study=f"inputs = 'a'\nisovalue = 1\nborder = '{text}'")
    assert f" border is {repr(text)[:200]}; " in str(caught.value)


SCALARS = [
    "1979-05-27",
    "07:32:00",
    "1979-05-27T07:32:00Z",
    "true",
    "{a = 1}",
    "[[1]]",
    "[true]",
    "[1979-05-27]",
]


def test_no_option_takes_what_no_words_could_give(plan):
    options = {p.name: p for p in dmc.commands["batch"].load().params if p.name not in NOT_IN_FILES}
    for name, option in options.items():
        for value in SCALARS:
            if getattr(option, "is_flag", False) and value == "true":
                continue
            lines = {"inputs": "'synth:iwp:8'", "isovalue": "1"} | {name: value}
            with pytest.raises(SettingsError, match=rf"study.toml: {name} is "):
                plan("study.toml", study="\n".join(f"{key} = {text}" for key, text in lines.items()))


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("relax = 1.5", "'1.5' is not a valid integer"),
        ("remesh = 2.0", "'2.0' is not a valid integer"),
        ("relax = [1]", "expected a text or a number"),
        ("shape = [4, 5, 6.5]", "expected three integers"),
        ("require = [1]", "require is '1'; expected one of"),
        ("force = 1", "expected true or false"),
        ("force = 'true'", "expected true or false"),
        ("border = 1", "'1' is not one of"),
    ],
)
def test_a_value_is_refused_as_its_words_would_be(plan, line, message):
    with pytest.raises(SettingsError, match=message):
        plan("study.toml", study=f"inputs = 'synth:iwp:8'\nisovalue = 1\n{line}")


def test_a_value_becomes_what_its_words_would_become(plan):
    text = "inputs = 'synth:iwp:8'\nisovalue = [1, 0.1, '2']\nseries = 2\nproject = false\nsigma = 1\n"
    items = plan("study.toml", study=text)
    assert [item.surface.isovalue for item in items] == [1.0, 0.1, 2.0]
    assert (items[0].read.series, items[0].read.sigma, items[0].mesh.project) == ("2", 1.0, False)


@pytest.mark.parametrize("kind", ["device", "pipe", "folder"])
def test_only_a_file_is_read_as_one(plan, tmp_path, kind):
    path = tmp_path / "study.toml"
    {"device": lambda: path.symlink_to("/dev/zero"), "pipe": lambda: os.mkfifo(path), "folder": path.mkdir}[
        kind
    ]()
    with pytest.raises(SettingsError, match="give the name of"):
        plan("study.toml")


def test_patterns_are_expanded_in_order_and_a_name_that_looks_like_one_is_a_name(plan, tmp_path):
    (tmp_path / "deep" / "er").mkdir(parents=True)
    for name in ("b.nrrd", "a.nrrd", "c[1].nrrd", "deep/er/d.nrrd"):
        (tmp_path / name).touch()
    words = ["-i", 0, "-o", "{stem}.ply"]
    assert [item.input for item in plan("[a-b].nrrd", *words)] == ["a.nrrd", "b.nrrd"]
    assert [item.input for item in plan("c[1].nrrd", *words)] == ["c[1].nrrd"]
    assert "deep/er/d.nrrd" in [item.input for item in plan("**/*.nrrd", *words)]
    assert paths(plan(tmp_path / "a.nrrd", "-i", 0, "-o", "{parent}/{stem}.ply")) == [str(tmp_path / "a.ply")]


def test_two_files_on_the_command_line_are_inputs(plan):
    items = plan("a.toml", "b.toml", "-i", 0)
    assert [item.input for item in items] == ["a.toml", "b.toml"]


def test_without_isovalues_each_volume_decides(plan):
    (item,) = plan("a")
    assert (item.surface.isovalue, item.output.path) == (None, "a_auto.ply")
    assert [item.output.path for item in plan("a", "-i", "otsu:2:1", "-i", "20%", "-i", "5")] == [
        *("a_otsu-2-1.ply", "a_20%.ply", "a_5.ply")
    ]
    with pytest.raises(SettingsError, match=r"found \{isovalue:.2f\}"):
        plan("a", "-i", "otsu", "-o", "{stem}_{isovalue:.2f}.ply")


def test_a_batch_needs_one_file_an_item(plan):
    with pytest.raises(SettingsError, match=r"c\.ply is the output of a at 0 and of b at 0"):
        plan("a", "b", "-i", 0, "-o", "c.ply")
    with pytest.raises(click.UsageError, match="Missing"):
        plan()
