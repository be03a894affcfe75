/* Airlight: resolve and join. */
#include "core/effect/fog/airlight.h"

/* Depths of rays that see about the same fog: a tenth of the way more or less. Larger: halos around what stands before
 * a wall; smaller: fewer neighbours on slanted surfaces, and noise there. */
#define SAME_DEPTH 0.1f
static bool same_depth(float a, float b)
{
    return a == b || fabsf(a - b) <= SAME_DEPTH * lum_min(a, b);
}

/* Weights of the pixels around one, `step` apart: 5 x 5, half at the ends, so that in steps of 1 each stratum counts
 * once. */
#define WINDOW 5u
struct window {
    uint32_t n;
    uint32_t pixel[WINDOW * WINDOW];
    float weight[WINDOW * WINDOW];
};

/* The positions that windows of a cell use: from 2 steps before it to 2 steps behind. */
#define STEP_MAX 3u
struct around {
    uint32_t step, x0, y0;
    uint32_t x[LUM_CELL_SIDE + 4 * STEP_MAX], y[LUM_CELL_SIDE + 4 * STEP_MAX];
};

static void look_around(struct around *ret, const struct lum_pass *pass, struct lum_tile_rect r, uint32_t step)
{
    ret->step = step;
    ret->x0 = r.x, ret->y0 = r.y;
    lum_pattern_positions(r.x, r.w, 2 * step, LUM_AIRLIGHT_SIDE * step, pass->tiling.w, ret->x);
    lum_pattern_positions(r.y, r.h, 2 * step, LUM_AIRLIGHT_SIDE * step, pass->tiling.h, ret->y);
}

static struct window window_at(const struct lum_pass *pass, const struct around *a, uint32_t x, uint32_t y)
{
    const float *depth = pass->surfaces->depth;
    const uint32_t *from_x = a->x + (x - a->x0), *from_y = a->y + (y - a->y0);
    uint32_t w = pass->tiling.w;
    float own = depth[(size_t)y * w + x];
    struct window win = {.n = 0};
    for (uint32_t j = 0; j < WINDOW; j++) {
        uint32_t qy = from_y[j * a->step];
        for (uint32_t i = 0; i < WINDOW && qy != LUM_NOWHERE; i++) {
            uint32_t qx = from_x[i * a->step];
            if (qx == LUM_NOWHERE || !same_depth(own, depth[(size_t)qy * w + qx]))
                continue;
            win.pixel[win.n] = qy * w + qx;
            win.weight[win.n++] = (i % 4 == 0 ? 0.5f : 1.0f) * (j % 4 == 0 ? 0.5f : 1.0f);
        }
    }
    return win;
}

/* Gauss and Legendre's points and weights on (0, 1): few where the light is far from the ray and all is smooth. */
#define RULE_MAX 6u
_Static_assert(RULE_MAX <= LUM_SCATTER_POINTS, "all points of a rule are looked from at once");
struct rule {
    uint32_t n;
    float u[RULE_MAX], weight[RULE_MAX];
};
static const struct rule far_rule = {4,
                                     {0.0694318442f, 0.3300094782f, 0.6699905218f, 0.9305681558f},
                                     {0.1739274226f, 0.3260725774f, 0.3260725774f, 0.1739274226f}};
static const struct rule near_rule = {
    6,
    {0.0337652429f, 0.1693953068f, 0.3806904070f, 0.6193095930f, 0.8306046932f, 0.9662347571f},
    {0.0856622462f, 0.1803807865f, 0.2339569673f, 0.2339569673f, 0.1803807865f, 0.0856622462f}};

/* What is scattered to the eye at some distances, by the light's middle. */
static void look_from_points(const struct lum_scatter_query *q, uint32_t n, const float *t, const float *pdf,
                             struct lum_rgb *ret_radiance)
{
    struct lum_scatter s;
    if (q->snapshot->lights.lights[q->light].kind != &lum_emitter_sphere) {
        lum_medium_scatter_points(q, n, t, pdf, ret_radiance);
        return;
    }
    for (uint32_t k = 0; k < n; k++) {
        bool any = lum_medium_scatter_at(q, t[k], pdf[k], (struct lum_vec2){0.5f, 0.5f}, &s);
        ret_radiance[k] = any ? s.radiance : lum_grey(0.0f);
    }
}

/* Light that the pair would send to the eye if nothing were in the way. */
static struct lum_rgb open_light(const struct lum_pass *pass, const struct lum_airlight_pair *pair, uint32_t x,
                                 uint32_t y)
{
    struct lum_scatter_query q = lum_airlight_query(pass, pair, x, y);
    struct lum_rgb sum = lum_grey(0.0f);
    struct lum_airlight_draw w;
    if (!lum_airlight_plan(&q, &w))
        return sum;
    const struct rule *rule = w.by_angle ? &near_rule : &far_rule;
    float t[RULE_MAX], pdf[RULE_MAX];
    struct lum_rgb radiance[RULE_MAX];
    for (uint32_t k = 0; k < rule->n; k++)
        t[k] = lum_airlight_distance(&w, rule->u[k], &pdf[k]);
    look_from_points(&q, rule->n, t, pdf, radiance);
    for (uint32_t k = 0; k < rule->n; k++)
        sum = lum_rgb_mad(sum, radiance[k], rule->weight[k]);
    return sum;
}

/* True when the light's middle tells well what all of it would give, and how that falls off. */
static bool is_sharp(const struct lum_pass *pass, const struct lum_airlight_pair *pair)
{
    const struct lum_emitter_row *kind = pass->snapshot->lights.lights[pair->light].kind;
    return pair->alone && (kind == &lum_emitter_point || kind == &lum_emitter_sphere);
}

/* Mean over the window of what the pair's points see, and of what they would see if nothing were in the way. */
static struct lum_airlight mean_around(const struct lum_pass *pass, const struct lum_airlight_pair *pair,
                                       const struct window *win)
{
    const struct lum_airlight *kept = lum_airlight_at(lum_airlights_of(pass), pair->slot, 0);
    struct lum_airlight sum = {.open = 0.0f};
    float weight = 0.0f;
    for (uint32_t k = 0; k < win->n; k++) {
        sum.seen = lum_rgb_mad(sum.seen, kept[win->pixel[k]].seen, win->weight[k]);
        sum.open += win->weight[k] * kept[win->pixel[k]].open;
        weight += win->weight[k];
    }
    return (struct lum_airlight){.seen = lum_rgb_scale(sum.seen, 1.0f / weight), .open = sum.open / weight};
}

static struct lum_rgb resolve_pixel(const struct lum_pass *pass, const struct lum_airlight_pair *pair,
                                    const struct window *win, uint32_t x, uint32_t y)
{
    struct lum_airlight mean = mean_around(pass, pair, win);
    if (!is_sharp(pass, pair))
        return mean.seen;
    float share = lum_luminance(mean.seen) / mean.open;
    if (!(share > 0.0f)) /* nobody looked, or sees anything */
        return lum_grey(0.0f);
    struct lum_rgb open = open_light(pass, pair, x, y);
    share = lum_min(share, 1.0f);
    if (!lum_pass_panes(pass))
        return lum_rgb_scale(open, share);
    return lum_rgb_scale(mean.seen, share * lum_luminance(open) / lum_luminance(mean.seen)); /* in the panes' colour */
}

/* Slots that the cell has, in turn, with their pairs that shine; those that were traced since they were resolved. */
struct slots {
    uint32_t n, n_stale;
    struct lum_airlight_pair pairs[LUM_AIRLIGHTS_MAX], stale[LUM_AIRLIGHTS_MAX];
};

static struct slots slots_of(const struct lum_pass *pass, const struct lum_airlights *kept, uint32_t cell)
{
    struct slots s = {.n = 0};
    struct lum_airlight_pair pair;
    for (uint32_t i = 0; lum_airlight_next(pass, i, &pair); i++) {
        if (s.n > 0 && s.pairs[s.n - 1].slot == pair.slot)
            continue;
        s.pairs[s.n++] = pair;
        if (lum_memo_step(&kept->made, lum_airlight_item(kept, pair.slot, cell)) == LUM_AIRLIGHT_TRACED)
            s.stale[s.n_stale++] = pair;
    }
    return s;
}

/* To `smooth` goes light that takes the ratio, to `raw` all other. */
static void sum_pixel(const struct lum_pass *pass, const struct slots *s, size_t pixel)
{
    const struct lum_airlights *kept = lum_airlights_of(pass);
    const struct lum_component_buffer *media = &pass->components->buffer[LUM_EFFECT_MEDIA];
    struct lum_rgb sum[2] = {lum_grey(0.0f), lum_grey(0.0f)};
    for (uint32_t i = 0; i < s->n; i++) {
        const struct lum_airlight_pair *pair = &s->pairs[i];
        struct lum_rgb light = lum_airlight_at(kept, pair->slot, pixel)->resolved;
        bool sharp = is_sharp(pass, pair);
        sum[sharp] = lum_rgb_add(sum[sharp], lum_rgb_mul(light, lum_airlight_power(pass, pair)));
    }
    media->raw[pixel] = sum[0];
    media->smooth[pixel] = sum[1];
}

/* Pixels of a cell in a row: pair by pair, so that what is kept of one is at hand. */
static void resolve_row(const struct lum_pass *pass, const struct slots *slots, const struct around *around,
                        uint32_t x0, uint32_t n, uint32_t y)
{
    struct lum_airlights *kept = lum_airlights_of(pass);
    struct window win[LUM_CELL_SIDE];
    size_t first = (size_t)y * pass->tiling.w + x0;
    for (uint32_t i = 0; i < n && slots->n_stale > 0; i++)
        win[i] = window_at(pass, around, x0 + i, y);
    for (uint32_t k = 0; k < slots->n_stale; k++) {
        struct lum_airlight *of_pair = lum_airlight_at(kept, slots->stale[k].slot, first);
        for (uint32_t i = 0; i < n; i++)
            of_pair[i].resolved = resolve_pixel(pass, &slots->stale[k], &win[i], x0 + i, y);
    }
    for (uint32_t i = 0; i < n; i++)
        sum_pixel(pass, slots, first + i);
}

static void resolve_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    (void)counters;
    if (!lum_memo_advance(&pass->components->made[LUM_EFFECT_MEDIA], cell, LUM_AIRLIGHT_TRACED))
        return;
    struct lum_airlights *kept = lum_airlights_of(pass);
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    struct slots slots = slots_of(pass, kept, cell);
    struct around around;
    look_around(&around, pass, r, 1);
    for (uint32_t y = r.y; y < r.y + r.h; y++)
        resolve_row(pass, &slots, &around, r.x, r.w, y);
    for (uint32_t i = 0; i < slots.n_stale; i++)
        lum_memo_set(&kept->made, lum_airlight_item(kept, slots.stale[i].slot, cell), LUM_AIRLIGHT_RESOLVED);
}

static bool any_even(const struct lum_pass *pass)
{
    struct lum_airlight_pair pair;
    for (uint32_t i = 0; lum_airlight_next(pass, i, &pair); i++)
        if (!is_sharp(pass, &pair))
            return true;
    return false;
}

/* Light without a place changes slowly over the picture: means around are joined once more, over three periods of the
 * pattern. */
#define JOIN_STEP 3u
_Static_assert(JOIN_STEP <= STEP_MAX, "windows fit");

static void join_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    (void)counters;
    struct lum_component_buffer *b = &pass->components->buffer[LUM_EFFECT_MEDIA];
    if (!lum_memo_advance(&pass->components->made[LUM_EFFECT_MEDIA], cell, LUM_AIRLIGHT_RESOLVED) || !any_even(pass))
        return;
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    struct around around;
    look_around(&around, pass, r, JOIN_STEP);
    for (uint32_t y = r.y; y < r.y + r.h; y++)
        for (uint32_t x = r.x; x < r.x + r.w; x++) {
            struct window win = window_at(pass, &around, x, y);
            struct lum_rgb sum = lum_grey(0.0f);
            float weight = 0.0f;
            for (uint32_t k = 0; k < win.n; k++) {
                sum = lum_rgb_mad(sum, b->raw[win.pixel[k]], win.weight[k]);
                weight += win.weight[k];
            }
            struct lum_rgb *smooth = &b->smooth[(size_t)y * pass->tiling.w + x];
            *smooth = lum_rgb_mad(*smooth, sum, 1.0f / weight);
        }
}

static const struct lum_estimator join_stage = {
    .name = "airlight, join", .stage = LUM_STAGE_UPSAMPLE, .tile = join_cell, .cells = true, .surfaces = true};
const struct lum_estimator lum_airlight_resolve = {.name = "airlight, resolve",
                                                   .stage = LUM_STAGE_FILTER,
                                                   .tile = resolve_cell,
                                                   .cells = true,
                                                   .surfaces = true,
                                                   .then = &join_stage};
