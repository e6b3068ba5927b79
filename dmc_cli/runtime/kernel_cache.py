"""Load compiled kernels from disk, and compile those that are missing or damaged.

Warp keeps each module in a folder of the cache, named by a hash of its source, and trusts what it finds
there. A power cut or a full disk may leave less than was written, and code that is not what was compiled may
do anything. So a folder gets the checksums of its files, which are compared before they are loaded; a folder
that fails, or that Warp cannot load, is removed and its module compiled once more. Folders without checksums
(Warp compiled them where nobody had asked for it) are only looked over.

LLVM ends the process where the disk is full, so there has to be room before it is asked to write.
"""

import errno
import json
import os
import shutil
import zlib
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, wait
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Thread
from typing import Any

import warp as wp

from dmc_cli.errors import WriteError

CHECKSUMS = "checksums.json"
"""In a module's folder: the CRC-32 of each of its other files."""

ROOM = 1 << 19
"""Bytes for a module that is to be compiled, at least: the largest have a tenth less."""

LOOK_UP = 0.1
"""Seconds between two looks for a signal, where waiting itself hides it."""

BINARIES = {".cubin", ".o", ".ptx"}
"""Suffixes of compiled code."""


def load_compiled(device: str, modules: Sequence[Any], block_dim: int | None) -> list[Any]:
    """Load the modules that the cache holds; return the others, missing and damaged ones.

    Args:
        device: Warp's name of the device.
        modules: Warp's modules.
        block_dim: Part of the hash in a folder's name.
    """
    # Warp keeps the hash, which is most of the work of loading
    whole = [module for module in modules if _is_whole(_folder(module, block_dim))]
    damaged = []
    try:
        wp.force_load(device, whole, block_dim=block_dim)
    except MemoryError:
        raise
    except Exception:  # Warp's for code that LLVM refuses, JSON's, the system's
        damaged = [module for module in whole if not _can_load(device, module, block_dim)]
    return [module for module in modules if module not in whole or module in damaged]


def compile_modules(device: str, modules: Sequence[Any], block_dim: int | None, workers: int) -> None:
    """Compile and load modules, whatever the cache holds of them.

    Args:
        device: Warp's name of the device.
        modules: Warp's modules.
        block_dim: Part of the hash in a folder's name.
        workers: Threads that compile side by side; one by one where no thread can be had.

    Raises:
        OSError: The cache cannot be written.
        WriteError: What was compiled cannot be loaded.
    """
    cache = cache_folder()
    for module in modules:
        _remove(_folder(module, block_dim))
    _check_room(cache, len(modules))
    try:
        try:
            _compile_beside(device, modules, block_dim, workers)
        except (MemoryError, OSError):
            raise
        except Exception:  # no thread could be started, or another run was at the same folder
            _compile_again(device, modules, block_dim)
    finally:
        for folder in cache.glob(f"*_p{os.getpid()}_t*"):  # where Warp was compiling
            shutil.rmtree(folder, ignore_errors=True)
    for module in modules:
        _write_checksums(_folder(module, block_dim))


def _compile_beside(device: str, modules: Sequence[Any], block_dim: int | None, workers: int) -> None:
    """Compile and load modules in a thread: LLVM would keep the caller from a signal for minutes."""
    done: Future[None] = Future()

    def work() -> None:
        try:
            done.set_result(wp.force_load(device, modules, block_dim=block_dim, max_workers=workers))
        except BaseException as error:
            done.set_exception(error)  # raised where the caller waits

    Thread(target=work, name="dmc-compile", daemon=True).start()
    while not done.done():
        wait([done], timeout=LOOK_UP)
    done.result()


def _compile_again(device: str, modules: Sequence[Any], block_dim: int | None) -> None:
    """Compile modules one by one, those that could be loaded excepted."""
    for module in modules:
        if _can_load(device, module, block_dim):
            continue
        module.mark_modified()  # else Warp tells the failure again
        _remove(_folder(module, block_dim))
        try:
            wp.force_load(device, [module], block_dim=block_dim)
        except (MemoryError, OSError):
            raise
        except Exception as error:
            raise WriteError(
                f"the kernels of {module.name} cannot be compiled and loaded ({error}); expected a kernel"
                f" cache that works in {wp.config.kernel_cache_dir}; remove that folder, or name another in"
                " the environment variable WARP_CACHE_PATH"
            ) from error


def _can_load(device: str, module: Any, block_dim: int | None) -> bool:
    """Load a module and return whether that worked."""
    try:
        wp.force_load(device, [module], block_dim=block_dim)
    except MemoryError:
        raise
    except Exception:
        return False
    return True


def cache_folder() -> Path:
    """Return where Warp, once started, keeps compiled kernels."""
    return Path(wp.config.kernel_cache_dir or "")


def _folder(module: Any, block_dim: int | None) -> Path:
    """Return the folder of a module, for whichever device."""
    name: str = module.get_module_identifier(block_dim)
    return cache_folder() / name


def _is_whole(folder: Path) -> bool:
    """Return whether a module's folder is there and holds what was written to it."""
    try:
        expected = json.loads((folder / CHECKSUMS).read_bytes())
        return all(zlib.crc32((folder / name).read_bytes()) == value for name, value in expected.items())
    except FileNotFoundError:
        return not (folder / CHECKSUMS).exists() and _looks_whole(folder)
    except (OSError, ValueError, AttributeError):
        return False


def _looks_whole(folder: Path) -> bool:
    """Return whether a folder without checksums holds compiled code and what belongs to it."""
    try:
        suffixes = {file.suffix for file in folder.iterdir() if file.stat().st_size}
    except OSError:
        return False
    return ".meta" in suffixes and not BINARIES.isdisjoint(suffixes)


def _write_checksums(folder: Path) -> None:
    """Write down the checksums of a folder's files, where that is possible."""
    part = folder / f"{CHECKSUMS}.{os.getpid()}"
    with suppress(OSError):
        files = [file for file in folder.iterdir() if not file.name.startswith(CHECKSUMS)]
        part.write_text(json.dumps({file.name: zlib.crc32(file.read_bytes()) for file in files}))
        part.replace(folder / CHECKSUMS)


def _remove(path: Path) -> None:
    """Remove a folder, or whatever is in its place."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _check_room(cache: Path, count: int) -> None:
    """Raise OSError unless the disk takes so many modules."""
    probe = cache / f"room_p{os.getpid()}_t0"
    probe.mkdir(exist_ok=True)
    try:
        for number in range(count):
            (probe / str(number)).write_bytes(bytes(ROOM))
    finally:
        shutil.rmtree(probe, ignore_errors=True)


@contextmanager
def usable_cache() -> Iterator[None]:
    """Tell, where the context fails, what is wrong with the folder of the compiled kernels.

    Raises:
        WriteError: An error of the system, or a name that Warp cannot handle.
        MemoryError: The system has no memory left.
    """
    try:
        yield
    except WriteError:
        raise
    except (OSError, UnicodeError) as error:
        if isinstance(error, OSError) and error.errno == errno.ENOMEM:
            raise MemoryError(f"the kernels cannot be loaded: {error.strerror}") from error
        found = getattr(error, "strerror", None) or error
        filename = getattr(error, "filename", None)
        raise WriteError(
            f"the kernel cache {wp.config.kernel_cache_dir or filename} cannot be used: {found}; expected a"
            " folder that can be written, with room for the kernels; make it so, or name another in the"
            " environment variable WARP_CACHE_PATH"
        ) from error
