#include "core/light/tree.h"

#include <math.h>

#include "core/accel/accel.h"
#include "core/light/light.h"

/* ---- how much comes from a side of a node at most ---- */

/* A group nearer than so many of its radii, squared, is looked at part by part: one that is all around a place, or
 * before and behind it, says little of what it brings. NOTES has what other distances do. */
#define NEAR2 (3.0f * 3.0f)

struct brought {
    float most[LUM_LIGHT_SIDES];
    float near[LUM_LIGHT_SIDES]; /* 1 or 0 */
};

/* Upper bounds of the illuminance at p of a surface that faces n, but for r^2, which within a sphere is its radius'.
 * Angles are taken off each other by cosine and sine: that to p by those of the cone and of the sphere as seen from p,
 * that of the surface by the sphere's alone. */
static void look(const struct lum_light_node *node, struct lum_vec3 p, struct lum_vec3 n, struct brought *ret)
{
    const float surface = lum_dot(n, n) > 0.0f ? 1.0f : 0.0f;
    for (uint32_t k = 0; k < LUM_LIGHT_SIDES; k++) {
        float x = p.x - node->centre[0][k], y = p.y - node->centre[1][k], z = p.z - node->centre[2][k];
        float d2 = x * x + y * y + z * z, r2 = node->radius2[k], far2 = lum_max(d2, r2), per = 1.0f / sqrtf(far2);
        float part = r2 / far2, seen_sin = sqrtf(part), seen_cos = sqrtf(1.0f - part);
        float c = (node->axis[0][k] * x + node->axis[1][k] * y + node->axis[2][k] * z) * per;
        c = node->both_sides[k] > 0.0f ? fabsf(c) : c;
        float s = sqrtf(lum_max(1.0f - c * c, 0.0f)), cf = node->cos_faced[k], sf = node->sin_faced[k];
        float beyond_cos = c >= cf ? 1.0f : c * cf + s * sf;
        float beyond_sin = c >= cf ? 0.0f : lum_max(s * cf - c * sf, 0.0f);
        float fade = beyond_cos >= seen_cos ? 1.0f : beyond_cos * seen_cos + beyond_sin * seen_sin;
        fade = fade < node->cos_end[k] ? 0.0f : fade;
        float i = -(n.x * x + n.y * y + n.z * z) * per, i_sin = sqrtf(lum_max(1.0f - i * i, 0.0f));
        float facing = i >= seen_cos ? 1.0f : i * seen_cos + i_sin * seen_sin;
        facing = surface > 0.0f ? facing : 1.0f;
        float share = d2 > r2 ? lum_max(fade, 0.0f) * lum_max(facing, 0.0f) : 1.0f;
        ret->most[k] = node->intensity[k] * share / far2;
        ret->near[k] = d2 < NEAR2 * r2 ? 1.0f : 0.0f;
    }
}

/* ---- going down ---- */

/* Among what a choice is made: sides of nodes. */
#define CUT_MAX 64u
struct cut {
    float most[CUT_MAX], sum;
    uint32_t at[CUT_MAX]; /* node * LUM_LIGHT_SIDES + side */
    bool near[CUT_MAX];
    uint32_t n;
};

static void add_sides(struct cut *cut, const struct lum_light_tree *tree, uint32_t node, struct lum_vec3 p,
                      struct lum_vec3 n)
{
    struct brought b;
    look(&tree->nodes[node], p, n, &b);
    for (uint32_t k = 0; k < LUM_LIGHT_SIDES; k++) {
        if (!(b.most[k] > 0.0f))
            continue;
        cut->most[cut->n] = b.most[k];
        cut->near[cut->n] = b.near[k] > 0.0f && tree->nodes[node].child[k];
        cut->at[cut->n++] = node * LUM_LIGHT_SIDES + k;
    }
}

/* Of a node: its sides, in place of near ones theirs, as far as there is room. */
static void make_cut(struct cut *cut, const struct lum_light_tree *tree, uint32_t node, struct lum_vec3 p,
                     struct lum_vec3 n)
{
    cut->n = 0;
    add_sides(cut, tree, node, p, n);
    for (uint32_t i = 0; i < cut->n;) {
        if (!cut->near[i] || cut->n + LUM_LIGHT_SIDES > CUT_MAX) {
            i++;
            continue;
        }
        uint32_t at = cut->at[i], last = --cut->n;
        cut->most[i] = cut->most[last];
        cut->near[i] = cut->near[last];
        cut->at[i] = cut->at[last];
        add_sides(cut, tree, tree->nodes[at / LUM_LIGHT_SIDES].child[at % LUM_LIGHT_SIDES], p, n);
    }
    cut->sum = 0.0f;
    for (uint32_t i = 0; i < cut->n; i++)
        cut->sum += cut->most[i];
}

/* One of the cut by u, which becomes another number. Not of an empty one. */
static uint32_t choose(const struct cut *cut, float *inout_u)
{
    float x = *inout_u * cut->sum, below = 0.0f;
    uint32_t i = 0;
    while (i + 1 < cut->n && x >= below + cut->most[i])
        below += cut->most[i++];
    *inout_u = lum_clamp((x - below) / cut->most[i], 0.0f, 0x1.fffffep-1f);
    return i;
}

static uint32_t descend(const struct lum_light_tree *tree, struct lum_vec3 p, struct lum_vec3 n, float u,
                        float *ret_prob)
{
    struct cut cut;
    *ret_prob = 1.0f;
    for (uint32_t node = 0;;) {
        make_cut(&cut, tree, node, p, n);
        if (cut.n == 0)
            return LUM_NO_OBJECT;
        uint32_t i = choose(&cut, &u), at = cut.at[i];
        *ret_prob *= cut.most[i] / cut.sum;
        const struct lum_light_node *chosen = &tree->nodes[at / LUM_LIGHT_SIDES];
        node = chosen->child[at % LUM_LIGHT_SIDES];
        if (!node)
            return chosen->light[at % LUM_LIGHT_SIDES];
    }
}

/* True when the leaf is, or is below, side `at`. Children come after their parents. */
static bool is_below(const struct lum_light_tree *tree, uint32_t leaf, uint32_t at)
{
    while (leaf > at) {
        const struct lum_light_node *node = &tree->nodes[leaf / LUM_LIGHT_SIDES];
        if (leaf / LUM_LIGHT_SIDES == 0)
            return false;
        leaf = node->parent * LUM_LIGHT_SIDES + node->side;
    }
    return leaf == at;
}

/* As descend comes to the leaf. */
static float prob_of(const struct lum_light_tree *tree, struct lum_vec3 p, struct lum_vec3 n, uint32_t leaf)
{
    struct cut cut;
    float prob = 1.0f;
    for (uint32_t node = 0;;) {
        uint32_t i = 0;
        make_cut(&cut, tree, node, p, n);
        while (i < cut.n && !is_below(tree, leaf, cut.at[i]))
            i++;
        if (i == cut.n)
            return 0.0f;
        prob *= cut.most[i] / cut.sum;
        if (cut.at[i] == leaf)
            return prob;
        node = tree->nodes[cut.at[i] / LUM_LIGHT_SIDES].child[cut.at[i] % LUM_LIGHT_SIDES];
    }
}

static bool is_in_tree(const struct lum_light_table *t, uint32_t light)
{
    return t->tree_share > 0.0f && t->tree->leaf_of[light] != LUM_NO_OBJECT;
}

float lum_lights_pick_pdf(const struct lum_light_table *t, struct lum_vec3 p, struct lum_vec3 n, uint32_t light)
{
    float blind = t->pick_pdf[light];
    if (!is_in_tree(t, light))
        return blind;
    float prob = prob_of(t->tree, p, n, t->tree->leaf_of[light]);
    return LUM_LIGHT_BLIND_SHARE * blind + (1.0f - LUM_LIGHT_BLIND_SHARE) * t->tree_share * prob;
}

/* One of those that are nowhere, such as suns and skies; x: a number below the sum of their probabilities. */
static uint32_t pick_from_afar(const struct lum_light_table *t, float x, float *ret_prob)
{
    float below = 0.0f;
    uint32_t i = 0;
    while (i + 1 < t->n_afar && x >= below + t->pick_pdf[t->afar[i]])
        below += t->pick_pdf[t->afar[i++]];
    if (i >= t->n_afar)
        return LUM_NO_OBJECT;
    *ret_prob = t->pick_pdf[t->afar[i]];
    return t->afar[i];
}

/* First whether the tree, the table, or what is from afar: of a float's 24 bits the tree gets what this leaves. */
uint32_t lum_lights_pick_from(const struct lum_light_table *t, struct lum_vec3 p, struct lum_vec3 n, float u,
                              float *ret_prob)
{
    const float guided = (1.0f - LUM_LIGHT_BLIND_SHARE) * t->tree_share;
    uint32_t light;
    if (!(t->tree_share > 0.0f))
        return lum_lights_pick(t, &u, ret_prob);
    if (u < guided) {
        float prob;
        light = descend(t->tree, p, n, lum_min(u / guided, 0x1.fffffep-1f), &prob);
        if (light != LUM_NO_OBJECT)
            *ret_prob = LUM_LIGHT_BLIND_SHARE * t->pick_pdf[light] + guided * prob;
        return light;
    }
    if (u >= guided + LUM_LIGHT_BLIND_SHARE && t->n_afar > 0)
        return pick_from_afar(t, (u - guided - LUM_LIGHT_BLIND_SHARE) / (1.0f - LUM_LIGHT_BLIND_SHARE), ret_prob);
    u = lum_min((u - guided) / LUM_LIGHT_BLIND_SHARE, 0x1.fffffep-1f);
    light = lum_lights_pick(t, &u, ret_prob);
    if (light != LUM_NO_OBJECT)
        *ret_prob = lum_lights_pick_pdf(t, p, n, light);
    return light;
}
