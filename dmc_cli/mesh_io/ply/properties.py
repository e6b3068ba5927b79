"""Name the properties of PLY files: types, places, corners, and how values stand for properties.

A value of one number an item is a property of its name; one of several is name_0, name_1 and so on.
"""

import numpy as np

from dmc_cli.array_types import AnyArray

POINT = ("x", "y", "z")
NORMAL = ("nx", "ny", "nz")
CORNERS = "vertex_indices"

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
"""NumPy's letters for PLY's types."""


def type_name(array: AnyArray) -> str:
    """Return PLY's oldest word for the type of an array, which all readers know."""
    letters = f"{array.dtype.kind}{array.dtype.itemsize}"
    return next(name for name, known in TYPES.items() if known == letters)


def property_names(name: str, array: AnyArray) -> list[str]:
    """Return the properties that a value becomes, one a column."""
    return [name] if array.ndim == 1 else [f"{name}_{column}" for column in range(array.shape[1])]


def as_values(columns: dict[str, AnyArray]) -> dict[str, AnyArray]:
    """Return properties as values: name_0, name_1 ... of one type that follow each other as one vector.

    Args:
        columns: Properties in the file's order.
    """
    names = list(columns)
    values: dict[str, AnyArray] = {}
    start = 0
    while start < len(names):
        stem, end = names[start].removesuffix("_0"), start
        kind = columns[names[start]].dtype
        if stem and stem not in columns:  # names of properties that are no vectors are in there
            while names[end : end + 1] == [f"{stem}_{end - start}"] and columns[names[end]].dtype == kind:
                end += 1
        if end - start > 1:
            values[stem] = np.column_stack([columns[name] for name in names[start:end]])
        else:
            end = start + 1
            values[names[start]] = columns[names[start]]
        start = end
    return values
