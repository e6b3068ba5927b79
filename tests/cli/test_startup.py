"""`dmc --help` imports nothing that it does not show. Proved by modules, not by a clock."""

import os
import subprocess
import sys

import pytest

from dmc_cli.cli import dmc
from dmc_cli.version import VERSION

HEAVY = {
    *("warp", "numpy", "nibabel", "pydicom", "nrrd", "meshio", "rich", "orjson", "isal"),
    *("asyncio", "concurrent.futures", "hashlib", "importlib.metadata", "json", "logging", "pathlib"),
    *("secrets", "tempfile", "traceback", "click.shell_completion"),
}
"""What takes long to import, and nobody needs to read a help text."""

FOR_A_LIST = {
    "dmc_cli",
    *(f"dmc_cli.{name}" for name in ("cli", "errors", "files", "printable", "system", "version")),
    *(f"dmc_cli.cli.{name}" for name in ("group", "lazy", "signals", "terminal")),
    "dmc_cli.files.streams",
}
"""Our modules that are needed to list the commands."""

MOST_MODULES = 40
"""Modules beside click's own that a list of commands may import: 28 with Python 3.11."""

PROBE = """
import sys
import click
before = set(sys.modules)
from dmc_cli.cli import dmc
try:
    dmc(sys.argv[1:], prog_name="dmc")
except SystemExit as stop:
    assert not stop.code, stop.code
print(*sorted(set(sys.modules) - before), file=sys.stderr)
"""


def imported_by(*words, **variables):
    """Return the modules that a run of `dmc` imports, click's own apart, and what it prints."""
    result = subprocess.run(
        [sys.executable, "-S", "-c", PROBE, *words],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))} | variables,
        capture_output=True,
        encoding="utf-8",
        check=True,
        timeout=60,
    )
    return set(result.stderr.split()), result.stdout


@pytest.mark.parametrize("words", [["--help"], ["-h"], ["--version"]], ids=" ".join)
def test_the_list_of_commands_imports_none_of_them(words):
    modules, shown = imported_by(*words)
    assert "dmc" in shown
    assert {name for name in modules if name.startswith("dmc_cli")} <= FOR_A_LIST
    assert not modules & HEAVY
    assert len(modules) <= MOST_MODULES


@pytest.mark.parametrize("command", dmc.commands)
def test_help_of_a_command_imports_no_other_command_and_nothing_heavy(command):
    modules, shown = imported_by(command, "--help")
    assert f"dmc {command}" in shown
    assert {name for name in dmc.commands if f"dmc_cli.cli.{name}" in modules} == {command}
    assert modules & HEAVY <= ({"click.shell_completion"} if command == "completion" else set())


@pytest.mark.parametrize(
    ("words", "loaded"), [("dmc ", set()), ("dmc in", set()), ("dmc info --in", {"info"})], ids=repr
)
def test_completion_imports_the_command_that_is_there_and_no_other(words, loaded):
    modules, _ = imported_by(_DMC_COMPLETE="bash_complete", COMP_LINE=words)
    assert {name for name in dmc.commands if f"dmc_cli.cli.{name}" in modules} == {"completion"} | loaded
    assert not modules & (HEAVY - {"click.shell_completion"})


@pytest.mark.parametrize("name", dmc.commands)
def test_a_command_has_the_name_that_it_is_listed_under(name):
    command = dmc.commands[name].load()
    assert command.name == name
    assert command.help.partition("\n")[0]


def test_python_dash_m_is_the_same_program(run_process):
    result = run_process("--version")
    assert result.returncode == 0
    assert result.stdout == f"dmc, version {VERSION}\n"
