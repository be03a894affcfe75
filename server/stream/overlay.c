#include "server/stream/overlay.h"

#include <string.h>

#include "core/accel/accel.h"
#include "core/interleave/interleave.h"

/* ---- kinds ---- */

static void set_colors(struct lum_scale *s, const uint32_t *rgb, uint32_t n)
{
    s->n_colors = n;
    s->n_limits = n - 1;
    for (uint32_t i = 0; i < n; i++)
        for (int c = 0; c < 3; c++)
            s->colors[i][c] = (uint8_t)(rgb[i] >> (16 - 8 * c));
}

_Static_assert((uint32_t)LUM_GUIDANCE_MAX <= LUM_SCALE_LIMITS, "a class for each number of iterations");

static bool has_guidance(const char *name, enum lum_effect *ret_effect)
{
    static const char map[] = "guidance_";
    size_t n = sizeof map - 1;
    return strncmp(name, map, n) == 0 && lum_effect_find(name + n, strlen(name + n), ret_effect);
}

/* How often a pixel's tile of the pattern was refined, the first time included. */
static bool make_guidance(struct lum_overlay *o, const uint8_t *iterations)
{
    if (!iterations)
        return false;
    struct lum_scale *s = &o->scale;
    o->unit = "times refined";
    s->n_colors = LUM_GUIDANCE_MAX;
    s->n_limits = LUM_GUIDANCE_MAX - 1;
    for (uint32_t i = 0; i < s->n_colors; i++) {
        lum_tone_pixel(lum_guidance_color(i, LUM_GUIDANCE_MAX), 1.0, LUM_TONE_NONE, s->colors[i]);
        s->limits[i] = (double)i + 1.0;
    }
    for (size_t i = 0; i < (size_t)o->w * o->h; i++)
        o->classes[i] = (uint8_t)lum_scale_color(s, (double)iterations[i]);
    return true;
}

/* Error over the light around. */
static enum lum_status make_error(struct lum_overlay *o, const struct lum_view *view, bool *ret_made,
                                  struct lum_error *err)
{
    static const uint32_t colors[] = {0x2457c5, 0x16a8a0, 0x3dbb5f, 0xd6c72f, 0xf5a623, 0xf2711c, 0xe2342d, 0xb0126f};
    static const double limits[] = {0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5};
    _Static_assert(LUM_ARRAY_LEN(colors) == LUM_ARRAY_LEN(limits) + 1, "a limit between each two");
    struct lum_error_map map;
    enum lum_status status = lum_view_error_map(view, &map, err);
    if (status)
        return status;
    o->unit = "relative";
    set_colors(&o->scale, colors, LUM_ARRAY_LEN(colors));
    memcpy(o->scale.limits, limits, sizeof limits);
    for (uint32_t y = 0; y < o->h; y++)
        for (uint32_t x = 0; x < o->w; x++) {
            float rel = lum_error_map_at(&map, map.rel, x, y);
            bool known = isfinite(rel);
            uint32_t class = known ? lum_scale_color(&o->scale, (double)rel) : LUM_OVERLAY_NONE;
            o->classes[(size_t)y * o->w + x] = (uint8_t) class;
            *ret_made = *ret_made || known;
        }
    lum_error_map_finish(&map);
    return LUM_OK;
}

/* As of clay in an even light from above: to find one's way where there is none yet. The first grey is background. */
static enum lum_status make_shapes(struct lum_overlay *o, const struct lum_overlay_source *source,
                                   struct lum_error *err)
{
    enum { GREYS = 64, DARKEST = 24, LIGHTEST = 200 }; /* sRGB: what is dark is told apart, and nothing is white */
    const struct lum_vec3 from = lum_normalize(lum_v3(0.4f, 0.8f, 0.5f));
    struct lum_aovs seen = {0};
    enum lum_status status = lum_view_aovs(source->view, source->snapshot, source->settings, &seen, err);
    if (status)
        return status;
    o->opaque = true;
    o->scale.n_colors = GREYS;
    for (int i = 0; i < GREYS; i++)
        memset(o->scale.colors[i], DARKEST + (LIGHTEST - DARKEST) * i / (GREYS - 1), 3);
    for (size_t i = 0; i < (size_t)o->w * o->h; i++) {
        float lit = 0.5f + 0.5f * lum_dot(seen.normal_world[i], from);
        o->classes[i] = seen.instance[i] == LUM_NO_OBJECT ? 0 : (uint8_t)(1.0f + lit * (GREYS - 1.5f));
    }
    return LUM_OK;
}

/* What a map of light is of: cd/m2, or lx. */
struct field {
    float *values;        /* w * h; NAN: there is none */
    struct lum_aovs seen; /* where it is asked for */
    bool illuminance;
};

/* A surface that the eye sees has an illuminance, whatever it is made of; background and lamps that are no objects have
 * none. */
static enum lum_status take_field(struct field *f, bool lines, const struct lum_overlay_source *source,
                                  struct lum_error *err)
{
    const struct lum_film *film = lum_view_film(source->view);
    size_t n = (size_t)film->w * film->h;
    enum lum_status status = LUM_OK;
    f->values = lum_calloc(n, sizeof *f->values);
    if (!f->values)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a map of %u x %u", film->w, film->h);
    if (f->illuminance || lines)
        status = lum_view_aovs(source->view, source->snapshot, source->settings, &f->seen, err);
    for (size_t i = 0; i < n && !status; i++) {
        float l = lum_luminance(lum_film_mean(film, (uint32_t)(i % film->w), (uint32_t)(i / film->w)));
        f->values[i] = !f->illuminance ? l : f->seen.instance[i] == LUM_NO_OBJECT ? NAN : l * LUM_PI;
    }
    return status;
}

/* Isolux lines, or those of luminance. */
static enum lum_status draw_lines(struct lum_overlay *o, const struct field *f, const struct lum_overlay_source *source,
                                  struct lum_error *err)
{
    struct lum_error_map errors;
    enum lum_status status = lum_view_error_map(source->view, &errors, err);
    if (status)
        return status;
    const struct lum_isolines of = {.w = o->w,
                                    .h = o->h,
                                    .values = f->values,
                                    .seen = &f->seen,
                                    .camera = &source->settings->camera,
                                    .errors = &errors,
                                    .per_error = f->illuminance ? LUM_PI_D : 1.0,
                                    .levels = o->scale.limits,
                                    .n_levels = o->scale.n_limits};
    o->lines = lum_calloc((size_t)o->w * o->h, sizeof *o->lines);
    status = o->lines ? lum_isolines_find(&of, o->lines, err)
                      : lum_fail(err, LUM_ERR_NOMEM, "", "no memory for lines over %u x %u pixels", o->w, o->h);
    if (!status)
        o->n_labels = lum_isolines_label(o->lines, o->w, o->h, o->labels);
    lum_error_map_finish(&errors);
    return status;
}

static void fill(struct lum_overlay *o, const struct field *f, bool colors)
{
    for (size_t i = 0; i < (size_t)o->w * o->h; i++) {
        bool has_color = colors && !isnan(f->values[i]);
        o->classes[i] = (uint8_t)(has_color ? lum_scale_color(&o->scale, (double)f->values[i]) : LUM_OVERLAY_NONE);
    }
}

static enum lum_status make_field(struct lum_overlay *o, const struct lum_overlay_want *want,
                                  const struct lum_overlay_source *source, bool *ret_made, struct lum_error *err)
{
    struct field f = {.illuminance = lum_overlay_is_illuminance(want->name)};
    enum lum_status status = LUM_OK;
    if (f.illuminance == source->settings->illuminance) /* else the picture is not of what the map is to show */
        status = take_field(&f, want->lines, source, err);
    if (!status && f.values && lum_scale_make(&want->colors, f.values, (size_t)o->w * o->h, &o->scale)) {
        *ret_made = o->opaque = o->false_color = true;
        o->plain = want->fill;
        o->unit = f.illuminance ? "lx" : "cd/m2";
        fill(o, &f, want->fill);
        if (want->lines)
            status = draw_lines(o, &f, source, err);
    }
    lum_free(f.values);
    return status;
}

/* ---- */

void lum_overlay_finish(struct lum_overlay *overlay)
{
    lum_free(overlay->classes);
    lum_free(overlay->lines);
    *overlay = (struct lum_overlay){0};
}

bool lum_overlay_is_kind(const char *name)
{
    enum lum_effect unused;
    return strcmp(name, "none") == 0 || strcmp(name, "luminance") == 0 || lum_overlay_is_illuminance(name) ||
           strcmp(name, "error") == 0 || strcmp(name, "shapes") == 0 || has_guidance(name, &unused);
}

bool lum_overlay_is_illuminance(const char *name)
{
    return strcmp(name, "illuminance") == 0;
}

static bool reserve(struct lum_overlay *o, const struct lum_film *film)
{
    uint8_t *classes = o->classes;
    lum_free(o->lines);
    if (!classes || o->w != film->w || o->h != film->h) {
        lum_free(classes);
        classes = lum_calloc((size_t)film->w * film->h, sizeof *classes);
    }
    *o = (struct lum_overlay){.w = film->w, .h = film->h, .classes = classes};
    return classes != NULL;
}

enum lum_status lum_overlay_make(struct lum_overlay *overlay, const struct lum_overlay_want *want,
                                 const struct lum_overlay_source *source, struct lum_error *err)
{
    const struct lum_film *film = lum_view_film(source->view);
    enum lum_effect effect;
    enum lum_status status = LUM_OK;
    bool made = false;
    if (strcmp(want->name, "none") != 0) {
        if (!reserve(overlay, film))
            return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a map of %u x %u", film->w, film->h);
        if (has_guidance(want->name, &effect))
            made = source->settings->method->ais && make_guidance(overlay, lum_view_guidance(source->view, effect));
        else if (strcmp(want->name, "error") == 0)
            status = make_error(overlay, source->view, &made, err);
        else if (strcmp(want->name, "shapes") == 0)
            made = !(status = make_shapes(overlay, source, err));
        else
            status = make_field(overlay, want, source, &made, err);
    }
    if (!made || status)
        lum_overlay_finish(overlay);
    return status;
}

static uint8_t mix(uint8_t grey, uint8_t code)
{
    return (uint8_t)((grey + code + 1) / 2);
}

/* Rec.709 luma, in 256ths */
static uint8_t luma(const uint8_t *p)
{
    return (uint8_t)((54u * p[0] + 183u * p[1] + 19u * p[2] + 128u) / 256u);
}

/* A line is seen on any colour: the greater contrast of WCAG is with white below a luma of some 118. */
enum { LINE_LIGHT_BELOW = 118 };

#define NO_VALUE 112 /* grey of what has none, on a plain map: in no palette */

static void paint_pixel(const struct lum_overlay *o, size_t at, uint8_t *inout_p)
{
    uint8_t grey = o->plain ? NO_VALUE : luma(inout_p), class = o->classes[at];
    for (int c = 0; c < 3; c++)
        inout_p[c] = class == LUM_OVERLAY_NONE ? grey
                     : o->opaque               ? o->scale.colors[class][c]
                                               : mix(grey, o->scale.colors[class][c]);
    if (o->lines && o->lines[at])
        memset(inout_p, luma(inout_p) < LINE_LIGHT_BELOW ? 255 : 0, 3);
}

void lum_overlay_paint(const struct lum_overlay *overlay, const struct lum_frame_header *tile, uint8_t *inout_rgba)
{
    if (!overlay || !overlay->classes)
        return;
    for (uint32_t y = 0; y < tile->h; y++)
        for (uint32_t x = 0; x < tile->w; x++)
            paint_pixel(overlay, (size_t)(tile->y + y) * overlay->w + tile->x + x,
                        inout_rgba + ((size_t)y * tile->w + x) * 4);
}
