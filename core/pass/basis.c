#include "core/pass/basis.h"

#include "core/pass/pass.h"

/* A kind of light that is switched off to its last lamp calls for nothing, but what was found out about it stays true:
 * kinds of light differ only where the settings say so. Without any light, effects that nothing calls for any more stay
 * as they were found, too: only what shows then, and did not, is news. */
static bool renew_effects(struct lum_basis *basis, const struct lum_pass *pass)
{
    const uint32_t lights = LUM_EFFECT_BIT(LUM_EFFECT_DIRECT) | LUM_EFFECT_BIT(LUM_EFFECT_SOFT_SHADOW) |
                            LUM_EFFECT_BIT(LUM_EFFECT_ENVIRONMENT);
    bool same = ((basis->settings.effects_off ^ pass->settings->effects_off) & lights) == 0;
    for (uint32_t e = 0; e < LUM_EFFECT_COUNT; e++) {
        bool on = pass->on[e] || (pass->snapshot->lights.n_active == 0 && basis->on[e]);
        same = same && (LUM_EFFECT_BIT(e) & lights || basis->on[e] == on);
        basis->on[e] = on;
    }
    return same;
}

uint32_t lum_basis_renew(struct lum_basis *basis, const struct lum_pass *pass)
{
    uint32_t edits = LUM_EDITS_ALL;
    bool same_effects = renew_effects(basis, pass);
    if (basis->valid) {
        edits = lum_edits_of_versions(&basis->versions, &pass->snapshot->versions) |
                lum_edits_of_settings(&basis->settings, pass->settings) |
                (same_effects ? 0 : LUM_EDIT_BIT(LUM_EDIT_METHOD));
    }
    basis->valid = true;
    basis->versions = pass->snapshot->versions;
    basis->settings = *pass->settings;
    return edits;
}
