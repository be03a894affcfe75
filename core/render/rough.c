#include "core/render/rough.h"

#include <math.h>
#include <stdlib.h>

#include "core/material/bsdf.h"
#include "core/scene/surface.h"

/* Added to albedos before they are divided by: what is not in proportion to them (gloss, mirrors, black surfaces). */
#define SHEEN_FLOOR 0.05f
#define MATTE_FLOOR 1e-3f /* of what has no such part: black can still be divided by */
/* Another object, or another kind of surface, has its light only where nothing alike is near. */
#define UNLIKE 1e-3f
/* Below this weight the four nearest pixels are no neighbours, and those around them are asked. */
#define ENOUGH 0.05f

struct job {
    const struct lum_rough_picture *coarse;
    struct lum_rgb *light; /* of the coarse picture, over albedo */
    const struct lum_pass *pass;
    float scale; /* pixels of the coarse picture per one of the full */
};

/* A pixel of the full picture, and where it is in the coarse one. */
struct target {
    size_t pixel;
    float x, y; /* in coarse pixels, whose centres are whole numbers */
};

static struct lum_rgb divisor(const struct lum_surfaces *s, size_t pixel)
{
    bool matte = s->kind[pixel] == (LUM_PIXEL_SURFACE | LUM_PIXEL_DIFFUSE);
    return lum_rgb_add(s->albedo[pixel], lum_grey(matte ? MATTE_FLOOR : SHEEN_FLOOR));
}

/* Of a coarse pixel: what its surface reflects, over its albedo. */
static struct lum_rgb light_at(const struct job *j, uint32_t x, uint32_t y)
{
    const struct lum_rough_picture *c = j->coarse;
    struct lum_rgb radiance = lum_film_mean(c->film, x, y);
    size_t i = (size_t)y * c->film->w + x;
    if (c->surfaces->kind[i] & LUM_PIXEL_SHINES) {
        struct lum_rgb shine = lum_surfaces_shine(j->pass->snapshot, c->gbuffer, c->tiling, c->eye, x, y);
        radiance = lum_rgb(lum_max(radiance.r - shine.r, 0.0f), lum_max(radiance.g - shine.g, 0.0f),
                           lum_max(radiance.b - shine.b, 0.0f));
    }
    return lum_rgb_div(radiance, divisor(c->surfaces, i));
}

/* What a coarse pixel's surface says of the target's, 0 .. 1: the same kind, facing the same way, in the same plane to
 * within half of what a coarse pixel covers. */
static float likeness(const struct job *j, size_t target, size_t from)
{
    const struct lum_surfaces *fine = j->pass->surfaces, *coarse = j->coarse->surfaces;
    float alike = fine->kind[target] == coarse->kind[from] ? 1.0f : UNLIKE;
    bool by_object = (fine->kind[target] & (LUM_PIXEL_SPECULAR | LUM_PIXEL_SHEET | LUM_PIXEL_SHINES)) != 0;
    if (by_object && fine->object[target] != coarse->object[from])
        alike *= UNLIKE;
    if (fine->object[target] == LUM_NO_OBJECT || coarse->object[from] == LUM_NO_OBJECT)
        return alike;
    struct lum_vec3 n = fine->n[target];
    float cosine = fmaxf(lum_dot(n, coarse->n[from]), 0.0f);
    float off = lum_dot(n, lum_v3_sub(coarse->p[from], fine->p[target]));
    float far = off / (0.5f * j->coarse->eye->per_pixel * fine->depth[target]);
    return alike * cosine * cosine / (1.0f + far * far);
}

struct gathered {
    struct lum_rgb light; /* over albedo */
    float weight;
};

/* Pixels within `reach` of the target, by a tent of that width. */
static struct gathered gather(const struct job *j, const struct target *t, float reach)
{
    const struct lum_film *film = j->coarse->film;
    struct gathered sum = {.weight = 0.0f};
    int y0 = (int)ceilf(t->y - reach), y1 = (int)floorf(t->y + reach);
    int x0 = (int)ceilf(t->x - reach), x1 = (int)floorf(t->x + reach);
    for (int y = y0 < 0 ? 0 : y0; y <= y1 && y < (int)film->h; y++)
        for (int x = x0 < 0 ? 0 : x0; x <= x1 && x < (int)film->w; x++) {
            size_t from = (size_t)y * film->w + (size_t)x;
            float tent = (reach - fabsf((float)x - t->x)) * (reach - fabsf((float)y - t->y));
            float weight = tent * (likeness(j, t->pixel, from) + UNLIKE * UNLIKE);
            sum.light = lum_rgb_add(sum.light, lum_rgb_scale(j->light[from], weight));
            sum.weight += weight;
        }
    return sum;
}

static struct lum_rgb radiance_of(const struct job *j, const struct target *t)
{
    struct gathered sum = gather(j, t, 1.0f);
    if (sum.weight < ENOUGH)
        sum = gather(j, t, 2.0f);
    if (!(sum.weight > 0.0f))
        return lum_grey(0.0f);
    return lum_rgb_scale(lum_rgb_mul(sum.light, divisor(j->pass->surfaces, t->pixel)), 1.0f / sum.weight);
}

/* A coarse pixel that met a stripe of sun, or anything else that is thinner than it, would show as a dot of its whole
 * size. What it has beyond so many times the mean of those around it on its surface they share, by a tent that is
 * wider: else their square shows. A corner of what is lit has a third of those around on its side. */
#define LONE 2.0f
#define AROUND 2 /* pixels each way */
#define TENT 5   /* pixels each way, where it is 0 */

/* On the same surface, and none that shows another. */
static bool shares(const struct lum_surfaces *s, size_t pixel, size_t other)
{
    return s->kind[other] == s->kind[pixel] && s->object[other] == s->object[pixel] &&
           !(s->kind[pixel] & LUM_PIXEL_SPECULAR) && lum_dot(s->n[pixel], s->n[other]) > 0.9f;
}

/* Most are not, and next to that nothing is asked of them. */
static bool may_be_lone(const struct job *j, uint32_t x, uint32_t y)
{
    const uint32_t w = j->coarse->film->w, h = j->coarse->film->h;
    const struct lum_rgb *at = &j->light[(size_t)y * w + x];
    if (x == 0 || y == 0 || x + 1 >= w || y + 1 >= h)
        return true;
    float near = lum_luminance(at[-1]) + lum_luminance(at[1]) + lum_luminance(at[w]) + lum_luminance(*(at - w));
    return lum_luminance(*at) > LONE * 0.25f * near;
}

/* Of its light what others get. */
static struct lum_rgb beyond(const struct job *j, int px, int py)
{
    const int w = (int)j->coarse->film->w, h = (int)j->coarse->film->h;
    size_t pixel = (size_t)py * (size_t)w + (size_t)px;
    float y = lum_luminance(j->light[pixel]), others = 0.0f, n = 0.0f;
    for (int qy = py > AROUND ? py - AROUND : 0; qy <= py + AROUND && qy < h; qy++)
        for (int qx = px > AROUND ? px - AROUND : 0; qx <= px + AROUND && qx < w; qx++) {
            size_t other = (size_t)qy * (size_t)w + (size_t)qx;
            if (other == pixel || !shares(j->coarse->surfaces, pixel, other))
                continue;
            n += 1.0f;
            others += lum_luminance(j->light[other]);
        }
    float most = n > 0.0f ? LONE * others / n : y;
    return y > most ? lum_rgb_scale(j->light[pixel], 1.0f - most / y) : lum_grey(0.0f);
}

/* weight: 0 adds up the weights of those who get it; else one over their sum, and it is given. */
static float share_out(const struct job *j, int px, int py, struct lum_rgb share, float weight, struct lum_rgb *gets)
{
    const int w = (int)j->coarse->film->w, h = (int)j->coarse->film->h;
    size_t pixel = (size_t)py * (size_t)w + (size_t)px;
    float sum = 0.0f;
    for (int dy = -TENT + 1; dy < TENT; dy++)
        for (int dx = -TENT + 1; dx < TENT; dx++) {
            int qx = px + dx, qy = py + dy;
            size_t other = (size_t)qy * (size_t)w + (size_t)qx;
            if (qx < 0 || qy < 0 || qx >= w || qy >= h || !shares(j->coarse->surfaces, pixel, other))
                continue;
            float tent = (float)((TENT - abs(dx)) * (TENT - abs(dy)));
            sum += tent;
            gets[other] = lum_rgb_mad(gets[other], share, tent * weight);
        }
    return sum;
}

/* Of all at once: what one gets makes no other less lone. */
static enum lum_status share_lone(struct job *j, struct lum_error *err)
{
    const uint32_t w = j->coarse->film->w, h = j->coarse->film->h;
    struct lum_rgb *gets = lum_calloc((size_t)w * h, sizeof *gets);
    if (!gets)
        return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for a rough picture");
    for (uint32_t y = 0; y < h; y++)
        for (uint32_t x = 0; x < w; x++) {
            if (!may_be_lone(j, x, y))
                continue;
            struct lum_rgb share = beyond(j, (int)x, (int)y);
            if (!(lum_luminance(share) > 0.0f))
                continue;
            float weight = share_out(j, (int)x, (int)y, share, 0.0f, gets);
            share_out(j, (int)x, (int)y, share, 1.0f / weight, gets); /* it gets of it, too */
            size_t pixel = (size_t)y * w + x;
            gets[pixel] = lum_rgb_mad(gets[pixel], share, -1.0f);
        }
    for (size_t i = 0; i < (size_t)w * h; i++)
        j->light[i] = lum_rgb_add(j->light[i], gets[i]);
    lum_free(gets);
    return LUM_OK;
}

/* Both pictures are of the same eye, their middles are the same direction; the coarse one may show a little more. */
static void tile_job(void *ctx, uint32_t tile, struct lum_counters *counters)
{
    const struct job *j = ctx;
    const struct lum_tiling *tiling = &j->pass->tiling;
    struct lum_tile_rect r = lum_tile_at(tiling, tile);
    for (uint32_t y = r.y; y < r.y + r.h; y++)
        for (uint32_t x = r.x; x < r.x + r.w; x++) {
            struct target t = {
                (size_t)y * tiling->w + x,
                0.5f * (j->coarse->eye->w - 1.0f) + ((float)x + 0.5f - 0.5f * (float)tiling->w) * j->scale,
                0.5f * (j->coarse->eye->h - 1.0f) + ((float)y + 0.5f - 0.5f * (float)tiling->h) * j->scale};
            struct lum_rgb radiance = radiance_of(j, &t);
            if (j->pass->surfaces->kind[t.pixel] & LUM_PIXEL_SHINES)
                radiance = lum_rgb_add(
                    radiance, lum_surfaces_shine(j->pass->snapshot, j->pass->gbuffer, tiling, &j->pass->eye, x, y));
            lum_film_set(j->pass->film, x, y, radiance, &counters->nonfinite);
        }
}

enum lum_status lum_rough_upsample(const struct lum_rough_picture *coarse, const struct lum_pass *pass,
                                   const struct lum_stage_runner *runner, struct lum_error *err)
{
    int64_t begin_ns = lum_clock_ns();
    const struct lum_film *film = coarse->film;
    struct job job = {.coarse = coarse, .pass = pass, .scale = pass->eye.per_pixel / coarse->eye->per_pixel};
    job.light = lum_calloc((size_t)film->w * film->h, sizeof *job.light);
    if (!job.light)
        return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for a rough picture");
    for (uint32_t y = 0; y < film->h; y++)
        for (uint32_t x = 0; x < film->w; x++)
            job.light[(size_t)y * film->w + x] = light_at(&job, x, y);
    enum lum_status status = share_lone(&job, err);
    if (status == LUM_OK)
        status = lum_stage_loop(runner, pass->tiling.n, tile_job, &job);
    lum_free(job.light);
    runner->stats->stage_ms[LUM_STAGE_UPSAMPLE] += (double)(lum_clock_ns() - begin_ns) * 1e-6;
    return status;
}
