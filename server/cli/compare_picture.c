#include "server/cli/compare_picture.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "core/film/film.h"
#include "core/math/color.h"
#include "server/stream/png.h"

#define MAX_SIDE 32768u /* px, for pictures of others than this renderer; what they have in all counts in 32 bits */

static size_t pixel_count(const struct lum_compared *p)
{
    return (size_t)p->w * p->h;
}

/* ---- files ---- */

static enum lum_status read_exr(struct lum_compared *p, struct lum_error *err)
{
    static const char *const names[3] = {"R", "G", "B"};
    enum lum_status st = lum_exr_read(p->path, MAX_SIDE, MAX_SIDE, &p->exr, err);
    if (st)
        return st;
    p->w = p->exr.w;
    p->h = p->exr.h;
    for (int k = 0; k < 3; k++) {
        uint32_t i = 0;
        while (i < p->exr.n_channels && strcmp(p->exr.names[i], names[k]) != 0)
            i++;
        if (i == p->exr.n_channels)
            return lum_fail(err, LUM_ERR_UNSUPPORTED, "", "%s has no channel %s", p->path, names[k]);
        p->rgb[k] = p->exr.pixels + i * pixel_count(p);
    }
    return LUM_OK;
}

static enum lum_status read_png(struct lum_compared *p, struct lum_error *err)
{
    struct lum_png_image image;
    enum lum_status st = lum_png_read(p->path, MAX_SIDE, &image, err);
    if (st)
        return st;
    p->w = image.w;
    p->h = image.h;
    p->shown = image.rgb;
    p->linear = lum_calloc(pixel_count(p), 3 * sizeof *p->linear);
    if (!p->linear)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the light of %s", p->path);
    for (size_t k = 0; k < 3; k++) {
        p->rgb[k] = p->linear + k * pixel_count(p);
        for (size_t i = 0; i < pixel_count(p); i++)
            p->rgb[k][i] = lum_srgb8_to_linear[p->shown[3 * i + k]];
    }
    return LUM_OK;
}

enum lum_status lum_compared_read(const char *path, struct lum_compared *ret_picture, struct lum_error *err)
{
    struct lum_compared p = {.path = path};
    unsigned char begin[4] = {0};
    FILE *f = fopen(path, "rb");
    if (!f)
        return lum_fail(err, LUM_ERR_IO, "", "cannot read %s: %s", path, strerror(errno));
    size_t n = fread(begin, 1, sizeof begin, f);
    fclose(f);
    p.is_png = n == sizeof begin && memcmp(begin, "\x89PNG", sizeof begin) == 0;
    enum lum_status st = p.is_png ? read_png(&p, err) : read_exr(&p, err);
    if (st)
        lum_compared_finish(&p);
    else
        *ret_picture = p;
    return st;
}

void lum_compared_finish(struct lum_compared *p)
{
    lum_exr_finish(&p->exr);
    lum_free(p->linear);
    lum_free(p->shown);
    *p = (struct lum_compared){0};
}

/* ---- as a display shows it ---- */

static enum lum_status fill_film(const struct lum_compared *p, struct lum_film *film, struct lum_error *err)
{
    uint64_t nonfinite = 0; /* counted by who compares */
    enum lum_status st = lum_film_init(film, p->w, p->h, err);
    for (uint32_t y = 0; !st && y < p->h; y++)
        for (uint32_t x = 0; x < p->w; x++) {
            size_t i = (size_t)y * p->w + x;
            lum_film_add(film, x, y, 0, lum_rgb(p->rgb[0][i], p->rgb[1][i], p->rgb[2][i]), &nonfinite);
        }
    return st;
}

enum lum_status lum_compared_exposure(const struct lum_compared *p, double *ret_ev100, struct lum_error *err)
{
    struct lum_film film;
    enum lum_status st = fill_film(p, &film, err);
    if (st)
        return st;
    *ret_ev100 = lum_exposure_auto(&film);
    lum_film_finish(&film);
    return LUM_OK;
}

enum lum_status lum_compared_show(struct lum_compared *p, double ev100, struct lum_error *err)
{
    struct lum_film film;
    if (p->shown)
        return LUM_OK;
    enum lum_status st = fill_film(p, &film, err);
    if (st)
        return st;
    uint8_t *rgba = lum_calloc(pixel_count(p), 4);
    if (rgba) {
        const struct lum_display display = {.ev100 = ev100, .tone = LUM_TONE_AGX};
        lum_film_resolve(&film, 0, 0, p->w, p->h, &display, rgba, (size_t)4 * p->w);
        for (size_t i = 0; i < pixel_count(p); i++) /* packed in place: the source is never behind the target */
            memmove(rgba + 3 * i, rgba + 4 * i, 3);
        p->shown = rgba;
    } else {
        st = lum_fail(err, LUM_ERR_NOMEM, "", "no memory to show %s", p->path);
    }
    lum_film_finish(&film);
    return st;
}
