// Share a launch through job slots: see job_slots.py, which has the places of what lies here.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

namespace job_slots {

struct Part {
    long long next;
    long long end;
    long long rest_of_line[6];
};

struct Slot {
    long long open;
    long long after_open[7];
    long long inside;
    long long after_inside[7];
    long long entry;
    long long arguments;
    long long size;
    long long chunk;
    long long chunks;
    long long whole;
    long long last;
    long long part_count;
    long long workers;
    long long done;
    long long after_done[6];
    Part parts[64];
};

struct Board {
    long long stopped;
    long long after_stopped[7];
    long long slot_count;
    long long yield;
    long long clock;
    long long clock_id;
    long long after_clock[4];
    Slot slots[64];
};

static CUDA_CALLABLE Board& board_at(const wp::array_t<wp::int64>& board) {
    return *RUN(ITEMS(Board, board), 1);
}

#if defined(__clang__) && !defined(__CUDA_ARCH__)

// Return the time in milliseconds
static CUDA_CALLABLE long long now(const Board& board) {
    if (board.clock_id < 0) return reinterpret_cast<long long (*)()>(board.clock)();
    long long time[2] = {0, 0};  // seconds and nanoseconds
    const auto read_clock = reinterpret_cast<wp::int32 (*)(wp::int32, void*)>(board.clock);
    read_clock((wp::int32)board.clock_id, time);
    return time[0] * 1000 + time[1] / 1000000;
}

// Wait a moment; after `most_busy` looks before, offer the processor to others
static CUDA_CALLABLE void pause(const Board& board, int looks, int most_busy) {
    if (looks < most_busy) {
#if defined(__x86_64__)
        __builtin_ia32_pause();
#endif
    } else {
        reinterpret_cast<void (*)()>(board.yield)();
    }
}

// Run chunks, those of the part `own` first, until none is left or the time `end`, if that is not 0, is over;
// return whether none is left
static CUDA_CALLABLE bool run_chunks(const Board& board, Slot& slot, int own, long long end) {
    const long long size = slot.size;
    void* arguments = __builtin_alloca_with_align(size, 512);
    __builtin_memcpy(arguments, (const void*)slot.arguments, size);
    const auto entry = reinterpret_cast<void (*)(void*, void*)>(slot.entry);
    for (long long n = 0; n < slot.part_count; ++n) {
        Part& part = slot.parts[(own + n) % slot.part_count];
        while (__atomic_load_n(&part.next, __ATOMIC_RELAXED) < part.end) {  // looking disturbs nobody
            if (end && job_slots::now(board) > end) return false;
            const long long chunk = __atomic_fetch_add(&part.next, 1, __ATOMIC_RELAXED);
            if (chunk >= part.end) break;
            *(wp::int32*)arguments = (wp::int32)(chunk * slot.chunk);  // first
            entry((void*)(chunk + 1 < slot.chunks ? slot.whole : slot.last), arguments);
        }
    }
    return true;
}

#endif

}  // namespace job_slots

inline void open_job(wp::array_t<wp::int64> board, wp::int32 slot) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)
    job_slots::Slot& job = job_slots::board_at(board).slots[slot];
    for (long long n = 0; n < job.part_count; ++n) {
        job.parts[n].end = job.chunks * (n + 1) / job.part_count;
        __atomic_store_n(&job.parts[n].next, job.chunks * n / job.part_count, __ATOMIC_RELAXED);
    }
    job.done = 0;
    __atomic_store_n(&job.open, 1, __ATOMIC_SEQ_CST);
#endif
}

inline void close_job(wp::array_t<wp::int64> board, wp::int32 slot) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)
    __atomic_store_n(&job_slots::board_at(board).slots[slot].open, 0, __ATOMIC_SEQ_CST);
#endif
}

inline void drop_chunks(wp::array_t<wp::int64> board, wp::int32 slot) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)
    job_slots::Slot& job = job_slots::board_at(board).slots[slot];
    for (long long n = 0; n < job.part_count; ++n) {
        __atomic_store_n(&job.parts[n].next, job.parts[n].end, __ATOMIC_SEQ_CST);
    }
#endif
}

inline bool sign_in(wp::array_t<wp::int64> board, wp::int32 slot) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)
    job_slots::Slot& job = job_slots::board_at(board).slots[slot];
    const long long most = __atomic_load_n(&job.workers, __ATOMIC_RELAXED);
    if (__atomic_load_n(&job.open, __ATOMIC_RELAXED) &&
        __atomic_load_n(&job.inside, __ATOMIC_RELAXED) < most) {
        const long long before = __atomic_fetch_add(&job.inside, 1, __ATOMIC_SEQ_CST);
        if (__atomic_load_n(&job.open, __ATOMIC_SEQ_CST) && before < job.workers) return true;
        __atomic_fetch_sub(&job.inside, 1, __ATOMIC_SEQ_CST);
    }
#endif
    return false;
}

inline void sign_out(wp::array_t<wp::int64> board, wp::int32 slot) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)
    __atomic_fetch_sub(&job_slots::board_at(board).slots[slot].inside, 1, __ATOMIC_SEQ_CST);
#endif
}

template <int BUSY_LOOKS>
inline void rest(wp::array_t<wp::int64> board, wp::int32 slot, wp::int32 looks) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)
    job_slots::pause(job_slots::board_at(board), looks, BUSY_LOOKS);
#endif
}

template <int LONGEST_LEAD>
inline bool take_chunks_awhile(wp::array_t<wp::int64> board, wp::int32 slot) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)
    job_slots::Board& shared = job_slots::board_at(board);
    return job_slots::run_chunks(shared, shared.slots[slot], 0, job_slots::now(shared) + LONGEST_LEAD);
#else
    return true;
#endif
}

inline bool take_chunks(wp::array_t<wp::int64> board, wp::int32 slot, wp::int32 own) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)
    job_slots::Board& shared = job_slots::board_at(board);
    return job_slots::run_chunks(shared, shared.slots[slot], own, 0);
#else
    return true;
#endif
}

template <int BUSY_LOOKS, int LONGEST_LEAD>
inline bool see_done(wp::array_t<wp::int64> board, wp::int32 slot) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)
    job_slots::Board& shared = job_slots::board_at(board);
    job_slots::Slot& job = shared.slots[slot];
    const long long end = job_slots::now(shared) + LONGEST_LEAD;
    for (int looks = 0; __atomic_load_n(&job.inside, __ATOMIC_SEQ_CST); ++looks) {
        if (looks >= BUSY_LOOKS && job_slots::now(shared) > end) return false;
        job_slots::pause(shared, looks, BUSY_LOOKS);
    }
    job.done = 1;
#endif
    return true;
}

inline bool is_stopped(wp::array_t<wp::int64> board, wp::int32 slot) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)
    return __atomic_load_n(&job_slots::board_at(board).stopped, __ATOMIC_RELAXED) != 0;
#else
    return true;
#endif
}

inline wp::int32 slot_count(wp::array_t<wp::int64> board, wp::int32 slot) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)
    return (wp::int32)__atomic_load_n(&job_slots::board_at(board).slot_count, __ATOMIC_RELAXED);
#else
    return 0;
#endif
}
