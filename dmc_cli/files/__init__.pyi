# What other folders use of this one; `__init__.py` says what it is for.

from .atomic import (
    check_output as check_output,
    is_device as is_device,
    open_output as open_output,
    part_of as part_of,
    write_error as write_error,
    write_output as write_output,
    write_with_companion as write_with_companion,
)
from .streams import whole_writes as whole_writes
