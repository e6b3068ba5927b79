"""Follow links of an HDF5 file in it, and read attributes that are texts."""

from typing import Any

from dmc_cli.errors import UnsupportedFormatError

MOST_LINKS = 32
"""Soft links on the way to a dataset."""


def followed(file: Any, place: str, name: str, h5py: Any) -> Any:
    """Return what lies at a place of a file, soft links followed in it, or None where nothing does.

    Raises:
        UnsupportedFormatError: A link leads to another file, or links have no end.
    """
    group, pending, links = file, place.split("/"), 0
    while pending:
        key = pending.pop(0)
        if key in ("", "."):
            continue
        if not isinstance(group, h5py.Group):
            return None
        if not group.id.links.exists(key.encode()):
            return None
        kind = group.id.links.get_info(key.encode()).type
        if kind == h5py.h5l.TYPE_HARD:
            group = group[key]
            continue
        links += 1
        if kind != h5py.h5l.TYPE_SOFT or links > MOST_LINKS:
            raise UnsupportedFormatError(
                f"{name}: {group.name} holds a link out of the file, {key[:80]!r}; expected all values in "
                "this file; copy it with h5repack, or give the other file"
            )
        target = group.id.links.get_val(key.encode()).decode("utf-8", "replace")
        group = file if target.startswith("/") else group
        pending = [*target.split("/"), *pending]
    return group


def text_of(value: Any) -> str:
    """Return an attribute as text: a string, bytes, or an array of one of them; empty for anything else."""
    if getattr(value, "shape", None) == (1,):
        value = value[0]
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value if isinstance(value, str) else ""
