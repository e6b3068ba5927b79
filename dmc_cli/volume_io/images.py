"""Read folders of PNG, BMP, JPEG and JPEG 2000 images, a slice each.

PNG, BMP and JPEG are decoded by Pillow, JPEG 2000 by openjpeg, which gives values as they are stored; both
are extras. Values are grey ones: of colours only those whose three parts are equal, which is how some
programs write grey.
"""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import UnsupportedFormatError, VolumeError
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Volume, VolumeEntry
from dmc_cli.volume_io.image_kinds import KINDS, are_grey, most_common_kind, turned
from dmc_cli.volume_io.image_resolution import image_lengths, jpeg_2000_lengths
from dmc_cli.volume_io.image_stack import ImageKind, Plane, stack_volume
from dmc_cli.volume_io.layout import check_file
from dmc_cli.volume_io.library_errors import library_errors

MISSING = {
    "Pillow": 'Pillow is not installed; pip install "dmc-cli[images]" or pip install pillow',
    "openjpeg": 'openjpeg is not installed; pip install "dmc-cli[images]" or pip install pylibjpeg-openjpeg',
}

LARGEST_RATIO = 5000
"""No slice of a scan is packed by more on the average of a folder."""

SCALED = {"L;2": 85, "L;4": 17}
"""Grey of few bits that Pillow spreads over 8, and by what factor."""

DEEP_COLORS = ("RGB;16B", "RGBA;16B")
"""Pillow's names of colours of 16 bits."""

FEW_BITS = {"1": 1, "L;2": 2, "L;4": 4}
"""Pillow's names of images of less than 8 bits."""

ORIENTATION = 274
"""Exif's tag."""

GREY_MODES = ("1", "L", "I;16", "I;16B", "I", "F")
"""Pillow's names of grey images."""


def images_volume(path: Path, name: str, settings: ReadSettings, progress: Progress = SILENT) -> Volume:
    """Return the volume of a folder of slices.

    Raises:
        UnsupportedFormatError: A single image, one that is not grey, or what decodes it is missing.
        VolumeError: As `stack_volume`.
    """
    if not path.is_dir():
        check_file(path, name)
        raise UnsupportedFormatError(
            f"{name}: a single image found; expected a volume; give the folder with all slices"
        )
    names = [file.name for file in path.iterdir() if not file.name.startswith(".")]
    found = most_common_kind(names, name, [kind for kind in KINDS if kind != "TIFF"])
    if found is None:
        raise VolumeError(
            f"{name}: no PNG, BMP, JPEG or JPEG 2000 image found; expected a folder of slices; check the path"
        )
    title = found[0]
    opener = _opened_jpeg_2000 if title == "JPEG 2000" else _opened
    kind = ImageKind("images", title, KINDS[title], opener, LARGEST_RATIO)
    return stack_volume(path, name, settings, progress, kind)


def images_entries(path: Path, name: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return the volume of the folder as one entry.

    Raises:
        VolumeError: As `images_volume`.
    """
    return [VolumeEntry(description="images", size=images_volume(path, name, settings).shape)]


@contextmanager
def _opened(path: Path, name: str) -> Iterator[Plane]:
    """Open an image of Pillow's."""
    try:
        from PIL import Image, UnidentifiedImageError
    except ImportError as error:
        raise UnsupportedFormatError(f"{name}: images found, but {MISSING['Pillow']}") from error
    with _told(path, name, UnidentifiedImageError), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # large images, and metadata that nobody looks at
        # opened here: Pillow leaves a file open that cannot be read
        with path.open("rb") as file, Image.open(file, formats=("PNG", "BMP", "DIB", "JPEG")) as image:
            frames = getattr(image, "n_frames", 1)
            if frames > 1:
                raise UnsupportedFormatError(
                    f"{name}: {frames} images found in {path.name}; expected one slice"
                )
            columns, rows = image.size
            raw = _raw_mode(image)
            is_grey = image.mode in GREY_MODES and not raw.endswith(";I")
            dtype = np.dtype("u2" if raw in DEEP_COLORS else "u1")
            if is_grey and image.mode not in ("1", "L"):
                dtype = np.dtype({"I": "i4", "F": "f4"}.get(image.mode, "u2"))
            bits = FEW_BITS.get(image.mode, FEW_BITS.get(raw, 0))
            notices = (
                turned(image.getexif().get(ORIENTATION), str(image.format)) if "exif" in image.info else ()
            )
            yield Plane(
                (rows, columns),
                dtype,
                lambda: _grey(image, raw, path, name),
                notices,
                bits,
                image_lengths(image),
            )


def _raw_mode(image: Any) -> str:
    """Return Pillow's name of how the pixels are stored, empty where it does not tell."""
    arguments = image.tile[0].args if image.tile else ""
    first = arguments[0] if isinstance(arguments, tuple) and arguments else arguments
    return first if isinstance(first, str) else ""


def _grey(image: Any, raw: str, path: Path, name: str) -> AnyArray:
    """Return an image's grey values, as they are stored.

    Raises:
        UnsupportedFormatError: It has colours, or transparent pixels.
    """
    if image.mode in GREY_MODES:
        values: AnyArray = np.asarray(image)
        return values // SCALED[raw] if raw in SCALED else values
    parts = None
    if raw in DEEP_COLORS and "transparency" not in image.info:
        parts = _deep_parts(path, raw)
    elif ";16" not in raw and image.mode in ("RGB", "RGBA", "LA", "P"):
        parts = np.asarray(image.convert("RGBA"))
    if parts is not None and are_grey(parts):
        return parts[..., 0]
    raise UnsupportedFormatError(
        f"{name}: {path.name} has colours or transparent pixels ({raw or image.mode}); expected grey slices; "
        "convert them, or put what is no slice elsewhere"
    )


def _deep_parts(path: Path, raw: str) -> AnyArray:
    """Return the parts of pixels of 16 bits, of which Pillow decodes one byte, as the raw mode says."""
    from PIL import Image

    halves = []
    for half in (raw, raw.replace("16B", "16L")):
        with path.open("rb") as file, Image.open(file, formats=("PNG",)) as image:
            image.tile = [tile._replace(args=half) for tile in image.tile]
            halves.append(np.asarray(image).astype(np.uint16))
    return halves[0] << 8 | halves[1]


@contextmanager
def _opened_jpeg_2000(path: Path, name: str) -> Iterator[Plane]:
    """Open an image of openjpeg's, whose values keep their bits and their sign."""
    try:
        from openjpeg.utils import decode, get_parameters
    except ImportError as error:
        raise UnsupportedFormatError(f"{name}: JPEG 2000 images found, but {MISSING['openjpeg']}") from error
    with _told(path, name):
        content = path.read_bytes()
        told = get_parameters(content)
        if told["samples_per_pixel"] != 1:
            raise UnsupportedFormatError(
                f"{name}: {path.name} has {told['samples_per_pixel']} values a pixel; expected grey slices"
            )
        width = next((bits for bits in (8, 16, 32) if told["precision"] <= bits), 32)
        told_lengths = jpeg_2000_lengths(content)
        dtype = np.dtype(f"{'i' if told['is_signed'] else 'u'}{width // 8}")
        yield Plane((told["rows"], told["columns"]), dtype, lambda: decode(content), told=told_lengths)


@contextmanager
def _told(path: Path, name: str, unknown: type[Exception] = NotImplementedError) -> Iterator[None]:
    """Tell in one message whatever a decoder meets; `unknown` is what it raises for a file of no kind."""
    with library_errors(f"{name}: {path.name} cannot be read", "expected an image; get the file again"):
        try:
            yield
        except unknown as error:
            raise ValueError("it begins like no PNG, BMP or JPEG") from error
