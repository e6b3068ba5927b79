"""Each command's help ends with examples, and the examples run."""

import re
import shlex

import click
import pytest

from dmc_cli.cli import dmc
from tests.docs.readme import ROOT, output_of


def examples(command):
    text = dmc.commands[command].load().help
    return re.findall(r"^\s+(dmc .*)$", text.partition("Examples:")[2], re.MULTILINE)


@pytest.mark.parametrize("command", dmc.commands)
def test_help_has_two_examples(command):
    own = [example for example in examples(command) if shlex.split(example)[1] == command]
    assert len(own) >= 2  # another command may come first, to make what this one needs


@pytest.mark.parametrize("command", dmc.commands)
def test_examples_keep_their_lines(command, run):
    lines = [line.strip() for line in run(command, "--help").stdout.splitlines()]
    assert set(examples(command)) <= set(lines)


@pytest.mark.parametrize("command", dmc.commands)
def test_every_option_has_help(command):
    assert all(
        option.help for option in dmc.commands[command].load().params if isinstance(option, click.Option)
    )


@pytest.mark.parametrize("command", dmc.commands)
def test_the_examples_have_options_and_words_that_there_are(command, monkeypatch):
    monkeypatch.chdir(ROOT)
    for example in examples(command):
        _, name, *words = shlex.split(example)
        parent = click.Context(dmc, info_name="dmc", **dmc.context_settings)
        with dmc.commands[name].load().make_context(name, words, parent=parent):
            pass


@pytest.mark.slow
@pytest.mark.parametrize("command", dmc.commands)
def test_the_examples_run(command, tmp_path):
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    for example in examples(command):
        output_of(example, tmp_path)


@pytest.mark.parametrize(
    "told",
    [
        "[default: open]",
        "[default: outward]",
        "Of dmc: manifold (default), asymptotic.",
        "Of dmc: exact (default), sampled, iterative, centroid. Of dc: qef (default), paper, particle.",
    ],
)
def test_defaults_are_told_of_each_method_where_they_differ(run, told):
    assert told in " ".join(run("convert", "--help").stdout.split())


def test_a_context_without_settings_changes_no_help(run):
    """The help option of a command is made once a process: here by a context as completion has it."""
    command = dmc.commands["measure"].load()
    command.get_params(click.Context(command))
    assert "-h, --help" in run("measure", "--help").stdout


def test_options_stand_under_their_headings_and_general_ones_last(run):
    text = run("convert", "--help").stdout
    headings = re.findall(r"^([A-Z][\w ]*):$", text, re.MULTILINE)
    expected = [
        "Surface",
        "Part",
        "Labels",
        "Mesh",
        "Input",
        "Raw input",
        "Noise",
        "Output",
        "Run",
        "General",
    ]
    assert headings[-len(expected) :] == expected
    for before, option, after in (("Surface:", "-i, --isovalue", "Mesh:"), ("Run:", "--memory", "General:")):
        assert text.index(before) < text.index(option) < text.index(after)
    assert re.search(r"-v, --verbose +Print more; -vv adds tracebacks\.\n", text)
    assert text.index("--isovalue") < text.index("--method") < text.index("--topology")
    assert text.index("Input:") < text.index("--spacing") < text.index("Raw input:")
    assert text.index("General:") < text.index("-q, --quiet") < text.index("-h, --help")
