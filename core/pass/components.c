#include "core/pass/components.h"

#include <string.h>

static void finish_buffer(struct lum_component_buffer *b)
{
    lum_free(b->raw);
    lum_free(b->smooth);
    lum_free(b->iterations);
    *b = (struct lum_component_buffer){0};
}

void lum_components_finish(struct lum_components *c)
{
    for (int i = 0; i < LUM_EFFECT_COUNT; i++) {
        finish_buffer(&c->buffer[i]);
        lum_memo_finish(&c->made[i]);
        lum_memo_finish(&c->filtered[i]);
    }
    lum_free(c->radiance);
    *c = (struct lum_components){0};
}

static bool reserve_buffer(struct lum_component_buffer *b, size_t n, size_t n_raw)
{
    if (b->raw)
        return true;
    b->raw = lum_calloc(n_raw, sizeof *b->raw);
    b->smooth = lum_calloc(n, sizeof *b->smooth);
    b->iterations = lum_calloc(n, 1);
    return b->raw && b->smooth && b->iterations;
}

static bool reserve_radiance(struct lum_components *c, bool wanted)
{
    if (wanted == (c->radiance != NULL))
        return true;
    lum_free(c->radiance);
    c->radiance = wanted ? lum_calloc((size_t)c->w * c->h, sizeof *c->radiance) : NULL;
    return !wanted || c->radiance;
}

/* Light that sheets let through is all that the buffer of transmission has. */
static bool has_far_sides(const struct lum_pass *pass)
{
    return pass->snapshot->has_sheets && pass->on[LUM_EFFECT_TRANSMISSION] && pass->on[LUM_EFFECT_INDIRECT_DIFFUSE];
}

/* What the estimators of effects which are on say of them. Returns bits of those that they fill. */
static uint32_t ask_estimators(struct lum_components *c, const struct lum_pass *pass)
{
    uint32_t filled = 0;
    c->lasting = 0;
    for (int e = 0; e < LUM_EFFECT_COUNT; e++) {
        const struct lum_estimator *by = pass->on[e] ? lum_method_serves(pass->settings->method, e) : NULL;
        if (!by)
            continue;
        filled |= by->components | by->joins;
        c->lasting |= by->lasting;
    }
    return has_far_sides(pass) ? filled : filled & ~LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION);
}

static bool reserve(struct lum_components *c, const struct lum_pass *pass)
{
    uint32_t bits = ask_estimators(c, pass);
    for (int i = 0; i < LUM_EFFECT_COUNT; i++) {
        if (!lum_memo_reserve(&c->made[i], pass->tiling.n) || !lum_memo_reserve(&c->filtered[i], pass->tiling.n))
            return false;
        if (!(bits & LUM_EFFECT_BIT(i)))
            finish_buffer(&c->buffer[i]);
        else if (!reserve_buffer(&c->buffer[i], (size_t)c->w * c->h, (size_t)(c->w + 1) * (c->h + 1)))
            return false;
    }
    return reserve_radiance(c, lum_pass_antialiased(pass));
}

static void forget(struct lum_components *c, enum lum_fate fate)
{
    for (int i = 0; i < LUM_EFFECT_COUNT; i++) {
        struct lum_component_buffer *b = &c->buffer[i];
        lum_memo_forget(&c->made[i]);
        lum_memo_forget(&c->filtered[i]);
        if (!b->raw)
            continue;
        memset(b->raw, 0, (size_t)(c->w + 1) * (c->h + 1) * sizeof *b->raw);
        if (fate != LUM_FATE_DIMMED || !(c->lasting & LUM_EFFECT_BIT(i)))
            memset(b->iterations, 0, (size_t)c->w * c->h);
    }
}

/* Of what makes the product stale, objects moved since the pass before, and no more. */
static bool is_motion_alone(const struct lum_components *c, const struct lum_pass *pass, uint32_t edits,
                            enum lum_product product)
{
    return !lum_is_stale(edits & ~LUM_EDIT_BIT(LUM_EDIT_GEOMETRY), product) &&
           lum_motion_mask_is_known(pass->motion_mask) && c->surfaces + 1 == pass->surfaces->version;
}

static struct lum_outcome find_outcome(const struct lum_components *c, const struct lum_pass *pass, uint32_t edits)
{
    struct lum_outcome outcome = {LUM_FATE_SAME, LUM_FATE_SAME};
    bool seen_anew = c->surfaces != pass->surfaces->version;
    if (!seen_anew && lum_is_stale(edits, LUM_PRODUCT_COMPONENTS) && !lum_is_stale(edits, LUM_PRODUCT_UNIT_LIGHT))
        outcome.light = LUM_FATE_DIMMED;
    else if (seen_anew || lum_is_stale(edits, LUM_PRODUCT_COMPONENTS))
        outcome.light = is_motion_alone(c, pass, edits, LUM_PRODUCT_UNIT_LIGHT) ? LUM_FATE_MOVED : LUM_FATE_STALE;
    if (seen_anew || lum_is_stale(edits, LUM_PRODUCT_EDGES))
        outcome.neighbours = is_motion_alone(c, pass, edits, LUM_PRODUCT_EDGES) ? LUM_FATE_MOVED : LUM_FATE_STALE;
    return outcome;
}

enum lum_status lum_components_update(struct lum_components *c, const struct lum_pass *pass,
                                      struct lum_outcome *ret_outcome, struct lum_error *err)
{
    if (c->w != pass->tiling.w || c->h != pass->tiling.h) {
        lum_components_finish(c);
        c->w = pass->tiling.w;
        c->h = pass->tiling.h;
    }
    if (!reserve(c, pass)) {
        lum_components_finish(c);
        return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for the buffers of %u x %u pixels", pass->tiling.w,
                        pass->tiling.h);
    }
    *ret_outcome = find_outcome(c, pass, lum_basis_renew(&c->basis, pass));
    if (ret_outcome->light != LUM_FATE_SAME)
        forget(c, ret_outcome->light);
    c->surfaces = pass->surfaces->version;
    return LUM_OK;
}

bool lum_components_enter(const struct lum_pass *pass, enum lum_effect effect, uint32_t tile)
{
    return !lum_memo_advance(&pass->components->made[effect], tile, 0);
}

bool lum_components_enter_filter(const struct lum_pass *pass, enum lum_effect effect, uint32_t tile)
{
    return !lum_memo_advance(&pass->components->filtered[effect], tile, 0);
}

struct lum_guide lum_components_guide(const struct lum_pass *pass)
{
    return (struct lum_guide){
        .w = pass->tiling.w,
        .h = pass->tiling.h,
        .p = pass->surfaces->p,
        .n = pass->surfaces->n,
        .depth = pass->surfaces->depth,
        .kind = pass->surfaces->kind,
        .pixel = pass->eye.per_pixel,
    };
}
