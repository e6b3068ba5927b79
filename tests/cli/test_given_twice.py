"""An option that decides what is made is given once; a second one is never taken in silence."""

import click
import pytest

from dmc_cli.cli import dmc

VOLUME = ["synth:sphere:8", "out.ply"]
LAST_COUNTS = {"device", "threads", "memory", "jobs"}
OPTIONS = [
    pytest.param(command, option, id=f"{command}{option.opts[-1]}")
    for command in dmc.commands
    for option in dmc.commands[command].load().params
    if isinstance(option, click.Option) and not (option.is_flag or option.count or option.multiple)
]


@pytest.mark.parametrize(("command", "option"), OPTIONS)
def test_only_options_that_change_no_result_may_be_given_twice(command, option):
    value = option.type.choices[0] if isinstance(option.type, click.Choice) else "1"
    message = ""
    try:
        dmc.commands[command].load().make_context(command, [option.opts[-1], value] * 2)
    except click.UsageError as error:
        message = error.message
    assert ("was given 2 times; expected once; " in message) == (option.name not in LAST_COUNTS)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["convert", *VOLUME, "-i", 0, "--isovalue=0"], "isovalue 0 was given 2 times; expected each once;"),
        (["convert", *VOLUME, "-i", 0.1, "-i", "0:0.2:0.1"], "isovalue 0.1 was given 2 times"),
        (["measure", "m.ply", "--volume", "a", "-i", 0, "-i", 0], "'-i' / '--isovalue' was given 2 times"),
        (
            ["convert", *VOLUME, "-i", 0, "--require", "closed", "--require", "manifold"],
            "'--require' was given 2 times; expected once; give one list, with commas between",
        ),
        (["reproduce", "--table", "3", "--table", "8"], "give one list, with commas between"),
        (["batch", "synth:sphere:8", "-i", 0, "-o", "a.ply", "-o", "b.ply"], "'-o' / '--output' was given 2"),
        (["convert", *VOLUME, *["-i", 0] * 3], "isovalue 0 was given 3 times"),
        (["convert", *VOLUME, *["--border", "open"] * 3], "was given 3 times"),
    ],
)
def test_a_second_value_is_refused_before_any_work(run, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    result = run(*words)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())
    assert list(tmp_path.iterdir()) == []


def test_the_last_of_flags_and_of_options_of_the_run_counts(run, tmp_path):
    words = ["convert", "synth:sphere:8", tmp_path / "a.obj", "-i", 0, "--threads", 1, "--threads", 2]
    result = run(*words, "--device", "cuda:99", "--device", "cpu", "--normals", "--no-normals", "-q", "-q")
    assert (result.exit_code, result.stderr) == (0, "")
    assert b"\nvn " not in (tmp_path / "a.obj").read_bytes()


def test_help_is_given_all_the_same(run):
    assert run("convert", "-i", 0, "-i", 1, "--help").stdout.startswith("Usage: ")


def test_isovalues_of_a_batch_are_meant_to_be_several(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run("batch", "synth:sphere:8", "-i", 0, "-i", 0.1).exit_code == 0
    assert {path.name for path in tmp_path.iterdir()} == {"synth_sphere_8_0.ply", "synth_sphere_8_0.1.ply"}
