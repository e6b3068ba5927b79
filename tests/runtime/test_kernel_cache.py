"""A damaged kernel cache mends itself, or one message says what is wrong with it."""

import errno
import json
import os
import shutil
import signal
import threading
from pathlib import Path

import numpy as np
import pytest
import warp as wp

from dmc_cli.errors import WriteError
from dmc_cli.progress import SilentProgress
from dmc_cli.runtime import device as device_module, kernel_cache
from dmc_cli.runtime.device import launch_fallback, load_kernels, select_device
from dmc_cli.runtime.kernel_cache import CHECKSUMS, ROOM, compile_modules, load_compiled, usable_cache
from tests import doubling

MODULE = wp.get_module(doubling.__name__)


class Heard(SilentProgress):
    def __init__(self):
        self.stages = []

    def stage(self, name):
        self.stages.append(name)
        return super().stage(name)


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """A cache that holds the module, as `compile_modules` left it."""
    select_device("cpu")
    launch_fallback()  # what every launch needs comes from the usual cache
    cache, before = tmp_path_factory.mktemp("compiled"), wp.config.kernel_cache_dir
    wp.config.kernel_cache_dir = str(cache)
    compile_modules("cpu", [MODULE], 1, 2)
    wp.config.kernel_cache_dir = before
    return cache


@pytest.fixture
def cache(compiled, tmp_path, monkeypatch):
    """A copy of it, in use; the module is not loaded."""
    shutil.copytree(compiled, tmp_path / "cache")
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path / "cache"))
    MODULE.unload()
    return tmp_path / "cache"


def folder_of(cache):
    (folder,) = cache.iterdir()
    return folder


def file_of(folder, suffix):
    (file,) = folder.glob(f"*{suffix}")
    return file


def works():
    values = wp.array(np.arange(4), dtype=wp.int32, device="cpu")
    wp.launch(doubling.double_kernel, dim=4, inputs=[0, values], device="cpu")
    return values.numpy().tolist() == [0, 2, 4, 6]


def assert_mended(cache):
    folder = folder_of(cache)
    assert {file.suffix for file in folder.iterdir()} == {".cpp", ".json", ".meta", ".o"}
    MODULE.unload()
    assert load_compiled("cpu", [MODULE], 1) == []
    assert works()


def emptied(file):
    file.write_bytes(b"")


def garbage(file):
    file.write_bytes(os.urandom(1000))


def cut(file):
    file.write_bytes(file.read_bytes()[:-1])


def one_bit_flipped(file):
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)


def gone(file):
    file.unlink()


def of_zeros(file):
    file.write_bytes(bytes(len(file.read_bytes())))


DAMAGES = [emptied, garbage, cut, one_bit_flipped, gone, of_zeros]


def test_a_whole_cache_is_loaded_and_nothing_compiled(cache, monkeypatch):
    monkeypatch.setattr(device_module, "compile_modules", None)
    heard = Heard()
    before = {file: file.stat().st_mtime_ns for file in folder_of(cache).iterdir()}
    assert load_compiled("cpu", [MODULE], 1) == []
    assert works()
    assert heard.stages == []
    assert {file: file.stat().st_mtime_ns for file in folder_of(cache).iterdir()} == before


def test_the_checksums_are_those_of_all_other_files(cache):
    sums = json.loads((folder_of(cache) / CHECKSUMS).read_text())
    assert sorted([*sums, CHECKSUMS]) == sorted(os.listdir(folder_of(cache)))
    assert len(set(sums.values())) == len(sums) == 3


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage.__name__)
@pytest.mark.parametrize("suffix", [".o", ".meta", ".cpp"])
def test_damage_is_noticed_before_anything_is_loaded(cache, suffix, damage, monkeypatch):
    damage(file_of(folder_of(cache), suffix))
    loaded = []
    monkeypatch.setattr(wp, "force_load", lambda device, modules, **_: loaded.extend(modules))
    assert load_compiled("cpu", [MODULE], 1) == [MODULE]
    assert loaded == []


@pytest.mark.parametrize("content", [b"", b"[1]", b"{", b"\xff", b'{"none": 1}', b'{"none": "x"}'])
def test_checksums_that_are_damaged_are_noticed(cache, content):
    (folder_of(cache) / CHECKSUMS).write_bytes(content)
    assert load_compiled("cpu", [MODULE], 1) == [MODULE]


@pytest.mark.parametrize("damage", [emptied, garbage, cut, gone], ids=lambda damage: damage.__name__)
@pytest.mark.parametrize("suffix", [".o", ".meta"])
def test_damage_without_checksums_is_noticed_too(cache, suffix, damage):
    (folder_of(cache) / CHECKSUMS).unlink()
    damage(file_of(folder_of(cache), suffix))
    assert load_compiled("cpu", [MODULE], 1) == [MODULE]


def test_a_whole_folder_without_checksums_is_loaded(cache):
    (folder_of(cache) / CHECKSUMS).unlink()
    assert load_compiled("cpu", [MODULE], 1) == []
    assert works()


def test_what_is_missing_and_what_is_damaged_come_in_order(cache, monkeypatch):
    """The good one of three is loaded although another that looks whole cannot be."""
    scan = wp.get_module("dmc_cli.runtime.prefix_sums")
    (folder_of(cache) / CHECKSUMS).unlink()
    file_of(folder_of(cache), ".o").write_bytes(b"garbage")
    assert load_compiled("cpu", [scan, MODULE], 1) == [scan, MODULE]


def test_a_damaged_module_is_compiled_anew_and_told(cache, monkeypatch):
    def load_ours(device, modules, block_dim):  # not those of every launch, which this cache lacks
        return load_compiled(device, [module for module in modules if module is MODULE], block_dim)

    monkeypatch.setattr(device_module, "load_compiled", load_ours)
    garbage(file_of(folder_of(cache), ".o"))
    heard = Heard()
    load_kernels(select_device("cpu", 2), [doubling], heard)
    assert heard.stages == ["compiling 1 kernel modules, once for this version"]
    assert works()
    assert_mended(cache)
    heard.stages.clear()
    load_kernels(select_device("cpu", 2), [doubling], heard)
    assert heard.stages == []


@pytest.mark.parametrize("kind", ["file", "link", "folder"])
def test_whatever_is_in_a_folders_place_is_replaced(cache, tmp_path, kind):
    folder = folder_of(cache)
    shutil.rmtree(folder)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "precious").touch()
    {
        "file": folder.touch,
        "link": lambda: folder.symlink_to(elsewhere),
        "folder": lambda: (folder / "half").mkdir(parents=True),
    }[kind]()
    assert load_compiled("cpu", [MODULE], 1) == [MODULE]
    compile_modules("cpu", [MODULE], 1, 1)
    assert_mended(cache)
    assert (elsewhere / "precious").exists()


def failing_once(error):
    """Return a stand-in for Warp's loader that fails the first time, and the calls that it got."""
    load, calls = wp.force_load, []

    def stand_in(device, modules, **options):
        calls.append(options)
        if len(calls) == 1:
            raise error
        load(device, modules, **options)

    return stand_in, calls


def test_where_no_thread_can_be_had_modules_are_compiled_one_by_one(cache, monkeypatch):
    stand_in, calls = failing_once(RuntimeError("can't start new thread"))
    monkeypatch.setattr(wp, "force_load", stand_in)
    compile_modules("cpu", [MODULE], 1, 5)
    assert calls[0]["max_workers"] == 5
    assert len(calls) > 1
    assert not any("max_workers" in call for call in calls[1:])
    monkeypatch.undo()
    assert works()


def test_what_never_compiles_is_an_error_with_status_9(cache, monkeypatch):
    def fail(device, modules, **_):
        raise Exception("CPU kernel build failed with error code 1")

    monkeypatch.setattr(wp, "force_load", fail)
    with pytest.raises(
        WriteError, match=r"tests\.doubling cannot be compiled .*build failed.*WARP_CACHE_PATH"
    ):
        compile_modules("cpu", [MODULE], 1, 2)


@pytest.mark.parametrize("error", [MemoryError("no room"), OSError(errno.ENOSPC, "No space left on device")])
def test_no_memory_and_no_disk_are_not_tried_again(cache, monkeypatch, error):
    stand_in, calls = failing_once(error)
    monkeypatch.setattr(wp, "force_load", stand_in)
    with pytest.raises(type(error)):
        compile_modules("cpu", [MODULE], 1, 2)
    assert len(calls) == 1
    calls.clear()
    (cache / "whole").mkdir()
    monkeypatch.setattr(kernel_cache, "_is_whole", lambda folder: True)
    if isinstance(error, MemoryError):
        with pytest.raises(MemoryError):
            load_compiled("cpu", [MODULE], 1)


def test_what_a_failed_compiler_leaves_is_removed(cache, monkeypatch):
    def fail(device, modules, **_):
        (cache / f"wp_x_p{os.getpid()}_t1").mkdir()
        (cache / f"wp_x_p{os.getpid() + 1}_t1").mkdir()  # of another run
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(wp, "force_load", fail)
    with pytest.raises(OSError, match="No space"):
        compile_modules("cpu", [MODULE], 1, 2)
    assert os.listdir(cache) == [f"wp_x_p{os.getpid() + 1}_t1"]


def test_there_has_to_be_room_before_the_compiler_begins(cache, monkeypatch):
    """LLVM would end the process."""
    written, write = [], Path.write_bytes

    def limited(path, content):
        written.append(len(content))
        if sum(written) > 2 * ROOM:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", limited)
    loaded = []
    monkeypatch.setattr(wp, "force_load", lambda device, modules, **_: loaded.extend(modules))
    told = r"cannot be used: No space left on device; .* room for the kernels"
    with pytest.raises(WriteError, match=told), usable_cache():
        compile_modules("cpu", [MODULE] * 3, 1, 2)
    assert written == [ROOM] * 3
    assert loaded == []
    assert os.listdir(cache) == []


def test_the_room_is_given_back(cache):
    compile_modules("cpu", [MODULE], 1, 1)
    assert_mended(cache)


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (OSError(errno.EROFS, "Read-only file system"), "cannot be used: Read-only file system"),
        (UnicodeEncodeError("utf-8", "\udcff", 0, 1, "surrogates not allowed"), "surrogates not allowed"),
    ],
)
def test_what_is_wrong_with_the_cache_is_told(cache, error, message):
    with pytest.raises(WriteError, match=message) as caught, usable_cache():
        raise error
    assert str(cache) in str(caught.value)
    assert "WARP_CACHE_PATH" in str(caught.value)


def test_a_system_without_memory_is_not_a_bad_cache():
    with pytest.raises(MemoryError, match="Cannot allocate memory"), usable_cache():
        raise OSError(errno.ENOMEM, "Cannot allocate memory")


class Struck(BaseException):
    pass


@pytest.mark.skipif(not hasattr(signal, "SIGUSR1"), reason="no signal is free on this system")
def test_a_signal_does_not_wait_for_the_compiler(cache, monkeypatch):
    def strike(*_):
        raise Struck

    release, compilers = threading.Event(), []

    def compile_for_long(*_, **__):
        compilers.append(threading.current_thread())
        os.kill(os.getpid(), signal.SIGUSR1)
        release.wait(60)

    monkeypatch.setattr(kernel_cache.wp, "force_load", compile_for_long)
    before = signal.signal(signal.SIGUSR1, strike)
    try:
        with pytest.raises(Struck):
            compile_modules("cpu", [MODULE], 1, 1)
    finally:
        signal.signal(signal.SIGUSR1, before)
        release.set()
    assert threading.main_thread() not in compilers
    assert compilers
    compilers[0].join(60)


def test_what_the_compiler_raises_is_raised_where_it_is_waited_for(cache, monkeypatch):
    def fail(*_, **__):
        raise MemoryError("none left")

    monkeypatch.setattr(kernel_cache.wp, "force_load", fail)
    with pytest.raises(MemoryError, match="none left"):
        compile_modules("cpu", [MODULE], 1, 1)
