"""What `dmc --help` costs: nothing heavy is imported. Proved by the modules, not by a clock."""

import subprocess
import sys

import pytest

from dmc_cli.cli import dmc

HEAVY = ["warp", "numpy", "nibabel", "pydicom", "nrrd", "meshio", "rich", "orjson", "asyncio"]
PROBE = """
import sys
from dmc_cli.cli import dmc
try:
    dmc(sys.argv[1:])
except SystemExit as stop:
    assert not stop.code, stop.code
print(*sorted(set(sys.modules) & {heavy}), file=sys.stderr)
"""


@pytest.mark.parametrize(
    "words", [["--help"], ["-h"], ["--version"], *([name, "--help"] for name in dmc.commands)], ids=" ".join
)
def test_help_imports_nothing_heavy(words):
    probe = PROBE.replace("{heavy}", repr(set(HEAVY)))
    result = subprocess.run(
        [sys.executable, "-c", probe, *words], capture_output=True, encoding="utf-8", check=True, timeout=60
    )
    assert result.stderr.strip() == ""
    assert "dmc" in result.stdout


def test_python_dash_m_is_the_same_program(run_process):
    result = run_process("--version")
    assert result.returncode == 0
    assert result.stdout.startswith("dmc, version ")
