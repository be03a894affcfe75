/* How pictures that need not be exact are coded: as tiles of JPEG or WebP, how well, or as video, and which of it suits
 * a line.
 *
 * Four steps, each of fewer bytes than the one before: JPEG as the client asked for it; WebP of the same error, which
 * takes half the bytes and ten times the time, and is left out where there is none; WebP of more error, where even that
 * shows fewer than ten pictures a second; video, where that does so, too. It takes what the line brings in the time of
 * a picture, and is taken at once: on such a line a few tiles more are seconds. What a step takes is reckoned from what
 * the frames before took. A step is left when another is better by a margin, and not before a few frames were sent with
 * it: the ways to and fro have different limits.
 *
 * A picture at rest that is larger than those that move comes by tiles, and is a picture of its own: it begins with the
 * step and the notes of those that move, and leaves them as they are, so that the next drag goes on as the last. */
#ifndef LUM_SERVER_STREAM_CODING_H
#define LUM_SERVER_STREAM_CODING_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/message/frame.h"

struct lum_coding {
    uint8_t codec;   /* enum lum_codec */
    uint8_t quality; /* of tiles, as JPEG has it; of video: 0 */
};

struct lum_coding_notes {
    int step;
    uint32_t stay;      /* frames until another step may be taken */
    double plain_bytes; /* a frame takes as JPEG; 0: not known */
    double n_pixels;    /* of a frame */
    double slowness;    /* of this machine: 1 as the one that the table was made on */
};

struct lum_coding_state {
    struct lum_coding_notes moving, rest;
    bool rests; /* the last frame was chosen so */
};

/* What a frame took. */
struct lum_coding_cost {
    uint64_t n_bytes, n_pixels, cpu_ns;
};

struct lum_coding_line {
    double bytes_s; /* 0: not known */
    uint32_t threads;
    bool webp;   /* the client reads it, and this build writes it */
    bool vp9;    /* likewise */
    bool rest;   /* the picture is larger than those that move, since nothing does */
    bool colors; /* stand for values: no more error than was asked for, and with edges as sharp */
};

/* The next frame's. */
struct lum_coding lum_coding_choose(struct lum_coding_state *state, uint32_t quality,
                                    const struct lum_coding_line *line);
/* Pictures that move are video now; also while one rests. */
bool lum_coding_is_video(const struct lum_coding_state *state);
/* What a picture of a video should take on that line; interval_s: how often there is one, as of late. */
uint32_t lum_coding_video_bytes(double bytes_s, double interval_s);
/* A frame was coded as was chosen last. Of video the cost is not looked at. */
void lum_coding_note(struct lum_coding_state *state, uint32_t quality, const struct lum_coding_cost *cost);

/* WebP's own number for the error that JPEG of this quality has; above 90, of 90: it gets no better with its colours of
 * half the resolution. */
int lum_coding_webp_quality(uint32_t quality);

#endif
