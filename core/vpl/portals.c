/* Finds the openings by which light from afar comes into rooms.
 *
 * Lines drawn evenly through the scene cross surfaces, as often as these are large; where a house stands on a site of
 * acres few cross it, and so points of objects, each as likely as another, are asked as well. The side of a surface is
 * inside when ray after ray from it, by the cosine, meets something. From those that are inside many rays go out: where
 * they end tells how far the rooms go, which is the box, and those that meet nothing leave it through the openings, as
 * often as diffuse light would; light goes both ways, so that an opening is found the sooner the more of an even sky
 * comes in by it. Where one of those rays leaves the box, the opening is followed to its edges: the side that sees a
 * cell open looks through those beside it.
 *
 * This depends on geometry and panes alone. The box is rounded to a grid, cells are taken whole or not at all, and rays
 * start from the numbers of crossings: what moves elsewhere changes no cell, as a rule, and so no VPL and no record. */
#include "core/vpl/portals.h"

#include <stdlib.h>
#include <string.h>

#include "core/math/sampler.h"
#include "core/math/warp.h"
#include "core/trace/rays.h"
#include "core/vpl/share.h"

/* Lines through the scene, crossings of each, and rays that a side has to meet something by to be inside: of a wall
 * that faces the ground and the sky half do, and one in 256 such sides is taken for one inside. */
enum { LINES = 1024, CROSSINGS = 8, ROUNDS = 8, POINTS = 512, SIDES = LINES * CROSSINGS + POINTS };
/* Sides that are asked, in the first round and later; and rays from those that are inside, all together. With twice as
 * many of each, pictures are no better, for openings are followed to their edges. */
enum { ASKED_FIRST = 4096, ASKED = 512, RAYS_INSIDE = 4096 };
_Static_assert(ASKED_FIRST <= RAYS_INSIDE && RAYS_INSIDE >= 8 * ASKED,
               "lines have room for all, and each side some rays");
/* Of these so many are to meet something: else the side is none inside, after all, or sees so much of the sky that it
 * is not seen by windows. */
#define MET_INSIDE 0.75f
/* With fewer sides inside, or rays through the portals, there is nothing to say. */
#define INSIDE_LEAST 8u
#define ESCAPED_LEAST 8u
/* With fewer of these it is looked again, so often in all: of four rooms with a window of 2 m2 each 15 rays get out in
 * a round. */
#define ESCAPED_MANY 64u
#define ROUNDS_OUT 4u
/* So often a cell beside an open one is looked through before it stays shut. */
#define LOOKS 2u
/* The box leaves out so many of where rays end, at each end: some go out and end there. */
#define OUTLIERS 0.03f
/* Its grid: so many steps in its longest side, which is rounded down to a power of 2 times the scene's radius, so that
 * a scene that is scaled has the same. It is so many wider than the room, as walls are: light that the sides of a
 * window send in has come into the box, too. */
#define BOX_STEPS 64.0f
#define WALL_STEPS 3.0f

struct side {
    struct lum_vec3 p, n; /* n: unit; 0: there is none */
    uint32_t number;
};

struct line {
    struct lum_vec3 o, d;
    float t; /* where it ends; INFINITY: at nothing, or behind panes alone; 0 or less: it does not count */
};

struct range {
    float lo, hi;
};

/* Which side looks through which cell of the box. */
struct look {
    uint32_t cell, side;
};

struct way_out {
    struct line line;
    uint32_t side;
};

struct search {
    const struct lum_vpl_request *rq;
    uint32_t n_crossed, n_sides, n_lines, n_out;
    uint32_t n_traced;                        /* lines before the ones that are being traced */
    struct side crossed[SIDES], sides[SIDES]; /* all, and those of them that are inside */
    bool sees_out[ASKED_FIRST];               /* by side */
    struct line lines[ROUNDS_OUT * RAYS_INSIDE];
    struct way_out out[RAYS_INSIDE];
    struct look looks[RAYS_INSIDE], seen[RAYS_INSIDE]; /* of lines, while there are cells; and of those before them */
    uint8_t looked[6u * LUM_PORTALS_SIDE * LUM_PORTALS_SIDE]; /* by cell: how often, yet */
    float room[ROUNDS_OUT * RAYS_INSIDE];
};

/* ---- lines through the scene ---- */

/* On a face of the bounds, inwards by the cosine: the lines through a convex body are even where they start so. */
static struct line line_through(const struct lum_snapshot *s, uint32_t number, uint32_t seed)
{
    struct lum_sampler sampler = lum_sampler_at(number, 2, 0, seed);
    struct lum_vec2 u = lum_sampler_2d(&sampler, 0), v = lum_sampler_2d(&sampler, 1), w = lum_sampler_2d(&sampler, 2);
    struct lum_vec3 lo = s->bounds_lo, size = lum_v3_sub(s->bounds_hi, lo);
    float area[3] = {size.y * size.z, size.z * size.x, size.x * size.y};
    float at = w.x * (area[0] + area[1] + area[2]);
    uint32_t axis = at < area[0] ? 0 : at < area[0] + area[1] ? 1 : 2;
    float upper = w.y < 0.5f ? 0.0f : 1.0f, share[3];
    share[axis] = upper, share[(axis + 1) % 3] = u.x, share[(axis + 2) % 3] = u.y;
    struct lum_frame f = lum_frame_from_normal(lum_portals_normal(2 * axis + (upper > 0.0f)));
    struct lum_vec3 d = lum_frame_to_scene(&f, lum_warp_cosine(v));
    struct lum_vec3 o = {lo.x + share[0] * size.x, lo.y + share[1] * size.y, lo.z + share[2] * size.z};
    return (struct line){lum_v3_mad(o, d, -4.0f * LUM_RAY_OFFSET), d, 0.0f};
}

/* Ray r of a line crosses a surface; the side is the one that it winds around. Where the line goes on from. */
static struct lum_vec3 cross(const struct lum_snapshot *s, const struct lum_rays *rays, const struct lum_hits *hits,
                             uint32_t r, struct side *ret_side)
{
    struct lum_vec3 d = lum_rays_direction(rays, r);
    struct lum_vec3 p = lum_v3_mad(lum_v3(rays->ox[r], rays->oy[r], rays->oz[r]), d, hits->t[r]);
    if (hits->object[r] >= s->n_instances) /* a lamp */
        return lum_v3_mad(p, d, 4.0f * LUM_RAY_OFFSET);
    ret_side->p = p;
    ret_side->n = lum_instance_normal(&s->instances[hits->object[r]], lum_v3(hits->ngx[r], hits->ngy[r], hits->ngz[r]));
    return lum_ray_offset(p, lum_dot(ret_side->n, d) > 0.0f ? ret_side->n : lum_v3_neg(ret_side->n));
}

static void cross_batch(void *ctx, uint32_t job, struct lum_counters *counters)
{
    struct search *search = ctx;
    const struct lum_snapshot *s = search->rq->snapshot;
    struct lum_trace trace = lum_trace_of(s, counters);
    struct lum_rays rays;
    struct lum_hits hits;
    uint32_t line[LUM_RAY_BATCH], first = job * LUM_RAY_BATCH;
    rays.n = 0;
    for (uint32_t i = first; i < first + LUM_RAY_BATCH && i < LINES; i++) {
        struct line l = line_through(s, i, search->rq->seed);
        line[rays.n] = i;
        lum_rays_push(&rays, l.o, l.d, INFINITY);
    }
    for (uint32_t c = 0; c < CROSSINGS && rays.n > 0; c++) {
        uint32_t n = rays.n;
        counters->rays[LUM_RAY_VPL] += lum_known_closest(&search->rq->known, &trace, &rays, &hits);
        rays.n = 0;
        for (uint32_t r = 0; r < n; r++) { /* ray r is read before a ray up to r is written */
            if (hits.object[r] == LUM_NO_OBJECT)
                continue;
            struct lum_vec3 d = lum_rays_direction(&rays, r);
            struct lum_vec3 on = cross(s, &rays, &hits, r, &search->crossed[line[r] * CROSSINGS + c]);
            line[rays.n] = line[r];
            lum_rays_push(&rays, on, d, INFINITY);
        }
    }
}

/* A point of an object, of a triangle that is as likely as its others. */
static struct side side_of(const struct lum_instance *instance, struct lum_vec2 u, float of_triangles)
{
    const struct lum_mesh *mesh = instance->mesh;
    struct side side = {0};
    if (mesh->n_triangles == 0)
        return side;
    uint32_t t = (uint32_t)lum_min(of_triangles * (float)mesh->n_triangles, (float)(mesh->n_triangles - 1));
    const uint32_t *tri = mesh->indices + 3 * (size_t)t;
    struct lum_vec2 b = lum_warp_triangle(u);
    struct lum_vec3 v[3];
    for (int k = 0; k < 3; k++) {
        const float *q = mesh->positions + 3 * (size_t)tri[k];
        v[k] = lum_v3(q[0], q[1], q[2]);
    }
    if (tri[1] > tri[2]) /* the same point whichever way it is wound */
        b = (struct lum_vec2){b.y, b.x};
    struct lum_vec3 e1 = lum_v3_sub(v[1], v[0]), e2 = lum_v3_sub(v[2], v[0]);
    side.p = lum_affine_point(&instance->local_to_scene, lum_v3_mad(lum_v3_mad(v[0], e1, b.x), e2, b.y));
    side.n = lum_instance_normal(instance, lum_cross(e1, e2));
    return side;
}

/* As many of each object, or of some; a point's number hangs on its object's id alone, so that what comes or goes moves
 * few. */
static void pick_points(struct search *search)
{
    const struct lum_snapshot *s = search->rq->snapshot;
    uint32_t every = 1, each = 1, n = LINES * CROSSINGS;
    while (s->n_instances / every > POINTS)
        every *= 2;
    while (2 * each * s->n_instances <= POINTS && s->n_instances > 0)
        each *= 2;
    for (uint32_t i = 0; i < s->n_instances; i++) {
        uint32_t hash = lum_hash_u32((uint32_t)s->instances[i].hash);
        for (uint32_t k = 0; k < each && hash % every == 0 && n < SIDES; k++) {
            uint32_t number = lum_hash_combine(hash, k) | UINT32_C(1) << 31;
            struct lum_sampler sampler = lum_sampler_at(number, 2, 0, search->rq->seed);
            struct side side = side_of(&s->instances[i], lum_sampler_2d(&sampler, 0), lum_sampler_2d(&sampler, 1).x);
            side.number = number;
            search->crossed[n++] = side;
        }
    }
}

static enum lum_status find_sides(struct search *search, struct lum_error *err)
{
    enum lum_status status =
        lum_vpl_run(search->rq, (LINES + LUM_RAY_BATCH - 1) / LUM_RAY_BATCH, cross_batch, search, err);
    pick_points(search);
    for (uint32_t i = 0; i < SIDES; i++)
        if (lum_dot(search->crossed[i].n, search->crossed[i].n) > 0.5f && lum_v3_finite(search->crossed[i].p)) {
            search->crossed[search->n_crossed] = search->crossed[i];
            if (i < LINES * CROSSINGS)
                search->crossed[search->n_crossed].number = i;
            search->n_crossed++;
        }
    return status;
}

/* ---- who is inside ---- */

static bool meets_pane(const struct lum_snapshot *s, uint32_t object)
{
    return object < s->n_instances && lum_material_is_pane(&s->materials[s->instances[object].material]);
}

/* Lines that met panes meet nothing when there are panes alone. rays: of the lines, which are written anew. */
static void look_through_panes(const struct lum_snapshot *s, struct lum_rays *rays, const struct lum_hits *hits,
                               struct line *lines, struct lum_counters *counters)
{
    uint32_t line[LUM_RAY_BATCH], n = rays->n;
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_rgb through[LUM_RAY_BATCH];
    rays->n = 0;
    for (uint32_t i = 0; i < n; i++)
        if (meets_pane(s, hits->object[i])) {
            line[rays->n] = i;
            lum_rays_push(rays, lines[i].o, lines[i].d, INFINITY);
        }
    if (rays->n == 0)
        return;
    struct lum_trace light = lum_trace_of_light(s, counters, true);
    lum_trace_light(&light, rays, occluded, through);
    counters->rays[LUM_RAY_VPL] += rays->n;
    for (uint32_t r = 0; r < rays->n; r++)
        if (!occluded[r])
            lines[line[r]].t = INFINITY;
}

static void trace_lines(void *ctx, uint32_t job, struct lum_counters *counters)
{
    struct search *search = ctx;
    struct lum_trace trace = lum_trace_of(search->rq->snapshot, counters);
    const uint32_t first = search->n_traced + job * LUM_RAY_BATCH;
    struct line *lines = search->lines + first;
    uint32_t left = search->n_lines - first, n = left < LUM_RAY_BATCH ? left : LUM_RAY_BATCH;
    struct lum_rays rays;
    struct lum_hits hits;
    rays.n = 0;
    for (uint32_t i = 0; i < n; i++)
        lum_rays_push(&rays, lines[i].o, lines[i].d, INFINITY);
    counters->rays[LUM_RAY_VPL] += lum_known_closest(&search->rq->known, &trace, &rays, &hits);
    for (uint32_t i = 0; i < n; i++)
        lines[i].t = hits.object[i] == LUM_NO_OBJECT ? INFINITY : hits.t[i];
    if (search->rq->snapshot->has_panes)
        look_through_panes(search->rq->snapshot, &rays, &hits, lines, counters);
}

static enum lum_status trace_from(struct search *search, uint32_t first, struct lum_error *err)
{
    uint32_t n = search->n_lines - first;
    search->n_traced = first;
    return lum_vpl_run(search->rq, (n + LUM_RAY_BATCH - 1) / LUM_RAY_BATCH, trace_lines, search, err);
}

static struct line line_from(const struct side *side, uint32_t number, uint32_t seed)
{
    struct lum_frame frame = lum_frame_from_normal(side->n);
    struct lum_sampler sampler = lum_sampler_at(side->number, 1, number, seed);
    return (struct line){lum_ray_offset(side->p, side->n),
                         lum_frame_to_scene(&frame, lum_warp_cosine(lum_sampler_2d(&sampler, 0))), INFINITY};
}

/* About as many as `most`, by their numbers, of which each round looks at other bits. */
static void thin_out(struct search *search, uint32_t most, uint32_t round)
{
    uint32_t every = 1, n = 0;
    while (search->n_sides / every > most)
        every *= 2;
    for (uint32_t i = 0; i < search->n_sides && n < most; i++)
        if (lum_hash_combine(round, search->sides[i].number) % every == 0)
            search->sides[n++] = search->sides[i];
    search->n_sides = n;
}

/* Leaves those sides that are inside. way: -1 for the sides that surfaces do not wind around. */
static enum lum_status find_inside(struct search *search, float way, struct lum_error *err)
{
    enum lum_status status = LUM_OK;
    search->n_sides = search->n_crossed;
    for (uint32_t i = 0; i < search->n_sides; i++) {
        search->sides[i] = search->crossed[i];
        search->sides[i].n = lum_v3_mul(search->crossed[i].n, way);
    }
    for (uint32_t round = 0; round < ROUNDS && search->n_sides > 0 && status == LUM_OK; round++) {
        uint32_t n = 0;
        thin_out(search, round == 0 ? ASKED_FIRST : ASKED, round);
        search->n_lines = search->n_sides;
        for (uint32_t i = 0; i < search->n_sides; i++)
            search->lines[i] = line_from(&search->sides[i], round, search->rq->seed);
        status = trace_from(search, 0, err);
        for (uint32_t i = 0; i < search->n_sides; i++)
            if (isfinite(search->lines[i].t))
                search->sides[n++] = search->sides[i];
        search->n_sides = n;
    }
    return status;
}

/* Adds the ways out of rays that are there, `each` from each side in each round. Those from a side that is not inside,
 * after all, do not count, nor those from one that sees no way out: it may be within a wall. */
static void find_ways_out(struct search *search, uint32_t each)
{
    const uint32_t of_round = each * search->n_sides, n_rounds = search->n_lines / of_round, n = each * n_rounds;
    search->n_out = 0;
    for (uint32_t i = 0; i < search->n_sides; i++) {
        uint32_t met = 0;
        for (uint32_t k = 0; k < n; k++)
            met += isfinite(search->lines[k / each * of_round + i * each + k % each].t);
        search->sees_out[i] = met < n && (float)met >= MET_INSIDE * (float)n;
        for (uint32_t k = 0; k < n && search->sees_out[i]; k++) {
            struct line line = search->lines[k / each * of_round + i * each + k % each];
            if (!isfinite(line.t) && search->n_out < RAYS_INSIDE)
                search->out[search->n_out++] = (struct way_out){line, i};
        }
    }
}

/* Rays from all that are inside; again, until of several rooms each has some ways out. */
static enum lum_status look_out(struct search *search, struct lum_error *err)
{
    const uint32_t each = RAYS_INSIDE / search->n_sides, n = each * search->n_sides;
    enum lum_status status = LUM_OK;
    search->n_lines = search->n_out = 0;
    for (uint32_t round = 0; round < ROUNDS_OUT && status == LUM_OK; round++) {
        if (search->n_out >= ESCAPED_MANY || search->n_out * ROUNDS_OUT < round * ESCAPED_LEAST)
            break; /* enough; or there would not be, in the end */
        for (uint32_t i = 0; i < n; i++)
            search->lines[search->n_lines + i] =
                line_from(&search->sides[i / each], ROUNDS + round * each + i % each, search->rq->seed);
        search->n_lines += n;
        status = trace_from(search, search->n_lines - n, err);
        find_ways_out(search, each);
    }
    for (uint32_t i = 0; i < search->n_lines; i++)
        if (!search->sees_out[i % n / each])
            search->lines[i].t = 0.0f;
    return status;
}

/* ---- the box ---- */

static int by_size(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Where lines end along an axis, but for outliers. False: nowhere. */
static bool find_range(struct search *search, uint32_t axis, struct range *ret)
{
    uint32_t n = 0;
    float *room = search->room;
    for (uint32_t i = 0; i < search->n_lines; i++) {
        const struct line *l = &search->lines[i];
        if (l->t > 0.0f && isfinite(l->t))
            room[n++] = lum_v3_part(lum_v3_mad(l->o, l->d, l->t), axis);
    }
    if (n == 0)
        return false;
    qsort(room, n, sizeof *room, by_size);
    uint32_t out = (uint32_t)(OUTLIERS * (float)n);
    *ret = (struct range){room[out], room[n - 1 - out]};
    return true;
}

/* The range on the grid, and wider by walls, but no wider than the scene. */
static struct range widen(struct range r, float step, float scene_lo, float scene_hi)
{
    return (struct range){lum_max((ceilf(r.lo / step) - WALL_STEPS) * step, scene_lo - 2.0f * LUM_RAY_OFFSET),
                          lum_min((floorf(r.hi / step) + WALL_STEPS) * step, scene_hi + 2.0f * LUM_RAY_OFFSET)};
}

/* False: there is none, or it would be flat. */
static bool find_box(struct search *search, struct lum_portals *o)
{
    const struct lum_vec3 lo = search->rq->snapshot->bounds_lo, hi = search->rq->snapshot->bounds_hi;
    struct range x, y, z;
    if (!find_range(search, 0, &x) || !find_range(search, 1, &y) || !find_range(search, 2, &z))
        return false;
    float longest = lum_max(x.hi - x.lo, lum_max(y.hi - y.lo, z.hi - z.lo));
    if (!(longest > 0.0f))
        return false;
    float radius = search->rq->snapshot->lights.scene_radius;
    float step = radius * exp2f(floorf(log2f(longest / radius))) / BOX_STEPS;
    x = widen(x, step, lo.x, hi.x), y = widen(y, step, lo.y, hi.y), z = widen(z, step, lo.z, hi.z);
    o->lo = lum_v3(x.lo, y.lo, z.lo), o->hi = lum_v3(x.hi, y.hi, z.hi);
    return x.lo < x.hi && y.lo < y.hi && z.lo < z.hi;
}

/* ---- cells ---- */

/* Opens what is beside open cells, too: edges of openings lie within. False: there is no room. */
static bool open_edges(struct lum_portals *o)
{
    uint32_t beside;
    for (uint32_t k = 0, n = o->n; k < n; k++)
        for (int i = 0; i < 9; i++)
            if (lum_portals_beside(o, o->cell[k], i % 3 - 1, i / 3 - 1, &beside) && !lum_portals_open(o, beside))
                return false;
    return true;
}

/* A line from a side through a cell. It is looked along where that side faces the cell from within, and few have
 * looked through it. */
static void look_through(struct search *search, const struct lum_portals *o, struct look look)
{
    uint8_t *looked = &search->looked[look.cell];
    if (lum_portals_is_open(o, look.cell) || *looked >= LOOKS || search->n_lines >= RAYS_INSIDE)
        return;
    const struct side *from = &search->sides[look.side];
    struct lum_sampler sampler = lum_sampler_at(look.cell, 3, *looked, search->rq->seed);
    struct lum_vec3 inward, p = lum_ray_offset(from->p, from->n);
    struct lum_vec3 d = lum_v3_sub(lum_portals_point(o, look.cell, lum_sampler_2d(&sampler, 0), &inward), p);
    float length = lum_length(d);
    if (!(length > 0.0f) || lum_dot(d, from->n) <= 0.0f || lum_dot(d, inward) >= 0.0f)
        return;
    ++*looked;
    search->looks[search->n_lines] = look;
    search->lines[search->n_lines++] = (struct line){p, lum_v3_mul(d, 1.0f / length), INFINITY};
}

/* Opens the cells beside those that were seen through, and beside those again, where the same sides get out by them:
 * few rays come to a small opening, and it is to be found to its edges. n: of search->looks. False: there is no
 * room. */
static bool follow(struct search *search, struct lum_portals *o, uint32_t n, enum lum_status *inout_status,
                   struct lum_error *err)
{
    while (n > 0 && *inout_status == LUM_OK) {
        struct look beside;
        memcpy(search->seen, search->looks, n * sizeof *search->seen);
        search->n_lines = 0;
        for (uint32_t k = 0; k < n; k++)
            for (int i = 0; i < 9; i++) {
                beside.side = search->seen[k].side;
                if (lum_portals_beside(o, search->seen[k].cell, i % 3 - 1, i / 3 - 1, &beside.cell))
                    look_through(search, o, beside);
            }
        *inout_status = trace_from(search, 0, err);
        n = 0;
        for (uint32_t k = 0; k < search->n_lines; k++)
            if (!isfinite(search->lines[k].t)) {
                search->looks[n++] = search->looks[k];
                if (!lum_portals_open(o, search->looks[k].cell))
                    return false;
            }
    }
    return true;
}

/* Opens the cells by which the ways out leave the box. Those looks are in search->looks then. False: there is no room.
 */
static bool open_seen(struct search *search, struct lum_portals *o, uint32_t *ret_n)
{
    *ret_n = 0;
    for (uint32_t i = 0; i < search->n_out; i++) {
        struct lum_portal_hit hit;
        if (!lum_portals_leave(o, search->out[i].line.o, search->out[i].line.d, &hit))
            continue;
        search->looks[(*ret_n)++] = (struct look){hit.cell, search->out[i].side};
        if (!lum_portals_open(o, hit.cell))
            return false;
    }
    return true;
}

_Static_assert(6u * 8u * 8u <= LUM_PORTALS_MAX, "some side has room for all cells");

/* As small cells as there is room for. */
static enum lum_status open_cells(struct search *search, struct lum_portals *o, struct lum_error *err)
{
    const struct lum_portals shut = *o;
    enum lum_status status = LUM_OK;
    for (uint32_t side = LUM_PORTALS_SIDE; status == LUM_OK; side /= 2) { /* at 8 there is room for all */
        uint32_t n;
        lum_portals_cut(o, shut.lo, shut.hi, side);
        memset(search->looked, 0, sizeof search->looked);
        if (!open_seen(search, o, &n))
            continue;
        if (n < ESCAPED_LEAST) {
            *o = shut;
            break;
        }
        if (follow(search, o, n, &status, err) && status == LUM_OK && open_edges(o))
            break;
    }
    lum_portals_sort(o);
    return status;
}

static enum lum_status search_from(struct search *search, float way, struct lum_portals *ret, struct lum_error *err)
{
    search->n_out = 0;
    enum lum_status status = find_inside(search, way, err);
    if (status != LUM_OK || search->n_sides < INSIDE_LEAST)
        return status;
    status = look_out(search, err);
    if (status == LUM_OK && find_box(search, ret))
        status = open_cells(search, ret, err);
    return status;
}

/* The side that a surface does not wind around is within a wall, as a rule; but rooms of single sheets may be wound
 * either way. */
static enum lum_status search_all(struct search *search, struct lum_portals *ret, struct lum_error *err)
{
    enum lum_status status = find_sides(search, err);
    if (status == LUM_OK)
        status = search_from(search, 1.0f, ret, err);
    if (status == LUM_OK && ret->n == 0)
        status = search_from(search, -1.0f, ret, err);
    return status;
}

enum lum_status lum_vpl_find_portals(struct lum_portals *ret_portals, const struct lum_vpl_request *rq,
                                     struct lum_error *err)
{
    *ret_portals = (struct lum_portals){0};
    if (!(rq->snapshot->bounds_lo.x <= rq->snapshot->bounds_hi.x))
        return LUM_OK;
    struct search *search = lum_calloc(1, sizeof *search);
    if (!search)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory to look for portals");
    search->rq = rq;
    enum lum_status status = search_all(search, ret_portals, err);
    if (status != LUM_OK)
        *ret_portals = (struct lum_portals){0};
    lum_free(search);
    return status;
}
