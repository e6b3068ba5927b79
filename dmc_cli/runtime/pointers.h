// Point into arrays; the tests have these pointers checked: see tests/checked/pointers.h.
#pragma once

// ITEMS: the items of an array; ROW: those of one of its rows. POINTER: what they are. RUN: the address of as
// many items, to read at once
#ifdef DMC_CHECKED
#define POINTER(type) checked::Pointer<type>
#define ITEMS(type, array) checked::items<type>(array, #array, __func__)
#define ROW(type, array, number) checked::row<type>(array, number, #array, __func__)
#define RUN(pointer, count) checked::run(pointer, count)
#else  // DMC_CHECKED
#define POINTER(type) type*
#define ITEMS(type, array) ((type*)(array).data)
#define ROW(type, array, number) \
    ((type*)((char*)(array).data + (size_t)(number) * (size_t)(array).strides[0]))
#define RUN(pointer, count) (pointer)
#endif  // DMC_CHECKED
