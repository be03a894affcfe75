#include "core/render/rough.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/material/bsdf.h"
#include "core/math/lanes.h"
#include "core/render/rough_known.h"
#include "core/scene/surface.h"

/* Added to albedos before they are divided by: what is not in proportion to them (gloss, mirrors, black surfaces). */
#define SHEEN_FLOOR 0.05f
#define MATTE_FLOOR 1e-3f /* of what has no such part: black can still be divided by */
/* Another object, or another kind of surface, has its light only where nothing alike is near. */
#define UNLIKE 1e-3f
/* Weights of the four nearest add up to 1 where all are alike. Below this they are no neighbours, and those twice as
 * far are asked, and so on, up to REACH_MAX coarse pixels: what is thinner than they are is met here and there. With
 * .05 and 2 the SMAPE of rough pictures was 1.4 to 4.5 % more in five rooms, and 8 is no better than 4, but dearer. */
#define ENOUGH 0.5f
#define REACH_MAX 4.0f

struct job {
    const struct lum_pass *coarse;
    /* Of the coarse picture, over albedo: all of it, or without what layers know; each as it is, or what is new to the
     * base. NULL: there is none */
    struct lum_rgb *light[2][2];
    float *part; /* of the base that what is new goes with */
    struct lum_rough_known known;
    const struct lum_rough_base *base; /* NULL: there is none */
    const struct lum_pass *pass;
    float scale_x, scale_y; /* pixels of the coarse picture per one of the full */
};

static struct lum_rgb divisor(const struct lum_surfaces *s, size_t pixel)
{
    bool matte = s->kind[pixel] == (LUM_PIXEL_SURFACE | LUM_PIXEL_DIFFUSE);
    return lum_rgb_add(s->albedo[pixel], lum_grey(matte ? MATTE_FLOOR : SHEEN_FLOOR));
}

/* What shines by itself in a pixel; without `known`, what is not in layers that the full picture knows. */
static struct lum_rgb shine_at(const struct job *j, const struct lum_pass *pass, uint32_t x, uint32_t y, bool known)
{
    uint32_t light;
    struct lum_rgb shine =
        lum_surfaces_shine(j->pass->snapshot, pass->gbuffer, &pass->tiling, &pass->eye, x, y, &light);
    return known || !lum_rough_knows(&j->known, light) ? shine : lum_grey(0.0f);
}

/* As the composite does. */
static struct lum_rgb seen_through_media(const struct lum_pass *pass, size_t pixel, struct lum_rgb radiance)
{
    if (!pass->on[LUM_EFFECT_MEDIA] || pass->settings->illuminance || lum_rgb_black(radiance))
        return radiance;
    return lum_rgb_mul(radiance, lum_pass_transmittance(pass, pixel));
}

/* Of light what is left without a part of it. */
static struct lum_rgb without(struct lum_rgb c, struct lum_rgb part)
{
    return lum_rgb(lum_max(c.r - part.r, 0.0f), lum_max(c.g - part.g, 0.0f), lum_max(c.b - part.b, 0.0f));
}

/* Of the base, how much goes on: light that grew dimmer takes its details along. */
static float part_of_base(struct lum_rgb now, struct lum_rgb then)
{
    float a = lum_luminance(now), b = lum_luminance(then);
    return a >= b ? 1.0f : a > 0.0f ? a / b : 0.0f;
}

/* Of a tile of the coarse picture: what its surfaces reflect, over their albedo. */
static void light_tile(struct job *j, uint32_t tile)
{
    const struct lum_pass *c = j->coarse;
    struct lum_tile_rect r = lum_tile_at(&c->tiling, tile);
    struct lum_rgb known[LUM_TILE_PIXELS] = {{0}}, rest[LUM_TILE_PIXELS];
    if (j->known.chosen)
        lum_rough_known_sum(&j->known, c, tile, r.w * r.h, known);
    if (j->base)
        lum_rough_rest(c, tile, rest);
    for (uint32_t k = 0; k < r.w * r.h; k++) {
        uint32_t x = r.x + k % r.w, y = r.y + k / r.w;
        size_t i = (size_t)y * c->tiling.w + x;
        bool shines = c->surfaces->kind[i] & LUM_PIXEL_SHINES;
        struct lum_rgb radiance = lum_film_mean(c->film, x, y), over = divisor(c->surfaces, i), shine = lum_grey(0.0f);
        for (int leave = 0; leave < 2; leave++) {
            if (!j->light[leave][0])
                continue;
            shine = shines ? shine_at(j, c, x, y, !leave) : lum_grey(0.0f);
            struct lum_rgb left = leave ? without(radiance, seen_through_media(c, i, known[k])) : radiance;
            left = without(left, shine);
            j->light[leave][0][i] = lum_rgb_div(left, over);
            if (!j->base)
                continue;
            j->part[i] = shines ? 0.0f : part_of_base(rest[k], j->base->coarse[i]);
            j->light[leave][1][i] = lum_rgb_div(lum_rgb_mad(left, j->base->coarse[i], -j->part[i]), over);
        }
    }
}

/* ---- pixels of the full picture ---- */

/* Pixels in a row that lie between the same coarse ones: as many as there are, at most. */
#define LANES LUM_LANES

struct span {
    const struct lum_rgb *light; /* of the coarse picture, that it is to have */
    const float *part;           /* likewise, of the base; NULL: nothing of that */
    uint32_t n;
    size_t pixel;      /* the first */
    float x[LANES], y; /* in coarse pixels, whose centres are whole numbers */
    float px[LANES], py[LANES], pz[LANES], nx[LANES], ny[LANES], nz[LANES];
    float per_reach[LANES];                                /* one over half of what a coarse pixel covers there */
    uint32_t kind[LANES], object[LANES], by_object[LANES]; /* the last: 1 if another object is unlike */
};

struct gathered {
    float r[LANES], g[LANES], b[LANES]; /* light over albedo, weighted */
    float part[LANES], weight[LANES];
};

/* Unused lanes repeat the first. */
static void load_span(struct span *s, const struct job *j)
{
    const struct lum_surfaces *fine = j->pass->surfaces;
    for (uint32_t i = 0; i < LANES; i++) {
        size_t pixel = s->pixel + (i < s->n ? i : 0);
        struct lum_vec3 p = fine->p[pixel], n = fine->n[pixel];
        s->px[i] = p.x, s->py[i] = p.y, s->pz[i] = p.z;
        s->nx[i] = n.x, s->ny[i] = n.y, s->nz[i] = n.z;
        s->per_reach[i] = 1.0f / (0.5f * j->coarse->eye.per_pixel * fine->depth[pixel]);
        s->kind[i] = fine->kind[pixel];
        s->object[i] = fine->object[pixel];
        s->by_object[i] = (fine->kind[pixel] & (LUM_PIXEL_SPECULAR | LUM_PIXEL_SHEET | LUM_PIXEL_SHINES)) != 0;
    }
}

/* Adds a coarse pixel by a tent of width `reach`, and by what its surface says of the span's, 0 .. 1: the same kind,
 * facing the same way, in the same plane to within half of what a coarse pixel covers. Without a branch: vector code.
 */
static void add_coarse(const struct job *j, const struct span *restrict s, uint32_t x, uint32_t y, float reach,
                       struct gathered *restrict inout)
{
    const struct lum_surfaces *coarse = j->coarse->surfaces;
    size_t from = (size_t)y * j->coarse->film->w + x;
    const struct lum_vec3 p = coarse->p[from], n = coarse->n[from];
    const struct lum_rgb light = s->light[from];
    const float part = s->part ? s->part[from] : 0.0f;
    const uint32_t kind = coarse->kind[from], object = coarse->object[from];
    const float across = (float)x, down = reach - fabsf((float)y - s->y);
    for (uint32_t i = 0; i < LANES; i++) {
        float alike = s->kind[i] == kind ? 1.0f : UNLIKE;
        alike *= (s->by_object[i] & (uint32_t)(s->object[i] != object)) ? UNLIKE : 1.0f;
        float cosine = s->nx[i] * n.x + s->ny[i] * n.y + s->nz[i] * n.z;
        cosine = cosine > 0.0f ? cosine : 0.0f;
        float off = s->nx[i] * (p.x - s->px[i]) + s->ny[i] * (p.y - s->py[i]) + s->nz[i] * (p.z - s->pz[i]);
        float far = off * s->per_reach[i];
        float of_plane = cosine * cosine / (1.0f + far * far);
        bool nothing = (s->object[i] == LUM_NO_OBJECT) | (object == LUM_NO_OBJECT);
        alike *= nothing ? 1.0f : of_plane;
        float tent = down * (reach - fabsf(across - s->x[i]));
        float weight = (tent > 0.0f ? tent : 0.0f) * (alike + UNLIKE * UNLIKE);
        inout->r[i] += light.r * weight;
        inout->g[i] += light.g * weight;
        inout->b[i] += light.b * weight;
        inout->part[i] += part * weight;
        inout->weight[i] += weight;
    }
}

/* All coarse pixels within `reach` of any of the span. */
static void gather(const struct job *j, const struct span *s, float reach, struct gathered *ret_sum)
{
    const struct lum_film *film = j->coarse->film;
    int y0 = (int)ceilf(s->y - reach), y1 = (int)floorf(s->y + reach);
    int x0 = (int)ceilf(s->x[0] - reach), x1 = (int)floorf(s->x[s->n - 1] + reach);
    memset(ret_sum, 0, sizeof *ret_sum);
    for (int y = y0 < 0 ? 0 : y0; y <= y1 && y < (int)film->h; y++)
        for (int x = x0 < 0 ? 0 : x0; x <= x1 && x < (int)film->w; x++)
            add_coarse(j, s, (uint32_t)x, (uint32_t)y, reach, ret_sum);
}

/* Where the four nearest are no neighbours, those around them are asked. */
static void gather_enough(const struct job *j, const struct span *s, struct gathered *ret_sum)
{
    struct gathered wide;
    gather(j, s, 1.0f, ret_sum);
    for (float reach = 2.0f; reach <= REACH_MAX; reach *= 2.0f) {
        uint32_t few = 0;
        for (uint32_t i = 0; i < s->n; i++)
            few += ret_sum->weight[i] < ENOUGH;
        if (few == 0)
            return;
        gather(j, s, reach, &wide);
        for (uint32_t i = 0; i < s->n; i++) {
            bool is = ret_sum->weight[i] < ENOUGH;
            ret_sum->r[i] = is ? wide.r[i] : ret_sum->r[i];
            ret_sum->g[i] = is ? wide.g[i] : ret_sum->g[i];
            ret_sum->b[i] = is ? wide.b[i] : ret_sum->b[i];
            ret_sum->part[i] = is ? wide.part[i] : ret_sum->part[i];
            ret_sum->weight[i] = is ? wide.weight[i] : ret_sum->weight[i];
        }
    }
}

/* ---- coarse pixels that stand alone ---- */

/* A coarse pixel that met a stripe of sun, or anything else that is thinner than it, would show as a dot of its whole
 * size. What it has beyond so many times the mean of those around it on its surface they share, by a tent that is
 * wider: else their square shows. A corner of what is lit has a third of those around on its side. */
#define LONE 2.0f
#define AROUND 2 /* pixels each way */
#define TENT 5   /* pixels each way, where it is 0 */

/* On the same surface, to a turn of 26 degrees, and none that shows another. More turn: light goes round edges; less:
 * on what is round, or has a normal map, nobody shares. */
#define SAME_COS 0.9f
static bool shares(const struct lum_surfaces *s, size_t pixel, size_t other)
{
    return s->kind[other] == s->kind[pixel] && s->object[other] == s->object[pixel] &&
           !(s->kind[pixel] & LUM_PIXEL_SPECULAR) && lum_dot(s->n[pixel], s->n[other]) > SAME_COS;
}

/* Most are not, and next to that nothing is asked of them. */
static bool may_be_lone(const struct job *j, const struct lum_rgb *light, uint32_t x, uint32_t y)
{
    const uint32_t w = j->coarse->film->w, h = j->coarse->film->h;
    const struct lum_rgb *at = &light[(size_t)y * w + x];
    if (x == 0 || y == 0 || x + 1 >= w || y + 1 >= h)
        return true;
    float near = lum_luminance(at[-1]) + lum_luminance(at[1]) + lum_luminance(at[w]) + lum_luminance(*(at - w));
    return lum_luminance(*at) > LONE * 0.25f * near;
}

/* Of its light what others get. */
static struct lum_rgb beyond(const struct job *j, const struct lum_rgb *light, int px, int py)
{
    const int w = (int)j->coarse->film->w, h = (int)j->coarse->film->h;
    size_t pixel = (size_t)py * (size_t)w + (size_t)px;
    float y = lum_luminance(light[pixel]), others = 0.0f, n = 0.0f;
    for (int qy = py > AROUND ? py - AROUND : 0; qy <= py + AROUND && qy < h; qy++)
        for (int qx = px > AROUND ? px - AROUND : 0; qx <= px + AROUND && qx < w; qx++) {
            size_t other = (size_t)qy * (size_t)w + (size_t)qx;
            if (other == pixel || !shares(j->coarse->surfaces, pixel, other))
                continue;
            n += 1.0f;
            others += lum_luminance(light[other]);
        }
    float most = n > 0.0f ? LONE * others / n : y;
    return y > most ? lum_rgb_scale(light[pixel], 1.0f - most / y) : lum_grey(0.0f);
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
static enum lum_status share_lone(const struct job *j, struct lum_rgb *inout_light, struct lum_error *err)
{
    const uint32_t w = j->coarse->film->w, h = j->coarse->film->h;
    struct lum_rgb *gets = lum_calloc((size_t)w * h, sizeof *gets);
    if (!gets)
        return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for a rough picture");
    for (uint32_t y = 0; y < h; y++)
        for (uint32_t x = 0; x < w; x++) {
            if (!may_be_lone(j, inout_light, x, y))
                continue;
            struct lum_rgb share = beyond(j, inout_light, (int)x, (int)y);
            if (!(lum_luminance(share) > 0.0f))
                continue;
            float weight = share_out(j, (int)x, (int)y, share, 0.0f, gets);
            share_out(j, (int)x, (int)y, share, 1.0f / weight, gets); /* it gets of it, too */
            size_t pixel = (size_t)y * w + x;
            gets[pixel] = lum_rgb_mad(gets[pixel], share, -1.0f);
        }
    for (size_t i = 0; i < (size_t)w * h; i++)
        inout_light[i] = lum_rgb_add(inout_light[i], gets[i]);
    lum_free(gets);
    return LUM_OK;
}

/* ---- all of it ---- */

/* known: what layers know of its light; NULL: it takes all from the coarse picture. */
static void write_span(const struct job *j, const struct span *s, uint32_t x, uint32_t y, const struct lum_rgb *known,
                       struct lum_counters *inout_counters)
{
    const struct lum_pass *pass = j->pass;
    struct gathered sum;
    gather_enough(j, s, &sum);
    for (uint32_t i = 0; i < s->n; i++) {
        struct lum_rgb radiance =
            lum_rgb_mul(lum_rgb(sum.r[i], sum.g[i], sum.b[i]), divisor(pass->surfaces, s->pixel + i));
        radiance = sum.weight[i] > 0.0f ? lum_rgb_scale(radiance, 1.0f / sum.weight[i]) : lum_grey(0.0f);
        if (s->kind[i] & LUM_PIXEL_SHINES)
            radiance = lum_rgb_add(radiance, shine_at(j, pass, x + i, y, !known));
        if (s->part && sum.weight[i] > 0.0f)
            radiance = lum_rgb_mad(radiance, j->base->fine[s->pixel + i], sum.part[i] / sum.weight[i]);
        if (known)
            radiance = lum_rgb_add(radiance, seen_through_media(pass, s->pixel + i, known[i]));
        if (s->part)
            radiance = without(radiance, lum_grey(0.0f));
        lum_film_set(pass->film, x + i, y, radiance, &inout_counters->nonfinite);
    }
}

/* Where the middle of a pixel of the full picture is in the coarse one. Both are of the same eye, their middles are the
 * same direction; the coarse one may show a little more, but of panoramas both show all. */
static float in_coarse(float scale, float coarse_size, uint32_t size, uint32_t at)
{
    return 0.5f * (coarse_size - 1.0f) + ((float)at + 0.5f - 0.5f * (float)size) * scale;
}

static void tile_job(void *ctx, uint32_t tile, struct lum_counters *counters)
{
    const struct job *j = ctx;
    const struct lum_tiling *tiling = &j->pass->tiling;
    const struct lum_eye *eye = &j->coarse->eye;
    struct lum_tile_rect r = lum_tile_at(tiling, tile);
    bool is_known = j->known.chosen && j->known.whole[tile], is_based = j->base && j->base->kept[tile];
    struct lum_rgb known[LUM_TILE_PIXELS];
    struct span s = {.light = j->light[is_known][is_based], .part = is_based ? j->part : NULL};
    if (is_known)
        lum_rough_known_sum(&j->known, j->pass, tile, r.w * r.h, known);
    for (uint32_t y = r.y; y < r.y + r.h; y++) {
        s.y = in_coarse(j->scale_y, eye->h, tiling->h, y);
        for (uint32_t x = r.x; x < r.x + r.w; x += s.n) {
            s.pixel = (size_t)y * tiling->w + x;
            float first = floorf(in_coarse(j->scale_x, eye->w, tiling->w, x));
            for (s.n = 0; s.n < LANES && x + s.n < r.x + r.w; s.n++) {
                s.x[s.n] = in_coarse(j->scale_x, eye->w, tiling->w, x + s.n);
                if (floorf(s.x[s.n]) > first)
                    break;
            }
            for (uint32_t i = s.n; i < LANES; i++)
                s.x[i] = s.x[0];
            load_span(&s, j);
            write_span(j, &s, x, y, is_known ? known + (y - r.y) * r.w + (x - r.x) : NULL, counters);
        }
    }
}

static void drop_light(struct job *j)
{
    for (int leave = 0; leave < 2; leave++)
        for (int based = 0; based < 2; based++)
            lum_free(j->light[leave][based]);
    lum_free(j->part);
    lum_rough_known_finish(&j->known);
}

/* Light of the coarse picture, ready to be looked up. */
static enum lum_status take_light(struct job *j, struct lum_error *err)
{
    size_t n = (size_t)j->coarse->film->w * j->coarse->film->h;
    bool ok = true;
    lum_rough_known_init(&j->known, j->pass->layers, j->coarse->layers, &j->pass->snapshot->lights);
    for (int leave = 0; leave <= (j->known.chosen != NULL); leave++)
        for (int based = 0; based <= (j->base != NULL); based++)
            ok = (j->light[leave][based] = lum_calloc(n, sizeof *j->light[leave][based])) && ok;
    if (j->base)
        ok = (j->part = lum_calloc(n, sizeof *j->part)) && ok;
    if (!ok)
        return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for a rough picture");
    for (uint32_t t = 0; t < j->coarse->tiling.n; t++)
        light_tile(j, t);
    enum lum_status status = LUM_OK;
    for (int leave = 0; leave < 2 && status == LUM_OK; leave++)
        if (j->light[leave][0])
            status = share_lone(j, j->light[leave][0], err);
    return status;
}

enum lum_status lum_rough_upsample(const struct lum_pass *coarse, const struct lum_pass *pass,
                                   const struct lum_rough_base *base, const struct lum_stage_runner *runner,
                                   struct lum_error *err)
{
    int64_t begin_ns = lum_clock_ns();
    const struct lum_eye *a = &pass->eye, *b = &coarse->eye;
    struct job job = {.coarse = coarse,
                      .pass = pass,
                      .base = base,
                      .scale_x = a->panorama ? a->per_column / b->per_column : a->per_pixel / b->per_pixel,
                      .scale_y = a->panorama ? a->per_row / b->per_row : a->per_pixel / b->per_pixel};
    enum lum_status status = take_light(&job, err);
    if (status == LUM_OK)
        status = lum_stage_loop(runner, pass->tiling.n, tile_job, &job);
    drop_light(&job);
    runner->stats->stage_ms[LUM_STAGE_UPSAMPLE] += (double)(lum_clock_ns() - begin_ns) * 1e-6;
    return status;
}
