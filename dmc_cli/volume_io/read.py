"""Read a volume from a path, whatever its format: the one way in.

`inputs.py` finds out what the input is. A new format is a reader, and an entry in `volume_formats.py`.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from dmc_cli.errors import DmcError, VolumeError
from dmc_cli.notices import refuse_uncertain
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import STREAM, ReadSettings
from dmc_cli.volume import Volume, VolumeEntry
from dmc_cli.volume_formats import FORMATS, reader
from dmc_cli.volume_io.inputs import Input, input_format, opened, read_layout, spooled_input
from dmc_cli.volume_io.layout import file_entry
from dmc_cli.volume_io.synthetic import PREFIX, parse_synthetic, synthetic_volume
from dmc_cli.volume_io.unused_options import unused_options
from dmc_cli.volume_io.values import load_volume


def read_volume(path: str, settings: ReadSettings, progress: Progress = SILENT) -> Volume:
    """Read a volume: a file, packed or not, a folder, an archive, `synth:FIELD:N`, or `-`.

    Args:
        path: The input as the user named it.
        settings: How to read it; what the format does not need is ignored, with a warning.
        progress: Who is told the stages.

    Returns:
        The volume, at least two nodes along each axis, its affine invertible.

    Raises:
        VolumeError: The input cannot be used; its subclasses tell why.
        AmbiguousVolumeError: Several volumes, or `settings.strict` and a warning about meaning.
        SettingsError: The format needs a setting that is missing or wrong.
        MemoryBudgetError: The values do not fit into the memory that is free.
    """
    if path.startswith(PREFIX):
        return _warned(synthetic_volume(path, settings, progress), "synthetic", settings)
    with _told_errors(path):
        if path == STREAM:
            with spooled_input(settings) as file:
                return replace(_read_path(file, STREAM, settings, progress), files=())
        return _read_path(Path(path), path, settings, progress)


def check_input(path: str, settings: ReadSettings) -> None:
    """Find out, without reading it, whether there is an input and a reader for it.

    Raises:
        VolumeError: There is no such input, or it is empty.
        UnsupportedFormatError: No reader knows it.
    """
    if path.startswith(PREFIX):
        parse_synthetic(path)
    elif path != STREAM:
        with _told_errors(path):
            input_format(Path(path), path, settings)


def list_volumes(path: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return what there is to choose from in an input: the series of a folder, or the one volume of a file.

    The values are not read. A file with several volumes is one entry that tells how many.

    Raises:
        VolumeError: The input cannot be used; its subclasses tell why.
        SettingsError: The format needs a setting that is missing or wrong.
    """
    if path.startswith(PREFIX):
        field, count = parse_synthetic(path)
        return [VolumeEntry(description=f"synthetic field {field}", size=(count, count, count))]
    with _told_errors(path), opened(Path(path), path, settings) as found:
        return _entries(found, path, settings)


def survey_volumes(
    path: str, settings: ReadSettings, progress: Progress = SILENT
) -> tuple[list[VolumeEntry], Volume | None]:
    """Return what `list_volumes` does, and what `read_volume` does where no choice of a series is left.

    Each file is opened once for both. Nothing is listed of standard input.

    Raises:
        VolumeError: As both.
        SettingsError: As both.
    """
    if path == STREAM or path.startswith(PREFIX):
        entries = [] if path == STREAM else list_volumes(path, settings)
        return entries, read_volume(path, settings, progress)
    with _told_errors(path), opened(Path(path), path, settings) as found:
        survey = FORMATS[found.format_name].survey
        if survey:
            entries, volume = reader(survey)(found.path, path, settings, progress)
            return entries, None if volume is None else _finished(volume, found, settings)
        entries = _entries(found, path, settings)
        if len(entries) > 1 and settings.series is None:
            return entries, None
        return entries, _finished(_values(found, path, settings, progress), found, settings)


def _entries(found: Input, name: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return the entries of a file or folder."""
    known = FORMATS[found.format_name]
    if known.entries:
        entries: list[VolumeEntry] = reader(known.entries)(found.path, name, settings)
        return entries
    layout = read_layout(found.format_name, found.path, name, replace(settings, volume_index=0))
    is_filtered = settings.channel is not None or settings.time is not None
    count = len(layout.listed) if is_filtered and layout.listed else layout.count
    return [file_entry(found.format_name, count, layout.shape, layout.listed)]


@contextmanager
def _told_errors(name: str) -> Iterator[None]:
    """Tell in one message what the system refuses while an input is read, wherever a reader meets it."""
    try:
        yield
    except (DmcError, BrokenPipeError):
        raise
    except (OSError, UnicodeError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise VolumeError(
            f"{name}: cannot be read ({reason}); expected files that can be read to their end; check the "
            "path, the disk and the access rights"
        ) from error


def _read_path(path: Path, name: str, settings: ReadSettings, progress: Progress) -> Volume:
    with opened(path, name, settings) as found:
        volume = _values(found, name, settings, progress)
    return _finished(volume, found, settings)


def _values(found: Input, name: str, settings: ReadSettings, progress: Progress) -> Volume:
    """Return the volume as its reader gives it."""
    known = FORMATS[found.format_name]
    if known.read:
        volume: Volume = reader(known.read)(found.path, name, settings, progress)
        return volume
    return load_volume(read_layout(found.format_name, found.path, name, settings), progress)


def _finished(volume: Volume, found: Input, settings: ReadSettings) -> Volume:
    """Return the volume with what is told of its input.

    Raises:
        AmbiguousVolumeError: As `_warned`.
    """
    if found.packed is not None:
        volume = replace(volume, files=(found.packed,))
    volume = replace(volume, warnings=(*found.notices, *volume.warnings))
    return _warned(volume, found.format_name, settings)


def _warned(volume: Volume, format_name: str, settings: ReadSettings) -> Volume:
    """Return the volume with a warning for each option that has no effect on its format.

    Raises:
        AmbiguousVolumeError: `settings.strict`, and a warning is about the meaning of the file.
    """
    if settings.strict:
        refuse_uncertain(volume.warnings, volume.path)
    return replace(volume, warnings=(*unused_options(format_name, settings), *volume.warnings))
