/* The director's answers about the scene: pick, surroundings, bounds, photometry, daylight, statistics. */
#include "server/director/internal.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "core/scene/scene.h"
#include "protocol/json/json.h"
#include "server/director/read_request.h"
#include "server/director/view_frames.h"
#include "server/world/daylight.h"
#include "server/world/photometry.h"

static bool add_numbers(cJSON *o, const char *key, const double *values, int n)
{
    return lum_json_add(o, key, cJSON_CreateDoubleArray(values, n));
}

bool lum_request_read_pixel(struct lum_json_reader *r, struct lum_request *q)
{
    return lum_request_read_view_id(r, q) && lum_json_require(r, "x") && lum_json_require(r, "y") &&
           lum_json_number(r, "x", 0.0, LUM_LIMIT_VIEW_SIDE, &q->x) &&
           lum_json_number(r, "y", 0.0, LUM_LIMIT_VIEW_SIDE, &q->y);
}

/* The view whose pixel the request names. NULL: there is none, and err says why. */
static struct lum_server_view *view_of_pixel(struct lum_director *d, const struct lum_request *q,
                                             struct lum_proto_error *err)
{
    struct lum_server_view *v = lum_director_view_of(d, q, err);
    if (!v)
        return NULL;
    if (!(q->x >= 0.0 && q->x < v->settings.w))
        lum_proto_fail_range(err, "x", 0.0, v->settings.w);
    else if (!(q->y >= 0.0 && q->y < v->settings.h))
        lum_proto_fail_range(err, "y", 0.0, v->settings.h);
    else
        return v;
    return NULL;
}

bool lum_director_pick(struct lum_director *d, const struct lum_request *q, struct lum_pick *ret_pick,
                       struct lum_proto_error *err)
{
    const struct lum_server_view *v = view_of_pixel(d, q, err);
    if (v)
        lum_pick_at(v->moment ? v->moment : d->world.snapshot, &v->settings.camera, v->settings.w, v->settings.h, q->x,
                    q->y, ret_pick);
    return v != NULL;
}

static bool add_point(cJSON *o, const struct lum_pick *p)
{
    const double point[3] = {p->point_world.x, p->point_world.y, p->point_world.z};
    const double normal[3] = {(double)p->normal.x, (double)p->normal.y, (double)p->normal.z};
    return add_numbers(o, "point", point, 3) && add_numbers(o, "normal", normal, 3);
}

static bool read_pick(struct lum_json_reader *r, struct lum_request *q)
{
    return lum_request_read_pixel(r, q) && lum_json_end(r);
}

static void pick(struct lum_director *d, const struct lum_request *q)
{
    struct lum_pick p;
    struct lum_proto_error err;
    if (!lum_director_pick(d, q, &p, &err)) {
        lum_director_refuse(d, q, &err);
        return;
    }
    cJSON *o = cJSON_CreateObject();
    if (p.hit) {
        lum_json_add_string(o, "id", p.id);
        add_point(o, &p);
        lum_json_add_number(o, "distance", p.distance_m);
    } else {
        lum_json_add(o, "id", cJSON_CreateNull());
    }
    lum_director_reply(d, q, o);
}

const struct lum_request_type lum_request_pick = {.name = "pick", .read = read_pick, .answer = pick};

static bool read_view(struct lum_json_reader *r, struct lum_request *q)
{
    return lum_request_read_view_id(r, q) && lum_json_end(r);
}

static void surroundings(struct lum_director *d, const struct lum_request *q)
{
    struct lum_proto_error err;
    const struct lum_server_view *v = lum_director_view_of(d, q, &err);
    if (!v) {
        lum_director_refuse(d, q, &err);
        return;
    }
    struct lum_surroundings around;
    lum_surroundings_at(v->moment ? v->moment : d->world.snapshot, &v->settings.camera, &around);
    cJSON *o = cJSON_CreateObject();
    lum_json_add_number(o, "enclosed", around.enclosed);
    lum_json_add_number(o, "reach", around.reach_m);
    lum_director_reply(d, q, o);
}

const struct lum_request_type lum_request_surroundings = {
    .name = "surroundings", .read = read_view, .answer = surroundings};

/* What the picture has at the request's pixel: no ray is traced for it. */
static void view_read(struct lum_director *d, const struct lum_request *q)
{
    struct lum_proto_error err;
    struct lum_server_view *v = view_of_pixel(d, q, &err);
    struct lum_reading reading;
    struct lum_error e;
    bool read = v && !lum_server_view_read(v, lum_world_lit(&d->world), (uint32_t)q->x, (uint32_t)q->y, &reading, &e);
    if (v && !read)
        lum_proto_fail(&err, LUM_PROTO_INTERNAL, "internal", e.field, "%s", e.text);
    if (!read) {
        lum_director_refuse(d, q, &err);
        return;
    }
    cJSON *o = cJSON_CreateObject();
    lum_json_add_string(o, "unit", reading.unit);
    lum_json_add_number(o, "value", reading.value);
    lum_json_add_number(o, "error", reading.error);
    lum_json_add_number(o, "camera_seq", v->want.camera_seq);
    lum_json_add_number(o, "scene_rev", (double)v->scene_rev);
    lum_director_reply(d, q, o);
}

const struct lum_request_type lum_request_view_read = {.name = "view.read", .read = read_pick, .answer = view_read};

static void bounds(struct lum_director *d, const struct lum_request *q)
{
    struct lum_box box;
    struct lum_proto_error err;
    if (!lum_snapshot_bounds(d->world.snapshot, q->id, &box)) {
        char near[sizeof err.text / 2] = "";
        if (!lum_document_find(d->world.doc, q->id))
            lum_document_nearest(d->world.doc, LUM_RECORD_TYPE_COUNT, q->id, near, sizeof near);
        lum_proto_fail(&err, LUM_PROTO_APPLICATION, "not_found", "id", "nothing of \"%s\" is to be seen%s", q->id,
                       near);
        lum_director_refuse(d, q, &err);
        return;
    }
    const double lo[3] = {box.lo.x, box.lo.y, box.lo.z}, hi[3] = {box.hi.x, box.hi.y, box.hi.z};
    cJSON *o = cJSON_CreateObject();
    add_numbers(o, "min", lo, 3);
    add_numbers(o, "max", hi, 3);
    lum_director_reply(d, q, o);
}

const struct lum_request_type lum_request_bounds = {.name = "bounds", .read = lum_request_read_id, .answer = bounds};

static void photometry(struct lum_director *d, const struct lum_request *q)
{
    const struct lum_record *r = lum_document_find(d->world.doc, q->id);
    struct lum_proto_error err;
    if (r && r->type == LUM_RECORD_LIGHT && r->light.web) {
        lum_director_reply(d, q, lum_photometry_describe(r->light.web, true, true));
        return;
    }
    char near[sizeof err.text / 2] = "";
    if (!r)
        lum_document_nearest(d->world.doc, LUM_RECORD_LIGHT, q->id, near, sizeof near);
    lum_proto_fail(&err, LUM_PROTO_APPLICATION, "not_found", "id", "there is no ies light \"%s\"%s", q->id, near);
    lum_director_refuse(d, q, &err);
}

const struct lum_request_type lum_request_photometry = {
    .name = "photometry", .read = lum_request_read_id, .answer = photometry};

static void daylight(struct lum_director *d, const struct lum_request *q)
{
    lum_director_reply(d, q, lum_daylight_describe(&d->world));
}

const struct lum_request_type lum_request_daylight = {
    .name = "daylight", .read = lum_request_read_nothing, .answer = daylight};

/* ---- stats.get ---- */

static cJSON *scene_json(const struct lum_director *d)
{
    cJSON *o = cJSON_CreateObject();
    for (int t = 0; t < LUM_RECORD_TYPE_COUNT; t++)
        if (t != LUM_RECORD_RENDER)
            lum_json_add_number(o, lum_record_type_names[t],
                                (double)lum_document_count(d->world.doc, (enum lum_record_type)t));
    lum_json_add_number(o, "triangles", (double)d->world.snapshot->n_triangles);
    lum_json_add_number(o, "triangles_dropped", (double)lum_scene_dropped_triangles(d->world.scene));
    lum_json_add_number(o, "texels_dropped", (double)lum_scene_dropped_texels(d->world.scene));
    lum_json_add_number(o, "emitters", (double)d->world.snapshot->lights.n_lights);
    return o;
}

static cJSON *view_json(struct lum_director *d, const struct lum_server_view *v)
{
    const double size[2] = {v->settings.w, v->settings.h};
    uint32_t shown[2];
    lum_server_view_shown_size(v, shown);
    cJSON *o = cJSON_CreateObject();
    lum_json_add_number(o, "view_id", v->id);
    add_numbers(o, "size", size, 2);
    lum_json_add_string(o, "method", v->settings.method->name);
    lum_json_add_number(o, "frame_seq", (double)v->frame_seq);
    lum_json_add_number(o, "frames_skipped", (double)lum_stream_skipped(v->stream));
    lum_json_add_bool(o, "complete", v->complete);
    struct lum_frame_stats last = {
        .frame = v->frame_seq, .w = shown[0], .h = shown[1], .n_passes = 1, .sum = v->last_pass};
    last.stopped_by = v->complete ? lum_server_view_stopped_by(v) : NULL;
    last.budget = lum_budget_news_of(&v->watch);
    last.caustics = lum_world_caustics(&d->world, v->last_pass.complete);
    lum_json_add(o, "last_pass", lum_frame_stats_json(&last));
    return o;
}

/* The effects that the method computes. */
static cJSON *served_json(const struct lum_method *method)
{
    cJSON *list = cJSON_CreateArray();
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (lum_method_serves(method, e))
            lum_json_add(list, NULL, cJSON_CreateString(lum_effect_names[e]));
    return list;
}

/* What a client may ask for as "method". */
static cJSON *methods_json(void)
{
    size_t n;
    const struct lum_method *table = lum_methods(&n);
    cJSON *list = cJSON_CreateArray();
    for (size_t i = 0; i < n; i++) {
        cJSON *m = cJSON_CreateObject();
        lum_json_add_string(m, "name", table[i].name);
        lum_json_add_string(m, "summary", table[i].summary);
        lum_json_add_bool(m, "progressive", table[i].progressive);
        lum_json_add_bool(m, "refines", table[i].refines);
        lum_json_add(m, "effects", served_json(&table[i]));
        lum_json_add(list, NULL, m);
    }
    return list;
}

/* Is what was edited on disk? null where nothing is kept. */
static cJSON *state_json(const struct lum_director *d)
{
    struct lum_journal_status s;
    if (!d->journal)
        return cJSON_CreateNull();
    lum_journal_status(d->journal, &s);
    cJSON *o = cJSON_CreateObject();
    lum_json_add_string(o, "durability", lum_durability_names[s.durability]);
    lum_json_add_number(o, "saved_rev", (double)s.saved_rev);
    lum_json_add_bool(o, "read_only", s.read_only);
    lum_json_add_string(o, "why", s.read_only ? s.why : "");
    lum_json_add_number(o, "journal_bytes", (double)s.journal_bytes);
    lum_json_add_number(o, "snapshots", (double)s.n_snapshots);
    return o;
}

static void stats_get(struct lum_director *d, const struct lum_request *q)
{
    cJSON *o = cJSON_CreateObject(), *views = cJSON_CreateArray();
    lum_json_add_string(o, "version", LUMEND_VERSION);
    lum_json_add_string(o, "embree", lum_device_version(d->world.device));
    lum_json_add_string(o, "isa", lum_device_isa(d->world.device));
    lum_json_add_number(o, "threads", lum_pool_size(d->world.pool));
    lum_json_add_number(o, "uptime_s", (double)(lum_clock_ns() - d->start_ns) * 1e-9);
    lum_json_add_number(o, "scene_rev", (double)lum_document_rev(d->world.doc));
    lum_json_add_string(o, "scene_name", d->config.scene);
    lum_json_add(o, "state", state_json(d));
    lum_json_add(o, "scene", scene_json(d));
    lum_json_add(o, "desk", lum_director_desk_json(d));
    lum_json_add(o, "methods", methods_json());
    for (const struct lum_server_view *v = d->views; v; v = v->next)
        lum_json_add(views, NULL, view_json(d, v));
    lum_json_add(o, "views", views);
    lum_director_reply(d, q, o);
}

const struct lum_request_type lum_request_stats_get = {
    .name = "stats.get", .read = lum_request_read_nothing, .answer = stats_get};
