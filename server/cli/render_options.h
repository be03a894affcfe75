/* Options of `lumend render`. */
#ifndef LUM_SERVER_CLI_RENDER_OPTIONS_H
#define LUM_SERVER_CLI_RENDER_OPTIONS_H

#include <stdio.h>

#include "core/base/base.h"
#include "core/cache/caches.h"
#include "core/film/false_color.h"
#include "core/method/method.h"
#include "protocol/record/record.h"
#include "server/net/address.h"

struct lum_render_options {
    /* as given, borrowed from argv; NULL: not given */
    const char *scene, *edits, *out, *method, *camera, *assets, *stats, *isa;
    uint32_t w, h;     /* 0: the default */
    uint32_t n_frames; /* 0: not given: one frame, after all edits */
    double fps;
    uint32_t spp;         /* 0: not given */
    double time_s, error; /* 0: not given */
    bool panorama, light_groups, has_seed, has_storage, deterministic, help;
    bool exr;         /* out is .exr, else .png */
    uint32_t threads; /* 0: all */
    uint32_t seed;
    uint32_t effects_off, effects_on; /* bits LUM_EFFECT_BIT */
    uint32_t vpls;                    /* 0: the scene's */
    enum lum_storage storage;
    double cache_accuracy;      /* 0: the scene's */
    bool has_exposure;          /* of a .png; else the scene's */
    struct lum_opt exposure_ev; /* not set: automatic */
    const char *tone_map;       /* of a .png; NULL: the scene's */
    const char *overlay;        /* of a .png; NULL: none */
    struct lum_false_color false_color;
    bool lines, only_lines; /* isolines over it; over the grey picture */
    bool has_false_color;   /* one of these was given */
    bool illuminance;       /* a layer of an .exr */
    bool legend;            /* the scale is part of the picture */
    struct lum_address tev; /* host "": not given */
};

/* A failure here is a usage error; err->field names the option. */
LUM_MUST_USE enum lum_status lum_render_options_parse(int argc, char **argv, struct lum_render_options *ret_options,
                                                      struct lum_error *err);

/* `out` with its %d or %0Nd replaced by the frame's number; a copy when there is none. False: it does not fit. */
bool lum_render_frame_path(const char *out, uint32_t frame, char *ret_path, size_t n_path);

#endif
