import os
import subprocess
import sys

import pytest


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_calls_dmc(run, shell):
    result = run("completion", shell)
    assert result.exit_code == 0
    assert "_DMC_COMPLETE" in result.stdout


def test_values_of_an_option_are_completed():
    environment = {
        "_DMC_COMPLETE": "bash_complete",
        "COMP_WORDS": "dmc convert a b --topology m",
        "COMP_CWORD": "5",
    }
    program = "from dmc_cli.cli import dmc; dmc(prog_name='dmc')"
    result = subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | environment,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert result.stdout == "plain,manifold\n"
