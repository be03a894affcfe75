#include "server/director/view.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "server/base/suggest.h"
#include "server/director/budget.h"
#include "server/director/rest.h"
#include "server/director/view_moment.h"
#include "server/stream/webp.h"
#include "server/world/apply.h"

enum { GLANCES = 16 }; /* across, and down */

/* ---- from the request and the scene to settings ---- */

struct resolved {
    struct lum_view_settings settings;
    struct lum_opt exposure_ev, white_balance_k;
    enum lum_tone_map tone;
    uint8_t codec;
};

static bool gives(const struct lum_view_params *p, enum lum_view_param param)
{
    return p->given >> param & 1u;
}

static bool resolve_camera(const struct lum_view_params *want, const struct lum_world *world,
                           struct lum_camera *ret_camera, struct lum_proto_error *err)
{
    if (gives(want, LUM_VIEW_CAMERA)) {
        *ret_camera = lum_apply_camera(&want->camera);
        return true;
    }
    return lum_world_camera(world, gives(want, LUM_VIEW_CAMERA_ID) ? want->camera_id : NULL, ret_camera, err);
}

static bool fail_method(const char *name, struct lum_proto_error *err)
{
    char near[LUM_SUGGEST_BYTES];
    lum_suggest_method(name, near);
    return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "method", "there is no method \"%s\"%s", name,
                          near);
}

/* Always fills *r with something usable; false when the request names what does not exist. */
static bool resolve(const struct lum_view_params *want, const struct lum_world *world, struct resolved *r,
                    struct lum_proto_error *err)
{
    struct lum_error e;
    const struct lum_record *render = lum_world_render(world);
    bool ok = true;
    r->settings = lum_view_settings_default();
    r->settings.reproject_shadows = !world->deterministic;
    r->settings.error_share = LUM_ERROR_SHARE;
    r->settings.measure_at_rest = true;
    if (lum_apply_settings(render, &r->settings, &e))
        ok = lum_apply_error(&e, "", err);
    if (gives(want, LUM_VIEW_SIZE)) {
        r->settings.w = (uint32_t)want->size[0];
        r->settings.h = (uint32_t)want->size[1];
    }
    if (want->method[0]) {
        const struct lum_method *m = lum_method_find(want->method);
        if (m)
            r->settings.method = m;
        else
            ok = fail_method(want->method, err);
    }
    r->settings.deterministic = world->deterministic;
    r->settings.effects_off = want->effects_off;
    r->settings.effects_on = want->effects_on;
    r->settings.illuminance = lum_overlay_is_illuminance(want->overlay);
    if (gives(want, LUM_VIEW_SPP))
        r->settings.max_spp = want->spp;
    else if (r->settings.max_spp == 0 || want->budget.error.set || want->budget.time_ms.set)
        r->settings.max_spp = LUM_LIMIT_SPP;
    r->exposure_ev = gives(want, LUM_VIEW_EXPOSURE_EV) ? want->exposure_ev : render->render.exposure_ev;
    r->white_balance_k = want->white_balance_k;
    lum_codec_find(want->codec, &r->codec); /* its row knows no other */
    if (r->codec == LUM_CODEC_WEBP && !lum_webp_available())
        ok = lum_proto_fail(err, LUM_PROTO_APPLICATION, "unsupported", "codec", "this server was built without WebP");
    r->tone = LUM_TONE_AGX;
    const char *tone = gives(want, LUM_VIEW_TONE_MAP) ? want->tone_map : render->render.tone_map;
    if (lum_apply_tone_map(tone, &r->tone, &e))
        ok = lum_apply_error(&e, "", err);
    return resolve_camera(want, world, &r->settings.camera, err) && ok;
}

/* A grid of rays, ended by the first that meets something: mostly one. */
static bool sees_only_background(const struct lum_snapshot *snapshot, const struct lum_view_settings *s)
{
    for (int i = 0; i < GLANCES * GLANCES; i++) {
        int k =
            (i * 151 + GLANCES * GLANCES / 2 + GLANCES / 2) % (GLANCES * GLANCES); /* from the middle, then scattered */
        struct lum_pick pick;
        lum_pick_at(snapshot, &s->camera, s->w, s->h, (k % GLANCES + 0.5) / GLANCES * s->w,
                    (k / GLANCES + 0.5) / GLANCES * s->h, &pick);
        if (pick.hit)
            return false;
    }
    return true;
}

/* ---- lamps alone ---- */

static bool is_named(const struct lum_view_params *want, const struct lum_light *light)
{
    for (uint32_t i = 0; i < want->n_solo; i++)
        if (strcmp(want->solo[i], light->id) == 0 || strcmp(want->solo[i], light->group) == 0)
            return true;
    return false;
}

static bool names_any(const struct lum_view_params *want, const struct lum_light_table *lights)
{
    for (uint32_t i = 0; i < lights->n_lights; i++)
        if (is_named(want, &lights->lights[i]))
            return true;
    return false;
}

/* Switched on or not. */
static void switch_alone(void *user, struct lum_light *light)
{
    light->on = is_named(user, light);
}

/* The scene as this view shows it. All of it where what was to be alone is gone, or there is no memory for less. */
static const struct lum_snapshot *lit_scene(struct lum_server_view *v, const struct lum_snapshot *scene)
{
    struct lum_error ignored;
    lum_snapshot_unref(v->solo);
    v->solo = NULL;
    if (v->moment)
        scene = v->moment;
    if (names_any(&v->want, &scene->lights) && lum_snapshot_relit(scene, switch_alone, &v->want, &v->solo, &ignored))
        v->solo = NULL;
    if (!v->solo && v->moment)
        v->solo = lum_snapshot_ref(v->moment);
    return v->solo ? v->solo : scene;
}

/* ---- what a change makes stale ---- */

void lum_server_view_refresh(struct lum_server_view *v, const struct lum_world *world, int64_t received_ns,
                             uint64_t order)
{
    const struct lum_snapshot *snapshot = lit_scene(v, lum_world_lit(world));
    struct resolved r;
    struct lum_proto_error ignored;
    resolve(&v->want, world, &r, &ignored);
    if (!lum_view_same_picture(&v->settings, &r.settings) || !lum_versions_equal(&v->versions, &snapshot->versions)) {
        v->stale = true;
        v->complete = v->failed = false;
        lum_budget_begin(&v->watch);
        v->sent_spp = 0;
    } else {
        v->complete = v->complete && r.settings.max_spp <= v->settings.max_spp;
        v->unsent = v->unsent || v->last_pass.spp > 0; /* the same film, under a new revision or exposure */
        v->scene_rev = snapshot->scene_rev;
    }
    bool same_camera = lum_camera_equal(&v->settings.camera, &r.settings.camera);
    if (!same_camera || v->versions.geometry != snapshot->versions.geometry || v->frame_seq == 0)
        v->only_background = sees_only_background(snapshot, &r.settings);
    uint32_t n_things = snapshot->n_instances + snapshot->lights.n_lights;
    if (!same_camera || v->n_things != n_things || v->exposure_ev.set)
        v->automatic = (struct lum_auto_exposure){.ev = v->automatic.ev};
    v->n_things = n_things;
    if (r.settings.method != v->settings.method)
        v->pace = (struct lum_pace){0};
    else
        lum_pace_scale(&v->pace, (double)r.settings.w * r.settings.h / ((double)v->settings.w * v->settings.h));
    v->final_sent = false;
    v->settings = r.settings;
    v->exposure_ev = r.exposure_ev;
    v->tone = r.tone;
    v->white_balance_k = r.white_balance_k;
    v->codec = r.codec;
    v->versions = snapshot->versions;
    v->newest_ns = received_ns > v->newest_ns ? received_ns : v->newest_ns;
    v->change_order = order;
}

/* ---- life ---- */

static bool fit_tiles(struct lum_server_view *v, uint32_t w, uint32_t h, struct lum_proto_error *err)
{
    uint32_t n = lum_tile_count(w, h);
    struct lum_tile_state *tiles = lum_calloc(n, sizeof *tiles);
    if (!tiles || (v->stream && !lum_stream_resize(v->stream, n))) {
        lum_free(tiles);
        return lum_proto_fail_memory(err);
    }
    lum_free(v->tiles);
    v->tiles = tiles;
    v->n_tiles = n;
    v->video.anew = true; /* a chunk may have been cut off */
    return true;
}

bool lum_server_view_create(struct lum_world *world, const struct lum_view_params *params, uint32_t id,
                            struct lum_server_view **ret_view, struct lum_proto_error *err)
{
    struct lum_view_params want = lum_view_params_default();
    lum_view_params_merge(&want, params);
    struct resolved r;
    if (!resolve(&want, world, &r, err))
        return false;
    struct lum_server_view *v = lum_calloc(1, sizeof *v);
    if (!v)
        return lum_proto_fail_memory(err);
    v->id = id;
    v->want = want;
    lum_frame_stats_begin(&v->frame, 0);
    lum_budget_begin(&v->watch);
    struct lum_error e;
    if (lum_view_create(world->pool, &v->core, &e)) {
        lum_apply_error(&e, "", err);
        goto fail;
    }
    lum_view_share(v->core, world->caches);
    v->stream = lum_stream_create(id, lum_tile_count(r.settings.w, r.settings.h));
    if (!v->stream) {
        lum_proto_fail_memory(err);
        goto fail;
    }
    struct lum_moment_change moment;
    if (!lum_moment_prepare(v, world, params, &moment, err))
        goto fail;
    lum_moment_take(v, &moment);
    if (!fit_tiles(v, r.settings.w, r.settings.h, err) || !lum_rest_reserve(v, world, err))
        goto fail;
    *ret_view = v;
    return true;
fail:
    lum_server_view_destroy(v);
    return false;
}

void lum_server_view_destroy(struct lum_server_view *v)
{
    if (!v)
        return;
    lum_stream_unref(v->stream);
    lum_view_destroy(v->core);
    lum_view_destroy(v->rest.core);
    lum_video_close(&v->video.of);
    lum_overlay_finish(&v->overlay);
    lum_snapshot_unref(v->solo);
    lum_snapshot_unref(v->moment);
    lum_free(v->tiles);
    lum_free(v);
}

const char *lum_server_view_stopped_by(const struct lum_server_view *v)
{
    return lum_budget_stop(&v->want.budget, v->settings.method, &v->last_pass, v->watch.spent_ms);
}

bool lum_server_view_update(struct lum_server_view *v, struct lum_world *world, const struct lum_view_params *params,
                            struct lum_proto_error *err)
{
    struct lum_view_params want = v->want;
    lum_view_params_merge(&want, params);
    struct resolved r;
    if (!resolve(&want, world, &r, err))
        return false;
    struct lum_moment_change moment;
    bool resized = r.settings.w != v->settings.w || r.settings.h != v->settings.h;
    if (!lum_moment_prepare(v, world, params, &moment, err))
        return false;
    if (resized && !fit_tiles(v, r.settings.w, r.settings.h, err)) {
        lum_moment_drop(&moment);
        return false;
    }
    lum_moment_take(v, &moment);
    uint32_t lost = v->want.codecs & ~want.codecs; /* some may wait in the stream */
    if (lost & (1u << LUM_CODEC_WEBP | 1u << LUM_CODEC_VP9) || r.codec != v->codec || want.quality > v->want.quality ||
        want.downscale != v->want.downscale || params->resend)
        memset(v->tiles, 0, v->n_tiles * sizeof *v->tiles);
    if (lost >> LUM_CODEC_VP9 & 1u)
        lum_video_close(&v->video.of);
    v->video.anew = v->video.anew || params->resend;
    bool rests_otherwise = memcmp(want.rest_size, v->want.rest_size, sizeof want.rest_size) != 0;
    v->want = want;
    if (rests_otherwise && !lum_rest_reserve(v, world, err))
        return false;
    if (rests_otherwise) {
        v->rest.failed = v->complete = false;
        v->stale = true;
        v->sent_spp = 0;
    }
    if (gives(params, LUM_VIEW_BUDGET) || gives(params, LUM_VIEW_SPP))
        lum_budget_change(&v->watch, &want.budget, &r.settings);
    if (gives(params, LUM_VIEW_BUDGET) && !lum_server_view_stopped_by(v))
        v->complete = false; /* a larger budget than the one that ended it */
    return true;
}

/* ---- passes ---- */

bool lum_server_view_needs_pass(const struct lum_server_view *v)
{
    return !v->failed && (v->stale || !v->complete);
}

/* An edit must show while the hand still moves: soon, or in the time that the client gave. Methods without samples show
 * a rough picture first only if asked to. */
static struct lum_pace_choice preview_for(struct lum_server_view *v)
{
    const struct lum_opt *time_ms = &v->want.budget.time_ms;
    if (!time_ms->set && !lum_method_adds_samples(v->settings.method))
        return (struct lum_pace_choice){0};
    return lum_pace_choose(&v->pace, v->settings.method, time_ms->set ? time_ms->value : LUM_PREVIEW_MS);
}

/* It tells what the next edit may take: neither a sample at rest does, nor a new sum for a lamp that was dimmed. */
static bool made_anew(const struct lum_pass_stats *pass)
{
    uint64_t rays = 0;
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        rays += k == LUM_RAY_PROBE ? 0 : pass->rays[k];
    return pass->changed && rays > 0 && (pass->preview > 1 || pass->spp == 1);
}

static void note_pace(struct lum_server_view *v, const struct lum_pass_stats *pass)
{
    const struct lum_pace_ease *ease = lum_pace_ease_of(v->settings.method);
    lum_pace_note(&v->pace, v->settings.method,
                  &(struct lum_pace_pass){.side = pass->preview,
                                          .eased = pass->preview > 1 && v->settings.preview_eased,
                                          .ms = pass->ms,
                                          .fixed_ms = lum_pace_fixed_ms(pass),
                                          .stage_ms = ease ? pass->stage_ms[ease->stage] : 0.0});
}

/* Of the picture at rest: it is shown when it has as many samples as the one that it takes the place of. The first ones
 * cost time alone. */
static bool takes_the_place(struct lum_server_view *v, const struct lum_pass_stats *pass)
{
    struct lum_proto_error ignored;
    const struct lum_view_settings *s = &v->rest.settings;
    if (pass->spp < v->last_pass.spp && !pass->complete)
        return false;
    if (!fit_tiles(v, s->w, s->h, &ignored)) {
        v->rest.failed = true;
        v->rest.on = false;
        return false;
    }
    v->rest.shown = v->unsent = true;
    v->sent_spp = 0;
    return true;
}

/* Once a picture is whole: the next change will make it rough. */
static enum lum_status prepare(struct lum_server_view *v, const struct lum_snapshot *snapshot,
                               const _Atomic bool *cancel, struct lum_pass_stats *ret_stats, struct lum_error *err)
{
    *ret_stats = (struct lum_pass_stats){0};
    if (v->stale || v->prepared || v->settings.deterministic || !lum_server_view_is_whole(v))
        return LUM_OK;
    struct lum_pace_choice next = preview_for(v);
    struct lum_view_settings settings = v->settings;
    settings.preview = next.side;
    settings.preview_eased = next.eased != NULL;
    enum lum_status status = lum_view_prepare(v->core, snapshot, &settings, cancel, ret_stats, err);
    v->prepared = status != LUM_ERR_CANCELLED; /* without, rough pictures are rougher */
    return v->prepared ? LUM_OK : status;
}

static void add_rays(struct lum_pass_stats *inout, const struct lum_pass_stats *more)
{
    inout->ms += more->ms;
    inout->cpu_ms += more->cpu_ms;
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        inout->rays[k] += more->rays[k];
}

/* From the picture at rest to one that moves, or the other way. */
static enum lum_status change_picture(struct lum_server_view *v, struct lum_error *err)
{
    struct lum_proto_error e;
    if (v->stale) {
        if (v->rest.shown && !fit_tiles(v, v->settings.w, v->settings.h, &e))
            return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for tiles");
        v->rest.on = v->rest.shown = false;
        v->chose = preview_for(v);
        v->settings.preview = v->chose.side;
        v->settings.preview_eased = v->chose.eased != NULL;
    } else if (!v->rest.on && lum_rest_may_begin(v)) {
        v->rest.on = true;
    }
    if (v->rest.on) { /* also what was changed that makes no other picture */
        v->rest.settings = v->settings;
        v->rest.settings.preview = 1;
        v->rest.settings.preview_eased = false;
        v->rest.settings.w = (uint32_t)v->want.rest_size[0];
        v->rest.settings.h = (uint32_t)v->want.rest_size[1];
    }
    return LUM_OK;
}

/* What a pass did, into what is known of the picture. */
static void note_pass(struct lum_server_view *v, const struct lum_pass_stats *pass)
{
    lum_frame_stats_add(&v->frame, pass);
    v->frame.w = lum_rest_shown_settings(v)->w;
    v->frame.h = lum_rest_shown_settings(v)->h;
    lum_budget_note(&v->watch, &v->want.budget, &v->settings, pass, v->watch.spent_ms + pass->ms);
    bool known_anew = isfinite(pass->error.bound) && !(pass->error.bound == v->last_pass.error.bound);
    v->last_pass = *pass;
    v->unsent = v->unsent || pass->changed || v->sent_spp == 0 || known_anew;
    v->complete = lum_server_view_stopped_by(v) != NULL && (v->rest.shown || !lum_rest_is_larger(v));
}

enum lum_status lum_server_view_pass(struct lum_server_view *v, const struct lum_snapshot *snapshot,
                                     const _Atomic bool *cancel, struct lum_error *err)
{
    struct lum_pass_stats pass, prepared;
    enum lum_status st = change_picture(v, err);
    if (v->solo)
        snapshot = v->solo;
    if (!st)
        st = prepare(v, snapshot, cancel, &prepared, err);
    const struct lum_view_settings *settings = v->rest.on ? &v->rest.settings : &v->settings;
    if (!st)
        st = lum_view_pass(v->rest.on ? v->rest.core : v->core, snapshot, settings, cancel, &pass, err);
    v->last_pass_ns = lum_clock_ns();
    if (st == LUM_ERR_CANCELLED)
        return st;
    if (st && v->rest.on && !v->rest.shown) { /* what is shown goes on */
        v->rest.failed = true;
        v->rest.on = false;
        return st;
    }
    v->prepared = v->prepared && !v->stale;
    v->stale = false;
    if (st) {
        v->failed = true;
        return st;
    }
    v->scene_rev = snapshot->scene_rev;
    add_rays(&pass, &prepared);
    if (!v->rest.on && made_anew(&pass))
        note_pace(v, &pass);
    if (v->rest.on && !v->rest.shown && !takes_the_place(v, &pass))
        v->watch.spent_ms += pass.ms;
    else
        note_pass(v, &pass);
    return LUM_OK;
}
