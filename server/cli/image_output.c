#include "server/cli/image_output.h"

#include <stdio.h>
#include <string.h>

#include "core/accel/accel.h"
#include "server/stream/png.h"

enum { PNG_FILE_LEVEL = 6 }; /* zlib's own choice: a file is kept, and nobody waits as for a frame */

struct lum_rgb *lum_film_pixels(const struct lum_film *film)
{
    struct lum_rgb *pixels = lum_calloc((size_t)film->w * film->h, sizeof *pixels);
    for (uint32_t y = 0; pixels && y < film->h; y++)
        for (uint32_t x = 0; x < film->w; x++)
            pixels[(size_t)y * film->w + x] = lum_film_mean(film, x, y);
    return pixels;
}

enum lum_status lum_write_png(const char *path, const struct lum_png_output *o, struct lum_error *err)
{
    struct lum_canvas canvas;
    enum lum_status st = lum_paint_png(o, &canvas, err);
    if (st)
        return st;
    st = lum_png_write(path, &(struct lum_png){canvas.rgb, canvas.w, canvas.h, PNG_FILE_LEVEL}, err);
    lum_free(canvas.rgb);
    return st;
}

/* Channels of one picture, as they are gathered. */
struct channels {
    struct lum_exr_channel *list;
    uint32_t n;
};

static void add_channel(struct channels *c, const char *layer, const char *name, const float *pixels, size_t stride)
{
    struct lum_exr_channel *ch = &c->list[c->n++];
    snprintf(ch->name, sizeof ch->name, "%.58s%s%s", layer, layer[0] ? "." : "", name);
    ch->pixels = pixels;
    ch->stride = stride;
    ch->half = false;
}

static void add_rgb(struct channels *c, const char *layer, const struct lum_rgb *pixels)
{
    if (!pixels)
        return;
    add_channel(c, layer, "R", &pixels->r, 3);
    add_channel(c, layer, "G", &pixels->g, 3);
    add_channel(c, layer, "B", &pixels->b, 3);
}

static void add_aovs(struct channels *c, const struct lum_aovs *aovs, const float *ids)
{
    add_rgb(c, "albedo", aovs->albedo);
    if (aovs->normal_world) {
        add_channel(c, "N", "X", &aovs->normal_world->x, 3);
        add_channel(c, "N", "Y", &aovs->normal_world->y, 3);
        add_channel(c, "N", "Z", &aovs->normal_world->z, 3);
    }
    if (aovs->depth_m)
        add_channel(c, "", "Z", aovs->depth_m, 1);
    if (ids)
        add_channel(c, "", "id", ids, 1);
}

/* Maps are bytes, channels floats. False: memory is short. */
static bool add_guidance(struct channels *c, const struct lum_exr_output *o, float *maps[LUM_EFFECT_COUNT])
{
    size_t n = (size_t)o->w * o->h;
    for (int e = 0; e < LUM_EFFECT_COUNT; e++) {
        if (!o->guidance[e])
            continue;
        maps[e] = lum_calloc(n, sizeof *maps[e]);
        if (!maps[e])
            return false;
        for (size_t i = 0; i < n; i++)
            maps[e][i] = (float)o->guidance[e][i];
        add_channel(c, "guidance", lum_effect_names[e], maps[e], 1);
    }
    return true;
}

static bool add_errors(struct channels *c, const char *layer, const char *name, const struct lum_error_map *map,
                       double scale, float **ret_pixels)
{
    if (!map)
        return true;
    *ret_pixels = lum_calloc((size_t)map->w * map->h, sizeof **ret_pixels);
    if (!*ret_pixels)
        return false;
    for (uint32_t y = 0; y < map->h; y++)
        for (uint32_t x = 0; x < map->w; x++)
            (*ret_pixels)[(size_t)y * map->w + x] = (float)(scale * (double)lum_error_map_at(map, map->rms, x, y));
    add_channel(c, layer, name, *ret_pixels, 1);
    return true;
}

static bool add_illuminance(struct channels *c, const struct lum_film *film, float **ret_pixels)
{
    if (!film)
        return true;
    *ret_pixels = lum_calloc((size_t)film->w * film->h, sizeof **ret_pixels);
    if (!*ret_pixels)
        return false;
    for (uint32_t y = 0; y < film->h; y++)
        for (uint32_t x = 0; x < film->w; x++)
            (*ret_pixels)[(size_t)y * film->w + x] = LUM_PI * lum_luminance(lum_film_mean(film, x, y));
    add_channel(c, "illuminance", "Y", *ret_pixels, 1);
    return true;
}

/* Where channels go: to a file, or else to tev. */
struct sink {
    const char *path, *name;
    struct lum_tev *tev;
    bool begin;
};

static enum lum_status give(const struct sink *sink, const struct lum_exr_output *o, const struct channels *c,
                            struct lum_error *err)
{
    if (sink->path)
        return lum_exr_write(sink->path, o->w, o->h, c->list, c->n, o->attributes, o->n_attributes, err);
    return lum_tev_show(sink->tev, &(struct lum_tev_image){sink->name, sink->begin, o->w, o->h, c->list, c->n}, err);
}

static enum lum_status write_to(const struct sink *sink, const struct lum_exr_output *o, struct lum_error *err)
{
    size_t n = (size_t)o->w * o->h;
    float *ids = o->aovs.instance ? lum_calloc(n, sizeof *ids) : NULL;
    float *maps[LUM_EFFECT_COUNT] = {NULL}, *errors = NULL, *lux = NULL, *lux_errors = NULL;
    struct channels c = {.list = lum_calloc(14 + LUM_EFFECT_COUNT + (size_t)3 * o->n_layers, sizeof *c.list)};
    enum lum_status st = LUM_OK;
    if (!c.list || (o->aovs.instance && !ids) || !add_guidance(&c, o, maps) ||
        !add_errors(&c, "error", "Y", o->errors, 1.0, &errors) || !add_illuminance(&c, o->illuminance, &lux) ||
        !add_errors(&c, "illuminance", "error", o->illuminance_errors, LUM_PI_D, &lux_errors)) {
        st = lum_fail(err, LUM_ERR_NOMEM, "", "no memory to write %s", sink->path ? sink->path : "to tev");
        goto done;
    }
    for (size_t i = 0; ids && i < n; i++)
        ids[i] = o->aovs.instance[i] == LUM_NO_OBJECT ? 0.0f : (float)o->aovs.instance[i] + 1.0f;
    add_rgb(&c, "", o->beauty);
    for (uint32_t i = 0; i < o->n_layers; i++)
        add_rgb(&c, o->layers[i].name, o->layers[i].pixels);
    add_aovs(&c, &o->aovs, ids);
    st = give(sink, o, &c, err);
done:
    lum_free(c.list);
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        lum_free(maps[e]);
    lum_free(errors);
    lum_free(lux);
    lum_free(lux_errors);
    lum_free(ids);
    return st;
}

enum lum_status lum_write_exr(const char *path, const struct lum_exr_output *o, struct lum_error *err)
{
    return write_to(&(struct sink){.path = path}, o, err);
}

enum lum_status lum_show_exr(struct lum_tev *tev, const char *name, bool begin, const struct lum_exr_output *o,
                             struct lum_error *err)
{
    return write_to(&(struct sink){.name = name, .tev = tev, .begin = begin}, o, err);
}
