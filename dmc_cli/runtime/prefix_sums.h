// Sum counts, given by their addresses: see prefix_sums.py.
#pragma once
#include "builtin.h"

inline wp::int64 chunk_sum(wp::uint64 counts, wp::int64 begin, wp::int64 end) {
    const long long* count = (const long long*)counts;
    long long sum = 0;
    for (long long n = begin; n < end; ++n) sum += count[n];
    return sum;
}

inline void store_sums(wp::uint64 counts, wp::int64 length, wp::int64 begin, wp::int64 end, wp::int64 before,
                       wp::uint64 sums_out) {
    const long long* count = (const long long*)counts;
    long long* sum = (long long*)sums_out;
    for (long long n = begin; n < end; ++n) {
        sum[n] = before;
        before += count[n];
    }
    if (end == length) sum[length] = before;
}
