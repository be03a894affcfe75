/* Airlight: what is kept from pass to pass. */
#include "core/effect/fog/airlight.h"

#include <string.h>

static void finish(void *state)
{
    struct lum_airlights *a = state;
    lum_free(a->kept);
    lum_memo_finish(&a->made);
    *a = (struct lum_airlights){0};
}

/* By size and number of lights alone: what shares a slot must not depend on memory. */
static uint32_t slots_within_budget(const struct lum_airlights *a, uint32_t n)
{
    size_t fit = LUM_AIRLIGHTS_BYTES / (a->n_pixels * sizeof *a->kept), most = LUM_AIRLIGHTS_MAX;
    most = fit < most ? fit : most;
    return n > most ? (most > 0 ? (uint32_t)most : 1) : n;
}

static bool reserve(void *state, const struct lum_pass *pass)
{
    struct lum_airlights *a = state;
    a->n_pixels = (size_t)pass->tiling.w * pass->tiling.h;
    a->n_cells = pass->cells.n;
    uint32_t n_pairs = pass->snapshot->n_media * pass->snapshot->lights.n_lights;
    uint32_t n = slots_within_budget(a, n_pairs);
    if (pass->snapshot->lights.n_active == 0)
        return true; /* what is there may serve again */
    a->shared = n < n_pairs;
    if (n == a->n)
        return true;
    lum_free(a->kept);
    a->kept = n ? lum_calloc((size_t)n * a->n_pixels, sizeof *a->kept) : NULL;
    a->n = n;
    return n == 0 || (a->kept && lum_memo_reserve(&a->made, n * a->n_cells));
}

/* Dimming leaves those that do not hold a sum at present power. */
static void invalidate(void *state, const struct lum_pass *pass, const struct lum_outcome *outcome)
{
    (void)pass;
    struct lum_airlights *a = state;
    uint32_t first = outcome->light != LUM_FATE_DIMMED ? 0 : a->shared ? a->n - 1 : a->n;
    if (outcome->light == LUM_FATE_SAME || first == a->n)
        return;
    memset(lum_airlight_at(a, first, 0), 0, (a->n - first) * a->n_pixels * sizeof *a->kept);
    for (uint32_t item = first * a->n_cells; item < a->made.n; item++)
        lum_memo_set(&a->made, item, 0);
}

const struct lum_state_kind lum_airlights_kind = {sizeof(struct lum_airlights), reserve, invalidate, finish};
