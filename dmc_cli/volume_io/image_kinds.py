"""Know the kinds of images that slices are written as, by their suffixes, and the tag that turns them."""

from collections import Counter
from collections.abc import Collection, Iterable
from pathlib import PurePath

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import AmbiguousVolumeError
from dmc_cli.notices import Notice

KINDS = {
    "TIFF": (".tif", ".tiff"),
    "PNG": (".png",),
    "BMP": (".bmp",),
    "JPEG 2000": (".jp2", ".j2k", ".j2c", ".jpc", ".jpf", ".jpx"),
    "JPEG": (".jpg", ".jpeg"),
}
"""Suffixes by the name of the kind."""


def turned(orientation: object, title: str) -> tuple[Notice, ...]:
    """Return what is told of images whose tag Orientation, of TIFF and Exif, is not 1: as stored."""
    if orientation in (None, 0, 1):
        return ()
    sentence = f"the {title} images are to be turned or mirrored by their tag Orientation; taken as stored"
    return (Notice("W-IMAGE-TURNED", sentence),)


def are_grey(parts: AnyArray) -> bool:
    """Return whether the colours of all pixels are the same, and opaque where there is a fourth."""
    is_opaque = (parts[..., 3:] == np.iinfo(parts.dtype).max).all()
    return bool(is_opaque and (parts[..., :3] == parts[..., :1]).all())


def kind_of(file_name: str) -> str | None:
    """Return the kind of image that a file's suffix means, or None."""
    suffix = PurePath(file_name).suffix.lower()
    return next((kind for kind, suffixes in KINDS.items() if suffix in suffixes), None)


def most_common_kind(
    file_names: Iterable[str], name: str, among: Collection[str] = tuple(KINDS)
) -> tuple[str, int] | None:
    """Return the kind that most files have, and how many they are; None where there is no image.

    Args:
        file_names: Of a folder.
        name: The input, for messages.
        among: Kinds that count.

    Raises:
        AmbiguousVolumeError: Two kinds have the same number of files, and several each.
    """
    counts = Counter(kind for file_name in file_names if (kind := kind_of(file_name)) in among)
    (first, count), *others = counts.most_common(2) or [(None, 0)]
    if first is None:
        return None
    if others and others[0][1] == count > 1:
        raise AmbiguousVolumeError(
            f"{name}: {count} {first} files and as many {others[0][0]} files found; expected slices of one "
            "kind; put the others into a folder of their own"
        )
    return first, count
