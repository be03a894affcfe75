#include "core/light/portals.h"

#include <math.h>
#include <stdlib.h>

/* Faces are 2 axis + (1: the upper one); along a face go the next two axes. */

static uint32_t index_in(float x, float lo, float hi, uint32_t side)
{
    float at = (x - lo) / (hi - lo) * (float)side;
    return at > 0.0f ? (at < (float)side ? (uint32_t)at : side - 1u) : 0u;
}

static uint32_t cells_along(float edge, float longest, uint32_t side)
{
    float n = ceilf(edge / longest * (float)side - 0.5f);
    return n > 1.0f ? (n < (float)side ? (uint32_t)n : side) : 1u;
}

void lum_portals_cut(struct lum_portals *o, struct lum_vec3 lo, struct lum_vec3 hi, uint32_t side)
{
    struct lum_vec3 size = lum_v3_sub(hi, lo);
    float longest = lum_v3_largest(size);
    *o = (struct lum_portals){.lo = lo, .hi = hi, .side = side};
    for (uint32_t k = 0; k < 3; k++)
        o->along[k] = cells_along(lum_v3_part(size, k), longest, side);
}

/* Of a cell, along an axis. */
static float edge_of_cell(const struct lum_portals *o, uint32_t axis)
{
    return (lum_v3_part(o->hi, axis) - lum_v3_part(o->lo, axis)) / (float)o->along[axis];
}

float lum_portals_cell_area(const struct lum_portals *o, uint32_t axis)
{
    return edge_of_cell(o, (axis + 1u) % 3u) * edge_of_cell(o, (axis + 2u) % 3u);
}

/* The cell of a face that point x, on it, is in. */
static uint32_t cell_at(const struct lum_portals *o, uint32_t axis, bool upper, struct lum_vec3 x)
{
    uint32_t a = (axis + 1u) % 3u, b = (axis + 2u) % 3u;
    uint32_t i = index_in(lum_v3_part(x, a), lum_v3_part(o->lo, a), lum_v3_part(o->hi, a), o->along[a]);
    uint32_t j = index_in(lum_v3_part(x, b), lum_v3_part(o->lo, b), lum_v3_part(o->hi, b), o->along[b]);
    return (2u * axis + upper) * lum_portals_per_face(o) + j * o->side + i;
}

bool lum_portals_beside(const struct lum_portals *o, uint32_t cell, int dx, int dy, uint32_t *ret_beside)
{
    uint32_t face = cell / lum_portals_per_face(o), axis = face / 2u, at = cell % lum_portals_per_face(o);
    int i = (int)(at % o->side) + dx, j = (int)(at / o->side) + dy;
    if (i < 0 || j < 0 || i >= (int)o->along[(axis + 1u) % 3u] || j >= (int)o->along[(axis + 2u) % 3u])
        return false;
    *ret_beside = face * lum_portals_per_face(o) + (uint32_t)j * o->side + (uint32_t)i;
    return true;
}

static struct lum_portal_hit hit_at(const struct lum_portals *o, uint32_t axis, bool upper, float t, struct lum_vec3 p,
                                    struct lum_vec3 d)
{
    return (struct lum_portal_hit){.distance = t * lum_length(d),
                                   .cosine = fabsf(lum_v3_part(d, axis)) / lum_length(d),
                                   .area = lum_portals_cell_area(o, axis),
                                   .cell = cell_at(o, axis, upper, lum_v3_mad(p, d, t))};
}

bool lum_portals_leave(const struct lum_portals *o, struct lum_vec3 p, struct lum_vec3 d, struct lum_portal_hit *ret)
{
    float least = INFINITY;
    uint32_t through = 0;
    for (uint32_t k = 0; k < 3; k++) {
        float x = lum_v3_part(p, k), dk = lum_v3_part(d, k), lo = lum_v3_part(o->lo, k), hi = lum_v3_part(o->hi, k);
        if (!(x >= lo && x <= hi))
            return false;
        float t = dk > 0.0f ? (hi - x) / dk : dk < 0.0f ? (lo - x) / dk : INFINITY;
        if (t < least) {
            least = t;
            through = k;
        }
    }
    if (!isfinite(least))
        return false;
    *ret = hit_at(o, through, lum_v3_part(d, through) > 0.0f, least, p, d);
    return true;
}

bool lum_portals_enter(const struct lum_portals *o, struct lum_vec3 p, struct lum_vec3 d, struct lum_portal_hit *ret)
{
    float near = -INFINITY, far = INFINITY;
    uint32_t through = 0;
    for (uint32_t k = 0; k < 3; k++) {
        float x = lum_v3_part(p, k), dk = lum_v3_part(d, k), lo = lum_v3_part(o->lo, k), hi = lum_v3_part(o->hi, k);
        if (dk == 0.0f) {
            if (!(x >= lo && x <= hi))
                return false;
            continue;
        }
        float t_in = ((dk > 0.0f ? lo : hi) - x) / dk, t_out = ((dk > 0.0f ? hi : lo) - x) / dk;
        if (t_in > near) {
            near = t_in;
            through = k;
        }
        far = lum_min(far, t_out);
    }
    if (!(near <= far) || !isfinite(near))
        return false;
    *ret = hit_at(o, through, lum_v3_part(d, through) < 0.0f, near, p, d);
    return true;
}

bool lum_portals_inside(const struct lum_portals *o, struct lum_vec3 p)
{
    return p.x >= o->lo.x && p.x <= o->hi.x && p.y >= o->lo.y && p.y <= o->hi.y && p.z >= o->lo.z && p.z <= o->hi.z;
}

/* Beside what a surface faces, the share of what lies behind it that counts: interpolated normals lean. */
#define BEHIND 0.02f

/* Of the cells of a face that p lies `before` of, and adds them up. cos cos / d^2 is finite as d^2 counts for no less
 * than a cell's area. */
static float see_face(const struct lum_portals *o, uint32_t face, float before, struct lum_vec3 p, struct lum_vec3 n,
                      float *restrict part)
{
    const float *restrict x = o->centre[0], *restrict y = o->centre[1], *restrict z = o->centre[2];
    const float area = lum_portals_cell_area(o, face / 2u);
    float all = 0.0f;
    for (uint32_t k = o->first[face]; k < o->first[face + 1]; k++) {
        float dx = x[k] - p.x, dy = y[k] - p.y, dz = z[k] - p.z, d2 = dx * dx + dy * dy + dz * dz;
        float to = dx * n.x + dy * n.y + dz * n.z, least = BEHIND * sqrtf(d2);
        part[k] = (to > least ? to : least) * before * area / ((d2 + area) * (d2 + area));
        all += part[k];
    }
    return all;
}

void lum_portals_see(const struct lum_portals *o, struct lum_vec3 p, struct lum_vec3 n, struct lum_portals_seen *ret)
{
    ret->all = 0.0f;
    for (uint32_t face = 0; face < 6; face++) {
        uint32_t axis = face / 2u;
        float before = face % 2u ? lum_v3_part(p, axis) - lum_v3_part(o->hi, axis)
                                 : lum_v3_part(o->lo, axis) - lum_v3_part(p, axis);
        if (before > 0.0f)
            ret->all += see_face(o, face, before, p, n, ret->part);
        else
            for (uint32_t k = o->first[face]; k < o->first[face + 1]; k++)
                ret->part[k] = 0.0f;
    }
}

bool lum_portals_aim(const struct lum_portals *o, const struct lum_portals_seen *seen, struct lum_vec3 p,
                     struct lum_vec2 u, struct lum_vec3 *ret_d, struct lum_portal_hit *ret_hit)
{
    float left = u.x * seen->all;
    uint32_t k = 0, last = 0;
    if (!(seen->all > 0.0f))
        return false;
    for (; k < o->n && (last = seen->part[k] > 0.0f ? k : last, left >= seen->part[k]); k++)
        left -= seen->part[k];
    if (k == o->n) /* by rounding */
        left = 0.5f * seen->part[k = last];
    uint32_t cell = o->cell[k];
    struct lum_vec2 v = {lum_clamp(left / seen->part[k], 0.0f, 1.0f), u.y};
    struct lum_vec3 inward, d = lum_v3_sub(lum_portals_point(o, cell, v, &inward), p);
    float distance = lum_length(d), cosine = lum_dot(d, inward) / distance;
    *ret_d = lum_v3_mul(d, 1.0f / distance);
    *ret_hit =
        (struct lum_portal_hit){distance, cosine, lum_portals_cell_area(o, cell / lum_portals_per_face(o) / 2u), cell};
    return cosine > 0.0f;
}

float lum_portals_chance(const struct lum_portals *o, const struct lum_portals_seen *seen, uint32_t cell)
{
    uint32_t lo = 0, hi = o->n;
    while (lo < hi) {
        uint32_t mid = (lo + hi) / 2u;
        if (o->cell[mid] < cell)
            lo = mid + 1u;
        else
            hi = mid;
    }
    return lo < o->n && o->cell[lo] == cell && seen->all > 0.0f ? seen->part[lo] / seen->all : 0.0f;
}

float lum_portals_aim_pdf(const struct lum_portals *o, const struct lum_portals_seen *seen, struct lum_vec3 p,
                          struct lum_vec3 d)
{
    struct lum_portal_hit hit;
    if (!lum_portals_enter(o, p, d, &hit) || !(hit.distance > 0.0f) || !lum_portals_is_open(o, hit.cell))
        return 0.0f;
    return lum_portals_chance(o, seen, hit.cell) * hit.distance * hit.distance / (hit.cosine * hit.area);
}

struct lum_vec3 lum_portals_normal(uint32_t face)
{
    float way = face % 2u ? -1.0f : 1.0f;
    uint32_t axis = face / 2u;
    return lum_v3(axis == 0 ? way : 0.0f, axis == 1 ? way : 0.0f, axis == 2 ? way : 0.0f);
}

bool lum_portals_open(struct lum_portals *o, uint32_t cell)
{
    if (lum_portals_is_open(o, cell))
        return true;
    if (o->n == LUM_PORTALS_MAX)
        return false;
    o->cell[o->n++] = cell;
    o->open[cell / 64u] |= UINT64_C(1) << cell % 64u;
    return true;
}

static int by_number(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

void lum_portals_sort(struct lum_portals *o)
{
    qsort(o->cell, o->n, sizeof *o->cell, by_number);
    for (uint32_t face = 0, k = 0; face <= 6; face++) {
        while (k < o->n && o->cell[k] < face * lum_portals_per_face(o))
            k++;
        o->first[face] = face < 6 ? k : o->n;
    }
    for (uint32_t k = 0; k < o->n; k++) {
        struct lum_vec3 n, p = lum_portals_point(o, o->cell[k], (struct lum_vec2){0.5f, 0.5f}, &n);
        o->centre[0][k] = p.x, o->centre[1][k] = p.y, o->centre[2][k] = p.z;
    }
}

struct lum_vec3 lum_portals_point(const struct lum_portals *o, uint32_t cell, struct lum_vec2 u, struct lum_vec3 *ret_n)
{
    uint32_t face = cell / lum_portals_per_face(o), axis = face / 2u, at = cell % lum_portals_per_face(o);
    uint32_t a = (axis + 1u) % 3u, b = (axis + 2u) % 3u;
    float x[3];
    x[axis] = lum_v3_part(face % 2u ? o->hi : o->lo, axis);
    x[a] = lum_v3_part(o->lo, a) + ((float)(at % o->side) + u.x) * edge_of_cell(o, a);
    x[b] = lum_v3_part(o->lo, b) + ((float)(at / o->side) + u.y) * edge_of_cell(o, b);
    *ret_n = lum_portals_normal(face);
    return lum_v3(x[0], x[1], x[2]);
}
