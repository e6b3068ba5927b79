# What other folders use of this one; `__init__.py` says what it is for.

from .allocation import (
    allocate_values as allocate_values,
    available_bytes as available_bytes,
    forecasting as forecasting,
)
from .checks import (
    FARTHEST_MM as FARTHEST_MM,
    WIDENED as WIDENED,
    check_affine as check_affine,
    check_shape as check_shape,
    storable_type as storable_type,
    widened_type as widened_type,
)
from .histogram import Histogram as Histogram, count_values as count_values
from .label_guess import looks_like_labels as looks_like_labels, told_as_labels as told_as_labels
from .label_table import Color as Color, Label as Label
from .labels import (
    LabelValues as LabelValues,
    encode_labels as encode_labels,
    find_labels as find_labels,
)
from .mapping import intact as intact, map_file as map_file, mapped_file as mapped_file
from .space import (
    RAS_LPS as RAS_LPS,
    UNIT_LENGTHS as UNIT_LENGTHS,
    is_turned as is_turned,
    output_affine as output_affine,
)
from .suggestions import Chosen as Chosen, Suggestion as Suggestion, Suggestions as Suggestions
from .tkr import TKR_AXES as TKR_AXES, VolumeGeometry as VolumeGeometry, volume_geometry as volume_geometry
from .volume import Space as Space, Volume as Volume, VolumeEntry as VolumeEntry
