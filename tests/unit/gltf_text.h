/* glTF files of a few lines, and what is read from them. */
#ifndef LUM_TESTS_UNIT_GLTF_TEXT_H
#define LUM_TESTS_UNIT_GLTF_TEXT_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/unit/import_kit.h"

/* Sums of single-precision values that are exact in binary are compared exactly; what went through sines, within this
 * many units of the last place of a float near 1. */
#define CLOSE 4e-7

#define ASSET "{\"asset\":{\"version\":\"2.0\"},"

static inline int gltf_setup(void **state)
{
    static struct kit kit;
    kit_open(&kit);
    *state = &kit;
    return 0;
}

static inline int gltf_teardown(void **state)
{
    kit_close(*state);
    return 0;
}

static const float triangle[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};

/* A file with one triangle in b.bin; extra goes before it at the top level. */
#define TRIANGLE(extra)                                                                                                \
    ASSET extra "\"buffers\":[{\"uri\":\"b.bin\",\"byteLength\":36}],"                                                 \
                "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"                                                  \
                "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}],"

#define SCENE0 "\"scenes\":[{\"nodes\":[0]}],"
#define MESH0 "\"meshes\":[{\"name\":\"tri\",\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"

static inline void assert_near_all(const double *got, const double *want, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!(fabs(got[i] - want[i]) <= CLOSE * fmax(1.0, fabs(want[i]))))
            fail_msg("value %zu is %.9g, not %.9g", i, got[i], want[i]);
}

static inline void assert_floats(const struct lum_floats *got, const float *want, size_t n)
{
    assert_int_equal(got->n, n);
    assert_non_null(got->f32);
    for (size_t i = 0; i < n; i++)
        if (got->f32[i] != want[i])
            fail_msg("value %zu is %.9g, not %.9g", i, (double)got->f32[i], (double)want[i]);
}

static inline void assert_indices(const struct lum_indices *got, const uint32_t *want, size_t n)
{
    assert_int_equal(got->n, n);
    assert_memory_equal(got->u32, want, n * sizeof *want);
}

#endif
