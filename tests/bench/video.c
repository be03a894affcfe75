/* What pictures of a drag cost as VP9: bytes, time of one thread, and how far they are off from what they were made of,
 * for what lines of several widths bring in the time of a picture. A ball flies while the eye turns and goes
 * (motion.h). */
#include <math.h>
#include <string.h>

#ifdef LUM_BENCH_VP9
#include <vpx/vp8dx.h>
#include <vpx/vpx_decoder.h>
#endif

#include "core/film/film.h"
#include "core/metric/metric.h"
#include "server/stream/coding.h"
#include "server/stream/vp9.h"
#include "tests/bench/motion.h"
#include "tests/bench/places.h"
#include "tests/bench/table.h"

static const struct lum_bench_column columns[] = {
    {"scene", "scene", LUM_BENCH_TEXT},
    {"method", "method", LUM_BENCH_TEXT},
    {"mbit_s", "Mbit/s", 1},
    {"key_bytes", "key, bytes", 0},
    {"bytes", "bytes", 0},
    {"most_bytes", "at most", 0},
    {"ms", "CPU, ms", 1},
    {"rms", "rms of 255", 2},
    {"smape", "SMAPE", 4},
};

#ifdef LUM_BENCH_VP9

#define METHODS "live"
enum { POSES = 30, QUICK_POSES = 4, LINES = 3 };
static const double lines_mbit_s[LINES] = {0.5, 1.0, 2.0};

/* One video of the drag. */
struct video {
    struct lum_vp9 *encoder;
    vpx_codec_ctx_t decoder;
    bool open;
    double key_bytes, bytes, most_bytes, ms, rms, smape; /* sums over pictures; bytes without the key */
};

struct rig {
    struct lum_bench_stand at;
    struct lum_bench_motion motion;
    struct lum_view *view;
    struct lum_display display;
    struct video videos[LINES];
    uint8_t *made, *got;
    float *planes[2];
};

static bool open_rig(struct rig *rig)
{
    struct lum_error err = {0};
    if (!lum_bench_stand_open(&rig->at, (const uint32_t[]){760, 520}, (const uint32_t[]){160, 96}))
        return false;
    const size_t n = (size_t)rig->at.settings.w * rig->at.settings.h;
    rig->made = lum_calloc(n, 4);
    rig->got = lum_calloc(n, 4);
    rig->planes[0] = lum_calloc(n, sizeof(float));
    rig->planes[1] = lum_calloc(n, sizeof(float));
    if (!rig->made || !rig->got || !rig->planes[0] || !rig->planes[1])
        return lum_bench_failed("out of memory");
    rig->motion = lum_bench_motion_plan(&rig->at.world, &rig->at.settings);
    return lum_bench_motion_begin(&rig->motion, &rig->at.world) &&
           (lum_view_create(rig->at.world.pool, &rig->view, &err) == LUM_OK || lum_bench_failed(err.text));
}

static void close_videos(struct rig *rig)
{
    for (int i = 0; i < LINES; i++) {
        if (rig->videos[i].open)
            vpx_codec_destroy(&rig->videos[i].decoder);
        lum_vp9_destroy(rig->videos[i].encoder);
        rig->videos[i] = (struct video){0};
    }
}

static bool open_videos(struct rig *rig)
{
    for (int i = 0; i < LINES; i++) {
        struct video *v = &rig->videos[i];
        v->encoder = lum_vp9_create(rig->at.settings.w, rig->at.settings.h, 1);
        v->open = vpx_codec_dec_init(&v->decoder, vpx_codec_vp9_dx(), NULL, 0) == VPX_CODEC_OK;
        if (!v->encoder || !v->open)
            return lum_bench_failed("no encoder or decoder");
    }
    return true;
}

static uint8_t byte_of(double v)
{
    return (uint8_t)fmin(fmax(v + 0.5, 0.0), 255.0);
}

static bool decode(struct rig *rig, struct video *v, const struct lum_vp9_frame *f)
{
    vpx_codec_iter_t at = NULL;
    const vpx_image_t *image =
        vpx_codec_decode(&v->decoder, f->bytes, (unsigned)f->n, NULL, 0) ? NULL : vpx_codec_get_frame(&v->decoder, &at);
    if (!image)
        return lum_bench_failed("a chunk cannot be decoded");
    uint8_t *out = rig->got;
    for (uint32_t y = 0; y < rig->at.settings.h; y++)
        for (uint32_t x = 0; x < rig->at.settings.w; x++, out += 4) {
            double l = image->planes[0][(size_t)y * (size_t)image->stride[0] + x];
            double cb = image->planes[1][(size_t)(y / 2) * (size_t)image->stride[1] + x / 2] - 128.0;
            double cr = image->planes[2][(size_t)(y / 2) * (size_t)image->stride[2] + x / 2] - 128.0;
            double r = l + 1.5748 * cr, b = l + 1.8556 * cb;
            out[0] = byte_of(r);
            out[1] = byte_of((l - 0.2126 * r - 0.0722 * b) / 0.7152);
            out[2] = byte_of(b);
        }
    return true;
}

static float linear(uint8_t v)
{
    float x = (float)v / 255.0f;
    return x <= 0.04045f ? x / 12.92f : powf((x + 0.055f) / 1.055f, 2.4f);
}

static void compare(struct rig *rig, struct video *v)
{
    const size_t n = (size_t)rig->at.settings.w * rig->at.settings.h;
    double squares = 0.0;
    for (size_t c = 0; c < 3; c++) {
        for (size_t i = 0; i < n; i++) {
            const uint8_t got = rig->got[4 * i + c], made = rig->made[4 * i + c];
            squares += (got - made) * (double)(got - made);
            rig->planes[0][i] = linear(got);
            rig->planes[1][i] = linear(made);
        }
        v->smape +=
            lum_metric_compare(&(struct lum_metric_input){rig->planes[0], rig->planes[1], n, LUM_METRIC_EPSILON})
                .smape /
            3.0;
    }
    v->rms += sqrt(squares / (3.0 * (double)n));
}

static bool encode(struct rig *rig, struct video *v, double mbit_s)
{
    const struct lum_view_settings *s = &rig->at.settings;
    int64_t start_ns = lum_cpu_clock_ns();
    lum_vp9_put(v->encoder, &(struct lum_vp9_part){rig->made, 0, 0, s->w, s->h});
    const struct lum_vp9_frame f = lum_vp9_encode(v->encoder, lum_coding_video_bytes(mbit_s * 125000.0, 0.0), false);
    v->ms += (double)(lum_cpu_clock_ns() - start_ns) * 1e-6;
    if (f.n == 0)
        return lum_bench_failed("a picture cannot be encoded");
    if (f.key)
        v->key_bytes += (double)f.n;
    else
        v->bytes += (double)f.n;
    if (!f.key && (double)f.n > v->most_bytes)
        v->most_bytes = (double)f.n;
    if (!decode(rig, v, &f))
        return false;
    compare(rig, v);
    return true;
}

static bool measure_pose(struct rig *rig, uint32_t pose)
{
    struct lum_view_settings *s = &rig->at.settings;
    struct lum_pass_stats stats;
    struct lum_error err = {0};
    if (!lum_bench_motion_pose(&rig->motion, pose, &rig->at.world, &s->camera))
        return false;
    if (lum_view_pass(rig->view, rig->at.world.snapshot, s, NULL, &stats, &err))
        return lum_bench_failed(err.text);
    const struct lum_film *film = lum_view_film(rig->view);
    if (pose == 0)
        rig->display = (struct lum_display){.ev100 = lum_exposure_auto(film), .tone = LUM_TONE_AGX};
    lum_film_resolve(film, 0, 0, s->w, s->h, &rig->display, rig->made, (size_t)s->w * 4);
    for (int i = 0; i < LINES; i++)
        if (!encode(rig, &rig->videos[i], lines_mbit_s[i]))
            return false;
    return true;
}

static bool measure_place(void *of, void *table)
{
    struct rig *rig = of;
    lum_bench_progress("video: %s", rig->at.place->scene);
    if (!open_rig(rig)) {
        printf("skipped: %s\n", rig->at.place->scene);
        return true;
    }
    const uint32_t n = rig->at.options->quick ? QUICK_POSES : POSES;
    for (size_t m = 0; m < rig->at.n_methods; m++) {
        rig->at.settings.method = rig->at.methods[m];
        bool ok = open_videos(rig);
        for (uint32_t pose = 0; ok && pose < n; pose++)
            ok = measure_pose(rig, pose);
        for (int i = 0; ok && i < LINES; i++) {
            const struct video *v = &rig->videos[i];
            LUM_BENCH_TEXTS(table, rig->at.place->scene, rig->at.methods[m]->name);
            LUM_BENCH_NUMBERS(table, lines_mbit_s[i], v->key_bytes, v->bytes / (n - 1), v->most_bytes, v->ms / n,
                              v->rms / n, v->smape / n);
        }
        close_videos(rig);
        if (!ok)
            return false;
    }
    return true;
}

static void close_rig(void *of)
{
    struct rig *rig = of;
    close_videos(rig);
    lum_view_destroy(rig->view);
    lum_free(rig->made);
    lum_free(rig->got);
    lum_free(rig->planes[0]);
    lum_free(rig->planes[1]);
    lum_bench_stand_close(&rig->at);
}

static bool measure(const struct lum_bench_options *options, struct lum_bench_table *table)
{
    const struct lum_bench_tour tour = {METHODS, sizeof(struct rig), measure_place, close_rig};
    return lum_bench_go(&tour, options, table);
}

#else

static bool measure(const struct lum_bench_options *options, struct lum_bench_table *table)
{
    (void)options;
    (void)table;
    printf("skipped: this build has no VP9\n");
    return true;
}

#endif

int lum_bench_video(const struct lum_bench_options *options)
{
    struct lum_bench_table table = LUM_BENCH_TABLE(columns);
    lum_thread_init_fp();
    bool ok = measure(options, &table);
    ok = lum_bench_table_finish(&table, options, "video") && ok;
    return ok ? 0 : 1;
}
