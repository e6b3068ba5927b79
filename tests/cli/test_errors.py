"""Errors become messages and exit status in one place."""

import errno
import os
import resource

import click
import pytest
from click.testing import CliRunner

from dmc_cli import errors
from dmc_cli.cli.group import DmcGroup
from dmc_cli.cli.signals import Stopped

STATUS = {
    "SettingsError": 2,
    "VolumeError": 3,
    "UnsupportedFormatError": 3,
    "DamagedVolumeError": 3,
    "AmbiguousVolumeError": 4,
    "MeshFileError": 3,
    "EmptySurfaceError": 5,
    "RequirementError": 6,
    "DeviceError": 7,
    "MemoryBudgetError": 7,
    "BatchError": 8,
    "WriteError": 9,
}


def outcome(error):
    @click.group(cls=DmcGroup)
    def group():
        pass

    @group.command()
    def fail():
        raise error

    return CliRunner().invoke(group, ["fail"])


@pytest.mark.parametrize("name", STATUS)
def test_each_error_has_its_status_and_one_message(name):
    more = ({},) if name == "RequirementError" else ()  # the report
    result = outcome(getattr(errors, name)("found this; expected that; do so", *more))
    assert result.exit_code == STATUS[name]
    assert result.stderr == "Error: found this; expected that; do so\n"
    assert result.stdout == ""


def test_no_error_class_is_forgotten():
    classes = {name for name, value in vars(errors).items() if isinstance(value, type) and name != "DmcError"}
    assert classes - {"CallError", "MeshInvariantError"} == set(STATUS)


def test_a_broken_invariant_and_a_wrong_call_are_bugs_of_ours():
    assert errors.MeshInvariantError.exit_status == errors.CallError.exit_status == 1


def test_no_memory_ends_with_status_7():
    result = outcome(MemoryError("Unable to allocate 9 TiB"))
    assert result.exit_code == 7
    assert "Unable to allocate 9 TiB" in result.stderr


NO_MEMORY = [
    MemoryError(),
    OSError(errno.ENOMEM, "Cannot allocate memory"),
    ImportError("libopenblas.so: failed to map segment from shared object"),
    RuntimeError("can't start new thread"),
]


@pytest.mark.parametrize("error", NO_MEMORY, ids=lambda error: type(error).__name__)
def test_whatever_means_no_memory_ends_with_status_7(error):
    result = outcome(error)
    assert result.exit_code == 7
    assert result.stderr.startswith("Error: the memory is used up (")
    assert "()" not in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize("error", [OSError(errno.EIO, "odd"), ImportError("odd"), RuntimeError("odd")])
def test_what_means_something_else_stays_what_it_is(error):
    assert outcome(error).exception is error


@pytest.mark.parametrize("megabytes", [150, 400])
def test_a_limit_on_memory_ends_with_status_7_wherever_it_strikes(run_process, tmp_path, megabytes):
    """In NumPy's libraries, which would end the process, and in Warp's."""
    limits = (megabytes << 20, resource.RLIM_INFINITY)
    result = run_process(
        "convert", "synth:torus:16", tmp_path / "mesh.ply", "-i", 0,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, limits),
    )  # fmt: skip
    assert result.returncode == 7, result.stderr
    assert result.stderr.startswith("Error: the memory is used up (")
    assert result.stderr.count("\n") == 1
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(("number", "status"), [(2, 130), (15, 143)])
def test_a_signal_has_the_status_that_shells_use(number, status):
    result = outcome(Stopped(number))
    assert result.exit_code == status
    assert "no output was left incomplete" in result.stderr


def test_a_bug_of_ours_keeps_its_traceback():
    result = outcome(ZeroDivisionError("oops"))
    assert isinstance(result.exception, ZeroDivisionError)


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EPIPE, errno.EBADF])
def test_what_standard_output_runs_into_ends_with_status_9(number):
    result = outcome(OSError(number, "oops"))
    assert result.exit_code == 9
    assert result.stderr.startswith("Error: standard output cannot be written: ")


def test_any_other_error_of_the_system_is_a_bug_of_ours():
    assert isinstance(outcome(PermissionError(errno.EACCES, "oops")).exception, PermissionError)


def test_memory_that_is_used_up_is_told_without_words_of_the_system():
    assert "the memory is used up (no more could be allocated)" in outcome(MemoryError()).stderr
