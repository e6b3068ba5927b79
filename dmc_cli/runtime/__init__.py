"""Run kernels; all that knows Warp's private side.

arrays           Warp arrays over memory that is there already
buffer_pool      memory that is kept for the next array
kernel_cache     compiled kernels on the disk
warp_launch      a kernel launched by Warp
compiled_kernel  a kernel called without Warp's launch
native_code      C++ of native functions, from the headers beside the kernels
pointers         how headers reach arrays, so that each access can be checked
job, job_slots, worker_pool  the CPU threads that share a launch
prefix_sums      the prefix sum of a long array, by all threads
device           devices, and the one way to launch a kernel
kernels          the modules with kernels that launches need
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
