/* Lamps on their way from how they shone to how the document says that they do. The document has the end from the
 * start: a fade is only how the picture gets there, as the light of a desk is (patches.h), and traces no ray more.
 *
 * Thread: the world's. */
#ifndef LUM_SERVER_WORLD_FADE_H
#define LUM_SERVER_WORLD_FADE_H

#include "core/light/light.h"
#include "protocol/base/value.h"

struct lum_fading {
    lum_id id;
    struct lum_rgb from, to; /* power (light.h) */
    int64_t start_ns, end_ns;
    bool holds; /* the newest scene has it, and so bright in the end */
};

struct lum_fade {
    struct lum_fading *items; /* sorted by id */
    size_t n;
    int64_t now_ns; /* that it is shown at */
};

/* How each light of a table shines now, on its way as it may be, by id: n_lights of them, the caller's to free. NULL:
 * no memory. */
struct lum_fading *lum_fade_shown(const struct lum_fade *fade, const struct lum_light_table *table);
/* After an edit of the lamps `ids` (sorted here): each goes from how it was shown before that to how it is now; 0: at
 * once. Others go on as they did. Without memory lamps are as the document says. */
void lum_fade_begin(struct lum_fade *fade, const struct lum_fading *shown, size_t n_shown,
                    const struct lum_light_table *now, const char **ids, size_t n_ids, int64_t start_ns,
                    int64_t duration_ns);
/* After any edit: a lamp that somebody changed meanwhile is as the document says. */
void lum_fade_follow(struct lum_fade *fade, const struct lum_light_table *now);
/* Time passes. Those that have arrived are dropped. */
void lum_fade_turn(struct lum_fade *fade, int64_t now_ns);
void lum_fade_finish(struct lum_fade *fade);
/* NULL: it is as the document says. */
const struct lum_fading *lum_fade_of(const struct lum_fade *fade, const char *id);
/* Of lum_snapshot_relit: linear in light, of each primary. */
void lum_fade_shine(const struct lum_fade *fade, struct lum_light *light);

#endif
