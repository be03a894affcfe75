/* A team shares the work of a view: each member comes to the picture, the rays and the records that one alone would,
 * to the bit, at every pass and after edits. Where one is short of memory all end, or none. */
#include <sys/wait.h>
#include <unistd.h>

#include "core/base/team.h"
#include "core/cache/store.h"
#include "core/path/guide.h"
#include "tests/support/crew.h"
#include "tests/support/effort.h"
#include "tests/support/rig.h"

enum { PICTURES = 5 };

/* What a member saw, pass by pass. */
struct seen {
    struct lum_rgb *picture[PICTURES];
    uint64_t rays[PICTURES][LUM_RAY_KIND_COUNT], tiles[PICTURES][LUM_EFFECT_COUNT];
    uint64_t created[PICTURES], updated[PICTURES], removed[PICTURES];
    double error[PICTURES], noise[PICTURES];
    uint64_t heard_bytes;
};

struct scenario {
    const char *method;
    bool pane; /* under the lamps: records keep what it leaves of each VPL */
    struct seen seen[CREW_MAX];
};

static void put_pane(struct rig *r)
{
    struct lum_material_desc m = lum_material_default();
    m.base_color = lum_rgb(0.8f, 0.9f, 1.0f);
    m.transmission = 1.0f;
    m.thin = true;
    m.roughness = 0.0f;
    rig_material(r, "glass", &m);
    rig_square(r, "pane", 1.0);
    rig_object(r, "pane", "pane", "glass", rig_v(0.0, 1.7, 0.0));
}

static void begin(struct rig *r, const char *method, bool pane)
{
    rig_begin(r, 2);
    rig_room(r);
    if (pane)
        put_pane(r);
    rig_bulb(r, "lamp", rig_v(-0.7, 2.4, 0.3), 80);
    struct lum_light_desc panel = rig_quad(rig_v(0.5, 2.95, 0.5), rig_v(0.6, 0, 0), rig_v(0, 0, 0.6), 60);
    rig_light(r, "panel", &panel);
    rig_commit(r);
    r->settings.method = lum_method_find(method);
    r->settings.w = 104; /* tiles at the edges are cut */
    r->settings.h = 56;
    r->settings.n_vpls = 64;
    r->settings.max_spp = r->settings.method->progressive ? 9 : 3; /* guides are made before samples 2, 3, 4, 6 and 8 */
    r->settings.error_share = LUM_ERROR_SHARE;
}

/* Before the k-th picture. */
static void edit(struct rig *r, int k)
{
    switch (k) {
    case 1:
        rig_object(r, "crate", "crate", "red", rig_v(0.1, 0.5, -0.6));
        break;
    case 2:
        rig_bulb(r, "lamp", rig_v(-0.7, 2.4, 0.3), 20);
        break;
    case 3:
        rig_bulb(r, "lamp", rig_v(0.9, 2.4, 0.3), 20);
        break;
    default:
        r->settings.camera.target.x -= k == 4 ? 0.8 : 0.0;
        return;
    }
    rig_commit(r);
}

static void note(struct seen *s, const struct lum_pass_stats *stats, int k)
{
    for (int i = 0; i < LUM_RAY_KIND_COUNT; i++)
        s->rays[k][i] += stats->rays[i];
    for (int i = 0; i < LUM_EFFECT_COUNT; i++)
        s->tiles[k][i] += stats->effects[i].tiles;
    s->created[k] += stats->cache.created;
    s->updated[k] += stats->cache.updated;
    s->removed[k] += stats->cache.removed;
    s->error[k] = stats->error.bound;
    s->noise[k] = stats->effects[LUM_EFFECT_INDIRECT_DIFFUSE].noise;
}

static void look(struct lum_team *team, void *user)
{
    struct scenario *sc = user;
    struct seen *s = &sc->seen[team ? team->rank : 0];
    struct rig r;
    begin(&r, sc->method, sc->pane);
    lum_view_join(r.view, team);
    for (int k = 0; k < PICTURES; k++) {
        struct lum_pass_stats stats;
        edit(&r, k);
        do {
            stats = rig_pass(&r);
            note(s, &stats, k);
        } while (!stats.complete);
        s->picture[k] = rig_picture(&r);
    }
    s->heard_bytes = team ? team->heard_bytes : 0;
    rig_end(&r);
}

static void hold_against(const struct scenario *alone, const struct scenario *team, uint32_t rank, uint32_t size)
{
    const struct seen *a = &alone->seen[0], *b = &team->seen[rank];
    for (int k = 0; k < PICTURES; k++) {
        if (memcmp(a->picture[k], b->picture[k], 104 * 56 * sizeof(struct lum_rgb)) != 0)
            fail_msg("%s: picture %d of rank %u of %u is not that of one alone", team->method, k, rank, size);
        for (int i = 0; i < LUM_RAY_KIND_COUNT; i++)
            if (a->rays[k][i] != b->rays[k][i])
                fail_msg("%s: picture %d of rank %u of %u: %llu rays of kind %d, and not %llu", team->method, k, rank,
                         size, (unsigned long long)b->rays[k][i], i, (unsigned long long)a->rays[k][i]);
        assert_memory_equal(a->tiles[k], b->tiles[k], sizeof a->tiles[k]);
        assert_int_equal(a->created[k], b->created[k]);
        assert_int_equal(a->updated[k], b->updated[k]);
        assert_int_equal(a->removed[k], b->removed[k]);
        assert_memory_equal(&a->error[k], &b->error[k], sizeof a->error[k]);
        assert_memory_equal(&a->noise[k], &b->noise[k], sizeof a->noise[k]);
    }
    assert_true(b->heard_bytes > 0 || size == 1);
}

static void forget(struct scenario *s)
{
    for (int m = 0; m < CREW_MAX; m++)
        for (int k = 0; k < PICTURES; k++)
            lum_free(s->seen[m].picture[k]);
}

static void pictures_are_those_of_one(void **state)
{
    (void)state;
    static const struct scenario scenarios[] = {{.method = "path"},     {.method = "live"},    {.method = "irrcache"},
                                                {"live", .pane = true}, {"tic", .pane = true}, {"ic", .pane = true}};
    static const uint32_t sizes[] = {3, 1, 2};
    for (size_t k = 0; k < LUM_ARRAY_LEN(scenarios); k++) {
        struct scenario alone = scenarios[k];
        look(NULL, &alone);
        for (size_t i = 0; i < TEST_EFFORT(LUM_ARRAY_LEN(sizes)); i++) {
            struct scenario team = scenarios[k];
            crew_run(sizes[i], look, &team);
            for (uint32_t r = 0; r < sizes[i]; r++)
                hold_against(&alone, &team, r, sizes[i]);
            forget(&team);
        }
        forget(&alone);
    }
}

/* ---- memory that is short ---- */

enum { SHORT_PASSES = 5, ALONE = CREW_GAVE_UP + 1 };

/* Records that this thread puts into a store, since it began to count, and which of them finds no room there; 0: none.
 */
static _Thread_local uint64_t n_inserted, fails_at;

/* Those that it asks for, and from which of them on there is no memory for any; 0: there is. A round asks for some, and
 * then inserts them: where the first few ended, in both counts. */
enum { ROUNDS_SEEN = 4 };
static _Thread_local struct {
    uint64_t n, fails_at, n_inserted;
    uint32_t n_rounds;
    struct {
        uint64_t asked, inserted;
    } end[ROUNDS_SEEN];
} asked;

struct lum_cache_record *__real_lum_store_new(struct lum_store *store, uint32_t worker);
struct lum_cache_record *__wrap_lum_store_new(struct lum_store *store, uint32_t worker);
struct lum_cache_record *__wrap_lum_store_new(struct lum_store *store, uint32_t worker)
{
    if (n_inserted > asked.n_inserted && asked.n_rounds < ROUNDS_SEEN) {
        asked.end[asked.n_rounds].asked = asked.n;
        asked.end[asked.n_rounds++].inserted = n_inserted;
    }
    asked.n_inserted = n_inserted;
    bool none = ++asked.n >= asked.fails_at && asked.fails_at > 0;
    return none ? NULL : __real_lum_store_new(store, worker);
}

bool __real_lum_store_insert(struct lum_store *store, uint32_t worker, struct lum_cache_record *record);
bool __wrap_lum_store_insert(struct lum_store *store, uint32_t worker, struct lum_cache_record *record);
bool __wrap_lum_store_insert(struct lum_store *store, uint32_t worker, struct lum_cache_record *record)
{
    return ++n_inserted != fails_at && __real_lum_store_insert(store, worker, record);
}

/* The k-th allocation of one pass fails at the last member, which goes on as long as its passes succeed. */
struct shortage {
    const char *method;
    uint32_t pass;
    uint64_t k;
    bool records;   /* the k-th record finds no room, in place of the k-th allocation */
    uint64_t asked; /* and nobody has memory from the one on that they ask for so late; 0: they have */
};

static void look_short(struct lum_team *team, void *user)
{
    const struct shortage *sh = user;
    struct rig r;
    begin(&r, sh->method, false);
    lum_view_join(r.view, team);
    for (uint32_t i = 0; i < SHORT_PASSES; i++) {
        struct lum_pass_stats stats;
        struct lum_error err;
        if (!r.settings.method->progressive)
            edit(&r, (int)i);
        uint64_t k = i == sh->pass && team->rank == team->size - 1 ? sh->k : 0;
        n_inserted = asked.n = asked.n_inserted = 0;
        fails_at = sh->records ? k : 0;
        asked.fails_at = i == sh->pass ? sh->asked : 0;
        lum_alloc_fail_after(sh->records ? 0 : k);
        enum lum_status status = lum_view_pass(r.view, r.snapshot, &r.settings, NULL, &stats, &err);
        lum_alloc_fail_after(0);
        if (status != LUM_OK && sh->asked)
            _Exit(ALONE);
        if (status != LUM_OK)
            team->kind->give_up(team, err.text);
    }
    rig_end(&r);
}

/* Of a pass of one alone. */
static uint64_t count_records(const char *method, uint32_t pass)
{
    struct rig r;
    begin(&r, method, false);
    for (uint32_t i = 0; i <= pass; i++) {
        struct lum_pass_stats stats;
        struct lum_error err;
        if (!r.settings.method->progressive)
            edit(&r, (int)i);
        memset(&asked, 0, sizeof asked);
        n_inserted = 0;
        assert_int_equal(lum_view_pass(r.view, r.snapshot, &r.settings, NULL, &stats, &err), LUM_OK);
    }
    rig_end(&r);
    return n_inserted;
}

/* 0: it ended well; CREW_GAVE_UP: one gave up. All else fails. */
static int exit_of(struct shortage sh)
{
    int how = 0;
    fflush(NULL);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        crew_run(2, look_short, &sh);
        _Exit(0);
    }
    assert_int_equal(waitpid(child, &how, 0), child);
    if (!WIFEXITED(how) || (WEXITSTATUS(how) != 0 && WEXITSTATUS(how) != CREW_GAVE_UP))
        fail_msg("%s: pass %u without its allocation %u: members were not at the same step", sh.method, sh.pass,
                 (unsigned)sh.k);
    return WEXITSTATUS(how);
}

/* Where one alone would go on without something, the members of a team would be at different work. */
static void short_memory_parts_none(void **state)
{
    (void)state;
#if defined(__SANITIZE_THREAD__)
    skip(); /* its runtime starts no threads in a child of a process that had some */
#endif
    for (uint64_t k = 1; k <= 3; k++) /* the guide, its nodes, and its first cells */
        assert_int_equal(exit_of((struct shortage){"path", 1, k, false, 0}), CREW_GAVE_UP);
    for (uint32_t pass = 2; pass < SHORT_PASSES; pass++) /* more cells */
        (void)exit_of((struct shortage){"path", pass, 1, false, 0});
    int n_whole = 0;
    for (uint64_t k = 60; k <= 90; k++) /* of the first frame: caches, VPLs, rays that are kept, records, probes */
        n_whole += exit_of((struct shortage){"live", 0, k, false, 0}) == 0;
    assert_true(n_whole > 0);
}

/* Where there is no room for a record a view makes some, and begins anew: a member of a team cannot do so alone, and
 * least of all in its last round, when the others go on to other work. */
static void records_without_room_part_none(void **state)
{
    (void)state;
#if defined(__SANITIZE_THREAD__)
    skip();
#endif
    const char *methods[] = {"live", "irrcache"};
    for (int m = 0; m < 2; m++)
        for (uint32_t pass = 0; pass < 2; pass++) {
            uint64_t n = count_records(methods[m], pass);
            assert_true(n > 8);
            const uint64_t at[] = {1, n / 2, n - 1, n};
            for (int i = 0; i < 4; i++)
                assert_int_equal(exit_of((struct shortage){methods[m], pass, at[i], true, 0}), CREW_GAVE_UP);
        }
}

/* One has no room for the last record of a round, and the others have no memory for the first of the next, nor for any
 * then: all have no room, and not at the same step. They give up where they part, and not one of them later, for a
 * reason of its own, while the others are a step behind. */
static void records_without_room_at_two_steps_part_none(void **state)
{
    (void)state;
#if defined(__SANITIZE_THREAD__)
    skip();
#endif
    (void)count_records("live", 0);
    assert_true(asked.n_rounds > 1);
    uint32_t n = asked.n_rounds;
    for (uint32_t i = 0; i < n; i++) {
        struct shortage sh = {"live", 0, asked.end[i].inserted, true, asked.end[i].asked + 1};
        assert_int_equal(exit_of(sh), CREW_GAVE_UP);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pictures_are_those_of_one),
        cmocka_unit_test(short_memory_parts_none),
        cmocka_unit_test(records_without_room_part_none),
        cmocka_unit_test(records_without_room_at_two_steps_part_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
