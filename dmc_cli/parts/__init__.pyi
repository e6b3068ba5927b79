# What other folders use of this one; `__init__.py` says what it is for.

from .band import band_bytes as band_bytes, band_volume as band_volume
from .blending import blending_bytes as blending_bytes
from .components import RUN_BYTES as RUN_BYTES
from .crop import crop_volume as crop_volume
from .filtering import (
    resampled_shape as resampled_shape,
    resampled_volume as resampled_volume,
    smoothed_volume as smoothed_volume,
)
from .kernels import kernel_modules as kernel_modules
from .label_resampling import resampled_labels as resampled_labels
from .label_selection import select_labels as select_labels
from .selection import list_components as list_components, select_part as select_part
from .table import cut_table as cut_table
