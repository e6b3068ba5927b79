# What other folders use of this one; `__init__.py` says what it is for.

from .inputs import input_format as input_format, read_layout as read_layout
from .label_names import read_label_names as read_label_names, table_beside as table_beside
from .layout import exists as exists
from .pair import pair_files as pair_files
from .raw import RAW_TYPES as RAW_TYPES
from .read import (
    check_input as check_input,
    list_volumes as list_volumes,
    read_volume as read_volume,
    survey_volumes as survey_volumes,
)
from .synthetic import FIELDS as FIELDS, PREFIX as PREFIX, synthetic_volume as synthetic_volume
from .volume_file import choose_volume_format as choose_volume_format, write_volume as write_volume
from .within import Bounds as Bounds, Walk as Walk
from .zarr import is_zarr as is_zarr
