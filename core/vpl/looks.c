/* Light paths that begin with a look out of a portal: walk.h has the argument. */
#include "core/light/emit.h"
#include "core/light/emitter.h"
#include "core/math/warp.h"
#include "core/scene/surface.h"
#include "core/vpl/walk.h"

/* The part of the paths. */
#define LOOKS_OUT 0.25f

/* A light is as important as it has paths: half by its flux when it was first seen, half alike, so that those that were
 * dim then are still asked for when they are all that is left. By powers of 2: what moves elsewhere, and changes the
 * shares a little, leaves importance as it is. */
static float importance_of(const struct lum_vpl_walk *w, uint32_t light, const struct lum_light_ray *shot)
{
    const struct lum_snapshot *s = w->snapshot;
    const struct lum_vpl_share *share = &w->plan->shares[light];
    double flux_unit = lum_light_flux_unit(&s->lights.lights[light], s->bounds_lo, s->bounds_hi);
    return (float)(exp2(round(log2(share->upto - share->below))) * (double)lum_luminance(shot->flux_unit) / flux_unit);
}

void lum_vpl_set_off(const struct lum_vpl_walk *w, struct lum_vpl_path *inout, const struct lum_light_ray *shot)
{
    inout->flux = shot->flux_unit;
    inout->left = 1.0f;
    inout->density = shot->density;
    inout->found = !w->snapshot->lights.lights[inout->share].delta;
    inout->importance = importance_of(w, inout->share, shot);
    if (shot->density > 0.0f && w->set->portals.n > 0) { /* fewer go this way */
        inout->flux = lum_rgb_scale(inout->flux, 1.0f / (1.0f - LOOKS_OUT));
        inout->importance /= 1.0f - LOOKS_OUT;
    }
}

/* Beside the others' density, less than this is not worth a ray that asks whether x sees y: then they alone count. */
#define LOOKS_LEAST 0.05f

/* Density of a look out over that of the others, at y of normal n that light arrives at in direction d: both over area
 * at y, solid angle to the light, and points x. 0: that way leads nobody there. x: hit, towards which to_x goes. */
static float looks_over_others(const struct lum_vpl_walk *w, const struct lum_vpl_path *path,
                               const struct lum_portals_seen *seen, struct lum_vec3 n, struct lum_vec3 d,
                               struct lum_vec3 to_x, const struct lum_portal_hit *x, float pdf_sa)
{
    const struct lum_portals *o = &w->set->portals;
    float cos_light = -lum_dot(n, d), cos_x = lum_dot(n, to_x), chance = lum_portals_chance(o, seen, x->cell);
    if (!(cos_light * cos_x > 0.0f) || !(chance > 0.0f) || !(path->density > 0.0f))
        return 0.0f;
    float looks = x->cosine * fabsf(cos_x) / (LUM_PI * x->distance * x->distance * (float)o->n * chance);
    float ratio = LOOKS_OUT / (1.0f - LOOKS_OUT) * looks * pdf_sa / (fabsf(cos_light) * path->density);
    return ratio > LOOKS_LEAST ? ratio : 0.0f;
}

static void count_for_both(struct lum_vpl_path *inout, float ratio)
{
    inout->flux = lum_rgb_scale(inout->flux, 1.0f / (1.0f + ratio));
    inout->importance /= 1.0f + ratio;
}

/* Whether a ray meets it is chance, and another's for a ray from elsewhere: it is no place that is seen. */
static bool is_chance(const struct lum_material *m)
{
    return m->alpha_mode == LUM_ALPHA_BLEND;
}

bool lum_vpl_look_out(struct lum_vpl_walk *w, struct lum_vpl_path *inout, struct lum_vec2 *inout_u)
{
    const struct lum_portals *o = &w->set->portals;
    struct lum_vec2 u = {inout_u->x / LOOKS_OUT, inout_u->y};
    if (o->n == 0 || !lum_light_is_from_afar(&w->snapshot->lights.lights[inout->share]))
        return false;
    inout_u->x = lum_clamp((inout_u->x - LOOKS_OUT) / (1.0f - LOOKS_OUT), 0.0f, LUM_ONE_MINUS);
    if (u.x >= 1.0f)
        return false;
    uint32_t k = (uint32_t)(u.x * (float)o->n);
    k = k < o->n ? k : o->n - 1u;
    u.x = lum_clamp(u.x * (float)o->n - (float)k, 0.0f, LUM_ONE_MINUS);
    struct lum_vec3 inward, x = lum_portals_point(o, o->cell[k], u, &inward);
    struct lum_frame f = lum_frame_from_normal(lum_v3_neg(inward));
    struct lum_vec3 d = lum_frame_to_scene(&f, lum_warp_cosine(lum_sampler_2d(&inout->sampler, PAIR_DIRECTION)));
    inout->looks_out = true;
    inout->by = (struct lum_portal_hit){.cosine = -lum_dot(d, inward), .cell = o->cell[k]};
    w->path[w->rays.n] = *inout;
    lum_rays_push(&w->rays, x, d, INFINITY);
    return true;
}

void lum_vpl_send_light(struct lum_vpl_walk *w, struct lum_vpl_path path, uint32_t i, struct lum_vec3 d)
{
    struct lum_vec3 y = lum_v3_mad(lum_v3(w->rays.ox[i], w->rays.oy[i], w->rays.oz[i]), d, w->hits.t[i]);
    struct lum_vec3 n = lum_normalize(lum_v3(w->hits.ngx[i], w->hits.ngy[i], w->hits.ngz[i]));
    struct lum_light_ray shot;
    float pdf_sa;
    path.by.distance = w->hits.t[i];
    if (w->hits.object[i] >= w->snapshot->n_instances || !(path.by.distance > 0.0f))
        return;
    const struct lum_instance *instance = &w->snapshot->instances[w->hits.object[i]];
    n = lum_instance_normal(instance, n);
    if (is_chance(&w->snapshot->materials[instance->material]))
        return;
    if (!lum_light_emit_to(w->snapshot, path.share, &w->set->portals, y, lum_sampler_2d(&path.sampler, PAIR_SKY), &shot,
                           &pdf_sa))
        return;
    path.density = shot.density;
    struct lum_portals_seen seen;
    lum_portals_see(&w->set->portals, y, lum_dot(n, d) < 0.0f ? n : lum_v3_neg(n), &seen);
    float ratio = looks_over_others(w, &path, &seen, n, shot.d, lum_v3_neg(d), &path.by, pdf_sa);
    if (!(ratio > 0.0f))
        return;
    path.looks_out = false;
    path.reaches = lum_length(lum_v3_sub(y, shot.o));
    lum_vpl_set_off(w, &path, &shot);
    count_for_both(&path, ratio);
    w->path[w->rays.n] = path;
    lum_rays_push(&w->rays, shot.o, shot.d, INFINITY);
}

void lum_vpl_weigh_by_looks(struct lum_vpl_walk *w, struct lum_vpl_path *inout, const struct lum_surface *s,
                            struct lum_vec3 d)
{
    const struct lum_portals *o = &w->set->portals;
    struct lum_portal_hit x;
    struct lum_vec3 to_x;
    struct lum_portals_seen seen;
    if (lum_portals_inside(o, s->p) || is_chance(&w->snapshot->materials[s->material]))
        return;
    lum_portals_see(o, s->p, s->ng, &seen); /* towards the light, and where it is not, portals do not count */
    if (!lum_portals_aim(o, &seen, s->p, lum_sampler_2d(&inout->sampler, PAIR_PORTAL), &to_x, &x))
        return;
    float pdf_sa = lum_light_emit_to_pdf(w->snapshot, inout->share, lum_v3_neg(d));
    float ratio = looks_over_others(w, inout, &seen, s->ng, d, to_x, &x, pdf_sa);
    if (!(ratio > 0.0f))
        return;
    struct lum_rays rays;
    struct lum_hits hits;
    struct lum_trace trace = lum_trace_of(w->snapshot, w->counters);
    rays.n = 0;
    lum_rays_push(&rays, lum_v3_mad(s->p, to_x, x.distance), lum_v3_neg(to_x), INFINITY);
    w->counters->rays[LUM_RAY_VPL] += lum_known_closest(w->known, &trace, &rays, &hits);
    if (hits.object[0] != LUM_NO_OBJECT && fabsf(hits.t[0] - x.distance) <= LUM_VPL_SAME_PLACE)
        count_for_both(inout, ratio);
}
