/* What selective rendering costs (thesis, chapter 4): of a 4096 x 4096 picture only the pixels at multiples of a stride
 * are rendered, stride 1 to 4096, and the time is divided by their number. Coherence is lost as the stride grows:
 * packets become incoherent, and what one pixel brought into the caches serves fewer others.
 *
 * The pixels are gathered tile by tile (16 x 16) in scan order, row by row within a tile, into batches of up to 256
 * rays, which travel 16 at a time, or one at a time for comparison. A pixel is: a ray through its centre, traversal,
 * the lookup of the surface with its texture, a shading by the cosine to the eye, and the write to the full-size float
 * picture; then the same for the ray that the surface reflects as if it were a mirror, whatever it is made of (the
 * thesis' secondary rays are specular too). Secondary rays alone are stored beforehand, and only their traversal,
 * lookup, shading and write are timed.
 *
 * The thesis runs all scenes after each other for each stride, so that a sweep finds the caches full of other scenes.
 * So do we, and a sweep is never repeated at once: rounds over everything are the outermost loop. Each sweep of few
 * pixels is therefore short, and timed alone, less what reading the clock costs; the report has the median and
 * quartiles over rounds. One thread: its CPU time, jobs run by the caller. All threads: wall clock through the
 * renderer's pool, with a batch per job, so that waking the workers counts, as it does for a frame. */
#include "tests/bench/stride.h"

#include "core/scene/surface.h"
#include "tests/bench/table.h"

/* Batches that secondary rays are stored for at a time: 9 MB, far more than L2, read in order. */
#define CHUNK 1024u

/* Rays and the pixels that they belong to. */
struct batch {
    struct lum_rays rays;
    uint32_t pixel[LUM_RAY_BATCH];
};

struct sweep {
    const struct stride_scene *scene;
    uint32_t side, stride, n_pixels;
    enum stride_part part;
    struct lum_rgb *picture;
    struct batch *stored; /* secondary alone */
    uint32_t first;       /* batch that stored[0] comes from */
    _Atomic uint64_t *bad_rays;
};

/* ---- a batch of pixels ---- */

/* The k-th pixel at multiples of the stride, in scan order of tiles. All sizes are powers of two. */
static void pixel_at(const struct sweep *sw, uint32_t k, uint32_t *ret_x, uint32_t *ret_y)
{
    uint32_t cell =
        sw->stride > LUM_TILE_SIDE ? sw->stride : LUM_TILE_SIDE; /* pixels a side that hold a tile's share */
    uint32_t per_side = cell / sw->stride, in_row = sw->side / cell;
    uint32_t c = k / (per_side * per_side), i = k % (per_side * per_side);
    *ret_x = c % in_row * cell + i % per_side * sw->stride;
    *ret_y = c / in_row * cell + i / per_side * sw->stride;
}

static void fill(const struct sweep *sw, uint32_t b, struct batch *ret_batch)
{
    uint32_t first = b * LUM_RAY_BATCH;
    uint32_t n = sw->n_pixels - first < LUM_RAY_BATCH ? sw->n_pixels - first : LUM_RAY_BATCH;
    ret_batch->rays.n = 0;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t x, y;
        pixel_at(sw, first + i, &x, &y);
        ret_batch->pixel[i] = y * sw->side + x;
        lum_rays_push(&ret_batch->rays, sw->scene->eye.o,
                      lum_eye_direction(&sw->scene->eye, (float)x + 0.5f, (float)y + 0.5f), INFINITY);
    }
}

static void trace(const struct sweep *sw, const struct lum_rays *rays, bool primary, struct lum_hits *ret_hits)
{
    struct lum_counters counters = {0};
    const struct lum_snapshot *s = sw->scene->world.snapshot;
    struct lum_trace t = primary ? lum_trace_of_eye(s, &counters) : lum_trace_of(s, &counters);
    lum_trace_closest(&t, rays, ret_hits);
    if (counters.bad_rays)
        atomic_fetch_add(sw->bad_rays, counters.bad_rays);
}

static void push_reflection(struct batch *b, uint32_t pixel, const struct lum_surface *s, struct lum_vec3 d)
{
    struct lum_vec3 r = lum_v3_mad(d, s->ns, -2.0f * lum_dot(d, s->ns));
    if (!(lum_dot(r, s->ng) > 0.0f)) /* an interpolated normal may send it below the surface */
        r = lum_v3_mad(d, s->ng, -2.0f * lum_dot(d, s->ng));
    b->pixel[b->rays.n] = pixel;
    lum_rays_push(&b->rays, lum_ray_offset(s->p, s->ng), r, INFINITY);
}

/* weight 1 sets the pixels, less adds to them. ret_reflected: NULL, or an empty batch. */
static void shade(const struct sweep *sw, const struct batch *b, const struct lum_hits *hits, float weight,
                  struct batch *ret_reflected)
{
    const struct lum_snapshot *snapshot = sw->scene->world.snapshot;
    for (uint32_t i = 0; i < b->rays.n; i++) {
        struct lum_rgb color = lum_grey(0.0f);
        if (hits->object[i] != LUM_NO_OBJECT) {
            struct lum_surface s;
            struct lum_vec3 d = lum_rays_direction(&b->rays, i);
            lum_snapshot_surface(snapshot, hits, i, d, &s);
            color = s.vertex_color;
            if (s.material != LUM_NO_OBJECT) {
                const struct lum_material *m = &snapshot->materials[s.material];
                color =
                    lum_rgb_mul(lum_rgb_mul(color, m->base_color), lum_texture_sample(&m->base_color_tex, s.uv).rgb);
            }
            color = lum_rgb_scale(color, fabsf(lum_dot(s.ns, d)) * weight);
            if (ret_reflected)
                push_reflection(ret_reflected, b->pixel[i], &s, d);
        }
        struct lum_rgb *pixel = &sw->picture[b->pixel[i]];
        *pixel = weight == 1.0f ? color : lum_rgb_add(*pixel, color);
    }
}

/* ---- jobs ---- */

#define REFLECTED 0.1f

static void render_batch(void *ctx, uint32_t job, uint32_t worker)
{
    (void)worker;
    const struct sweep *sw = ctx;
    struct batch primary, reflected;
    struct lum_hits hits;
    bool both = sw->part == STRIDE_BOTH;
    reflected.rays.n = 0;
    fill(sw, job, &primary);
    trace(sw, &primary.rays, true, &hits);
    shade(sw, &primary, &hits, 1.0f, both ? &reflected : NULL);
    if (!both)
        return;
    trace(sw, &reflected.rays, false, &hits);
    shade(sw, &reflected, &hits, REFLECTED, NULL);
}

static void store_batch(void *ctx, uint32_t job, uint32_t worker)
{
    (void)worker;
    const struct sweep *sw = ctx;
    struct batch primary;
    struct lum_hits hits;
    sw->stored[job].rays.n = 0;
    fill(sw, sw->first + job, &primary);
    trace(sw, &primary.rays, true, &hits);
    shade(sw, &primary, &hits, 1.0f, &sw->stored[job]);
}

static void render_stored(void *ctx, uint32_t job, uint32_t worker)
{
    (void)worker;
    const struct sweep *sw = ctx;
    struct lum_hits hits;
    trace(sw, &sw->stored[job].rays, false, &hits);
    shade(sw, &sw->stored[job], &hits, REFLECTED, NULL);
}

/* ---- timing ---- */

struct bench {
    struct stride_study study;
    struct lum_pool *pool; /* borrowed */
    struct lum_rgb *picture;
    struct batch *stored;
    _Atomic uint64_t bad_rays;
    double clock_ns[STRIDE_CREWS]; /* what a pair of readings costs */
};

static int64_t now(enum stride_crew crew)
{
    return crew == STRIDE_ONE ? lum_cpu_clock_ns() : lum_clock_ns();
}

static double timed(struct bench *b, lum_job_fn fn, struct sweep *sw, uint32_t n_jobs, enum stride_crew crew)
{
    int64_t begin_ns = now(crew);
    if (crew == STRIDE_ALL)
        (void)lum_pool_run(b->pool, n_jobs, fn, sw, NULL);
    else
        for (uint32_t j = 0; j < n_jobs; j++)
            fn(sw, j, 0);
    double ns = (double)(now(crew) - begin_ns) - b->clock_ns[crew];
    return fmax(ns, 1.0) * 1e-9;
}

static void measure_clocks(struct bench *b)
{
    double ns[101];
    for (int crew = 0; crew < STRIDE_CREWS; crew++) {
        for (size_t i = 0; i < LUM_ARRAY_LEN(ns); i++) {
            int64_t begin_ns = now((enum stride_crew)crew);
            ns[i] = (double)(now((enum stride_crew)crew) - begin_ns);
        }
        b->clock_ns[crew] = lum_bench_quantile(ns, LUM_ARRAY_LEN(ns), 0.5);
    }
}

static double sweep_stored(struct bench *b, struct sweep *sw, uint32_t n_batches, enum stride_crew crew,
                           uint64_t *ret_rays)
{
    double seconds = 0.0;
    *ret_rays = 0;
    for (sw->first = 0; sw->first < n_batches; sw->first += CHUNK) {
        uint32_t n = n_batches - sw->first < CHUNK ? n_batches - sw->first : CHUNK;
        (void)lum_pool_run(b->pool, n, store_batch, sw, NULL);
        for (uint32_t i = 0; i < n; i++)
            *ret_rays += sw->stored[i].rays.n;
        seconds += timed(b, render_stored, sw, n, crew);
    }
    return seconds;
}

/* One of the ways to render: part, rays, crew. */
struct way {
    enum stride_part part;
    enum stride_rays rays;
    enum stride_crew crew;
};

static void sample(struct bench *b, struct way way, uint32_t scene, uint32_t stride, uint32_t round)
{
    struct stride_study *st = &b->study;
    struct sweep sw = {
        .scene = &st->scenes[scene],
        .side = st->side,
        .stride = st->strides[stride],
        .n_pixels = stride_pixels(st, stride),
        .part = way.part,
        .picture = b->picture,
        .stored = b->stored,
        .bad_rays = &b->bad_rays,
    };
    lum_device_trace_singly(sw.scene->world.device, way.rays == STRIDE_SINGLES);
    uint32_t n_batches = (sw.n_pixels + LUM_RAY_BATCH - 1) / LUM_RAY_BATCH;
    st->seconds[scene][way.part][way.rays][way.crew][stride][round] =
        way.part == STRIDE_SECONDARY ? sweep_stored(b, &sw, n_batches, way.crew, &st->n_secondary[scene][stride])
                                     : timed(b, render_batch, &sw, n_batches, way.crew);
}

/* Every other round runs the ways backwards, so that a drift of the machine does not favour one. */
static void run_round(struct bench *b, uint32_t round)
{
    const uint32_t n_ways = STRIDE_PARTS * STRIDE_RAYS * STRIDE_CREWS;
    for (uint32_t i = 0; i < n_ways; i++) {
        uint32_t w = round % 2 ? n_ways - 1 - i : i;
        struct way way = {(enum stride_part)(w % STRIDE_PARTS), (enum stride_rays)(w / STRIDE_PARTS % STRIDE_RAYS),
                          (enum stride_crew)(w / STRIDE_PARTS / STRIDE_RAYS)};
        for (uint32_t s = 0; s < b->study.n_strides; s++)
            for (uint32_t scene = 0; round < b->study.n_samples[s] && scene < b->study.n_scenes; scene++)
                sample(b, way, scene, s, round);
    }
}

/* ---- scenes ---- */

/* After Manta's SPHERE GRID: 64 spheres and a floor, two materials, one lamp. */
static bool write_sphere_grid(const struct lum_bench_options *o, char *ret_path, size_t size)
{
    const char *name = "sphere-grid.jsonl";
    snprintf(ret_path, size, "%s/%s", o->out, name);
    FILE *f = lum_bench_open(o, name);
    if (!f)
        return false;
    fputs("{\"lumend\":1,\"kind\":\"scene\",\"title\":\"64 spheres on a floor\"}\n"
          "{\"op\":\"add\",\"type\":\"material\",\"id\":\"chalk\",\"base_color\":[0.7,0.68,0.64],\"specular\":0}\n"
          "{\"op\":\"add\",\"type\":\"material\",\"id\":\"chrome\",\"base_color\":[0.8,0.8,0.82],\"metallic\":1,"
          "\"roughness\":0}\n"
          "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"ground\",\"shape\":\"quad\",\"size\":[24,0,24]}\n"
          "{\"op\":\"add\",\"type\":\"object\",\"id\":\"floor\",\"mesh\":\"ground\",\"material\":\"chalk\"}\n"
          "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"ball\",\"shape\":\"sphere\",\"size\":[0.8,0.8,0.8],"
          "\"segments\":[64,32]}\n"
          "{\"op\":\"add\",\"type\":\"light\",\"id\":\"lamp\",\"kind\":\"point\",\"position\":[3,7,5],\"flux_lm\":"
          "20000}\n"
          "{\"op\":\"add\",\"type\":\"camera\",\"id\":\"main\",\"position\":[3.6,3.4,5.6],\"target\":[0,1.8,0],"
          "\"up\":[0,1,0],\"vfov_deg\":45}\n",
          f);
    for (int i = 0; i < 64; i++)
        fprintf(f,
                "{\"op\":\"add\",\"type\":\"object\",\"id\":\"ball-%d\",\"mesh\":\"ball\",\"material\":\"chrome\","
                "\"transform\":{\"translate\":[%g,%g,%g]}}\n",
                i, i % 4 - 1.5, i / 16 + 0.5, i / 4 % 4 - 1.5);
    return lum_bench_close(f, name);
}

static bool load(struct stride_scene *s, const char *name, const char *source, uint32_t side)
{
    struct lum_camera camera;
    struct lum_error err = {0};
    if (!lum_bench_world(source, 0, &s->world))
        return false;
    s->name = name;
    if (lum_snapshot_camera(s->world.snapshot, NULL, &camera, &err) == LUM_OK &&
        lum_eye_init(&s->eye, &camera, &s->world.snapshot->norm, side, side, &err) == LUM_OK)
        return true;
    fprintf(stderr, "lumend-bench: %s: %s\n", name, err.text);
    return false;
}

static bool load_all(struct stride_study *st, const struct lum_bench_options *o)
{
    char grid[4200];
    st->n_scenes = 1;
    if (o->scene)
        return load(&st->scenes[0], lum_bench_scene_name(o->scene), o->scene, st->side);
    st->n_scenes = STRIDE_SCENES;
    return write_sphere_grid(o, grid, sizeof grid) && load(&st->scenes[0], "sphere-grid", grid, st->side) &&
           load(&st->scenes[1], "cornell", "cornell", st->side) && load(&st->scenes[2], "office", "office", st->side) &&
           load(&st->scenes[3], "many-lights", "many-lights", st->side);
}

/* ---- the study ---- */

/* Large sweeps last seconds and vary little; small ones are short and are done more often. */
static bool plan(struct stride_study *st, const struct lum_bench_options *options)
{
    struct lum_view_settings size;
    lum_bench_size(options, (const uint32_t[]){4096, 4096}, (const uint32_t[]){256, 256}, &size);
    if (size.h & (size.h - 1))
        return lum_bench_failed("stride: the side of its picture must be a power of two");
    bool quick = options->quick;
    st->side = size.h;
    st->n_rounds = lum_bench_rounds(options, STRIDE_ROUNDS, 3);
    for (uint32_t stride = 1; stride <= st->side; stride *= quick ? 4 : 2) {
        uint32_t n = quick ? 3 : stride == 1 ? 1 : stride == 2 ? 2 : stride == 4 ? 5 : STRIDE_ROUNDS;
        st->n_samples[st->n_strides] = n < st->n_rounds ? n : st->n_rounds;
        st->strides[st->n_strides++] = stride;
    }
    return true;
}

int lum_bench_stride(const struct lum_bench_options *options)
{
    int status = 1;
    struct bench *b = lum_calloc(1, sizeof *b);
    if (!b)
        return fprintf(stderr, "lumend-bench: out of memory\n"), 1;
    struct stride_study *st = &b->study;
    lum_thread_init_fp();
    if (!plan(st, options) || !load_all(st, options))
        goto out;
    b->pool = st->scenes[0].world.pool;
    b->picture = lum_calloc((size_t)st->side * st->side, sizeof *b->picture);
    b->stored = lum_calloc(CHUNK, sizeof *b->stored);
    if (!b->picture || !b->stored) {
        fprintf(stderr, "lumend-bench: out of memory for a picture of %u x %u\n", st->side, st->side);
        goto out;
    }
    measure_clocks(b);
    for (uint32_t round = 0; round < st->n_rounds; round++) {
        lum_bench_progress("stride: round %u of %u", round + 1, st->n_rounds);
        run_round(b, round);
    }
    if (b->bad_rays)
        fprintf(stderr, "lumend-bench: %llu rays were not fit to trace\n", (unsigned long long)b->bad_rays);
    else
        status = stride_report(st, options) ? 0 : 1;
out:
    lum_free(b->stored);
    lum_free(b->picture);
    for (uint32_t i = 0; i < STRIDE_SCENES; i++)
        lum_world_finish(&st->scenes[i].world);
    lum_free(b);
    return status;
}
