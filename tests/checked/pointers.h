// Have the memory accesses of compiled kernels checked: included before all else, see bounds.py.
#pragma once

#define WP_NO_CRT
#include "crt.h"

namespace checked {

// Whether a name ends in `tile.h`: what is asserted of tiles holds on one thread only
constexpr bool is_of_tiles(const char* file) {
    int length = 0;
    while (file[length]) ++length;
    const char* end = "tile.h";
    for (int n = 0; n < 6; ++n)
        if (length < 6 || file[length - 6 + n] != end[n]) return false;
    return true;
}

// A pointer that knows the array that it goes through, and ends the process rather than leave it
template <typename T>
struct Pointer {
    T* at;
    T* begin;
    T* end;
    const char* array;
    const char* function;

    Pointer(T* at, T* begin, T* end, const char* array, const char* function)
        : at(at), begin(begin), end(end), array(array), function(function) {}
    template <int N>
    Pointer(T (&items)[N]) : Pointer(items, items, items + N, "a list", "a function") {}
    template <typename S>
    Pointer(const Pointer<S>& other)  // of items that may be changed: of such as may not
        : Pointer(other.at, other.begin, other.end, other.array, other.function) {}

    T* run(long long offset, long long count) const {
        long long first = at - begin + offset, size = end - begin;
        if (first < 0 || first + count > size) {
            printf("%s: items %lld to %lld of %s, which has %lld\n", function, first, first + count - 1,
                   array, size);
            _wp_assert("the items lie in the array", __FILE__, __LINE__);
        }
        return at + offset;
    }
    T& operator[](long long offset) const { return *run(offset, 1); }
    T& operator*() const { return *run(0, 1); }
    Pointer moved(long long offset) const { return Pointer(at + offset, begin, end, array, function); }
    Pointer& operator+=(long long offset) { return *this = moved(offset); }
    Pointer& operator-=(long long offset) { return *this = moved(-offset); }
    Pointer operator+(long long offset) const { return moved(offset); }
    Pointer operator-(long long offset) const { return moved(-offset); }
    Pointer& operator++() { return *this += 1; }
    Pointer operator++(int) {
        Pointer before = *this;
        ++at;
        return before;
    }
    template <typename S>
    bool operator<(const Pointer<S>& other) const {
        return at < other.at;
    }
};

template <typename T, typename Array>
Pointer<T> items(const Array& array, const char* name, const char* function) {
    long long bytes = sizeof(*array.data);
    for (int d = 0; d < array.ndim; ++d)
        bytes = array.shape[d] ? bytes + (array.shape[d] - 1LL) * array.strides[d] : -(1LL << 40);
    T* begin = (T*)array.data;
    return Pointer<T>(begin, begin, begin + (bytes > 0 ? bytes / (long long)sizeof(T) : 0), name, function);
}

template <typename T, typename Array>
Pointer<T> row(const Array& array, long long row, const char* name, const char* function) {
    if (row < 0 || row >= array.shape[0]) {
        printf("%s: row %lld of %s, which has %d\n", function, row, name, array.shape[0]);
        _wp_assert("the row lies in the array", __FILE__, __LINE__);
    }
    T* begin = (T*)((char*)array.data + row * array.strides[0]);
    long long bytes = sizeof(*array.data);
    for (int d = 1; d < array.ndim; ++d) bytes *= array.shape[d];
    return Pointer<T>(begin, begin, begin + bytes / (long long)sizeof(T), name, function);
}

template <typename T, typename Vector>
Pointer<T> components(Vector& vector, const char* name, const char* function) {
    T* begin = (T*)&vector;
    return Pointer<T>(begin, begin, begin + sizeof(vector) / sizeof(T), name, function);
}

template <typename T>
T* run(const Pointer<T>& pointer, long long count) {
    return pointer.run(0, count);
}

// Reads what the address of a prefetch is made of, which may be anything
template <typename Address>
void prefetch(const Address&) {}

}  // namespace checked

#define __builtin_prefetch(address) checked::prefetch(address)

// Warp's own checks of indices
#undef assert
#define assert(expression)                                                  \
    do {                                                                    \
        if constexpr (!checked::is_of_tiles(__FILE__))                      \
            if (!(expression)) _wp_assert(#expression, __FILE__, __LINE__); \
    } while (0)
