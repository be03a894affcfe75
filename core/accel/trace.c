/* Batches of rays through Embree, 16 at a time. The structure-of-arrays batch has Embree's own packet layout in runs of
 * 16 lanes, so packing is ten 64-byte copies; lanes past the end of the batch are copied too and switched off. */
#include "core/accel/trace.h"

#include <string.h>

#include "core/accel/embree.h"

#define WIDTH 16 /* rays of the widest packet that Embree takes */

struct filter_context {
#if RTC_VERSION_MAJOR >= 4
    struct RTCRayQueryContext rtc;
    struct RTCIntersectArguments intersect;
    struct RTCOccludedArguments occluded;
#else
    struct RTCIntersectContext rtc;
#endif
    const struct lum_accel_alpha *alpha;
    const struct lum_accel_panes *panes; /* NULL: they occlude */
    const struct lum_rays *rays;         /* with panes: the batch */
    struct passage *passages;            /* same: by ray */
    uint32_t n_instances;
};

/* What a query takes last: Embree 3 the context, then rays; Embree 4 rays, then arguments that the context is in. */
#if RTC_VERSION_MAJOR >= 4
#define CONTEXT_AND(rays, context, query) rays, &(context)->query
#else
#define CONTEXT_AND(rays, context, query) &(context)->rtc, rays
#endif

/* What light has been through so far. */
struct passage {
    struct lum_rgb left, depth;
    uint32_t n; /* panes */
    uint32_t object[LUM_PANES_KEPT];
    float t[LUM_PANES_KEPT];
};

/* Embree's packets are N-wide arrays one after the other; RTCHitN's fields are Ng_x Ng_y Ng_z u v primID geomID instID.
 */
static void filter_alpha(const struct RTCFilterFunctionNArguments *args)
{
    const struct filter_context *context = (const struct filter_context *)args->context;
    const float *hit_f = (const float *)args->hit;
    const uint32_t *hit_u = (const uint32_t *)args->hit;
    uint32_t n = args->N;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t instance = hit_u[7 * n + i];
        if (args->valid[i] == 0 || instance >= context->n_instances)
            continue; /* emitter shapes are opaque */
        if (!context->alpha->opaque(context->alpha->user, instance, hit_u[5 * n + i], hit_f[3 * n + i],
                                    hit_f[4 * n + i]))
            args->valid[i] = 0;
    }
}

/* True when this is the pane that the ray has just been counted through. steep: |d| times the cosine. */
static bool is_counted(const struct passage *p, uint32_t object, float t, float steep)
{
    uint32_t n = p->n < LUM_PANES_KEPT ? p->n : LUM_PANES_KEPT;
    for (uint32_t k = 0; k < n; k++)
        if (p->object[k] == object && fabsf(p->t[k] - t) * steep <= LUM_RAY_OFFSET)
            return true;
    return false;
}

/* False: the light ends here. */
static bool pass_pane(const struct filter_context *context, uint32_t i, uint32_t object, uint32_t prim, float u,
                      float v, float t)
{
    const struct lum_rays *r = context->rays;
    struct lum_vec3 d = {r->dx[i], r->dy[i], r->dz[i]};
    struct passage *p = &context->passages[i];
    struct lum_accel_pane pane;
    if (!context->panes->passes(context->panes->user, object, prim, u, v, d, &pane))
        return false;
    if (is_counted(p, object, t, pane.steep))
        return true;
    uint32_t slot = p->n++ % LUM_PANES_KEPT;
    p->object[slot] = object;
    p->t[slot] = t;
    p->left = lum_rgb_mul(p->left, pane.left);
    p->depth = lum_rgb_mad(p->depth, pane.depth, t * lum_length(d));
    return !lum_rgb_black(p->left);
}

/* The ray's fields are ox oy oz tnear dx dy dz time tfar mask id flags; tfar is that of the candidate. The ray itself
 * is in the instance's space. */
static void filter_light(const struct RTCFilterFunctionNArguments *args)
{
    const struct filter_context *context = (const struct filter_context *)args->context;
    const float *hit_f = (const float *)args->hit, *ray_f = (const float *)args->ray;
    const uint32_t *hit_u = (const uint32_t *)args->hit, *ray_u = (const uint32_t *)args->ray;
    uint32_t n = args->N;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t object = hit_u[7 * n + i], prim = hit_u[5 * n + i];
        float u = hit_f[3 * n + i], v = hit_f[4 * n + i];
        if (args->valid[i] == 0 || object >= context->n_instances)
            continue; /* emitter shapes are opaque */
        if ((context->alpha && !context->alpha->opaque(context->alpha->user, object, prim, u, v)) ||
            pass_pane(context, ray_u[10 * n + i], object, prim, u, v, ray_f[8 * n + i]))
            args->valid[i] = 0;
    }
}

/* Sets valid[lane] to -1 where lane < n and the ray is fit for Embree, else 0; returns how many of the n are not. One
 * pass without branches, which compilers turn into a few vector instructions. NaN fails every comparison. */
static uint32_t gate(const struct lum_rays *r, uint32_t first, uint32_t n, int valid[WIDTH])
{
    uint32_t bad = 0;
    for (uint32_t k = 0; k < WIDTH; k++) {
        uint32_t i = first + k;
        float ox = fabsf(r->ox[i]), oy = fabsf(r->oy[i]), oz = fabsf(r->oz[i]);
        float dx = fabsf(r->dx[i]), dy = fabsf(r->dy[i]), dz = fabsf(r->dz[i]);
        uint32_t ok =
            (uint32_t)(ox <= LUM_RAY_LIMIT) & (uint32_t)(oy <= LUM_RAY_LIMIT) & (uint32_t)(oz <= LUM_RAY_LIMIT);
        ok &= (uint32_t)(dx <= LUM_RAY_LIMIT) & (uint32_t)(dy <= LUM_RAY_LIMIT) & (uint32_t)(dz <= LUM_RAY_LIMIT);
        ok &= (uint32_t)(dx > 0.0f) | (uint32_t)(dy > 0.0f) | (uint32_t)(dz > 0.0f);
        ok &= (uint32_t)(r->tnear[i] >= 0.0f) & (uint32_t)(r->tnear[i] <= r->tfar[i]);
        uint32_t live = (uint32_t)(k < n);
        valid[k] = -(int)(ok & live);
        bad += (ok ^ 1u) & live;
    }
    return bad;
}

/* Makes lanes that are not valid such as Embree never looks at. It has a mask for that, but where the processor has no
 * vectors of 16 it traces every lane with tnear <= tfar, whatever the mask says, and aborts on what it finds there. */
static void switch_off(const int valid[WIDTH], struct RTCRay16 *packet)
{
    for (uint32_t k = 0; k < WIDTH; k++)
        if (valid[k] == 0) {
            packet->org_x[k] = packet->org_y[k] = packet->org_z[k] = 0.0f;
            packet->dir_x[k] = packet->dir_y[k] = 0.0f;
            packet->dir_z[k] = 1.0f;
            packet->tnear[k] = 1.0f;
            packet->tfar[k] = 0.0f;
        }
}

static void pack(const struct lum_rays *r, uint32_t first, uint32_t mask, struct RTCRay16 *packet)
{
    const size_t size = WIDTH * sizeof(float);
    memcpy(packet->org_x, r->ox + first, size);
    memcpy(packet->org_y, r->oy + first, size);
    memcpy(packet->org_z, r->oz + first, size);
    memcpy(packet->tnear, r->tnear + first, size);
    memcpy(packet->dir_x, r->dx + first, size);
    memcpy(packet->dir_y, r->dy + first, size);
    memcpy(packet->dir_z, r->dz + first, size);
    memcpy(packet->tfar, r->tfar + first, size);
    for (uint32_t k = 0; k < WIDTH; k++) {
        packet->mask[k] = mask;
        packet->id[k] = first + k;
    }
}

static void unpack(const struct RTCRayHit16 *packet, uint32_t first, struct lum_hits *h)
{
    const size_t size = WIDTH * sizeof(float);
    memcpy(h->t + first, packet->ray.tfar, size);
    memcpy(h->u + first, packet->hit.u, size);
    memcpy(h->v + first, packet->hit.v, size);
    memcpy(h->ngx + first, packet->hit.Ng_x, size);
    memcpy(h->ngy + first, packet->hit.Ng_y, size);
    memcpy(h->ngz + first, packet->hit.Ng_z, size);
    memcpy(h->prim + first, packet->hit.primID, size);
    memcpy(h->object + first, packet->hit.instID[0], size); /* everything is an instance (top.c) */
}

/* panes: NULL where they occlude. */
static void filter_context_init(struct filter_context *context, const struct lum_trace *trace,
                                const struct lum_accel_panes *panes, bool coherent)
{
    RTCFilterFunctionN filter = panes ? filter_light : trace->alpha ? filter_alpha : NULL;
    context->alpha = trace->alpha;
    context->panes = panes;
    context->rays = NULL;
    context->passages = NULL;
    context->n_instances = trace->top->n_instances;
#if RTC_VERSION_MAJOR >= 4
    rtcInitRayQueryContext(&context->rtc);
    rtcInitIntersectArguments(&context->intersect);
    rtcInitOccludedArguments(&context->occluded);
    context->intersect.context = context->occluded.context = &context->rtc;
    context->intersect.filter = context->occluded.filter = filter;
    context->intersect.flags = context->occluded.flags =
        (coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT) |
        (filter ? RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER : 0);
#else
    rtcInitIntersectContext(&context->rtc);
    if (coherent)
        context->rtc.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    context->rtc.filter = filter;
#endif
}

/* Hits on emitter shapes: normals in scene space, and coordinates on them, from the hit point, taken relative to the
 * centre first so that it is as exact as the distance. */
static void complete_shape_hits(const struct lum_accel_top *top, const struct lum_rays *rays, struct lum_hits *h)
{
    for (uint32_t i = 0; i < rays->n; i++) {
        if (h->object[i] == LUM_NO_OBJECT || h->object[i] < top->n_instances)
            continue;
        const struct lum_accel_shape *s = &top->shapes[h->object[i] - top->n_instances];
        struct lum_vec3 o = lum_v3(rays->ox[i], rays->oy[i], rays->oz[i]);
        struct lum_vec3 d = lum_v3(rays->dx[i], rays->dy[i], rays->dz[i]);
        struct lum_vec3 q = lum_v3_mad(lum_v3_sub(o, s->p), d, h->t[i]);
        struct lum_vec3 n = s->row->on(s, q, &h->u[i], &h->v[i]);
        h->ngx[i] = n.x;
        h->ngy[i] = n.y;
        h->ngz[i] = n.z;
    }
}

static uint32_t ray_mask(const struct lum_trace *trace)
{
    return trace->camera ? LUM_MASK_CAMERA : LUM_MASK_ALL;
}

/* ---- packets ---- */

/* These four return how many rays were not fit. */
static uint32_t closest_packets(const struct lum_trace *trace, struct filter_context *context,
                                const struct lum_rays *rays, struct lum_hits *ret_hits)
{
    uint32_t bad = 0;
    struct RTCRayHit16 packet;
    memset(&packet, 0, sizeof packet);
    _Alignas(64) int valid[WIDTH];
    for (uint32_t first = 0; first < rays->n; first += WIDTH) {
        uint32_t n = rays->n - first;
        uint32_t unfit = gate(rays, first, n, valid);
        bad += unfit;
        pack(rays, first, ray_mask(trace), &packet.ray);
        if (n < WIDTH || unfit)
            switch_off(valid, &packet.ray);
        memset(packet.hit.geomID, 0xff, sizeof packet.hit.geomID);
        memset(packet.hit.instID, 0xff, sizeof packet.hit.instID);
        rtcIntersect16(valid, trace->top->scene, CONTEXT_AND(&packet, context, intersect));
        unpack(&packet, first, ret_hits);
    }
    return bad;
}

static uint32_t any_packets(const struct lum_trace *trace, struct filter_context *context, const struct lum_rays *rays,
                            uint8_t ret_occluded[LUM_RAY_BATCH])
{
    uint32_t bad = 0;
    struct RTCRay16 packet;
    memset(&packet, 0, sizeof packet);
    _Alignas(64) int valid[WIDTH];
    for (uint32_t first = 0; first < rays->n; first += WIDTH) {
        uint32_t n = rays->n - first;
        uint32_t unfit = gate(rays, first, n, valid);
        bad += unfit;
        pack(rays, first, ray_mask(trace), &packet);
        if (n < WIDTH || unfit)
            switch_off(valid, &packet);
        rtcOccluded16(valid, trace->top->scene, CONTEXT_AND(&packet, context, occluded));
        /* Embree writes tfar = -inf into occluded lanes; lanes that it did not trace keep tfar and count as free */
        for (uint32_t k = 0; k < WIDTH; k++)
            ret_occluded[first + k] = (uint8_t)((valid[k] != 0) & (packet.tfar[k] < 0.0f));
    }
    return bad;
}

/* ---- one by one ---- */

static struct RTCRay single_ray(const struct lum_trace *trace, const struct lum_rays *rays, uint32_t i)
{
    return (struct RTCRay){.org_x = rays->ox[i],
                           .org_y = rays->oy[i],
                           .org_z = rays->oz[i],
                           .tnear = rays->tnear[i],
                           .dir_x = rays->dx[i],
                           .dir_y = rays->dy[i],
                           .dir_z = rays->dz[i],
                           .tfar = rays->tfar[i],
                           .mask = ray_mask(trace),
                           .id = i};
}

static uint32_t closest_singles(const struct lum_trace *trace, struct filter_context *context,
                                const struct lum_rays *rays, struct lum_hits *ret_hits)
{
    uint32_t bad = 0;
    _Alignas(64) int valid[WIDTH];
    for (uint32_t i = 0; i < rays->n; i++) {
        if (i % WIDTH == 0)
            bad += gate(rays, i, rays->n - i, valid);
        struct RTCRayHit q = {.ray = single_ray(trace, rays, i),
                              .hit = {.geomID = RTC_INVALID_GEOMETRY_ID, .instID = {RTC_INVALID_GEOMETRY_ID}}};
        if (valid[i % WIDTH])
            rtcIntersect1(trace->top->scene, CONTEXT_AND(&q, context, intersect));
        ret_hits->t[i] = q.ray.tfar;
        ret_hits->u[i] = q.hit.u;
        ret_hits->v[i] = q.hit.v;
        ret_hits->ngx[i] = q.hit.Ng_x;
        ret_hits->ngy[i] = q.hit.Ng_y;
        ret_hits->ngz[i] = q.hit.Ng_z;
        ret_hits->prim[i] = q.hit.primID;
        ret_hits->object[i] = q.hit.instID[0];
    }
    return bad;
}

static uint32_t any_singles(const struct lum_trace *trace, struct filter_context *context, const struct lum_rays *rays,
                            uint8_t ret_occluded[LUM_RAY_BATCH])
{
    uint32_t bad = 0;
    _Alignas(64) int valid[WIDTH];
    for (uint32_t i = 0; i < rays->n; i++) {
        if (i % WIDTH == 0)
            bad += gate(rays, i, rays->n - i, valid);
        struct RTCRay ray = single_ray(trace, rays, i);
        if (valid[i % WIDTH])
            rtcOccluded1(trace->top->scene, CONTEXT_AND(&ray, context, occluded));
        ret_occluded[i] = (uint8_t)((valid[i % WIDTH] != 0) & (ray.tfar < 0.0f));
    }
    return bad;
}

/* ---- either way ---- */

void lum_trace_closest(const struct lum_trace *trace, const struct lum_rays *rays, struct lum_hits *ret_hits)
{
    struct filter_context context;
    filter_context_init(&context, trace, NULL, trace->coherent);
    ret_hits->white = false;
    uint32_t bad = trace->top->device->singly ? closest_singles(trace, &context, rays, ret_hits)
                                              : closest_packets(trace, &context, rays, ret_hits);
    if (trace->top->n_shapes)
        complete_shape_hits(trace->top, rays, ret_hits);
    if (bad)
        *trace->bad_rays += bad;
}

static void trace_any(const struct lum_trace *trace, struct filter_context *context, const struct lum_rays *rays,
                      uint8_t ret_occluded[LUM_RAY_BATCH])
{
    uint32_t bad = trace->top->device->singly ? any_singles(trace, context, rays, ret_occluded)
                                              : any_packets(trace, context, rays, ret_occluded);
    if (bad)
        *trace->bad_rays += bad;
}

void lum_trace_any(const struct lum_trace *trace, const struct lum_rays *rays, uint8_t ret_occluded[LUM_RAY_BATCH])
{
    struct filter_context context;
    filter_context_init(&context, trace, NULL, false); /* coherent occlusion: see trace.h */
    trace_any(trace, &context, rays, ret_occluded);
}

/* What is behind surfaces adds up whatever order they are met in; light that begins or ends in it would be brightened.
 */
static struct lum_rgb left_of(const struct passage *p)
{
    if (lum_rgb_black(p->depth))
        return p->left;
    return lum_rgb_mul(p->left, lum_rgb(expf(-lum_max(p->depth.r, 0.0f)), expf(-lum_max(p->depth.g, 0.0f)),
                                        expf(-lum_max(p->depth.b, 0.0f))));
}

void lum_trace_light(const struct lum_trace *trace, const struct lum_rays *rays, uint8_t ret_occluded[LUM_RAY_BATCH],
                     struct lum_rgb ret_left[LUM_RAY_BATCH])
{
    struct filter_context context;
    struct passage passages[LUM_RAY_BATCH]; /* 24 KiB */
    filter_context_init(&context, trace, trace->panes, false);
    context.rays = rays;
    context.passages = passages;
    for (uint32_t i = 0; i < rays->n && trace->panes; i++) {
        passages[i].left = lum_grey(1.0f);
        passages[i].depth = lum_grey(0.0f);
        passages[i].n = 0;
    }
    trace_any(trace, &context, rays, ret_occluded);
    for (uint32_t i = 0; i < rays->n && trace->panes; i++)
        ret_left[i] = left_of(&passages[i]);
}
