"""How the tests of the command line call it."""

import subprocess
import sys

import pytest
from click.testing import CliRunner

from dmc_cli.cli import dmc


@pytest.fixture
def run():
    """Call `dmc` in this process; an unexpected exception fails the test with its traceback."""

    def call(*words, input=None):
        result = CliRunner().invoke(dmc, [str(word) for word in words], input=input)
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result

    return call


@pytest.fixture
def run_process():
    """Call `dmc` in a process of its own, as a shell does."""

    def call(*words, **options):
        command = [sys.executable, "-m", "dmc_cli", *(str(word) for word in words)]
        return subprocess.run(command, capture_output=True, text=True, timeout=200, check=False, **options)

    return call
