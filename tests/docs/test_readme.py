"""The README tells the truth: its commands run and print what it shows, its tables are the options."""

import re

import pytest

from dmc_cli.cli import dmc
from tests.docs.readme import (
    CONSOLE,
    FORMATS,
    README,
    ROOT,
    TABLE,
    console,
    format_table,
    option_table,
    timeless,
)

TEXT = README.read_text("utf-8")


def test_the_commands_print_what_is_shown(tmp_path):
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    blocks = [match[0] for match in CONSOLE.finditer(TEXT)]
    assert blocks
    for block in blocks:
        assert timeless(console(block, tmp_path)) == timeless(block), "run `make docs`"


def test_the_python_code_runs(tmp_path, monkeypatch, capsys):
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    monkeypatch.chdir(tmp_path)
    for code in re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL):
        exec(code, {})
    assert capsys.readouterr().out


@pytest.mark.parametrize("command", dmc.commands)
def test_every_command_is_mentioned(command):
    assert f"dmc {command}" in TEXT


@pytest.mark.parametrize(("command", "table"), [match.group(2, 3) for match in TABLE.finditer(TEXT)])
def test_the_tables_are_the_options(command, table):
    assert option_table(command) == table, "run `make docs`"


def test_the_table_of_formats_is_what_the_registries_have():
    assert FORMATS.search(TEXT)[2] == format_table(), "run `make docs`"


@pytest.mark.parametrize("target", sorted(set(re.findall(r"\bmake ([a-z-]+)\b", TEXT))))
def test_the_make_targets_exist(target):
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE)
