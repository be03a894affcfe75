/* Private to core/path: what the files of the path tracer share. A vertex is where a path is scattered. */
#ifndef LUM_CORE_PATH_VERTEX_H
#define LUM_CORE_PATH_VERTEX_H

#include "core/path/guide.h"
#include "core/path/wave.h"

/* Sampler pairs: the pixel filter's; each vertex then takes four. */
enum {
    LUM_WAVE_PAIR_PICK = LUM_WAVE_PAIR_PIXEL + 1,
    LUM_WAVE_PAIR_LIGHT,
    LUM_WAVE_PAIR_BSDF,
    LUM_WAVE_PAIR_ROULETTE,
    LUM_WAVE_PAIRS_PER_VERTEX = 4
};

/* Media have pairs of their own, beyond those of any vertex: what they take does not change a path. */
enum { LUM_WAVE_PAIRS_PER_MEDIUM = 3 };

static inline uint32_t lum_wave_pair(uint32_t depth, uint32_t pair)
{
    return pair + depth * LUM_WAVE_PAIRS_PER_VERTEX;
}

struct lum_vertex {
    const struct lum_bsdf *b;
    const struct lum_wave_fog *fog; /* on the segment that ended here; NULL: none */
    struct lum_vec3 p, wo;
    uint32_t depth;
    uint32_t lobes_off; /* of those that the surface has: what no path goes on by */
    struct lum_path_guide_locate guide;
};

/* Of the ray by which a path goes on. */
static inline enum lum_ray_kind lum_lobe_ray_kind(enum lum_lobe lobe)
{
    switch (lobe) {
    case LUM_LOBE_DIFFUSE:
    case LUM_LOBE_DIFFUSE_TRANSMIT:
        return LUM_RAY_INDIRECT_DIFFUSE;
    case LUM_LOBE_GLOSSY:
        return LUM_RAY_GLOSSY;
    case LUM_LOBE_REFLECT:
        return LUM_RAY_REFLECTION;
    case LUM_LOBE_TRANSMIT:
    case LUM_LOBE_GLOSSY_TRANSMIT:
        break;
    }
    return LUM_RAY_TRANSMISSION;
}

/* The effect that light counts as at a vertex: of, where it comes from there; or what brought the path there. */
static inline uint8_t lum_path_effect(const struct lum_path *path, enum lum_effect of)
{
    return path->effect == LUM_EFFECT_ANTIALIAS ? (uint8_t)of : path->effect;
}

/* Density with which the path goes on to wi, given the BSDF's own. */
static inline float lum_vertex_pdf(const struct lum_vertex *v, struct lum_vec3 wi, float pdf_sa)
{
    return v->guide.share > 0.0f ? lum_path_guide_bsdf_pdf(&v->guide, v->b, wi, pdf_sa) : pdf_sa;
}

/* The direct light of a light is left out: what it lights by way of a diffuse surface is another effect, and stays. */
static inline bool lum_wave_leaves_out(const struct lum_wave *w, uint32_t light)
{
    return w->lights_off && (w->lights_off & LUM_EFFECT_BIT(lum_light_effect(&w->snapshot->lights.lights[light])));
}

/* As lum_lights_pick_from has it: what lies below is dark to what lets no light through. */
static inline struct lum_vec3 lum_vertex_lit_normal(const struct lum_bsdf *b)
{
    return b->glass > 0.0f || b->far_prob > 0.0f ? lum_v3(0.0f, 0.0f, 0.0f) : b->frame.n;
}

/* Vertices that a path has behind it and that its greatest depth counts. */
static inline uint32_t lum_path_depth(const struct lum_path *path, uint32_t depth)
{
    uint32_t n = path->n_scattered;
    return depth - path->n_panes - (n > LUM_WAVE_SCATTERED_MAX ? n - LUM_WAVE_SCATTERED_MAX : 0);
}

/* ---- wave.c ---- */
/* Roulette keeps the mean: survivors carry what the dead would have. False: the path dies. */
bool lum_wave_roulette(const struct lum_wave *w, struct lum_path *path, uint32_t depth);

/* ---- left_out.c ---- */
/* Effects that go on from a surface. */
uint32_t lum_lobe_effects(const struct lum_bsdf *b);
/* f |cos| towards a light, weighted against the lobes that paths go on by; the others have the light to themselves.
 * pdf: of the light sample. */
struct lum_rgb lum_vertex_respond_in_part(const struct lum_vertex *at, struct lum_vec3 wi, float pdf);
/* False: the path does not go on by this lobe. Else, where a lobe that covers the same directions is left out, the
 * sample becomes one of what stays. */
bool lum_vertex_keep_lobe(const struct lum_vertex *at, struct lum_bsdf_sample *inout_sample);

/* ---- wave_light.c ---- */
void lum_wave_bring_home(struct lum_wave *w, const struct lum_gain *gain, uint8_t effect);
/* Light that is sampled from a vertex. Its shadow rays are traced together: what it gains adds up in the same order
 * whatever batch it is in. */
void lum_wave_sample_lights(struct lum_wave *w, const struct lum_path *path, const struct lum_vertex *v, float u_pick);
/* Light on its way to the eye: with a shadow ray, which was just pushed, when that comes back; else at once. */
void lum_wave_keep_light(struct lum_wave *w, const struct lum_gain *gain, enum lum_ray_kind kind, uint8_t effect,
                         bool has_ray);
/* What was sampled comes home where nothing is in its way. */
void lum_wave_trace_shadows(struct lum_wave *w);
/* Ray i of a batch, which ends at distance t or goes on for ever. */
void lum_wave_add_segment(struct lum_wave *w, const struct lum_rays *rays, uint32_t i, float t, uint32_t slot);

/* ---- wave_fog.c ---- */
/* The batch came back: what its segments gain and lose in media, and which paths are scattered there. */
void lum_wave_cross_media(struct lum_wave *w, uint32_t depth);
/* Ray i of the batch, which fog scatters: the path that goes on from there. */
void lum_wave_scatter_in_fog(struct lum_wave *w, uint32_t i, uint32_t depth);
/* pdf with which lum_medium_scatter would have found light i from path->from, given that of a light sample there. */
float lum_wave_origin_pdf(const struct lum_wave *w, const struct lum_path *path, uint32_t light, float pdf_sa);

#endif
