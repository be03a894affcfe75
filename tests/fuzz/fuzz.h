/* What a fuzz target defines; libFuzzer calls it, or seeds.c does, once for each seed. */
#ifndef LUM_TESTS_FUZZ_FUZZ_H
#define LUM_TESTS_FUZZ_FUZZ_H

#include <stddef.h>
#include <stdint.h>

/* -1 keeps the input out of the corpus. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

#endif
