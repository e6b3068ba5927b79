"""Define every error that the package raises on purpose; imports nothing.

DmcError(Exception)                     the common root; each class knows its exit status
├─ SettingsError(ValueError)         2  a setting is out of its range, or two contradict (output is input)
├─ VolumeError(ValueError)           3  the input cannot be used
│  ├─ UnsupportedFormatError         3  no reader for this file or this variant of its format
│  ├─ DamagedVolumeError             3  header and data disagree, or the data end early
│  └─ AmbiguousVolumeError           4  several series or time points: lists them and the option to choose;
│                                       with --strict also a file that leaves its meaning open
├─ MeshFileError(ValueError)         3  a mesh file that is to be measured is missing or damaged
├─ EmptySurfaceError(ValueError)     5  no quad at this isovalue: names the value range
├─ RequirementError(ValueError)      6  `--require` asks for what the mesh is not
├─ DeviceError(RuntimeError)         7  no such device
│  └─ MemoryBudgetError              7  the work does not fit: bytes needed and bytes available
├─ BatchError(RuntimeError)          8  some items of a batch failed
├─ WriteError(OSError)               9  the output exists, or it cannot be written
├─ CallError(ValueError)             1  a program's call: wrong arrays, or another stage must come first
└─ MeshInvariantError(AssertionError) 1 a bug of ours: which invariant, the first offending index

A message has three parts: what was found, what was expected, what to do.
"""


class DmcError(Exception):
    """Anything that the package raises on purpose."""

    exit_status = 1


class SettingsError(DmcError, ValueError):
    """A setting is out of its range, or contradicts another one."""

    exit_status = 2


class VolumeError(DmcError, ValueError):
    """The input cannot be used."""

    exit_status = 3


class UnsupportedFormatError(VolumeError):
    """There is no reader for this file, or not for this variant of its format."""


class DamagedVolumeError(VolumeError):
    """Header and data disagree, or the data end early."""


class AmbiguousVolumeError(VolumeError):
    """The input holds several volumes; the message lists them and the option that chooses."""

    exit_status = 4


class MeshFileError(DmcError, ValueError):
    """A mesh file that is to be measured is missing or damaged."""

    exit_status = 3


class EmptySurfaceError(DmcError, ValueError):
    """There is no quad at this isovalue."""

    exit_status = 5


class RequirementError(DmcError, ValueError):
    """The mesh is not what `--require` asks for; `report` is the report on it, with the verdicts."""

    exit_status = 6

    def __init__(self, message: str, report: dict[str, object]) -> None:
        super().__init__(message)
        self.report = report


class DeviceError(DmcError, RuntimeError):
    """The device that was asked for is not there."""

    exit_status = 7


class MemoryBudgetError(DeviceError):
    """The work does not fit into the memory."""


class BatchError(DmcError, RuntimeError):
    """Some items of a batch failed."""

    exit_status = 8


class WriteError(DmcError, OSError):
    """The output exists already, or it cannot be written."""

    exit_status = 9


class CallError(DmcError, ValueError):
    """A program calls a function with what it cannot take: wrong arrays, or before another stage.

    The command line makes no such call, so that there it is a bug of ours.
    """


class MeshInvariantError(DmcError, AssertionError):
    """A result breaks an invariant: a bug of ours, to be reported."""
