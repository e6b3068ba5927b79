"""How kernels run on a CPU: calls of compiled kernels, the threads that share them, and how they are stopped.

Read `compiled_kernel.py`, then `worker_pool.py`, `job.py`, and `job_slots.py`, which is what its threads do
in native code. `stop.py` lets one thread ask others to stop; `kernel_cache.py` loads what is compiled and
mends what is damaged.
"""
