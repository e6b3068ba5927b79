"""Tell what a NRRD header calls its axes: by their kinds, else by their labels."""

from dmc_cli.notices import Notice
from dmc_cli.volume_io.axes import SPELLINGS, UNNAMED, maybe_colors
from dmc_cli.volume_io.nrrd.header import per_axis

SPATIAL_KINDS = ("domain", "space")
NO_KINDS = ("", "???", "none")


def axis_names(fields: dict[str, str], count: int) -> list[str]:
    """Return what each axis is called: a known label, else a kind that is none of space, else nothing."""
    kinds = _told(fields, "kinds", count)
    known = {spelling for spellings in SPELLINGS.values() for spelling in spellings}
    names = []
    for kind, label in zip(kinds, _told(fields, "labels", count), strict=True):
        is_other = kind not in SPATIAL_KINDS and kind not in NO_KINDS
        fits = label in known and not (is_other and label in _of_space())
        names.append(label if fits else kind if is_other else UNNAMED)
    return names


def spatial_axes(fields: dict[str, str], count: int) -> list[int]:
    """Return the axes of space of a header without directions: by kinds, by labels, else the first three.

    What is called a time or a channel is none, though its kind may be `domain`, nor is an axis whose spacing
    is nan, as long as three others are left.
    """
    kinds, names = _told(fields, "kinds", count), axis_names(fields, count)
    if any(kind in SPATIAL_KINDS for kind in kinds):
        others = (*SPELLINGS["time"], *SPELLINGS["channel"])
        told = [a for a in range(count) if kinds[a] in SPATIAL_KINDS and names[a] not in others]
        return _spaced(fields, told, count)
    labelled = [a for a in range(count) if names[a] in _of_space()]
    nameless = [a for a in range(count) if names[a] == UNNAMED]
    missing = max(3 - len(labelled), 0)
    return sorted([*labelled, *_spaced(fields, nameless, count, missing)[:missing]])


def _spaced(fields: dict[str, str], axes: list[int], count: int, least: int = 3) -> list[int]:
    """Return those of some axes that have a spacing, or all where fewer than `least` have one."""
    spacings = _told(fields, "spacings", count)
    kept = [axis for axis in axes if spacings[axis] != "nan"]
    return kept if len(kept) >= least else axes


def world_axes(fields: dict[str, str], spatial: tuple[int, int, int], count: int) -> tuple[int, int, int]:
    """Return along which axis of the world each of three axes runs: 0, 1, 2, unless labels say x, y, z."""
    names = axis_names(fields, count)
    found = [
        next((n for n, kind in enumerate("xyz") if names[axis] in SPELLINGS[kind]), -1) for axis in spatial
    ]
    x, y, z = found if sorted(found) == [0, 1, 2] else (0, 1, 2)
    return x, y, z


def unnamed_order(fields: dict[str, str], sizes: list[int]) -> tuple[Notice, ...]:
    """Return a warning where nothing tells which axes are those of space, and it may be others than taken."""
    several = [size for size in sizes if size > 1]
    is_told = "space directions" in fields or any(_told(fields, "kinds", len(sizes)))
    if is_told or any(axis_names(fields, len(sizes))):
        return ()
    if len(several) <= 3:
        if len(several) < 3 or "spacings" in fields:
            return ()
        return maybe_colors(several, f"an array of sizes {' x '.join(map(str, sizes))}", "first")
    sentence = (
        "the header names none of its axes; the first three are taken as x, y, z, the others count volumes"
    )
    return (Notice("W-AXES-MISSING", sentence),)


def _told(fields: dict[str, str], key: str, count: int) -> list[str]:
    """Return a field's entries in lower case, without quotes; empty ones where it has not one an axis."""
    entries = [entry.strip('"').strip().lower() for entry in per_axis(fields.get(key, ""))]
    return entries if len(entries) == count else [""] * count


def _of_space() -> tuple[str, ...]:
    return (*SPELLINGS["x"], *SPELLINGS["y"], *SPELLINGS["z"])
