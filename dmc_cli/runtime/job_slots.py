"""Share a launch through job slots: what threads do where they meet there, in native code.

Each thread that launches has a slot. It writes a job into it and opens it; then, or after it has got the next
launch ready, it runs chunks of it, as each worker does that finds it open. A worker signs in before and signs
out after; who finds no chunk left closes the job; and the thread that launched waits until all have signed
out, so nobody looks at a job that is over. Each thread first takes the chunks of its own part, where the
launch before left its data in the processor's cache, then those of the others' parts.

Warp's language has no atomic integers of 64 bits on CPU and cannot call an address: these few steps are C++
(`job_slots.h`, whose structs have the entries below as fields of the same names).
"""

import warp as wp

from dmc_cli.runtime.native_code import native

wp.set_module_options({"enable_backward": False})

LINE = 8
"""Entries, 64 bits each, of a cache line: what different threads write is as far apart."""

MOST_PARTS = 64
"""Parts that a job's chunks are divided into at most; with more threads, some share a part."""

MOST_SLOTS = 64
"""Threads that launch at the same time and get help; others work alone."""

OPEN, INSIDE, JOB, PARTS = 0, LINE, 2 * LINE, 4 * LINE
"""Entries of a slot: whether its job is open; how many workers are signed in; the job; the parts of its
chunks, a line each: the next chunk of the part, and its end."""

ENTRY, ARGUMENTS, SIZE, CHUNK, CHUNKS, WHOLE, LAST, PART_COUNT, WORKERS, DONE = range(JOB, JOB + 10)
"""The job: addresses of the kernel's compiled function and of its arguments; their bytes; kernel threads a
chunk; chunks; addresses of the launch bounds of a chunk and of the last one; parts; workers that may help;
whether it is done."""

SLOT = PARTS + LINE * MOST_PARTS
"""Entries of a slot."""

STOPPED, SLOT_COUNT, YIELD, CLOCK, CLOCK_ID, FIRST_SLOT = 0, LINE, LINE + 1, LINE + 2, LINE + 3, 2 * LINE
"""Entries of the board: whether workers shall end; how many slots are in use; addresses of the system's
functions that let another thread have the processor and that tell the time, and the number of the clock, or
-1 for a function that returns milliseconds; the slots."""

BOARD = FIRST_SLOT + SLOT * MOST_SLOTS
"""Entries of the board."""

BUSY_LOOKS = 200
"""Looks at an entry, some ten microseconds, before the processor is offered to others at each."""

LONGEST_LEAD = 50
"""Milliseconds after which a thread that leads a job looks after the interpreter's signals."""


@wp.func_native(native(__file__, "open_job"))
def open_job(board: wp.array(dtype=wp.int64), slot: wp.int32) -> None:
    """Divide the job's chunks into parts and let workers in."""
    ...


@wp.func_native(native(__file__, "close_job"))
def close_job(board: wp.array(dtype=wp.int64), slot: wp.int32) -> None:
    """Let no more workers in."""
    ...


@wp.func_native(native(__file__, "drop_chunks"))
def drop_chunks(board: wp.array(dtype=wp.int64), slot: wp.int32) -> None:
    """Leave the chunks that nobody has taken undone."""
    ...


@wp.func_native(native(__file__, "sign_in"))
def sign_in(board: wp.array(dtype=wp.int64), slot: wp.int32) -> wp.bool:
    """Sign in if the slot's job is open and may have one more worker, and return whether it is."""
    ...


@wp.func_native(native(__file__, "sign_out"))
def sign_out(board: wp.array(dtype=wp.int64), slot: wp.int32) -> None:
    """Sign out, after work on a slot's job."""
    ...


@wp.func_native(native(__file__, "rest", BUSY_LOOKS=BUSY_LOOKS))
def rest(board: wp.array(dtype=wp.int64), slot: wp.int32, looks: wp.int32) -> None:
    """Wait a moment; `looks` is how often an entry was looked at in vain before."""
    ...


@wp.func_native(native(__file__, "take_chunks_awhile", LONGEST_LEAD=LONGEST_LEAD))
def take_chunks_awhile(board: wp.array(dtype=wp.int64), slot: wp.int32) -> wp.bool:
    """Run chunks of the job, not for long, and return whether none is left."""
    ...


@wp.func_native(native(__file__, "take_chunks"))
def take_chunks(board: wp.array(dtype=wp.int64), slot: wp.int32, own: wp.int32) -> wp.bool:
    """Run chunks of the job until none is left, those of the part `own` first."""
    ...


@wp.func_native(native(__file__, "see_done", BUSY_LOOKS=BUSY_LOOKS, LONGEST_LEAD=LONGEST_LEAD))
def see_done(board: wp.array(dtype=wp.int64), slot: wp.int32) -> wp.bool:
    """Wait, not for long, until nobody is signed in, and return whether that is so: then the job is done."""
    ...


@wp.func_native(native(__file__, "is_stopped"))
def is_stopped(board: wp.array(dtype=wp.int64), slot: wp.int32) -> wp.bool:
    """Return whether workers shall end."""
    ...


@wp.func_native(native(__file__, "slot_count"))
def slot_count(board: wp.array(dtype=wp.int64), slot: wp.int32) -> wp.int32:
    """Return how many slots are in use."""
    ...


@wp.kernel
def open_kernel(board: wp.array(dtype=wp.int64), slot: wp.int32) -> None:
    """Open a slot's job for workers."""
    open_job(board, slot)


@wp.kernel
def lead_kernel(board: wp.array(dtype=wp.int64), slot: wp.int32, opens: wp.bool) -> None:
    """Work on a slot's job until it is done or time is over; open it first, if it is not yet."""
    if opens:
        open_job(board, slot)
    if take_chunks_awhile(board, slot):
        close_job(board, slot)
        see_done(board, slot)


@wp.kernel
def drop_kernel(board: wp.array(dtype=wp.int64), slot: wp.int32) -> None:
    """Drop what is left of a slot's job, and wait for those who are at work on it."""
    close_job(board, slot)
    drop_chunks(board, slot)
    is_done = bool(False)
    while not is_done:
        is_done = see_done(board, slot)


@wp.kernel
def help_kernel(board: wp.array(dtype=wp.int64), own: wp.int32, patience: wp.int32) -> None:
    """Help with every job, its part `own` first, until `patience` looks at all slots found none."""
    looks = int(0)
    slot = int(0)
    while looks < patience and not is_stopped(board, slot):
        count = slot_count(board, slot)
        for _n in range(count):
            slot = wp.where(slot + 1 < count, slot + 1, 0)
            if sign_in(board, slot):
                take_chunks(board, slot, own)
                close_job(board, slot)
                sign_out(board, slot)
                looks = -1
        if looks >= 0:
            rest(board, slot, looks)
        looks += 1
