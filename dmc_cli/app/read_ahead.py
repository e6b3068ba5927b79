"""Read the input in a thread while Warp is imported and kernels are loaded.

Reading takes as long as both together where values are compressed, and decompression leaves the
interpreter's lock to the imports. So a command starts this first and imports the conversion then.
"""

from contextlib import suppress
from threading import Thread

from dmc_cli.app.memory_budget import reserve_values
from dmc_cli.progress import SILENT, Progress, SilentProgress
from dmc_cli.settings import STREAM, ConvertSettings
from dmc_cli.volume import Volume, forecasting
from dmc_cli.volume_io import check_input, read_volume

_TICK = 0.05
"""Seconds between two looks at how far the thread is."""


class ReadAhead:
    """A volume that is being read.

    The thread is a daemon: whoever is interrupted does not wait for it. Standard input is read by whoever
    asks for the result, because a thread that waits for it cannot be left behind.
    """

    def __init__(self, settings: ConvertSettings) -> None:
        """Begin to read.

        Raises:
            VolumeError: There is no such input, or no reader for it.
        """
        self._settings = settings
        self._volume: Volume | None = None
        self._failure: BaseException | None = None
        self._fraction = 0.0
        self._thread: Thread | None = None
        if settings.input != STREAM:
            check_input(settings.input, settings.read)
            thread = Thread(target=self._run, name="dmc-read", daemon=True)
            with suppress(RuntimeError):  # no thread can be started: whoever asks for the result reads
                thread.start()
                self._thread = thread

    def check(self) -> None:
        """Raise what the reading has failed with, if it has."""
        if self._failure is not None:
            raise self._failure

    def result(self, progress: Progress = SILENT) -> Volume:
        """Wait for the volume and return it, or raise what the reading failed with."""
        if self._thread is None:
            return self._read(progress)
        while self._thread.is_alive():
            self._thread.join(_TICK)
            progress.advance(self._fraction)
        self.check()
        assert self._volume is not None
        volume, self._volume = self._volume, None  # the caller alone decides how long the values live
        return volume

    def _run(self) -> None:
        try:
            self._volume = self._read(_Relay(self))
        except BaseException as error:
            # whatever it is, it is raised again where the result is asked for
            self._failure = error

    def _read(self, progress: Progress) -> Volume:
        settings = self._settings
        with forecasting(lambda shape, size: reserve_values(shape, size, settings)):
            return read_volume(settings.input, settings.read, progress)

    def tell(self, fraction: float) -> None:
        """Note how far the thread is; whoever waits for the result shows it."""
        self._fraction = fraction


class _Relay(SilentProgress):
    """The thread's progress: kept until somebody waits for the result."""

    def __init__(self, ahead: ReadAhead) -> None:
        self._ahead = ahead

    def advance(self, fraction: float) -> None:
        self._ahead.tell(fraction)
