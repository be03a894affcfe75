/* Loops over LUM_SUM_LANES values without a branch, which become vector code. */
#include "core/cache/vpl_sum.h"

#include <string.h>

#include "core/math/color.h"
#include "core/math/sampler.h"
#include "core/medium/medium.h"

#define LANES LUM_SUM_LANES

uint64_t lum_vpl_faces(const struct lum_vpl_set *set, const struct lum_receiver *at, uint32_t word)
{
    const struct lum_vec3 n = at->n, g = at->ng;
    uint64_t all = 0;
    for (uint32_t k = 64 * word; k < set->n && k < 64 * (word + 1); k += LANES) { /* padding faces nothing */
        const struct lum_vec3 p = lum_vpl_seen_from(set, k, at->p);
        uint32_t faces[LANES], bits = 0;
        for (uint32_t i = 0; i < LANES; i++) {
            float dx = set->px[k + i] - p.x, dy = set->py[k + i] - p.y, dz = set->pz[k + i] - p.z;
            float to = dx * n.x + dy * n.y + dz * n.z, side = dx * g.x + dy * g.y + dz * g.z;
            float from = -(dx * set->nx[k + i] + dy * set->ny[k + i] + dz * set->nz[k + i]);
            faces[i] = (uint32_t)(to > 0.0f) & (uint32_t)(side > 0.0f) & (uint32_t)(from > 0.0f);
        }
        for (uint32_t i = 0; i < LANES; i++)
            bits |= faces[i] << i;
        all |= (uint64_t)bits << k % 64;
    }
    return all;
}

/* Geometry terms of LANES VPLs and their gradients; 0 where the bit is not set. */
struct terms {
    _Alignas(64) float g[LANES], x[LANES], y[LANES], z[LANES];
};

/* With d = v - p from the point to the VPL, h = -d.n_vpl, u = m^2 / (h^2 + m^2) and b^2 = h^2 + m^2 u: the lifted term
 * is G = a b / (d^2 + m^2 u)^2, where a = d.n - (b - h) min(n.n_vpl, 0). dG/dp follows from dd/dp = -1, dh/dp = n_vpl,
 * db/dh = h (1 - u^2) / b and d(m^2 u)/dh = -2 h u^2. Of the sky dd/dp = 0,
 * and m = 1, which is nothing to its distance. */
static void lifted_terms(const struct lum_vpl_set *set, uint32_t k, const struct lum_receiver *at, uint32_t bits,
                         float lift, struct terms *restrict ret)
{
    const struct lum_vec3 p = lum_vpl_seen_from(set, k, at->p), n = at->n;
    const float *restrict px = set->px + k, *restrict py = set->py + k, *restrict pz = set->pz + k;
    const float *restrict nx = set->nx + k, *restrict ny = set->ny + k, *restrict nz = set->nz + k;
    const float *restrict radius = set->radius + k;
    const bool sky = k >= lum_vpl_first_sky(set);
    const float moves = sky ? 0.0f : 1.0f, per_radius = sky ? 0.0f : lift, least = sky ? 1.0f : LUM_POINT_LIGHT_NEAR;
    float asked[LANES];
    for (uint32_t i = 0; i < LANES; i++)
        asked[i] = (float)(bits >> i & 1u);
    for (uint32_t i = 0; i < LANES; i++) {
        float wide = per_radius * radius[i], m = wide > least ? wide : least, lift2 = m * m;
        float vx = nx[i], vy = ny[i], vz = nz[i];
        float dx = px[i] - p.x, dy = py[i] - p.y, dz = pz[i] - p.z;
        float h = -(dx * vx + dy * vy + dz * vz), u = lift2 / (h * h + lift2), rise = lift2 * u;
        float b = sqrtf(h * h + rise), slope = h * (1.0f - u * u) / b;
        float faces = n.x * vx + n.y * vy + n.z * vz, opposed = faces < 0.0f ? faces : 0.0f;
        float a = dx * n.x + dy * n.y + dz * n.z - (b - h) * opposed;
        float per_r2 = 1.0f / (dx * dx + dy * dy + dz * dz + rise), per_r4 = per_r2 * per_r2;
        per_r4 = a > 0.0f ? per_r4 * asked[i] : 0.0f;
        float term = a * b * per_r4, spread = 4.0f * term * per_r2 * moves;
        float along = (a * slope + b * (1.0f - slope) * opposed) * per_r4 * moves + spread * h * u * u;
        float across = b * per_r4 * moves;
        ret->g[i] = term;
        ret->x[i] = along * vx - across * n.x + spread * dx;
        ret->y[i] = along * vy - across * n.y + spread * dy;
        ret->z[i] = along * vz - across * n.z + spread * dz;
    }
}

/* ---- drawing ---- */

/* What VPLs that the point faces would bring it, of bounced light. */
static uint32_t find_reach(const struct lum_vpl_set *set, const struct lum_receiver *at, float lift,
                           const uint64_t *faces, float *ret_reach)
{
    uint32_t n = 0;
    for (uint32_t k = 0; k < set->n_bounced; k += LANES) {
        uint32_t bits = (uint32_t)(faces[k / 64] >> k % 64) & ((1u << LANES) - 1u);
        struct terms terms;
        memset(ret_reach + k, 0, LANES * sizeof *ret_reach);
        if (!bits)
            continue;
        lifted_terms(set, k, at, bits, lift, &terms);
        for (uint32_t i = 0; i < LANES; i++)
            ret_reach[k + i] = terms.g[i] * set->importance[k + i];
        n += (uint32_t)__builtin_popcount(bits);
    }
    return n;
}

/* The step with which at least n are drawn on average, less than 1.5 n: n = sum of min(1, reach / step). Each round
 * takes those out that are above it; it only falls, so that a few rounds come near. A power of the root of 2, so that
 * what moves elsewhere rarely changes it. */
static float find_step(const float *reach, uint32_t n_slots, uint32_t n)
{
    float step = INFINITY;
    for (uint32_t round = 0; round < 4; round++) {
        double rest = 0.0;
        uint32_t n_sure = 0;
        for (uint32_t k = 0; k < n_slots; k++) {
            n_sure += reach[k] >= step;
            rest += reach[k] >= step ? 0.0 : (double)reach[k];
        }
        if (n_sure >= n || !(rest > 0.0))
            break;
        step = (float)(rest / (n - n_sure));
    }
    return isfinite(step) ? exp2f(0.5f * floorf(2.0f * log2f(step))) : 0.0f;
}

/* Side of the cells whose points draw by the same numbers: coordinates of a scene are at most 2^7. */
#define DRAW_CELL 2.0f

static uint32_t hash_cell(struct lum_vec3 p)
{
    uint32_t x = (uint32_t)(int32_t)floorf(p.x / DRAW_CELL), y = (uint32_t)(int32_t)floorf(p.y / DRAW_CELL);
    uint32_t z = (uint32_t)(int32_t)floorf(p.z / DRAW_CELL);
    return lum_hash_combine(lum_hash_combine(lum_hash_u32(x), y), z);
}

float lum_vpl_draw(const struct lum_vpl_set *set, const struct lum_receiver *at, float lift, uint32_t n,
                   uint64_t *ret_bits)
{
    float reach[LUM_VPL_MAX]; /* 256 KiB of a worker's stack, touched as far as the set goes */
    for (uint32_t w = 0; w < lum_vpl_words(set->n); w++)
        ret_bits[w] = lum_vpl_faces(set, at, w);
    if (find_reach(set, at, lift, ret_bits, reach) <= n)
        return 0.0f;
    float step = find_step(reach, set->n_bounced, n);
    uint32_t cell = hash_cell(at->p);
    for (uint32_t k = 0; k < set->n_bounced; k++) {
        float u = (float)(lum_hash_combine(cell, k) >> 8) * 0x1p-24f;
        if (!(reach[k] > u * step))
            ret_bits[k / 64] &= ~(UINT64_C(1) << k % 64);
    }
    return step;
}

/* ---- sums ---- */

/* Those that were drawn stand for those that were not. */
static void weigh(const struct lum_vpl_set *set, uint32_t k, float step, struct terms *inout_terms)
{
    for (uint32_t i = 0; i < LANES; i++) {
        float reach = inout_terms->g[i] * set->importance[k + i];
        float weight = reach > 0.0f && reach < step ? step / reach : 1.0f;
        inout_terms->g[i] *= weight;
        inout_terms->x[i] *= weight;
        inout_terms->y[i] *= weight;
        inout_terms->z[i] *= weight;
    }
}

/* Lanes of irradiance and gradient, by colour. */
struct lanes {
    _Alignas(64) float e[3][LANES], x[3][LANES], y[3][LANES], z[3][LANES];
};

static void add_terms(struct lanes *sum, const struct terms *t, float *const flux[3], uint32_t k)
{
    for (uint32_t c = 0; c < 3; c++) {
        const float *f = flux[c] + k;
        for (uint32_t i = 0; i < LANES; i++) {
            sum->e[c][i] += f[i] * t->g[i];
            sum->x[c][i] += f[i] * t->x[i];
            sum->y[c][i] += f[i] * t->y[i];
            sum->z[c][i] += f[i] * t->z[i];
        }
    }
}

/* What panes leave of the flux of LANES VPLs. */
static void dim_by_panes(const uint32_t *left, float inout_flux[3][LANES])
{
    for (uint32_t i = 0; i < LANES; i++) {
        struct lum_rgb share = lum_share_unpack(left[i]);
        inout_flux[0][i] *= share.r;
        inout_flux[1][i] *= share.g;
        inout_flux[2][i] *= share.b;
    }
}

/* What media leave of it. */
static void dim_by_media(const struct lum_vpl_set *set, uint32_t k, const struct lum_receiver *at, uint32_t bits,
                         const struct lum_snapshot *media, float inout_flux[3][LANES])
{
    for (uint32_t i = 0; i < LANES; i++) {
        struct lum_vec3 p = {set->px[k + i], set->py[k + i], set->pz[k + i]};
        struct lum_vec3 d = lum_v3_sub(p, lum_vpl_seen_from(set, k, at->p));
        struct lum_rgb left = lum_grey(0.0f);
        if (bits >> i & 1u)
            left = lum_media_transmittance(media, at->p, lum_normalize(d),
                                           k < lum_vpl_first_sky(set) ? lum_length(d) : INFINITY);
        inout_flux[0][i] *= left.r;
        inout_flux[1][i] *= left.g;
        inout_flux[2][i] *= left.b;
    }
}

static bool any_pane(const uint32_t *left)
{
    uint32_t any = 0;
    for (uint32_t i = 0; left && i < LANES; i++)
        any |= left[i];
    return any != 0;
}

static void add_lanes(double sum[4][3], const struct lanes *lanes)
{
    for (uint32_t c = 0; c < 3; c++)
        for (uint32_t i = 0; i < LANES; i++) {
            sum[0][c] += (double)lanes->e[c][i];
            sum[1][c] += (double)lanes->x[c][i];
            sum[2][c] += (double)lanes->y[c][i];
            sum[3][c] += (double)lanes->z[c][i];
        }
}

void lum_vpl_sum_visible(const struct lum_vpl_set *set, const struct lum_receiver *at, const uint64_t *visible,
                         const uint32_t *left, float lift, float step, const struct lum_snapshot *media,
                         struct lum_vpl_sum *ret_sum)
{
    double sum[4][3] = {{0}};
    for (uint32_t block = 0; block < set->n; block += LUM_SUM_BLOCK) {
        struct lanes lanes = {0};
        for (uint32_t k = block; k < set->n && k < block + LUM_SUM_BLOCK; k += LANES) {
            uint32_t bits = (uint32_t)(visible[k / 64] >> k % 64) & ((1u << LANES) - 1u);
            if (!bits)
                continue;
            struct terms terms;
            float dimmed[3][LANES];
            lifted_terms(set, k, at, bits, lift, &terms);
            if (step > 0.0f && k < set->n_bounced)
                weigh(set, k, step, &terms);
            bool panes = left && any_pane(left + k);
            if (!media && !panes) {
                add_terms(&lanes, &terms, set->flux, k);
                continue;
            }
            for (uint32_t c = 0; c < 3; c++)
                memcpy(dimmed[c], set->flux[c] + k, sizeof dimmed[c]);
            if (media)
                dim_by_media(set, k, at, bits, media, dimmed);
            if (panes)
                dim_by_panes(left + k, dimmed);
            add_terms(&lanes, &terms, (float *const[3]){dimmed[0], dimmed[1], dimmed[2]}, 0);
        }
        add_lanes(sum, &lanes);
    }
    struct lum_rgb values[4];
    for (uint32_t q = 0; q < 4; q++)
        values[q] = lum_rgb_scale(lum_rgb((float)sum[q][0], (float)sum[q][1], (float)sum[q][2]), LUM_INV_PI);
    ret_sum->irradiance = values[0];
    memcpy(ret_sum->gradient, values + 1, sizeof ret_sum->gradient);
}
