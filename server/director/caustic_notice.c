#include "server/director/caustic_notice.h"

#include <stdio.h>

/* Enough, and not by chance: two standard errors from nothing. */
static bool is_told(const struct lum_caustic_amount *a)
{
    double share = lum_caustic_share(a);
    return share > LUM_CAUSTIC_TOLD && share > 2.0 * lum_caustic_share_stderr(a);
}

/* Two digits: its standard error is a tenth of it or so. */
static void percent(char ret_text[16], double share)
{
    snprintf(ret_text, 16, share < 0.0995 ? "%.1f %%" : "%.0f %%", 100.0 * share);
}

struct lum_caustic_notice lum_caustic_notice(const struct lum_caustic_report *r)
{
    struct lum_caustic_notice n = {{0}, {0}};
    const struct lum_caustic_of_light *most = NULL;
    bool all = is_told(&r->all);
    char of_light[16], of_all[16], whose[LUM_ID_MAX + 96];
    for (uint32_t i = r->n_lights; i-- > 0;)
        if (is_told(&r->lights[i].amount))
            most = &r->lights[i];
    if (r->n_lights == 0 || (!most && !all))
        return n;
    percent(of_all, lum_caustic_share(&r->all));
    if (most)
        percent(of_light, lum_caustic_share(&most->amount));
    if (!most)
        snprintf(whose, sizeof whose, "%s of the light of lamps without extent", of_all);
    else if (all && r->all.arriving_lm > 1.001 * most->amount.arriving_lm)
        snprintf(whose, sizeof whose, "%s of the light of %s (%s of that of all such lamps)", of_light, most->id,
                 of_all);
    else
        snprintf(whose, sizeof whose, "%s of the light of %s", of_light, most->id);
    const struct lum_caustic_of_light *first = most ? most : &r->lights[0];
    snprintf(n.why, sizeof n.why, "%s is in no picture: it goes by way of mirrors or solid glass (above all %s)", whose,
             first->object);
    snprintf(n.mend, sizeof n.mend, "Give the lamp an extent (%s): then path, and live at rest, find that light%s",
             first->from_afar ? "a diameter_deg of 0.53" : "a sphere, disc or quad in its place",
             first->glass ? "; or set glass of render to architectural: then light goes straight through" : "");
    return n;
}
