#include "server/director/sensors.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "protocol/record/field.h"
#include "server/base/log.h"
#include "server/director/internal.h"
#include "server/director/read_request.h"
#include "server/report/power.h"
#include "server/world/sensors.h"
#include "server/world/work_plane.h"

/* 30 times a second: at 20 what a hand drags was measured beside every other picture alone, of 40 ms each. */
#define TOLD_EVERY_NS (1e9 / 30)
#define REFINED_EVERY_NS 5e8 /* of what only grows more exact */
/* Of a slice: at least so many that the time of one is known, at most so many as a second has. */
#define SAMPLES_MIN 256u
#define SAMPLES_MAX 65536u

enum stage { STAGE_NEW, STAGE_LOOKING, STAGE_GLANCING, STAGE_REFINING, STAGE_SETTLED, STAGE_FAILED };

/* A sensor of the scene. */
struct entry {
    struct entry *next;
    struct lum_record *record; /* held: it is another once the sensor is edited */
    struct lum_sensor_desc desc;
    struct lum_sensor *sensor;
    struct lum_versions versions; /* of the scene that it is measured in */
    uint64_t scene_rev;           /* of that */
    enum stage stage;
    bool seen; /* while comparing with the document */
    /* What was last known of a whole scene: shown until the next is. */
    bool known, news, fresh; /* fresh: news of another scene, and not of more paths */
    struct lum_sensor_result result;
    uint64_t result_rev;
};

struct watcher {
    struct watcher *next;
    struct lum_session_ref session;
    bool points;
};

struct lum_director_sensors {
    struct entry *entries;
    struct watcher *watchers;
    struct entry *turn;                 /* who was refined last */
    uint64_t document_rev;              /* that the entries are of */
    uint32_t n_lamps;                   /* when ns_per_place was measured: it hangs on them */
    double ns_per_place, ns_per_sample; /* measured */
    double ns_per_glance;               /* likewise, of eyes: a sample of what looks at lamps */
    int64_t told_ns;
};

/* ---- entries ---- */

static void free_entry(struct entry *e)
{
    lum_sensor_destroy(e->sensor);
    lum_record_unref(e->record);
    lum_free(e);
}

void lum_director_sensors_destroy(struct lum_director_sensors *s)
{
    if (!s)
        return;
    for (struct entry *e = s->entries, *next; e; e = next) {
        next = e->next;
        free_entry(e);
    }
    for (struct watcher *w = s->watchers, *next; w; w = next) {
        next = w->next;
        lum_free(w);
    }
    lum_free(s);
}

static struct entry *find(const struct lum_director_sensors *s, const char *id)
{
    for (struct entry *e = s->entries; e; e = e->next)
        if (strcmp(e->record->id, id) == 0)
            return e;
    return NULL;
}

static struct entry *create_entry(struct lum_director *d, const struct lum_record *r)
{
    struct lum_error err;
    struct entry *e = lum_calloc(1, sizeof *e);
    if (!e)
        return NULL;
    e->record = lum_record_ref((struct lum_record *)(uintptr_t)r);
    e->desc = lum_sensor_desc_of(r);
    if (!lum_sensor_create(&e->desc, LUM_LIMIT_SENSOR_POINTS, &e->sensor, &err))
        return e;
    lum_log(&d->config.log, LUM_LOG_ERROR, "sensors", "%s: %s", r->id, err.text);
    free_entry(e);
    return NULL;
}

/* Does the sensor still measure the same? Its name, its targets and the room's floor may differ. */
static bool same_place(const struct lum_record *a, const struct lum_record *b)
{
    const struct lum_fields *t = lum_fields_of(LUM_RECORD_SENSOR);
    for (size_t i = 0; i < t->n; i++)
        if (strncmp(t->fields[i].name, "target_", 7) != 0 && strcmp(t->fields[i].name, "name") != 0 &&
            strcmp(t->fields[i].name, "floor_m2") != 0 &&
            !lum_field_equal(&t->fields[i], lum_record_body(a), lum_record_body(b)))
            return false;
    return true;
}

static void take_record(void *user, const struct lum_record *r)
{
    struct lum_director *d = user;
    struct lum_director_sensors *s = d->sensors;
    if (r->type != LUM_RECORD_SENSOR)
        return;
    struct entry *e = find(s, r->id), **end = &s->entries;
    if (e && e->record != r && same_place(e->record, r)) {
        lum_record_unref(e->record);
        e->record = lum_record_ref((struct lum_record *)(uintptr_t)r);
        e->desc = lum_sensor_desc_of(r);
        e->news = e->known;
    }
    if (e && e->record == r) {
        e->seen = true;
        return;
    }
    e = create_entry(d, r); /* one of the same id goes, unseen */
    if (!e)
        return;
    e->seen = true;
    while (*end)
        end = &(*end)->next;
    *end = e;
}

/* The entries become those of the document. */
static void follow_document(struct lum_director *d)
{
    struct lum_director_sensors *s = d->sensors;
    uint64_t rev = lum_document_rev(d->world.doc);
    if (s->document_rev == rev)
        return;
    for (struct entry *e = s->entries; e; e = e->next)
        e->seen = false;
    if (!lum_document_each(d->world.doc, take_record, d))
        return; /* memory is short: next time */
    s->document_rev = rev;
    for (struct entry **at = &s->entries, *e; (e = *at);) {
        if (e->seen) {
            at = &e->next;
            continue;
        }
        *at = e->next;
        s->turn = s->turn == e ? NULL : s->turn;
        free_entry(e);
    }
}

/* ---- what is told ---- */

static double rounded(double v, double digits)
{
    double scale = v != 0.0 ? pow(10.0, digits - 1.0 - floor(log10(fabs(v)))) : 1.0;
    return round(v * scale) / scale;
}

static bool add_values(cJSON *o, const struct entry *e)
{
    uint32_t nu, nv;
    lum_sensor_size(e->sensor, &nu, &nv);
    bool eyes = lum_sensor_has_eyes(&e->desc);
    cJSON *values = cJSON_CreateArray();
    bool ok = values != NULL;
    for (uint32_t i = 0; ok && i < nu * nv; i++) {
        struct lum_meter_reading r = lum_sensor_reading(e->sensor, i);
        bool is = r.clearance == LUM_CLEARANCE_FREE && r.stderr_lx >= 0.0;
        double value = !is ? (double)NAN : eyes ? lum_sensor_gaze(e->sensor, i).ugr.ugr : r.lx;
        ok = lum_json_add(values, NULL, isfinite(value) ? cJSON_CreateNumber(rounded(value, 4)) : cJSON_CreateNull());
    }
    return lum_json_add(o, eyes ? "point_ugr" : "lx", values) && ok;
}

/* Over whose floor power is told: the largest work plane's. */
static const struct entry *room_of(const struct lum_director_sensors *s)
{
    const struct entry *room = NULL;
    double most = 0.0;
    for (const struct entry *e = s ? s->entries : NULL; e; e = e->next) {
        double floor_m2 = lum_power_floor(&e->desc);
        if (!(floor_m2 > most))
            continue;
        most = floor_m2;
        room = e;
    }
    return room;
}

static bool add_power(const struct lum_director *d, cJSON *o, const struct entry *e)
{
    struct lum_load load;
    if (e != room_of(d->sensors))
        return true;
    lum_load_of(&d->world, &load);
    struct lum_power power = lum_power_of(&load, &e->desc, &e->result);
    return lum_power_add(o, &power);
}

static cJSON *entry_json(const struct lum_director *d, const struct entry *e)
{
    struct lum_sensor_targets targets = lum_sensor_targets_of(e->record);
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_string(o, "id", e->record->id) &&
              lum_json_add_number(o, "scene_rev", (double)e->result_rev) &&
              lum_json_add_bool(o, "settled", e->stage == STAGE_SETTLED && e->result_rev == e->scene_rev) &&
              lum_sensor_add_result(o, &e->desc, e->sensor, &e->result, &targets) && add_power(d, o, e);
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

static void tell(struct lum_director *d, int64_t now)
{
    struct lum_director_sensors *s = d->sensors;
    for (const struct watcher *w = s->watchers; w; w = w->next) {
        cJSON *o = cJSON_CreateObject(), *list = cJSON_CreateArray();
        bool ok = list != NULL;
        for (struct entry *e = s->entries; e; e = e->next) {
            cJSON *one = e->news && e->known ? entry_json(d, e) : NULL;
            if (one && w->points && e->desc.kind != LUM_SENSOR_OBSERVER)
                ok = add_values(one, e) && ok;
            if (one)
                ok = lum_json_add(list, NULL, one) && ok;
        }
        ok = lum_json_add(o, "sensors", list) && ok;
        if (ok)
            lum_director_send_news(d, w->session, lum_rpc_notification("sensors", o));
        else
            cJSON_Delete(o);
    }
    for (struct entry *e = s->entries; e; e = e->next)
        e->news = e->fresh = false;
    s->told_ns = now;
}

void lum_director_tell_sensors(struct lum_director *d)
{
    struct lum_director_sensors *s = d->sensors;
    if (!s || !s->watchers)
        return;
    int64_t now = lum_clock_ns();
    bool news = false, fresh = false, working = false;
    for (const struct entry *e = s->entries; e; e = e->next) {
        news = news || (e->news && e->known);
        fresh = fresh || e->fresh;
        working = working || (e->stage != STAGE_SETTLED && e->stage != STAGE_FAILED);
    }
    double since = (double)(now - s->told_ns);
    if (news && (!working || since >= (fresh ? TOLD_EVERY_NS : REFINED_EVERY_NS)))
        tell(d, now);
}

struct lum_sensor *lum_director_copy_sensor(const struct lum_director *d, const struct lum_record *r)
{
    const struct entry *e = d->sensors ? find(d->sensors, r->id) : NULL;
    struct lum_sensor *copy;
    struct lum_error none;
    bool holds = e && e->record == r && (e->stage == STAGE_REFINING || e->stage == STAGE_SETTLED) &&
                 lum_versions_equal(&e->versions, &lum_world_lit(&d->world)->versions);
    return holds && !lum_sensor_copy(e->sensor, &copy, &none) ? copy : NULL;
}

/* ---- slices ---- */

/* Unless there are so many lamps that no point has had a glance: then paths come first. */
static void keep_result(struct entry *e)
{
    struct lum_sensor_result now;
    (void)lum_sensor_result(e->sensor, &now);
    if (now.n_known == 0 && now.n_covered + now.n_inside < now.n)
        return;
    e->fresh = e->fresh || !e->known || e->result_rev != e->scene_rev;
    e->known = e->news = true;
    e->result_rev = e->scene_rev;
    e->result = now;
}

/* The same light: what was measured holds. */
static void take_revision(struct entry *e, uint64_t rev)
{
    if (e->result_rev == e->scene_rev && e->scene_rev != rev) {
        e->result_rev = rev;
        e->news = e->fresh = e->known;
    }
    e->scene_rev = rev;
}

/* Nothing of the scene that there is now is known of all points. */
static bool is_awaited(const struct entry *e)
{
    return e->stage == STAGE_LOOKING || e->stage == STAGE_GLANCING;
}

/* A scene in which other light arrives is measured anew; not before the glance that runs is whole, nor, where passes
 * wait for their time, before its values could be told. */
static void aim(struct lum_director *d, struct entry *e, bool may_begin)
{
    const struct lum_snapshot *now = lum_world_lit(&d->world);
    if (is_awaited(e))
        return;
    if (e->stage != STAGE_NEW && lum_versions_equal(&e->versions, &now->versions)) {
        take_revision(e, now->scene_rev);
        return;
    }
    e->stage = STAGE_NEW;
    if (!may_begin)
        return;
    lum_sensor_aim(e->sensor, now);
    e->versions = now->versions;
    e->scene_rev = now->scene_rev;
    e->stage = STAGE_LOOKING;
}

static void fail(struct lum_director *d, struct entry *e, const struct lum_error *err)
{
    lum_log(&d->config.log, LUM_LOG_ERROR, "sensors", "%s: %s", e->record->id, err->text);
    e->stage = STAGE_FAILED; /* until something changes */
}

/* At least so many that the time of one is known. */
static uint32_t samples_of(double slice_ns, double ns_per_sample)
{
    double fit = ns_per_sample > 0.0 ? slice_ns / ns_per_sample : 0.0;
    return (uint32_t)fmax(SAMPLES_MIN, fmin(fit, SAMPLES_MAX));
}

static void look(struct lum_director *d, struct entry *e, double slice_ns)
{
    struct lum_director_sensors *s = d->sensors;
    uint32_t n_lamps = lum_world_lit(&d->world)->lights.n_active;
    if (s->n_lamps != n_lamps)
        s->ns_per_place = 0.0; /* with too many there is no glance, and a place takes next to nothing */
    s->n_lamps = n_lamps;
    uint32_t n = s->ns_per_place > 0.0 ? (uint32_t)fmin(slice_ns / s->ns_per_place, LUM_LIMIT_SENSOR_POINTS) : 4;
    n = n > 0 ? n : 1;
    int64_t from = lum_clock_ns();
    bool more = lum_sensor_look(e->sensor, d->world.pool, n, true);
    if (more || s->ns_per_place == 0.0) /* the last slice of a glance has fewer places than n */
        s->ns_per_place = (double)(lum_clock_ns() - from) / n;
    if (more)
        return;
    e->stage = lum_sensor_has_eyes(&e->desc) ? STAGE_GLANCING : STAGE_REFINING;
    if (e->stage == STAGE_REFINING)
        keep_result(e);
}

static void glance_at_lamps(struct lum_director *d, struct entry *e, double slice_ns)
{
    struct lum_director_sensors *s = d->sensors;
    uint64_t before = lum_sensor_samples(e->sensor);
    int64_t from = lum_clock_ns();
    bool more = lum_sensor_glance_at_lamps(e->sensor, d->world.pool, samples_of(slice_ns, s->ns_per_glance));
    uint64_t done = lum_sensor_samples(e->sensor) - before;
    if (done >= SAMPLES_MIN)
        s->ns_per_glance = (double)(lum_clock_ns() - from) / (double)done;
    if (more)
        return;
    e->stage = STAGE_REFINING;
    keep_result(e);
}

static void refine(struct lum_director *d, struct entry *e, double slice_ns)
{
    struct lum_director_sensors *s = d->sensors;
    const struct lum_meter_goal goal = {LUM_SENSOR_ERROR, LUM_SENSOR_DARK, LUM_SENSOR_SAMPLES_MAX};
    struct lum_error err;
    bool more = false;
    uint32_t n = samples_of(slice_ns, s->ns_per_sample);
    uint64_t before = lum_sensor_samples(e->sensor);
    int64_t from = lum_clock_ns();
    if (lum_sensor_refine(e->sensor, d->world.pool, &goal, n, &more, &err)) {
        fail(d, e, &err);
        return;
    }
    uint64_t done = lum_sensor_samples(e->sensor) - before;
    if (done >= SAMPLES_MIN)
        s->ns_per_sample = (double)(lum_clock_ns() - from) / (double)done;
    if (!more)
        e->stage = STAGE_SETTLED;
    keep_result(e);
}

/* Who is next: of those that are looked at, who has waited longest, so that none waits for ever while edits go on. Then
 * all in turn. */
static struct entry *choose(struct lum_director_sensors *s)
{
    struct entry *oldest = NULL, *first = NULL, *after = NULL;
    bool past = false;
    for (struct entry *e = s->entries; e; e = e->next) {
        if (is_awaited(e) && (!oldest || e->scene_rev < oldest->scene_rev))
            oldest = e;
        if (e->stage == STAGE_REFINING) {
            first = first ? first : e;
            after = !after && past ? e : after;
        }
        past = past || e == s->turn;
    }
    return oldest ? oldest : after ? after : first;
}

enum lum_need lum_director_sensors_need(struct lum_director *d, bool busy)
{
    struct lum_director_sensors *s = d->sensors;
    if (!s || !s->watchers)
        return LUM_NEED_NOTHING;
    follow_document(d);
    bool may_begin = !busy || (double)(lum_clock_ns() - s->told_ns) >= TOLD_EVERY_NS;
    for (struct entry *e = s->entries; e; e = e->next)
        aim(d, e, may_begin);
    const struct entry *e = choose(s);
    return !e ? LUM_NEED_NOTHING : is_awaited(e) ? LUM_NEED_AWAITED : LUM_NEED_REFINES;
}

void lum_director_measure(struct lum_director *d, double slice_ns)
{
    struct entry *e = d->sensors->turn = choose(d->sensors);
    if (e->stage == STAGE_LOOKING)
        look(d, e, slice_ns);
    else if (e->stage == STAGE_GLANCING)
        glance_at_lamps(d, e, slice_ns);
    else
        refine(d, e, slice_ns);
}

/* ---- requests ---- */

void lum_director_stop_watching(struct lum_director *d, struct lum_session_ref session)
{
    if (!d->sensors)
        return;
    for (struct watcher **at = &d->sensors->watchers, *w; (w = *at);) {
        if (!lum_session_same(w->session, session)) {
            at = &w->next;
            continue;
        }
        *at = w->next;
        lum_free(w);
    }
    if (!d->sensors->watchers) { /* the scene that was measured is not held on to */
        lum_director_sensors_destroy(d->sensors);
        d->sensors = NULL;
    }
}

static bool read_watch(struct lum_json_reader *r, struct lum_request *q)
{
    q->on = true;
    lum_json_bool(r, "on", &q->on);
    lum_json_bool(r, "points", &q->points);
    return lum_json_end(r);
}

/* NULL: memory is short. */
static struct watcher *watcher_of(struct lum_director *d, struct lum_session_ref session)
{
    if (!d->sensors)
        d->sensors = lum_calloc(1, sizeof *d->sensors);
    if (!d->sensors)
        return NULL;
    struct watcher *w = d->sensors->watchers;
    while (w && !lum_session_same(w->session, session))
        w = w->next;
    if (w)
        return w;
    w = lum_calloc(1, sizeof *w);
    if (w) {
        *w = (struct watcher){.next = d->sensors->watchers, .session = session};
        d->sensors->watchers = w;
    }
    return w;
}

static void watch(struct lum_director *d, const struct lum_request *q)
{
    if (!q->on) {
        lum_director_stop_watching(d, q->session);
        lum_director_reply(d, q, cJSON_CreateObject());
        return;
    }
    struct watcher *w = watcher_of(d, q->session);
    if (!w) {
        struct lum_proto_error err;
        lum_proto_fail_memory(&err);
        lum_director_refuse(d, q, &err);
        return;
    }
    w->points = q->points;
    for (struct entry *e = d->sensors->entries; e; e = e->next)
        e->news = e->known;
    lum_director_reply(d, q, cJSON_CreateObject());
}

const struct lum_request_type lum_request_sensor_watch = {.name = "sensor.watch", .read = read_watch, .answer = watch};

static void read_sensor(struct lum_director *d, const struct lum_request *q)
{
    struct lum_proto_error err;
    const struct lum_record *r = lum_document_find(d->world.doc, q->id);
    if (!r || r->type != LUM_RECORD_SENSOR) {
        char near[sizeof err.text / 2] = "";
        lum_document_nearest(d->world.doc, LUM_RECORD_SENSOR, q->id, near, sizeof near);
        lum_proto_fail(&err, LUM_PROTO_APPLICATION, "not_found", "id", "there is no sensor \"%s\"%s", q->id, near);
        lum_director_refuse(d, q, &err);
        return;
    }
    const struct entry *e = d->sensors ? find(d->sensors, q->id) : NULL;
    struct entry *fresh = e && e->record == r ? NULL : create_entry(d, r); /* its points, without values */
    const struct entry *shown = fresh ? fresh : e;
    cJSON *o = shown && shown->known ? entry_json(d, shown) : cJSON_CreateObject();
    if (!shown || !o || (!shown->known && !lum_json_add_string(o, "id", q->id)) ||
        (shown->desc.kind != LUM_SENSOR_OBSERVER &&
         !lum_json_add(o, "points", lum_sensor_points_json(&shown->desc, shown->sensor)))) {
        cJSON_Delete(o);
        o = NULL;
    }
    if (fresh)
        free_entry(fresh);
    lum_director_reply(d, q, o);
}

const struct lum_request_type lum_request_sensor_read = {
    .name = "sensor.read", .read = lum_request_read_id, .answer = read_sensor};

static bool read_place(struct lum_json_reader *r, struct lum_request *q)
{
    q->height_m = 0.75;
    q->border_m = 0.5;
    q->has_point = lum_json_id(r, "on", q->id);
    if (q->has_point) {
        q->height_m = 0.001;
        q->border_m = 0.0;
    }
    lum_json_number(r, "height_m", -LUM_LIMIT_COORD_M, LUM_LIMIT_COORD_M, &q->height_m);
    lum_json_number(r, "border_m", 0.0, LUM_LIMIT_COORD_M, &q->border_m);
    q->n_directions = 1;
    lum_json_u32(r, "directions", 1, LUM_LIMIT_DIRECTIONS, &q->n_directions);
    return lum_json_end(r);
}

static bool add_vector(cJSON *o, const char *name, struct lum_vec3d v)
{
    const double values[3] = {v.x, v.y, v.z};
    return lum_json_add(o, name, cJSON_CreateDoubleArray(values, 3));
}

static void place(struct lum_director *d, const struct lum_request *q)
{
    struct lum_sensor_desc desc;
    struct lum_proto_error err;
    if (!lum_work_plane_place(&d->world,
                              &(struct lum_work_plane){q->has_point ? q->id : NULL, NULL, q->height_m, q->border_m},
                              &desc, &err)) {
        lum_director_refuse(d, q, &err);
        return;
    }
    lum_work_plane_fit(&desc, LUM_LIMIT_SENSOR_POINTS / (q->n_directions > 1 ? q->n_directions : 1));
    cJSON *o = cJSON_CreateObject();
    if (!lum_json_add_string(o, "kind", lum_sensor_kind_names[desc.kind]) ||
        !add_vector(o, "position", desc.position) || !add_vector(o, "u", desc.u) || !add_vector(o, "v", desc.v) ||
        (desc.spacing_m > 0.0 && !lum_json_add_number(o, "spacing_m", desc.spacing_m)) ||
        (desc.floor_m2 > 0.0 && !lum_json_add_number(o, "floor_m2", desc.floor_m2))) {
        cJSON_Delete(o);
        o = NULL;
    }
    lum_director_reply(d, q, o);
}

const struct lum_request_type lum_request_sensor_place = {.name = "sensor.place", .read = read_place, .answer = place};
