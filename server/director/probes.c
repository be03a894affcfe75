#include "server/director/probes.h"

#include <math.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "server/director/internal.h"
#include "server/director/read_request.h"

#define SAMPLES_MAX 65536u /* of one probe: about a second of tracing */
#define SAMPLES_DEFAULT 256u
#define SAMPLES_FIRST 256u /* of the first slice, which tells how long one takes */

struct lum_prober {
    struct lum_prober *next;
    struct lum_session_ref session;
    struct lum_request *first, **last; /* owned; their point and normal are known */
    uint32_t n;
    struct lum_probing *probing; /* of the first; NULL: not begun */
    double ns_per_sample;        /* of that; 0: not known yet */
};

/* ---- queues ---- */

static void free_prober(struct lum_prober *p)
{
    for (struct lum_request *q = p->first, *next; q; q = next) {
        next = q->next;
        lum_request_destroy(q);
    }
    lum_probing_destroy(p->probing);
    lum_free(p);
}

void lum_director_drop_probes(struct lum_director *d, struct lum_session_ref session)
{
    for (struct lum_prober **at = &d->probes.first, *p; (p = *at);) {
        if (!lum_session_same(p->session, session)) {
            at = &p->next;
            continue;
        }
        *at = p->next;
        free_prober(p);
    }
}

void lum_director_drop_all_probes(struct lum_director *d)
{
    while (d->probes.first)
        lum_director_drop_probes(d, d->probes.first->session);
}

enum lum_need lum_director_probes_need(const struct lum_director *d)
{
    return d->probes.first ? LUM_NEED_AWAITED : LUM_NEED_NOTHING;
}

/* That of the session; a new one comes last. NULL: memory is short. */
static struct lum_prober *prober_of(struct lum_director *d, struct lum_session_ref session)
{
    struct lum_prober **at = &d->probes.first;
    for (; *at; at = &(*at)->next)
        if (lum_session_same((*at)->session, session))
            return *at;
    struct lum_prober *p = lum_calloc(1, sizeof *p);
    if (p) {
        p->session = session;
        p->last = &p->first;
        *at = p;
    }
    return p;
}

/* The first request of the session is over, and freed. */
static void pop(struct lum_prober *p)
{
    struct lum_request *q = p->first;
    p->first = q->next;
    p->last = p->first ? p->last : &p->first;
    p->n--;
    lum_request_destroy(q);
    lum_probing_destroy(p->probing);
    p->probing = NULL;
    p->ns_per_sample = 0.0;
}

/* The turn passes on; who has nothing left goes. */
static void pass_turn(struct lum_director *d)
{
    struct lum_prober **end = &d->probes.first, *p = *end;
    *end = p->next;
    p->next = NULL;
    if (!p->first) {
        free_prober(p);
        return;
    }
    while (*end)
        end = &(*end)->next;
    *end = p;
}

/* ---- one probe ---- */

/* What the view shows that the request names; all where it names none. NULL: it is gone. */
static const struct lum_snapshot *scene_of(struct lum_director *d, const struct lum_request *q,
                                           struct lum_proto_error *err)
{
    if (q->view_id == 0)
        return lum_world_lit(&d->world);
    const struct lum_server_view *v = lum_director_view_of(d, q, err);
    if (!v)
        return NULL;
    return v->solo ? v->solo : lum_world_lit(&d->world);
}

/* In the scene as it is now. */
static bool begin(struct lum_director *d, const struct lum_request *q, struct lum_probing **ret_probing,
                  struct lum_proto_error *err)
{
    const struct lum_snapshot *scene = scene_of(d, q, err);
    struct lum_error e;
    if (!scene)
        return false;
    struct lum_vec3d point = {q->point[0], q->point[1], q->point[2]};
    struct lum_vec3 normal = lum_v3((float)q->normal[0], (float)q->normal[1], (float)q->normal[2]);
    if (!lum_probing_create(scene, point, normal, q->samples, 0, ret_probing, &e))
        return true;
    return lum_proto_fail(err, LUM_PROTO_INTERNAL, "internal", e.field, "%s", e.text);
}

static void answer(struct lum_director *d, const struct lum_request *q, const struct lum_probing *probing)
{
    struct lum_probe probe;
    uint64_t rays;
    lum_probing_result(probing, &probe, &rays);
    const double rgb[3] = {(double)probe.irradiance.r, (double)probe.irradiance.g, (double)probe.irradiance.b};
    cJSON *o = cJSON_CreateObject();
    lum_json_add_number(o, "illuminance_lx", probe.illuminance_lx);
    lum_json_add_number(o, "stderr_lx", probe.stderr_lx);
    lum_json_add(o, "irradiance", cJSON_CreateDoubleArray(rgb, 3));
    lum_json_add(o, "point", cJSON_CreateDoubleArray(q->point, 3));
    lum_json_add(o, "normal", cJSON_CreateDoubleArray(q->normal, 3));
    lum_json_add_number(o, "samples", q->samples);
    lum_json_add_number(o, "rays", (double)rays);
    lum_json_add_number(o, "scene_rev", (double)lum_probing_scene_rev(probing));
    lum_director_reply(d, q, o);
}

/* True: there is more to do of it. */
static bool go_on(struct lum_director *d, struct lum_prober *p, double slice_ns)
{
    struct lum_proto_error err;
    struct lum_error e;
    bool more = false;
    if (!p->probing && !begin(d, p->first, &p->probing, &err)) {
        lum_director_refuse(d, p->first, &err);
        return false;
    }
    double fit = p->ns_per_sample > 0.0 ? slice_ns / p->ns_per_sample : SAMPLES_FIRST;
    uint32_t n = (uint32_t)fmax(1.0, fmin(fit, SAMPLES_MAX));
    int64_t from = lum_clock_ns();
    if (lum_probing_go_on(p->probing, d->world.pool, n, &more, &e)) {
        lum_proto_fail(&err, LUM_PROTO_INTERNAL, "internal", e.field, "%s", e.text);
        lum_director_refuse(d, p->first, &err);
        return false;
    }
    p->ns_per_sample = (double)(lum_clock_ns() - from) / n;
    if (!more)
        answer(d, p->first, p->probing);
    return more;
}

void lum_director_probe(struct lum_director *d, double slice_ns)
{
    struct lum_prober *p = d->probes.first;
    if (!go_on(d, p, slice_ns))
        pop(p);
    pass_turn(d);
}

/* ---- request ---- */

/* {view_id, x, y} or {point, normal, view_id?}, and samples. */
static bool read_probe(struct lum_json_reader *r, struct lum_request *q)
{
    q->samples = SAMPLES_DEFAULT;
    lum_json_u32(r, "samples", 1, SAMPLES_MAX, &q->samples);
    q->has_point = lum_json_numbers(r, "point", 3, -LUM_LIMIT_COORD_M, LUM_LIMIT_COORD_M, q->point);
    if (!q->has_point)
        return lum_request_read_pixel(r, q) && lum_json_end(r);
    lum_json_u32(r, "view_id", 1, UINT32_MAX, &q->view_id);
    if (!lum_json_require(r, "normal") || !lum_json_numbers(r, "normal", 3, -1.0, 1.0, q->normal) || !lum_json_end(r))
        return false;
    if (lum_length(lum_v3((float)q->normal[0], (float)q->normal[1], (float)q->normal[2])) > 0.0f)
        return true;
    return lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "invalid_value", "normal", "normal must not be zero");
}

/* The point, which may lie under a pixel, and the unit normal. */
static bool find_point(struct lum_director *d, struct lum_request *q, struct lum_proto_error *err)
{
    struct lum_pick at = {.hit = true,
                          .point_world = {q->point[0], q->point[1], q->point[2]},
                          .normal = lum_v3((float)q->normal[0], (float)q->normal[1], (float)q->normal[2])};
    if (!q->has_point && !lum_director_pick(d, q, &at, err))
        return false;
    if (!at.hit)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "", "there is nothing under this pixel");
    at.normal = lum_normalize(at.normal);
    const double point[3] = {at.point_world.x, at.point_world.y, at.point_world.z};
    const double normal[3] = {(double)at.normal.x, (double)at.normal.y, (double)at.normal.z};
    for (int i = 0; i < 3; i++) {
        q->point[i] = point[i];
        q->normal[i] = normal[i];
    }
    return true;
}

/* What is asked for alone is measured in the scene as it is now; else, when those before it are answered. */
static bool enqueue(struct lum_director *d, struct lum_request *q, struct lum_proto_error *err)
{
    struct lum_probing *probing = NULL;
    if (!find_point(d, q, err) || !scene_of(d, q, err))
        return false;
    struct lum_prober *p = prober_of(d, q->session);
    if (!p)
        return lum_proto_fail_memory(err);
    if (p->n == LUM_LIMIT_PROBES_WAITING)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "busy", "",
                              "%u probes of this session wait already; ask again when one is answered", p->n);
    if (p->n == 0 && !begin(d, q, &probing, err)) {
        lum_director_drop_probes(d, q->session);
        return false;
    }
    if (p->n++ == 0)
        p->probing = probing;
    q->next = NULL;
    *p->last = q;
    p->last = &q->next;
    return true;
}

const struct lum_request_type lum_request_probe = {.name = "probe", .read = read_probe, .enqueue = enqueue};
