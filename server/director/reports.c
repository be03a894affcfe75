#include "server/director/reports.h"

#include <math.h>
#include <stdlib.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/director/internal.h"
#include "server/report/report.h"
#include "server/report/shot.h"
#include "server/world/work_plane.h"

/* A slice holds all else up. Places that are looked at in one, and samples: at least so many that the time of one is
 * known, at most so many as a second has. */
#define PLACES_PER_SLICE 64u
#define SAMPLES_MIN 256u
#define SAMPLES_MAX 65536u
/* `live` is right in the mean from the first on, and somebody waits. Steps of false colour hide noise. */
#define PICTURE_SPP 4u
#define ILLUMINANCE_SPP 2u
#define POINT_ERROR 0.02 /* likewise: means of many points are known much better */

/* All of the revision that was shown when it began. */
struct lum_reporting {
    uint64_t scene_rev;
    struct lum_record *records[LUM_LIMIT_SENSORS]; /* held: names are theirs */
    struct lum_measured measured[LUM_LIMIT_SENSORS];
    size_t n, n_done; /* sensors */
    bool looked;      /* clearance of the points of the next is known */
    struct lum_schedule schedule;
    struct lum_shot *shots[LUM_REPORT_PICTURES];
    struct lum_canvas pictures[LUM_REPORT_PICTURES];
    int n_pictures; /* done */
    struct progress {
        const char *stage; /* NULL: nothing was told */
        uint32_t done, of;
    } told;
    double ns_per_sample;
};

static void free_reporting(struct lum_reporting *r)
{
    if (!r)
        return;
    for (size_t i = 0; i < r->n; i++) {
        lum_sensor_destroy(r->measured[i].sensor);
        if (r->records[i])
            lum_record_unref(r->records[i]);
    }
    for (int i = 0; i < LUM_REPORT_PICTURES; i++) {
        lum_shot_destroy(r->shots[i]);
        lum_free(r->pictures[i].rgb);
    }
    lum_schedule_finish(&r->schedule);
    lum_free(r);
}

/* ---- beginning ---- */

static void take_sensor(void *user, const struct lum_record *record)
{
    struct lum_reporting *r = user;
    if (record->type != LUM_RECORD_SENSOR || r->n == LUM_LIMIT_SENSORS)
        return;
    r->records[r->n] = lum_record_ref((struct lum_record *)(uintptr_t)record);
    r->measured[r->n++] = (struct lum_measured){.id = record->id,
                                                .name = record->sensor.name,
                                                .desc = lum_sensor_desc_of(record),
                                                .targets = lum_sensor_targets_of(record)};
}

/* The scene's own, or as `lumend measure` a work plane, where there is a floor for one. */
static bool find_sensors(struct lum_director *d, struct lum_reporting *r)
{
    struct lum_proto_error none;
    if (!lum_document_each(d->world.doc, take_sensor, r))
        return false;
    struct lum_measured *one = &r->measured[0];
    if (r->n == 0 &&
        lum_work_plane_place(&d->world, &(struct lum_work_plane){NULL, NULL, 0.75, 0.5}, &one->desc, &none)) {
        lum_work_plane_fit(&one->desc, LUM_LIMIT_SENSOR_POINTS);
        r->n = 1;
    }
    return true;
}

static uint32_t spp_of(int picture)
{
    return picture == LUM_REPORT_ILLUMINANCE ? ILLUMINANCE_SPP : PICTURE_SPP;
}

static enum lum_status prepare(struct lum_director *d, const struct lum_request *q, struct lum_reporting *r,
                               struct lum_error *err)
{
    const struct lum_server_view *v = q->view_id ? lum_director_view_of(d, q, NULL) : NULL;
    enum lum_status st = lum_schedule_make(&d->world, &r->schedule, err);
    for (size_t i = 0; i < r->n && !st; i++) {
        struct lum_measured *one = &r->measured[i];
        one->sensor = r->records[i] ? lum_director_copy_sensor(d, r->records[i]) : NULL;
        if (one->sensor) /* what its panel shows, the page shows */
            continue;
        st = lum_sensor_create(&one->desc, LUM_LIMIT_SENSOR_POINTS, &one->sensor, err);
        if (!st)
            lum_sensor_aim(one->sensor, lum_world_lit(&d->world));
    }
    for (int i = 0; i < LUM_REPORT_PICTURES && !st; i++) {
        const struct lum_shot_desc desc = {LUM_REPORT_PICTURE_W, LUM_REPORT_PICTURE_H, spp_of(i),
                                           i == LUM_REPORT_ILLUMINANCE, v ? &v->settings.camera : NULL};
        st = lum_shot_create(&d->world, &desc, &r->shots[i], err);
    }
    return st;
}

static enum lum_status begin(struct lum_director *d, const struct lum_request *q, struct lum_error *err)
{
    struct lum_reporting *r = d->reports.now = lum_calloc(1, sizeof *r);
    if (!r || !find_sensors(d, r))
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a report");
    r->scene_rev = lum_world_lit(&d->world)->scene_rev;
    return prepare(d, q, r, err);
}

/* ---- slices ---- */

static enum lum_status measure(struct lum_director *d, struct lum_reporting *r, double slice_ns, struct lum_error *err)
{
    const struct lum_meter_goal goal = {POINT_ERROR, LUM_SENSOR_DARK, LUM_SENSOR_SAMPLES_MAX};
    struct lum_measured *one = &r->measured[r->n_done];
    if (!r->looked) {
        r->looked = !lum_sensor_look(one->sensor, d->world.pool, PLACES_PER_SLICE, false);
        return LUM_OK;
    }
    double fit = r->ns_per_sample > 0.0 ? slice_ns / r->ns_per_sample : 0.0;
    uint32_t n = (uint32_t)fmax(SAMPLES_MIN, fmin(fit, SAMPLES_MAX));
    uint64_t before = lum_sensor_samples(one->sensor);
    int64_t from = lum_clock_ns();
    bool more = false;
    enum lum_status st = lum_sensor_refine(one->sensor, d->world.pool, &goal, n, &more, err);
    uint64_t done = lum_sensor_samples(one->sensor) - before;
    if (done >= SAMPLES_MIN)
        r->ns_per_sample = (double)(lum_clock_ns() - from) / (double)done;
    if (!st && !more) {
        (void)lum_sensor_result(one->sensor, &one->result);
        r->n_done++;
        r->looked = false;
    }
    return st;
}

/* False: something in the inbox waits already. */
static bool begin_pass(struct lum_director *d)
{
    pthread_mutex_lock(&d->lock);
    d->picturing = !d->stop && !d->inbox;
    if (d->picturing)
        atomic_store_explicit(&d->cancel, false, memory_order_relaxed);
    bool go = d->picturing;
    pthread_mutex_unlock(&d->lock);
    return go;
}

static void end_pass(struct lum_director *d)
{
    pthread_mutex_lock(&d->lock);
    d->picturing = false;
    pthread_mutex_unlock(&d->lock);
}

static enum lum_status picture(struct lum_director *d, struct lum_reporting *r, struct lum_error *err)
{
    struct lum_shot *shot = r->shots[r->n_pictures];
    bool done = false;
    if (!begin_pass(d))
        return LUM_OK;
    enum lum_status st = lum_shot_pass(shot, &d->cancel, &done, err);
    end_pass(d);
    if (st == LUM_ERR_CANCELLED)
        return LUM_OK;
    if (!st && done) {
        st = lum_shot_paint(shot, &r->pictures[r->n_pictures], err);
        lum_shot_destroy(shot);
        r->shots[r->n_pictures++] = NULL;
    }
    return st;
}

static enum lum_status answer(struct lum_director *d, const struct lum_request *q, const struct lum_reporting *r,
                              struct lum_error *err)
{
    struct lum_report report = {.scene = d->config.scene, .measured = r->measured, .n = r->n, .schedule = &r->schedule};
    for (int i = 0; i < LUM_REPORT_PICTURES; i++)
        report.pictures[i] = r->pictures[i];
    char *html;
    size_t n;
    enum lum_status st = lum_report_write(&report, &html, &n, err);
    if (st)
        return st;
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_number(o, "scene_rev", (double)r->scene_rev) && lum_json_add_string(o, "html", html);
    free(html);
    if (!ok) {
        cJSON_Delete(o);
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a report");
    }
    lum_director_reply(d, q, o);
    return LUM_OK;
}

/* ---- progress ---- */

/* Of sensors how many are done, of a picture how many samples a pixel. */
static struct progress progress_of(const struct lum_reporting *r)
{
    static const char *const names[LUM_REPORT_PICTURES] = {"picture", "illuminance"};
    if (r->n_done < r->n)
        return (struct progress){"sensors", (uint32_t)r->n_done, (uint32_t)r->n};
    if (r->n_pictures == LUM_REPORT_PICTURES)
        return r->told; /* the page is written at once */
    const struct lum_shot *shot = r->shots[r->n_pictures];
    return (struct progress){names[r->n_pictures], lum_shot_spp(shot), spp_of(r->n_pictures)};
}

/* To who asked, whenever there is something new. Memory short: the next time. */
static void tell_progress(struct lum_director *d)
{
    struct lum_reporting *r = d->reports.now;
    struct progress now = progress_of(r);
    if (now.stage == r->told.stage && now.done == r->told.done)
        return;
    r->told = now;
    cJSON *params = cJSON_CreateObject();
    if (lum_json_add_string(params, "stage", now.stage) && lum_json_add_number(params, "done", now.done) &&
        lum_json_add_number(params, "of", now.of))
        lum_director_send_news(d, d->reports.waiting->session, lum_rpc_notification("report.progress", params));
    else
        cJSON_Delete(params);
}

static void pop(struct lum_director *d)
{
    struct lum_request *q = d->reports.waiting;
    d->reports.waiting = q->next;
    free_reporting(d->reports.now);
    d->reports.now = NULL;
    lum_request_destroy(q);
}

enum lum_need lum_director_reports_need(const struct lum_director *d)
{
    return d->reports.waiting ? LUM_NEED_AWAITED : LUM_NEED_NOTHING;
}

void lum_director_report(struct lum_director *d, double slice_ns)
{
    const struct lum_request *q = d->reports.waiting;
    const struct lum_reporting *r = d->reports.now;
    struct lum_error e;
    enum lum_status st;
    bool over = false;
    if (!r) {
        st = begin(d, q, &e);
    } else if (r->n_done < r->n) {
        st = measure(d, d->reports.now, slice_ns, &e);
    } else if (r->n_pictures < LUM_REPORT_PICTURES) {
        st = picture(d, d->reports.now, &e);
    } else {
        st = answer(d, q, r, &e);
        over = true;
    }
    if (st) {
        struct lum_proto_error err;
        lum_proto_fail(&err, LUM_PROTO_INTERNAL, "internal", e.field, "%s", e.text);
        lum_director_refuse(d, q, &err);
    }
    if (st || over)
        pop(d);
    else
        tell_progress(d);
}

/* ---- requests ---- */

void lum_director_drop_reports(struct lum_director *d, struct lum_session_ref session)
{
    while (d->reports.waiting && lum_session_same(d->reports.waiting->session, session))
        pop(d);
    for (struct lum_request **at = d->reports.waiting ? &d->reports.waiting->next : &d->reports.waiting, *q;
         (q = *at);) {
        if (!lum_session_same(q->session, session)) {
            at = &q->next;
            continue;
        }
        *at = q->next;
        lum_request_destroy(q);
    }
}

void lum_director_drop_all_reports(struct lum_director *d)
{
    while (d->reports.waiting)
        pop(d);
}

static bool read_report(struct lum_json_reader *r, struct lum_request *q)
{
    lum_json_u32(r, "view_id", 1, UINT32_MAX, &q->view_id);
    return lum_json_end(r);
}

static bool enqueue(struct lum_director *d, struct lum_request *q, struct lum_proto_error *err)
{
    struct lum_request **end = &d->reports.waiting;
    if (q->view_id && !lum_director_view_of(d, q, err))
        return false;
    for (; *end; end = &(*end)->next)
        if (lum_session_same((*end)->session, q->session))
            return lum_proto_fail(err, LUM_PROTO_APPLICATION, "busy", "",
                                  "a report of this session is being made; ask again when it is answered");
    q->next = NULL;
    *end = q;
    return true;
}

const struct lum_request_type lum_request_report_get = {.name = "report.get", .read = read_report, .enqueue = enqueue};
