/* Indirect diffuse light (thesis 5.3.2, listing 5.2): the virtual point lights in LUM_AIS_SUBSETS disjoint subsets, of
 * which a pixel begins with the one of its place in the pattern and takes another one with every iteration. After
 * LUM_AIS_SUBSETS iterations it has seen all of them.
 *
 * AIS computes every fourth pixel of every fourth row, and the filter puts it on the others (5.2.4). "A quarter of the
 * resolution" could also mean a quarter of the pixels; the thesis' own times tell: with all subsets, AIS then takes
 * 9/16 of the rays that IGI takes with one, and Tables 5.1 and 6.2 say 0.28 s against 0.43 s for cornell, 0.32 against
 * 0.56 for desk, 0.69 against 0.97 for sibenik, primary rays included in the former; with a quarter of the pixels it
 * would be 9/4. Pixels around which nothing was computed at all gather from all virtual point lights. */
#include "core/effect/ais/ais.h"

#include <string.h>

#include "core/pass/vpls.h"
#include "core/vpl/gather.h"
#include "core/vpl/vpl.h"

/* About 320 KiB, most of it the slots: lives on a worker's stack. */
struct indirect {
    struct lum_ais_cell cell;
    const struct lum_pass *pass;
    struct lum_counters *counters;
    struct lum_rgb sum[LUM_AIS_PIXELS];                       /* of all iterations: irradiance of the subsets taken */
    uint16_t sampled[LUM_AIS_PIXELS], missed[LUM_AIS_PIXELS]; /* in the initial pass: VPLs of the subset, and those of
                                                               * them that are occluded */
    uint32_t slots[LUM_VPL_MAX];
    /* a batch */
    struct lum_gather_points points;
    struct lum_rgb irradiance[LUM_RAY_BATCH];
    uint16_t batch_missed[LUM_RAY_BATCH];
};

/* Every LUM_AIS_SUBSETS-th slot, if there is a VPL in it: such subsets cover all lights and bounces (vpl.h). */
static uint32_t list_subset(struct indirect *s, uint32_t first, uint32_t step)
{
    const struct lum_vpl_set *set = s->pass->vpls;
    uint32_t n = 0;
    for (uint32_t k = first; k < set->n; k += step)
        if (set->flux[0][k] > 0.0f || set->flux[1][k] > 0.0f || set->flux[2][k] > 0.0f)
            s->slots[n++] = k;
    return n;
}

static void push_point(struct indirect *s, size_t at)
{
    const struct lum_surfaces *surfaces = s->pass->surfaces;
    uint32_t i = s->points.n_points++;
    s->points.p[i] = surfaces->p[at];
    s->points.n[i] = surfaces->n[at];
    s->points.ng[i] = surfaces->ng[at];
}

static void gather(struct indirect *s, uint32_t n_slots)
{
    memset(s->irradiance, 0, sizeof s->irradiance);
    memset(s->batch_missed, 0, sizeof s->batch_missed);
    lum_vpl_gather(&(struct lum_gather){
        .snapshot = s->pass->snapshot,
        .set = s->pass->vpls,
        .slots = s->slots,
        .n_slots = n_slots,
        .bound = lum_vpl_bound(s->pass->vpls->spacing),
        .media = s->pass->on[LUM_EFFECT_MEDIA],
        .panes = lum_pass_panes(s->pass),
        .points = &s->points,
        .irradiance = s->irradiance,
        .missed = s->batch_missed,
        .counters = s->counters,
    });
    s->points.n_points = 0;
}

static void take_first_samples(struct indirect *s)
{
    for (uint32_t place = 0; place < LUM_AIS_SUBSETS; place++) {
        struct lum_ais_list list;
        lum_ais_list_pixels(&s->cell, place, 0, &list);
        if (list.n == 0)
            continue;
        for (uint32_t k = 0; k < list.n; k++)
            push_point(s, lum_ais_pixel(&s->cell, list.pixel[k]));
        uint32_t n_slots = list_subset(s, lum_ais_subset(place, 0), LUM_AIS_SUBSETS);
        gather(s, n_slots);
        for (uint32_t k = 0; k < list.n; k++) {
            uint32_t i = list.pixel[k];
            s->sum[i] = s->irradiance[k];
            s->sampled[i] = (uint16_t)n_slots;
            s->missed[i] = s->batch_missed[k];
        }
    }
}

static void add_batch(struct indirect *s, struct lum_ais_list *list, uint32_t n_slots)
{
    if (list->n == 0)
        return;
    gather(s, n_slots);
    for (uint32_t k = 0; k < list->n; k++)
        s->sum[list->pixel[k]] = lum_rgb_add(s->sum[list->pixel[k]], s->irradiance[k]);
    list->n = 0;
}

/* The iteration in which each place of the pattern uses a subset. */
static void find_iterations(uint32_t subset, uint32_t ret_iteration[LUM_AIS_SUBSETS])
{
    for (uint32_t place = 0; place < LUM_AIS_SUBSETS; place++)
        for (uint32_t iteration = 0; iteration < LUM_AIS_SUBSETS; iteration++)
            if (lum_ais_subset(place, iteration) == subset)
                ret_iteration[place] = iteration;
}

/* All further iterations, subset by subset: each is for all pixels that use it, whichever iteration it is of theirs, so
 * that rays from neighbouring pixels end in one place. */
static void take_further_samples(struct indirect *s)
{
    const struct lum_ais_cell *p = &s->cell;
    for (uint32_t subset = 0; subset < LUM_AIS_SUBSETS; subset++) {
        uint32_t iteration_at[LUM_AIS_SUBSETS], n_slots = list_subset(s, subset, LUM_AIS_SUBSETS);
        struct lum_ais_list list = {.n = 0};
        find_iterations(subset, iteration_at);
        for (uint32_t t = 0; t < p->tiles_x * p->tiles_y; t++)
            for (uint32_t place = 0; place < LUM_AIS_SUBSETS; place++) {
                uint32_t i = lum_ais_at(p, t, place);
                if (i == LUM_AIS_PIXELS || iteration_at[place] == 0 ||
                    iteration_at[place] > p->further[lum_ais_tile(p, i)])
                    continue;
                list.pixel[list.n++] = (uint16_t)i;
                push_point(s, lum_ais_pixel(p, i));
                if (list.n == LUM_RAY_BATCH)
                    add_batch(s, &list, n_slots);
            }
        add_batch(s, &list, n_slots);
    }
}

/* Listing 5.2 for one tile. */
static uint32_t guide_tile(const struct indirect *s, uint32_t tile_x, uint32_t tile_y, uint32_t max)
{
    const struct lum_ais_cell *p = &s->cell;
    uint16_t sampled[LUM_AIS_SUBSETS], missed[LUM_AIS_SUBSETS];
    uint32_t n = 0;
    for (uint32_t y = tile_y * LUM_AIS_SIDE; y < (tile_y + 1) * LUM_AIS_SIDE && y < p->h; y++)
        for (uint32_t x = tile_x * LUM_AIS_SIDE; x < (tile_x + 1) * LUM_AIS_SIDE && x < p->w; x++) {
            uint32_t i = y * LUM_CELL_SIDE + x;
            if (!p->wanted[i])
                continue;
            sampled[n] = s->sampled[i];
            missed[n++] = s->missed[i];
        }
    return n > 0 ? lum_guidance_indirect(sampled, missed, n, max) : 0;
}

static void guide(struct indirect *s)
{
    const struct lum_ais *ais = lum_ais_of(s->pass);
    for (uint32_t y = 0; y < s->cell.tiles_y; y++)
        for (uint32_t x = 0; x < s->cell.tiles_x; x++)
            s->cell.further[y * s->cell.tiles_x + x] =
                (uint8_t)(ais->adaptive ? guide_tile(s, x, y, ais->max) : ais->max - 1);
}

/* Irradiance of all virtual point lights is the mean over the subsets taken, times how many there are; over pi it is
 * the radiance of a white surface. */
static void add_to_component(const struct indirect *s)
{
    const struct lum_ais_cell *p = &s->cell;
    bool joined = lum_ais_of(s->pass)->joined;
    uint32_t w = lum_filter_size(s->pass->tiling.w, p->step);
    for (uint32_t y = 0; y < p->h; y++)
        for (uint32_t x = 0; x < p->w; x++) {
            uint32_t i = y * LUM_CELL_SIDE + x;
            if (!p->wanted[i])
                continue;
            float weight = LUM_INV_PI * LUM_AIS_SUBSETS / (float)(1 + p->further[lum_ais_tile(p, i)]);
            lum_component_add(s->pass->components, joined ? LUM_EFFECT_SOFT_SHADOW : LUM_EFFECT_INDIRECT_DIFFUSE,
                              (size_t)(p->y0 + y) * w + p->x0 + x, lum_rgb_scale(s->sum[i], weight));
        }
}

/* ---- pixels that upsampling does not serve ---- */

static void finish_pixels(struct indirect *s, const size_t *at)
{
    struct lum_component_buffer *buffer = &s->pass->components->buffer[LUM_EFFECT_INDIRECT_DIFFUSE];
    uint32_t n = s->points.n_points;
    gather(s, list_subset(s, 0, 1));
    for (uint32_t k = 0; k < n; k++) {
        buffer->smooth[at[k]] = lum_rgb_scale(s->irradiance[k], LUM_INV_PI);
        buffer->iterations[at[k]] = (uint8_t)(lum_ais_of(s->pass)->max - 1);
    }
}

static void compute_unserved(struct indirect *s, uint32_t cell)
{
    const struct lum_pass *pass = s->pass;
    struct lum_guide guide_of_pass = lum_components_guide(pass);
    struct lum_filter f = lum_ais_upsampling(pass, &guide_of_pass);
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    size_t at[LUM_RAY_BATCH];
    for (uint32_t y = r.y; y < r.y + r.h; y++)
        for (uint32_t x = r.x; x < r.x + r.w; x++) {
            size_t pixel = (size_t)y * pass->tiling.w + x;
            if (!(pass->surfaces->kind[pixel] & LUM_PIXEL_DIFFUSE) || lum_upsample_taps(&f, x, y))
                continue;
            at[s->points.n_points] = pixel;
            push_point(s, pixel);
            if (s->points.n_points == LUM_RAY_BATCH)
                finish_pixels(s, at);
        }
    if (s->points.n_points > 0)
        finish_pixels(s, at);
}

/* Listing 5.1. */
static void indirect_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    if (lum_components_enter(pass, LUM_EFFECT_INDIRECT_DIFFUSE, cell))
        return;
    const struct lum_ais *ais = lum_ais_of(pass);
    struct indirect s;
    s.pass = pass;
    s.counters = counters;
    s.points.n_points = 0;
    lum_ais_cell_init(&s.cell, pass, cell, ais->step);
    if (lum_ais_cell_want(&s.cell, LUM_PIXEL_DIFFUSE)) {
        take_first_samples(&s);
        guide(&s);
        if (lum_ais_last_iteration(&s.cell) > 0)
            take_further_samples(&s);
        add_to_component(&s);
        lum_ais_note(&s.cell, ais->joined ? LUM_EFFECT_SOFT_SHADOW : LUM_EFFECT_INDIRECT_DIFFUSE);
    }
    if (ais->step > 1)
        compute_unserved(&s, cell);
}

const struct lum_estimator lum_estimator_ais_indirect = {
    .name = "ais_indirect",
    .stage = LUM_STAGE_INDIRECT,
    .tile = indirect_cell,
    .cells = true,
    .components = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE),
    .smoothed_by = &lum_filter_ais,
    .then = &lum_stage_vpls,
};

const struct lum_estimator lum_estimator_igi_indirect = {
    .name = "igi_indirect",
    .stage = LUM_STAGE_INDIRECT,
    .tile = indirect_cell,
    .cells = true,
    .components = LUM_EFFECT_BIT(LUM_EFFECT_SOFT_SHADOW),
    .smoothed_by = &lum_filter_ais,
    .then = &lum_stage_vpls,
};
