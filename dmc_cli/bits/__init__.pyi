# What other folders use of this one; `__init__.py` says what it is for.

from .flags import ANY as ANY, flagged as flagged
from .kernels import selection_kernels as selection_kernels
from .selection import (
    WORDS_A_CHUNK as WORDS_A_CHUNK,
    concatenated as concatenated,
    keep_flagged as keep_flagged,
    keep_masked as keep_masked,
    list_mask as list_mask,
    mask_flagged as mask_flagged,
    mask_length as mask_length,
    order_key as order_key,
    part as part,
)
from .words import (
    ALL_BITS as ALL_BITS,
    LANES as LANES,
    VECTOR_FLAGS as VECTOR_FLAGS,
    Words as Words,
    bit_index as bit_index,
    has_bit as has_bit,
    low_bits as low_bits,
    next_node as next_node,
    previous_node as previous_node,
)
