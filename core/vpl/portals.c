/* Finds the openings by which light from afar comes into rooms.
 *
 * VPLs lie where light goes. A ray from each tells of its surroundings whether they are inside: there nearly all rays
 * meet something. From those that are inside many rays go out by the cosine: where they end tells how far
 * the room goes, which is the box, and those that meet nothing leave it through the portals, as often as diffuse light
 * would; light goes both ways, so that a cell of the box counts by how much of an even sky comes in through it.
 *
 * The box is rounded to a grid, cells are taken whole or not at all, and rays start from the numbers of slots: what
 * moves elsewhere changes no cell, as a rule, and so no VPL and no record. */
#include "core/vpl/share.h"

#include <stdlib.h>

#include "core/math/sampler.h"
#include "core/math/warp.h"
#include "core/trace/rays.h"
#include "core/trace/stale.h"

/* Rays from all VPLs together that are inside. */
enum { RAYS_INSIDE = 8192 };

/* Of all rays from a place that is outside, less than so many meet something; of one that is inside for sure, so many
 * more: a yard is in between. */
#define MET_OUTSIDE 0.6f
#define MET_RANGE 0.3f
/* With fewer VPLs inside, or rays through the portals, there is nothing to say. */
#define INSIDE_LEAST 8.0f
#define ESCAPED_LEAST 8u
/* Where more get out the sky is not seen by windows. */
#define ESCAPED_MOST 0.35f
/* The box leaves out so many of where rays end, at each end: some go out and end there. */
#define OUTLIERS 0.03f
/* Its grid: so many steps in the scene's radius. It is so many wider than the room, as walls are: light that the sides
 * of a window send in has come into the box, too. */
#define BOX_STEPS 64.0f
#define WALL_STEPS 3.0f

struct line {
    struct lum_vec3 o, d;
    float t; /* where it ends; INFINITY: at nothing, or behind panes alone */
};

struct search {
    const struct lum_vpl_set *seen;
    const struct lum_vpl_request *rq;
    struct line *lines;
    uint32_t n_lines;
    uint32_t *slots; /* of those inside, and of how many before it: lines start by turns */
    float *upto;
    uint32_t n_inside;
};

static void trace_lines(void *ctx, uint32_t job, struct lum_counters *counters)
{
    const struct search *search = ctx;
    struct lum_trace trace = lum_trace_of(search->rq->snapshot, counters);
    struct lum_trace light = lum_trace_of_light(search->rq->snapshot, counters, true);
    struct line *lines = search->lines + job * LUM_RAY_BATCH;
    uint32_t left = search->n_lines - job * LUM_RAY_BATCH, n = left < LUM_RAY_BATCH ? left : LUM_RAY_BATCH;
    struct lum_rays rays;
    struct lum_hits hits;
    rays.n = 0;
    for (uint32_t i = 0; i < n; i++)
        lum_rays_push(&rays, lines[i].o, lines[i].d, INFINITY);
    lum_trace_closest(&trace, &rays, &hits);
    counters->rays[LUM_RAY_VPL] += n;
    for (uint32_t i = 0; i < n; i++)
        lines[i].t = hits.object[i] == LUM_NO_OBJECT ? INFINITY : hits.t[i];
    if (!light.panes)
        return;
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_rgb through[LUM_RAY_BATCH];
    lum_trace_light(&light, &rays, occluded, through);
    counters->rays[LUM_RAY_VPL] += n;
    for (uint32_t i = 0; i < n; i++)
        lines[i].t = occluded[i] ? lines[i].t : INFINITY;
}

static enum lum_status trace_all(struct search *search, struct lum_error *err)
{
    return lum_vpl_run(search->rq, (search->n_lines + LUM_RAY_BATCH - 1) / LUM_RAY_BATCH, trace_lines, search, err);
}

static struct line line_from(const struct lum_vpl_set *seen, uint32_t slot, uint32_t number, uint32_t seed)
{
    struct lum_vec3 n = lum_v3(seen->nx[slot], seen->ny[slot], seen->nz[slot]);
    struct lum_frame frame = lum_frame_from_normal(n);
    struct lum_sampler sampler = lum_sampler_at(slot, 1, number, seed);
    struct lum_vec3 p = lum_v3(seen->px[slot], seen->py[slot], seen->pz[slot]);
    return (struct line){lum_ray_offset(p, n), lum_frame_to_scene(&frame, lum_warp_cosine(lum_sampler_2d(&sampler, 0))),
                         INFINITY};
}

/* ---- who is inside ---- */

static enum lum_status ask_all(struct search *search, struct lum_error *err)
{
    const struct lum_vpl_set *seen = search->seen;
    search->n_lines = 0;
    for (uint32_t i = 0; i < seen->n; i++)
        if (seen->light[i] != LUM_NO_OBJECT)
            search->lines[search->n_lines++] = line_from(seen, i, 0, search->rq->seed);
    return trace_all(search, err);
}

struct tally {
    float n, met;
};

static void count_inside(struct search *search, struct tally *places)
{
    const struct lum_vpl_set *seen = search->seen;
    const struct lum_snapshot *s = search->rq->snapshot;
    float upto = 0.0f;
    for (uint32_t i = 0, line = 0; i < seen->n; i++)
        if (seen->light[i] != LUM_NO_OBJECT) {
            struct tally *place = &places[lum_vpl_place_of(seen, s, i)];
            place->n += 1.0f;
            place->met += isfinite(search->lines[line++].t) ? 1.0f : 0.0f;
        }
    for (uint32_t i = 0; i < seen->n; i++) {
        if (seen->light[i] == LUM_NO_OBJECT)
            continue;
        const struct tally *place = &places[lum_vpl_place_of(seen, s, i)];
        float inside = lum_clamp((place->met / place->n - MET_OUTSIDE) / MET_RANGE, 0.0f, 1.0f);
        if (!(inside > 0.0f))
            continue;
        search->slots[search->n_inside] = i;
        search->upto[search->n_inside++] = upto += inside;
    }
}

static enum lum_status find_inside(struct search *search, struct lum_error *err)
{
    enum lum_status status = ask_all(search, err);
    if (status != LUM_OK)
        return status;
    struct tally *places = lum_calloc(LUM_VPL_PLACES, sizeof *places);
    if (!places)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory to look for portals");
    count_inside(search, places);
    lum_free(places);
    return LUM_OK;
}

/* Rays from those inside, as many from each as it is inside. */
static enum lum_status look_out(struct search *search, struct lum_error *err)
{
    float all = search->upto[search->n_inside - 1];
    search->n_lines = RAYS_INSIDE;
    for (uint32_t i = 0, k = 0, number = 1; i < RAYS_INSIDE; i++, number++) {
        while (k + 1 < search->n_inside && search->upto[k] <= ((float)i + 0.5f) / RAYS_INSIDE * all) {
            k++;
            number = 1;
        }
        search->lines[i] = line_from(search->seen, search->slots[k], number, search->rq->seed);
    }
    return trace_all(search, err);
}

/* ---- the box ---- */

static int by_size(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static float coordinate(struct lum_vec3 v, uint32_t axis)
{
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

/* Where lines end along an axis, but for outliers, on the grid. False: it would be flat. */
static bool find_range(const struct search *search, uint32_t axis, float *room, float *ret_lo, float *ret_hi)
{
    const struct lum_snapshot *s = search->rq->snapshot;
    float step = s->lights.scene_radius / BOX_STEPS;
    uint32_t n = 0;
    for (uint32_t i = 0; i < search->n_lines; i++) {
        const struct line *l = &search->lines[i];
        if (isfinite(l->t))
            room[n++] = coordinate(lum_v3_mad(l->o, l->d, l->t), axis);
    }
    if (n == 0)
        return false;
    qsort(room, n, sizeof *room, by_size);
    uint32_t out = (uint32_t)(OUTLIERS * (float)n);
    *ret_lo =
        lum_max((ceilf(room[out] / step) - WALL_STEPS) * step, coordinate(s->bounds_lo, axis) - 2.0f * LUM_RAY_OFFSET);
    *ret_hi = lum_min((floorf(room[n - 1 - out] / step) + WALL_STEPS) * step,
                      coordinate(s->bounds_hi, axis) + 2.0f * LUM_RAY_OFFSET);
    return *ret_lo < *ret_hi;
}

static bool find_box(const struct search *search, float *room, struct lum_portals *o)
{
    return find_range(search, 0, room, &o->lo.x, &o->hi.x) && find_range(search, 1, room, &o->lo.y, &o->hi.y) &&
           find_range(search, 2, room, &o->lo.z, &o->hi.z);
}

/* ---- cells ---- */

/* Opens a cell and those beside it on its face: what is seen of an opening by few rays ends within them. False: there
 * is no room. */
static bool open_around(struct lum_portals *o, uint32_t cell)
{
    uint32_t face = cell / lum_portals_per_face(o), at = cell % lum_portals_per_face(o);
    uint32_t i = at % o->side, j = at / o->side;
    for (uint32_t y = j > 0 ? j - 1 : 0; y <= j + 1 && y < o->side; y++)
        for (uint32_t x = i > 0 ? i - 1 : 0; x <= i + 1 && x < o->side; x++) {
            uint32_t beside = face * lum_portals_per_face(o) + y * o->side + x;
            if (!lum_portals_is_open(o, beside) && !lum_portals_open(o, beside))
                return false;
        }
    return true;
}

_Static_assert(6u * 8u * 8u <= LUM_PORTALS_MAX, "some side has room for all cells");

/* Opens the cells through which lines get out of the box, as small as they may be. */
static void open_cells(const struct search *search, struct lum_portals *o)
{
    const struct lum_portals shut = *o;
    for (uint32_t side = LUM_PORTALS_SIDE;; side /= 2) { /* at 8 there is room for all */
        *o = shut;
        o->side = side;
        uint32_t n = 0;
        bool room = true;
        for (uint32_t i = 0; i < search->n_lines && room; i++) {
            const struct line *l = &search->lines[i];
            struct lum_portal_hit hit;
            if (isfinite(l->t) || !lum_portals_leave(o, l->o, l->d, &hit))
                continue;
            room = open_around(o, hit.cell);
            n++;
        }
        if (!room)
            continue;
        if (n < ESCAPED_LEAST || (float)n > ESCAPED_MOST * (float)search->n_lines)
            *o = shut;
        lum_portals_sort(o);
        return;
    }
}

static enum lum_status search_all(struct search *search, struct lum_portals *ret, float *room, struct lum_error *err)
{
    enum lum_status status = find_inside(search, err);
    if (status != LUM_OK || search->n_inside == 0 || search->upto[search->n_inside - 1] < INSIDE_LEAST)
        return status;
    status = look_out(search, err);
    if (status == LUM_OK && find_box(search, room, ret))
        open_cells(search, ret);
    return status;
}

/* seen: VPLs from where to look. */
static enum lum_status look_from(struct lum_portals *ret_portals, const struct lum_vpl_set *seen,
                                 const struct lum_vpl_request *rq, struct lum_error *err)
{
    uint32_t n_lines = seen->n > RAYS_INSIDE ? seen->n : RAYS_INSIDE;
    struct search search = {.seen = seen, .rq = rq};
    *ret_portals = (struct lum_portals){0};
    search.lines = lum_calloc(n_lines, sizeof *search.lines);
    search.slots = lum_calloc(seen->n, sizeof *search.slots);
    search.upto = lum_calloc(seen->n, sizeof *search.upto);
    float *room = lum_calloc(RAYS_INSIDE, sizeof *room);
    enum lum_status status = LUM_OK;
    if (search.lines && search.slots && search.upto && room)
        status = search_all(&search, ret_portals, room, err);
    else
        status = lum_fail(err, LUM_ERR_NOMEM, "", "out of memory to look for portals");
    lum_free(room);
    lum_free(search.upto);
    lum_free(search.slots);
    lum_free(search.lines);
    return status;
}

/* Tries whose VPLs look for portals: of a sky's paths few come in. */
#define TRIES_SEEN 4u

enum lum_status lum_vpl_find_portals(struct lum_vpl_set *set, const struct lum_vpl_request *rq, struct lum_error *err)
{
    const struct lum_vec3 lo = rq->snapshot->bounds_lo, hi = rq->snapshot->bounds_hi;
    bool geometry = lo.x <= hi.x; /* else no ray has to be asked */
    if (set->tries == 1 || !geometry || !lum_vpl_comes_from_afar(set))
        return LUM_OK;
    struct lum_vpl_set few = *set;
    struct lum_vpl_plan plan;
    few.tries = set->tries < TRIES_SEEN ? set->tries : TRIES_SEEN;
    few.max_bounces = set->max_bounces > 2 ? set->max_bounces : 2;
    lum_vpl_plan_init(&plan, &few);
    struct lum_vpl_set seen = {.n = set->n_bounced * few.tries, .lobes_off = set->lobes_off, .versions = set->versions};
    enum lum_status status = lum_vpl_alloc(&seen, err);
    if (status == LUM_OK)
        status = lum_vpl_emit(rq, &plan, &seen, err);
    if (status == LUM_OK)
        status = look_from(&set->portals, &seen, rq, err);
    lum_vpl_finish(&seen);
    return status;
}

enum lum_status lum_vpl_portals(struct lum_portals *ret_portals, const struct lum_vpl_request *rq,
                                struct lum_error *err)
{
    const struct lum_vpl_set before = {0};
    struct lum_vpl_set set = {.n = rq->n,
                              .n_bounced = rq->n,
                              .max_bounces = rq->max_bounces,
                              .seed = rq->seed,
                              .tries = rq->tries,
                              .versions = lum_versions_seen(rq->snapshot, rq->media)};
    enum lum_status status = lum_vpl_share_paths(&set, &before, rq->snapshot, err);
    if (status == LUM_OK)
        status = lum_vpl_find_portals(&set, rq, err);
    *ret_portals = set.portals;
    lum_vpl_finish(&set);
    return status;
}
