#include "server/director/view_frames.h"

#include <math.h>
#include <string.h>

#include "core/math/color.h"
#include "server/director/rest.h"
#include "server/stream/webp.h"

/* When a picture that only grows better is sent: each of the first samples, which the eye tells apart; then whenever
 * there are twice as many, or after this time. Oftener is traffic for noise, less often looks as if it hung. */
#define GROWING_INTERVAL_NS 250000000ll
enum { EVERY_PASS_BELOW_SPP = 8 };
/* Without room or memory for a video it is not tried again before. */
#define VIDEO_AGAIN_NS 10000000000ll
#define REST_S 1.0 /* no hand waits so long between two movements */

const char *const lum_in_view_names[] = {
    [LUM_IN_VIEW_SCENE] = "scene", [LUM_IN_VIEW_DARK] = "dark", [LUM_IN_VIEW_NOTHING] = "nothing"};

static bool is_lossy(uint8_t codec)
{
    return codec == LUM_CODEC_JPEG || codec == LUM_CODEC_WEBP || codec == LUM_CODEC_VP9;
}

static bool reads_webp(const struct lum_server_view *v)
{
    return lum_webp_available() && (v->codec == LUM_CODEC_WEBP || v->want.codecs >> LUM_CODEC_WEBP & 1u);
}

static uint64_t n_pixels(const struct lum_film *film)
{
    return (uint64_t)film->w * film->h;
}

/* Asked of the pictures that move: those at rest are none of a video's. */
static bool reads_vp9(const struct lum_server_view *v)
{
    const struct lum_film *film = lum_view_film(v->core);
    const struct lum_view_video *video = &v->video;
    bool failed = video->failed_ns > 0 && n_pixels(film) >= video->failed_pixels &&
                  lum_clock_ns() - video->failed_ns <= VIDEO_AGAIN_NS;
    return lum_vp9_available() && v->want.codecs >> LUM_CODEC_VP9 & 1u && v->want.downscale == 0 &&
           lum_video_fits(film->w, film->h) && !failed;
}

static int64_t later(int64_t a_ns, int64_t b_ns)
{
    return a_ns > b_ns ? a_ns : b_ns;
}

/* The exact picture is large: on a thin line it would keep what a hand does meanwhile waiting for seconds. So the
 * client has to have the one before it, or twice the time that the line needs for that to have gone by, and nothing to
 * have changed for a while. */
static int64_t exact_at_ns(const struct lum_server_view *v, bool *ret_heard)
{
    int64_t seen_ns, settled_ns = v->newest_ns + LUM_VIEW_SETTLE_NS;
    *ret_heard = lum_stream_is_idle(v->stream, &seen_ns);
    if (*ret_heard)
        return later(seen_ns + LUM_VIEW_SETTLE_NS, settled_ns);
    double unheard_s = fmin(2.0 * lum_stream_owed_s(v->stream), LUM_VIEW_UNHEARD_MOST_S);
    return later(v->sent_ns + later(LUM_VIEW_UNHEARD_NS, (int64_t)(unheard_s * 1e9)), settled_ns);
}

/* A picture that is complete, of a codec with loss. What a hand does is first shown as it is shown while it moves,
 * also where a pass takes longer than hands rest. */
static enum lum_frame_due exact_due(const struct lum_server_view *v, int64_t now_ns, int64_t *ret_wait_ns)
{
    bool heard;
    int64_t rest = exact_at_ns(v, &heard) - now_ns;
    bool first = v->unsent && (v->sent_spp == 0 || !heard || rest > 0);
    if (rest <= 0 && !first)
        return LUM_DUE_FINAL;
    if (ret_wait_ns)
        *ret_wait_ns = rest > 0 ? rest : LUM_VIEW_SETTLE_NS;
    return first ? LUM_DUE_FRAME : LUM_DUE_NONE;
}

enum lum_frame_due lum_server_view_due(const struct lum_server_view *v, int64_t now_ns, int64_t *ret_wait_ns)
{
    if (ret_wait_ns)
        *ret_wait_ns = INT64_MAX;
    if (v->stale || (v->last_pass.spp == 0 && v->last_pass.preview <= 1))
        return LUM_DUE_NONE; /* a picture of the former state is not sent under the new one's name */
    if (v->automatic.follows) {
        int64_t wait = v->sent_ns + LUM_EXPOSURE_STEP_NS - now_ns;
        if (ret_wait_ns)
            *ret_wait_ns = wait > 0 ? wait : LUM_EXPOSURE_STEP_NS;
        return wait > 0 && v->sent_spp > 0 ? LUM_DUE_NONE : LUM_DUE_FRAME;
    }
    if (v->complete && !v->final_sent)
        return is_lossy(v->codec) ? exact_due(v, now_ns, ret_wait_ns) : LUM_DUE_FINAL;
    if (!v->unsent)
        return LUM_DUE_NONE;
    uint32_t spp = v->last_pass.spp;
    bool due = v->sent_spp == 0 || spp < EVERY_PASS_BELOW_SPP || spp / 2 >= v->sent_spp ||
               now_ns - v->sent_ns >= GROWING_INTERVAL_NS;
    return due ? LUM_DUE_FRAME : LUM_DUE_NONE;
}

bool lum_server_view_is_awaited(const struct lum_server_view *v, int64_t now_ns)
{
    return lum_stream_wants_frame(v->stream) || now_ns - v->sent_ns < LUM_VIEW_UNREAD_NS;
}

static uint16_t error_field(const struct lum_server_view *v)
{
    double bound = v->last_pass.error.bound;
    if (!isfinite(bound))
        return 65535;
    return (uint16_t)fmin(bound * 10000.0, 65534.0);
}

/* Only between JPEG and what serves in its place: other codecs were meant as they were named. */
static struct lum_coding coding(struct lum_server_view *v, uint32_t threads, double line_bytes_s)
{
    struct lum_coding c = {v->codec, (uint8_t)v->want.quality};
    if (v->codec == LUM_CODEC_JPEG)
        c = lum_coding_choose(&v->coding, v->want.quality,
                              &(struct lum_coding_line){.bytes_s = line_bytes_s,
                                                        .threads = threads,
                                                        .webp = reads_webp(v),
                                                        .vp9 = reads_vp9(v),
                                                        .rest = v->rest.shown,
                                                        .colors = v->overlay.classes != NULL});
    if (v->codec != LUM_CODEC_JPEG || !lum_coding_is_video(&v->coding))
        lum_video_close(&v->video.of);
    return c;
}

/* Of a picture at rest WebP takes a tenth to a third fewer bytes than PNG, in about the same time. */
static void make_exact(const struct lum_server_view *v, struct lum_frame_header *h)
{
    if (is_lossy(h->codec))
        h->codec = reads_webp(v) ? LUM_CODEC_WEBP : LUM_CODEC_PNG;
    if (h->codec != LUM_CODEC_HALF_DEFLATE)
        h->flags |= LUM_FRAME_LOSSLESS;
}

static struct lum_frame_header frame_header(const struct lum_server_view *v, struct lum_coding c, bool final)
{
    struct lum_frame_header h = {.frame_seq = v->frame_seq + 1,
                                 .scene_rev = v->scene_rev,
                                 .view_id = v->id,
                                 .camera_seq = v->want.camera_seq,
                                 .codec = c.codec,
                                 .quality = c.quality,
                                 .downscale = (uint8_t)v->want.downscale,
                                 .error = error_field(v),
                                 .spp = (uint16_t)(v->last_pass.spp < 65535 ? v->last_pass.spp : 65535)};
    if (v->settings.method->progressive)
        while (1u << h.downscale < v->last_pass.preview)
            h.downscale++; /* a rough pass of paths has no more detail than that, others have that of all surfaces */
    if (final) {
        h.flags |= LUM_FRAME_CONVERGED;
        h.downscale = 0;
    }
    if (final || !is_lossy(h.codec))
        make_exact(v, &h);
    if (h.flags & LUM_FRAME_LOSSLESS)
        h.quality = 100;
    return h;
}

static uint32_t micros_since(int64_t from_ns, int64_t now_ns)
{
    int64_t us = (now_ns - from_ns) / 1000;
    return us < 0 ? 0 : us > UINT32_MAX ? UINT32_MAX : (uint32_t)us;
}

/* Fast frames are as bright as the picture that they become. In a deterministic world time changes no picture. */
static double exposure_ev(struct lum_server_view *v, const struct lum_film *film)
{
    if (v->exposure_ev.set)
        return v->exposure_ev.value;
    if (v->automatic.settled && v->settings.deterministic)
        return v->automatic.ev;
    bool fast = v->settings.method->refines && v->last_pass.spp > 0 && v->last_pass.preview <= 1;
    bool fit = v->complete || fast || v->last_pass.spp >= EVERY_PASS_BELOW_SPP;
    lum_auto_exposure_see(&v->automatic, lum_exposure_auto(film), fit, lum_clock_ns());
    return v->automatic.ev;
}

static struct lum_display display(struct lum_server_view *v, const struct lum_film *film)
{
    struct lum_display d = {.ev100 = exposure_ev(v, film), .tone = v->tone, .balanced = v->white_balance_k.set};
    if (d.balanced)
        lum_white_balance(v->white_balance_k.value, d.balance);
    return d;
}

static struct lum_overlay_want overlay_want(const struct lum_view_params *want)
{
    const struct lum_view_false_color *f = &want->false_color;
    return (struct lum_overlay_want){
        .name = want->overlay,
        .colors = {.scale = strcmp(f->scale, "linear") == 0 ? LUM_SCALE_LINEAR : LUM_SCALE_LOG,
                   .palette = strcmp(f->palette, "spectrum") == 0 ? LUM_PALETTE_SPECTRUM : LUM_PALETTE_EVEN,
                   .smooth = f->smooth,
                   .min = f->min.set ? f->min.value : (double)NAN,
                   .max = f->max.set ? f->max.value : (double)NAN},
        .fill = strcmp(f->lines, "only") != 0,
        .lines = strcmp(f->lines, "off") != 0,
    };
}

static bool is_black(const struct lum_film *film)
{
    for (uint32_t y = 0; y < film->h; y++)
        for (uint32_t x = 0; x < film->w; x++)
            if (lum_luminance(lum_film_mean(film, x, y)) > 0.0f)
                return false;
    return true;
}

static enum lum_in_view in_view(const struct lum_server_view *v, const struct lum_film *film)
{
    if (v->only_background)
        return LUM_IN_VIEW_NOTHING;
    return is_black(film) ? LUM_IN_VIEW_DARK : LUM_IN_VIEW_SCENE;
}

static void note_coding(struct lum_server_view *v, const struct lum_encoder *encoder)
{
    const struct lum_coding_cost cost = lum_encoder_cost(encoder);
    if (v->codec == LUM_CODEC_JPEG)
        lum_coding_note(&v->coding, v->want.quality, &cost);
}

/* Since the last picture; a rest between two movements tells nothing. */
static double interval_s(const struct lum_server_view *v)
{
    double s = (double)(lum_clock_ns() - v->sent_ns) * 1e-9, was = v->video.interval_s;
    return s > REST_S ? was : was > 0.0 ? 0.75 * was + 0.25 * s : s;
}

/* The next chunk, in the first tile's place. Whatever tiles the client has are painted over then. */
static enum lum_status encode_video(struct lum_server_view *v, struct lum_encoder *encoder, struct lum_picture *picture,
                                    double line_bytes_s, struct lum_encoded_tile **ret_tiles, struct lum_error *err)
{
    uint64_t skipped = lum_stream_skipped(v->stream);
    v->video.interval_s = interval_s(v);
    const struct lum_video_want want = {.n_bytes = lum_coding_video_bytes(line_bytes_s, v->video.interval_s),
                                        .key = v->video.anew || skipped != v->video.skipped};
    enum lum_status st = lum_video_run(&v->video.of, encoder, picture, &want, &ret_tiles[0], err);
    v->video.failed_ns = st ? lum_clock_ns() : 0;
    v->video.failed_pixels = n_pixels(picture->film);
    if (st)
        return st;
    v->video.anew = false;
    v->video.skipped = skipped;
    picture->header.quality = ret_tiles[0]->header.quality;
    memset(v->tiles, 0, v->n_tiles * sizeof *v->tiles);
    return LUM_OK;
}

/* ret_tiles: zeroed. Where video was chosen and cannot be, it is tiles. */
static enum lum_status encode(struct lum_server_view *v, struct lum_encoder *encoder, struct lum_picture *picture,
                              double line_bytes_s, struct lum_encoded_tile **ret_tiles, struct lum_error *err)
{
    if (picture->header.codec == LUM_CODEC_VP9) {
        if (!encode_video(v, encoder, picture, line_bytes_s, ret_tiles, err))
            return LUM_OK;
        const struct lum_coding c = coding(v, lum_encoder_threads(encoder), line_bytes_s);
        picture->header = frame_header(v, c, false);
    }
    return lum_encoder_run(encoder, picture, v->tiles, ret_tiles, err);
}

enum lum_status lum_server_view_publish(struct lum_server_view *v, const struct lum_snapshot *scene,
                                        struct lum_encoder *encoder, enum lum_frame_due due,
                                        struct lum_published *ret_published, struct lum_error *err)
{
    int64_t start = lum_clock_ns();
    const struct lum_film *film = lum_view_film(lum_rest_shown_core(v));
    const struct lum_overlay_source source = {lum_rest_shown_core(v), v->solo ? v->solo : scene,
                                              lum_rest_shown_settings(v)};
    const struct lum_overlay_want map = overlay_want(&v->want);
    enum lum_status st = lum_overlay_make(&v->overlay, &map, &source, err);
    if (st)
        return st;
    double line_bytes_s = lum_stream_line(v->stream);
    struct lum_coding c = {v->codec, (uint8_t)v->want.quality};
    if (due != LUM_DUE_FINAL)
        c = coding(v, lum_encoder_threads(encoder), line_bytes_s);
    struct lum_picture picture = {.film = film,
                                  .display = display(v, film),
                                  .overlay = &v->overlay,
                                  .header = frame_header(v, c, due == LUM_DUE_FINAL)};
    struct lum_encoded_tile **tiles = lum_calloc(v->n_tiles, sizeof(struct lum_encoded_tile *));
    if (!tiles)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a frame");
    st = encode(v, encoder, &picture, line_bytes_s, tiles, err);
    if (!st) {
        int64_t now = lum_clock_ns();
        if (due != LUM_DUE_FINAL)
            note_coding(v, encoder);
        struct lum_published p = {.line_bytes_s = (uint64_t)line_bytes_s,
                                  .coding = {picture.header.codec, picture.header.quality},
                                  .encode_ms = (double)(now - start) * 1e-6,
                                  .exposure_ev = picture.display.ev100,
                                  .server_us = micros_since(v->newest_ns, now),
                                  .in_view = in_view(v, film)};
        for (uint32_t i = 0; i < v->n_tiles; i++)
            if (tiles[i]) {
                tiles[i]->header.server_us = p.server_us;
                p.n_tiles++;
                p.n_bytes += tiles[i]->n_bytes + LUM_FRAME_HEADER_BYTES;
            }
        lum_stream_publish(v->stream, picture.header.frame_seq, tiles);
        v->frame_seq++;
        v->unsent = false;
        v->final_sent = due == LUM_DUE_FINAL && !v->automatic.follows;
        v->sent_spp = v->last_pass.spp;
        v->sent_ns = now;
        *ret_published = p;
    }
    lum_free(tiles);
    return st;
}

enum lum_status lum_server_view_read(struct lum_server_view *v, const struct lum_snapshot *scene, uint32_t x,
                                     uint32_t y, struct lum_reading *ret_reading, struct lum_error *err)
{
    bool illuminance = v->settings.illuminance;
    const struct lum_film *film = lum_view_film(lum_rest_shown_core(v));
    double scale = illuminance ? LUM_PI_D : 1.0;
    struct lum_reading r = {.unit = illuminance ? "lx" : "cd/m2", .value = (double)NAN, .error = (double)NAN};
    struct lum_aovs seen = {0};
    struct lum_error_map errors;
    enum lum_status st = LUM_OK;
    *ret_reading = r;
    if (v->stale || v->failed || v->frame_seq == 0 || x >= v->settings.w || y >= v->settings.h)
        return LUM_OK;
    x = (uint32_t)((x + 0.5) * film->w / v->settings.w);
    y = (uint32_t)((y + 0.5) * film->h / v->settings.h);
    if (illuminance)
        st = lum_view_aovs(lum_rest_shown_core(v), v->solo ? v->solo : scene, lum_rest_shown_settings(v), &seen, err);
    if (st || (illuminance && seen.instance[(size_t)y * film->w + x] == LUM_NO_OBJECT))
        return st;
    r.value = scale * (double)lum_luminance(lum_film_mean(film, x, y));
    st = lum_view_error_map(lum_rest_shown_core(v), &errors, err);
    if (st)
        return st;
    r.error = scale * (double)lum_error_map_at(&errors, errors.rms, x, y);
    lum_error_map_finish(&errors);
    *ret_reading = r;
    return LUM_OK;
}
