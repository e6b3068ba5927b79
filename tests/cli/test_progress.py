"""Bars only on a terminal, lines only on request, nothing on standard output."""

import io
import re
import sys

import pytest

from dmc_cli.cli.progress import BarProgress, LineProgress, echo_data, shown_progress
from dmc_cli.progress import SILENT


class Terminal(io.StringIO):
    def isatty(self):
        return True


def use(progress):
    with progress.stage("reading"):
        progress.advance(0.25)
        with progress.stage("compiling kernels"):
            progress.note("a fact")
        progress.advance(1.0)


@pytest.mark.parametrize(("quiet", "verbose"), [(True, 0), (True, 2), (False, 0)])
def test_without_a_terminal_silence_is_the_default(quiet, verbose):
    with shown_progress(quiet=quiet, verbose=verbose) as progress:
        assert progress is SILENT


def test_verbose_lines_tell_stages_and_notes(capsys):
    with shown_progress(quiet=False, verbose=1) as progress:
        assert isinstance(progress, LineProgress)
        use(progress)
    captured = capsys.readouterr()
    assert captured.out == ""
    assert [line.split(":")[0] for line in captured.err.splitlines()] == [
        "a fact",
        "compiling kernels",
        "reading",
    ]


@pytest.mark.parametrize("verbose", [0, 1])
def test_a_terminal_gets_a_bar_that_names_the_stage(monkeypatch, verbose):
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    with shown_progress(quiet=False, verbose=verbose) as progress:
        assert isinstance(progress, BarProgress)
        use(progress)
    assert ("a fact" in terminal.getvalue()) == bool(verbose)


def test_no_color_is_honoured(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("NO_COLOR", "1")
    with shown_progress(quiet=False, verbose=1) as progress:
        use(progress)
    assert not re.search(r"\x1b\[(\d+;)*[39]\d(;\d+)*m", terminal.getvalue())


def test_a_stage_that_fails_leaves_the_bar_usable():
    with pytest.raises(ValueError, match="broken"), LineProgress().stage("reading"):
        raise ValueError("broken")


def test_kernels_that_are_compiled_already_are_not_said_to_be_compiled(run_process, tmp_path):
    words = ["convert", "synth:torus:16", str(tmp_path / "a.ply"), "-i", "0", "--force", "-v"]
    run_process(*words)
    messages = run_process(*words).stderr
    assert "loading kernels" in messages
    assert "compiling" not in messages


def on_one_terminal(*words, folder):
    """Standard output and standard error of `dmc` as a terminal shows them, control sequences and all."""
    import os
    import pty
    import subprocess
    import sys

    master, slave = pty.openpty()
    command = [sys.executable, "-m", "dmc_cli", *words]
    with subprocess.Popen(command, cwd=folder, stdin=slave, stdout=slave, stderr=slave) as process:
        os.close(slave)
        shown = b""
        while True:
            try:
                piece = os.read(master, 65536)
            except OSError:  # Linux's way to tell that the other end is closed
                break
            if not piece:
                break
            shown += piece
    os.close(master)
    return process.returncode, shown.decode()


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_lines_of_data_and_bars_do_not_mix_on_a_terminal(tmp_path, monkeypatch, jobs):
    monkeypatch.setenv("TERM", "xterm")
    words = ["synth:torus:16", "synth:sphere:16", "-i", "0", "--jobs", jobs]
    status, shown = on_one_terminal("batch", *words, folder=tmp_path)
    assert status == 0
    control = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
    lines = [control.sub("", line) for line in re.split(r"[\r\n]+", shown)]
    outcomes = [line for line in lines if '{"input"' in line]
    assert len(outcomes) == 2
    assert all(line.startswith("{") and line.endswith("}") for line in outcomes)


def test_a_stage_that_fails_takes_its_bar_away(monkeypatch):
    monkeypatch.setattr("sys.stderr", Terminal())
    monkeypatch.setenv("TERM", "xterm")
    with shown_progress(quiet=False, verbose=0) as progress:
        progress.advance(0.5)  # of no stage
        with progress.stage("outer"):
            with pytest.raises(ValueError, match="broken"), progress.stage("inner"):
                raise ValueError("broken")
            progress.advance(0.25)
            (task,) = progress._bar.tasks
            assert (task.description, task.completed, task.total) == ("outer", 0.25, 1.0)
        assert not progress._bar.tasks


def test_data_are_printed_whoever_listens(capsys):
    echo_data("a line", SILENT)
    assert capsys.readouterr().out == "a line\n"


def test_data_are_printed_on_a_terminal_without_a_bar(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr("sys.stdout", terminal)
    echo_data("a line", SILENT)
    assert terminal.getvalue() == "a line\n"


def test_lines_of_data_take_the_bars_off_a_terminal_that_both_are_on(monkeypatch):
    told = []
    monkeypatch.setattr("sys.stderr", Terminal())
    monkeypatch.setattr("sys.stdout", Terminal())
    monkeypatch.setenv("TERM", "xterm")
    with shown_progress(quiet=False, verbose=0) as progress:
        bar = progress._bar
        monkeypatch.setattr(bar, "stop", lambda: told.append(f"hidden, {sys.stdout.getvalue()!r} printed"))
        monkeypatch.setattr(bar, "start", lambda: told.append(f"shown, {sys.stdout.getvalue()!r} printed"))
        echo_data("data", progress)
        assert told == ["hidden, '' printed", "shown, 'data\\n' printed"]
        monkeypatch.undo()


def test_the_streams_stay_as_they_are_while_there_is_a_bar(monkeypatch):
    terminal, output = Terminal(), Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setattr("sys.stdout", output)
    monkeypatch.setenv("TERM", "xterm")
    with shown_progress(quiet=False, verbose=0):
        assert sys.stderr is terminal
        assert sys.stdout is output
