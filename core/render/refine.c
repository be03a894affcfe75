#include "core/render/refine.h"

#include <string.h>

void lum_refine_finish(struct lum_refinement *r)
{
    lum_film_finish(&r->truth);
    lum_free(r->tile_spp);
    lum_free(r->frame);
    lum_free(r->errors);
    *r = (struct lum_refinement){0};
}

enum lum_status lum_refine_init(struct lum_refinement *r, const struct lum_tiling *t, struct lum_error *err)
{
    enum lum_status status = lum_film_init(&r->truth, t->w, t->h, err);
    if (status != LUM_OK)
        return status;
    r->tile_spp = lum_calloc(t->n, sizeof *r->tile_spp);
    r->errors = lum_calloc(t->n, sizeof *r->errors);
    r->frame = lum_calloc((size_t)t->w * t->h, sizeof *r->frame);
    if (r->tile_spp && r->errors && r->frame)
        return LUM_OK;
    lum_refine_finish(r);
    return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory to refine a picture of %u x %u", t->w, t->h);
}

void lum_refine_begin(struct lum_refinement *r, const struct lum_tiling *t)
{
    memset(r->tile_spp, 0, t->n * sizeof *r->tile_spp);
    r->error_rel = (double)NAN;
    r->taken = r->finest = false;
    r->n_frames = 1;
    r->next_frame_spp = 2;
}

void lum_refine_take(struct lum_refinement *r, const struct lum_tiling *t, const struct lum_film *frame)
{
    for (uint32_t y = 0; y < t->h; y++)
        for (uint32_t x = 0; x < t->w; x++)
            r->frame[(size_t)y * t->w + x] = lum_film_mean(frame, x, y);
    r->taken = true;
}

/* ---- what both are worth ---- */

static double half_luminance(const struct lum_film *film, int half, size_t i)
{
    const double *s = &film->half[half][3 * i];
    double n = (double)film->n[half][i];
    return n > 0.0 ? (0.2126 * s[0] + 0.7152 * s[1] + 0.0722 * s[2]) / n : 0.0;
}

static void measure_tile(struct lum_refinement *r, const struct lum_tiling *t, uint32_t tile)
{
    struct lum_tile_rect rect = lum_tile_at(t, tile);
    struct lum_tile_error e = {0};
    for (uint32_t y = rect.y; y < rect.y + rect.h; y++)
        for (uint32_t x = rect.x; x < rect.x + rect.w; x++) {
            size_t i = (size_t)y * t->w + x;
            double a = half_luminance(&r->truth, 0, i), b = half_luminance(&r->truth, 1, i);
            double frame = (double)lum_luminance(r->frame[i]);
            e.frame += (frame - a) * (frame - b);
            e.noise += (a - b) * (a - b) * 0.25;
            e.mean += (a + b) * 0.5;
        }
    r->errors[tile] = e;
}

/* The frame is never believed to be better than this, relative to the mean: so that the samples take over in the end,
 * and an estimate that noise drove below 0 does no harm. */
#define FRAME_ERROR_MIN 0.01

/* How much worse the eye takes grain than a smooth error of the same square: a picture that rests must not get worse to
 * look at. Samples take over where their noise is a quarter of the frame's error. */
#define GRAIN 16.0

static void weigh_tile(struct lum_refinement *r, const struct lum_tiling *t, uint32_t tile)
{
    uint32_t tx = tile % t->nx, ty = tile / t->nx;
    double frame = 0.0, noise = 0.0, mean = 0.0, pixels = 0.0;
    for (uint32_t y = ty > 0 ? ty - 1 : 0; y <= ty + 1 && y < t->ny; y++)
        for (uint32_t x = tx > 0 ? tx - 1 : 0; x <= tx + 1 && x < t->nx; x++) {
            const struct lum_tile_error *e = &r->errors[y * t->nx + x];
            struct lum_tile_rect rect = lum_tile_at(t, y * t->nx + x);
            frame += e->frame;
            noise += e->noise;
            mean += e->mean;
            pixels += (double)rect.w * rect.h;
        }
    double least = FRAME_ERROR_MIN * mean / pixels, e = fmax(frame / pixels, least * least), v = noise / pixels;
    r->errors[tile].weight = e > 0.0 ? (float)(e / (e + GRAIN * v)) : 1.0f;
}

/* The frame's error is measured against noise, so its sum may come out below what the weights believe, even below 0. */
static double blend_error(const struct lum_refinement *r, const struct lum_tiling *t)
{
    double noise = 0.0, frame = 0.0, least = 0.0, mean = 0.0, n = (double)t->w * t->h;
    for (uint32_t i = 0; i < t->n; i++) {
        const struct lum_tile_error *e = &r->errors[i];
        struct lum_tile_rect rect = lum_tile_at(t, i);
        double w = (double)e->weight, rest = (1.0 - w) * (1.0 - w), floor = FRAME_ERROR_MIN * e->mean;
        noise += w * w * e->noise;
        frame += rest * e->frame;
        least += rest * floor * floor / ((double)rect.w * rect.h);
        mean += e->mean;
    }
    return mean > 0.0 ? sqrt((noise + fmax(frame, least)) / n) / (mean / n) : 0.0;
}

/* ---- the blend ---- */

/* Weight at a pixel: bilinear between the centres of tiles, so that tiles do not show. */
static float weight_at(const struct lum_refinement *r, const struct lum_tiling *t, uint32_t x, uint32_t y)
{
    float fx = lum_clamp(((float)x + 0.5f) / (float)t->side - 0.5f, 0.0f, (float)(t->nx - 1));
    float fy = lum_clamp(((float)y + 0.5f) / (float)t->side - 0.5f, 0.0f, (float)(t->ny - 1));
    uint32_t x0 = (uint32_t)fx, y0 = (uint32_t)fy, x1 = x0 + 1 < t->nx ? x0 + 1 : x0, y1 = y0 + 1 < t->ny ? y0 + 1 : y0;
    float u = fx - (float)x0, v = fy - (float)y0;
    const struct lum_tile_error *e = r->errors;
    float top = e[y0 * t->nx + x0].weight * (1.0f - u) + e[y0 * t->nx + x1].weight * u;
    float bottom = e[y1 * t->nx + x0].weight * (1.0f - u) + e[y1 * t->nx + x1].weight * u;
    return top * (1.0f - v) + bottom * v;
}

void lum_refine_blend(struct lum_refinement *r, const struct lum_tiling *t, struct lum_film *film, uint64_t *nonfinite)
{
    for (uint32_t i = 0; i < t->n; i++)
        measure_tile(r, t, i);
    for (uint32_t i = 0; i < t->n; i++)
        weigh_tile(r, t, i);
    r->error_rel = blend_error(r, t);
    for (uint32_t y = 0; y < t->h; y++)
        for (uint32_t x = 0; x < t->w; x++) {
            float w = weight_at(r, t, x, y);
            struct lum_rgb frame = lum_rgb_scale(r->frame[(size_t)y * t->w + x], 1.0f - w);
            lum_film_set(film, x, y, lum_rgb_mad(frame, lum_film_mean(&r->truth, x, y), w), nonfinite);
        }
}
