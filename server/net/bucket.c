#include "server/net/bucket.h"

#include <math.h>

struct lum_bucket lum_bucket_full(double per_s, double full, int64_t now_ns)
{
    return (struct lum_bucket){.level = full, .per_s = per_s, .full = full, .filled_ns = now_ns};
}

static void fill(struct lum_bucket *b, int64_t now_ns)
{
    b->level = fmin(b->full, b->level + (double)(now_ns - b->filled_ns) * 1e-9 * b->per_s);
    b->filled_ns = now_ns;
}

double lum_bucket_level(struct lum_bucket *b, int64_t now_ns)
{
    fill(b, now_ns);
    return b->level;
}

bool lum_bucket_take(struct lum_bucket *b, int64_t now_ns)
{
    fill(b, now_ns);
    if (b->level < 1.0)
        return false;
    b->level -= 1.0;
    return true;
}

#define WAIT_AT_MOST_NS 3.6e12 /* an hour; without a limit a debt could be of more nanoseconds than are counted */

int64_t lum_bucket_charge(struct lum_bucket *b, double n, int64_t now_ns)
{
    fill(b, now_ns);
    b->level -= n;
    return b->level < 0.0 ? (int64_t)fmin(ceil(-b->level / b->per_s * 1e9), WAIT_AT_MOST_NS) : 0;
}
