#include "core/effect/indirect/tile_points.h"

#include <string.h>

void lum_tile_points_load(struct lum_tile_points *ret_points, const struct lum_pass *pass, uint32_t tile,
                          const struct lum_pixel_mask *mask)
{
    struct lum_tile_points *s = ret_points;
    const struct lum_surfaces *surfaces = pass->surfaces;
    float side = lum_tile_is_far(pass, tile) ? -1.0f : 1.0f;
    s->n = 0;
    for (uint32_t k = 0; k < 32; k++) { /* rows of 8, by blocks of 8 x 8: what is summed together lies together */
        uint32_t x = k / 8 % 2 * 8, y = k / 16 * 8 + k % 8, first = y * LUM_TILE_SIDE + x;
        for (uint32_t bits = (uint32_t)(mask->bits[first / 64] >> first % 64) & 0xffu; bits; bits &= bits - 1) {
            uint32_t slot = first + (uint32_t)__builtin_ctz(bits), i = s->n++;
            size_t pixel = lum_tile_pixel(pass, tile, slot);
            struct lum_vec3 p = surfaces->p[pixel], n = lum_v3_mul(surfaces->n[pixel], side);
            s->px[i] = p.x, s->py[i] = p.y, s->pz[i] = p.z;
            s->nx[i] = n.x, s->ny[i] = n.y, s->nz[i] = n.z;
            s->slot[i] = (uint8_t)slot;
        }
    }
    for (uint32_t i = s->n; i % 16 != 0; i++)
        s->px[i] = s->py[i] = s->pz[i] = s->nx[i] = s->ny[i] = s->nz[i] = 0.0f;
}

/* WARD lets pass sqrt(1 - n.n') < a, HATS |n - n'| = sqrt(2 (1 - n.n')) < its width; less what normals may be off their
 * unit length. */
static float least_dot(enum lum_metric metric, const struct lum_weighting *w)
{
    float most_turn = metric == LUM_METRIC_WARD ? w->accuracy * w->accuracy : 0.5f / (w->per_chord * w->per_chord);
    return 1.0f - most_turn - 1e-3f; /* far more than they are: some that serve nobody are looked at */
}

struct lum_lookup lum_lookup_of(const struct lum_cache *cache, const struct lum_pass *pass, uint32_t worker)
{
    enum lum_metric metric = cache->key.kind->metric;
    struct lum_weighting w = lum_weighting_of(cache->key.accuracy);
    return (struct lum_lookup){.cache = cache,
                               .store = cache->store,
                               .worker = worker,
                               .metric = metric,
                               .weighting = w,
                               .least_dot = least_dot(metric, &w),
                               .pixel = pass->footprint,
                               .eye = pass->eye.o};
}

struct lum_tile_points_box lum_tile_points_box_of(const struct lum_tile_points *s, uint32_t from, uint32_t n)
{
    const struct lum_vec3 up = {INFINITY, INFINITY, INFINITY}, down = {-INFINITY, -INFINITY, -INFINITY};
    struct lum_tile_points_box b = {up, down, up, down};
    for (uint32_t i = from; i < from + n; i++) {
        struct lum_vec3 p = {s->px[i], s->py[i], s->pz[i]}, normal = {s->nx[i], s->ny[i], s->nz[i]};
        b.lo = lum_v3_min(b.lo, p);
        b.hi = lum_v3_max(b.hi, p);
        b.n_lo = lum_v3_min(b.n_lo, normal);
        b.n_hi = lum_v3_max(b.n_hi, normal);
    }
    return b;
}

/* False when a record turns away from all normals of the box by more than any metric lets pass. */
static bool may_face(const struct lum_lookup *l, const struct lum_tile_points_box *b, struct lum_vec3 n)
{
    float dot = lum_max(n.x * b->n_lo.x, n.x * b->n_hi.x) + lum_max(n.y * b->n_lo.y, n.y * b->n_hi.y) +
                lum_max(n.z * b->n_lo.z, n.z * b->n_hi.z);
    return dot > l->least_dot;
}

/* By where they lie, and not by index: that may depend on which worker removed what. */
static bool comes_before(const struct lum_cache_record *a, const struct lum_cache_record *b)
{
    int order = memcmp(&a->p, &b->p, sizeof a->p);
    if (order == 0)
        order = memcmp(&a->n, &b->n, sizeof a->n);
    return order != 0 ? order < 0 : a->index < b->index;
}

/* Shell sort (gaps of Ciura 2001): a few dozen as a rule. */
void lum_tile_points_sort(struct lum_candidates *c)
{
    static const uint32_t gaps[] = {301, 132, 57, 23, 10, 4, 1};
    for (size_t g = 0; g < LUM_ARRAY_LEN(gaps); g++)
        for (uint32_t i = gaps[g]; i < c->n; i++) {
            struct lum_cache_record *r = c->records[i];
            uint32_t k = i;
            for (; k >= gaps[g] && comes_before(r, c->records[k - gaps[g]]); k -= gaps[g])
                c->records[k] = c->records[k - gaps[g]];
            c->records[k] = r;
        }
}

/* False when all points of the box are out of a record's reach: never, where rounding might decide, of which a part in
 * a thousand is far more. */
static bool may_reach(const struct lum_tile_points_box *b, const struct lum_cache_record *r)
{
    float x = lum_max(lum_max(b->lo.x - r->p.x, r->p.x - b->hi.x), 0.0f);
    float y = lum_max(lum_max(b->lo.y - r->p.y, r->p.y - b->hi.y), 0.0f);
    float z = lum_max(lum_max(b->lo.z - r->p.z, r->p.z - b->hi.z), 0.0f);
    return x * x + y * y + z * z <= 1.001f * r->radius * r->radius;
}

bool lum_tile_points_box_may_meet(const struct lum_lookup *l, const struct lum_tile_points_box *box,
                                  const struct lum_cache_record *r)
{
    return may_reach(box, r) && may_face(l, box, r->n) && lum_record_is_fine(l, r);
}

bool lum_tile_points_find(const struct lum_lookup *l, const struct lum_tile_points *points, struct lum_candidates *c)
{
    struct lum_tile_points_box box = lum_tile_points_box_of(points, 0, points->n);
    uint32_t n_found = lum_store_overlap(l->store, l->worker, box.lo, box.hi, c->records, LUM_TILE_RECORDS);
    c->n = 0;
    for (uint32_t k = 0; k < n_found; k++)
        if (may_face(l, &box, c->records[k]->n) && lum_record_is_fine(l, c->records[k]))
            c->records[c->n++] = c->records[k];
    lum_tile_points_sort(c);
    return n_found < LUM_TILE_RECORDS;
}

/* ---- who is served ---- */

/* The metric is a constant where this is called, so that each has a loop of its own. edge: of lum_weight_tents. */
static inline float weigh(const struct lum_weighting *w, enum lum_metric metric, const struct lum_cache_record *r,
                          float per_radius, float edge, const struct lum_tile_points *s, uint32_t i)
{
    struct lum_vec3 d = {s->px[i] - r->p.x, s->py[i] - r->p.y, s->pz[i] - r->p.z}, n = {s->nx[i], s->ny[i], s->nz[i]};
    return metric == LUM_METRIC_WARD ? lum_weight_ward(w, per_radius, d, r->n, n)
                                     : lum_weight_tents(w, per_radius, edge, d, r->n, n);
}

/* Raises best[i] above 0 where record r serves point i. */
static inline void raise_best(const struct lum_lookup *l, enum lum_metric metric, const struct lum_cache_record *r,
                              const struct lum_tile_points *restrict s, float *restrict best)
{
    const struct lum_weighting w = l->weighting;
    const struct lum_cache_record at = {.p = r->p, .n = r->n};
    float per_radius = 1.0f / r->radius;
    for (uint32_t i = 0; i < s->n; i++)
        best[i] = lum_max(best[i], weigh(&w, metric, &at, per_radius, LUM_TENT_SERVES, s, i));
}

/* Keeps the points that nobody serves yet. */
static void drop_served(struct lum_tile_points *s, struct lum_pixel_mask *mask, float *best)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < s->n; i++) {
        if (best[i] > 0.0f) {
            lum_pixel_mask_clear(mask, s->slot[i]);
            continue;
        }
        s->px[n] = s->px[i], s->py[n] = s->py[i], s->pz[n] = s->pz[i];
        s->nx[n] = s->nx[i], s->ny[n] = s->ny[i], s->nz[n] = s->nz[i];
        s->slot[n++] = s->slot[i];
    }
    s->n = n;
    memset(best, 0, n * sizeof *best);
}

/* Most points are served by the first few records: they are dropped after 1, 2, 4, .. of them. */
static void serve_by(const struct lum_lookup *l, const struct lum_candidates *c, struct lum_tile_points *s,
                     struct lum_pixel_mask *mask)
{
    _Alignas(64) float best[LUM_TILE_PIXELS] = {0};
    for (uint32_t k = 0; k < c->n && s->n > 0; k++) {
        if (l->metric == LUM_METRIC_WARD)
            raise_best(l, LUM_METRIC_WARD, c->records[k], s, best);
        else
            raise_best(l, LUM_METRIC_TENTS, c->records[k], s, best);
        if ((k & (k + 1)) == 0)
            drop_served(s, mask, best);
    }
    drop_served(s, mask, best);
}

void lum_tile_points_note(const struct lum_candidates *c, _Atomic uint64_t *found)
{
    for (uint32_t k = 0; k < c->n; k++) {
        uint32_t index = c->records[k]->index;
        uint64_t bit = UINT64_C(1) << index % 64;
        if (!(atomic_load_explicit(&found[index / 64], memory_order_relaxed) & bit))
            atomic_fetch_or_explicit(&found[index / 64], bit, memory_order_relaxed);
    }
}

static struct lum_tile_points point_of(const struct lum_tile_points *s, uint32_t i)
{
    struct lum_tile_points one = {.n = 1};
    one.px[0] = s->px[i], one.py[0] = s->py[i], one.pz[0] = s->pz[i];
    one.nx[0] = s->nx[i], one.ny[0] = s->ny[i], one.nz[0] = s->nz[i];
    one.slot[0] = s->slot[i];
    return one;
}

void lum_tile_points_serve(const struct lum_lookup *l, const struct lum_candidates *candidates,
                           struct lum_tile_points *points, struct lum_pixel_mask *mask, _Atomic uint64_t *found)
{
    if (candidates) {
        if (found)
            lum_tile_points_note(candidates, found);
        serve_by(l, candidates, points, mask);
        return;
    }
    struct lum_cache_record *records[LUM_TILE_RECORDS];
    for (uint32_t i = 0; i < points->n; i++) {
        struct lum_tile_points one = point_of(points, i);
        struct lum_candidates c = {0, records};
        lum_tile_points_find(l, &one, &c);
        if (found)
            lum_tile_points_note(&c, found);
        serve_by(l, &c, &one, mask);
    }
}

/* ---- interpolation ---- */

#define GROUP 64u /* points that are summed together: a block of 8 x 8 where all pixels take part */

/* Sums are of differences to the first record that counts at a point: what all agree on stays exact. */
struct sums {
    _Alignas(64) float weight[GROUP];
    float first[3][GROUP], sum[3][GROUP];
};

/* Points from .. from + n - 1 of a tile. */
struct group {
    const struct lum_tile_points *points;
    uint32_t from, n;
};

/* What a record says at distance d: no less than a twentieth and no more than 20 times what it says where it lies
 * (as in Radiance). */
static inline float extrapolate(float value, const float gradient[3], struct lum_vec3 d)
{
    float there = value + (gradient[0] * d.x + gradient[1] * d.y + gradient[2] * d.z);
    return lum_max(lum_min(there, 20.0f * value), 0.05f * value);
}

static inline void add_record(const struct lum_lookup *l, enum lum_metric metric, bool inclined,
                              const struct lum_cache_record *r, const struct group *g, struct sums *restrict sums)
{
    const struct lum_weighting w = l->weighting;
    const struct lum_cache_record at = {.p = r->p, .n = r->n};
    const float per_radius = 1.0f / r->radius;
    const float value[3] = {r->irradiance.r, r->irradiance.g, r->irradiance.b};
    const float gradient[3][3] = {{r->gradient[0].r, r->gradient[1].r, r->gradient[2].r},
                                  {r->gradient[0].g, r->gradient[1].g, r->gradient[2].g},
                                  {r->gradient[0].b, r->gradient[1].b, r->gradient[2].b}};
    const struct lum_tile_points *restrict s = g->points;
    const uint32_t from = g->from, n = (g->n + 15u) & ~15u;
    for (uint32_t i = 0; i < n; i++) {
        float weight = weigh(&w, metric, &at, per_radius, 1.0f, s, from + i);
        struct lum_vec3 d = {s->px[from + i] - at.p.x, s->py[from + i] - at.p.y, s->pz[from + i] - at.p.z};
        for (uint32_t c = 0; c < 3; c++) {
            float there = inclined ? extrapolate(value[c], gradient[c], d) : value[c];
            float first = sums->weight[i] > 0.0f ? sums->first[c][i] : there; /* where this one serves or not */
            sums->first[c][i] = first;
            sums->sum[c][i] += weight * (there - first);
        }
        sums->weight[i] += weight;
    }
}

static bool has_gradient(const struct lum_cache_record *r)
{
    float most = 0.0f;
    for (uint32_t k = 0; k < 3; k++)
        most =
            lum_max(most, lum_max(fabsf(r->gradient[k].r), lum_max(fabsf(r->gradient[k].g), fabsf(r->gradient[k].b))));
    return most > 0.0f;
}

static void add_any_record(const struct lum_lookup *l, const struct lum_cache_record *r, const struct group *g,
                           struct sums *sums)
{
    bool inclined = has_gradient(r);
    if (l->metric == LUM_METRIC_WARD && inclined)
        add_record(l, LUM_METRIC_WARD, true, r, g, sums);
    else if (l->metric == LUM_METRIC_WARD)
        add_record(l, LUM_METRIC_WARD, false, r, g, sums);
    else if (inclined)
        add_record(l, LUM_METRIC_TENTS, true, r, g, sums);
    else
        add_record(l, LUM_METRIC_TENTS, false, r, g, sums);
}

static void interpolate_group(const struct lum_lookup *l, const struct lum_candidates *c, const struct group *g,
                              struct lum_rgb *ret_irradiance)
{
    struct sums sums;
    struct lum_tile_points_box box = lum_tile_points_box_of(g->points, g->from, g->n);
    memset(&sums, 0, sizeof sums);
    for (uint32_t k = 0; k < c->n; k++)
        if (may_reach(&box, c->records[k]) && may_face(l, &box, c->records[k]->n))
            add_any_record(l, c->records[k], g, &sums);
    for (uint32_t i = 0; i < g->n; i++) {
        float per_weight = sums.weight[i] > 0.0f ? 1.0f / sums.weight[i] : 0.0f;
        struct lum_rgb sum = {sums.first[0][i] + sums.sum[0][i] * per_weight,
                              sums.first[1][i] + sums.sum[1][i] * per_weight,
                              sums.first[2][i] + sums.sum[2][i] * per_weight};
        ret_irradiance[i] = per_weight > 0.0f
                                ? lum_rgb(lum_max(sum.r, 0.0f), lum_max(sum.g, 0.0f), lum_max(sum.b, 0.0f))
                                : lum_grey(0.0f);
    }
}

static void interpolate_by(const struct lum_lookup *l, const struct lum_candidates *c, const struct lum_tile_points *s,
                           struct lum_rgb *ret_irradiance)
{
    for (uint32_t from = 0; from < s->n; from += GROUP) {
        struct group g = {s, from, s->n - from < GROUP ? s->n - from : GROUP};
        interpolate_group(l, c, &g, ret_irradiance + from);
    }
}

void lum_tile_points_interpolate(const struct lum_lookup *l, const struct lum_candidates *candidates,
                                 const struct lum_tile_points *points, struct lum_rgb ret_irradiance[LUM_TILE_PIXELS])
{
    if (candidates) {
        interpolate_by(l, candidates, points, ret_irradiance);
        return;
    }
    struct lum_cache_record *records[LUM_TILE_RECORDS];
    for (uint32_t i = 0; i < points->n; i++) {
        struct lum_tile_points one = point_of(points, i);
        struct lum_candidates c = {0, records};
        lum_tile_points_find(l, &one, &c);
        interpolate_by(l, &c, &one, &ret_irradiance[i]);
    }
}
