#include "server/stream/coding.h"

#include <stddef.h>

#include "core/base/base.h"

/* Of pictures of `live`, which is what moves: root mean square error and bytes of both, by `lumend-bench codecs`
 * (tests/bench/RESULTS.md). Above 90 JPEG keeps the resolution of colours, which WebP does not have. Other pictures
 * have other numbers, and nearly the same ratios. */
struct knot {
    double quality, webp_quality;
    double jpeg_bytes, webp_bytes; /* a pixel */
};
static const struct knot knots[] = {
    {1, 1, 0.04, 0.02},     {20, 6, 0.099, 0.038},  {50, 25, 0.137, 0.066},  {70, 43, 0.170, 0.085},
    {85, 77, 0.230, 0.130}, {90, 90, 0.326, 0.194}, {100, 90, 0.750, 0.194},
};
#define JPEG_NS_PIXEL 3.0
#define WEBP_NS_PIXEL 32.0

#define SEEN_AT_ONCE_S 0.060 /* JPEG that comes so soon is left alone: what hands do is shown as they move */
#define FEW_S 0.100          /* above, fewer than ten pictures a second */
#define SLOWEST 8.0          /* a machine that halted for a moment, or tables that are made once, tell nothing more */
#define BETTER 0.8           /* of the time, that another step must take at most */
#define BACK 0.5             /* of a limit, at which a step back up is taken: pictures differ in what WebP gains */
#define VIDEO_S 0.070        /* of the line, for a picture of a video: fourteen a second, and none late; */
#define VIDEO_SHARE 0.5      /* or so much of the time that there is for it, where pictures take longer to make; */
#define VIDEO_MOST_S 0.200   /* but it is late itself then */
#define VIDEO_MOST 1e6       /* bytes: no picture takes so many */
#define VIDEO_LEAST 5000u    /* bytes: the line's rate is not read off fewer (line.c) */

enum {
    STEP_JPEG,
    STEP_WEBP,
    STEP_WEBP_ROUGH,
    STEP_VIDEO,
    ROUGH_QUALITY = 50, /* a quarter of the bytes of JPEG 85, 1.6 times its error */
    CHROMA_FROM = 90,   /* JPEG of this quality has colours of full resolution, and WebP never has */
    STAY_FRAMES = 4,    /* what a step really takes is known then */
};

static struct knot at(double quality)
{
    size_t i = 1;
    while (i + 1 < LUM_ARRAY_LEN(knots) && knots[i].quality < quality)
        i++;
    const struct knot *a = &knots[i - 1], *b = &knots[i];
    double t = (quality - a->quality) / (b->quality - a->quality);
    return (struct knot){quality, a->webp_quality + t * (b->webp_quality - a->webp_quality),
                         a->jpeg_bytes + t * (b->jpeg_bytes - a->jpeg_bytes),
                         a->webp_bytes + t * (b->webp_bytes - a->webp_bytes)};
}

int lum_coding_webp_quality(uint32_t quality)
{
    return (int)(at(quality).webp_quality + 0.5);
}

static struct lum_coding of_step(int step, uint32_t quality)
{
    if (step == STEP_VIDEO)
        return (struct lum_coding){LUM_CODEC_VP9, 0};
    if (step == STEP_WEBP_ROUGH && quality > ROUGH_QUALITY)
        quality = ROUGH_QUALITY;
    return (struct lum_coding){step == STEP_JPEG ? LUM_CODEC_JPEG : LUM_CODEC_WEBP, (uint8_t)quality};
}

/* Bytes of a step, of those that JPEG of the quality that was asked for takes. */
static double share(int step, uint32_t quality)
{
    struct lum_coding c = of_step(step, quality);
    return (step == STEP_JPEG ? at(c.quality).jpeg_bytes : at(c.quality).webp_bytes) / at(quality).jpeg_bytes;
}

static double ns_pixel(int step)
{
    return step == STEP_JPEG ? JPEG_NS_PIXEL : WEBP_NS_PIXEL;
}

/* WebP of the same error: there is none for a quality above 90. At 90 it is so over a picture, and colours that are
 * read as values have edges. */
static bool has_like(uint32_t quality, bool colors)
{
    return quality < CHROMA_FROM || (quality == CHROMA_FROM && !colors);
}

/* Encoding, and the line. */
static double seconds(const struct lum_coding_notes *s, int step, uint32_t quality, const struct lum_coding_line *line)
{
    return s->n_pixels * ns_pixel(step) * s->slowness * 1e-9 / line->threads +
           s->plain_bytes * share(step, quality) / line->bytes_s;
}

/* Of those with tiles. */
static int better_tiles(const struct lum_coding_notes *s, uint32_t quality, const struct lum_coding_line *line)
{
    double jpeg = seconds(s, STEP_JPEG, quality, line), webp = seconds(s, STEP_WEBP, quality, line),
           rough = seconds(s, STEP_WEBP_ROUGH, quality, line);
    bool like = has_like(quality, line->colors);
    if (!line->webp)
        return STEP_JPEG;
    switch (s->step) {
    case STEP_JPEG:
        if (like)
            return jpeg > SEEN_AT_ONCE_S && webp < BETTER * jpeg ? STEP_WEBP : STEP_JPEG;
        return jpeg > FEW_S && rough < BETTER * jpeg && !line->colors ? STEP_WEBP_ROUGH : STEP_JPEG;
    case STEP_WEBP:
        if (jpeg < BACK * SEEN_AT_ONCE_S || jpeg < BETTER * webp)
            return STEP_JPEG;
        return webp > FEW_S && rough < BETTER * webp && !line->colors ? STEP_WEBP_ROUGH : STEP_WEBP;
    default:
        if (!like)
            return jpeg < BACK * FEW_S ? STEP_JPEG : STEP_WEBP_ROUGH;
        return webp < BACK * FEW_S ? STEP_WEBP : STEP_WEBP_ROUGH;
    }
}

/* Tiles in the fewest bytes that this client may have. */
static int last_tiles(const struct lum_coding_line *line)
{
    return !line->webp ? STEP_JPEG : line->colors ? STEP_WEBP : STEP_WEBP_ROUGH;
}

static int better_step(const struct lum_coding_notes *s, uint32_t quality, const struct lum_coding_line *line)
{
    double fewest = seconds(s, last_tiles(line), quality, line);
    if (s->step == STEP_VIDEO)
        return fewest < BACK * FEW_S ? last_tiles(line) : STEP_VIDEO;
    return line->vp9 && !line->colors && fewest > FEW_S ? STEP_VIDEO : better_tiles(s, quality, line);
}

/* Without a better one: what is not to be had any more is left. */
static int same_step(const struct lum_coding_notes *s, const struct lum_coding_line *line)
{
    bool gone = s->step == STEP_VIDEO ? !line->vp9 || line->colors : s->step > last_tiles(line);
    return gone ? last_tiles(line) : s->step;
}

static struct lum_coding choose(struct lum_coding_notes *s, uint32_t quality, const struct lum_coding_line *line)
{
    int step = same_step(s, line);
    if (step == s->step && s->stay == 0 && s->plain_bytes > 0.0 && line->bytes_s > 0.0)
        step = better_step(s, quality, line);
    if (step == STEP_WEBP && !has_like(quality, line->colors))
        step = STEP_JPEG;
    if (step != s->step)
        s->stay = STAY_FRAMES;
    s->step = step;
    return of_step(step, quality);
}

struct lum_coding lum_coding_choose(struct lum_coding_state *s, uint32_t quality, const struct lum_coding_line *line)
{
    struct lum_coding_line tiles = *line;
    tiles.vp9 = false;
    if (line->rest && !s->rests)
        s->rest = s->moving;
    s->rests = line->rest;
    return line->rest ? choose(&s->rest, quality, &tiles) : choose(&s->moving, quality, line);
}

bool lum_coding_is_video(const struct lum_coding_state *s)
{
    return s->moving.step == STEP_VIDEO;
}

uint32_t lum_coding_video_bytes(double bytes_s, double interval_s)
{
    double line_s = VIDEO_SHARE * interval_s;
    line_s = line_s < VIDEO_S ? VIDEO_S : line_s > VIDEO_MOST_S ? VIDEO_MOST_S : line_s;
    double bytes = line_s * bytes_s;
    return bytes > VIDEO_LEAST ? (uint32_t)(bytes < VIDEO_MOST ? bytes : VIDEO_MOST) : VIDEO_LEAST;
}

/* The frame before tells most; one of few tiles says little of the next. */
static double mixed(double was, double is)
{
    return was > 0.0 ? was + 0.5 * (is - was) : is;
}

static void note(struct lum_coding_notes *s, uint32_t quality, const struct lum_coding_cost *cost)
{
    if (s->step != STEP_VIDEO && cost->n_pixels == 0)
        return;
    s->stay -= s->stay > 0;
    if (s->step == STEP_VIDEO) /* tells nothing of tiles */
        return;
    s->plain_bytes = mixed(s->plain_bytes, (double)cost->n_bytes / share(s->step, quality));
    s->n_pixels = mixed(s->n_pixels, (double)cost->n_pixels);
    double slowness = (double)cost->cpu_ns / ((double)cost->n_pixels * ns_pixel(s->step));
    s->slowness = mixed(s->slowness, slowness < SLOWEST ? slowness : SLOWEST);
}

void lum_coding_note(struct lum_coding_state *s, uint32_t quality, const struct lum_coding_cost *cost)
{
    note(s->rests ? &s->rest : &s->moving, quality, cost);
}
