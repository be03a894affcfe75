/* A cache of instant caching on a rig, the records in it, and what they would be if they were built now. */
#ifndef LUM_TESTS_SUPPORT_INSTANT_BED_H
#define LUM_TESTS_SUPPORT_INSTANT_BED_H

#include "core/cache/instant.h"
#include "core/pass/pass.h"
#include "tests/support/rig.h"

#define BED_RECORDS 256u

struct instant_bed {
    struct rig rig;
    struct lum_caches *caches;
    struct lum_cache *cache;
    struct lum_cache_record *records[BED_RECORDS]; /* in the cache; NULL: was removed */
    uint32_t n;
    uint64_t rays; /* of the last update and the last refresh */
};

struct lum_cache_key instant_key(const struct lum_cache_kind *kind, uint32_t n_vpls, uint32_t max_bounces);
void bed_begin(struct instant_bed *b, const struct lum_cache_key *key);
void bed_end(struct instant_bed *b);
void bed_tell_cache(struct instant_bed *b);
/* Publishes the edits and tells the cache. */
void bed_publish(struct instant_bed *b);
struct lum_cache_job bed_job(struct instant_bed *b, struct lum_cache_record *const *records, uint32_t n,
                             struct lum_counters *counters);
/* Fills records; their rays are b->rays. */
void bed_build(struct instant_bed *b, struct lum_cache_record *const *records, uint32_t n);
/* Builds those from `first` on and shares them. */
void bed_insert(struct instant_bed *b, uint32_t first);
/* Not yet built. */
void bed_add(struct instant_bed *b, struct lum_vec3 p, struct lum_vec3 n);
/* n records on the surfaces that rays from a point meet. */
void bed_add_seen(struct instant_bed *b, struct lum_vec3 eye, uint32_t n, uint32_t seed);
/* Brings records first .. first + n - 1 up to date, as a view would; those that were removed are forgotten. */
void bed_refresh(struct instant_bed *b, uint32_t first, uint32_t n);
/* Every record that is up to date is bit for bit what it would be if it were built now: its terms are what was traced,
 * with the same arithmetic, and their sum is taken in the same order, so that there is nothing to tolerate. */
void bed_assert_as_built(struct instant_bed *b, const char *what);
/* Green irradiance of all records. */
double bed_total(const struct instant_bed *b);
void bed_lamp(struct instant_bed *b, const char *id, double x, double y, double z, double cd);

#endif
