/* Which of many lights to sample from a point: a tree of the lights that are somewhere, whose nodes know where theirs
 * lie, to where they shine and how much. From the root down a side is chosen by how much light its lights can bring at
 * most, were nothing in between (Conty Estevez and Kulla 2018). What can bring none is not chosen so, and all else may
 * be: the estimate is unbiased. */
#ifndef LUM_CORE_LIGHT_TREE_H
#define LUM_CORE_LIGHT_TREE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/math/vec.h"

struct lum_light;
struct lum_light_table;

/* Where a light is, or several, and where they shine to: a sphere around them, and a cone of the directions that they
 * face, beyond which light fades by the cosine of the angle to it, until it ends. */
struct lum_light_reach {
    struct lum_vec3 centre;
    float radius;
    struct lum_vec3 axis; /* unit */
    float cos_faced;      /* half angle of that cone; -1: all around */
    float cos_end;        /* of the angle beyond it at which light ends: 0 of surfaces, 1 of what has an edge there */
    bool both_sides;      /* it shines as much to where -axis points */
    float intensity; /* most that goes anywhere: of one light per luminance of its power (lum_light), of a node in cd
                        scale^2 */
};

#define LUM_LIGHT_SIDES 8u /* lanes of a register of AVX2 */

/* What a node consists of, in lanes: that is looked at as one. */
struct lum_light_node {
    float centre[3][LUM_LIGHT_SIDES], radius2[LUM_LIGHT_SIDES];
    float axis[3][LUM_LIGHT_SIDES], cos_faced[LUM_LIGHT_SIDES], sin_faced[LUM_LIGHT_SIDES], cos_end[LUM_LIGHT_SIDES];
    float both_sides[LUM_LIGHT_SIDES]; /* 1 or 0 */
    float intensity[LUM_LIGHT_SIDES];  /* 0: it is dark, or there is none */
    uint32_t child[LUM_LIGHT_SIDES];   /* the node, 0: a light */
    uint32_t light[LUM_LIGHT_SIDES];
    uint32_t parent, side; /* which of the parent's it is */
};

/* Nodes of what is somewhere, root first and children after parents; none of fewer than two lights. */
struct lum_light_tree {
    struct lum_light_node *nodes;
    uint32_t *leaf_of; /* per light: node * LUM_LIGHT_SIDES + side; LUM_NO_OBJECT: it is not in here */
    float *unit;       /* per light: its intensity when the luminance of its power is 1 */
    uint32_t n_nodes, n_lights;
};

/* n: of all lights. reach: of those that are somewhere; its centre of others is not finite. False: out of memory. */
bool lum_light_tree_build(struct lum_light_tree *tree, const struct lum_light_reach *reach, uint32_t n);
/* How bright they are by now. shines: per light, probability 0: it does not. */
void lum_light_tree_brighten(struct lum_light_tree *tree, const struct lum_light *lights, const float *shines);
/* The same lights, brighter or not. False: out of memory. */
bool lum_light_tree_copy(struct lum_light_tree *tree, const struct lum_light_tree *from);
/* The same lights in the same places, as bright. */
bool lum_light_tree_same(const struct lum_light_tree *a, const struct lum_light_tree *b);
void lum_light_tree_finish(struct lum_light_tree *tree); /* accepts zeroes */

/* Of the picks of lights that are somewhere, this share goes by the table as if there were no tree: what is near may be
 * behind a wall, where all others would wait long. */
#define LUM_LIGHT_BLIND_SHARE 0.2f

/* Of a surface that faces n, from one side; 0 0 0: from both, or of a point in fog. Both agree: pick comes to light i
 * with probability pick_pdf. A number u makes several choices, and is not to be used again. LUM_NO_OBJECT: none was
 * picked, which is a sample, and black. Thread: any. */
uint32_t lum_lights_pick_from(const struct lum_light_table *t, struct lum_vec3 p, struct lum_vec3 n, float u,
                              float *ret_prob);
float lum_lights_pick_pdf(const struct lum_light_table *t, struct lum_vec3 p, struct lum_vec3 n, uint32_t light);

#endif
