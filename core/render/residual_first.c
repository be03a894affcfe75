/* What samples meet first, and the frame shows in the middle of its pixels: its albedo, and what of it shines by
 * itself. */
#include "core/effect/antialias/antialias.h"
#include "core/render/residual_steps.h"

/* How many samples of a pixel the frame counts as: it shows one ray, or where it was smoothed several, which the
 * samples replace with the square of their number. */
static float frame_weight(const struct lum_residual *r, size_t i)
{
    uint32_t n = r->truth->n[0][i] + r->truth->n[1][i];
    bool smoothed = r->neighbours && r->neighbours[i] != LUM_NEIGHBOURS_SELF;
    return (smoothed ? (float)LUM_EDGE_RAYS : 1.0f) / (float)(n > 0 ? n : 1);
}

/* As samples of halves first to last met it, and the frame, half of it for each. */
static struct lum_rgb albedo_of(const struct step *step, size_t i, int first, int last)
{
    const struct lum_film *film = step->r->truth;
    float n = 0.5f * (float)(1 + last - first) * frame_weight(step->r, i);
    struct lum_rgb sum = lum_rgb_scale(lum_residual_frame_albedo(step, i), n);
    for (int half = first; half <= last; half++) {
        sum = lum_rgb_mad(sum, half_albedo(step, i, half), (float)film->n[half][i]);
        n += (float)film->n[half][i];
    }
    return lum_rgb_scale(sum, 1.0f / n);
}

struct lum_rgb lum_residual_albedo(const struct step *step, size_t i)
{
    if (step->r->truth->first[0])
        return albedo_of(step, i, 0, 1);
    return lum_rgb_scale(lum_rgb_add(step->r->guide->albedo[i], lum_grey(ALBEDO_FLOOR)), step->scale);
}

struct lum_rgb lum_residual_albedo_by(const struct step *step, size_t i, int half)
{
    return step->r->truth->first[0] ? albedo_of(step, i, half, half) : lum_residual_albedo(step, i);
}

/* Where it was smoothed, of all that it is smoothed by. */
struct lum_rgb lum_residual_frame_albedo(const struct step *step, size_t i)
{
    const struct lum_rgb *albedo = step->r->guide->albedo;
    uint32_t neighbours = step->r->neighbours ? step->r->neighbours[i] : LUM_NEIGHBOURS_SELF;
    struct lum_rgb sum = albedo[i];
    if (neighbours != LUM_NEIGHBOURS_SELF) {
        sum = lum_grey(0.0f);
        for (uint32_t k = 0; k < LUM_EDGE_RAYS; k++)
            sum =
                lum_rgb_mad(sum, albedo[lum_edge_neighbour(neighbours, k, i, step->m->w)], 1.0f / (float)LUM_EDGE_RAYS);
    }
    return lum_rgb_scale(lum_rgb_add(sum, lum_grey(ALBEDO_FLOOR)), step->scale);
}

/* The frame, with this albedo. What of it is no matter of albedo, gloss, must not become many times as much; of panes,
 * mirrors and black gloss all of it is none. At edges it is as it is: of another object samples say nothing about how
 * much light there is on this one. */
#define PAINT_MOST 4.0f
struct lum_rgb lum_residual_painted(const struct step *step, size_t i, struct lum_rgb albedo)
{
    const uint32_t w = step->m->w;
    if (!step->r->truth->first[0] || !(step->r->guide->kind[i] & LUM_PIXEL_DIFFUSE) ||
        lum_outliers_are_at_edge(step, (uint32_t)(i % w), (uint32_t)(i / w)))
        return step->r->frame[i];
    struct lum_rgb per = lum_rgb_div(albedo, lum_residual_frame_albedo(step, i));
    const float least = 1.0f / PAINT_MOST;
    per = lum_rgb(lum_clamp(per.r, least, PAINT_MOST), lum_clamp(per.g, least, PAINT_MOST),
                  lum_clamp(per.b, least, PAINT_MOST));
    return lum_rgb_mul(step->r->frame[i], per);
}

/* What shines by itself, by the samples of one half, or both, and by the frame, half of it for each. */
struct lum_rgb lum_residual_shine(const struct lum_residual *r, size_t i, int first, int last)
{
    struct lum_rgb sum = lum_grey(0.0f);
    if (!r->shine)
        return sum;
    float n = 0.5f * (float)(1 + last - first) * frame_weight(r, i);
    sum = lum_rgb_scale(r->shine[i], n);
    for (int half = first; half <= last; half++) {
        sum = lum_rgb_mad(sum, r->truth->first[half][i].shine, (float)r->truth->n[half][i]);
        n += (float)r->truth->n[half][i];
    }
    return lum_rgb_scale(sum, 1.0f / n);
}

/* By a half's samples alone; of one that has none, what the picture shows. */
float lum_residual_sampled_shine(const struct lum_residual *r, size_t i, int half)
{
    bool known = r->shine && r->truth->n[half][i] > 0;
    return lum_luminance(known ? r->truth->first[half][i].shine : lum_residual_shine(r, i, half, half));
}
