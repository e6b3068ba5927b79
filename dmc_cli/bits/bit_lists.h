// List the set bits of a block of words, without a loop for each word.
//
// A word has few bits, and how many is as good as random: the end of a loop over them is guessed wrongly
// nearly each time, which costs as much as what is done for a bit or two. So all bits of a block are listed
// first, by one instruction a word where the processor has it (AVX-512 VBMI2) or by two, and done in one
// loop. On a GPU there is no list.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

namespace bit_lists {

typedef POINTER(unsigned short) codes_t;

// Write tag + b for each set bit b of a word to a list, which has room for 32; return the end of the list
static CUDA_CALLABLE codes_t list_bits(unsigned int word, int tag, codes_t to) {
#if defined(__AVX512VBMI2__) && defined(__AVX512BW__)
    typedef short Codes __attribute__((vector_size(64)));
    Codes codes = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13, 14, 15,
                   16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31};
    codes += (short)tag;
    codes = __builtin_ia32_compresshi512_mask(codes, codes, word);
    __builtin_memcpy(RUN(to, 32), &codes, sizeof(codes));
    to += wp::bit_count(word);
#elif defined(__AVX512F__) && defined(__clang__) && !defined(__CUDA_ARCH__)
    typedef int Codes __attribute__((vector_size(64)));
    typedef short Stored __attribute__((vector_size(32)));
    Codes codes = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    codes += tag;
    for (int half = 0; half < 2; ++half, codes += 16, word >>= 16) {
        unsigned short bits = (unsigned short)word;
        Stored stored =
            __builtin_convertvector(__builtin_ia32_compresssi512_mask(codes, codes, bits), Stored);
        __builtin_memcpy(RUN(to, 16), &stored, sizeof(stored));
        to += wp::bit_count(bits);
    }
#else
    for (; word; word &= word - 1) *to++ = (unsigned short)(tag + wp::bit_count(~word & (word - 1)));
#endif
    return to;
}

}  // namespace bit_lists
