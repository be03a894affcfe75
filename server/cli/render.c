/* lumend render: an image or a sequence, without network. */
#include "server/cli/commands.h"
#include "server/cli/help.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "core/accel/accel.h"
#include "protocol/json/json.h"
#include "server/base/write_file.h"
#include "server/cli/image_output.h"
#include "server/cli/progress.h"
#include "server/cli/render_budget.h"
#include "server/cli/render_layers.h"
#include "server/cli/render_notice.h"
#include "server/cli/render_options.h"
#include "server/cli/render_team.h"
#include "server/cli/render_tev.h"
#include "server/cli/team_scene.h"
#include "server/director/caustic_notice.h"
#include "server/farm/farm.h"
#include "server/import/expand.h"
#include "server/world/apply.h"
#include "server/world/light_groups.h"

#define EDITOR "(edits)"
#define DEFAULT_SPP 64u /* an eighth of the noise of one; more is asked for by --spp, --time or --error */

struct batch {
    struct lum_render_options options;
    struct lum_team *team; /* ranks that render with this one; NULL: there are none */
    struct lum_render_told told;
    bool quiet; /* another rank writes the files, and what there is to tell */
    struct lum_import_config import;
    struct lum_world world;
    struct lum_ops edits;
    size_t n_edits_done;
    struct lum_view *view;
    struct lum_view *meter; /* whose pictures are of illuminance; NULL: not asked for */
    struct lum_view_settings settings;
    /* of the current frame */
    struct lum_frame_stats frame_stats;
    struct lum_budget_watch watch; /* of its picture, or of its last layer */
    struct lum_rgb *beauty;
    struct lum_layer *layers; /* light groups */
    uint32_t n_layers;
    /* of the run */
    cJSON *frames; /* of the statistics; NULL: not asked for */
    struct lum_progress progress;
    double setup_ms;
    bool caustics_told;
    const char *reading; /* the file that an error is about; NULL: none */
    bool line_open;      /* on the terminal */
    bool missed;         /* a frame is not within --error */
    struct lum_render_tev tev;
};

static void log_to_stderr(void *user, int level, const char *component, const char *text)
{
    const struct batch *b = user;
    if (level > 0 && level <= 2 && !b->quiet) /* errors are told once, at the end */
        fprintf(stderr, "lumend: %s: %s\n", component, text);
}

static bool core_failed(const struct lum_error *e, struct lum_proto_error *err)
{
    return lum_apply_error(e, "", err);
}

/* ---- edits ---- */

static bool apply_transaction(struct batch *b, struct lum_ops *ops, struct lum_proto_error *err)
{
    struct lum_expansion expansion = {0};
    if (lum_ops_need_import(ops) &&
        !lum_ops_expand(&(struct lum_expand_context){.config = &b->import}, ops, &expansion, err))
        return false;
    struct lum_changes changes;
    struct lum_edit edit = {EDITOR, ops, expansion.children, expansion.n};
    bool ok = lum_world_apply(&b->world, &edit, &changes, err);
    if (ok)
        lum_changes_finish(&changes);
    lum_expansion_finish(&expansion);
    return ok;
}

/* Applies ops[from, from + n) as one transaction. */
static bool apply_edits(struct batch *b, size_t from, size_t n, struct lum_proto_error *err)
{
    struct lum_ops ops = {.ops = b->edits.ops + from, .n = n, .lines = b->edits.lines + from};
    if (apply_transaction(b, &ops, err))
        return true;
    b->reading = b->options.edits;
    lum_ops_name_line(&ops, err);
    return false;
}

/* All edits due at t_ms; those of the same instant are one transaction. */
static bool apply_edits_until(struct batch *b, double t_ms, struct lum_proto_error *err)
{
    const double *t = b->edits.t_ms;
    while (b->n_edits_done < b->edits.n && (!t || t[b->n_edits_done] <= t_ms)) {
        size_t from = b->n_edits_done, n = 1;
        while (from + n < b->edits.n && (!t || t[from + n] == t[from]))
            n++;
        if (!apply_edits(b, from, n, err))
            return false;
        b->n_edits_done += n;
    }
    struct lum_error e;
    return !lum_world_commit(&b->world, &e) || core_failed(&e, err);
}

/* ---- settings ---- */

#define PANORAMA_W 1200u
#define PANORAMA_H 600u

/* The camera, and the size that goes with it. */
static bool resolve_camera(const struct batch *b, struct lum_view_settings *s, struct lum_proto_error *err)
{
    const struct lum_render_options *o = &b->options;
    if (!lum_world_camera(&b->world, o->camera, &s->camera, err))
        return false;
    s->camera.panorama = s->camera.panorama || o->panorama;
    if (s->camera.panorama && !o->w) {
        s->w = PANORAMA_W;
        s->h = PANORAMA_H;
    }
    if (s->camera.panorama && s->w != 2 * s->h)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "invalid_value", "size",
                              "--size of a panorama must be twice as wide as high, not %ux%u", s->w, s->h);
    return true;
}

static bool resolve_settings(struct batch *b, struct lum_proto_error *err)
{
    const struct lum_render_options *o = &b->options;
    struct lum_view_settings s = lum_view_settings_default();
    struct lum_error e;
    if (lum_apply_settings(lum_world_render(&b->world), &s, &e))
        return core_failed(&e, err);
    if (o->w) {
        s.w = o->w;
        s.h = o->h;
    }
    if (o->method)
        s.method = lum_method_find(o->method);
    if (o->has_seed)
        s.seed = o->seed;
    if (o->vpls)
        s.n_vpls = o->vpls;
    if (o->has_storage)
        s.storage = o->storage;
    if (o->cache_accuracy > 0.0)
        s.cache_accuracy = (float)o->cache_accuracy;
    s.deterministic = b->world.deterministic;
    if (!o->light_groups) /* layers are of other lights: what is measured of one says nothing of the next */
        s.error_share = LUM_ERROR_SHARE;
    s.measure_at_rest = o->error > 0.0 && !lum_method_adds_samples(s.method); /* of the others samples tell */
    s.effects_off = o->effects_off;
    s.effects_on = o->effects_on;
    s.illuminance = o->overlay && lum_overlay_is_illuminance(o->overlay);
    /* render.spp says where a resting picture stops in the daemon: far more than one waits for here */
    s.max_spp = o->spp ? o->spp : o->time_s > 0.0 || o->error > 0.0 ? LUM_LIMIT_SPP : DEFAULT_SPP;
    if (!resolve_camera(b, &s, err))
        return false;
    if (!b->quiet) {
        lum_render_tell_unused(o, s.method);
        if (s.camera.panorama)
            lum_render_tell_unseen_lamps(b->world.snapshot);
    }
    b->settings = s;
    return true;
}

/* ---- a frame ---- */

static void show_progress(struct batch *b, uint32_t frame, const struct lum_pass_stats *pass)
{
    int64_t now = lum_clock_ns();
    if (b->quiet || !lum_progress_due(&b->progress, now))
        return;
    b->line_open = b->progress.tty;
    uint32_t n = b->options.n_frames ? b->options.n_frames : 1;
    fprintf(stderr, "%sframe %u of %u: %u", b->progress.tty ? "\r" : "lumend render: ", frame + 1, n, pass->spp);
    if (b->settings.max_spp < LUM_LIMIT_SPP)
        fprintf(stderr, " of %u", b->settings.max_spp);
    fprintf(stderr, " samples");
    if (isfinite(pass->error.bound))
        fprintf(stderr, ", relative error below %.4f", pass->error.bound);
    fprintf(stderr, ", %.0f s%s", (double)(now - b->progress.start_ns) * 1e-9, b->progress.tty ? "   " : "\n");
}

static enum lum_status write_exr(struct batch *b, const char *path, struct lum_error *err);

/* To tev: first with all channels, then what gets better. */
static enum lum_status show_so_far(struct batch *b, struct lum_error *err)
{
    if (b->tev.begun)
        return lum_render_tev_film(&b->tev, lum_view_film(b->view), err);
    enum lum_status st = write_exr(b, NULL, err);
    lum_free(b->beauty);
    b->beauty = NULL; /* it is not the last */
    return st;
}

/* Passes until there are enough; adds to the frame's statistics. ret_last: of the picture that they left. */
static enum lum_status render_passes(struct batch *b, uint32_t frame, const struct lum_view_budget *budget,
                                     struct lum_pass_stats *ret_last, struct lum_error *err)
{
    int64_t start = lum_clock_ns();
    bool told = b->quiet || b->options.light_groups; /* what is expected is of one layer */
    lum_budget_begin(&b->watch);
    do {
        enum lum_status st = lum_view_pass(b->view, b->world.snapshot, &b->settings, NULL, ret_last, err);
        if (st)
            return st;
        lum_frame_stats_add(&b->frame_stats, ret_last);
        double spent_ms = lum_render_spent_ms(b->team, start, ret_last);
        lum_budget_note(&b->watch, budget, &b->settings, ret_last, spent_ms);
        show_progress(b, frame, ret_last);
        if (lum_render_tev_due(&b->tev, frame, &b->options) && (st = show_so_far(b, err)))
            return st;
        lum_render_tell_expected(&b->options, frame, &b->watch, &told);
    } while (!b->watch.stopped_by);
    lum_render_compare_films(b->team, lum_view_film(b->view), "the picture");
    b->frame_stats.stopped_by = b->watch.stopped_by;
    b->frame_stats.budget = lum_budget_news_of(&b->watch);
    return LUM_OK;
}

static void drop_frame(struct batch *b)
{
    for (uint32_t i = 0; i < b->n_layers; i++)
        lum_free(b->layers[i].pixels);
    lum_free(b->layers);
    lum_free(b->beauty);
    b->layers = NULL;
    b->n_layers = 0;
    b->beauty = NULL;
}

/* Renders one group alone and adds it to the beauty. */
static enum lum_status render_layer(struct batch *b, uint32_t frame, const char *group,
                                    const struct lum_view_budget *budget, struct lum_layer_sum *inout_sum,
                                    struct lum_error *err)
{
    struct lum_pass_stats last;
    enum lum_status st = lum_light_groups_solo(&b->world, group, err);
    if (!st)
        st = render_passes(b, frame, budget, &last, err);
    if (st)
        return st;
    lum_layer_sum_add(inout_sum, lum_view_film(b->view), &last, b->watch.stopped_by, b->watch.spent_ms);
    struct lum_layer *layer = &b->layers[b->n_layers];
    layer->pixels = lum_film_pixels(lum_view_film(b->view));
    if (!layer->pixels)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the layer %s", group);
    snprintf(layer->name, sizeof layer->name, "%s", group);
    b->n_layers++;
    for (size_t i = 0; i < (size_t)b->settings.w * b->settings.h; i++)
        b->beauty[i] = lum_rgb_add(b->beauty[i], layer->pixels[i]);
    return LUM_OK;
}

/* The beauty is the sum of the layers: exactly, and with the noise of each. A layer gets its part of the time; where
 * each keeps to a relative error, so does their sum. */
static enum lum_status render_groups(struct batch *b, uint32_t frame, struct lum_error *err)
{
    struct lum_light_groups groups;
    struct lum_view_budget budget = lum_render_budget(&b->options);
    struct lum_layer_sum sum = {.spp = UINT32_MAX};
    enum lum_status st = lum_light_groups_list(&b->world, &groups, err);
    if (st)
        return st;
    b->beauty = lum_calloc((size_t)b->settings.w * b->settings.h, sizeof *b->beauty);
    b->layers = lum_calloc(groups.n, sizeof *b->layers);
    if (!b->beauty || !b->layers)
        st = lum_fail(err, LUM_ERR_NOMEM, "", "no memory for %zu layers", groups.n);
    budget.time_ms.value /= groups.n > 0 ? (double)groups.n : 1.0;
    for (size_t i = 0; i < groups.n && !st; i++)
        st = render_layer(b, frame, groups.names[i], &budget, &sum, err);
    if (groups.n == 0)
        sum = (struct lum_layer_sum){.stopped_by = "whole"};
    if (!st)
        lum_layer_sum_tell(&b->frame_stats, &sum, b->options.error);
    lum_light_groups_finish(&groups);
    return st ? st : lum_light_groups_solo(&b->world, NULL, err);
}

/* Once: what is true of the first frame that it is told of is mostly true of all. */
static void tell_caustics(struct batch *b)
{
    b->frame_stats.caustics = lum_world_caustics(&b->world, true);
    struct lum_caustic_notice notice = lum_caustic_notice(&b->frame_stats.caustics);
    if (!notice.why[0] || b->caustics_told || b->quiet)
        return;
    b->caustics_told = true;
    fprintf(stderr, "lumend render: %s. %s\n", notice.why, notice.mend);
}

/* The same of illuminance, as exact as the picture: by as many passes, or as much time. Its cost is in no statistics.
 */
static enum lum_status render_illuminance(struct batch *b, struct lum_error *err)
{
    const struct lum_view_budget budget = lum_render_budget(&b->options);
    struct lum_view_settings settings = b->settings;
    struct lum_pass_stats last;
    int64_t start = lum_clock_ns();
    settings.illuminance = true;
    do {
        enum lum_status st = lum_view_pass(b->meter, b->world.snapshot, &settings, NULL, &last, err);
        if (st)
            return st;
    } while (!lum_budget_stop(&budget, settings.method, &last, lum_render_spent_ms(b->team, start, &last)));
    lum_render_compare_films(b->team, lum_view_film(b->meter), "the picture of illuminance");
    return LUM_OK;
}

static bool render_picture(struct batch *b, uint32_t frame, struct lum_proto_error *err)
{
    struct lum_error e;
    lum_frame_stats_begin(&b->frame_stats, frame);
    b->frame_stats.w = b->settings.w;
    b->frame_stats.h = b->settings.h;
    struct lum_view_budget budget = lum_render_budget(&b->options);
    struct lum_pass_stats last;
    enum lum_status st =
        b->options.light_groups ? render_groups(b, frame, &e) : render_passes(b, frame, &budget, &last, &e);
    if (!st && b->meter)
        st = render_illuminance(b, &e);
    if (!st) {
        b->missed = (!b->quiet && lum_render_tell_missed(&b->options, frame, &b->frame_stats)) || b->missed;
        tell_caustics(b);
    }
    return !st || core_failed(&e, err);
}

/* The file's attributes, and the file. path NULL: to tev. */
static enum lum_status write_layers(struct batch *b, const char *path, struct lum_exr_output *out,
                                    struct lum_error *err)
{
    enum lum_status st;
    cJSON *json = lum_frame_stats_json(&b->frame_stats);
    char *stats = json ? lum_json_print(json, NULL) : NULL;
    cJSON_Delete(json);
    if (!b->beauty)
        b->beauty = lum_film_pixels(lum_view_film(b->view));
    if (stats && b->beauty) {
        struct lum_exr_attribute attributes[] = {{"lumend:version", LUMEND_VERSION},
                                                 {"lumend:scene", b->options.scene},
                                                 {"lumend:method", b->settings.method->name},
                                                 {"lumend:stats", stats}};
        out->beauty = b->beauty;
        out->attributes = attributes;
        out->n_attributes = LUM_ARRAY_LEN(attributes);
        st = path ? lum_write_exr(path, out, err) : lum_render_tev_put(&b->tev, out, err);
    } else {
        st = lum_fail(err, LUM_ERR_NOMEM, "", "no memory to write %s", path ? path : "to tev");
    }
    free(stats);
    return st;
}

/* path NULL: to tev. */
static enum lum_status write_exr(struct batch *b, const char *path, struct lum_error *err)
{
    struct lum_exr_output out = {.w = b->settings.w, .h = b->settings.h, .layers = b->layers, .n_layers = b->n_layers};
    struct lum_error_map errors = {0}, lux_errors = {0};
    enum lum_status st = lum_view_aovs(b->view, b->world.snapshot, &b->settings, &out.aovs, err);
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        out.guidance[e] = lum_view_guidance(b->view, (enum lum_effect)e);
    if (!st && !b->options.light_groups) { /* else what was rendered last is one group's light */
        st = lum_view_error_map(b->view, &errors, err);
        out.errors = &errors;
    }
    if (!st && b->meter) {
        st = lum_view_error_map(b->meter, &lux_errors, err);
        out.illuminance = lum_view_film(b->meter);
        out.illuminance_errors = &lux_errors;
    }
    if (!st)
        st = write_layers(b, path, &out, err);
    lum_error_map_finish(&errors);
    lum_error_map_finish(&lux_errors);
    return st;
}

/* Nothing where --overlay is not given. */
static enum lum_status make_overlay(struct batch *b, struct lum_overlay *overlay, struct lum_error *err)
{
    const struct lum_render_options *o = &b->options;
    const struct lum_overlay_want want = {o->overlay, o->false_color, !o->only_lines, o->lines};
    const struct lum_overlay_source source = {b->view, b->world.snapshot, &b->settings};
    return o->overlay ? lum_overlay_make(overlay, &want, &source, err) : LUM_OK;
}

static enum lum_status write_png(struct batch *b, const char *path, struct lum_error *err)
{
    const struct lum_render_options *o = &b->options;
    const struct lum_record_render *r = &lum_world_render(&b->world)->render;
    const struct lum_film *film = lum_view_film(b->view);
    struct lum_opt ev = o->has_exposure ? o->exposure_ev : r->exposure_ev;
    enum lum_tone_map tone = LUM_TONE_AGX;
    enum lum_status st = lum_apply_tone_map(o->tone_map ? o->tone_map : r->tone_map, &tone, err);
    struct lum_overlay overlay = {0};
    if (!st)
        st = make_overlay(b, &overlay, err);
    if (!st && o->overlay)
        lum_render_tell_legend(o->overlay, &overlay);
    const struct lum_png_output out = {.film = film,
                                       .display = {.ev100 = ev.set ? ev.value : lum_exposure_auto(film), .tone = tone},
                                       .overlay = &overlay,
                                       .legend = o->legend};
    if (!st)
        st = lum_write_png(path, &out, err);
    lum_overlay_finish(&overlay);
    return st;
}

/* Where another rank writes: what its view does for the file, this one does, too, so that both go on alike. */
static enum lum_status follow_write(struct batch *b, struct lum_error *err)
{
    struct lum_aovs unused;
    struct lum_overlay overlay = {0};
    if (b->options.exr)
        return lum_view_aovs(b->view, b->world.snapshot, &b->settings, &unused, err);
    enum lum_status st = make_overlay(b, &overlay, err);
    lum_overlay_finish(&overlay);
    return st;
}

static bool write_image(struct batch *b, uint32_t frame, struct lum_proto_error *err)
{
    char path[4096];
    struct lum_error e;
    if (!lum_render_frame_path(b->options.out, frame, path, sizeof path))
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "", "the path of --out is too long");
    enum lum_status st;
    if (b->quiet)
        st = follow_write(b, &e);
    else if (b->options.exr)
        st = write_exr(b, path, &e);
    else
        st = write_png(b, path, &e);
    if (!st && b->tev.line)
        st = write_exr(b, NULL, &e);
    return !st || core_failed(&e, err);
}

static bool render_frame(struct batch *b, uint32_t frame, struct lum_proto_error *err)
{
    double t_ms = b->options.n_frames ? frame * 1000.0 / b->options.fps : (double)INFINITY;
    bool ok = apply_edits_until(b, t_ms, err) && resolve_settings(b, err) && render_picture(b, frame, err) &&
              write_image(b, frame, err);
    uint64_t nonfinite = b->frame_stats.sum.nonfinite;
    if (ok && nonfinite > 0 && !b->quiet)
        fprintf(stderr, "lumend render: %llu values were no finite numbers, and are black: please report the scene\n",
                (unsigned long long)nonfinite);
    drop_frame(b);
    if (!ok || !b->frames)
        return ok;
    cJSON *stats = lum_frame_stats_json(&b->frame_stats);
    bool told = lum_render_add_heard(stats, b->team, &b->told);
    return (lum_json_add(b->frames, NULL, stats) && told) || lum_proto_fail_memory(err);
}

/* ---- the run ---- */

static cJSON *stats_json(struct batch *b)
{
    struct lum_run_stats run = {.scene = b->options.scene,
                                .method = b->settings.method->name,
                                .isa = lum_device_isa(b->world.device),
                                .w = b->settings.w,
                                .h = b->settings.h,
                                .threads = lum_pool_size(b->world.pool),
                                .seed = b->settings.seed,
                                .setup_ms = b->setup_ms};
    cJSON *json = lum_run_stats_json(&run), *frames = b->frames;
    b->frames = NULL;
    bool told = lum_render_add_told(json, b->team, &b->told);
    if (lum_json_add(json, "frames", frames) && told)
        return json;
    cJSON_Delete(json);
    return NULL;
}

static bool write_stats(struct batch *b, struct lum_proto_error *err)
{
    size_t n;
    cJSON *json = stats_json(b);
    char *text = json ? lum_json_print(json, &n) : NULL;
    cJSON_Delete(json);
    if (!text)
        return lum_proto_fail_memory(err);
    FILE *f = fopen(b->options.stats, "wb");
    bool ok = f && fwrite(text, 1, n, f) == n && fputc('\n', f) != EOF;
    if (f && fclose(f) != 0)
        ok = false;
    free(text);
    return ok || lum_proto_fail(err, LUM_PROTO_APPLICATION, "io", "", "cannot write %.150s: %s", b->options.stats,
                                strerror(errno));
}

static bool set_up(struct batch *b, struct lum_proto_error *err)
{
    const struct lum_render_options *o = &b->options;
    struct lum_error e;
    struct lum_log log = {log_to_stderr, b};
    if (!b->quiet && (lum_may_write_file(o->out, &e) || (o->stats && lum_may_write_file(o->stats, &e))))
        return core_failed(&e, err);
    b->import = (struct lum_import_config){.assets_dir = o->assets, .log = log};
    if (lum_world_init(&b->world, o->threads, o->isa, &log, &e))
        return core_failed(&e, err);
    b->world.deterministic = o->deterministic || b->team; /* what each rank does must not depend on who is faster */
    if (b->team && o->tev.host[0]) {
        lum_fail(&e, LUM_ERR_UNSUPPORTED, "tev", "a picture by several processes is not shown in tev while it is made");
        return core_failed(&e, err);
    }
    if (!b->quiet && lum_render_tev_begin(&b->tev, o, &e))
        return core_failed(&e, err);
    b->reading = o->scene;
    if (!lum_team_scene_load(b->team, &b->world, o->scene, &b->import, &b->told.scene_bytes, err))
        return false;
    if (b->team && !lum_render_compare_scenes(b->team, &b->world, err))
        return false;
    b->reading = o->edits;
    if (o->edits && !lum_team_edits_load(b->team, o->edits, &b->edits, &b->told.edits_bytes, err))
        return false;
    b->reading = NULL;
    if (lum_view_create(b->world.pool, &b->view, &e))
        return core_failed(&e, err);
    lum_view_share(b->view, b->world.caches);
    lum_view_join(b->view, b->team);
    if (o->illuminance && lum_view_create(b->world.pool, &b->meter, &e))
        return core_failed(&e, err);
    if (b->meter) {
        lum_view_share(b->meter, b->world.caches);
        lum_view_join(b->meter, b->team);
    }
    if (o->stats && !(b->frames = cJSON_CreateArray()))
        return lum_proto_fail_memory(err);
    b->setup_ms = (double)(lum_clock_ns() - b->progress.start_ns) * 1e-6;
    return true;
}

static bool run(struct batch *b, struct lum_proto_error *err)
{
    if (!set_up(b, err))
        return false;
    uint32_t n = b->options.n_frames ? b->options.n_frames : 1;
    for (uint32_t i = 0; i < n; i++)
        if (!render_frame(b, i, err))
            return false;
    return !b->options.stats || b->quiet || write_stats(b, err);
}

int lum_cmd_render(int argc, char **argv)
{
    struct batch b = {.progress = {.start_ns = lum_clock_ns(), .tty = isatty(STDERR_FILENO)}};
    struct lum_error usage;
    if (lum_render_options_parse(argc, argv, &b.options, &usage)) {
        fprintf(stderr, "lumend render: %s\n", usage.text);
        return LUM_EXIT_USAGE;
    }
    if (b.options.help) {
        lum_help_render(&(struct lum_help){stdout, false});
        return LUM_EXIT_OK;
    }
    struct lum_proto_error err = {0};
    bool ok = (!lum_farm_join(&b.team, &usage) || core_failed(&usage, &err));
    b.quiet = b.team && b.team->rank > 0;
    ok = ok && run(&b, &err);
    if (b.line_open)
        fputc('\n', stderr);
    if (!ok)
        fprintf(stderr, "lumend render: %s%s%s\n", b.reading ? b.reading : "", b.reading ? ": " : "", err.text);
    if (!ok && b.team)
        b.team->kind->give_up(b.team, "its part failed");
    cJSON_Delete(b.frames);
    lum_view_destroy(b.view);
    lum_view_destroy(b.meter);
    lum_ops_finish(&b.edits);
    lum_tev_close(b.tev.line);
    lum_world_finish(&b.world);
    lum_farm_leave(b.team);
    return !ok ? LUM_EXIT_FAILED : b.missed ? LUM_EXIT_MISSED : LUM_EXIT_OK;
}
