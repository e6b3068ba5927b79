"""Nothing that a terminal obeys is ever printed, wherever a text comes from; JSON has escapes of its own."""

import io
import json
import os
import subprocess
import sys
import unicodedata
import zipfile
from contextlib import suppress

import click
import numpy as np
import pytest
from click.testing import CliRunner

from dmc_cli.cli.group import DmcGroup
from dmc_cli.cli.progress import BarProgress, LineProgress, shown_progress
from dmc_cli.cli.terminal import PrintableStream, escape_streams, unescaped
from dmc_cli.errors import VolumeError
from dmc_cli.printable import json_text, printable

EVIL = "\x1b[31mred\x1b]0;title\x07 \x9b2J \x7f\r\x08 \u202eoverride\u2066 \u200b\ufeff \u2028\udcff"
SHOWN = r"\x1b[31mred\x1b]0;title\x07 \x9b2J \x7f\r\x08 \u202eoverride\u2066 \u200b\ufeff \u2028\udcff"
HONEST = "Schädel 頭部　CT 🦴 mm² naïve"


def assert_harmless(text, keep="\n\t"):
    """No control or format character, no half of one, nothing private or unassigned."""
    found = {letter for letter in text if unicodedata.category(letter) in ("Cc", "Cf", "Cs", "Co", "Cn")}
    assert found <= set(keep), found


def test_what_is_not_printed_is_escaped_and_the_rest_stays():
    assert printable(EVIL) == SHOWN
    assert printable(HONEST) == HONEST
    assert printable("a\n\tb") == "a\n\tb"
    assert printable("a\n\tb", keep="") == r"a\n\tb"


@pytest.mark.parametrize("indent", [None, 2])
def test_json_can_be_printed_and_reads_back(indent):
    value = {EVIL: [EVIL, HONEST, 1.5, None], "astral": "\U000e0041"}
    text = json_text(value, indent)
    assert_harmless(text)
    assert HONEST in text
    assert json.loads(text.encode()) == value
    assert json_text({"a": "b"}) == '{"a": "b"}'
    with pytest.raises(ValueError, match="JSON"):
        json_text(float("nan"))


def test_every_character_of_the_first_plane_is_harmless():
    text = " ".join(map(chr, range(0x10000)))
    assert_harmless(printable(text))
    assert_harmless(json_text(text))
    assert json.loads(json_text(text)) == text


def group_that(action):
    @click.group(cls=DmcGroup)
    def group():
        pass

    @group.command()
    def act():
        action()

    return group


def raise_error():
    raise VolumeError(f"{EVIL}\nError: forged\n  a line of a list")


@pytest.mark.parametrize(
    "action", [lambda: click.echo(EVIL), lambda: click.echo(EVIL, err=True), raise_error]
)
def test_messages_are_escaped(action):
    output = CliRunner().invoke(group_that(action), ["act"]).output
    assert_harmless(output)
    assert SHOWN in output


def test_a_name_forges_no_message():
    result = CliRunner().invoke(group_that(raise_error), ["act"])
    assert result.exit_code == 3
    assert result.stderr == f"Error: {SHOWN}\\nError: forged\n  a line of a list\n"


@pytest.mark.parametrize(
    "words",
    [
        [EVIL],
        ["--" + EVIL],
        ["convert", "--" + EVIL],
        ["convert", "a", "b", "--inside", EVIL],
        ["convert", "a", "b", "-i", EVIL],
        ["convert", "a", "b", "--memory", EVIL],
        ["convert", "a", "b", EVIL, "-i", "0"],
        ["convert", EVIL, "a.ply", "-i", "0"],
        ["convert", "synth:sphere:8", EVIL + ".ply/b.ply", "-i", "0"],
        ["convert", "synth:sphere:8", "a." + EVIL, "-i", "0"],
        ["convert", "synth:" + EVIL, "a.ply", "-i", "0"],
        ["info", EVIL],
        ["info", EVIL, "-vv"],
        ["measure", EVIL + ".ply"],
        ["batch", EVIL + ".toml"],
        ["batch", "a", "-i", "0", "-o", "{" + EVIL + "}"],
    ],
    ids=repr,
)
def test_arguments_are_repeated_harmlessly(run, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    result = run(*words)
    assert result.exit_code in (2, 3, 9)
    assert_harmless(result.output)
    assert "\\x1b" in result.stderr
    assert "\\u202e" in result.stderr


def test_streams_escape_warnings_and_logs_of_libraries(monkeypatch):
    pipe = io.TextIOWrapper(io.BytesIO(), "utf-8")
    monkeypatch.setattr("sys.stderr", pipe)
    monkeypatch.setattr("sys.stdout", None)
    escape_streams()
    escape_streams()  # once is enough
    assert sys.stdout is None
    assert unescaped(sys.stderr) is pipe
    print(EVIL, file=sys.stderr)  # as warnings and logging do
    sys.stderr.writelines(["one ", EVIL])
    sys.stderr.flush()
    told = pipe.buffer.getvalue().decode()
    assert told.count(SHOWN) == 2
    assert_harmless(told)


@pytest.mark.parametrize(("encoding", "shown"), [("ascii", "²"), ("utf-8", "²"), ("iso8859-5", r"\xb2")])
def test_no_encoding_of_a_stream_ends_in_a_traceback(monkeypatch, encoding, shown):
    pipe = io.TextIOWrapper(io.BytesIO(), encoding)
    monkeypatch.setattr("sys.stdout", pipe)
    escape_streams()
    click.echo("mm²")
    sys.stdout.flush()
    assert shown.encode("utf-8") in pipe.buffer.getvalue()


def test_the_traceback_of_a_bug_is_escaped(tmp_path):
    program = (
        "import sys, dmc_cli.cli as cli, dmc_cli.cli.description as d\n"
        "def broken(*_): raise ZeroDivisionError(sys.argv[2])\n"
        "d.describe = broken\n"
        "cli.main()"
    )
    words = [sys.executable, "-c", program, "info", os.fsencode(EVIL)]
    result = subprocess.run(words, capture_output=True, check=False)
    assert result.returncode == 1
    told = result.stderr.decode()
    assert "ZeroDivisionError: \\x1b[31mred" in told
    assert_harmless(told)


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_lines_and_bars_of_progress_are_escaped(monkeypatch, capsys):
    with LineProgress().stage(EVIL):
        pass
    assert SHOWN in capsys.readouterr().err
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    escape_streams()
    with shown_progress(quiet=False, verbose=1) as progress:
        assert isinstance(progress, BarProgress)
        with progress.stage(EVIL):
            progress.note("a \x1b]0;title\x07\r\nfact")
    shown = terminal.getvalue()
    assert r"a \x1b]0;title\x07\r\nfact" in shown
    assert "\x1b]0;" not in shown
    assert "\x1b[" in shown  # the bar's own codes go through
    assert isinstance(sys.stderr, PrintableStream)


def test_names_of_files_are_shown_harmlessly_in_summaries_and_reports(run, tmp_path, monkeypatch):
    monkeypatch.chdir(os.fsencode(tmp_path))
    name = "\x1b[31m\u202e\n\x9bx\udcff"
    run("synth", "sphere", f"{name}.nrrd", "-n", 8)
    words = ["convert", f"{name}.nrrd", f"{name}.ply", "-i", 0, "--report"]
    to_file, streamed = run(*words, f"{name}.json"), run(*words, "-", "--force")
    for result in (to_file, streamed, run("info", f"{name}.nrrd"), run("measure", f"{name}.ply")):
        assert result.exit_code == 0, result.output
        assert_harmless(result.output)
    with open(f"{name}.json", "rb") as file:
        assert json.load(file)["input"]["path"] == f"{name}.nrrd"
    assert json.loads(streamed.stdout)["settings"]["output"] == f"{name}.ply"
    assert r"path      \x1b[31m\u202e\n\x9bx\udcff.nrrd" in run("info", f"{name}.nrrd").stdout
    for command, file in (("info", f"{name}.nrrd"), ("measure", f"{name}.ply")):
        result = run(command, file, "--json")
        assert_harmless(result.stdout)
        found = json.loads(result.stdout)
        assert (found.get("path") or found["mesh"]["path"]) == file
    batch = run("batch", f"{name}.nrrd", "-i", 0, "-o", "{stem}_{isovalue}.ply")
    assert_harmless(batch.output)
    assert json.loads(batch.stdout)["output"] == f"{name}_0.ply"


def test_texts_of_dicom_and_names_in_a_zip_are_shown_harmlessly(run, sample_data, tmp_path):
    import pydicom

    slices = sorted((sample_data / "dicom" / "head_ct").iterdir())[:5]
    with zipfile.ZipFile(tmp_path / "ct.zip", "w") as archive:
        for number, path in enumerate(slices):
            dataset = pydicom.dcmread(path)
            dataset.SpecificCharacterSet = "ISO_IR 192"
            dataset.SeriesInstanceUID = f"1.2.{number // 2}"
            dataset.SeriesDescription = "\x1b[2J\u202e\nmesh      0"
            buffer = io.BytesIO()
            dataset.save_as(buffer)
            archive.writestr("../" * (number == 4) + f"{number}\x1b[31m\u202e\n", buffer.getvalue())
    words = [tmp_path / "ct.zip", tmp_path / "a.ply", "-i", 0]
    for result in (
        run("info", words[0]),
        run("info", words[0], "--json"),
        run("info", words[0], "--series", 1),
        run("convert", *words),
        run("convert", *words, "--series", 1),
    ):
        assert_harmless(result.output)
        assert "u202e" in result.output
        assert "mesh      0" not in [line.strip() for line in result.output.splitlines()]


def test_keys_of_an_archive_of_arrays_are_shown_harmlessly(run, tmp_path):
    np.savez(tmp_path / "a.npz", **{"\x1b[31m\u202ea": np.zeros((3, 3, 3)), "b": np.zeros((3, 3, 3))})
    result = run("info", tmp_path / "a.npz")
    assert_harmless(result.output)


def test_data_go_to_standard_output_while_a_bar_is_on_the_terminal(tmp_path):
    pty = pytest.importorskip("pty")
    master, slave = pty.openpty()
    words = [sys.executable, "-m", "dmc_cli", "batch", "synth:sphere:12", "synth:torus:12", "-i", "0"]
    environment = os.environ | {"TERM": "xterm"}
    with (
        (tmp_path / "lines").open("wb") as lines,
        subprocess.Popen(words, cwd=tmp_path, env=environment, stdout=lines, stderr=slave),
    ):
        os.close(slave)
        with suppress(OSError):  # Linux's way to tell that the other end is closed
            while os.read(master, 65536):
                pass
    os.close(master)
    found = (tmp_path / "lines").read_text().splitlines()
    assert [json.loads(line)["status"] for line in found] == [0, 0]
