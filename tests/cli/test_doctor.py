import json


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
