#include "server/cli/render_notice.h"

#include <stdio.h>

/* Not refused: a script may go through all methods with the same options. */
void lum_render_tell_unused(const struct lum_render_options *o, const struct lum_method *method)
{
    if (o->vpls && !lum_method_counts_vpls(method))
        fprintf(stderr, "lumend render: method %s has no virtual point lights: --vpls has no effect\n", method->name);
    if ((o->has_storage || o->cache_accuracy > 0.0) && !method->cache)
        fprintf(stderr, "lumend render: method %s has no cache: --storage and --cache-accuracy have no effect\n",
                method->name);
    if ((o->spp || o->time_s > 0.0) && !lum_method_adds_samples(method))
        fprintf(stderr, "lumend render: method %s makes a frame in one pass: --spp and --time have no effect\n",
                method->name);
}

/* Who sums the light at an eye up from a picture all around lacks theirs. */
void lum_render_tell_unseen_lamps(const struct lum_snapshot *s)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < s->lights.n_active; i++)
        n += s->lights.lights[s->lights.active[i]].delta;
    if (n > 0)
        fprintf(
            stderr,
            "lumend render: %u lamps without an extent are in no picture: light at an eye that is summed up from it "
            "lacks what comes straight from them\n",
            n);
}
