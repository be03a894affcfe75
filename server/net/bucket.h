/* A bucket of tokens: a session pays with them for what it sends. They come back at an even pace, up to what the
 * bucket holds. */
#ifndef LUM_SERVER_NET_BUCKET_H
#define LUM_SERVER_NET_BUCKET_H

#include <stdbool.h>
#include <stdint.h>

struct lum_bucket {
    double level; /* tokens that are there; below 0: owed */
    double per_s, full;
    int64_t filled_ns; /* when level was right */
};

struct lum_bucket lum_bucket_full(double per_s, double full, int64_t now_ns);
double lum_bucket_level(struct lum_bucket *b, int64_t now_ns); /* what is there now */
/* Takes one token. False: there is none. */
bool lum_bucket_take(struct lum_bucket *b, int64_t now_ns);
/* Takes n, also those that are not there yet. Returns how long to wait until nothing is owed, an hour at most; 0:
 * nothing is. */
int64_t lum_bucket_charge(struct lum_bucket *b, double n, int64_t now_ns);

#endif
