"""Sums of counts, and memory whose former content never shows."""

import os
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import warp as wp
from hypothesis import given, settings, strategies as st

from dmc_cli.contouring import Surface, compute_normals, extract_surface
from dmc_cli.errors import DeviceError
from dmc_cli.field import upload_volume
from dmc_cli.mesh.mesh import COLOR
from dmc_cli.runtime import device as device_module
from dmc_cli.runtime.buffer_pool import HostMemory
from dmc_cli.runtime.device import SHORT_SCAN, Device, select_device
from dmc_cli.runtime.prefix_sums import CHUNK
from dmc_cli.runtime.worker_pool import worker_pool
from dmc_cli.settings import SurfaceSettings
from tests.fields import smooth_noise, volume_of, white_noise
from tests.mesh.meshes import colored, simplified
from tests.other_hardware import AsOnGpu
from tests.runtime.launcher import note_order_kernel

LENGTHS = [0, 1, CHUNK, SHORT_SCAN - 1, SHORT_SCAN, SHORT_SCAN + 1, 9 * CHUNK, 100_003]


def check_starts(threads: int, length: int) -> None:
    device = select_device("cpu", threads)
    counts = np.random.default_rng(length).integers(0, 1000, length)
    sums, total = device.starts(wp.array(counts, dtype=wp.int64, device="cpu"))
    assert np.array_equal(sums.numpy(), np.concatenate([[0], np.cumsum(counts)]))
    assert total == counts.sum()


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("length", LENGTHS)
def test_starts_are_the_sums_before_each_count(threads, length):
    check_starts(threads, length)


@pytest.mark.parametrize("length", LENGTHS)
def test_each_row_has_starts_of_its_own(length):
    device = select_device("cpu", 2)
    counts = np.random.default_rng(length).integers(0, 2**40, (3, length))
    found = device.starts_of_rows(wp.array(counts, dtype=wp.int64, device="cpu"))
    assert [total for _, total in found] == counts.sum(axis=1).tolist()
    for row, (sums, _) in zip(counts, found, strict=True):
        assert np.array_equal(sums.numpy(), np.concatenate([[0], np.cumsum(row)]))


def test_more_than_mesh_indices_can_number_is_refused():
    device = select_device("cpu", 1)
    with pytest.raises(DeviceError, match="2147483648 vertices or quads"):
        device.starts(wp.array([2**31 - 1, 1], dtype=wp.int64, device="cpu"))


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 40 * CHUNK))
def test_chunks_of_chunks_are_summed_alike(length):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(device_module, "SHORT_SCAN", 4)
        check_starts(2, length)


def test_threads_are_as_many_as_processors_that_may_be_used(monkeypatch):
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {3, 5, 7}, raising=False)
    monkeypatch.setattr("os.cpu_count", lambda: 64)
    assert select_device("cpu").threads == 3
    assert select_device("cpu", 2).threads == 2
    monkeypatch.delattr("os.sched_getaffinity")
    assert select_device("cpu").threads == 64


@pytest.mark.parametrize("dtype", [wp.uint8, wp.int64, wp.vec3])
@pytest.mark.parametrize("device", [Device("cpu"), AsOnGpu("cpu")], ids=["cpu", "as on a GPU"])
def test_one_array_without_items_of_each_type_is_enough(device, dtype):
    nothing = device.empty(0, dtype)
    assert device.empty(0, dtype) is nothing
    assert (nothing.shape, nothing.dtype) == ((0,), dtype)
    assert device.empty(1, dtype) is not nothing


NOISE = white_noise(64)  # launches of several chunks


def mesh_of_noise(device: Device, reserve=None) -> Surface:
    return extract_surface(upload_volume(NOISE, device), SurfaceSettings(isovalue=0.0), reserve=reserve)


@pytest.mark.pool
@pytest.mark.parametrize("short_of", ["cells", "vertices", "nothing"])
def test_nothing_is_begun_after_a_mesh_too_large(short_of, monkeypatch):
    sizes = []
    mesh_of_noise(select_device("cpu", 2), lambda *found, **cells: sizes.extend(found))
    del sizes[:-2]  # the last that is told
    limit = {"cells": 1000, "vertices": max(sizes) - 1, "nothing": max(sizes)}[short_of]
    monkeypatch.setattr(device_module, "MOST_ITEMS", limit)
    device = select_device("cpu", 2)
    if short_of == "nothing":
        mesh = mesh_of_noise(device)
        assert [mesh.mesh.vertex_count, mesh.mesh.face_count] == sizes
    else:
        with pytest.raises(DeviceError, match="vertices or quads"):
            mesh_of_noise(device)
    assert not worker_pool().slot.is_begun


@pytest.mark.pool
@pytest.mark.parametrize("left", range(1, 24, 2))
def test_nothing_is_begun_after_memory_ran_out(left, monkeypatch):
    device = select_device("cpu", 2)
    takes = []
    take = HostMemory.take

    def limited(memory, size):
        takes.append(size)
        if len(takes) == left:
            raise MemoryError
        return take(memory, size)

    monkeypatch.setattr(HostMemory, "take", limited)
    with pytest.raises(MemoryError):
        mesh_of_noise(device)
    assert not worker_pool().slot.is_begun


def two_spheres() -> np.ndarray:
    """A volume most of which is far from the surface."""
    k, j, i = np.mgrid[:40, :48, :200].astype(np.float32)
    near = np.hypot(np.hypot(i - 20, j - 24), k - 20)
    far = np.hypot(np.hypot(i - 170, j - 24), k - 20)
    return (9.3 - np.minimum(near, far)).astype(np.float32)


VOLUMES = {"spheres": volume_of(two_spheres()), "noise": white_noise(33), "smooth": smooth_noise(40)}


@pytest.mark.parametrize("name", VOLUMES)
@pytest.mark.parametrize("border", ["open", "closed"])
def test_what_memory_held_before_never_shows(name, border, monkeypatch):
    meshes = []
    take = HostMemory.take
    for content in (0x00, 0xFF, 0xA5):

        def take_filled(self, size, content=content):
            lease = take(self, size)
            lease.buffer.memory[:] = content
            return lease

        monkeypatch.setattr(HostMemory, "take", take_filled)
        device = select_device("cpu", 2)
        chosen = SurfaceSettings(isovalue=0.0, border=border)
        surface = extract_surface(upload_volume(VOLUMES[name], device), chosen)
        surface = colored(surface)
        normals = compute_normals(surface.placement, chosen).numpy().copy()
        twins = surface.mesh.halfedges.twin.numpy().copy()
        reduced = surface.mesh.face_values[COLOR].numpy().copy()
        found = simplified(surface).mesh
        meshes.append([normals, twins, reduced, found.positions.numpy(), found.faces.numpy()])
    assert len(meshes[0][1]) > 1000
    for other in meshes[1:]:
        assert all(np.array_equal(a, b) for a, b in zip(meshes[0], other, strict=True))


@pytest.mark.parametrize(
    ("told", "error", "words"),
    [
        ("warp.so: failed to map segment from shared object", MemoryError, "warp.so"),
        (
            "libstdc++.so.6: cannot open shared object file",
            DeviceError,
            r"cannot be started .*libstdc.*install",
        ),
    ],
)
def test_a_library_that_cannot_be_loaded_is_told(monkeypatch, told, error, words):
    def fail():
        raise RuntimeError("Failed to load the shared library") from OSError(told)

    monkeypatch.setattr(wp, "init", fail)
    device_module._start_warp.cache_clear()
    descriptors = len(os.listdir("/proc/self/fd"))
    with pytest.raises(error, match=words):
        select_device("cpu")
    assert len(os.listdir("/proc/self/fd")) == descriptors


def test_threads_start_warp_once(monkeypatch):
    """While it starts, standard error is silent: two at it would leave it so."""
    begun = []

    def start():
        begun.append(1)
        time.sleep(0.05)

    select_device("cpu")
    monkeypatch.setattr(wp, "init", start)
    device_module._start_warp.cache_clear()
    before = os.fstat(2)
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(select_device, 4 * ["cpu"]))
    assert begun == [1]
    assert os.path.samestat(before, os.fstat(2))


def test_a_launch_whole_goes_from_the_first_index_to_the_last():
    order = wp.zeros(50_001, dtype=wp.int32, device="cpu")
    device = Device("cpu", 4)
    device.wake()
    device.launch_whole(note_order_kernel, 50_000, [], [order])
    assert np.array_equal(order.numpy()[1:], np.arange(50_000))
    device.launch_whole(note_order_kernel, 0, [], [order])
