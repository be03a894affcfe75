/* The director's views: opening and closing them, whose turn it is, and sending frames. */
#include "server/director/internal.h"

#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/base/log.h"
#include "server/director/read_request.h"
#include "server/director/repeats.h"
#include "server/director/saving.h"
#include "server/director/view_frames.h"

#define SHIELD_NS 2000000000ll     /* a first pass slower than this shows a drag nothing anyway */
#define WAITED_LONG_NS 250000000ll /* a view that others keep from rendering for so long goes first */

/* ---- requests ---- */

struct lum_server_view *lum_director_view_of(struct lum_director *d, const struct lum_request *q,
                                             struct lum_proto_error *err)
{
    for (struct lum_server_view *v = d->views; v; v = v->next)
        if (v->id == q->view_id && lum_session_same(v->session, q->session))
            return v;
    if (err)
        lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "view_id", "this session has no view %u", q->view_id);
    return NULL;
}

/* NULL: refused. */
static struct lum_server_view *require_view(struct lum_director *d, const struct lum_request *q)
{
    struct lum_proto_error err;
    struct lum_server_view *v = lum_director_view_of(d, q, &err);
    if (!v)
        lum_director_refuse(d, q, &err);
    return v;
}

/* Of both its sizes. */
static uint64_t pixels_of(const struct lum_view_params *p)
{
    return (uint64_t)(p->size[0] * p->size[1] + p->rest_size[0] * p->rest_size[1]);
}

static bool has_room(const struct lum_director *d, const struct lum_request *q,
                     const struct lum_server_view *instead_of, struct lum_proto_error *err)
{
    uint64_t n = 0, own = 0, n_moments = 0, pixels;
    struct lum_view_params wanted = instead_of ? instead_of->want : q->view;
    lum_view_params_merge(&wanted, &q->view);
    pixels = pixels_of(&wanted);
    for (const struct lum_server_view *v = d->views; v; v = v->next) {
        if (v == instead_of)
            continue;
        n++;
        n_moments += v->moment != NULL;
        own += lum_session_same(v->session, q->session);
        pixels += pixels_of(&v->want);
    }
    if (own >= LUM_LIMIT_VIEWS_PER_SESSION)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "", "a session has at most %u views",
                              LUM_LIMIT_VIEWS_PER_SESSION);
    if (n >= LUM_LIMIT_VIEWS)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "", "this server has its %u views already",
                              LUM_LIMIT_VIEWS);
    if (wanted.moment.set && n_moments >= LUM_LIMIT_MOMENTS_SHOWN)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "moment",
                              "%u views show earlier moments already", LUM_LIMIT_MOMENTS_SHOWN);
    if (pixels > LUM_LIMIT_VIEWS_PIXELS)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "size",
                              "all views together have at most %u pixels", LUM_LIMIT_VIEWS_PIXELS);
    return true;
}

/* Views of moments have a room of their own. but: the one that shall show another, or NULL. */
static void count_moments(struct lum_director *d, const struct lum_server_view *but)
{
    d->world.past_bytes.shown = 0;
    for (const struct lum_server_view *v = d->views; v; v = v->next)
        d->world.past_bytes.shown += v != but ? v->moment_bytes : 0;
}

static void forget_past_unless_shown(struct lum_director *d)
{
    bool shown = false;
    for (const struct lum_server_view *v = d->views; v; v = v->next)
        shown = shown || v->moment;
    if (!shown)
        lum_world_forget_past(&d->world);
}

static bool read_view_open(struct lum_json_reader *r, struct lum_request *q)
{
    return lum_json_require(r, "size") && lum_view_params_read(r, &q->view) && lum_json_end(r);
}

static void view_open(struct lum_director *d, const struct lum_request *q)
{
    struct lum_proto_error err;
    struct lum_server_view *v;
    count_moments(d, NULL);
    if (!has_room(d, q, NULL, &err) || !lum_server_view_create(&d->world, &q->view, d->next_view_id + 1, &v, &err)) {
        forget_past_unless_shown(d);
        lum_director_refuse(d, q, &err);
        return;
    }
    v->session = q->session;
    v->next = d->views;
    d->views = v;
    d->next_view_id++;
    d->n_views++;
    pthread_mutex_lock(&d->lock);
    d->metrics.views = d->n_views;
    pthread_mutex_unlock(&d->lock);
    lum_server_view_refresh(v, &d->world, q->received_ns, ++d->order);
    lum_director_send_stream(d, q->session, lum_stream_ref(v->stream));
    cJSON *result = cJSON_CreateObject();
    lum_json_add_number(result, "view_id", v->id);
    lum_director_reply(d, q, result);
}

const struct lum_request_type lum_request_view_open = {
    .name = "view.open", .read = read_view_open, .answer = view_open};

static bool read_view_update(struct lum_json_reader *r, struct lum_request *q)
{
    return lum_request_read_view_id(r, q) && lum_view_params_read(r, &q->view) && lum_json_end(r);
}

static void view_update(struct lum_director *d, const struct lum_request *q)
{
    struct lum_proto_error err;
    struct lum_server_view *v = require_view(d, q);
    if (!v)
        return;
    count_moments(d, v);
    if ((q->view.given & (LUM_VIEW_BIT(SIZE) | LUM_VIEW_BIT(REST_SIZE) | LUM_VIEW_BIT(MOMENT)) &&
         !has_room(d, q, v, &err)) ||
        !lum_server_view_update(v, &d->world, &q->view, &err)) {
        forget_past_unless_shown(d);
        lum_director_refuse(d, q, &err);
        return;
    }
    forget_past_unless_shown(d);
    lum_server_view_refresh(v, &d->world, q->received_ns, ++d->order);
    lum_director_reply(d, q, cJSON_CreateObject());
}

const struct lum_request_type lum_request_view_update = {
    .name = "view.update", .read = read_view_update, .answer = view_update};

/* Takes the view at *at out of the list. */
static void close_view(struct lum_director *d, struct lum_server_view **at)
{
    struct lum_server_view *v = *at;
    *at = v->next;
    lum_director_send_closed(d, v->session, v->id);
    lum_server_view_destroy(v);
    d->n_views--;
    forget_past_unless_shown(d);
    pthread_mutex_lock(&d->lock);
    d->metrics.views = d->n_views;
    pthread_mutex_unlock(&d->lock);
}

static bool read_view_close(struct lum_json_reader *r, struct lum_request *q)
{
    return lum_request_read_view_id(r, q) && lum_json_end(r);
}

static void view_close(struct lum_director *d, const struct lum_request *q)
{
    struct lum_server_view *v = require_view(d, q);
    if (!v)
        return;
    struct lum_server_view **at = &d->views;
    while (*at != v)
        at = &(*at)->next;
    close_view(d, at);
    lum_director_reply(d, q, cJSON_CreateObject());
}

const struct lum_request_type lum_request_view_close = {
    .name = "view.close", .read = read_view_close, .answer = view_close};

static void session_lost(struct lum_director *d, const struct lum_request *q)
{
    for (struct lum_server_view **at = &d->views; *at;) {
        if (lum_session_same((*at)->session, q->session))
            close_view(d, at);
        else
            at = &(*at)->next;
    }
    lum_director_stop_watching(d, q->session);
    lum_director_drop_probes(d, q->session);
    lum_director_drop_scene_gets(d, q->session);
    lum_director_drop_timeline_gets(d, q->session);
    lum_director_drop_reports(d, q->session);
    lum_director_drop_assets(d, q->session);
    lum_director_drop_exports(d, q->session);
}

static void user_gone(struct lum_director *d, const struct lum_request *q)
{
    bool known = lum_repeats_forget(d, q->user);
    if (known || lum_document_next_undo(d->world.doc, q->user, false) ||
        lum_document_next_undo(d->world.doc, q->user, true))
        lum_director_note(d, LUM_ENTRY_FORGET, q->user, "", 0);
    lum_document_forget_user(d->world.doc, q->user);
}

static void session_closed(struct lum_director *d, const struct lum_request *q)
{
    session_lost(d, q);
    user_gone(d, q);
}

const struct lum_request_type lum_request_session_closed = {.answer = session_closed};
const struct lum_request_type lum_request_session_lost = {.answer = session_lost};
const struct lum_request_type lum_request_user_gone = {.answer = user_gone};

void lum_director_refresh_views(struct lum_director *d, int64_t received_ns)
{
    d->order++;
    for (struct lum_server_view *v = d->views; v; v = v->next)
        lum_server_view_refresh(v, &d->world, received_ns, d->order);
}

/* ---- frames ---- */

/* [x, y, value] of each. */
static cJSON *labels_json(const struct lum_overlay *overlay)
{
    cJSON *labels = cJSON_CreateArray();
    for (uint32_t i = 0; i < overlay->n_labels; i++) {
        const struct lum_isoline_label *l = &overlay->labels[i];
        const double label[3] = {l->x, l->y, overlay->scale.limits[l->level]};
        lum_json_add(labels, NULL, cJSON_CreateDoubleArray(label, 3));
    }
    return labels;
}

/* What the colours of a map stand for. */
static bool add_legend(cJSON *to, const struct lum_overlay *overlay)
{
    const struct lum_scale *s = &overlay->scale;
    if (!overlay->classes || !overlay->unit)
        return true;
    cJSON *o = cJSON_CreateObject(), *limits = cJSON_CreateDoubleArray(s->limits, (int)s->n_limits),
          *colors = cJSON_CreateArray();
    for (uint32_t i = 0; colors && i < s->n_colors; i++) {
        char text[8];
        const uint8_t *c = s->colors[i];
        snprintf(text, sizeof text, "#%02x%02x%02x", c[0], c[1], c[2]);
        cJSON_AddItemToArray(colors, cJSON_CreateString(text));
    }
    bool ok = lum_json_add_string(o, "unit", overlay->unit);
    ok = lum_json_add(o, "limits", limits) && ok;
    ok = lum_json_add(o, "colors", colors) && ok;
    if (overlay->false_color) {
        ok = lum_json_add_string(o, "scale", lum_scale_kind_names[s->kind]) &&
             lum_json_add_bool(o, "smooth", s->smooth) && lum_json_add_number(o, "min", s->min) &&
             lum_json_add_number(o, "max", s->max) && ok;
        ok = lum_json_add(o, "labels", labels_json(overlay)) && ok;
    }
    return lum_json_add(to, "overlay", o) && ok;
}

static bool add_choice(struct cJSON *to, const struct lum_pace_choice *c)
{
    if (c->side == 0)
        return lum_json_add(to, "budget_chose", cJSON_CreateNull());
    cJSON *o = cJSON_CreateObject();
    lum_json_add_number(o, "blocks", c->side);
    lum_json_add(o, "eased", c->eased ? cJSON_CreateString(c->eased) : cJSON_CreateNull());
    lum_json_add(o, "ms", isfinite(c->ms) ? cJSON_CreateNumber(c->ms) : cJSON_CreateNull());
    return lum_json_add(to, "budget_chose", o);
}

static void tell_stats(struct lum_director *d, struct lum_server_view *v, const struct lum_published *p, bool final)
{
    v->frame.stopped_by = v->complete ? lum_server_view_stopped_by(v) : NULL;
    v->frame.budget = lum_budget_news_of(&v->watch);
    v->frame.caustics = lum_world_caustics(&d->world, final || v->last_pass.spp > 1);
    cJSON *o = lum_frame_stats_json(&v->frame);
    bool ok = lum_json_add_number(o, "view_id", v->id) && lum_json_add_number(o, "frame_seq", (double)v->frame_seq) &&
              lum_json_add_number(o, "camera_seq", v->want.camera_seq) &&
              lum_json_add_string(o, "method", v->settings.method->name) &&
              lum_json_add_number(o, "exposure_ev", p->exposure_ev) &&
              lum_json_add_number(o, "encode_ms", p->encode_ms) &&
              lum_json_add_number(o, "server_ms", p->server_us * 1e-3) && lum_json_add_number(o, "tiles", p->n_tiles) &&
              lum_json_add_number(o, "bytes", (double)p->n_bytes) &&
              lum_json_add_string(o, "codec", lum_codec_name(p->coding.codec)) &&
              lum_json_add_number(o, "quality", p->coding.quality) &&
              lum_json_add(o, "line_bytes_s",
                           p->line_bytes_s > 0 ? cJSON_CreateNumber((double)p->line_bytes_s) : cJSON_CreateNull()) &&
              lum_json_add_bool(o, "overlay_map", v->overlay.classes != NULL) &&
              lum_json_add_string(o, "in_view", lum_in_view_names[p->in_view]) && add_choice(o, &v->chose) &&
              lum_json_add_bool(o, "converged", final) && add_legend(o, &v->overlay);
    if (!ok) {
        cJSON_Delete(o);
        return;
    }
    lum_director_send_news(d, v->session, lum_rpc_notification("frame.stats", o));
}

static void publish(struct lum_director *d, struct lum_server_view *v, enum lum_frame_due due)
{
    struct lum_published p;
    struct lum_error err;
    v->frame.sum.scene_rev = v->scene_rev;
    if (lum_server_view_publish(v, lum_world_lit(&d->world), d->encoder, due, &p, &err)) {
        lum_log(&d->config.log, LUM_LOG_ERROR, "director", "view %u: %s", v->id, err.text);
        v->failed = true; /* nothing is tried again before something changes */
        return;
    }
    pthread_mutex_lock(&d->lock);
    d->metrics.frames_published++;
    d->metrics.tiles_encoded += p.n_tiles;
    d->metrics.tile_bytes += p.n_bytes;
    pthread_mutex_unlock(&d->lock);
    if (v->want.stats)
        tell_stats(d, v, &p, due == LUM_DUE_FINAL);
    else
        d->config.wake_net(d->config.wake_user);
    lum_frame_stats_next(&v->frame, v->frame_seq);
}

static int64_t publish_if_due(struct lum_director *d, struct lum_server_view *v)
{
    int64_t wait_ns;
    enum lum_frame_due due = lum_server_view_due(v, lum_clock_ns(), &wait_ns);
    if (!v->failed && lum_stream_wants_frame(v->stream)) {
        if (due != LUM_DUE_NONE)
            publish(d, v, due);
        return wait_ns;
    }
    return INT64_MAX; /* the stream rings when it is hungry */
}

int64_t lum_director_publish_due(struct lum_director *d)
{
    int64_t wait_ns = lum_video_close_unused(lum_encoder_videos(d->encoder), lum_clock_ns());
    for (struct lum_server_view *v = d->views; v; v = v->next) {
        int64_t w = publish_if_due(d, v);
        wait_ns = w < wait_ns ? w : wait_ns;
    }
    return wait_ns;
}

/* ---- whose turn it is ---- */

struct candidate {
    struct lum_server_view *view;
    bool hungry, long_waited;
};

/* Whose stream is full comes last: nobody would see it soon. Then who was kept waiting, so that a drag in one view does
 * not stop the others; then the newest change, the fewest samples, and the longest wait. */
static bool goes_before(const struct candidate *a, const struct candidate *b)
{
    if (a->hungry != b->hungry)
        return a->hungry;
    if (a->long_waited != b->long_waited)
        return a->long_waited;
    if (!a->long_waited) {
        if (a->view->stale != b->view->stale)
            return a->view->stale;
        if (a->view->stale && a->view->change_order != b->view->change_order)
            return a->view->change_order > b->view->change_order;
        if (a->view->last_pass.spp != b->view->last_pass.spp)
            return a->view->last_pass.spp < b->view->last_pass.spp;
    }
    return a->view->last_pass_ns < b->view->last_pass_ns;
}

struct lum_server_view *lum_director_choose_view(struct lum_director *d)
{
    int64_t now = lum_clock_ns();
    struct candidate best = {0};
    for (struct lum_server_view *v = d->views; v; v = v->next) {
        if (!lum_server_view_needs_pass(v))
            continue;
        struct candidate c = {v, lum_stream_wants_frame(v->stream), now - v->last_pass_ns > WAITED_LONG_NS};
        if (!best.view || goes_before(&c, &best))
            best = c;
    }
    return best.view;
}

/* False: something in the inbox makes the pass obsolete already. The first pass after a change may not be cancelled, or
 * a drag would never show a picture. */
static bool begin_pass(struct lum_director *d, const struct lum_server_view *v)
{
    int64_t now_ns = lum_clock_ns();
    bool shielded = v->stale && lum_server_view_is_awaited(v, now_ns);
    pthread_mutex_lock(&d->lock);
    bool go = !d->stop && (v->stale || !d->inbox);
    if (go) {
        atomic_store_explicit(&d->cancel, false, memory_order_relaxed);
        d->rendering = v;
        d->shielded_until_ns = shielded ? now_ns + SHIELD_NS : 0;
    }
    pthread_mutex_unlock(&d->lock);
    return go;
}

static void end_pass(struct lum_director *d, const struct lum_pass_stats *pass)
{
    pthread_mutex_lock(&d->lock);
    d->rendering = NULL;
    if (pass) {
        d->metrics.passes++;
        d->metrics.last_pass_ms = pass->ms;
        d->metrics.nonfinite += pass->nonfinite;
        for (int i = 0; i < LUM_RAY_KIND_COUNT; i++)
            d->metrics.rays += pass->rays[i];
    }
    pthread_mutex_unlock(&d->lock);
}

void lum_director_run_pass(struct lum_director *d, struct lum_server_view *v)
{
    if (!begin_pass(d, v))
        return;
    struct lum_error err;
    v->settings.fading = d->world.fade.n > 0;
    enum lum_status st = lum_server_view_pass(v, lum_world_lit(&d->world), &d->cancel, &err);
    end_pass(d, st ? NULL : &v->last_pass);
    if (st && st != LUM_ERR_CANCELLED)
        lum_log(&d->config.log, LUM_LOG_ERROR, "director", "view %u: %s", v->id, err.text);
    if (!st)
        publish_if_due(d, v);
}
