#include "core/cache/octree.h"

#include <assert.h>
#include <string.h>

/* ---- memory ---- */

/* Allocated at a time: nodes and pages, of 256 and 192 bytes, are cut from it. */
enum { BLOCK_BYTES = 1 << 16 };

struct lum_octree_block {
    struct lum_octree_block *next;
    size_t used; /* bytes of data that are not zero any more */
    _Alignas(LUM_CACHE_LINE) unsigned char data[BLOCK_BYTES - LUM_CACHE_LINE];
};
static_assert(sizeof(struct lum_octree_block) == BLOCK_BYTES, "a block is as large as it says");
static_assert(sizeof(struct lum_octree_page) == 3 * LUM_CACHE_LINE, "octree.h says so");
static_assert(sizeof(struct lum_octree_node) == 4 * LUM_CACHE_LINE, "a page and the children");

/* Blocks after the current one were used before the arena was rewound. */
static bool next_block(struct lum_octree_arena *a)
{
    struct lum_octree_block *next = a->current ? a->current->next : a->first;
    if (next) {
        memset(next->data, 0, next->used);
        next->used = 0;
    } else {
        next = lum_calloc(1, sizeof *next);
        if (!next)
            return false;
        a->bytes += sizeof *next;
        if (a->current)
            a->current->next = next;
        else
            a->first = next;
    }
    a->current = next;
    return true;
}

static void *arena_new(struct lum_octree_arena *a, size_t bytes)
{
    if ((!a->current || a->current->used + bytes > sizeof a->current->data) && !next_block(a))
        return NULL;
    void *p = a->current->data + a->current->used;
    a->current->used += bytes;
    return p;
}

struct lum_octree_node *lum_octree_node_new(struct lum_octree_arena *arena)
{
    struct lum_octree_node *spare = arena->spare_node;
    arena->spare_node = NULL;
    return spare ? spare : arena_new(arena, sizeof *spare);
}

static struct lum_octree_page *page_new(struct lum_octree_arena *arena)
{
    struct lum_octree_page *spare = arena->spare_page;
    arena->spare_page = NULL;
    return spare ? spare : arena_new(arena, sizeof *spare);
}

void lum_octree_arena_rewind(struct lum_octree_arena *arena)
{
    arena->current = NULL;
    arena->spare_node = NULL;
    arena->spare_page = NULL;
}

void lum_octree_arena_finish(struct lum_octree_arena *arena)
{
    for (struct lum_octree_block *b = arena->first, *next; b; b = next) {
        next = b->next;
        lum_free(b);
    }
    *arena = (struct lum_octree_arena){0};
}

/* ---- cells ---- */

/* The side is a power of two, at least 1/16 of the largest coordinate, and the corner lies on multiples of a sixteenth
 * of it. So the centre of a cell LUM_OCTREE_DEPTH = 16 levels down is a multiple of side / 2^17, less than 18 side: 22
 * bits, exact. */
struct lum_octree_cell lum_octree_root_cell(struct lum_vec3 lo, struct lum_vec3 hi)
{
    float extent = lum_v3_largest(lum_v3_sub(hi, lo));
    float far_off = lum_max(lum_v3_largest(lum_v3_abs(lo)), lum_v3_largest(lum_v3_abs(hi)));
    float side = 0x1p-32f;
    while (side * 0.9375f < extent || side * 16.0f < far_off) /* the corner moves down by up to side / 16 */
        side *= 2.0f;
    float step = side / 16.0f, half = side / 2.0f;
    struct lum_vec3 corner = {floorf(lo.x / step) * step, floorf(lo.y / step) * step, floorf(lo.z / step) * step};
    return (struct lum_octree_cell){lum_v3_add(corner, lum_v3(half, half, half)), half};
}

static bool cell_holds(const struct lum_octree_cell *c, struct lum_vec3 p)
{
    struct lum_vec3 d = lum_v3_abs(lum_v3_sub(p, c->centre));
    return d.x <= c->half && d.y <= c->half && d.z <= c->half;
}

static uint32_t octant_of(const struct lum_octree_cell *c, struct lum_vec3 p)
{
    return (p.x >= c->centre.x ? 1u : 0u) | (p.y >= c->centre.y ? 2u : 0u) | (p.z >= c->centre.z ? 4u : 0u);
}

static struct lum_octree_cell child_cell(const struct lum_octree_cell *c, uint32_t octant)
{
    float half = c->half * 0.5f;
    struct lum_vec3 shift = {octant & 1u ? half : -half, octant & 2u ? half : -half, octant & 4u ? half : -half};
    return (struct lum_octree_cell){lum_v3_add(c->centre, shift), half};
}

/* ---- insertion ---- */

/* The child in an octant, made if need be. Whoever loses the race to attach it goes on in the winner's. Who comes by
 * sets the bits of the word that it needs and does not see, whoever made the child: what it publishes below must not be
 * overlooked. */
static struct lum_octree_node *child_at(struct lum_octree_node *node, uint32_t octant, uint64_t bits,
                                        struct lum_octree_insertion *in)
{
    struct lum_octree_node *child = atomic_load_explicit(&node->child[octant], memory_order_acquire);
    if (!child) {
        struct lum_octree_node *fresh = lum_octree_node_new(in->arena);
        if (!fresh)
            return NULL;
        if (atomic_compare_exchange_strong_explicit(&node->child[octant], &child, fresh, memory_order_acq_rel,
                                                    memory_order_acquire)) {
            child = fresh;
        } else {
            in->arena->spare_node = fresh;
            in->contended++;
        }
    }
    if (bits & ~atomic_load_explicit(&node->page.word, memory_order_acquire))
        atomic_fetch_or_explicit(&node->page.word, bits, memory_order_release);
    return child;
}

/* Records outside of the root's cube, or larger than it, stay in the root, which every search looks through. The margin
 * is for the roundings of the search (can_reach). */
static struct lum_octree_node *node_for(struct lum_octree_node *root, struct lum_octree_insertion *in)
{
    struct lum_octree_cell cell = *in->cell;
    const struct lum_octree_entry *e = &in->entry;
    if (!cell_holds(&cell, e->p))
        return root;
    float reach = e->radius * (1.0f + 0x1p-20f);
    struct lum_octree_node *node = root;
    for (uint32_t depth = 1; node && depth <= LUM_OCTREE_DEPTH && reach <= cell.half * 0.5f; depth++) {
        uint32_t octant = octant_of(&cell, e->p);
        bool here = depth == LUM_OCTREE_DEPTH || reach > cell.half * 0.25f;
        node = child_at(node, octant, here ? LUM_CHILD_HOLDS(octant) : LUM_CHILD_DEEPER(octant), in);
        cell = child_cell(&cell, octant);
    }
    return node;
}

static struct lum_octree_page *page_after(struct lum_octree_page *page, struct lum_octree_insertion *in)
{
    struct lum_octree_page *next = atomic_load_explicit(&page->next, memory_order_acquire);
    if (next)
        return next;
    struct lum_octree_page *fresh = page_new(in->arena);
    if (!fresh)
        return NULL;
    if (atomic_compare_exchange_strong_explicit(&page->next, &next, fresh, memory_order_acq_rel, memory_order_acquire))
        return fresh;
    in->arena->spare_page = fresh;
    in->contended++;
    return next;
}

/* At most one try per lane: one that was seen free and is not was claimed by another. */
static bool claim_lane(struct lum_octree_page *page, uint32_t *ret_lane)
{
    uint32_t seen_free = ~(uint32_t)atomic_load_explicit(&page->word, memory_order_relaxed) & 0xffu;
    for (; seen_free; seen_free &= seen_free - 1) {
        uint32_t lane = (uint32_t)__builtin_ctz(seen_free);
        uint64_t before = atomic_fetch_or_explicit(&page->word, LUM_LANE_CLAIMED(lane), memory_order_relaxed);
        if (!(before & LUM_LANE_CLAIMED(lane))) {
            *ret_lane = lane;
            return true;
        }
    }
    return false;
}

bool lum_octree_reserve(struct lum_octree_node *root, struct lum_octree_insertion *in)
{
    struct lum_octree_node *node = node_for(root, in);
    struct lum_octree_page *page = node ? &node->page : NULL;
    uint32_t lane = 0;
    while (page && !claim_lane(page, &lane))
        page = page_after(page, in);
    if (!page)
        return false;
    const struct lum_octree_entry *e = &in->entry;
    page->index[lane] = e->index;
    page->x[lane] = e->p.x;
    page->y[lane] = e->p.y;
    page->z[lane] = e->p.z;
    page->r2[lane] = e->radius * e->radius;
    in->place = (struct lum_place){page, lane};
    return true;
}

/* ---- search ---- */

/* Distance along one axis between a coordinate and an interval. */
static float gap(float lo, float hi, float x)
{
    return lum_max(lum_max(lo - x, x - hi), 0.0f);
}

static void take_lanes(const struct lum_octree_page *page, uint32_t lanes, struct lum_octree_query *q)
{
    for (; lanes; lanes &= lanes - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(lanes);
        float dx = gap(q->lo.x, q->hi.x, page->x[i]);
        float dy = gap(q->lo.y, q->hi.y, page->y[i]);
        float dz = gap(q->lo.z, q->hi.z, page->z[i]);
        if (!(dx * dx + dy * dy + dz * dz < page->r2[i]))
            continue;
        if (q->n < q->max)
            q->records[q->n] = lum_slab_at(q->slab, page->index[i]);
        q->n++;
    }
}

/* The three axes at once (a vector extension of GCC and clang, for any processor). The fourth lane is not used. */
typedef float float4 __attribute__((vector_size(16)));
typedef int32_t int4 __attribute__((vector_size(16)));

/* Bits of the children whose cell, grown by reach, meets lo .. hi. after: lo - centre; before: centre - hi; half: of
 * the children's side. A record q of the lower child of an axis has centre - 2 half <= q <= centre, exactly, and a gap
 * to the interval of at most its radius times 1 + 2^-22 if its rounded squares say that it serves; that is at most
 * reach (node_for). So lo - centre <= reach and centre - hi <= 2 half + reach hold for the exact numbers, and then also
 * for the rounded differences: rounding is monotonic, and the right sides are exact. Without branches: which children
 * serve cannot be predicted. */
static inline uint32_t can_reach(float4 after, float4 before, float half, float reach)
{
    const int4 lower_children = {0x55, 0x33, 0x0f, 0xff}, upper_children = {0xaa, 0xcc, 0xf0, 0xff};
    float far = 2.0f * half + reach;
    int4 lower = (after <= reach) & (before <= far);
    int4 upper = (before <= reach) & (after <= far);
    int4 m = (lower & lower_children) | (upper & upper_children);
    return (uint32_t)(m[0] & m[1] & m[2]);
}

/* A page and those after it; word: the first one's. */
static void look_through(const struct lum_octree_page *page, uint64_t word, struct lum_octree_query *q)
{
    for (;;) {
        take_lanes(page, (uint32_t)(word >> 8 & ~(word >> 16)) & 0xffu, q);
        page = atomic_load_explicit(&page->next, memory_order_acquire);
        if (!page)
            return;
        word = atomic_load_explicit(&page->word, memory_order_acquire);
    }
}

struct visit {
    float4 centre;
    const struct lum_octree_node *node;
    float half; /* of the children's side */
};

static float4 vector_of(struct lum_vec3 v)
{
    return (float4){v.x, v.y, v.z, 0.0f};
}

void lum_octree_search(const struct lum_octree_node *root, struct lum_octree_query *q)
{
    static const float4 direction[8] = {{-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}, {1, 1, -1},
                                        {-1, -1, 1},  {1, -1, 1},  {-1, 1, 1},  {1, 1, 1}};
    const float4 lo = vector_of(q->lo), hi = vector_of(q->hi);
    struct visit stack[7 * LUM_OCTREE_DEPTH + 1]; /* each level leaves at most 7 behind */
    uint32_t n = 0;
    stack[n++] = (struct visit){vector_of(q->cell->centre), root, q->cell->half * 0.5f};
    while (n > 0) {
        struct visit v = stack[--n];
        uint64_t word = atomic_load_explicit(&v.node->page.word, memory_order_acquire);
        look_through(&v.node->page, word, q);
        uint32_t holds = (uint32_t)(word >> 32) & 0xffu, deeper = (uint32_t)(word >> 24) & 0xffu;
        if (!(holds | deeper))
            continue;
        uint32_t children = (holds & can_reach(lo - v.centre, v.centre - hi, v.half, v.half)) |
                            (deeper & can_reach(lo - v.centre, v.centre - hi, v.half, v.half * 0.5f));
        for (; children; children &= children - 1) {
            uint32_t octant = (uint32_t)__builtin_ctz(children);
            const struct lum_octree_node *child = atomic_load_explicit(&v.node->child[octant], memory_order_acquire);
            stack[n++] = (struct visit){v.centre + direction[octant] * v.half, child, v.half * 0.5f};
        }
    }
}
