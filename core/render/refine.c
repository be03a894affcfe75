#include "core/render/refine.h"
#include "core/effect/antialias/antialias.h"

#include <string.h>

void lum_refine_finish(struct lum_refinement *r)
{
    lum_film_finish(&r->truth);
    lum_free(r->tile_spp);
    lum_free(r->frame);
    lum_free(r->shine);
    lum_residual_finish(r->memory);
    *r = (struct lum_refinement){0};
}

enum lum_status lum_refine_init(struct lum_refinement *r, const struct lum_tiling *t, struct lum_error *err)
{
    enum lum_status status = lum_film_init(&r->truth, t->w, t->h, err);
    if (status == LUM_OK)
        status = lum_film_keep_first(&r->truth, err);
    if (status != LUM_OK) {
        lum_refine_finish(r);
        return status;
    }
    r->tile_spp = lum_calloc(t->n, sizeof *r->tile_spp);
    r->frame = lum_calloc((size_t)t->w * t->h, sizeof *r->frame);
    r->shine = lum_calloc((size_t)t->w * t->h, sizeof *r->shine);
    if (r->tile_spp && r->frame && r->shine)
        return LUM_OK;
    lum_refine_finish(r);
    return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory to refine a picture of %u x %u", t->w, t->h);
}

#define FIRST_SPP 1u /* the first sample corrects the frame already */

/* Samples from which on the error is known. With one the halves are of pixels side by side. With a few, outliers at the
 * edges of lamps, which are most of the error there, mostly hide from the estimate: with four it was a seventeenth of
 * the squared error in `desk`, 144 x 96, with eight two thirds in `cornell`, 96 x 64, on average; with ten three
 * quarters, so that the bound was above the error in 115 of 120 pictures of these and of `office`. */
#define KNOWN_SPP 10u

void lum_refine_begin(struct lum_refinement *r, const struct lum_tiling *t)
{
    memset(r->tile_spp, 0, t->n * sizeof *r->tile_spp);
    r->error = LUM_FILM_ERROR_UNKNOWN;
    r->noise = (double)NAN;
    r->taken = r->owed = false;
    r->next_spp = FIRST_SPP;
}

/* What shines by itself in the middle of a pixel, as it comes to the eye. */
static struct lum_rgb shine_of(const struct lum_pass *pass, const struct lum_deferred *d, size_t i)
{
    const struct lum_tiling *t = &pass->tiling;
    if (!(d->surfaces.kind[i] & LUM_PIXEL_SHINES))
        return lum_grey(0.0f);
    uint32_t x = (uint32_t)(i % t->w), y = (uint32_t)(i / t->w);
    uint32_t light;
    struct lum_rgb shine = lum_surfaces_shine(pass->snapshot, &d->gbuffer, t, &pass->eye, x, y, &light);
    return pass->on[LUM_EFFECT_MEDIA] ? lum_rgb_mul(shine, lum_pass_transmittance(pass, i)) : shine;
}

/* The frame has it smoothed at edges as the rest. */
static struct lum_rgb smooth_shine(const struct lum_pass *pass, const struct lum_deferred *d, uint32_t neighbours,
                                   size_t i)
{
    if (neighbours == LUM_NEIGHBOURS_SELF)
        return shine_of(pass, d, i);
    struct lum_rgb sum = lum_grey(0.0f);
    for (uint32_t k = 0; k < LUM_EDGE_RAYS; k++)
        sum = lum_rgb_add(sum, shine_of(pass, d, lum_edge_neighbour(neighbours, k, i, pass->tiling.w)));
    return lum_rgb_scale(sum, 1.0f / (float)LUM_EDGE_RAYS);
}

void lum_refine_take(struct lum_refinement *r, const struct lum_pass *frame_pass, const struct lum_deferred *deferred,
                     const struct lum_film *frame)
{
    struct lum_pass seen = *frame_pass;
    const struct lum_pass *pass = &seen;
    seen.surfaces = (struct lum_surfaces *)&deferred->surfaces; /* a pass that makes no frame has none */
    const uint32_t *neighbours = lum_edge_neighbours(&deferred->states), w = pass->tiling.w;
    for (size_t i = 0; i < (size_t)w * pass->tiling.h; i++) {
        struct lum_rgb all = lum_film_mean(frame, (uint32_t)(i % w), (uint32_t)(i / w));
        struct lum_rgb shine = smooth_shine(pass, deferred, neighbours ? neighbours[i] : LUM_NEIGHBOURS_SELF, i);
        r->shine[i] = lum_rgb(lum_min(shine.r, all.r), lum_min(shine.g, all.g), lum_min(shine.b, all.b));
        r->frame[i] = lum_rgb_mad(all, r->shine[i], -1.0f);
    }
    r->taken = true;
}

bool lum_refine_is_due(const struct lum_refinement *r, uint32_t spp, uint32_t max_spp)
{
    bool last = max_spp > 0 && spp + 2 > max_spp;
    bool halves = spp == 1 || spp % 2 == 0; /* there are two, alike */
    return halves && (spp >= r->next_spp || last);
}

/* The estimate of a squared error may be below 0. */
static struct lum_film_error error_of(const struct lum_residual *job)
{
    double n = (double)job->picture->w * job->picture->h, square = fmax(job->error, 0.0);
    if (!isfinite(job->error) || !isfinite(job->mean) || !(job->mean > 0.0))
        return LUM_FILM_ERROR_UNKNOWN;
    return (struct lum_film_error){sqrt(square * n) / job->mean, sqrt((square + LUM_SURE * job->doubt) * n) / job->mean,
                                   n, 1.0};
}

/* Of the samples, over the mean of the picture as the error is; but for that of what shines by itself. */
static double noise_of(const struct lum_film *truth, const struct lum_residual *job)
{
    double mean = job->mean / ((double)truth->w * truth->h);
    return lum_film_error(truth).bound * (mean > 0.0 ? lum_film_mean_luminance(truth) / mean : 1.0);
}

#define BLOCK 8.0 /* side of the blocks of pixels that errors are told by (film/error.c) */

/* The squared error is what is left of squares of the samples, whose noise cancels in the mean. Where it is far above
 * the error few blocks decide what is left, and all may have missed what is bright and rare: then the deviation is
 * estimated too low. It is taken to be no less than if that noise were spread evenly, and alike within blocks: of
 * noise^2 over the picture, times sqrt(2 / blocks) for products of normal variables. (office.glb, 96 x 64, after 32
 * samples, noise 1.3: an error of .25 was said to be below .12.) */
static void doubt_noise(struct lum_film_error *error, double noise, const struct lum_film *film)
{
    double blocks = ceil(film->w / BLOCK) * ceil(film->h / BLOCK), deviation = noise * noise * sqrt(2.0 / blocks);
    if (isfinite(deviation))
        error->bound = fmax(error->bound, sqrt(error->rel * error->rel + LUM_SURE * deviation));
}

enum lum_status lum_refine_apply(struct lum_refinement *r, uint32_t spp, const struct lum_deferred *deferred,
                                 float per_pixel, struct lum_film *film, const struct lum_stage_runner *runner)
{
    struct lum_residual job = {.frame = r->frame,
                               .shine = r->shine,
                               .truth = &r->truth,
                               .guide = &deferred->surfaces,
                               .neighbours = lum_edge_neighbours(&deferred->states),
                               .per_pixel = per_pixel,
                               .picture = film};
    struct lum_error unused;
    enum lum_status status = lum_residual_apply(&job, &r->memory, runner, &unused);
    if (status == LUM_ERR_CANCELLED)
        return status;
    r->owed = false;
    /* A picture takes the time of c = 0.1 to 0.6 samples, and those since the last one are not in it: apart by
     * sqrt(2 c spp) both together lose least. */
    r->next_spp = spp + (spp < 2 ? 1 : 2 * (uint32_t)(0.5 * sqrt((double)spp) + 0.5));
    if (status != LUM_OK)
        return LUM_OK;
    runner->counters[0].nonfinite += job.nonfinite;
    r->error = LUM_FILM_ERROR_UNKNOWN;
    r->noise = spp >= KNOWN_SPP ? noise_of(&r->truth, &job) : (double)NAN;
    if (spp >= KNOWN_SPP)
        r->error = error_of(&job);
    doubt_noise(&r->error, r->noise, film);
    return LUM_OK;
}
