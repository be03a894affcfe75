#include "server/importer/fixtures.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/base.h"

/* Corners are one where they are this near, as a share of the mesh's largest extent: what exporters' floats round by.
 */
#define WELD 0x1p-19
/* Boxes that are nearer than this share of the smaller one's diagonal are of one fixture. */
#define GAP 0.02

#define PAIRS_MOST 2048u /* parts whose boxes are compared with one another; more are put together by place alone */

struct box {
    double lo[3], hi[3];
};

/* ---- sets ---- */

static uint32_t root_of(uint32_t *parent, uint32_t i)
{
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}

/* The smaller number stands for both, so that the outcome does not depend on the order. */
static void join(uint32_t *parent, uint32_t a, uint32_t b)
{
    a = root_of(parent, a);
    b = root_of(parent, b);
    if (a < b)
        parent[b] = a;
    else
        parent[a] = b;
}

/* ---- corners ---- */

static struct box box_of(const float *p, uint32_t n)
{
    struct box b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < 3; k++) {
            b.lo[k] = fmin(b.lo[k], (double)p[3 * i + k]);
            b.hi[k] = fmax(b.hi[k], (double)p[3 * i + k]);
        }
    return b;
}

static double extent_of(const struct box *b)
{
    return fmax(fmax(b->hi[0] - b->lo[0], b->hi[1] - b->lo[1]), b->hi[2] - b->lo[2]);
}

static uint32_t hash_cell(const int64_t cell[3])
{
    uint64_t h = 0;
    for (int k = 0; k < 3; k++) {
        h = (h ^ (uint64_t)cell[k]) * 0x9e3779b97f4a7c15u;
        h ^= h >> 29;
    }
    return (uint32_t)(h >> 8);
}

struct point {
    int64_t cell[3];
    uint32_t vertex; /* + 1; 0: free */
};

/* A slot that holds the cell, or the free one where it belongs. n: a power of two. */
static struct point *find_slot(struct point *slots, uint32_t n, const int64_t cell[3])
{
    uint32_t i = hash_cell(cell) & (n - 1);
    while (slots[i].vertex && memcmp(slots[i].cell, cell, sizeof slots[i].cell) != 0)
        i = (i + 1) & (n - 1);
    return &slots[i];
}

/* Cells of the width of the tolerance; a vertex belongs with those in its own cell and in the ones that it is nearer to
 * than half a cell: two within the tolerance of each other are found from one of them at least. */
static bool weld(const struct lum_fixture_query *q, const struct box *all, uint32_t *parent)
{
    uint32_t n = 16;
    while (n < 2 * q->n_vertices)
        n *= 2;
    struct point *slots = lum_calloc(n, sizeof *slots);
    double width = 2.0 * fmax(extent_of(all) * WELD, 0x1p-120);
    for (uint32_t v = 0; slots && v < q->n_vertices; v++) {
        int64_t near[2][3]; /* its own cell, and the next one on the side that it lies on */
        for (int k = 0; k < 3; k++) {
            double x = ((double)q->positions[3 * (size_t)v + (size_t)k] - all->lo[k]) / width;
            near[0][k] = (int64_t)x;
            near[1][k] = near[0][k] + (x - (double)near[0][k] < 0.5 ? -1 : 1);
        }
        for (int corner = 0; corner < 8; corner++) {
            const int64_t cell[3] = {near[corner & 1][0], near[corner >> 1 & 1][1], near[corner >> 2][2]};
            struct point *slot = find_slot(slots, n, cell);
            if (slot->vertex)
                join(parent, v, slot->vertex - 1);
            else if (corner == 0) {
                memcpy(slot->cell, cell, sizeof cell);
                slot->vertex = v + 1;
            }
        }
    }
    bool ok = slots != NULL;
    lum_free(slots);
    return ok;
}

/* ---- parts ---- */

/* Numbers the sets by their first triangles: label[triangle]; returns how many. number: scratch, by vertex. */
static uint32_t label_triangles(const struct lum_fixture_query *q, uint32_t *parent, uint32_t *number,
                                uint32_t *ret_label)
{
    uint32_t n = 0;
    for (uint32_t v = 0; v < q->n_vertices; v++)
        number[v] = UINT32_MAX;
    for (uint32_t t = 0; t < q->n_triangles; t++) {
        uint32_t root = root_of(parent, q->indices[3 * (size_t)t]);
        if (number[root] == UINT32_MAX)
            number[root] = n++;
        ret_label[t] = number[root];
    }
    return n;
}

static void find_boxes(const struct lum_fixture_query *q, const uint32_t *label, uint32_t n, struct box *boxes)
{
    for (uint32_t i = 0; i < n; i++)
        boxes[i] = box_of(NULL, 0);
    for (size_t c = 0; c < 3 * (size_t)q->n_triangles; c++) {
        struct box *b = &boxes[label[c / 3]], one = box_of(q->positions + 3 * (size_t)q->indices[c], 1);
        for (int k = 0; k < 3; k++) {
            b->lo[k] = fmin(b->lo[k], one.lo[k]);
            b->hi[k] = fmax(b->hi[k], one.hi[k]);
        }
    }
}

static double diagonal(const struct box *b)
{
    return sqrt(pow(b->hi[0] - b->lo[0], 2) + pow(b->hi[1] - b->lo[1], 2) + pow(b->hi[2] - b->lo[2], 2));
}

static bool are_near(const struct box *a, const struct box *b)
{
    double gap2 = 0.0, tolerance = GAP * fmin(diagonal(a), diagonal(b));
    for (int k = 0; k < 3; k++) {
        double gap = fmax(fmax(a->lo[k] - b->hi[k], b->lo[k] - a->hi[k]), 0.0);
        gap2 += gap * gap;
    }
    return gap2 <= tolerance * tolerance;
}

static void join_near(const struct box *boxes, uint32_t n, uint32_t *parent)
{
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = i + 1; j < n; j++)
            if (are_near(&boxes[i], &boxes[j]))
                join(parent, i, j);
}

static uint32_t count_sets(uint32_t *parent, uint32_t n)
{
    uint32_t sets = 0;
    for (uint32_t i = 0; i < n; i++)
        sets += root_of(parent, i) == i;
    return sets;
}

/* Parts whose centres lie in one cell of a grid are one, with wider and wider cells until few enough are left. */
static bool join_by_place(const struct box *all, const struct box *boxes, uint32_t n, uint32_t most, uint32_t *parent)
{
    uint32_t n_slots = 16;
    while (n_slots < 2 * n)
        n_slots *= 2;
    struct point *slots = lum_calloc(n_slots, sizeof *slots);
    for (double cells = 1 << 20; slots && count_sets(parent, n) > most; cells /= 2.0) {
        double width = fmax(extent_of(all) / cells, 0x1p-120) * (1.0 + 0x1p-20);
        memset(slots, 0, n_slots * sizeof *slots);
        for (uint32_t i = 0; i < n; i++) {
            int64_t cell[3];
            for (int k = 0; k < 3; k++)
                cell[k] = (int64_t)((0.5 * (boxes[i].lo[k] + boxes[i].hi[k]) - all->lo[k]) / width);
            struct point *slot = find_slot(slots, n_slots, cell);
            if (slot->vertex) {
                join(parent, i, slot->vertex - 1);
            } else {
                memcpy(slot->cell, cell, sizeof cell);
                slot->vertex = i + 1;
            }
        }
    }
    bool ok = slots != NULL;
    lum_free(slots);
    return ok;
}

/* From parts to fixtures: label[triangle] becomes the fixture's number. Returns how many; 0: memory is short. */
static uint32_t join_parts(const struct lum_fixture_query *q, const struct box *all, uint32_t n, uint32_t *label)
{
    struct box *boxes = lum_calloc(n, sizeof *boxes);
    uint32_t *parent = lum_calloc(n, sizeof *parent), *number = lum_calloc(n, sizeof *number), n_fixtures = 0;
    bool ok = boxes && parent && number;
    if (ok) {
        find_boxes(q, label, n, boxes);
        for (uint32_t i = 0; i < n; i++)
            parent[i] = i;
        if (n <= PAIRS_MOST)
            join_near(boxes, n, parent);
        ok = join_by_place(all, boxes, n, q->most, parent);
    }
    for (uint32_t i = 0; ok && i < n; i++) { /* a set's smallest number comes first, and stands for it */
        uint32_t root = root_of(parent, i);
        number[i] = root == i ? n_fixtures++ : number[root];
    }
    for (uint32_t t = 0; ok && t < q->n_triangles; t++)
        label[t] = number[label[t]];
    lum_free(boxes);
    lum_free(parent);
    lum_free(number);
    return ok ? n_fixtures : 0;
}

uint32_t lum_fixtures_find(const struct lum_fixture_query *q, uint32_t *ret_fixture)
{
    struct box all = box_of(q->positions, q->n_vertices);
    uint32_t *parent = lum_calloc(q->n_vertices, sizeof *parent), *number = lum_calloc(q->n_vertices, sizeof *number);
    uint32_t n = 0;
    for (uint32_t v = 0; parent && v < q->n_vertices; v++)
        parent[v] = v;
    if (parent && number && weld(q, &all, parent)) {
        for (uint32_t t = 0; t < q->n_triangles; t++)
            for (size_t k = 1; k < 3; k++)
                join(parent, q->indices[3 * (size_t)t], q->indices[3 * (size_t)t + k]);
        n = label_triangles(q, parent, number, ret_fixture);
        n = n > 1 ? join_parts(q, &all, n, ret_fixture) : n;
    }
    lum_free(parent);
    lum_free(number);
    return n;
}
