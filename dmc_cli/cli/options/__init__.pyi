# What commands use of the options.

from .from_settings import default_of as default_of, gather as gather, setting as setting, stack as stack
from .labels import label_options as label_options
from .mesh import mesh_options as mesh_options
from .output import (
    DEFAULT_OUTPUT as DEFAULT_OUTPUT,
    force_option as force_option,
    json_option as json_option,
    marked_option as marked_option,
    output_argument as output_argument,
    output_options as output_options,
    require_option as require_option,
    wall_option as wall_option,
)
from .part import part_options as part_options
from .reading import (
    input_argument as input_argument,
    noise_options as noise_options,
    read_options as read_options,
)
from .run import (
    device_option as device_option,
    memory_option as memory_option,
    run_options as run_options,
    threads_option as threads_option,
    verbosity_options as verbosity_options,
)
from .surface import (
    ISOVALUE_HELP as ISOVALUE_HELP,
    isovalues_of as isovalues_of,
    isovalues_option as isovalues_option,
    shape_of_surface_options as shape_of_surface_options,
    surface_options as surface_options,
)
