"""A report names the machine, on a GPU and without one, and the program."""

from types import SimpleNamespace

import pytest

from dmc_cli.report import memory, versions
from dmc_cli.version import VERSION


@pytest.fixture
def pool(monkeypatch):
    """Return a machine whose devices are GPUs with, or without, a memory pool."""

    def make(*, is_cuda=True, has_pool=True):
        device = SimpleNamespace(is_cuda=is_cuda, name="NVIDIA H100", is_cpu=not is_cuda)
        monkeypatch.setattr(memory.wp, "get_device", lambda name: device)
        monkeypatch.setattr(memory.wp, "is_mempool_enabled", lambda found: has_pool and found is device)
        monkeypatch.setattr(memory.wp, "get_mempool_used_mem_high", lambda found: 12345)

    return make


@pytest.mark.parametrize(
    ("is_cuda", "has_pool", "found"), [(True, True, 12345), (True, False, None), (False, True, None)]
)
def test_the_pool_of_a_gpu_tells_its_peak(pool, is_cuda, has_pool, found):
    pool(is_cuda=is_cuda, has_pool=has_pool)
    assert memory.measure_memory("cuda:0")["device_bytes"] == found


def test_a_gpu_is_told_by_its_model(pool):
    pool()
    assert versions.collect_versions("cuda:1")["device"] == "cuda:1 (NVIDIA H100)"


def test_the_version_is_the_package_s_own():
    assert versions.collect_versions("cpu")["dmc_cli"] == VERSION
