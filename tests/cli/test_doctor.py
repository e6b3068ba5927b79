import json
import os

import pytest


def test_doctor_tells_versions_devices_and_codecs(run_process):
    result = run_process("doctor")
    assert result.returncode == 0
    for word in ("warp-lang", "numpy", "device    cpu", "DICOM RLE: available", "kernels "):
        assert word in result.stdout
    assert "initialized" not in result.stdout


def test_doctor_as_json(run_process):
    diagnosis = json.loads(run_process("doctor", "--json").stdout)
    assert diagnosis["packages"]["warp-lang"]
    assert diagnosis["devices"][0]["alias"] == "cpu"
    assert diagnosis["kernel_cache"]["path"]


def test_a_missing_driver_is_told_once(run_process):
    assert "Warp CUDA warning" not in run_process("doctor").stderr


@pytest.mark.parametrize(("words", "times"), [([], 0), (["--warm-up"], 1)])
def test_kernels_are_compiled_on_request(run, monkeypatch, words, times):
    calls = []
    monkeypatch.setattr("dmc_cli.app.compile_kernels", calls.append)
    monkeypatch.setattr("dmc_cli.cli.description.diagnose", lambda: {"a": 1})
    assert json.loads(run("doctor", "--json", *words).stdout) == {"a": 1}
    assert len(calls) == times


@pytest.mark.slow
@pytest.mark.timeout(1000)
def test_compiling_all_kernels_says_nothing(run_process, tmp_path):
    """Of some 130 modules: a minute and a half of processor time, which a busy machine takes its time for."""
    environment = os.environ | {"WARP_CACHE_PATH": str(tmp_path)}
    result = run_process("doctor", "--warm-up", "--quiet", env=environment, timeout=900)
    assert result.returncode == 0
    assert result.stderr == ""
