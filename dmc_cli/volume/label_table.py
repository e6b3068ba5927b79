"""Hold what a file, or a table beside it, calls its labels, and their colours."""

from dataclasses import dataclass

Color = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""


@dataclass(frozen=True, kw_only=True)
class Label:
    """A label of a label map.

    Attributes:
        value: What its nodes have, in physical values.
        number: What it is chosen and named by; its value, unless labels of several layers have the same ones.
        name: What it is called; empty where nothing tells.
        color: The colour that it is shown in, or None.
        layer: The volume of the file that holds it: labels that overlap lie in several.
    """

    value: int
    number: int
    name: str = ""
    color: Color | None = None
    layer: int = 0
