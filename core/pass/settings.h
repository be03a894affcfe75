/* What a view asks for. */
#ifndef LUM_CORE_PASS_SETTINGS_H
#define LUM_CORE_PASS_SETTINGS_H

#include "core/cache/caches.h"
#include "core/scene/desc.h"
#include "core/trace/effect.h"

struct lum_method;

#define LUM_LAYERS_BYTES ((size_t)256 << 20) /* 600 x 400: 64 lights with hard shadows */

struct lum_view_settings {
    struct lum_camera camera;
    uint32_t w, h;
    const struct lum_method *method;
    uint32_t seed;
    uint32_t max_spp; /* progressive methods stop here; 0: never */
    /* Path segments after the first hit, of every method; roulette ends nearly all paths before. The first 16 times
     * that fog scatters a path of `path` count, further ones do not. */
    uint32_t max_depth;
    uint32_t shadow_samples; /* per area light and pixel in deferred methods: 1, 4, 9 or 16 */
    uint32_t shadow_budget;  /* rays that a frame of `live` may add where shadows are soft; 0: none */
    size_t layers_bytes;     /* of buffers light by light (effect/direct/layers.h) */
    bool reproject_shadows; /* `live`: what was seen of lights stays known where the eye moves on. False: a picture does
                           not depend on where the eye was before */
    bool illuminance;       /* the picture is of illuminance / pi: of what falls on each surface that the eye sees, as a
                               matt white one in its place would show it. Black where there is none: background, lamps
                               that are no objects. Without anti-aliasing: a mean over an edge is nobody's */
    bool antialias;         /* smooth edges, of hard shadows too; false: rays through pixel centres */
    uint32_t preview; /* after a change, first one rough pass with one sample per block of this many pixels a side, so
                         that an edit shows early; but of progressive methods it is shown by the surfaces of the full
                         picture; beyond LUM_PREVIEW_WHOLE by those of one of half the size. 0 and 1: none. At most
                         LUM_PREVIEW_MAX, of progressive methods LUM_PREVIEW_WHOLE. pace.h chooses */
    bool
        preview_eased; /* that pass does with less of what matters least, too (pace.h); not so of progressive methods */
    bool fading; /* lights are on their way to how they shine in the scene as it is (lum_snapshot.whole): pictures are
                    sums of those of both ends where all go the same share of it at a time, and are made anew at rest */
    uint32_t n_vpls; /* virtual point lights of methods that use them, 1 to LUM_VPL_MAX */
    /* methods with a cache */
    enum lum_storage storage;
    float cache_accuracy; /* a of Ward: LUM_CACHE_ACCURACY_MIN to _MAX; less is finer */
    double error_share;   /* time that measuring the error may take, over that of the picture (measure.h); 0: it is not
                             measured */
    bool measure_at_rest; /* once a picture is done, further passes measure its error, if its samples do not tell it */
    bool deterministic; /* the same picture for any number of threads: for those that else let threads share records as
                           soon as they are made */
    /* For study: effects switched off, and run although nothing calls for them. Bits 1 << enum lum_effect; off wins. */
    uint32_t effects_off, effects_on;
};
#define LUM_PREVIEW_WHOLE 16u /* a tile of paths; with larger blocks surfaces are most of what is left */
#define LUM_PREVIEW_MAX 32u
#define LUM_DEPTH_DEFAULT 64u   /* what is cut off where all reflect 0.7: 1e-10 of the light; 0.9: 0.1 %; 0.95: 3.6 % */
#define LUM_ERROR_SHARE 0.05    /* a twentieth of the time, that a moving picture tells how far it is off */
#define LUM_CACHE_ACCURACY 0.2f /* what Radiance, the oldest user of such caches, has as its default (rpict -aa) */
#define LUM_CACHE_ACCURACY_MIN 0.01f /* records get 400 times as many */
#define LUM_CACHE_ACCURACY_MAX 1.0f  /* Ward's metric: as far as where the error is as large as what is estimated */

/* True when both make the same picture of a scene, sample for sample: all but how many samples, and how early it shows.
 */
bool lum_view_same_picture(const struct lum_view_settings *a, const struct lum_view_settings *b);
/* True when both make pictures in the same way, from wherever: their errors may be alike. */
bool lum_view_same_error(const struct lum_view_settings *a, const struct lum_view_settings *b);
bool lum_camera_equal(const struct lum_camera *a, const struct lum_camera *b);

/* Bits of the edits between two settings. Effects are left out: lum_pass.on says which are on. */
uint32_t lum_edits_of_settings(const struct lum_view_settings *was, const struct lum_view_settings *now);

#endif
