"""The desk where CPU threads meet to share a launch: what they do there, in native code.

The thread that launches lays a job on the desk and opens it; then, or after it has got the next launch ready,
it takes slabs of it, as each helper does that watches the desk. A helper signs in before and signs out after;
who finds no slab left closes the job; and the thread that launched waits until all have signed out, so nobody
looks at a job that is over. Each thread first takes the slabs of its own part, where the launch before left
its data in the processor's cache, then those of the others' parts.

Warp's language has no atomic words on CPU and cannot call an address, so these few steps are C++.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

LINE = 8
"""Words of a cache line: what different threads write is as far apart."""

OPEN, INSIDE, JOB, PARTS = 0, LINE, 2 * LINE, 4 * LINE
"""Words of the desk: whether a job is open; how many helpers are signed in; the job; the parts of its slabs,
a line each: the next slab of the part, and its end."""

ENTRY, ARGUMENTS, SIZE, SLAB, SLABS, WHOLE, LAST, THREADS, YIELD = range(JOB, JOB + 9)
"""The job: addresses of the kernel's compiled function and of its arguments; their bytes; kernel threads a
slab; slabs; addresses of the launch bounds of a slab and of the last one. Then what never changes: CPU
threads; address of the system's function that lets another thread have the processor."""

BUSY_TURNS = 200
"""Looks at a word, some ten microseconds, before the processor is offered to others at each."""


def _on_cpu(body: str) -> str:
    """Return C++ that is there on a CPU alone, `words` being the desk's."""
    return (
        "\n#if defined(__clang__) && !defined(__CUDA_ARCH__)\n"
        f"long long* words = (long long*)desk.data;\n{body}\n#endif\n"
    )


@wp.func_native(_on_cpu(f"__atomic_store_n(words + {OPEN}, 1, __ATOMIC_SEQ_CST);"))
def open_job(desk: wp.array(dtype=wp.int64)):
    """Let helpers in."""
    ...


@wp.func_native(_on_cpu(f"__atomic_store_n(words + {OPEN}, 0, __ATOMIC_SEQ_CST);"))
def close_job(desk: wp.array(dtype=wp.int64)):
    """Let no more helpers in."""
    ...


@wp.func_native(
    _on_cpu(
        f"""
        if (__atomic_load_n(words + {OPEN}, __ATOMIC_RELAXED)) {{
            __atomic_fetch_add(words + {INSIDE}, 1, __ATOMIC_SEQ_CST);
            if (__atomic_load_n(words + {OPEN}, __ATOMIC_SEQ_CST)) return true;
            __atomic_fetch_sub(words + {INSIDE}, 1, __ATOMIC_SEQ_CST);
        }}
        """
    )
    + "return false;"
)
def sign_in(desk: wp.array(dtype=wp.int64)) -> wp.bool:
    """Sign in if a job is open, and return whether it is."""
    ...


@wp.func_native(_on_cpu(f"__atomic_fetch_sub(words + {INSIDE}, 1, __ATOMIC_SEQ_CST);"))
def sign_out(desk: wp.array(dtype=wp.int64)):
    """Sign out."""
    ...


@wp.func_native(_on_cpu(f"return __atomic_load_n(words + {INSIDE}, __ATOMIC_SEQ_CST) == 0;") + "return true;")
def is_left_by_all(desk: wp.array(dtype=wp.int64)) -> wp.bool:
    """Return whether nobody is signed in."""
    ...


@wp.func_native(
    _on_cpu(
        f"""
        if (turn < {BUSY_TURNS}) {{
        #if defined(__x86_64__)
            __builtin_ia32_pause();
        #endif
        }} else {{
            reinterpret_cast<void (*)()>(words[{YIELD}])();
        }}
        """
    )
)
def rest(desk: wp.array(dtype=wp.int64), turn: wp.int32):
    """Wait a moment: `turn` is how often before."""
    ...


@wp.func_native(
    _on_cpu(
        f"""
        const long long size = words[{SIZE}];
        void* arguments = __builtin_alloca_with_align(size, 512);
        __builtin_memcpy(arguments, (const void*)words[{ARGUMENTS}], size);
        const auto entry = reinterpret_cast<void (*)(void*, void*)>(words[{ENTRY}]);
        for (long long turn = 0; turn < words[{THREADS}]; ++turn) {{
            long long* part = words + {PARTS} + {LINE} * ((own + turn) % words[{THREADS}]);
            while (__atomic_load_n(part, __ATOMIC_RELAXED) < part[1]) {{  // looking disturbs nobody
                const long long slab = __atomic_fetch_add(part, 1, __ATOMIC_RELAXED);
                if (slab >= part[1]) break;
                *(wp::int32*)arguments = (wp::int32)(slab * words[{SLAB}]);  // first
                entry((void*)words[slab + 1 < words[{SLABS}] ? {WHOLE} : {LAST}], arguments);
            }}
        }}
        """
    )
)
def take_slabs(desk: wp.array(dtype=wp.int64), own: wp.int32):
    """Run slabs of the job until none is left, those of the part `own` first."""
    ...


@wp.kernel
def open_kernel(desk: wp.array(dtype=wp.int64)):
    """Open the job on the desk for helpers."""
    open_job(desk)


@wp.kernel
def lead_kernel(desk: wp.array(dtype=wp.int64)):
    """See the job on the desk done: open it, which may have been done before, and take slabs too."""
    open_job(desk)
    take_slabs(desk, 0)
    close_job(desk)
    turn = int(0)
    while not is_left_by_all(desk):
        rest(desk, turn)
        turn += 1


@wp.kernel
def help_kernel(desk: wp.array(dtype=wp.int64), own: wp.int32, patience: wp.int32):
    """Help with every job, its part `own` first, until there has been none for `patience` turns."""
    turn = int(0)
    while turn < patience:
        if sign_in(desk):
            take_slabs(desk, own)
            close_job(desk)
            sign_out(desk)
            turn = 0
        else:
            rest(desk, turn)
            turn += 1
