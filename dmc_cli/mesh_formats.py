"""Register the formats of meshes: a file or a folder of `mesh_io/` each, and an entry here.

Settings, help texts, messages and the README's table are made from this list. Writers and readers are
imported when they are called.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Any


@dataclass(frozen=True, kw_only=True)
class MeshFormat:
    """A format, and where its functions are, as `module:function`.

    Attributes:
        title: Its name.
        suffix: The one that means it.
        encode: From a `MeshFile` to chunks of bytes.
        read: From a path to a `MeshFile`.
        holds_normals: Whether there is a place for normals.
        holds_values: Whether there is one for values of vertices and faces.
        holds_groups: Whether there is one for names of parts.
        is_binary: Whether it is binary unless `--ascii` asks for text.
    """

    title: str
    suffix: str
    encode: str
    read: str
    holds_normals: bool = True
    holds_values: bool = False
    holds_groups: bool = False
    is_binary: bool = False


FORMATS: dict[str, MeshFormat] = {
    "ply": MeshFormat(
        title="PLY",
        suffix=".ply",
        encode="ply:encode_ply",
        read="ply:read_ply",
        holds_values=True,
        is_binary=True,
    ),
    "obj": MeshFormat(
        title="OBJ", suffix=".obj", encode="obj:encode_obj", read="obj:read_obj", holds_groups=True
    ),
    "off": MeshFormat(
        title="OFF", suffix=".off", encode="off:encode_off", read="off:read_off", holds_normals=False
    ),
}
"""The formats by their names, as `--output-format` takes them."""


def function(place: str) -> Callable[..., Any]:
    """Import and return the function at a place of `MeshFormat`."""
    found: Callable[..., Any] = resolve_name(f"dmc_cli.mesh_io.{place}")
    return found


def known_suffixes() -> list[str]:
    """Return the suffixes that mean a format, in the order of the list."""
    return [known.suffix for known in FORMATS.values()]
