/* Light by light buffers of a deferred view: what makes relighting free of rays.
 *
 * Light is linear, so a picture is the sum over its lights of power times response, where a light's response is the
 * radiance that it would give at power 1. A layer keeps, for one light and every pixel, which of its shadow samples
 * were traced and which of them see the light, with what panes leave of it (visibility: geometry only, and glass), and
 * the response (visibility, geometry, materials and what media leave of the light on its way). Then
 *   - another colour, intensity or switch of a light is another sum: no ray, no shading;
 *   - another material is another response from the same visibility bits: no shadow ray, except for samples that nobody
 *     needed before;
 *   - another medium dims the same light otherwise: likewise;
 *   - a moved light drops its own layer only;
 *   - a moved object drops what its boxes before and now can have changed: also of what mirrors and glass show.
 * The sum is made the same way when everything is fresh, so a relit picture equals a new one bit for bit.
 *
 * A layer takes 17 bytes a pixel, one with soft shadows 39 and 36 KiB, if its light is a disc or a mesh; with panes in
 * the scene 4 more, or 8, which are not counted: which lights have layers must not hang on an edit of glass. Lights for
 * which settings->layers_bytes leave no room share one layer that holds their summed radiance at their present power
 * and no visibility: when one of them changes, all of them are traced again (and the ray counters say so). Those that
 * come first in the table keep layers of their own: the choice must not depend on power, or dimming a light would
 * change it. Of lights with soft shadows there is a third kind, lean layers: they keep what shows of the light itself,
 * directly and by way of mirrors and glass, where anything does, and leave its light on what the eye sees to the
 * sampling of many lights (many_lights.h), which relights them all without a ray. Surfaces that shine without being a
 * light (unlit) are in the shared layer too, and so are the lights that another estimator of the method samples into a
 * component: only their own shine and their light behind mirrors and glass are kept here. */
#ifndef LUM_CORE_EFFECT_DIRECT_LAYERS_H
#define LUM_CORE_EFFECT_DIRECT_LAYERS_H

#include "core/effect/direct/area_visibility.h"
#include "core/effect/direct/many_lights.h"
#include "core/trace/branches.h"

/* Of more lights with soft shadows all are sampled together, as many lights. First frames of conf_lbl_mgf, with 32: 310
 * ms instead of 1030 for direct light, at a SMAPE of .095 instead of .094. With few lights layers take as long
 * (conference: SMAPE .070 instead of .074), and less when something moves, as samples need not be shaded again. */
#define LUM_AREA_LAYERS 8u
#define LUM_LEAN_LAYERS 1024u /* 9 bytes a tile each: 48 MiB at 1440 x 900 */

/* What a tile of a layer holds; each step includes the ones before. */
enum lum_layer_state {
    LUM_LAYER_EMPTY,
    LUM_LAYER_VISIBILITY, /* visibility bits */
    LUM_LAYER_DIRECT,     /* + response of surfaces that the eye sees */
    LUM_LAYER_SMOOTH,     /* + edges of hard shadows, where the view asks for anti-aliasing */
    LUM_LAYER_COMPLETE,   /* + response seen in mirrors and through glass */
};
#define LUM_LAYER_INNER_POINTS 4u /* two bits each fill a byte */

struct lum_layer {
    struct lum_light light; /* as it was when last checked; its id names the layer */
    uint32_t salt;          /* hash of the id: decorrelates the samples of different lights, whatever their index */
    uint32_t index;         /* in the present light table */
    struct lum_visibility *visibility; /* per pixel, tile by tile; NULL in the shared layer */
    uint8_t *inner; /* same: bit k: it is known whether point k in the pixel is lit, bit LUM_LAYER_INNER_POINTS + k: it
                       is (shadow_edges.c). NULL: nobody asks: the light has an extent, or anti-aliasing is off */
    uint32_t *left; /* same: what panes leave of the samples that are visible (lum_transmittance_pack), or, where the
                       middle of the pixel is dark, of the inner points. NULL: no panes, or area.left is there */
    struct lum_rgb *response; /* same; in the shared layer: radiance */
    uint8_t *state;           /* enum lum_layer_state per tile */
    uint8_t *whole;           /* by tile, 1: all is as the last frame left it. NULL: a lean layer, or the shared one */
    struct lum_area_visibility area; /* of lights kept by LUM_LAYERING_AREA; then response is without their
                             direct light, and visibility is NULL */
    struct lum_rgb **tiles; /* lean layers, which have neither of the above but state: response by tile; NULL: black */
    uint32_t n_tiles;       /* of tiles */
};

struct lum_layers {
    /* what the buffers depend on, as of the last lum_layers_update */
    struct lum_basis basis;
    uint32_t n_tiles;
    uint64_t gbuffer_stamp;
    /* by layer */
    struct lum_layer *layers;
    uint32_t n_layers;
    struct lum_layer shared;
    bool shared_on;
    struct lum_branches *branches;      /* by tile: of mirrors and glass */
    struct lum_many_lights many_lights; /* lights without a layer or with a lean one, of methods with soft shadows:
                                           their light on what the eye sees */
    uint32_t n_lean;                    /* layers */
    bool has_many_lights;               /* there are more than LUM_AREA_LAYERS that are or were on */
    uint32_t samples_behind;            /* of each area light, where mirrors and glass show what it shines on */
    _Atomic bool starved;               /* a tile of a lean layer found no memory: the pass has failed */
    /* soft shadows */
    float *brightness; /* scratch: per tile of their pattern; NULL: there are none */
    struct lum_eye eye,
        history_eye;     /* that the buffers show; and what lum_area_visibility.history and lum_surfaces.history_p do */
    bool reprojected;    /* samples of the history serve: the eye moved, and nothing else */
    bool doubted;        /* materials changed: what surfaces hide of lights by themselves may be otherwise */
    uint32_t n_passes;   /* for which the layers were brought up to date, this one included */
    uint32_t n_moves;    /* of the eye, while samples were reprojected */
    float refined_share; /* of settings->shadow_budget that the pass spends: as many further samples as first ones were
                          * lost. 0: something changed since the last pass, but not who sees which light */
    /* by light of the present snapshot */
    uint32_t *layer_of; /* LUM_NO_OBJECT: the shared one, or it does not shine */
    uint32_t capacity;  /* of layers, layer_of and unit_lights */
    /* The present snapshot with every light on at power 1: what responses are made with. Borrows everything but this
     * array. */
    struct lum_snapshot unit;
    struct lum_light *unit_lights;
};

void lum_layers_finish(struct lum_layers *layers);

/* Brings the set of layers in line with the snapshot and marks as stale what it changed. gbuffer_stamp: changes
 * whenever the G-buffer does, but for what pass->motion_mask says. On failure the layers are empty, but usable. */
LUM_MUST_USE enum lum_status lum_layers_update(struct lum_layers *layers, const struct lum_pass *pass,
                                               uint64_t gbuffer_stamp, struct lum_error *err);

/* True when direct light of this light on what the eye sees is kept in layers. */
bool lum_layers_hold(const struct lum_pass *pass, const struct lum_light *light);
/* True when the light has no layer, or a lean one. */
bool lum_layers_in_many_lights(const struct lum_layers *layers, uint32_t light);

/* ---- per tile (core/effect/direct/layer_tiles.c); thread: the worker that has the tile ---- */

/* True when every layer that shows has reached state in this tile. */
bool lum_layers_reached(const struct lum_pass *pass, uint32_t tile, enum lum_layer_state state);
/* Says so. */
void lum_layers_reach(const struct lum_pass *pass, uint32_t tile, enum lum_layer_state state);
/* Makes the tile black in layers that have not reached state. */
void lum_layers_blacken(const struct lum_pass *pass, uint32_t tile, enum lum_layer_state state);

/* The following add to layers that have not reached state only. Radiance that the pixel receives from emitter `light`
 * (or, LUM_NO_OBJECT, from a surface that shines without being a light): per unit of power. */
struct lum_emission {
    uint32_t slot, light;
    struct lum_rgb per_power;
};
void lum_layers_add(const struct lum_pass *pass, uint32_t tile, const struct lum_emission *e,
                    enum lum_layer_state state);

/* Direct light at vertices of the tile. For LUM_LAYER_DIRECT these are what the eye sees, one per pixel, and visibility
 * is used and kept. */
struct lum_vertices;
/* Of matte vertices, whose light of the sky records bring where they bring that of other surfaces. */
void lum_layers_light_matte(const struct lum_pass *pass, uint32_t tile, const struct lum_vertices *vertices,
                            enum lum_layer_state state, struct lum_counters *counters);
void lum_layers_light(const struct lum_pass *pass, uint32_t tile, const struct lum_vertices *vertices,
                      enum lum_layer_state state, struct lum_counters *counters);

/* Adds what a layer of its own has of a light in a tile, at this power. */
void lum_layer_add(const struct lum_layer *layer, uint32_t tile, uint32_t n_pixels, struct lum_rgb power,
                   struct lum_rgb *inout_sum);
/* Radiance of the pixels of a tile: the sum over lights. */
void lum_layers_sum(const struct lum_pass *pass, uint32_t tile, uint32_t n_pixels, struct lum_rgb *ret_radiance);

#endif
