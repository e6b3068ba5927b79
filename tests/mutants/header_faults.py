"""Faults in the headers beside the modules: Warp hashes their text with a kernel's, and compiles it anew."""

import re

from tests.mutants.mutant import Mutant
from tests.mutants.native_faults import native_faults

_FUNCTION = re.compile(
    r"^(?![ #/}])[^\n]*?\b(\w+)\([^{;]*\) \{(?:[^\n]*\}$|\n.*?^\}$)", re.MULTILINE | re.DOTALL
)


def functions_of(text):
    """Return the functions of a header: name, place of its start and of its end."""
    return [(match[1], match.start(), match.end()) for match in _FUNCTION.finditer(text)]


def header_faults_of(file, text):
    """Return all faults that we know to put into a header; their symbols are its functions."""
    functions = functions_of(text)
    found = []
    for start, length, new, kind in native_faults(text):
        symbol = next((name for name, first, end in functions if first <= start < end), "")
        line = text.count("\n", 0, start) + 1
        old = text[start : start + length]
        found.append(Mutant(file, start, start + length, new, f"C++ {kind}", line, old, symbol))
    return found
