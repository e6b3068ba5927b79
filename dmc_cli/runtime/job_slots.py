"""Share a launch through job slots: what threads do where they meet there, in native code.

Each thread that launches has a slot. It writes a job into it and opens it; then, or after it has got the next
launch ready, it runs chunks of it, as each worker does that finds it open. A worker signs in before and signs
out after; who finds no chunk left closes the job; and the thread that launched waits until all have signed
out, so nobody looks at a job that is over. Each thread first takes the chunks of its own part, where the
launch before left its data in the processor's cache, then those of the others' parts.

Warp's language has no atomic integers of 64 bits on CPU and cannot call an address: these few steps are C++.
"""

import warp as wp

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

BUSY_TURNS = 200
"""Looks at an entry, some ten microseconds, before the processor is offered to others at each."""

LONGEST_LEAD = 50
"""Milliseconds after which a thread that leads a job looks after the interpreter's signals."""


def _on_cpu(body: str, otherwise: str = "") -> str:
    """Return C++ for a CPU alone: `common` are the board's entries, `words` the slot's."""
    return f"""
    #if defined(__clang__) && !defined(__CUDA_ARCH__)
        long long* common = (long long*)board.data;
        long long* words = common + {FIRST_SLOT} + {SLOT} * (long long)slot;
        {body}
    #else
        return {otherwise};
    #endif
    """


_TAKE = f"""
    const long long size = words[{SIZE}];
    void* arguments = __builtin_alloca_with_align(size, 512);
    __builtin_memcpy(arguments, (const void*)words[{ARGUMENTS}], size);
    const auto entry = reinterpret_cast<void (*)(void*, void*)>(words[{ENTRY}]);
    for (long long turn = 0; turn < words[{PART_COUNT}]; ++turn) {{
        long long* part = words + {PARTS} + {LINE} * ((own + turn) % words[{PART_COUNT}]);
        while (__atomic_load_n(part, __ATOMIC_RELAXED) < part[1]) {{  // looking disturbs nobody
            if (is_over()) return false;
            const long long chunk = __atomic_fetch_add(part, 1, __ATOMIC_RELAXED);
            if (chunk >= part[1]) break;
            *(wp::int32*)arguments = (wp::int32)(chunk * words[{CHUNK}]);  // first
            entry((void*)words[chunk + 1 < words[{CHUNKS}] ? {WHOLE} : {LAST}], arguments);
        }}
    }}
    return true;
"""
"""Run chunks, those of the part `own` first, until none is left or time `is_over`; return whether none is."""

_TIME = f"""
    auto now = [&]() -> long long {{  // milliseconds
        if (common[{CLOCK_ID}] < 0) return reinterpret_cast<long long (*)()>(common[{CLOCK}])();
        long long time[2] = {{0, 0}};  // seconds and nanoseconds
        const auto read_clock = reinterpret_cast<wp::int32 (*)(wp::int32, void*)>(common[{CLOCK}]);
        read_clock((wp::int32)common[{CLOCK_ID}], time);
        return time[0] * 1000 + time[1] / 1000000;
    }};
    const long long end = now() + {LONGEST_LEAD};
    auto is_over = [&] {{ return now() > end; }};
"""

_REST = f"""
    if (turn < {BUSY_TURNS}) {{
    #if defined(__x86_64__)
        __builtin_ia32_pause();
    #endif
    }} else {{
        reinterpret_cast<void (*)()>(common[{YIELD}])();
    }}
"""


@wp.func_native(
    _on_cpu(
        f"""
        for (long long n = 0; n < words[{PART_COUNT}]; ++n) {{
            long long* part = words + {PARTS} + {LINE} * n;
            part[1] = words[{CHUNKS}] * (n + 1) / words[{PART_COUNT}];
            __atomic_store_n(part, words[{CHUNKS}] * n / words[{PART_COUNT}], __ATOMIC_RELAXED);
        }}
        words[{DONE}] = 0;
        __atomic_store_n(words + {OPEN}, 1, __ATOMIC_SEQ_CST);
        """
    )
)
def open_job(board: wp.array(dtype=wp.int64), slot: wp.int32) -> None:
    """Divide the job's chunks into parts and let workers in."""
    ...


@wp.func_native(_on_cpu(f"__atomic_store_n(words + {OPEN}, 0, __ATOMIC_SEQ_CST);"))
def close_job(board: wp.array(dtype=wp.int64), slot: wp.int32) -> None:
    """Let no more workers in."""
    ...


@wp.func_native(
    _on_cpu(
        f"""
        for (long long n = 0; n < words[{PART_COUNT}]; ++n) {{
            long long* part = words + {PARTS} + {LINE} * n;
            __atomic_store_n(part, part[1], __ATOMIC_SEQ_CST);
        }}
        """
    )
)
def drop_chunks(board: wp.array(dtype=wp.int64), slot: wp.int32) -> None:
    """Leave the chunks that nobody has taken undone."""
    ...


@wp.func_native(
    _on_cpu(
        f"""
        const long long most = __atomic_load_n(words + {WORKERS}, __ATOMIC_RELAXED);
        if (__atomic_load_n(words + {OPEN}, __ATOMIC_RELAXED)
            && __atomic_load_n(words + {INSIDE}, __ATOMIC_RELAXED) < most) {{
            const long long before = __atomic_fetch_add(words + {INSIDE}, 1, __ATOMIC_SEQ_CST);
            if (__atomic_load_n(words + {OPEN}, __ATOMIC_SEQ_CST) && before < words[{WORKERS}]) return true;
            __atomic_fetch_sub(words + {INSIDE}, 1, __ATOMIC_SEQ_CST);
        }}
        return false;
        """,
        otherwise="false",
    )
)
def sign_in(board: wp.array(dtype=wp.int64), slot: wp.int32) -> wp.bool:
    """Sign in if the slot's job is open and may have one more worker, and return whether it is."""
    ...


@wp.func_native(_on_cpu(f"__atomic_fetch_sub(words + {INSIDE}, 1, __ATOMIC_SEQ_CST);"))
def sign_out(board: wp.array(dtype=wp.int64), slot: wp.int32) -> None:
    """Sign out, after work on a slot's job."""
    ...


@wp.func_native(_on_cpu(_REST))
def rest(board: wp.array(dtype=wp.int64), slot: wp.int32, turn: wp.int32) -> None:
    """Wait a moment: `turn` is how often before."""
    ...


@wp.func_native(_on_cpu(_TIME + "const int own = 0;" + _TAKE, otherwise="true"))
def take_chunks_awhile(board: wp.array(dtype=wp.int64), slot: wp.int32) -> wp.bool:
    """Run chunks of the job, not for long, and return whether none is left."""
    ...


@wp.func_native(_on_cpu("auto is_over = [] { return false; };" + _TAKE, otherwise="true"))
def take_chunks(board: wp.array(dtype=wp.int64), slot: wp.int32, own: wp.int32) -> wp.bool:
    """Run chunks of the job until none is left, those of the part `own` first."""
    ...


@wp.func_native(
    _on_cpu(
        _TIME
        + f"""
        for (int turn = 0; __atomic_load_n(words + {INSIDE}, __ATOMIC_SEQ_CST); ++turn) {{
            if (turn >= {BUSY_TURNS} && is_over()) return false;
            {_REST}
        }}
        words[{DONE}] = 1;
        return true;
        """,
        otherwise="true",
    )
)
def see_done(board: wp.array(dtype=wp.int64), slot: wp.int32) -> wp.bool:
    """Wait, not for long, until nobody is signed in, and return whether that is so: then the job is done."""
    ...


@wp.func_native(
    _on_cpu(f"return __atomic_load_n(common + {STOPPED}, __ATOMIC_RELAXED) != 0;", otherwise="true")
)
def is_stopped(board: wp.array(dtype=wp.int64), slot: wp.int32) -> wp.bool:
    """Return whether workers shall end."""
    ...


@wp.func_native(
    _on_cpu(f"return (wp::int32)__atomic_load_n(common + {SLOT_COUNT}, __ATOMIC_RELAXED);", otherwise="0")
)
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
