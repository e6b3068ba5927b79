"""Completion of commands, options, their words and file names, in the shells themselves where they are."""

import os
import shlex
import shutil
import subprocess
import sys

import click
import pytest

from dmc_cli.cli import dmc

SHELLS = ("bash", "zsh", "fish")
NAMES = {
    *("input", "inputs", "path", "mesh", "output", "volume", "against", "report", "halfedges", "figures"),
    *("label_names", "junit", "marked"),
}
"""Parameters that are files or folders."""

CASES = [
    ("dmc ", sorted(dmc.commands)),
    ("dmc comp", ["compare", "completion"]),
    ("dmc convert s", ["scans"]),
    ("dmc convert scans/", ["scans/a.nrrd", "scans/b c.nrrd"]),
    ("dmc convert 'scans/b ", ["scans/b c.nrrd"]),
    ("dmc convert synth:torus:8 m", ["mesh.ply"]),
    ("dmc convert a b --report m", ["mesh.ply"]),
    ("dmc convert a b --report=m", ["mesh.ply"]),
    ("dmc convert a b --inside ", ["above", "below"]),
    ("dmc convert a b --inside=ab", ["above"]),
    ("dmc convert a b --require closed,m", ["closed,manifold"]),
    ("dmc convert a b -i ", ["air", "bone", "fat", "lung", "otsu", "skin", "soft"]),
    ("dmc convert a b -i b", ["bone"]),
    ("dmc convert a b -i 1 -i 2 --inside ab", ["above"]),
]


@pytest.mark.parametrize("shell", SHELLS)
def test_the_script_calls_dmc(run, shell):
    result = run("completion", shell)
    assert result.exit_code == 0
    assert f"_DMC_COMPLETE={shell}_complete" in result.stdout
    assert result.stderr == ""


def completed(words, number=None, shell="bash", **variables):
    """What the program answers to a shell."""
    number = len(words.split()) if number is None else number
    asked = {"_DMC_COMPLETE": f"{shell}_complete", "COMP_WORDS": words, "COMP_CWORD": str(number)}
    result = subprocess.run(
        [sys.executable, "-m", "dmc_cli"],
        env=os.environ | asked | variables,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert result.stderr == ""
    return result.stdout.splitlines()


def test_values_of_an_option_are_completed():
    assert completed("dmc convert a b --topology m", 5) == ["plain,manifold"]


def test_bash_counts_an_equals_sign_as_a_word():
    assert completed("dmc convert a b --topology = m", 6) == ["plain,manifold"]
    assert completed("dmc", 0, COMP_LINE="dmc convert a b --topology=m") == ["plain,manifold"]


def completions(command, parameter, incomplete):
    with click.Context(dmc, info_name="dmc") as context:
        found = parameter.shell_complete(click.Context(command, parent=context), incomplete)
    return [(item.type, item.value) for item in found]


@pytest.mark.parametrize(
    ("name", "parameter"),
    [
        pytest.param(name, parameter, id=f"{name}-{parameter.name}")
        for name, command in dmc.commands.items()
        for parameter in command.load().params
    ],
)
def test_every_parameter_completes_what_it_takes(name, parameter):
    found = completions(dmc.commands[name].load(), parameter, "")
    if parameter.name in NAMES:
        assert found == [("file", "")]
    elif isinstance(parameter.type, click.Choice):
        assert found == [("plain", choice) for choice in parameter.type.choices]
    else:  # a number, a list of words, a name that no disk knows: never a file
        assert all(kind == "plain" for kind, _ in found)
        has_words = ("require", "table", "dtype", "device", "method", "values")
        names_isovalues = parameter.name == "isovalue" and name not in ("measure", "mesh")
        assert bool(found) == (parameter.name in has_words or names_isovalues)


def parameter_of(name, option):
    return next(parameter for parameter in dmc.commands[name].load().params if parameter.name == option)


@pytest.mark.parametrize(
    ("option", "incomplete", "words"),
    [
        (
            "require",
            "",
            ["manifold", "closed", "all-quads", "on-surface", "no-self-intersections", "fe", "print"],
        ),
        ("require", "m", ["manifold"]),
        (
            "require",
            "closed,",
            [
                *("closed,manifold", "closed,all-quads", "closed,on-surface"),
                *("closed,no-self-intersections", "closed,fe", "closed,print"),
            ],
        ),
        ("require", "closed,manifold,o", ["closed,manifold,on-surface"]),
        ("dtype", "float", ["float32", "float64"]),
        ("device", "c", ["cpu", "cuda"]),
    ],
)
def test_words_are_completed(option, incomplete, words):
    found = completions(dmc.commands["convert"].load(), parameter_of("convert", option), incomplete)
    assert [value for _, value in found] == words


@pytest.fixture
def shell_folder(tmp_path, monkeypatch):
    """A folder with files to complete, and with a `dmc` that the shells find."""
    (tmp_path / "scans").mkdir()
    for name in ("scans/a.nrrd", "scans/b c.nrrd", "mesh.ply"):
        (tmp_path / name).touch()
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "dmc"
    program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m dmc_cli "$@"\n')
    program.chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("HOME", str(tmp_path))
    package = os.path.dirname(os.path.dirname(sys.modules["dmc_cli"].__file__))
    monkeypatch.setenv("PYTHONPATH", package)
    return tmp_path


def shell_output(shell, script, *options):
    words = [shell, *options, "-c", script]
    result = subprocess.run(words, capture_output=True, encoding="utf-8", timeout=100, check=False)
    assert result.stderr == ""
    return result.stdout


@pytest.mark.skipif(not shutil.which("bash"), reason="bash is not on this machine")
def test_bash_completes_with_the_script(run, shell_folder):
    lines = [line for line, _ in CASES]
    script = [run("completion", "bash").stdout]
    for line in lines:
        script += [
            f"COMP_LINE={shlex.quote(line)}; COMP_POINT={len(line)}; COMP_WORDS=(dmc); COMP_CWORD=0",
            '_dmc_completion dmc; printf "%s|" "${COMPREPLY[@]}"; echo',
        ]
    script += [
        "COMP_WORDS=(dmc convert scans/a.nrrd mes); COMP_CWORD=3; unset COMP_LINE; _dmc_completion dmc"
    ]
    script += ['echo "${COMPREPLY[*]}"', "complete -p dmc"]
    found = shell_output("bash", "\n".join(script), "--norc", "--noprofile").splitlines()
    for (line, words), answer in zip(CASES, found, strict=False):
        assert sorted(word for word in answer.split("|") if word) == words, line
    assert found[-2:] == ["mesh.ply", "complete -o nosort -F _dmc_completion dmc"]


@pytest.mark.skipif(not shutil.which("fish"), reason="fish is not on this machine")
def test_fish_completes_with_the_script(run, shell_folder):
    (shell_folder / "dmc.fish").write_text(run("completion", "fish").stdout)
    wanted = {
        "dmc convert scans/a": ["scans/a.nrrd"],
        "dmc convert a b --report m": ["mesh.ply"],
        "dmc convert a b --inside a": ["above"],
        "dmc convert a b -i ": [],
    }
    for line, words in wanted.items():
        script = f"source dmc.fish; complete -C {shlex.quote(line)}"
        assert shell_output("fish", script, "--no-config").split() == words


@pytest.mark.skipif(not shutil.which("zsh"), reason="zsh is not on this machine")
def test_zsh_takes_the_script(run, shell_folder):
    (shell_folder / "_dmc").write_text(run("completion", "zsh").stdout)
    script = "autoload -Uz compinit; compinit -u -D; source ./_dmc; echo $_comps[dmc]"
    assert shell_output("zsh", script, "-f").strip() == "_dmc_completion"
    text = (shell_folder / "_dmc").read_text()
    assert "_path_files -f" in text
    assert text.index("compset -P '*='") < text.index("for type key")
