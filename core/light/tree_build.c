/* The tree of lights is built from the root down: a node's leaves are split where the cost of both sides is least, flux
 * by the solid angle that it goes to by the size of the box (Conty Estevez and Kulla 2018), until there are as many
 * groups as a node has sides. */
#include "core/light/tree.h"

#include <math.h>
#include <string.h>

#include "core/accel/accel.h"
#include "core/base/base.h"
#include "core/light/light.h"

/* ---- what several lights have in common ---- */

static float angle_between(struct lum_vec3 a, struct lum_vec3 b)
{
    return acosf(lum_clamp(lum_dot(a, b), -1.0f, 1.0f));
}

/* Smallest cone around two; where it is nearly all around, all around. */
static void join_cones(struct lum_light_reach *a, const struct lum_light_reach *b)
{
    float ha = acosf(a->cos_faced), hb = acosf(b->cos_faced), between = angle_between(a->axis, b->axis);
    if (between + hb <= ha)
        return;
    if (between + ha <= hb) {
        a->axis = b->axis;
        a->cos_faced = b->cos_faced;
        return;
    }
    float half = 0.5f * (ha + hb + between);
    struct lum_vec3 side = lum_v3_sub(b->axis, lum_v3_mul(a->axis, lum_dot(a->axis, b->axis)));
    float length = lum_length(side);
    if (half >= LUM_PI || !(length > 1e-4f)) {
        a->cos_faced = -1.0f;
        return;
    }
    float turn = half - ha;
    a->axis = lum_normalize(lum_v3_mad(lum_v3_mul(a->axis, cosf(turn)), side, sinf(turn) / length));
    a->cos_faced = cosf(half);
}

/* ---- building ---- */

#define BUCKETS 12u     /* places where a group may be parted: more find a cheaper one, and take longer to build */
#define MEDIAN_FROM 16u /* depth from which lights are halved by number, however they lie */

struct leaf {
    struct lum_light_reach reach;
    uint32_t light;
};

/* Leaves from..to, together: reach is without the sphere. */
struct group {
    struct lum_light_reach reach;
    struct lum_vec3 lo, hi; /* box around their spheres */
    uint32_t from, to;
};

struct builder {
    struct lum_light_tree *tree;
    struct leaf *leaf; /* in an order that building changes */
};

static struct group leaf_group(const struct builder *b, uint32_t at)
{
    const struct lum_light_reach *r = &b->leaf[at].reach;
    struct lum_vec3 half = lum_v3(r->radius, r->radius, r->radius);
    return (struct group){*r, lum_v3_sub(r->centre, half), lum_v3_add(r->centre, half), at, at + 1};
}

/* Those of g come right after those that are there, or elsewhere where only their number matters. */
static void add_to(struct group *all, const struct group *g)
{
    if (g->from == g->to)
        return;
    if (all->from == all->to) {
        *all = *g;
        return;
    }
    join_cones(&all->reach, &g->reach);
    all->reach.cos_end = lum_min(all->reach.cos_end, g->reach.cos_end);
    all->reach.both_sides = all->reach.both_sides || g->reach.both_sides;
    all->reach.intensity += g->reach.intensity;
    all->lo = lum_v3_min(all->lo, g->lo);
    all->hi = lum_v3_max(all->hi, g->hi);
    all->to += g->to - g->from;
}

static struct group group_of(const struct builder *b, uint32_t from, uint32_t to)
{
    struct group all = {.from = from, .to = from};
    for (uint32_t i = from; i < to; i++) {
        struct group one = leaf_group(b, i);
        add_to(&all, &one);
    }
    return all;
}

/* Steradians that it shines into, each counted by how much: Conty Estevez and Kulla, equation 1. */
static float spread_of(const struct lum_light_reach *r)
{
    float faced = acosf(r->cos_faced), end = lum_min(faced + acosf(r->cos_end), LUM_PI);
    float fading = 2.0f * end * sinf(faced) - cosf(faced - 2.0f * end) - 2.0f * faced * sinf(faced) + cosf(faced);
    return 2.0f * LUM_PI * (1.0f - r->cos_faced) + 0.5f * LUM_PI * fading;
}

static float cost_of(const struct group *g)
{
    struct lum_vec3 d = lum_v3_sub(g->hi, g->lo);
    return g->from < g->to ? g->reach.intensity * spread_of(&g->reach) * lum_dot(d, d) : 0.0f;
}

static float coordinate(const struct leaf *leaf, int axis)
{
    const struct lum_vec3 *c = &leaf->reach.centre;
    return axis == 0 ? c->x : axis == 1 ? c->y : c->z;
}

static uint32_t bucket_of(const struct leaf *leaf, int axis, float low, float size)
{
    float x = (coordinate(leaf, axis) - low) / size * (float)BUCKETS;
    return x < (float)BUCKETS ? (uint32_t)x : BUCKETS - 1;
}

/* The boundary between buckets with the least cost on both sides; 0: all would be on one side. */
static uint32_t best_boundary(const struct builder *b, const struct group *g, int axis, float low, float size)
{
    struct group buckets[BUCKETS] = {0};
    for (uint32_t i = g->from; i < g->to; i++) {
        struct group one = leaf_group(b, i);
        add_to(&buckets[bucket_of(&b->leaf[i], axis, low, size)], &one);
    }
    float least = INFINITY;
    uint32_t best = 0;
    for (uint32_t k = 1; k < BUCKETS; k++) {
        struct group sides[2] = {0};
        for (uint32_t j = 0; j < BUCKETS; j++)
            add_to(&sides[j >= k], &buckets[j]);
        bool both = sides[0].from < sides[0].to && sides[1].from < sides[1].to;
        float cost = cost_of(&sides[0]) + cost_of(&sides[1]);
        if (both && (cost < least || best == 0)) {
            least = cost;
            best = k;
        }
    }
    return best;
}

/* Those of buckets below the boundary first; returns where the others begin. */
static uint32_t part_by(const struct builder *b, const struct group *g, int axis, float low, float size,
                        uint32_t boundary)
{
    uint32_t at = g->from;
    for (uint32_t i = g->from; i < g->to; i++) {
        if (bucket_of(&b->leaf[i], axis, low, size) >= boundary)
            continue;
        struct leaf swap = b->leaf[i];
        b->leaf[i] = b->leaf[at];
        b->leaf[at++] = swap;
    }
    return at;
}

/* Along the axis that their centres spread most; where the second half begins. */
static uint32_t split(const struct builder *b, const struct group *g, uint32_t depth)
{
    float low = 0.0f, size = 0.0f;
    int widest = 0;
    for (int axis = 0; axis < 3; axis++) {
        float from = INFINITY, to = -INFINITY;
        for (uint32_t i = g->from; i < g->to; i++) {
            from = lum_min(from, coordinate(&b->leaf[i], axis));
            to = lum_max(to, coordinate(&b->leaf[i], axis));
        }
        if (to - from > size) {
            widest = axis;
            low = from;
            size = to - from;
        }
    }
    bool sorted = depth < MEDIAN_FROM && size > 0.0f;
    uint32_t best = sorted ? best_boundary(b, g, widest, low, size) : 0;
    return best ? part_by(b, g, widest, low, size, best) : g->from + (g->to - g->from) / 2;
}

/* As many groups as a node has sides: the costliest is split until there are. */
static uint32_t split_up(const struct builder *b, struct group ret[LUM_LIGHT_SIDES], uint32_t depth)
{
    uint32_t n = 1;
    while (n < LUM_LIGHT_SIDES) {
        uint32_t at = LUM_LIGHT_SIDES;
        for (uint32_t k = 0; k < n; k++)
            if (ret[k].to - ret[k].from > 1 && (at == LUM_LIGHT_SIDES || cost_of(&ret[k]) > cost_of(&ret[at])))
                at = k;
        if (at == LUM_LIGHT_SIDES)
            break;
        uint32_t from = ret[at].from, to = ret[at].to, middle = split(b, &ret[at], depth);
        ret[at] = group_of(b, from, middle);
        ret[n++] = group_of(b, middle, to);
    }
    return n;
}

static void put(struct lum_light_node *node, uint32_t k, const struct group *g)
{
    const struct lum_light_reach *r = &g->reach;
    struct lum_vec3 centre = r->centre, across = lum_v3_sub(g->hi, g->lo);
    float radius = r->radius;
    if (g->to - g->from > 1) {
        centre = lum_v3_mul(lum_v3_add(g->lo, g->hi), 0.5f);
        radius = 0.5f * lum_length(across) * (1.0f + 0x1p-20f); /* rounding must leave nothing outside */
    }
    node->centre[0][k] = centre.x, node->centre[1][k] = centre.y, node->centre[2][k] = centre.z;
    node->radius2[k] = radius * radius;
    node->axis[0][k] = r->axis.x, node->axis[1][k] = r->axis.y, node->axis[2][k] = r->axis.z;
    node->cos_faced[k] = r->cos_faced;
    node->sin_faced[k] = sqrtf(lum_max(1.0f - r->cos_faced * r->cos_faced, 0.0f));
    node->cos_end[k] = r->cos_end;
    node->both_sides[k] = r->both_sides ? 1.0f : 0.0f;
}

/* Makes node `index`, and those below. */
static void build_node(const struct builder *b, uint32_t index, const struct group *all, uint32_t depth)
{
    struct lum_light_tree *tree = b->tree;
    struct group sides[LUM_LIGHT_SIDES] = {*all};
    uint32_t n = split_up(b, sides, depth);
    for (uint32_t k = 0; k < LUM_LIGHT_SIDES; k++) { /* no division by 0 where there is none */
        tree->nodes[index].radius2[k] = 1.0f;
        tree->nodes[index].light[k] = LUM_NO_OBJECT;
    }
    for (uint32_t k = 0; k < n; k++) {
        put(&tree->nodes[index], k, &sides[k]);
        if (sides[k].to - sides[k].from == 1) {
            uint32_t light = b->leaf[sides[k].from].light;
            tree->nodes[index].light[k] = light;
            tree->leaf_of[light] = index * LUM_LIGHT_SIDES + k;
            continue;
        }
        uint32_t child = tree->nodes[index].child[k] = tree->n_nodes++;
        tree->nodes[child].parent = index;
        tree->nodes[child].side = k;
        build_node(b, child, &sides[k], depth + 1);
    }
}

static bool allocate(struct lum_light_tree *tree, uint32_t n_lights, uint32_t n_nodes)
{
    *tree = (struct lum_light_tree){.n_lights = n_lights};
    tree->nodes = lum_calloc((size_t)n_nodes + 1, sizeof *tree->nodes);
    tree->leaf_of = lum_calloc((size_t)n_lights + 1, sizeof *tree->leaf_of);
    tree->unit = lum_calloc((size_t)n_lights + 1, sizeof *tree->unit);
    if (tree->nodes && tree->leaf_of && tree->unit)
        return true;
    lum_light_tree_finish(tree);
    return false;
}

bool lum_light_tree_build(struct lum_light_tree *tree, const struct lum_light_reach *reach, uint32_t n)
{
    struct leaf *leaf = lum_calloc((size_t)n + 1, sizeof *leaf);
    if (!leaf || !allocate(tree, n, n)) {
        lum_free(leaf);
        return false;
    }
    struct builder b = {tree, leaf};
    uint32_t n_leaves = 0;
    for (uint32_t i = 0; i < n; i++) {
        tree->leaf_of[i] = LUM_NO_OBJECT;
        if (!lum_v3_finite(reach[i].centre) || !isfinite(reach[i].radius) || !isfinite(reach[i].intensity))
            continue;
        leaf[n_leaves] = (struct leaf){reach[i], i};
        struct lum_light_reach *r = &leaf[n_leaves++].reach;
        r->radius = lum_max(r->radius * (1.0f + 0x1p-20f), LUM_POINT_LIGHT_NEAR);
        tree->unit[i] = r->intensity;
    }
    if (n_leaves > 1) {
        struct group all = group_of(&b, 0, n_leaves);
        tree->n_nodes = 1;
        build_node(&b, 0, &all, 0);
    }
    lum_free(leaf);
    return true;
}

void lum_light_tree_brighten(struct lum_light_tree *tree, const struct lum_light *lights, const float *shines)
{
    for (uint32_t i = tree->n_nodes; i-- > 0;) {
        struct lum_light_node *node = &tree->nodes[i];
        for (uint32_t k = 0; k < LUM_LIGHT_SIDES; k++) {
            uint32_t light = node->light[k];
            node->intensity[k] = 0.0f;
            for (uint32_t j = 0; node->child[k] && j < LUM_LIGHT_SIDES; j++)
                node->intensity[k] += tree->nodes[node->child[k]].intensity[j];
            if (light != LUM_NO_OBJECT && shines[light] > 0.0f)
                node->intensity[k] = tree->unit[light] * lum_luminance(lights[light].power);
        }
    }
}

bool lum_light_tree_copy(struct lum_light_tree *tree, const struct lum_light_tree *from)
{
    if (!allocate(tree, from->n_lights, from->n_nodes))
        return false;
    tree->n_nodes = from->n_nodes;
    memcpy(tree->nodes, from->nodes, from->n_nodes * sizeof *tree->nodes);
    if (from->n_lights) {
        memcpy(tree->leaf_of, from->leaf_of, from->n_lights * sizeof *tree->leaf_of);
        memcpy(tree->unit, from->unit, from->n_lights * sizeof *tree->unit);
    }
    return true;
}

bool lum_light_tree_same(const struct lum_light_tree *a, const struct lum_light_tree *b)
{
    size_t n_leaves = a->n_lights * sizeof *a->leaf_of, n_units = a->n_lights * sizeof *a->unit;
    if (a->n_nodes != b->n_nodes || a->n_lights != b->n_lights)
        return false;
    return (a->n_nodes == 0 || memcmp(a->nodes, b->nodes, a->n_nodes * sizeof *a->nodes) == 0) &&
           (a->n_lights == 0 ||
            (memcmp(a->leaf_of, b->leaf_of, n_leaves) == 0 && memcmp(a->unit, b->unit, n_units) == 0));
}

void lum_light_tree_finish(struct lum_light_tree *tree)
{
    lum_free(tree->nodes);
    lum_free(tree->leaf_of);
    lum_free(tree->unit);
    *tree = (struct lum_light_tree){0};
}
