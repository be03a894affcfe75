#include "core/cache/since.h"

#include <string.h>

#include "core/cache/vpl_sum.h"
#include "core/vpl/sky.h"

struct lum_since_ring {
    uint32_t n_vpls;
    uint64_t first, now;                      /* epochs that it knows of; first > now: none */
    struct lum_since since[LUM_SINCE_EPOCHS]; /* of epoch e at e % LUM_SINCE_EPOCHS */
    uint64_t moved[];                         /* of each */
};

struct lum_since_ring *lum_since_create(uint32_t n_vpls)
{
    size_t words = lum_vpl_words(n_vpls);
    struct lum_since_ring *ring = lum_calloc(1, sizeof *ring + LUM_SINCE_EPOCHS * words * sizeof ring->moved[0]);
    if (!ring)
        return NULL;
    ring->n_vpls = n_vpls;
    ring->first = 1;
    for (uint32_t i = 0; i < LUM_SINCE_EPOCHS; i++)
        ring->since[i].vpls = ring->moved + i * words;
    return ring;
}

static struct lum_mover *find_mover(struct lum_motion *motion, uint64_t object)
{
    for (uint32_t i = 0; i < motion->n; i++)
        if (motion->movers[i].n_objects == 1 && motion->movers[i].object == object)
            return &motion->movers[i];
    return NULL;
}

/* The number that an object which did not move has now: objects that come and go move those behind them. */
static uint32_t renumber(const struct lum_motion *motion, uint32_t object)
{
    uint32_t now = object;
    for (uint32_t i = 0; i < motion->n; i++)
        if (motion->movers[i].now == LUM_NO_OBJECT && motion->movers[i].before < object)
            now--;
    for (uint32_t i = 0; i < motion->n; i++) /* in the order of their numbers */
        if (motion->movers[i].before == LUM_NO_OBJECT && motion->movers[i].now <= now)
            now++;
    return now;
}

/* A mover that has been merged moves on as another one: boxes where it was in between meet more than they must. */
static void append_motion(struct lum_motion *all, const struct lum_motion *motion)
{
    all->everything |= motion->everything;
    all->renumbers |= motion->renumbers;
    for (uint32_t i = 0; i < all->n; i++)
        if (all->movers[i].now != LUM_NO_OBJECT && !lum_motion_has(motion, all->movers[i].object))
            all->movers[i].now = renumber(motion, all->movers[i].now);
    for (uint32_t i = 0; i < motion->n && !all->everything; i++) {
        const struct lum_mover *m = &motion->movers[i];
        struct lum_mover *known = m->n_objects == 1 ? find_mover(all, m->object) : NULL;
        if (known) {
            known->now = m->now;
            known->new_box = m->new_box;
        } else {
            lum_motion_add(all, m);
        }
    }
}

static uint64_t *moved_of(struct lum_since_ring *ring, uint64_t epoch)
{
    return ring->moved + epoch % LUM_SINCE_EPOCHS * lum_vpl_words(ring->n_vpls);
}

void lum_since_add(struct lum_since_ring *ring, uint64_t epoch, const struct lum_motion *motion, const uint64_t *moved)
{
    uint32_t words = lum_vpl_words(ring->n_vpls);
    if (ring->first > ring->now || epoch != ring->now + 1) /* nothing is known of what was before */
        ring->first = ring->now = epoch - 1;
    if (epoch - ring->first >= LUM_SINCE_EPOCHS)
        ring->first = epoch - LUM_SINCE_EPOCHS + 1;
    struct lum_since *fresh =
        &ring->since[(epoch - 1) % LUM_SINCE_EPOCHS]; /* nothing yet: this is the first change after it */
    fresh->motion.n = 0;
    fresh->motion.everything = false;
    fresh->motion.renumbers = false;
    memset(moved_of(ring, epoch - 1), 0, words * sizeof *moved);
    for (uint64_t e = ring->first; e < epoch; e++) {
        append_motion(&ring->since[e % LUM_SINCE_EPOCHS].motion, motion);
        lum_motion_enclose(&ring->since[e % LUM_SINCE_EPOCHS].motion);
        uint64_t *bits = moved_of(ring, e);
        for (uint32_t w = 0; w < words; w++)
            bits[w] |= moved[w];
    }
    ring->now = epoch;
}

const struct lum_since *lum_since(const struct lum_since_ring *ring, uint64_t epoch)
{
    return epoch >= ring->first && epoch < ring->now ? &ring->since[epoch % LUM_SINCE_EPOCHS] : NULL;
}

/* ---- boxes ---- */

/* By how much the box around a step may be larger, by surface, than that of what moved: as many segments more are
 * traced, and half as many tested. */
#define STEP_GROWTH 1.2f

struct box {
    struct lum_vec3 middle, half;
};

/* False: there is none. */
static bool box_of(const struct lum_bounds *b, struct box *ret_box)
{
    if (lum_bounds_empty(b))
        return false;
    *ret_box = (struct box){lum_v3_mul(lum_v3_add(b->lo, b->hi), 0.5f), lum_v3_mul(lum_v3_sub(b->hi, b->lo), 0.5f)};
    return true;
}

static float area_of(const struct box *b)
{
    return b->half.x * b->half.y + b->half.y * b->half.z + b->half.z * b->half.x;
}

/* The boxes of a mover: before and now; after a small step the one around both, which is hardly larger. */
static uint32_t boxes_of(const struct lum_mover *m, struct box ret_boxes[2])
{
    uint32_t n = box_of(&m->old_box, &ret_boxes[0]);
    n += box_of(&m->new_box, &ret_boxes[n]);
    if (n < 2)
        return n;
    struct box both;
    struct lum_bounds around = lum_bounds_join(&m->old_box, &m->new_box);
    box_of(&around, &both);
    if (area_of(&both) > STEP_GROWTH * lum_max(area_of(&ret_boxes[0]), area_of(&ret_boxes[1])))
        return 2;
    ret_boxes[0] = both;
    return 1;
}

/* A segment against a box, by separating axes (Gottschalk 1996): the box's own three, and those across the segment and
 * an edge. No division; what is rounded is far below the padding of the boxes. c: from the box's middle to the
 * segment's; x, y, z: half the segment; e: half the box. */
static inline uint32_t meets(float cx, float cy, float cz, float x, float y, float z, struct lum_vec3 e)
{
    float ax = fabsf(x), ay = fabsf(y), az = fabsf(z);
    return (uint32_t)(fabsf(cx) <= e.x + ax) & (uint32_t)(fabsf(cy) <= e.y + ay) & (uint32_t)(fabsf(cz) <= e.z + az) &
           (uint32_t)(fabsf(cy * z - cz * y) <= e.y * az + e.z * ay) &
           (uint32_t)(fabsf(cz * x - cx * z) <= e.z * ax + e.x * az) &
           (uint32_t)(fabsf(cx * y - cy * x) <= e.x * ay + e.y * ax);
}

/* Segments from one point to the VPLs k .. k + LUM_LANES - 1, as bits. */
static uint32_t segments_meet(const struct lum_vpl_set *set, uint32_t k, struct lum_vec3 from, const struct box *box)
{
    const struct lum_vec3 o = lum_v3_sub(from, box->middle), s = lum_vpl_seen_from(set, k, from), e = box->half;
    const float *px = set->px + k, *py = set->py + k, *pz = set->pz + k;
    const bool portals = k >= lum_vpl_first_portal(set);
    uint32_t met = 0;
    for (uint32_t i = 0; i < LUM_LANES; i++) {
        float x = px[i] - s.x, y = py[i] - s.y, z = pz[i] - s.z;
        float half = 0.5f * (portals ? LUM_VPL_FAR / sqrtf(x * x + y * y + z * z) : 1.0f);
        x *= half, y *= half, z *= half;
        met |= meets(o.x + x, o.y + y, o.z + z, x, y, z, e) ? lum_lane_bit[i] : 0u;
    }
    return met;
}

/* Those of a word of bits whose segments meet the box. */
static uint64_t find_meeting(const struct lum_vpl_set *set, uint32_t word, struct lum_vec3 from, const struct box *box,
                             uint64_t bits)
{
    const uint64_t group = (UINT64_C(1) << LUM_LANES) - 1u;
    uint64_t met = 0;
    for (uint32_t i = 0; i < 64; i += LUM_LANES)
        if (bits >> i & group)
            met |= (uint64_t)segments_meet(set, word * 64 + i, from, box) << i;
    return met & bits;
}

/* Segments picked out, to be tested against many boxes: their middles, and halves of the way from end to end. */
#define PICKED_MAX 64u

struct picked {
    uint32_t n, slot[PICKED_MAX];
    float mx[PICKED_MAX], my[PICKED_MAX], mz[PICKED_MAX], x[PICKED_MAX], y[PICKED_MAX], z[PICKED_MAX];
};

static void pick(struct picked *p, const struct lum_vpl_set *set, struct lum_vec3 from, uint32_t slot)
{
    struct lum_vec3 s = lum_vpl_seen_from(set, slot - slot % LUM_LANES, from);
    struct lum_vec3 place = {set->px[slot], set->py[slot], set->pz[slot]};
    struct lum_vec3 way = lum_vpl_segment(set, slot, lum_v3_sub(place, s));
    uint32_t i = p->n++;
    p->slot[i] = slot;
    p->x[i] = 0.5f * way.x;
    p->y[i] = 0.5f * way.y;
    p->z[i] = 0.5f * way.z;
    p->mx[i] = from.x + p->x[i];
    p->my[i] = from.y + p->y[i];
    p->mz[i] = from.z + p->z[i];
}

static void meet_box(const struct picked *p, const struct box *box, uint32_t *inout_meets)
{
    const struct lum_vec3 e = box->half, b = box->middle;
    for (uint32_t i = 0; i < p->n; i++)
        inout_meets[i] |= meets(p->mx[i] - b.x, p->my[i] - b.y, p->mz[i] - b.z, p->x[i], p->y[i], p->z[i], e);
}

/* Takes those out of inout_bits that meet a mover, and forgets them all. */
static void cross_out_picked(const struct lum_motion *motion, struct picked *p, uint64_t *inout_bits)
{
    uint32_t met[PICKED_MAX] = {0};
    struct box boxes[2];
    for (uint32_t m = 0; m < motion->n; m++) {
        uint32_t n_boxes = boxes_of(&motion->movers[m], boxes);
        for (uint32_t b = 0; b < n_boxes; b++)
            meet_box(p, &boxes[b], met);
    }
    for (uint32_t i = 0; i < p->n; i++)
        inout_bits[p->slot[i] / 64] &= ~((uint64_t)met[i] << p->slot[i] % 64);
    p->n = 0;
}

/* An object of many parts moves as one, as a rule: few segments meet the box around all, and only those are tested
 * against each. */
void lum_since_cross_out(const struct lum_since *since, const struct lum_vpl_set *set, struct lum_vec3 from,
                         uint64_t *inout_bits)
{
    const struct lum_motion *motion = &since->motion;
    const uint32_t words = lum_vpl_words(set->n);
    struct box around, alone[2];
    if (motion->everything)
        memset(inout_bits, 0, words * sizeof *inout_bits);
    if (motion->everything || !box_of(&motion->around, &around))
        return;
    bool one = motion->n == 1 && boxes_of(&motion->movers[0], alone) == 1; /* it is the one around all */
    struct picked p;
    p.n = 0;
    for (uint32_t w = 0; w < words; w++) {
        uint64_t near = find_meeting(set, w, from, &around, inout_bits[w]);
        if (one)
            inout_bits[w] &= ~near;
        for (; near && !one; near &= near - 1) {
            pick(&p, set, from, w * 64 + (uint32_t)__builtin_ctzll(near));
            if (p.n == PICKED_MAX)
                cross_out_picked(motion, &p, inout_bits);
        }
    }
    cross_out_picked(motion, &p, inout_bits);
}

bool lum_since_meets_ball(const struct lum_since *since, struct lum_vec3 middle, float radius)
{
    for (uint32_t m = 0; m < since->motion.n; m++) {
        struct box boxes[2];
        uint32_t n_boxes = boxes_of(&since->motion.movers[m], boxes);
        for (uint32_t b = 0; b < n_boxes; b++) {
            struct lum_vec3 d = lum_v3_sub(middle, boxes[b].middle), e = boxes[b].half;
            d = lum_v3_max(lum_v3_sub(lum_v3_abs(d), e), lum_v3(0.0f, 0.0f, 0.0f));
            if (lum_dot(d, d) <= radius * radius)
                return true;
        }
    }
    return since->motion.everything;
}

bool lum_since_meets_segments(const struct lum_since *since, struct lum_vec3 from, const struct lum_vec3 *ways,
                              uint32_t n)
{
    for (uint32_t m = 0; m < since->motion.n; m++) {
        struct box boxes[2];
        uint32_t n_boxes = boxes_of(&since->motion.movers[m], boxes);
        for (uint32_t b = 0; b < n_boxes; b++)
            for (uint32_t i = 0; i < n; i++) {
                struct lum_vec3 half = lum_v3_mul(ways[i], 0.5f);
                struct lum_vec3 c = lum_v3_sub(lum_v3_add(from, half), boxes[b].middle);
                if (meets(c.x, c.y, c.z, half.x, half.y, half.z, boxes[b].half))
                    return true;
            }
    }
    return since->motion.everything;
}
