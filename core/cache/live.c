/* The cache of `live`: sums of virtual point lights, kept as who sees whom.
 *
 * A record holds a bit for each VPL: it sees it. Of many VPLs it asks those that it draws by what they would bring
 * (lum_vpl_draw): of the indirect light in crytek_sponza 0.40 was there with all of 256 asked, 0.78 with all of 1,024,
 * and 0.78 with 128 and some drawn of these. The irradiance is the sum over those that it sees, with the flux that
 * they have now, taken anew whenever anything changed, in the time of some rays. So
 *   - light that is dimmed, coloured or switched, and surfaces that are coloured, but for sheets, cost no ray;
 *   - what moved costs a ray for each bit that may have changed: of VPLs that moved, and of those whose segment meets
 *     the box that an object had when the record was last true, or the one that it has now;
 *   - nothing drifts: after any edits a record is bit for bit what it would be if it were built now.
 * Records are brought up to date when somebody looks at them, so that what nobody looks at costs nothing.
 *
 * The diffuse light of an even sky is summed with the rest: its points are VPLs too (vpl/sky.c).
 *
 * Compared with the thesis' instant cache: a bit instead of a colour for each VPL, one test against boxes and one ray
 * instead of the ladder of five cases (NOTES R5), VPLs that are lifted instead of cut off and a gradient in closed
 * form (vpl_sum.h), and a radius by what is around instead of one for the whole scene (proximity.h). */
#include <string.h>

#include "core/cache/cache.h"
#include "core/cache/kind.h"
#include "core/cache/lost.h"
#include "core/cache/proximity.h"
#include "core/cache/since.h"
#include "core/cache/vpl_sum.h"
#include "core/cache/weight.h"
#include "core/math/color.h"
#include "core/trace/rays.h"
#include "core/vpl/gather.h"
#include "core/vpl/lifted.h"
#include "core/vpl/sky.h"

/* What is further away than this share of the scene's radius does not count for how far a record serves: */
#define REACH_MAX 0.25f
/* which is, for accuracy 1, so many distances of lum_proximity (at the default accuracy of 0.2: 0.3 of them), */
#define SERVES_PER_PROXIMITY 1.5f
/* but at least so many pixels, */
#define PIXELS_MIN 4.0f
/* and at most this share of the scene's radius. */
#define SERVES_MAX 0.1f
/* A record whose surroundings moved is let go when they are nearer, or further, than it was made for by this factor. */
#define PROXIMITY_CHANGE 1.5f

/* Paths for each VPL of light from afar; half for others. With 4 for all, of which each slot took the first that was
 * accepted, the indirect light of a first frame differed from draw to draw by 8 % (standard deviation) in crytek_sponza
 * and sponza and 3.5 % in sibenik (nave); now by 4, 5 and 1 %. SMAPE of the whole picture, before and now, of five
 * draws at 300 x 200: office .182, .167, sponza .098, .089, dabrovic_sponza .107, .098, office-media .163, .153,
 * crytek_sponza .192, .187, cornell .0287, .0283; it is 2 % more in desk, conf_lbl_mgf and conference_mcguire. */
#define TRIES 8u

/* VPLs in the set for each that settings ask for, and rays of a record for each of these: three quarters of as many as
 * there would be VPLs without that, of which it draws those that matter to it (lum_vpl_draw). With half as many first
 * frames take 4 to 7 % less time (office, sponza, conference, cornell; 600 x 400), and SMAPE is 2 to 8 % more; what
 * shows is that walls have clouds. With as many it is 4 to 6 % more time for 1 to 3 % less. */
#define SPARE 8u
#define RAYS_PER_VPL 0.75f
/* A record that serves less than so many pixels around looks at half of them, and of the points of the sky at one in 2,
 * one of less than half as many pixels at a quarter, and one in 4: it serves few, and the noise of many small records
 * evens out within a block of the picture. Of VPLs that takes a quarter of the time of all records of a first frame
 * (conf_lbl_mgf, crytek_sponza, conference_mcguire, sponza; 600 x 400); SMAPE is 1.035, 1.001, 1.008 and 1.006 of what
 * it was. Of the sky it takes 60 % of the rays, and 7 and 9 % of the time of a first frame (office, sponza); SMAPE is
 * 1.007 and 1.028 of what it was. */
#define PIXELS_FULL 16.0f

#define WORDS_MAX ((LUM_VPL_SLOTS_MAX + 63u) / 64u) /* a bit for each slot */

struct live_record {
    struct lum_cache_record base;
    float proximity;          /* of lum_proximity */
    float step;               /* of lum_vpl_draw */
    struct lum_around around; /* of lum_proximity */
    uint64_t bits[]; /* n_vpls it sees; n_vpls of which it is known whether it does, and that it faces. Of those that it
                      * sees, what panes leave is in lum_cache_left */
};

static size_t record_bytes(uint32_t n_vpls)
{
    return sizeof(struct live_record) + 2 * lum_vpl_words(n_vpls) * sizeof(uint64_t);
}

static struct live_record *live_of(struct lum_cache_record *record)
{
    return (struct live_record *)(void *)record;
}

static const uint64_t *sees(const struct lum_cache_record *record)
{
    return ((const struct live_record *)(const void *)record)->bits;
}

static struct lum_receiver receiver_of(const struct lum_cache_record *r)
{
    return (struct lum_receiver){r->p, r->n, r->ng};
}

/* ---- which VPLs a record sees ---- */

/* Rays under way, of several records. About 10 KiB: lives on a worker's stack. */
struct seeing {
    const struct lum_cache_job *job;
    struct lum_rays rays;
    struct live_record *record[LUM_RAY_BATCH]; /* by ray */
    uint32_t slot[LUM_RAY_BATCH];
};

static void trace_rays(struct seeing *s)
{
    if (s->rays.n == 0)
        return;
    const struct lum_cache *cache = s->job->cache;
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_rgb left[LUM_RAY_BATCH];
    struct lum_trace trace = lum_trace_of_light(s->job->snapshot, s->job->counters, cache->key.panes);
    lum_trace_light(&trace, &s->rays, occluded, left);
    for (uint32_t i = 0; i < s->rays.n; i++) {
        if (occluded[i])
            continue;
        s->record[i]->bits[s->slot[i] / 64] |= UINT64_C(1) << s->slot[i] % 64;
        if (trace.panes)
            lum_cache_left(cache, &s->record[i]->base)[s->slot[i]] = lum_transmittance_pack(left[i]);
    }
    s->rays.n = 0;
}

static void look(struct seeing *s, struct live_record *r, struct lum_vec3 from, uint32_t slot)
{
    const struct lum_vpl_set *set = &s->job->cache->vpls;
    struct lum_vec3 p = {set->px[slot], set->py[slot], set->pz[slot]};
    struct lum_vec3 end = p; /* in a portal: nothing is there, and what moves is tested against this very segment */
    if (slot < lum_vpl_first_portal(set))
        end = lum_ray_offset(p, lum_v3(set->nx[slot], set->ny[slot], set->nz[slot]));
    struct lum_vec3 d = lum_vpl_segment(set, slot, lum_v3_sub(end, lum_vpl_seen_from(set, slot, from)));
    struct lum_vec3 direct = lum_v3_sub(p, r->base.p);
    bool bounced = slot < set->n_bounced;
    if (bounced && lum_dot(direct, direct) < LUM_VPL_TOUCHING * LUM_VPL_TOUCHING) {
        uint32_t *left = lum_cache_left(s->job->cache, &r->base);
        r->bits[slot / 64] |= UINT64_C(1) << slot % 64;
        if (left)
            left[slot] = 0;
        return;
    }
    if (s->rays.n == LUM_RAY_BATCH)
        trace_rays(s);
    s->job->counters->rays[bounced ? LUM_RAY_INDIRECT_DIFFUSE : LUM_RAY_ENVIRONMENT]++;
    s->record[s->rays.n] = r;
    s->slot[s->rays.n] = slot;
    lum_rays_push(&s->rays, from, d, 1.0f);
}

/* Of the VPLs that a record may look at, and of the sky's, it looks at one in so many. */
static uint32_t one_in(const struct lum_cache_record *r)
{
    float pixels = r->footprint > 0.0f ? LUM_TENT_SERVES * r->radius / r->footprint : PIXELS_FULL;
    return pixels >= PIXELS_FULL ? 1 : pixels >= 0.5f * PIXELS_FULL ? 2 : 4;
}

/* Which VPLs the record looks at. `drawn`: room for lum_vpl_words. */
static void draw(const struct lum_cache *cache, struct live_record *r, uint64_t *ret_drawn)
{
    struct lum_receiver at = receiver_of(&r->base);
    uint32_t of = one_in(&r->base), n = (uint32_t)(RAYS_PER_VPL * (float)cache->key.n_vpls / (float)(SPARE * of));
    r->step = lum_vpl_draw(&cache->vpls, &at, LUM_VPL_LIFT, n > 0 ? n : 1, of, ret_drawn);
}

/* Of 64 VPLs those that were drawn and of which nothing is known: from now on it is. */
static uint64_t take_unknown(const struct lum_vpl_set *set, struct live_record *r, uint32_t word, uint64_t drawn)
{
    uint64_t *sees = r->bits + word, *known = sees + lum_vpl_words(set->n), unknown = drawn & ~*known;
    *sees &= *known & drawn;
    *known = drawn;
    return unknown;
}

/* Records of one neighbourhood, at most LUM_PROXIMITY_POINTS, look at what they do not know: VPL by VPL, so that rays
 * which travel together begin side by side and end at the same one. */
static void look_at_unknown(struct seeing *s, struct live_record *const *records, uint32_t n)
{
    const struct lum_vpl_set *set = &s->job->cache->vpls;
    struct lum_vec3 from[LUM_PROXIMITY_POINTS];
    uint64_t drawn[LUM_PROXIMITY_POINTS][WORDS_MAX];
    for (uint32_t i = 0; i < n; i++) {
        from[i] = lum_ray_offset(records[i]->base.p, records[i]->base.ng);
        draw(s->job->cache, records[i], drawn[i]);
    }
    for (uint32_t w = 0; w < lum_vpl_words(set->n); w++) {
        uint64_t unknown[LUM_PROXIMITY_POINTS], any = 0;
        for (uint32_t i = 0; i < n; i++)
            any |= unknown[i] = take_unknown(set, records[i], w, drawn[i][w]);
        for (; any; any &= any - 1) {
            uint32_t k = (uint32_t)__builtin_ctzll(any);
            for (uint32_t i = 0; i < n; i++)
                if (unknown[i] >> k & 1)
                    look(s, records[i], from[i], 64 * w + k);
        }
    }
}

/* ---- what it adds up to ---- */

/* No further than the gradient is to be trusted: over the radius it changes the irradiance by at most all of it.
 * Along the surface only: what lies before or behind it is another. */
static void limit_gradient(struct lum_cache_record *r)
{
    struct lum_rgb *g = r->gradient;
    struct lum_rgb off =
        lum_rgb_add(lum_rgb_add(lum_rgb_scale(g[0], r->n.x), lum_rgb_scale(g[1], r->n.y)), lum_rgb_scale(g[2], r->n.z));
    g[0] = lum_rgb_mad(g[0], off, -r->n.x);
    g[1] = lum_rgb_mad(g[1], off, -r->n.y);
    g[2] = lum_rgb_mad(g[2], off, -r->n.z);
    float steep = sqrtf(lum_luminance(g[0]) * lum_luminance(g[0]) + lum_luminance(g[1]) * lum_luminance(g[1]) +
                        lum_luminance(g[2]) * lum_luminance(g[2]));
    float most = lum_luminance(r->irradiance);
    if (steep * r->radius > most)
        for (uint32_t i = 0; i < 3; i++)
            g[i] = lum_rgb_scale(g[i], most / (steep * r->radius));
}

/* What it gets none of since VPLs are lifted. */
static void give_back(const struct lum_cache_job *job, const struct lum_cache_record *r, struct lum_vpl_sum *inout)
{
    struct lum_receiver at = receiver_of(r);
    float lacking = lum_vpl_lacking(&job->cache->vpls, &at, &((const struct live_record *)(const void *)r)->around,
                                    job->snapshot, LUM_VPL_LIFT);
    float times = 1.0f / (1.0f - lacking);
    inout->irradiance = lum_rgb_scale(inout->irradiance, times);
    for (uint32_t k = 0; k < 3; k++)
        inout->gradient[k] = lum_rgb_scale(inout->gradient[k], times);
}

static void add_up(const struct lum_cache_job *job, struct lum_cache_record *r)
{
    const struct lum_cache *cache = job->cache;
    bool media = cache->key.media && job->snapshot->n_media > 0;
    struct lum_receiver at = receiver_of(r);
    struct lum_vpl_sum sum;
    lum_vpl_sum_visible(&cache->vpls, &at, live_of(r)->bits, lum_cache_left(cache, r), LUM_VPL_LIFT, live_of(r)->step,
                        one_in(r), job->snapshot, media, &sum);
    give_back(job, r, &sum);
    if (!lum_rgb_finite(sum.irradiance)) {
        job->counters->nonfinite++;
        memset(&sum, 0, sizeof sum);
    }
    r->irradiance = sum.irradiance;
    memcpy(r->gradient, sum.gradient, sizeof r->gradient);
    limit_gradient(r);
    r->epoch = cache->epoch;
}

/* ---- building ---- */

static void set_radius(const struct lum_cache_job *job, struct live_record *r)
{
    float footprint = lum_cache_footprint(job->pixel, job->eye, r->base.p);
    float most = SERVES_MAX * job->snapshot->lights.scene_radius, least = lum_min(PIXELS_MIN * footprint, most);
    float wanted = SERVES_PER_PROXIMITY * job->cache->key.accuracy * r->proximity;
    float serves = lum_max(lum_clamp(wanted, least, most), LUM_RAY_OFFSET);
    r->base.radius = serves / LUM_TENT_SERVES;
    r->base.footprint = wanted < least || serves < PIXELS_FULL * footprint ? footprint : 0.0f;
}

/* How near their surroundings are now, and what is around. */
static void measure(const struct lum_cache_job *job, struct live_record **records, uint32_t n, float *ret_proximity)
{
    struct lum_receiver points[LUM_PROXIMITY_POINTS] = {{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
    struct lum_around around[LUM_PROXIMITY_POINTS];
    for (uint32_t i = 0; i < n; i++)
        points[i] = receiver_of(&records[i]->base);
    lum_proximity(job->snapshot, points, n, REACH_MAX * job->snapshot->lights.scene_radius, job->counters,
                  ret_proximity, around);
    for (uint32_t i = 0; i < n; i++)
        records[i]->around = around[i];
}

static void build(const struct lum_cache_job *job)
{
    struct seeing s;
    s.job = job;
    s.rays.n = 0;
    for (uint32_t first = 0; first < job->n; first += LUM_PROXIMITY_POINTS) {
        uint32_t n = lum_min_u32(job->n - first, LUM_PROXIMITY_POINTS);
        struct live_record *records[LUM_PROXIMITY_POINTS];
        float proximity[LUM_PROXIMITY_POINTS];
        for (uint32_t i = 0; i < n; i++)
            records[i] = live_of(job->records[first + i]);
        measure(job, records, n, proximity);
        for (uint32_t i = 0; i < n; i++) {
            records[i]->proximity = proximity[i];
            set_radius(job, records[i]);
            memset(records[i]->bits, 0, record_bytes(job->cache->vpls.n) - sizeof *records[i]);
        }
        look_at_unknown(&s, records, n);
    }
    trace_rays(&s);
    for (uint32_t i = 0; i < job->n; i++)
        add_up(job, job->records[i]);
}

/* ---- bringing up to date ---- */

/* Forgets what may have changed. */
static void forget(const struct lum_cache *cache, const struct lum_since *since, struct live_record *r)
{
    const uint32_t words = lum_vpl_words(cache->vpls.n);
    uint64_t *sees = r->bits, *known = r->bits + words;
    if (since) {
        for (uint32_t w = 0; w < words; w++)
            known[w] &= ~since->vpls[w];
        lum_since_cross_out(since, &cache->vpls, lum_ray_offset(r->base.p, r->base.ng), known);
    } else {
        memset(known, 0, words * sizeof *known);
    }
    for (uint32_t w = 0; w < words; w++)
        sees[w] &= known[w];
}

/* Lights may have been dimmed since, and surfaces coloured, but who sees whom is as it was. */
static bool is_quiet(const struct lum_cache *cache, const struct lum_since *since)
{
    uint64_t any = since->motion.n > 0 || since->motion.everything;
    for (uint32_t w = 0; w < lum_vpl_words(cache->vpls.n); w++)
        any |= since->vpls[w];
    return any == 0;
}

/* Removes those records whose surroundings are no longer what their radius was made for; n: at most
 * LUM_PROXIMITY_POINTS. Returns how many are left, in front. */
static uint32_t review(const struct lum_cache_job *job, struct live_record **records, uint32_t n)
{
    float proximity[LUM_PROXIMITY_POINTS];
    uint32_t left = 0;
    if (n == 0)
        return 0;
    measure(job, records, n, proximity);
    for (uint32_t i = 0; i < n; i++) {
        float ratio = proximity[i] / records[i]->proximity;
        if (ratio <= PROXIMITY_CHANGE && ratio >= 1.0f / PROXIMITY_CHANGE)
            records[left++] = records[i];
        else if (lum_store_remove(job->cache->store, job->worker, &records[i]->base))
            atomic_fetch_add_explicit(&job->cache->removed, 1, memory_order_relaxed);
    }
    return left;
}

/* What is around it was looked at in a scene of the same size. */
static bool is_to_scale(const struct lum_cache_job *job, const struct live_record *r)
{
    return r->around.scene_radius == job->snapshot->lights.scene_radius;
}

/* True when a ray that told what is around it may meet something else now, or what it met has another number. */
static bool sees_motion(const struct lum_cache_job *job, const struct lum_since *since, const struct live_record *r)
{
    struct lum_receiver at = receiver_of(&r->base);
    struct lum_vec3 ways[LUM_PROXIMITY_RAYS];
    if (!is_to_scale(job, r) || since->motion.renumbers)
        return true;
    if (!lum_since_meets_ball(since, at.p, REACH_MAX * job->snapshot->lights.scene_radius))
        return false;
    for (uint32_t i = 0; i < LUM_PROXIMITY_RAYS; i++)
        ways[i] = lum_proximity_way(&at, &r->around, i);
    return lum_since_meets_segments(since, lum_ray_offset(at.p, at.ng), ways, LUM_PROXIMITY_RAYS);
}

/* Up to LUM_PROXIMITY_POINTS records. */
static void refresh_some(struct seeing *s, struct lum_cache_record *const *records, uint32_t n)
{
    const struct lum_cache *cache = s->job->cache;
    const struct lum_since_ring *ring = cache->kind_state;
    struct live_record *kept[LUM_PROXIMITY_POINTS], *doubtful[LUM_PROXIMITY_POINTS], *around[LUM_PROXIMITY_POINTS];
    float unused[LUM_PROXIMITY_POINTS];
    uint32_t n_kept = 0, n_doubtful = 0, n_around = 0;
    for (uint32_t i = 0; i < n; i++) {
        struct live_record *r = live_of(records[i]);
        const struct lum_since *since = ring ? lum_since(ring, r->base.epoch) : NULL;
        if (since && is_quiet(cache, since) && is_to_scale(s->job, r))
            continue;
        forget(cache, since, r);
        if (!since || lum_since_meets_ball(since, r->base.p, LUM_TENT_SERVES * r->base.radius)) {
            doubtful[n_doubtful++] = r;
        } else {
            kept[n_kept++] = r;
            if (sees_motion(s->job, since, r))
                around[n_around++] = r;
        }
    }
    if (n_around > 0)
        measure(s->job, around, n_around, unused);
    n_doubtful = review(s->job, doubtful, n_doubtful);
    for (uint32_t i = 0; i < n_doubtful; i++)
        kept[n_kept++] = doubtful[i];
    look_at_unknown(s, kept, n_kept);
}

static void refresh(const struct lum_cache_job *job)
{
    struct seeing s;
    s.job = job;
    s.rays.n = 0;
    for (uint32_t first = 0; first < job->n; first += LUM_PROXIMITY_POINTS)
        refresh_some(&s, job->records + first, lum_min_u32(job->n - first, LUM_PROXIMITY_POINTS));
    trace_rays(&s);
    for (uint32_t i = 0; i < job->n; i++) /* nobody will find the removed ones again */
        add_up(job, job->records[i]);
}

/* ---- what changed ---- */

static void remove_movers(struct lum_cache *cache, const struct lum_motion *motion)
{
    if (!cache->store || (motion->n == 0 && !motion->everything))
        return;
    for (uint32_t i = 0; i < lum_store_limit(cache->store); i++) {
        struct lum_cache_record *r = lum_store_at(cache->store, i);
        if (r && lum_motion_carries(motion, r->object, r->p) && lum_store_remove(cache->store, 0, r))
            atomic_fetch_add_explicit(&cache->removed, 1, memory_order_relaxed);
    }
}

/* Without memory for the ring, stale records look at all VPLs again. */
static void change(struct lum_cache *cache, const struct lum_cache_update *update, const struct lum_motion *motion)
{
    (void)update;
    remove_movers(cache, motion);
    if (!cache->kind_state)
        cache->kind_state = lum_since_create(cache->vpls.n);
    if (cache->kind_state)
        lum_since_add(cache->kind_state, cache->epoch, motion, cache->moved);
}

const struct lum_cache_kind lum_cache_live = {
    .name = "live",
    .metric = LUM_METRIC_TENTS,
    .vpls = true,
    .sky = true,
    .tries = TRIES,
    .spare = SPARE,
    .gloss = true,
    .lasting = true,
    .record_bytes = record_bytes,
    .left = true,
    .sees = sees,
    .build = build,
    .refresh = refresh,
    .change = change,
};
