"""Tell which part and which material each face of an OBJ file has, and read the colours of materials.

Lines `g name` begin a group, `o name` an object, `usemtl name` what has a material; `mtllib` names the file
beside the mesh that tells them. Parts are groups; without any objects; without these what has one material.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dmc_cli.array_types import BoolArray, ByteArray, IntArray
from dmc_cli.mesh_io.grouping import Grouping
from dmc_cli.volume import Color

WORDS = {b"g": "group", b"o": "object", b"usemtl": "material", b"mtllib": "library"}
"""What lines tell, by their first words."""


@dataclass(frozen=True)
class State:
    """What the lines before a face have told last."""

    group: str = ""
    object: str = ""
    material: str = ""


def grouping_of(
    path: Path, text: ByteArray, starts: IntArray, is_face: BoolArray, told: list[str]
) -> Grouping | None:
    """Return the parts of the faces; None if no line tells of any.

    Args:
        path: The file.
        text: Its characters, uint8.
        starts: Where its lines start.
        is_face: Which of them are faces, (lines,).
        told: What is not read: materials that are not there, and what they have beside a colour are added.
    """
    marks = np.flatnonzero(np.isin(text[starts], [word[0] for word in WORDS]))
    if not marks.size:
        return None
    states, libraries = _states(text, starts, marks)
    known = list(dict.fromkeys(states))
    places = {state: number for number, state in enumerate(known)}
    numbers = np.array([places[state] for state in states])
    here = numbers[np.searchsorted(marks, np.flatnonzero(is_face))]
    used = [known[number] for number in dict.fromkeys(here.tolist())]
    parts = _parts(used)
    names = {name: number for number, name in enumerate(dict.fromkeys(n for n, _ in parts.values() if n))}
    of_state = np.full(len(known), -1)
    colors: dict[int, Color] = {}
    lights = _materials(path, libraries, told) if any(state.material for state in used) else {}
    for state, (name, material) in parts.items():
        number = names.get(name, -1)
        of_state[places[state]] = number
        if material in lights and number >= 0:
            colors[number] = lights[material]
    return Grouping(names=list(names), numbers=of_state[here], colors=colors)


def _states(text: ByteArray, starts: IntArray, marks: IntArray) -> tuple[list[State], list[str]]:
    """Return what is told before the first of some lines, and from each on; and the files of materials."""
    states, libraries = [State()], []
    ends = np.append(starts[1:], len(text))
    for start, end in zip(starts[marks].tolist(), ends[marks].tolist(), strict=True):
        word, _, rest = text[start:end].tobytes().strip().replace(b"\t", b" ").partition(b" ")
        kind, name = WORDS.get(word), rest.decode("utf-8", "replace").strip()
        if kind == "library":
            libraries.append(name)
        known = {} if kind in (None, "library") else {kind: name}
        states.append(replace(states[-1], **known) if known else states[-1])
    return states, libraries


def _parts(used: list[State]) -> dict[State, tuple[str, str]]:
    """Return name and material of the part that each state is of; several materials part a part."""
    kind = next((kind for kind in ("group", "object") if any(getattr(state, kind) for state in used)), None)
    titles = {state: getattr(state, kind) if kind else "" for state in used}
    materials: dict[str, set[str]] = {}
    for state, title in titles.items():
        materials.setdefault(title, set()).add(state.material)
    found = {}
    for state, title in titles.items():
        both = "_".join(word for word in (title, state.material) if word)
        found[state] = (both if len(materials[title]) > 1 else title or both), state.material
    return found


def _materials(path: Path, libraries: list[str], told: list[str]) -> dict[str, Color]:
    """Return the colours of materials by name."""
    found: dict[str, Color] = {}
    for name in libraries:
        place = path.parent / name
        try:
            text = place.read_text("utf-8", "replace") if place.is_file() else None
        except (OSError, ValueError):
            text = None
        if text is None:
            told.append(f"materials of {name}, a file that is not there")
            continue
        here = ""
        for line in text.splitlines():
            word, _, rest = line.strip().replace("\t", " ").partition(" ")
            if word == "newmtl":
                here = rest.strip()
            elif word == "Kd" and (color := _color(rest.split())) is not None:
                found[here] = color
            elif word.startswith("map_") and "textures" not in told:
                told.append("textures")
    return found


def _color(words: list[str]) -> Color | None:
    """Return a colour of numbers from 0 to 1; None if it is none."""
    try:
        shares = [float(word) for word in words]
    except ValueError:
        return None
    if len(shares) != 3 or not all(0 <= share <= 1 for share in shares):
        return None
    red, green, blue = (round(255 * share) for share in shares)
    return red, green, blue
