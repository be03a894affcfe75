/* How fast the way to a client is, by when it says that it has a frame.
 *
 * A frame of n bytes that is sent alone is answered after rtt + n / rate. So two frames of different sizes tell both;
 * and of frames that follow each other without a gap, each is answered n / rate after the one before. What tells
 * neither is a bound: the line is at least that fast, or, if all frames of a while say no more, no faster than it has
 * to be. A client that acknowledges before it has the frame looks faster than its line, and nothing else comes of it.
 *
 * No clock of its own: times are of a monotonic one. Not thread-safe. */
#ifndef LUM_SERVER_STREAM_LINE_H
#define LUM_SERVER_STREAM_LINE_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/base/limits.h"

struct lum_line_frame {
    uint64_t seq, n_bytes;
    int64_t began_ns;
    bool whole; /* its last byte is on its way */
};

struct lum_line {
    struct lum_line_frame frames[LUM_LIMIT_UNACKED_FRAMES]; /* oldest first */
    uint32_t n;
    int64_t answered_ns; /* the newest answer */
    struct {
        double bytes, ns; /* of the frame that was answered soonest of late; ns 0: none yet */
        int64_t at_ns;
    } soonest;
    struct {
        double bytes, ns; /* of frames that told the rate, the newest with the most weight */
    } sum;
    struct {
        double bytes, ns; /* of the last n frames, which all told much more than was thought */
        uint32_t n;
    } faster;
    struct {
        double bytes, ns; /* of the fastest frame that told no more than a bound below the rate */
        uint32_t n;
        int64_t since_ns;
    } bounds;
    double bytes_s; /* 0: not known */
};

/* The first byte of a frame is about to go. */
void lum_line_begin(struct lum_line *line, uint64_t seq, int64_t now_ns);
/* Bytes of the newest frame. last: they are its end. */
void lum_line_add(struct lum_line *line, uint64_t n_bytes, bool last);
/* The newest frame will have no end. */
void lum_line_cut(struct lum_line *line);
/* held_ns: how long the client says that it had the frame before it said so. */
void lum_line_answer(struct lum_line *line, uint64_t seq, int64_t held_ns, int64_t now_ns);
/* What was sent and is not answered takes so long by what is known; 0: nothing is. */
double lum_line_owed_s(const struct lum_line *line);

#endif
