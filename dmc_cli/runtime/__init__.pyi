# What other folders use of this one; `__init__.py` says what it is for.

from .arrays import adopt as adopt, size_of as size_of, view as view
from .buffer_pool import SPARE_SHARE as SPARE_SHARE
from .device import (
    FLAGS_A_CHUNK as FLAGS_A_CHUNK,
    ITEMS_A_CHUNK as ITEMS_A_CHUNK,
    Device as Device,
    initialize_warp as initialize_warp,
    launch_fallback as launch_fallback,
    load_kernels as load_kernels,
    mesh_size as mesh_size,
    select_device as select_device,
)
from .kernel_cache import cache_folder as cache_folder
from .kernels import launch_kernels as launch_kernels
from .native_code import native as native
