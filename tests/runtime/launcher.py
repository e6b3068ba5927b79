"""A pool of its own for a test, and kernels that tell who did what."""

import numpy as np
import warp as wp

from dmc_cli.runtime.device import select_device
from dmc_cli.runtime.worker_pool import WorkerPool

wp.set_module_options({"enable_backward": False})

DEVICE = select_device("cpu", 1)


class Launcher:
    """What a device does: launches that ask for a number of threads."""

    def __init__(self, threads: int) -> None:
        self.pool = WorkerPool()
        self.threads = threads

    def launch(self, kernel, dim, arguments, grain, longest=0):
        self.pool.launch(kernel, dim, arguments, self.threads, grain, longest)

    def begin(self, kernel, dim, arguments, grain):
        self.pool.begin(kernel, dim, arguments, self.threads, grain)

    def finish(self):
        self.pool.finish()

    def wake(self):
        self.pool.wake(self.threads)

    def workers_awake(self) -> int:
        return sum(worker.is_awake for worker in self.pool._workers)


@wp.kernel
def count_visits_kernel(first: wp.int32, step: wp.int32, visits_inout: wp.array(dtype=wp.int32)):
    """Add a step to each item; two threads at one item would lose one."""
    n = first + wp.tid()
    visits_inout[n] = visits_inout[n] + step


@wp.kernel
def note_order_kernel(first: wp.int32, order_inout: wp.array(dtype=wp.int32)):
    """Note how many went before; item 0 counts them."""
    n = first + wp.tid()
    order_inout[1 + n] = order_inout[0]
    order_inout[0] = order_inout[0] + 1


def visits_of(
    shared: Launcher, dim: int, grain: int, step: int = 1, launches: int = 1, ahead: bool = False
) -> np.ndarray:
    visits = wp.zeros(dim + 1, dtype=wp.int32, device="cpu")
    for _ in range(launches):
        (shared.begin if ahead else shared.launch)(count_visits_kernel, dim, [0, step, visits], grain)
    shared.finish()
    return visits.numpy()
