#include "tests/bench/slots.h"

#include <stdio.h>

#include "core/trace/rays.h"
#include "core/vpl/vpl.h"

/* UINT32_MAX after a message on stderr. */
static uint32_t count_lit(const struct lum_world *world, const struct lum_view_settings *s, uint32_t slots)
{
    struct lum_error err = {0};
    struct lum_counters counters = {0};
    struct lum_vpl_set set = {0};
    struct lum_demand demand;
    lum_demand_derive(world->snapshot, &demand);
    const struct lum_vpl_request request = {
        .snapshot = world->snapshot,
        .n = slots,
        .max_bounces = s->max_depth > 0 ? s->max_depth - 1 : 0,
        .seed = s->seed,
        .media = demand.on[LUM_EFFECT_MEDIA],
        .lobes_off = s->effects_off & LUM_VPL_LOBES,
        .pool = world->pool,
        .counters = &counters,
    };
    uint32_t n_lit = UINT32_MAX;
    if (lum_vpl_update(&set, &request, &err) == LUM_OK)
        n_lit = set.n_lit;
    else
        fprintf(stderr, "lumend-bench: %s\n", err.text);
    lum_vpl_finish(&set);
    return n_lit;
}

uint32_t lum_bench_slots_for(const struct lum_world *world, const struct lum_view_settings *settings, uint32_t n)
{
    enum { TRIES = 8 };
    uint32_t slots = n, best = n, least = UINT32_MAX; /* how far the best is off */
    for (int i = 0; i < TRIES && least > 0; i++) {
        uint32_t n_lit = count_lit(world, settings, slots);
        if (n_lit == UINT32_MAX)
            return 0;
        if (n_lit == 0)
            return n; /* no light, or nothing to shine on: as good as any */
        uint32_t off = n_lit > n ? n_lit - n : n - n_lit;
        if (off < least) {
            least = off;
            best = slots;
        }
        double next = (double)slots * (double)n / (double)n_lit;
        slots = next < LUM_VPL_MAX ? (uint32_t)(next + 0.5) : LUM_VPL_MAX;
    }
    return best;
}
