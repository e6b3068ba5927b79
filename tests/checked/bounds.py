"""Have all memory accesses of compiled kernels checked; one beside its array ends the process.

Arrays in Warp's code by Warp's own asserts, pointers in our headers by `pointers.h`, lists of known length by
clang. The flags are part of what Warp hashes, so that no kernel is shared with another way of compiling.
"""

import zlib
from pathlib import Path

import warp as wp

HEADER = Path(__file__).with_name("pointers.h")

SANITIZER = "-fsanitize=array-bounds,local-bounds -fsanitize-trap=array-bounds,local-bounds"


def check_bounds() -> None:
    """Have the modules that are compiled from now on checked; before `dmc_cli` is imported."""
    version = zlib.crc32(HEADER.read_bytes())
    wp.config.cpu_compiler_flags = (
        f"-march=native -include {HEADER} -DDMC_CHECKED={version} {SANITIZER} -fstrict-flex-arrays=3"
    )
