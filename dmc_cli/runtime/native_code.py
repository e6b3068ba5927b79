"""Take the C++ of Warp's native functions from the headers beside the kernels.

Warp compiles the body of a native function that it gets as text, and hashes that text, so that a header that
changes is compiled anew. A header is plain C++: functions, templates where Python supplies a constant, and
small functions that several use, in a namespace.
"""

import re
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[1]

_INCLUDE = re.compile(r'^#include "dmc_cli/(.+)"$', re.MULTILINE)
_DEFINE = re.compile(r"^#(?:define (?:.*\\\n)*.*|(?:ifdef|else  //|endif  //) DMC_CHECKED)\n", re.MULTILINE)
_NAMESPACE = re.compile(r"^namespace (\w+) \{\n(.*?)^\}  // namespace \w+$", re.MULTILINE | re.DOTALL)


def native(module: str, name: str, **constants: float) -> str:
    """Return the body of a C++ function, as `wp.func_native` takes it.

    Args:
        module: The `__file__` of a module that has a header beside it: `words.h` for `words.py`.
        name: The function.
        constants: What the parameters of the function's template are.

    Raises:
        ValueError: The header has no such function.
    """
    header = Path(module).with_suffix(".h")
    text = header.read_text("utf-8")
    found = re.search(rf"\b{name}\([^{{;]*\) \{{\n(.*?)^\}}$", text, re.MULTILINE | re.DOTALL)
    if found is None:
        raise ValueError(f"{header} has no function {name}")
    given = "".join(f"constexpr auto {key} = {_literal(value)};\n" for key, value in constants.items())
    return f"\n{_shared(header)}{given}{found[1]}"


def _literal(value: float) -> str:
    """Return a number in C++: a float, or of type int, or unsigned where that is too small."""
    if isinstance(value, float):
        return f"{value!r}f"
    return f"{value}u" if value >= 2**31 else str(value)


@cache
def _shared(header: Path) -> str:
    """Return what the functions of a header share, as it may stand in a function's body, each header once.

    A body can hold no namespace, but a struct of static functions, which are called alike.
    """
    return "".join(_own(each) for each in _headers(header))


@cache
def _headers(header: Path) -> tuple[Path, ...]:
    """Return a header behind those that it includes, directly or not."""
    included = _INCLUDE.findall(header.read_text("utf-8"))
    return tuple(dict.fromkeys([*(each for path in included for each in _headers(PACKAGE / path)), header]))


def _own(header: Path) -> str:
    """Return what a header itself shares: macros, and namespaces as structs."""
    text = header.read_text("utf-8")
    defined = "".join(_DEFINE.findall(text))
    helpers = "".join(f"struct {name} {{\n{body}}};\n" for name, body in _NAMESPACE.findall(text))
    return defined + helpers
