// Point into arrays; the tests have these pointers checked: see tests/checked/pointers.h.
#pragma once

// ITEMS: the items of an array; ROW: those of one of its rows. POINTER: what they are. RUN: the address of as
// many items, to read or write at once. COMPONENTS: those of a vector of Warp's, one after the other
#ifdef DMC_CHECKED
#define POINTER(type) checked::Pointer<type>
#define ITEMS(type, array) checked::items<type>(array, #array, __func__)
#define ROW(type, array, number) checked::row<type>(array, number, #array, __func__)
#define RUN(pointer, count) checked::run(pointer, count)
#define COMPONENTS(type, vector) checked::components<type>(vector, #vector, __func__)
#else  // DMC_CHECKED
#define POINTER(type) type*
#define ITEMS(type, array) ((type*)(array).data)
#define ROW(type, array, number) \
    ((type*)((char*)(array).data + (size_t)(number) * (size_t)(array).strides[0]))
#define RUN(pointer, count) (pointer)
#define COMPONENTS(type, vector) ((type*)&(vector))
#endif  // DMC_CHECKED
