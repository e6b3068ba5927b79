"""Split `file.h5:/entry/data`, a file and a dataset in it."""

import os
from pathlib import Path

from dmc_cli.volume_io.layout import exists


def split_dataset(path: Path) -> tuple[Path, str]:
    """Return the file and the dataset that a path names; none where a file has the whole name."""
    file, colon, dataset = os.fspath(path).rpartition(":")
    if not colon or not dataset or exists(path) or not exists(Path(file)) or not Path(file).is_file():
        return path, ""
    return Path(file), dataset
