/* Do triangles of a mesh lie on top of each other? Exporters write both sides of a sheet that way. A table of those
 * seen so far tells, by a hash of the three positions that does not hang on their order. */
#include "core/accel/accel.h"

#include <string.h>

/* At most half of the table is full. The longest run in one for 10^7 triangles is then about 80 places; one that is
 * longer than this was made to be: it counts as found, and costs no more time. */
#define MOST_LOOKS 1024u

static uint64_t mix(uint64_t h)
{
    h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
    h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
    return h ^ (h >> 32);
}

static const float *corner(const struct lum_triangles *t, uint32_t triangle, uint32_t k)
{
    return t->positions + 3 * (size_t)t->indices[3 * (size_t)triangle + k];
}

static uint64_t hash(const struct lum_triangles *t, uint32_t triangle)
{
    uint64_t sum = 0;
    for (uint32_t k = 0; k < 3; k++) {
        uint64_t h = 1;
        for (uint32_t axis = 0; axis < 3; axis++) {
            float x = corner(t, triangle, k)[axis] + 0.0f; /* -0 is 0 */
            uint32_t bits;
            memcpy(&bits, &x, sizeof bits);
            h = mix(h + bits);
        }
        sum += h;
    }
    return mix(sum);
}

static bool same_place(const float *p, const float *q)
{
    return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
}

static bool same(const struct lum_triangles *t, uint32_t a, uint32_t b)
{
    static const uint8_t orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    for (uint32_t i = 0; i < LUM_ARRAY_LEN(orders); i++) {
        uint32_t k = 0;
        while (k < 3 && same_place(corner(t, a, k), corner(t, b, orders[i][k])))
            k++;
        if (k == 3)
            return true;
    }
    return false;
}

/* Places hold numbers of triangles from 1 on. True: one like it was there. */
static bool meets(const struct lum_triangles *t, uint32_t triangle, uint32_t *table, size_t size)
{
    size_t place = (size_t)hash(t, triangle) & (size - 1);
    for (uint32_t looks = 0; table[place]; looks++, place = (place + 1) & (size - 1))
        if (looks == MOST_LOOKS || same(t, table[place] - 1, triangle))
            return true;
    table[place] = triangle + 1;
    return false;
}

enum lum_status lum_triangles_coincide(const struct lum_triangles *triangles, const _Atomic bool *stop, bool *ret_any,
                                       struct lum_error *err)
{
    size_t size = 2;
    while (size < 2 * (size_t)triangles->n_triangles)
        size *= 2;
    uint32_t *table = lum_calloc(size, sizeof *table);
    if (!table)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a mesh of %u triangles", triangles->n_triangles);
    bool any = false, stopped = false;
    for (uint32_t i = 0; i < triangles->n_triangles && !any && !stopped; i++) {
        any = meets(triangles, i, table, size);
        stopped = stop && atomic_load_explicit(stop, memory_order_relaxed);
    }
    lum_free(table);
    if (stopped)
        return lum_fail(err, LUM_ERR_CANCELLED, "", "the search of a mesh was stopped");
    *ret_any = any;
    return LUM_OK;
}
