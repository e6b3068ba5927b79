// Sixteen numbers side by side as vectors of clang's, on CUDA one: what loops over vertices or cells are
// written in.
#pragma once
#include "builtin.h"

namespace lanes {

#if defined(__clang__) && !defined(__CUDA_ARCH__) && !defined(DMC_AS_ON_GPU)
// Comparisons give -1 or 0
enum { LANES = 16 };
typedef float numbers __attribute__((ext_vector_type(16)));
typedef int integers __attribute__((ext_vector_type(16)));
typedef double doubles __attribute__((ext_vector_type(16)));
static numbers root(numbers a) { return __builtin_elementwise_sqrt(a); }
static numbers size(numbers a) { return __builtin_elementwise_abs(a); }
static numbers least(numbers a, numbers b) { return __builtin_elementwise_min(a, b); }
static numbers most(numbers a, numbers b) { return __builtin_elementwise_max(a, b); }
static integers least(integers a, integers b) { return __builtin_elementwise_min(a, b); }
static integers most(integers a, integers b) { return __builtin_elementwise_max(a, b); }
static integers whole(numbers a) { return __builtin_convertvector(__builtin_elementwise_floor(a), integers); }
static numbers number(integers a) { return __builtin_convertvector(a, numbers); }
static bool any(integers a) { return __builtin_reduce_or(a) != 0; }
static numbers load(const float* a) {
    numbers all;
    __builtin_memcpy(&all, a, sizeof(all));
    return all;
}
static integers load(const int* a) {
    integers all;
    __builtin_memcpy(&all, a, sizeof(all));
    return all;
}
static doubles load(const double* a) {
    doubles all;
    __builtin_memcpy(&all, a, sizeof(all));
    return all;
}
static numbers narrowed(numbers a) { return a; }
static numbers narrowed(doubles a) { return __builtin_convertvector(a, numbers); }
static doubles widened(numbers a) { return __builtin_convertvector(a, doubles); }
static doubles widened(doubles a) { return a; }
static integers is_negative(doubles a) { return __builtin_convertvector(a < 0.0, integers); }
static integers chosen(integers is_first, integers a, integers b) { return is_first ? a : b; }
static numbers chosen(integers is_first, numbers a, numbers b) { return is_first ? a : b; }
static doubles chosen(integers is_first, doubles a, doubles b) {
    typedef long long wide_integers __attribute__((ext_vector_type(16)));
    return __builtin_convertvector(is_first, wide_integers) ? a : b;
}
static void store(float* a, numbers all) { __builtin_memcpy(a, &all, sizeof(all)); }
static void store(int* a, integers all) { __builtin_memcpy(a, &all, sizeof(all)); }
#else
enum { LANES = 1 };
typedef float numbers;
typedef int integers;
typedef double doubles;
static CUDA_CALLABLE float root(float a) { return sqrtf(a); }
static CUDA_CALLABLE float size(float a) { return a < 0.0f ? -a : a; }
static CUDA_CALLABLE float least(float a, float b) { return a < b ? a : b; }
static CUDA_CALLABLE float most(float a, float b) { return a > b ? a : b; }
static CUDA_CALLABLE int least(int a, int b) { return a < b ? a : b; }
static CUDA_CALLABLE int most(int a, int b) { return a > b ? a : b; }
static CUDA_CALLABLE int whole(float a) { return (int)floorf(a); }
static CUDA_CALLABLE float number(int a) { return (float)a; }
static CUDA_CALLABLE bool any(int a) { return a != 0; }
static CUDA_CALLABLE float load(const float* a) { return *a; }
static CUDA_CALLABLE int load(const int* a) { return *a; }
static CUDA_CALLABLE double load(const double* a) { return *a; }
static CUDA_CALLABLE float narrowed(float a) { return a; }
static CUDA_CALLABLE float narrowed(double a) { return (float)a; }
static CUDA_CALLABLE double widened(float a) { return a; }
static CUDA_CALLABLE double widened(double a) { return a; }
static CUDA_CALLABLE int is_negative(double a) { return a < 0.0; }
static CUDA_CALLABLE int chosen(int is_first, int a, int b) { return is_first ? a : b; }
static CUDA_CALLABLE float chosen(int is_first, float a, float b) { return is_first ? a : b; }
static CUDA_CALLABLE double chosen(int is_first, double a, double b) { return is_first ? a : b; }
static CUDA_CALLABLE void store(float* a, float all) { *a = all; }
static CUDA_CALLABLE void store(int* a, int all) { *a = all; }
#endif

}  // namespace lanes
