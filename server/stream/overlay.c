#include "server/stream/overlay.h"

#include <string.h>

#include "core/accel/accel.h"
#include "core/interleave/interleave.h"

/* ---- kinds ---- */

static void set_colors(struct lum_overlay *o, const uint32_t *rgb, uint32_t n)
{
    o->n = n;
    for (uint32_t i = 0; i < n; i++)
        for (int c = 0; c < 3; c++)
            o->colors[i][c] = (uint8_t)(rgb[i] >> (16 - 8 * c));
}

static uint8_t class_of(const struct lum_overlay *o, double value)
{
    uint8_t i = 0;
    while (i + 1u < o->n && value >= o->limits[i])
        i++;
    return i;
}

_Static_assert((int)LUM_GUIDANCE_MAX <= (int)LUM_OVERLAY_CLASSES, "a class for each number of iterations");

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
    o->n = LUM_GUIDANCE_MAX;
    o->unit = "times refined";
    for (uint32_t i = 0; i < o->n; i++) {
        lum_tone_pixel(lum_guidance_color(i, LUM_GUIDANCE_MAX), 1.0, LUM_TONE_NONE, o->colors[i]);
        if (i + 1 < o->n)
            o->limits[i] = (double)i + 1.0;
    }
    for (size_t i = 0; i < (size_t)o->w * o->h; i++)
        o->classes[i] = class_of(o, (double)iterations[i]);
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
    set_colors(o, colors, LUM_ARRAY_LEN(colors));
    memcpy(o->limits, limits, sizeof limits);
    for (uint32_t y = 0; y < o->h; y++)
        for (uint32_t x = 0; x < o->w; x++) {
            float rel = lum_error_map_at(&map, map.rel, x, y);
            bool known = isfinite(rel);
            o->classes[(size_t)y * o->w + x] = known ? class_of(o, (double)rel) : (uint8_t)LUM_OVERLAY_NONE;
            *ret_made = *ret_made || known;
        }
    lum_error_map_finish(&map);
    return LUM_OK;
}

/* The least of 1, 2 and 5 times a power of ten that is no less than x > 0. */
static double round_up(double x)
{
    double ten = pow(10.0, floor(log10(x)));
    static const double steps[] = {1.0, 2.0, 5.0};
    for (size_t i = 0; i < LUM_ARRAY_LEN(steps); i++)
        if (x <= steps[i] * ten * (1.0 + 1e-9)) /* it is one itself, but for rounding */
            return steps[i] * ten;
    return 10.0 * ten;
}

/* All but one in a hundred pixels that have a value are below the highest limit: lamps, and what is next to them, are
 * above it. */
#define BELOW_TOP 0.99

/* The value that a share of those above 0 do not reach, to a twelfth of an octave. 0: there is none. */
static double percentile(const float *values, size_t n_values, double share)
{
    enum { BINS = 1536, PER_OCTAVE = 12, LOWEST = -64 };
    uint64_t n[BINS] = {0}, all = 0, below = 0;
    for (size_t i = 0; i < n_values; i++) {
        if (!(values[i] > 0.0f))
            continue;
        int bin = (int)((log2((double)values[i]) - LOWEST) * PER_OCTAVE);
        n[bin < 0 ? 0 : bin < BINS ? bin : BINS - 1]++;
        all++;
    }
    if (all == 0)
        return 0.0;
    uint32_t i = 0;
    for (; i + 1 < BINS && (double)(below + n[i]) < share * (double)all; i++)
        below += n[i];
    return exp2((double)(i + 1) / PER_OCTAVE + LOWEST);
}

/* What a map of light is of: cd/m2, or lx. */
struct field {
    float *values; /* w * h; NAN: there is none */
    bool illuminance;
};

/* A surface that the eye sees has an illuminance, whatever it is made of; background and lamps that are no objects have
 * none. */
static enum lum_status take_field(struct field *f, const struct lum_overlay_source *source, struct lum_error *err)
{
    const struct lum_film *film = lum_view_film(source->view);
    size_t n = (size_t)film->w * film->h;
    struct lum_aovs seen = {0};
    enum lum_status status = LUM_OK;
    f->values = lum_calloc(n, sizeof *f->values);
    if (!f->values)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a map of %u x %u", film->w, film->h);
    if (f->illuminance)
        status = lum_view_aovs(source->view, source->snapshot, source->settings, &seen, err);
    for (size_t i = 0; i < n && !status; i++) {
        float l = lum_luminance(lum_film_mean(film, (uint32_t)(i % film->w), (uint32_t)(i / film->w)));
        f->values[i] = !f->illuminance ? l : seen.instance[i] == LUM_NO_OBJECT ? NAN : l * LUM_PI;
    }
    return status;
}

/* False colour. Steps of 1, 2, 5, 10 ... up to what the picture needs: they change rarely while a lamp is dimmed. */
static bool color_field(struct lum_overlay *o, const struct field *f)
{
    static const uint32_t colors[LUM_OVERLAY_CLASSES] = {0x1b1440, 0x2a2f8f, 0x2457c5, 0x1a86c9, 0x16a8a0, 0x3dbb5f,
                                                         0x8cc63f, 0xd6c72f, 0xf5a623, 0xf2711c, 0xe2342d, 0xffd9ec};
    size_t n = (size_t)o->w * o->h;
    double top = percentile(f->values, n, BELOW_TOP);
    if (!(top > 0.0))
        return false;
    o->unit = f->illuminance ? "lx" : "cd/m2";
    o->opaque = true;
    set_colors(o, colors, LUM_OVERLAY_CLASSES);
    o->limits[o->n - 2] = round_up(top);
    for (uint32_t i = o->n - 2; i > 0; i--) /* 5 is followed by 2, others by their half */
        o->limits[i - 1] = round_up(o->limits[i] * 0.39);
    for (size_t i = 0; i < n; i++)
        o->classes[i] = isnan(f->values[i]) ? (uint8_t)LUM_OVERLAY_NONE : class_of(o, (double)f->values[i]);
    return true;
}

static enum lum_status make_field(struct lum_overlay *o, const char *name, const struct lum_overlay_source *source,
                                  bool *ret_made, struct lum_error *err)
{
    struct field f = {.illuminance = lum_overlay_is_illuminance(name)};
    enum lum_status status = LUM_OK;
    if (f.illuminance == source->settings->illuminance) /* else the picture is not of what the map is to show */
        status = take_field(&f, source, err);
    if (!status && f.values)
        *ret_made = color_field(o, &f);
    lum_free(f.values);
    return status;
}

/* ---- */

void lum_overlay_finish(struct lum_overlay *overlay)
{
    lum_free(overlay->classes);
    *overlay = (struct lum_overlay){0};
}

bool lum_overlay_is_kind(const char *name)
{
    enum lum_effect unused;
    return strcmp(name, "none") == 0 || strcmp(name, "luminance") == 0 || lum_overlay_is_illuminance(name) ||
           strcmp(name, "error") == 0 || has_guidance(name, &unused);
}

bool lum_overlay_is_illuminance(const char *name)
{
    return strcmp(name, "illuminance") == 0;
}

static bool reserve(struct lum_overlay *o, const struct lum_film *film)
{
    uint8_t *classes = o->classes;
    if (!classes || o->w != film->w || o->h != film->h) {
        lum_free(classes);
        classes = lum_calloc((size_t)film->w * film->h, sizeof *classes);
    }
    *o = (struct lum_overlay){.w = film->w, .h = film->h, .classes = classes};
    return classes != NULL;
}

enum lum_status lum_overlay_make(struct lum_overlay *overlay, const char *name, const struct lum_overlay_source *source,
                                 struct lum_error *err)
{
    const struct lum_film *film = lum_view_film(source->view);
    enum lum_effect effect;
    enum lum_status status = LUM_OK;
    bool made = false;
    if (strcmp(name, "none") != 0) {
        if (!reserve(overlay, film))
            return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a map of %u x %u", film->w, film->h);
        if (has_guidance(name, &effect))
            made = source->settings->method->ais && make_guidance(overlay, lum_view_guidance(source->view, effect));
        else if (strcmp(name, "error") == 0)
            status = make_error(overlay, source->view, &made, err);
        else
            status = make_field(overlay, name, source, &made, err);
    }
    if (!made)
        lum_overlay_finish(overlay);
    return status;
}

static uint8_t mix(uint8_t grey, uint8_t code)
{
    return (uint8_t)((grey + code + 1) / 2);
}

void lum_overlay_paint(const struct lum_overlay *overlay, const struct lum_frame_header *tile, uint8_t *inout_rgba)
{
    if (!overlay || !overlay->classes)
        return;
    for (uint32_t y = 0; y < tile->h; y++)
        for (uint32_t x = 0; x < tile->w; x++) {
            uint8_t *p = inout_rgba + ((size_t)y * tile->w + x) * 4;
            /* Rec.709 luma, in 256ths */
            uint8_t grey = (uint8_t)((54u * p[0] + 183u * p[1] + 19u * p[2] + 128u) / 256u);
            uint8_t class = overlay->classes[(size_t)(tile->y + y) * overlay->w + tile->x + x];
            for (int c = 0; c < 3; c++)
                p[c] = class == LUM_OVERLAY_NONE ? grey
                       : overlay->opaque         ? overlay->colors[class][c]
                                                 : mix(grey, overlay->colors[class][c]);
        }
}
