/* Many threads insert, search and remove in one store at once, more of them than there are cores. Every record carries
 * a sum of its fields, which no reader may ever see wrong, also of records that were removed in the same frame; and in
 * the end each is there exactly once, or was removed exactly once. Under the thread sanitizer it also checks the proof
 * sketch of tables.c. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>

#include "core/cache/store.h"
#include "core/math/sampler.h"

enum { THREADS = 16, FRAMES = 6, INSERTS = 150, HELD = 256, N_IDS = THREADS * FRAMES * INSERTS, N_FOUND = 64 };

struct note {
    struct lum_cache_record base;
    uint64_t sum;
};

struct stress {
    struct lum_store *store;
    pthread_barrier_t barrier;
    uint32_t seed;
    bool removes; /* threads remove what they find */
    _Atomic uint32_t n_broken, n_lost, n_refused;
    _Atomic uint8_t removed[N_IDS];
    _Atomic uint32_t n_inserted, n_removed;
};

struct thread {
    struct stress *s;
    uint32_t worker, dimension;
    struct lum_cache_record *held[HELD]; /* found in this frame: stay as they are until its end */
    uint32_t n_held;
};

static uint32_t bits(struct thread *t)
{
    return lum_hash_combine(lum_hash_combine(t->s->seed, t->worker), t->dimension++);
}

static uint64_t sum_of(const struct lum_cache_record *r)
{
    float fields[12];
    memcpy(fields,
           (float[]){r->p.x, r->p.y, r->p.z, r->n.x, r->n.y, r->n.z, r->radius, r->irradiance.r, r->irradiance.g,
                     r->irradiance.b, r->gradient[0].r, r->gradient[2].b},
           sizeof fields);
    uint64_t sum = r->object * UINT64_C(0x9e3779b97f4a7c15) + r->index;
    for (size_t i = 0; i < LUM_ARRAY_LEN(fields); i++) {
        uint32_t word;
        memcpy(&word, &fields[i], sizeof word);
        sum = (sum ^ word) * UINT64_C(0x100000001b3);
    }
    return sum;
}

static void check_sum(struct stress *s, struct lum_cache_record *r)
{
    if (((struct note *)r)->sum != sum_of(r))
        atomic_fetch_add(&s->n_broken, 1u);
}

static float uniform(struct thread *t)
{
    return (float)(bits(t) >> 8) * 0x1p-24f;
}

/* The same few places for all threads, so that they meet in the same new nodes and pages. */
static void fill(struct thread *t, struct lum_cache_record *r, uint32_t id)
{
    uint32_t place = lum_hash_combine(t->s->seed, id % (FRAMES * INSERTS));
    r->p = lum_v3((float)(place & 15u) / 16.0f, (float)(place >> 4 & 15u) / 16.0f, uniform(t));
    r->n = lum_v3(0.0f, 0.0f, 1.0f);
    r->radius = 0.004f * (float)(1u << (place >> 8 & 3u));
    r->object = id;
    r->irradiance = lum_rgb(uniform(t), uniform(t), uniform(t));
    r->gradient[0].r = uniform(t);
    r->gradient[2].b = uniform(t);
    ((struct note *)r)->sum = sum_of(r);
}

static void hold(struct thread *t, struct lum_cache_record *r)
{
    t->held[t->n_held++ % HELD] = r;
}

static void look_up(struct thread *t, struct lum_vec3 p, const struct lum_cache_record *own)
{
    struct stress *s = t->s;
    struct lum_cache_record *found[N_FOUND];
    uint32_t n = bits(t) % 2 || own ? lum_store_find(s->store, t->worker, p, found, N_FOUND)
                                    : lum_store_overlap(s->store, t->worker, p,
                                                        lum_v3(p.x + 0.1f, p.y + 0.1f, p.z + 0.1f), found, N_FOUND);
    bool seen = false;
    for (uint32_t i = 0; i < n; i++) {
        check_sum(s, found[i]);
        hold(t, found[i]);
        seen |= found[i] == own;
        if (s->removes && found[i] != own && bits(t) % 16 == 0 && lum_store_remove(s->store, t->worker, found[i])) {
            atomic_fetch_add(&s->removed[found[i]->object], 1u);
            atomic_fetch_add(&s->n_removed, 1u);
        }
    }
    /* another thread may have removed it, but not if nobody removes; and N_FOUND may not have sufficed */
    if (own && !seen && !s->removes && n < N_FOUND)
        atomic_fetch_add(&s->n_lost, 1u);
}

static void work_a_frame(struct thread *t, uint32_t frame)
{
    struct stress *s = t->s;
    for (uint32_t i = 0; i < INSERTS; i++) {
        struct lum_cache_record *r = lum_store_new(s->store, t->worker);
        if (!r) {
            atomic_fetch_add(&s->n_refused, 1u);
            continue;
        }
        if (bits(t) % 8 == 0) { /* thinks better of it */
            lum_store_drop(s->store, t->worker, r);
            r = lum_store_new(s->store, t->worker);
        }
        if (!r) {
            atomic_fetch_add(&s->n_refused, 1u);
            continue;
        }
        fill(t, r, (t->worker * FRAMES + frame) * INSERTS + i);
        if (lum_store_insert(s->store, t->worker, r)) {
            atomic_fetch_add(&s->n_inserted, 1u);
            look_up(t, r->p, r);
        }
        look_up(t, lum_v3(uniform(t), uniform(t), uniform(t)), NULL);
    }
    for (uint32_t i = 0; i < t->n_held && i < HELD; i++)
        check_sum(s, t->held[i]);
    t->n_held = 0;
}

static void *thread_main(void *arg)
{
    struct thread *t = arg;
    struct stress *s = t->s;
    for (uint32_t frame = 0; frame < FRAMES; frame++) {
        pthread_barrier_wait(&s->barrier);
        work_a_frame(t, frame);
        pthread_barrier_wait(&s->barrier);
        if (t->worker == 0 && lum_store_end_frame(s->store, NULL) != LUM_OK)
            atomic_fetch_add(&s->n_lost, 1u);
    }
    return NULL;
}

static void run(struct stress *s, enum lum_storage storage, uint32_t capacity)
{
    const struct lum_store_config config = {.storage = storage,
                                            .hi = {1.0f, 1.0f, 1.0f},
                                            .n_workers = THREADS,
                                            .record_bytes = sizeof(struct note),
                                            .capacity = capacity};
    assert_int_equal(lum_store_create(&config, &s->store, NULL), LUM_OK);
    static struct thread threads[THREADS];
    pthread_t ids[THREADS];
    assert_int_equal(pthread_barrier_init(&s->barrier, NULL, THREADS), 0);
    for (uint32_t i = 0; i < THREADS; i++) {
        threads[i] = (struct thread){.s = s, .worker = i};
        assert_int_equal(pthread_create(&ids[i], NULL, thread_main, &threads[i]), 0);
    }
    for (uint32_t i = 0; i < THREADS; i++)
        pthread_join(ids[i], NULL);
    pthread_barrier_destroy(&s->barrier);
}

/* Each id that was inserted is there once, by index and by search, or was removed once. */
static void check_all(struct stress *s)
{
    static uint8_t there[N_IDS];
    memset(there, 0, sizeof there);
    uint32_t n = 0;
    for (uint32_t i = 0; i < lum_store_limit(s->store); i++) {
        struct lum_cache_record *r = lum_store_at(s->store, i);
        if (!r)
            continue;
        assert_int_equal(r->index, i);
        assert_true(r->object < N_IDS);
        assert_int_equal(there[r->object]++, 0);
        check_sum(s, r);
        n++;
        static struct lum_cache_record *found[N_IDS];
        uint32_t n_found = lum_store_find(s->store, 0, r->p, found, N_IDS), times = 0;
        for (uint32_t k = 0; k < n_found; k++)
            times += found[k] == r;
        assert_int_equal(times, 1);
    }
    for (uint32_t id = 0; id < N_IDS; id++)
        assert_true(s->removed[id] + there[id] <= 1);
    struct lum_store_stats stats;
    lum_store_stats(s->store, &stats);
    printf("%u inserted, %u removed, %u refused, %llu contended\n", s->n_inserted, s->n_removed, s->n_refused,
           (unsigned long long)stats.contended);
    assert_int_equal(n, s->n_inserted - s->n_removed);
    assert_int_equal(lum_store_count(s->store), n);
    assert_int_equal(stats.inserted, s->n_inserted);
    assert_int_equal(stats.removed, s->n_removed);
    assert_int_equal(s->n_inserted + s->n_refused, N_IDS);
    assert_int_equal(s->n_broken, 0);
    assert_int_equal(s->n_lost, 0);
    lum_store_destroy(s->store);
}

static const enum lum_storage shared_storages[] = {LUM_STORAGE_LOCK, LUM_STORAGE_LOCAL, LUM_STORAGE_WAITFREE};

static void all_are_there_exactly_once(void **state)
{
    (void)state;
    static struct stress s;
    for (size_t i = 0; i < LUM_ARRAY_LEN(shared_storages); i++) {
        s = (struct stress){.seed = 1};
        run(&s, shared_storages[i], N_IDS + THREADS);
        assert_int_equal(s.n_refused, 0);
        check_all(&s);
    }
}

static void removal_under_readers(void **state)
{
    (void)state;
    static struct stress s;
    for (size_t i = 0; i < LUM_ARRAY_LEN(shared_storages); i++) {
        s = (struct stress){.seed = 2, .removes = true};
        run(&s, shared_storages[i], N_IDS + THREADS);
        assert_true(s.n_removed > 0);
        check_all(&s);
    }
}

/* Less room than threads ask for: it is used to the last record, and none is handed out twice. */
static void a_full_store_under_contention(void **state)
{
    (void)state;
    static struct stress s;
    for (size_t i = 0; i < LUM_ARRAY_LEN(shared_storages); i++) {
        s = (struct stress){.seed = 3};
        run(&s, shared_storages[i], N_IDS / 3 + 7);
        assert_int_equal(s.n_inserted, N_IDS / 3 + 7);
        check_all(&s);
        s = (struct stress){.seed = 4, .removes = true};
        run(&s, shared_storages[i], N_IDS / 3 + 7);
        check_all(&s);
    }
}

enum { RACERS = 4, ROUNDS = 1000, HEAT = 20 };

struct race {
    struct lum_store *store;
    _Atomic uint32_t n_ready;
    _Atomic uint32_t n_lost;
};
struct racer {
    struct race *race;
    uint32_t worker;
};

/* Everybody waits by looking, so that all start within nanoseconds; and gives way, as there may be fewer cores. */
static void meet(struct race *race, uint32_t n_meetings)
{
    atomic_fetch_add(&race->n_ready, 1u);
    while (atomic_load(&race->n_ready) < n_meetings * RACERS)
        sched_yield();
}

static void *racer_main(void *arg)
{
    struct racer *me = arg;
    struct race *race = me->race;
    uint32_t n_meetings = 0;
    for (uint32_t round = 0; round < ROUNDS; round++) {
        meet(race, ++n_meetings);
        struct lum_vec3 p = {(float)(round & 255u) / 256.0f, (float)(round >> 8) / 256.0f, 0.5f};
        float step = round % 2 ? 0x1p-6f : 0.0f; /* nodes of their own, or pages of one */
        for (uint32_t i = 0; i < HEAT; i++) {
            struct lum_cache_record *r = lum_store_new(race->store, me->worker);
            r->p = lum_v3(p.x, p.y, p.z + step * (float)i);
            r->radius = 0x1p-15f;
            if (!lum_store_insert(race->store, me->worker, r))
                atomic_fetch_add(&race->n_lost, 1u);
        }
        meet(race, ++n_meetings);
        struct lum_cache_record *found[2 * RACERS * HEAT];
        for (uint32_t i = 0; i < HEAT; i++) {
            struct lum_vec3 q = {p.x, p.y, p.z + step * (float)i};
            uint32_t n = lum_store_find(race->store, me->worker, q, found, LUM_ARRAY_LEN(found));
            if (n != (round % 2 ? RACERS : RACERS * HEAT))
                atomic_fetch_add(&race->n_lost, 1u);
        }
        meet(race, ++n_meetings);
        if (me->worker == 0 && round % 64 == 63)
            lum_store_clear(race->store);
        meet(race, ++n_meetings);
    }
    return NULL;
}

/* Threads that make the same new nodes and pages at the same time: whoever comes second goes on in the first one's, and
 * nothing is lost. */
static void who_loses_a_node_loses_no_record(void **state)
{
    (void)state;
    static struct race race;
    const struct lum_store_config config = {.storage = LUM_STORAGE_WAITFREE,
                                            .hi = {1.0f, 1.0f, 1.0f},
                                            .n_workers = RACERS,
                                            .record_bytes = sizeof(struct note),
                                            .capacity = ROUNDS * RACERS * HEAT};
    assert_int_equal(lum_store_create(&config, &race.store, NULL), LUM_OK);
    struct racer racers[RACERS];
    pthread_t ids[RACERS];
    for (uint32_t i = 0; i < RACERS; i++) {
        racers[i] = (struct racer){&race, i};
        assert_int_equal(pthread_create(&ids[i], NULL, racer_main, &racers[i]), 0);
    }
    for (uint32_t i = 0; i < RACERS; i++)
        pthread_join(ids[i], NULL);
    struct lum_store_stats stats;
    lum_store_stats(race.store, &stats);
    printf("%llu inserted, %llu contended\n", (unsigned long long)stats.inserted, (unsigned long long)stats.contended);
    assert_int_equal(race.n_lost, 0);
    assert_int_equal(stats.inserted, ROUNDS * RACERS * HEAT);
    lum_store_destroy(race.store);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_are_there_exactly_once),
        cmocka_unit_test(removal_under_readers),
        cmocka_unit_test(a_full_store_under_contention),
        cmocka_unit_test(who_loses_a_node_loses_no_record),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
