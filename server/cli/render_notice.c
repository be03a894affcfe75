#include "server/cli/render_notice.h"

#include <stdio.h>
#include <string.h>

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

void lum_render_tell_legend(const char *name, const struct lum_overlay *o)
{
    const struct lum_scale *s = &o->scale;
    if (strcmp(name, "none") == 0)
        return;
    if (!o->classes) {
        fprintf(stderr, "lumend render: there is no map '%s': of this picture it is not known\n", name);
        return;
    }
    if (s->smooth)
        printf("colours of %s, %s, %s from %g to %g:\n", name, o->unit, lum_scale_kind_names[s->kind], s->min, s->max);
    else
        printf("colours of %s, %s:\n", name, o->unit);
    for (uint32_t i = 0; s->smooth && i < s->n_limits; i++) {
        const uint8_t *c = s->colors[lum_scale_color(s, s->limits[i])];
        printf("  #%02x%02x%02x at %g\n", c[0], c[1], c[2], s->limits[i]);
    }
    for (uint32_t i = 0; !s->smooth && i < s->n_colors; i++) {
        printf("  #%02x%02x%02x", s->colors[i][0], s->colors[i][1], s->colors[i][2]);
        if (i > 0)
            printf(" from %g", s->limits[i - 1]);
        if (i < s->n_limits)
            printf(" below %g", s->limits[i]);
        putchar('\n');
    }
}
