"""The same bytes from the branches that a GPU, one core, another processor, or an unknown Warp takes."""

import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from dmc_cli.runtime import worker_pool
from dmc_cli.runtime.device import Device, select_device
from tests.other_hardware import VOLUMES, AsOnGpu, bytes_of, surface_hash


@cache
def expected(name: str) -> dict[str, bytes]:
    select_device("cpu")
    return bytes_of(name, Device("cpu", 3))


def check(name: str, device: Device) -> None:
    found = bytes_of(name, device)
    assert [key for key, value in expected(name).items() if found[key] != value] == []


@pytest.mark.parametrize("name", VOLUMES)
def test_the_branches_of_a_gpu_make_the_same_mesh(name, monkeypatch):
    expected(name)
    monkeypatch.setattr(worker_pool, "worker_pool", lambda: pytest.fail("a GPU needs no pool"))
    monkeypatch.setattr("dmc_cli.runtime.device.worker_pool", lambda: pytest.fail("a GPU needs no pool"))
    check(name, AsOnGpu("cpu", 1))


@pytest.mark.parametrize("name", VOLUMES)
def test_one_core_makes_the_same_mesh(name):
    check(name, Device("cpu", 1))


@pytest.mark.parametrize("name", VOLUMES)
def test_a_warp_that_is_not_known_makes_the_same_mesh(name, monkeypatch):
    expected(name)
    monkeypatch.setattr(worker_pool, "takes_structs", lambda source, kernel: False)
    monkeypatch.setattr(worker_pool, "_pool", None)
    check(name, Device("cpu", 3))
    assert worker_pool.worker_pool().fallback


@pytest.mark.parametrize("flags", ["", "-DDMC_AS_ON_GPU"], ids=["old-processor", "as-on-gpu"])
def test_bits_are_listed_alike_without_wide_vectors_and_as_on_a_gpu(flags):
    """No flags are the oldest processor of its kind, whose code this one runs too."""
    names = ["holes", "integers", "noise", "nets", "planes", "particles", "mc of noise", "mc of holes"]
    names += ["macet of noise", "macet of holes", "tmc of noise", "tmc of ties"]
    words = [sys.executable, "-m", "tests.other_hardware", flags, *names]
    root = Path(__file__).parents[2]
    run = subprocess.run(words, cwd=root, capture_output=True, encoding="utf-8", check=False, timeout=250)
    assert run.stdout.split() == [surface_hash(name) for name in names], run.stderr
