"""The README's generated parts: what its commands print, and the tables of options.

`make docs` writes them anew (python -m tests.docs.readme); the tests fail where they are stale.
"""

import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import click

from dmc_cli import mesh_formats, volume_formats
from dmc_cli.cli import dmc

ROOT = Path(__file__).resolve().parent.parent.parent
README = ROOT / "README.md"
CONSOLE = re.compile(r"(?<=```console\n)(.*?)(?=```)", re.DOTALL)
TABLE = re.compile(r"(<!-- options of (\w+) -->\n)(.*?)(?=<!-- end -->)", re.DOTALL)
FORMATS = re.compile(r"(<!-- formats -->\n)(.*?)(?=<!-- end -->)", re.DOTALL)
CHANGES = re.compile(r'^time .*|\d+(\.\d+)? (ms|s)\b|(?<="seconds": )[\d.]+', re.MULTILINE)


def refreshed(text, folder):
    """Return the README with its outputs and tables as they are now; commands run in `folder`."""
    (folder / "sample_data").symlink_to(ROOT / "sample_data")
    text = CONSOLE.sub(lambda match: console(match[0], folder), text)
    text = FORMATS.sub(lambda match: match[1] + format_table(), text)
    return TABLE.sub(lambda match: match[1] + option_table(match[2]), text)


def timeless(text):
    """Return the text without what differs from run to run and from machine to machine."""
    return CHANGES.sub("", text)


def console(block, folder):
    """Run the commands of a block, the lines with a `$`, and return it with what they print now."""
    commands = [line for line in block.splitlines() if line.startswith("$ ")]
    return "".join(f"{command}\n{output_of(command[2:], folder)}" for command in commands)


def output_of(command, folder):
    """Return what a `dmc` command prints on both streams; it has to succeed."""
    program, *words = shlex.split(command)
    if program != "dmc":
        raise ValueError(f"{command}: only dmc commands stand in the README's console blocks")
    run = subprocess.run(
        [sys.executable, "-m", "dmc_cli", *words],
        cwd=folder,
        env=os.environ | {"CUDA_VISIBLE_DEVICES": ""},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        check=False,
        timeout=200,
    )
    if run.returncode:
        raise RuntimeError(f"{command} ended with status {run.returncode}:\n{run.stdout}")
    return run.stdout


def format_table():
    """Return the formats of volumes and meshes as a Markdown table, as the registries have them."""
    volumes = [named(known.title, known.suffixes) for known in volume_formats.FORMATS.values()]
    meshes = [
        f"{known.title} ({known.suffix}{', or text with `--ascii`' if known.encoding == 'either' else ''})"
        for known in mesh_formats.FORMATS.values()
    ]
    quads, normals, vertex_values, face_values, groups, colors = (
        ", ".join(known.title for known in mesh_formats.FORMATS.values() if getattr(known, f"holds_{what}"))
        for what in ("quads", "normals", "vertex_values", "face_values", "groups", "colors")
    )
    lines = ["| | formats |", "| --- | --- |"]
    lines.append(f"| volumes | {', '.join([*volumes, 'synthetic fields'])} |")
    lines.append(f"| meshes | {', '.join(meshes)} |")
    lines.append(f"| quads stay whole in | {quads}; elsewhere they are split, which the summary says |")
    lines.append(f"| normals in | {normals} |")
    lines.append(f"| values of vertices in | {vertex_values} |")
    lines.append(f"| values of faces in | {face_values} |")
    lines.append(f"| several parts in | {groups} |")
    lines.append(f"| colours of labels in | {colors} |")
    schemas = ", of labels by ".join(
        f"[docs/{name}](docs/{name})" for name in ("report-schema.json", "labels-report-schema.json")
    )
    lines.append(f"| report | JSON, described by {schemas} |")
    return "\n".join(lines) + "\n"


def named(title, suffixes):
    """Return a format's title with the suffixes that mean it."""
    words = ", ".join(suffixes)
    return (
        f"{title[:-1]}; {words})"
        if words and title.endswith(")")
        else title + (f" ({words})" if words else "")
    )


def option_table(command):
    """Return the options of a command as a Markdown table, in the order of its help."""
    lines = ["| option | default | what it does |", "| --- | --- | --- |"]
    loaded = dmc.commands[command].load()
    context = click.Context(loaded, info_name=command)
    for option in loaded.params:
        if isinstance(option, click.Option):
            names, words = option.get_help_record(context)
            what = " ".join(words.partition("[default:")[0].split())
            names = names.replace("|", " \\| ")
            lines.append(f"| `{names}` | {shown_default(option)} | {what} |")
    return "\n".join(lines) + "\n"


def shown_default(option):
    """Return the default as a user would type it, empty where there is none."""
    if isinstance(option.show_default, str):
        return f"`{option.show_default}`"
    default = option.default
    if not isinstance(default, (str, int, float, tuple)) or default == () or option.count:
        return ""
    if isinstance(default, bool):
        on, off = option.opts[0], (option.secondary_opts or [""])[0]
        return f"`{on if default else off}`" if off else ""
    if isinstance(default, tuple):
        return f"`{','.join(f'{item:g}' for item in default)}`"
    return f"`{default}`"


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        README.write_text(refreshed(README.read_text("utf-8"), Path(folder)), "utf-8")
