"""`python -m tests.runtime.vector_loops MODULE FOLDER`: the functions whose loops clang vectorises."""

import importlib
import json
import os
import re
import sys
import tempfile
from pathlib import Path

import warp as wp

PROCESSOR = "-target-cpu x86-64-v4"
"""One with vectors of 512 bits, whichever this one is: nothing is run."""

REMARK = re.compile(r"^(/[^\n:]*\.cpp):(\d+):\d+: remark: vectorized loop \(vectorization width: (\d+)", re.M)
FUNCTION = re.compile(r"^(?:static|inline|WP_API)?.*?\b(\w+?)(?:_[0-9a-f]{8})?(?:_\d+)?\($")


def remarks_of(name: str, folder: str) -> str:
    """Compile a module and return what clang says; it writes to the process's standard error."""
    module = wp.get_module(importlib.import_module(name).__name__)
    flags = module.options["cpu_compiler_flags"] or wp.config.cpu_compiler_flags
    flags = flags.replace("-march=native", PROCESSOR)
    module.options["cpu_compiler_flags"] = f"{flags} -Rpass=loop-vectorize"
    kept = os.dup(2)
    with tempfile.TemporaryFile() as told:
        os.dup2(told.fileno(), 2)
        try:
            wp.compile_aot_module(module, device="cpu", module_dir=folder)
        finally:
            os.dup2(kept, 2)
        told.seek(0)
        return told.read().decode()


def widths(remarks: str, folder: str) -> dict[str, list[int]]:
    """The widths of the loops that have become vector code, by the C++ function that they are in."""
    found: dict[str, set[tuple[int, int]]] = {}
    sources: dict[str, list[str]] = {}
    for path, line, width in REMARK.findall(remarks):
        source = Path(folder) / Path(path).name  # compiled elsewhere and moved there
        lines = sources.setdefault(path, source.read_text().splitlines())
        above = (FUNCTION.match(text) for text in reversed(lines[: int(line)]))
        name = next((match[1] for match in above if match), "?")
        found.setdefault(name, set()).add((int(line), int(width)))
    return {name: [width for _, width in sorted(loops)] for name, loops in found.items()}


if __name__ == "__main__":
    print(json.dumps(widths(remarks_of(*sys.argv[1:]), sys.argv[2])))
