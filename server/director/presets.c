/* Looks of the room's light: stored, recalled, and how they fade. A recall is one edit, which has its end at once; the
 * fade is how the picture gets there (world/fade.h), step by step as fast as frames come. */
#include "server/director/internal.h"

#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/director/read_request.h"
#include "server/world/presets.h"

#define STEP_NS 10000000ll /* between steps of a fade, at least; a slow picture makes it longer */
#define WARNINGS_MAX 16

static bool read_fade(struct lum_json_reader *r, struct lum_request *q)
{
    q->fade_s.set = lum_json_number(r, "fade_s", 0.0, LUM_LIMIT_FADE_S, &q->fade_s.value);
    lum_director_read_op_id(r, q);
    return lum_json_end(r);
}

static bool read_store(struct lum_json_reader *r, struct lum_request *q)
{
    lum_json_string(r, "name", q->name, sizeof q->name);
    return lum_json_require(r, "id") && lum_json_id(r, "id", q->id) && read_fade(r, q);
}

static bool read_recall(struct lum_json_reader *r, struct lum_request *q)
{
    return lum_json_require(r, "id") && lum_json_id(r, "id", q->id) && read_fade(r, q);
}

static bool read_stop(struct lum_json_reader *r, struct lum_request *q)
{
    lum_director_read_op_id(r, q);
    return lum_json_end(r);
}

/* ops, which pass over, become those of the request. */
static bool take_ops(struct lum_request *q, cJSON *ops, struct lum_proto_error *err)
{
    bool ok = ops ? lum_ops_from_json(ops, &q->ops, err) : lum_proto_fail_memory(err);
    cJSON_Delete(ops);
    return ok;
}

static void store(struct lum_director *d, struct lum_request *q)
{
    struct lum_proto_error err;
    struct lum_expansion none = {0};
    const struct lum_record *there = lum_document_find(d->world.doc, q->id);
    if (there && there->type != LUM_RECORD_PRESET) {
        lum_proto_fail(&err, LUM_PROTO_APPLICATION, "conflict", "id", "\"%s\" is no preset, but there", q->id);
        lum_director_refuse_edit(d, q, &err);
        return;
    }
    cJSON *ops = cJSON_CreateArray();
    if (!lum_json_add(ops, NULL, lum_preset_store_op(d->world.doc, q->id, q->name, q->fade_s))) {
        cJSON_Delete(ops);
        ops = NULL;
    }
    if (take_ops(q, ops, &err))
        lum_director_edit(d, q, &none);
    else
        lum_director_refuse_edit(d, q, &err);
}

const struct lum_request_type lum_request_preset_store = {
    .name = "preset.store", .read = read_store, .take = store, .edits = true};

/* ---- recall ---- */

static void tell(struct lum_director *d, double fade_s, double left_s)
{
    cJSON *params = cJSON_CreateObject();
    lum_json_add_string(params, "id", d->fade.preset);
    lum_json_add_number(params, "fade_s", fade_s);
    lum_json_add_number(params, "left_s", left_s);
    lum_director_send(d, LUM_OUT_BROADCAST, (struct lum_session_ref){0}, lum_rpc_notification("preset.fading", params));
}

static void begin(struct lum_director *d, const struct lum_fading *shown, size_t n_shown, const char *preset,
                  const char **ids, size_t n_ids, double fade_s)
{
    int64_t now_ns = lum_clock_ns();
    lum_fade_begin(&d->world.fade, shown, n_shown, &d->world.snapshot->lights, ids, n_ids, now_ns,
                   (int64_t)(fade_s * 1e9));
    memcpy(d->fade.preset, preset, sizeof d->fade.preset);
    d->fade.told = fade_s > 0.0 && d->world.fade.n > 0;
    tell(d, fade_s, d->fade.told ? fade_s : 0.0);
    lum_world_relight(&d->world);
    lum_director_refresh_views(d, now_ns);
}

static void warn(struct lum_expansion *to, const cJSON *left_out)
{
    size_t n = (size_t)cJSON_GetArraySize(left_out);
    n = n < WARNINGS_MAX ? n : WARNINGS_MAX;
    to->warnings = n ? lum_calloc(n, sizeof *to->warnings) : NULL;
    for (const cJSON *c = left_out ? left_out->child : NULL; c && to->warnings && to->n_warnings < n; c = c->next)
        snprintf(to->warnings[to->n_warnings++], sizeof *to->warnings, "\"%.64s\" is gone, or another kind of lamp now",
                 c->valuestring);
}

static const struct lum_record *find(struct lum_director *d, const char *id, struct lum_proto_error *err)
{
    const struct lum_record *r = lum_document_find(d->world.doc, id);
    if (r && r->type == LUM_RECORD_PRESET)
        return r;
    char near[sizeof err->text / 2] = "";
    lum_document_nearest(d->world.doc, LUM_RECORD_PRESET, id, near, sizeof near);
    lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "id", "there is no preset \"%s\"%s", id, near);
    return NULL;
}

static bool make_recall(struct lum_director *d, struct lum_request *q, struct lum_expansion *warnings,
                        struct lum_proto_error *err)
{
    const struct lum_record *preset = find(d, q->id, err);
    if (!preset)
        return false;
    cJSON *left_out = cJSON_CreateArray(), *ops = lum_preset_recall_ops(d->world.doc, &preset->preset, left_out);
    if (!q->fade_s.set)
        q->fade_s.value = preset->preset.fade_s;
    warn(warnings, left_out);
    cJSON_Delete(left_out);
    if (!ops || ops->child)
        return take_ops(q, ops, err);
    cJSON_Delete(ops);
    return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "id", "no lamp of the preset \"%s\" is there",
                          q->id);
}

static void recall(struct lum_director *d, struct lum_request *q)
{
    struct lum_proto_error err;
    struct lum_expansion warnings = {0};
    lum_director_commit(d); /* what is staged is no part of the fade */
    if (!make_recall(d, q, &warnings, &err)) {
        lum_expansion_finish(&warnings);
        lum_director_refuse_edit(d, q, &err);
        return;
    }
    lum_id preset;
    double fade_s = q->fade_s.value;
    size_t n_ids = q->ops.n;
    uint64_t rev = lum_document_rev(d->world.doc);
    lum_id *ids = lum_calloc(n_ids, sizeof *ids);
    const char **sorted = lum_calloc(n_ids, sizeof *sorted);
    const struct lum_light_table *lights = &d->world.snapshot->lights;
    size_t n_shown = lights->n_lights;
    struct lum_fading *shown = lum_fade_shown(&d->world.fade, lights);
    memcpy(preset, q->id, sizeof preset);
    for (size_t i = 0; ids && sorted && i < n_ids; i++) {
        memcpy(ids[i], q->ops.ops[i].id, sizeof *ids);
        sorted[i] = ids[i];
    }
    lum_director_edit(d, q, &warnings);
    lum_director_commit(d);
    if (ids && sorted && shown && lum_document_rev(d->world.doc) != rev)
        begin(d, shown, n_shown, preset, sorted, n_ids, fade_s);
    lum_free(shown);
    lum_free(sorted);
    lum_free(ids);
}

const struct lum_request_type lum_request_preset_recall = {
    .name = "preset.recall", .read = read_recall, .take = recall, .edits = true};

/* ---- on its way ---- */

static void stop(struct lum_director *d, struct lum_request *q)
{
    struct lum_proto_error err;
    struct lum_expansion none = {0};
    lum_director_commit(d);
    cJSON *ops = d->world.fade.n > 0 ? lum_preset_stop_ops(&d->world) : NULL;
    if (d->world.fade.n == 0)
        lum_proto_fail(&err, LUM_PROTO_APPLICATION, "not_found", "", "no lamp fades");
    else if (take_ops(q, ops, &err)) {
        lum_fade_turn(&d->world.fade, INT64_MAX);
        lum_director_edit(d, q, &none);
        return;
    } else
        lum_world_relight(&d->world);
    lum_director_refuse_edit(d, q, &err);
}

const struct lum_request_type lum_request_preset_stop = {
    .name = "preset.stop", .read = read_stop, .take = stop, .edits = true};

int64_t lum_director_turn_fade(struct lum_director *d)
{
    struct lum_fade *fade = &d->world.fade;
    int64_t now_ns = lum_clock_ns();
    if (fade->n > 0 && now_ns - fade->now_ns >= STEP_NS) {
        lum_fade_turn(fade, now_ns);
        lum_world_relight(&d->world);
        lum_director_refresh_views(d, now_ns);
    }
    if (fade->n == 0 && d->fade.told) {
        d->fade.told = false;
        tell(d, 0.0, 0.0);
    }
    return fade->n == 0 ? INT64_MAX : fade->now_ns + STEP_NS > now_ns ? fade->now_ns + STEP_NS - now_ns : 0;
}
