"""Faults in the C++ of native functions: a few operators, found by pattern in headers and in strings."""

import re

PATTERNS = [
    (r" < ", [" <= ", " > "], "comparison"),
    (r" <= ", [" < "], "comparison"),
    (r" > ", [" >= ", " < "], "comparison"),
    (r" >= ", [" > "], "comparison"),
    (r" == ", [" != "], "comparison"),
    (r" != ", [" == "], "comparison"),
    (r" && ", [" || "], "logic"),
    (r" \|\| ", [" && "], "logic"),
    (r" & ", [" | "], "arithmetic"),
    (r" \| ", [" & "], "arithmetic"),
    (r" \^ ", [" & "], "arithmetic"),
    (r" \+ ", [" - "], "arithmetic"),
    (r" - ", [" + "], "arithmetic"),
    (r" \* ", [" + "], "arithmetic"),
    (r" / ", [" * "], "arithmetic"),
    (r" % ", [" / "], "arithmetic"),
    (r" << ", [" >> "], "arithmetic"),
    (r" >> ", [" << "], "arithmetic"),
    (r" \+= ", [" -= "], "arithmetic"),
    (r" \|= ", [" = "], "arithmetic"),
    (r" &= ", [" = "], "arithmetic"),
    (r"~(?=\w)", [""], "arithmetic"),
    (r"(?<=[(\s])!(?=\w)", [""], "sign"),
    (r"(?<=\bif \()[^(){}]+(?=\))", ["true", "false"], "condition"),
    (r"(?<![\w.{}#\"<])\d+(?=[\s;,)\]}])", [None], "number"),
    (r"\b(?:break|continue);", [";"], "statement"),
]


def native_faults(text):
    """Yield where and how long what goes is, what comes, and of which kind it is."""
    for pattern, news, kind in PATTERNS:
        for match in re.finditer(pattern, text):
            if _is_code(text, match.start()):
                for new in news:
                    number = str(int(match.group()) + 1) if new is None else new
                    yield match.start(), len(match.group()), number, kind


def _is_code(text, place):
    """Return whether a place is in neither a comment nor a line of the preprocessor."""
    line = text[text.rfind("\n", 0, place) + 1 : place]
    return "//" not in line and "/*" not in line and not line.lstrip().startswith("#")
