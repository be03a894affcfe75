/* Shared by the parts of the study of the irradiance cache's storages: what was measured (irrcache.c; irrcache_store.c,
 * which alone sees core's records: the protocol has others of that name) and how it is shown (irrcache_report.c). */
#ifndef LUM_TESTS_BENCH_IRRCACHE_H
#define LUM_TESTS_BENCH_IRRCACHE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

struct lum_bench_options;
struct lum_cache;
struct lum_caches;
struct lum_view_settings;

enum { IRR_SCENES = 5, IRR_ROUNDS = 5, IRR_ANIMATIONS = 2, IRR_FRAMES = 100, IRR_TURNS = 3 };

/* As the thesis calls them; in the order of enum lum_storage. */
enum irr_storage { IRR_TRA, IRR_LCK, IRR_LW, IRR_WF, IRR_STORAGES };
extern const char *const irr_storages[IRR_STORAGES];

/* Threads of a run: 1, 2, 4, 8. TRA has one only. */
enum { IRR_CREWS = 4 };
extern const uint32_t irr_threads[IRR_CREWS];

/* Frames of one storage and crew from an empty cache, by round: means of the two of a round. */
struct irr_cell {
    size_t n; /* rounds; 0: not measured */
    double ms[IRR_ROUNDS], cpu_ms[IRR_ROUNDS];
    double indirect_ms[IRR_ROUNDS]; /* of them: looking up, building, interpolating */
    double records[IRR_ROUNDS];     /* made in a frame */
    double discarded[IRR_ROUNDS];   /* made, and not kept */
    double overhead[IRR_ROUNDS];    /* LCK, LW: seconds; WF: insertions that had to go another way */
    uint64_t rays;                  /* of one frame */
};

struct irr_scene {
    const char *name;
    uint64_t n_triangles;
    struct irr_cell cells[IRR_STORAGES][IRR_CREWS];
};

/* A turn of the camera with the cache kept: median over the turns, frame by frame. */
struct irr_animation {
    const char *name;
    uint32_t n_frames, n_threads[2];
    double ms[IRR_STORAGES][2][IRR_FRAMES];
    double created[IRR_STORAGES][2][IRR_FRAMES];
};

/* Searches per second of all threads together; mixed: one in IRR_INSERT_EVERY operations inserts. */
#define IRR_INSERT_EVERY 64u
struct irr_lookups {
    size_t n; /* rounds */
    double per_s[IRR_ROUNDS];
    double found; /* records by a search, on average */
};

struct irr_study {
    struct irr_scene scenes[IRR_SCENES];
    size_t n_scenes;
    struct irr_animation animations[IRR_ANIMATIONS];
    size_t n_animations;
    struct irr_lookups lookups[2][IRR_STORAGES][IRR_CREWS]; /* [0]: searches alone, [1]: mixed */
    uint32_t n_crews, n_processors;
    uint32_t w, h;
    float accuracy;
    char machine[256];
};

/* The cache of method irrcache that a view with these settings uses in a scene without media, with panes or without,
 * held: to empty it, and to ask what its storage cost. */
LUM_MUST_USE enum lum_status irr_cache_acquire(struct lum_caches *caches, const struct lum_view_settings *settings,
                                               bool panes, struct lum_cache **ret_cache, struct lum_error *err);
void irr_cache_release(struct lum_caches *caches, struct lum_cache *cache); /* accepts NULL */
bool irr_cache_is_used(const struct lum_cache *cache);                      /* a view has */
/* Its memory stays. Between passes. */
void irr_cache_empty(struct lum_cache *cache);
/* Since creation. The thesis lists seconds of waiting for LCK, all threads together, seconds of merging for LW, and a
 * number of insertions for WF: those whose CAS another thread won. */
double irr_cache_overhead(const struct lum_cache *cache);

/* Fills study->lookups. False after a message on stderr. */
bool irr_measure_lookups(struct irr_study *study, bool quick);

/* Tables and figures. False after a message on stderr. */
bool irr_report(const struct irr_study *study, const struct lum_bench_options *options);

#endif
