/* Many viewers of one room: what the first frame of the k-th one costs when those before him have filled the cache,
 * against viewers that each have their own, as in a daemon for each.
 *
 * The cameras stand around what the scene's own one looks at, in turns of 8 degrees to both sides, each no farther
 * from its place than nine tenths of the way to what is between. 600 x 400, rays through pixel centres, one shadow ray
 * a light, whole frames. Each round begins with empty caches and views that have forgotten all but their memory; both
 * ways take turns, and change places every other round. irrcache is free-running.
 *
 * Indirect light: rays to and of VPLs or through hemispheres, and the stages VPLs to upsampling; what mirrors show is
 * counted with the rays. CPU time is not told stage by stage: it is shared out by wall time.
 *
 * Memory: the greatest resident size of processes that load the scene and look once, through one view or through eight
 * that share. They are forked before this one has any thread. Eight daemons take eight times the former. */
#define _GNU_SOURCE
#include "tests/bench/viewers.h"

#include <math.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

const char *const viewers_methods[VIEWERS_METHODS] = {"irrcache", "tic", "live"};
const double viewers_degrees[VIEWERS] = {0, 8, -8, 16, -16, 24, -24, 32};

/* Accuracies as in the study of instant caching. --quick takes the first. */
static const struct {
    const char *name;
    float accuracy;
} scenes[VIEWERS_SCENES] = {{"cornell", 0.2f}, {"office", 0.2f}, {"sibenik", 0.35f}};

/* A scene at work, with views for one method and way. */
struct rig {
    struct lum_world world;
    struct lum_view_settings settings; /* but for the camera and the method */
    struct lum_camera cameras[VIEWERS];
    struct lum_view *views[VIEWERS];
    struct lum_caches *caches[VIEWERS]; /* shared: the first alone */
};

/* ---- cameras ---- */

static struct lum_vec3d mad(struct lum_vec3d a, struct lum_vec3d b, double s)
{
    return (struct lum_vec3d){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

static double dot(struct lum_vec3d a, struct lum_vec3d b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

/* Turns v around the unit axis k (Rodrigues). */
static struct lum_vec3d turn(struct lum_vec3d v, struct lum_vec3d k, double radians)
{
    struct lum_vec3d cross = {k.y * v.z - k.z * v.y, k.z * v.x - k.x * v.z, k.x * v.y - k.y * v.x};
    struct lum_vec3d zero = {0, 0, 0};
    return mad(mad(mad(zero, v, cos(radians)), cross, sin(radians)), k, dot(k, v) * (1.0 - cos(radians)));
}

static struct lum_camera camera_at(const struct lum_snapshot *s, const struct lum_camera *own, double degrees)
{
    struct lum_camera camera = *own, across = *own;
    struct lum_vec3d zero = {0, 0, 0}, axis = mad(zero, own->up, 1.0 / sqrt(dot(own->up, own->up)));
    struct lum_vec3d place =
        mad(own->target, turn(mad(own->position, own->target, -1.0), axis, degrees * 3.14159265358979 / 180.0), 1.0);
    struct lum_vec3d way = mad(place, own->position, -1.0);
    double length = sqrt(dot(way, way)), share = 1.0;
    struct lum_pick pick = {0};
    if (!(length > 0.0))
        return camera;
    across.target = place;
    lum_pick_at(s, &across, 1, 1, 0.5, 0.5, &pick);
    if (pick.hit && 0.9 * pick.distance_m < length)
        share = 0.9 * pick.distance_m / length;
    camera.position = mad(own->position, way, share);
    return camera;
}

/* ---- views ---- */

static void close_views(struct rig *r)
{
    for (int k = 0; k < VIEWERS; k++) {
        lum_view_destroy(r->views[k]);
        r->views[k] = NULL;
    }
    for (int k = 0; k < VIEWERS; k++) {
        lum_caches_destroy(r->caches[k]);
        r->caches[k] = NULL;
    }
}

/* Close them in both cases. */
static bool open_views(struct rig *r, enum viewers_way way, int n)
{
    struct lum_error err = {0};
    for (int k = 0; k < n; k++) {
        int cache = way == VIEWERS_SHARED ? 0 : k;
        if (!r->caches[cache] && lum_caches_create(lum_pool_size(r->world.pool), &r->caches[cache], &err) != LUM_OK)
            return lum_bench_failed(err.text);
        if (lum_view_create(r->world.pool, &r->views[k], &err) != LUM_OK)
            return lum_bench_failed(err.text);
        lum_view_share(r->views[k], r->caches[cache]);
    }
    return true;
}

static bool look(struct rig *r, int k, struct lum_pass_stats *ret_stats)
{
    struct lum_error err = {0};
    r->settings.camera = r->cameras[k];
    if (lum_view_pass(r->views[k], r->world.snapshot, &r->settings, NULL, ret_stats, &err) != LUM_OK)
        return lum_bench_failed(err.text);
    if (ret_stats->nonfinite == 0 && ret_stats->bad_rays == 0)
        return true;
    return lum_bench_failed("values are not finite, or rays were not fit to trace");
}

static bool look_all(struct rig *r, int n)
{
    struct lum_pass_stats stats;
    for (int k = 0; k < n; k++)
        if (!look(r, k, &stats))
            return false;
    return true;
}

static bool open_rig(struct rig *r, const struct lum_bench_options *options, const char *scene, float accuracy)
{
    struct lum_error err = {0};
    struct lum_camera own;
    *r = (struct rig){.settings = lum_view_settings_default()};
    r->settings.w = options->quick ? 60 : 600;
    r->settings.h = options->quick ? 40 : 400;
    r->settings.antialias = false;
    r->settings.shadow_samples = 1;
    r->settings.max_spp = 1;
    r->settings.cache_accuracy = accuracy;
    if (!lum_bench_world(scene, 0, &r->world))
        return false;
    if (lum_snapshot_camera(r->world.snapshot, NULL, &own, &err) != LUM_OK) {
        lum_world_finish(&r->world);
        return lum_bench_failed(err.text);
    }
    for (int k = 0; k < VIEWERS; k++)
        r->cameras[k] = camera_at(r->world.snapshot, &own, viewers_degrees[k]);
    return true;
}

static void close_rig(struct rig *r)
{
    close_views(r);
    lum_world_finish(&r->world);
}

/* ---- what it costs ---- */

static double indirect_share(const struct lum_pass_stats *s)
{
    static const enum lum_stage stages[] = {LUM_STAGE_VPLS,     LUM_STAGE_CACHE,  LUM_STAGE_RECORDS,
                                            LUM_STAGE_INDIRECT, LUM_STAGE_FILTER, LUM_STAGE_UPSAMPLE};
    double sum = 0.0;
    for (size_t i = 0; i < LUM_ARRAY_LEN(stages); i++)
        sum += s->stage_ms[stages[i]];
    return sum / s->ms;
}

static bool time_round(struct rig *r, size_t round, struct viewers_frame frames[VIEWERS])
{
    for (int k = 0; k < VIEWERS; k++) {
        lum_view_forget(r->views[k]);
        if (r->caches[k])
            lum_caches_forget(r->caches[k]);
    }
    for (int k = 0; k < VIEWERS; k++) {
        struct lum_pass_stats s;
        if (!look(r, k, &s))
            return false;
        frames[k].rays[round] = (double)(s.rays[LUM_RAY_INDIRECT_DIFFUSE] + s.rays[LUM_RAY_VPL]);
        frames[k].created[round] = (double)s.cache.created;
        frames[k].indirect_ms[round] = s.cpu_ms * indirect_share(&s);
        frames[k].cpu_ms[round] = s.cpu_ms;
    }
    return true;
}

static bool time_method(struct rig rigs[VIEWERS_WAYS], size_t n_rounds, struct viewers_cell *cell)
{
    for (size_t round = 0; round < n_rounds; round++)
        for (size_t i = 0; i < VIEWERS_WAYS; i++) {
            size_t way = round % 2 ? VIEWERS_WAYS - 1 - i : i;
            if (!time_round(&rigs[way], round, cell->frames[way]))
                return false;
        }
    lum_caches_measure(rigs[VIEWERS_SHARED].caches[0], &cell->cache);
    return true;
}

/* Both ways have their own views and caches, and borrow the same world. */
static bool run_method(const struct rig *r, enum viewers_method method, struct viewers_study *study, size_t scene)
{
    struct rig rigs[VIEWERS_WAYS] = {*r, *r};
    bool ok = true;
    for (int way = 0; ok && way < VIEWERS_WAYS; way++) {
        rigs[way].settings.method = lum_method_find(viewers_methods[method]);
        ok = open_views(&rigs[way], (enum viewers_way)way, VIEWERS) && look_all(&rigs[way], VIEWERS); /* warm-up */
    }
    ok = ok && time_method(rigs, study->n_rounds, &study->cells[scene][method]);
    for (int way = 0; way < VIEWERS_WAYS; way++)
        close_views(&rigs[way]);
    return ok;
}

static bool run_scene(const struct lum_bench_options *options, float accuracy, struct viewers_study *study,
                      size_t scene)
{
    struct rig r;
    bool ok = true;
    if (!open_rig(&r, options, study->scenes[scene], accuracy))
        return false;
    study->w = r.settings.w;
    study->h = r.settings.h;
    lum_bench_machine(&r.world, study->machine, sizeof study->machine);
    for (int m = 0; ok && m < VIEWERS_METHODS; m++) {
        lum_bench_progress("viewers: %s, %s", lum_bench_scene_name(study->scenes[scene]), viewers_methods[m]);
        ok = run_method(&r, (enum viewers_method)m, study, scene);
    }
    close_rig(&r);
    return ok;
}

/* ---- memory ---- */

/* A process that is to be measured: a scene, and n views on one cache that look once. */
struct visit {
    const struct lum_bench_options *options;
    const char *scene, *method;
    float accuracy;
    int n;
};

/* Peak resident size, in KiB; below 0 after a message on stderr. */
static double visit(const struct visit *v)
{
    struct rig r;
    struct rusage usage;
    if (!open_rig(&r, v->options, v->scene, v->accuracy))
        return -1.0;
    r.settings.method = lum_method_find(v->method);
    bool ok = open_views(&r, VIEWERS_SHARED, v->n) && look_all(&r, v->n) && getrusage(RUSAGE_SELF, &usage) == 0;
    close_rig(&r);
    return ok ? (double)usage.ru_maxrss : -1.0;
}

/* False after a message on stderr. */
static bool measure_memory(const struct visit *v, double *ret_kb)
{
    int ends[2];
    double kb = -1.0;
    if (pipe(ends) != 0)
        return lum_bench_failed("cannot make a pipe");
    pid_t pid = fork();
    if (pid == 0) {
        kb = visit(v);
        _exit(write(ends[1], &kb, sizeof kb) != (ssize_t)sizeof kb);
    }
    close(ends[1]);
    ssize_t n = pid > 0 ? read(ends[0], &kb, sizeof kb) : 0;
    close(ends[0]);
    if (pid > 0)
        waitpid(pid, NULL, 0);
    if (n != (ssize_t)sizeof kb || kb < 0.0)
        return lum_bench_failed("a process whose memory was to be measured failed");
    *ret_kb = kb;
    return true;
}

static bool measure_memories(const struct lum_bench_options *options, float accuracy, struct viewers_study *study,
                             size_t scene)
{
    lum_bench_progress("viewers: %s, memory", lum_bench_scene_name(study->scenes[scene]));
    for (int m = 0; m < VIEWERS_METHODS; m++) {
        struct visit v = {options, study->scenes[scene], viewers_methods[m], accuracy, 1};
        struct viewers_cell *cell = &study->cells[scene][m];
        if (!measure_memory(&v, &cell->one_kb))
            return false;
        v.n = VIEWERS;
        if (!measure_memory(&v, &cell->eight_kb))
            return false;
    }
    return true;
}

int lum_bench_viewers(const struct lum_bench_options *options)
{
    struct viewers_study *study = lum_calloc(1, sizeof *study);
    float accuracies[VIEWERS_SCENES];
    bool ok = true;
    if (!study)
        return lum_bench_failed("out of memory"), 1;
    lum_thread_init_fp();
    study->n_rounds = options->quick ? 2 : VIEWERS_ROUNDS;
    study->n_scenes = options->quick || options->scene ? 1 : VIEWERS_SCENES;
    for (size_t i = 0; i < study->n_scenes; i++) {
        study->scenes[i] = options->scene ? options->scene : scenes[i].name;
        accuracies[i] = options->scene ? LUM_CACHE_ACCURACY : scenes[i].accuracy;
    }
    for (size_t i = 0; ok && i < study->n_scenes; i++) /* all, before there is a thread */
        ok = measure_memories(options, accuracies[i], study, i);
    for (size_t i = 0; ok && i < study->n_scenes; i++)
        ok = run_scene(options, accuracies[i], study, i);
    ok = ok && viewers_report(study, options);
    lum_free(study);
    return ok ? 0 : 1;
}
