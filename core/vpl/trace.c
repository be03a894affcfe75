/* Light paths, and the VPLs they leave. */
#include "core/math/lanes.h"
#include "core/math/sampler.h"
#include "core/vpl/vpl.h"

#include <string.h>

#include "core/base/pool.h"
#include "core/light/emit.h"
#include "core/material/bsdf.h"
#include "core/material/ggx.h"
#include "core/medium/collide.h"
#include "core/scene/surface.h"
#include "core/trace/rays.h"
#include "core/trace/stale.h"
#include "core/vpl/walk.h"

/* Segments of a path between mirrors and glass, beyond those that end at a VPL; as deep as the eye's own branches. */
#define SPECULAR_MAX 10u

/* What a surface is taken to reflect where its colour must not matter; and the least that a VPL counts of its path's
 * first: what white rooms keep is not to hang on VPLs that are hardly ever drawn. */
#define ALBEDO_GUESS 0.7f
#define IMPORTANCE_FLOOR 0.02f

/* Lobes are at least this wide (alpha): a sharper one would show as a highlight of each of them. */
#define LOBE_LEAST 0.3f

/* What of its flux goes by a lobe of light from w, which arrives on the side of n. */
static void set_lobe(struct lum_vpl_set *set, uint32_t slot, struct lum_gloss_lobe l, struct lum_vec3 n,
                     struct lum_vec3 w, float gloss)
{
    float alpha = lum_max(l.alpha, LOBE_LEAST);
    struct lum_ggx_albedo e = lum_ggx_albedo(lum_ggx_row(alpha), lum_dot(n, w));
    float albedo = l.f0 * e.scale + l.f90 * e.bias;
    bool any = gloss > 0.0f && albedo > 0.0f;
    set->lobe[slot] = any ? gloss : 0.0f;
    set->wx[slot] = w.x, set->wy[slot] = w.y, set->wz[slot] = w.z;
    set->alpha[slot] = alpha;
    set->f0[slot] = any ? l.f0 / albedo : 0.0f;
    set->f90[slot] = any ? l.f90 / albedo : 0.0f;
}

/* n: to the side that it shines on. */
static bool leave_vpl(struct lum_vpl_walk *w, const struct lum_vpl_path *path, const struct lum_surface *s,
                      struct lum_vec3 n, struct lum_rgb albedo, uint32_t *ret_slot)
{
    float weight;
    uint32_t slot = lum_vpl_plan_slot(w->plan, path->share, path->number, path->bounce, &weight);
    if (slot == LUM_NO_OBJECT)
        return false;
    struct lum_rgb flux = lum_rgb_scale(lum_rgb_mul(path->flux, albedo), weight);
    if (lum_rgb_black(flux))
        return false;
    if (!lum_rgb_finite(flux) || !lum_v3_finite(s->p)) {
        w->counters->nonfinite++;
        return false;
    }
    struct lum_vpl_set *set = w->set;
    set->px[slot] = s->p.x, set->py[slot] = s->p.y, set->pz[slot] = s->p.z;
    set->nx[slot] = n.x, set->ny[slot] = n.y, set->nz[slot] = n.z;
    set->flux_unit[0][slot] = flux.r, set->flux_unit[1][slot] = flux.g, set->flux_unit[2][slot] = flux.b;
    set->importance[slot] = path->importance * fmaxf(path->left, IMPORTANCE_FLOOR) * weight;
    set->light[slot] = path->share; /* shares are in the order of the light table */
    set->object[slot] = s->instance;
    set->prim[slot] = s->prim;
    *ret_slot = slot;
    return true;
}

/* What of the lobes is left out. Light that comes straight from a lamp goes on by gloss all the same: as in path, where
 * that is direct light, and the effect glossy is what is seen by way of gloss. */
static uint32_t off_for(const struct lum_vpl_walk *w, const struct lum_vpl_path *path)
{
    return path->n_segments > 0 ? w->set->lobes_off : w->set->lobes_off & ~LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY);
}

/* False: the lobe is left out. Where gloss is, what is sampled of the base that it covers is of the base alone. */
static bool goes_on(uint32_t lobes_off, const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_bsdf_sample *inout)
{
    static const uint32_t effects[] = {
        [LUM_LOBE_DIFFUSE] = 0,
        [LUM_LOBE_DIFFUSE_TRANSMIT] = 0,
        [LUM_LOBE_GLOSSY] = LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY),
        [LUM_LOBE_REFLECT] = LUM_EFFECT_BIT(LUM_EFFECT_REFLECTION),
        [LUM_LOBE_TRANSMIT] = LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION),
        [LUM_LOBE_GLOSSY_TRANSMIT] = LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION),
    };
    if (lobes_off & effects[inout->lobe])
        return false;
    if (inout->lobe != LUM_LOBE_DIFFUSE || !lum_bsdf_has_gloss(b) || !(lobes_off & LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY)))
        return true;
    struct lum_bsdf_value f = lum_bsdf_eval_parts(b, wo, inout->wi);
    float pdf_sa = lum_bsdf_cosine_pdf(b, inout->wi);
    if (b->diffuse_prob == 1.0f && lum_rgb_black(f.gloss)) /* none is there: the same to the last bit */
        return true;
    if (!(pdf_sa > 0.0f))
        return false;
    inout->weight = lum_rgb_scale(f.diffuse, 1.0f / pdf_sa);
    return true;
}

/* Reflection that the lobe of the surface's own VPL does not have. */
static bool is_of_mirror(const struct lum_bsdf *b, struct lum_vec3 wo, enum lum_lobe lobe)
{
    bool rough_glass = lobe == LUM_LOBE_GLOSSY && b->glass > 0.0f && !(b->sheen.weight > 0.0f);
    return lobe == LUM_LOBE_REFLECT || (rough_glass && lum_rgb_black(lum_bsdf_gloss_albedo(b, wo)));
}

/* Where mirrors and glass send light into the open they leave a VPL, too, whose lobe is mirrored to where they send it:
 * what they focus is there in the mean, if not in its place. Without it the median of blocks of a first frame was .90
 * of that of `path` in CornellBox-Sphere, now .99, and the mean .973 and now .986 in interiors/office. What goes
 * straight on is no VPL's: rays of visibility go through panes, and frosted ones have their own; nor is what stays in a
 * solid. Nor what a lamp without extent sends straight to mirrors: no path of the reference finds that (caustic.h).
 * False: nobody needs the path any more. */
static bool leave_beam(struct lum_vpl_walk *w, struct lum_vpl_path *path, const struct lum_bsdf *b,
                       const struct lum_surface *s, struct lum_vec3 wo, const struct lum_bsdf_sample *bs)
{
    bool across = bs->lobe == LUM_LOBE_TRANSMIT || bs->lobe == LUM_LOBE_GLOSSY_TRANSMIT;
    if (!w->set->gloss || (across ? b->straight || b->thin : !is_of_mirror(b, wo, bs->lobe)))
        return true;
    bool solid = b->glass > 0.0f && !b->thin && !b->straight, inside = across != s->backface;
    if ((solid && inside) || !path->found)
        return true;
    struct lum_vec3 n = across ? lum_v3_neg(b->ng) : b->ng;
    struct lum_vec3 mirrored = lum_v3_sub(lum_v3_mul(n, 2.0f * lum_dot(n, bs->wi)), bs->wi);
    uint32_t slot;
    if (leave_vpl(w, path, s, n, lum_grey(1.0f), &slot))
        set_lobe(w->set, slot, (struct lum_gloss_lobe){LOBE_LEAST, 1.0f, 1.0f}, n, mirrored, 1.0f);
    return path->bounce++ != path->last;
}

/* Half of what surfaces outside send on is aimed at portals, where any face them: of what lies on the ground before a
 * window one path in dozens would come in by it, to light the ceiling for all of them. Rays by both ways weigh by both.
 * Mirrors and glass go their own way, and sheets. Of the lobe the second number says which way; the first picks the
 * lobe. False: nothing goes on. */
#define AIMED 0.5f

static bool may_aim(const struct lum_vpl_walk *w, const struct lum_bsdf *b, const struct lum_surface *s,
                    struct lum_vec3 wo, struct lum_portals_seen *ret_seen)
{
    struct lum_bsdf_sample delta[2];
    if (w->set->portals.n == 0 || b->glass > 0.0f || b->far_prob > 0.0f || lum_portals_inside(&w->set->portals, s->p) ||
        lum_bsdf_delta_lobes(b, wo, delta) > 0)
        return false;
    lum_portals_see(&w->set->portals, s->p, b->ng, ret_seen);
    return ret_seen->all > 0.0f;
}

static bool scatter_aimed(const struct lum_vpl_walk *w, struct lum_vpl_path *path, const struct lum_bsdf *b,
                          const struct lum_surface *s, struct lum_vec3 wo, const struct lum_portals_seen *seen,
                          struct lum_vec2 u, struct lum_vec2 lobe, struct lum_bsdf_sample *ret)
{
    const struct lum_portals *o = &w->set->portals;
    struct lum_portal_hit hit;
    if (lobe.y < AIMED ? !lum_portals_aim(o, seen, s->p, u, &ret->wi, &hit) : !lum_bsdf_sample(b, wo, u, lobe.x, ret))
        return false;
    float pdf_aimed = lum_portals_aim_pdf(o, seen, s->p, ret->wi);
    bool gloss = !(off_for(w, path) & LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY));
    struct lum_bsdf_value f = lum_bsdf_eval_parts(b, wo, ret->wi);
    float pdf_sa = AIMED * pdf_aimed + (1.0f - AIMED) * f.pdf_sa;
    float even = lum_max(lum_dot(ret->wi, b->ng), 0.0f) * LUM_INV_PI;
    if (!(even > 0.0f) || !(pdf_sa > 0.0f) || !isfinite(pdf_sa))
        return false;
    ret->pdf_sa = pdf_sa;
    ret->lobe = LUM_LOBE_DIFFUSE;
    ret->weight = lum_rgb_scale(gloss ? lum_rgb_add(f.diffuse, f.gloss) : f.diffuse, 1.0f / pdf_sa);
    path->importance *=
        even / (AIMED * pdf_aimed + (1.0f - AIMED) * even); /* as of a surface without gloss: no colour */
    return true;
}

/* Sends the path on; it is appended to the batch. */
static void scatter(struct lum_vpl_walk *w, struct lum_vpl_path path, const struct lum_bsdf *b,
                    const struct lum_surface *s, struct lum_vec3 wo)
{
    uint32_t pair = path.n_segments * PAIRS_PER_SEGMENT;
    struct lum_vec2 lobe = {0.5f, 0.5f};
    struct lum_portals_seen seen;
    bool aims = may_aim(w, b, s, wo, &seen);
    if (aims || b->diffuse_prob < 1.0f || b->far_prob > 0.0f) /* there is something to choose */
        lobe = lum_sampler_2d(&path.sampler, PAIR_LOBE + pair);
    struct lum_bsdf_sample bs;
    struct lum_vec2 u = lum_sampler_2d(&path.sampler, PAIR_BSDF + pair);
    if (aims ? !scatter_aimed(w, &path, b, s, wo, &seen, u, lobe, &bs)
             : !lum_bsdf_sample(b, wo, u, lobe.x, &bs) || !goes_on(off_for(w, &path), b, wo, &bs))
        return;
    bool transmitted = bs.lobe == LUM_LOBE_TRANSMIT || bs.lobe == LUM_LOBE_GLOSSY_TRANSMIT;
    float eta2 = transmitted && !b->thin && !b->straight ? b->eta * b->eta : 1.0f; /* is in radiance, and not in flux */
    path.flux = lum_rgb_scale(lum_rgb_mul(path.flux, bs.weight), 1.0f / eta2);
    if (lum_rgb_black(path.flux) || path.n_segments > path.last + SPECULAR_MAX)
        return;
    path.found |= bs.pdf_sa > 0.0f;
    if (!leave_beam(w, &path, b, s, wo, &bs))
        return;
    path.n_segments++;
    w->path[w->rays.n] = path;
    lum_rays_push(&w->rays, lum_ray_offset(s->p, lum_dot(bs.wi, b->ng) >= 0.0f ? b->ng : lum_v3_neg(b->ng)), bs.wi,
                  INFINITY);
}

/* What a VPL sends on: evenly, and by a lobe. */
struct sent {
    struct lum_rgb even, gloss;
};

static struct sent sent_back(const struct lum_vpl_walk *w, const struct lum_vpl_path *path, const struct lum_bsdf *b,
                             struct lum_vec3 wo)
{
    struct sent sent = {0};
    if (!lum_rgb_black(b->diffuse)) /* what metals scatter evenly is little, and not worth a slot */
        sent.even = lum_bsdf_diffuse_albedo(b);
    if (!w->set->gloss || (off_for(w, path) & LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY)))
        return sent;
    sent.gloss = lum_bsdf_gloss_albedo(b, wo);
    if (b->sheen.weight > 0.0f)
        sent.even = lum_rgb_add(sent.even, lum_bsdf_sheen_albedo(b, wo));
    return sent;
}

/* Sheets, and, where there are lobes, thin rough glass. */
static struct sent sent_through(const struct lum_vpl_walk *w, const struct lum_bsdf *b, struct lum_vec3 wo)
{
    struct sent sent = {0};
    if (w->set->lobes_off & LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION))
        return sent;
    if (w->set->gloss)
        sent.gloss = lum_bsdf_haze_albedo(b, wo, &sent.even);
    if (b->far_prob > 0.0f) {
        struct lum_bsdf far = lum_bsdf_far_side(b);
        sent.even = lum_rgb_add(sent.even, lum_bsdf_diffuse_albedo(&far));
    }
    return sent;
}

/* A slot holds one VPL: the one on this side or the one on the far side, in proportion to their luminance. False: there
 * is none. */
static bool leave_one(struct lum_vpl_walk *w, const struct lum_vpl_path *path, const struct lum_surface *s,
                      const struct lum_bsdf *b, struct lum_vec3 wo)
{
    struct sent back = sent_back(w, path, b, wo), through = sent_through(w, b, wo);
    struct lum_rgb up = lum_rgb_add(back.even, back.gloss), down = lum_rgb_add(through.even, through.gloss);
    float far = lum_luminance(down), both = far + lum_luminance(up);
    if (!(both > 0.0f))
        return false;
    uint32_t pair = PAIR_LOBE + path->n_segments * PAIRS_PER_SEGMENT, slot;
    /* How the path goes on takes the other coordinate. */
    bool crosses = far > 0.0f && lum_sampler_2d(&path->sampler, pair).y < far / both;
    struct lum_rgb albedo = crosses ? lum_rgb_scale(down, both / far) : up;
    if (!crosses && far > 0.0f)
        albedo = lum_rgb_scale(up, both / (both - far));
    struct lum_vec3 n = crosses ? lum_v3_neg(s->ng) : s->ng, w_lobe = wo;
    struct lum_gloss_lobe lobe = {b->alpha, 1.0f, 1.0f};
    if (crosses) /* facets of a sheet let light through as if they mirrored it to the other side */
        w_lobe = lum_v3_mad(wo, s->ng, -2.0f * lum_dot(wo, s->ng));
    else
        lobe = lum_bsdf_gloss_lobe(b, wo);
    if (leave_vpl(w, path, s, n, albedo, &slot))
        set_lobe(w->set, slot, lobe, n, w_lobe,
                 crosses ? lum_luminance(through.gloss) / far : lum_luminance(back.gloss) / lum_luminance(up));
    return true;
}

/* ---- fog ---- */

/* A VPL in fog sends light to all sides. It stands for them as one that faces to a side drawn at random: the mean over
 * the sides of a cosine is even. Where fog scatters forward the side is drawn forward, too, so that light goes on as
 * far in the mean as by the phase function, whose mean cosine is g: that of the side times 2/3, which is that of a
 * cosine lobe. */
static struct lum_vec3 side_in_fog(float g, struct lum_vec3 d, struct lum_vec2 u)
{
    float of_side = lum_clamp(1.5f * g, -LUM_MEDIUM_G_MAX, LUM_MEDIUM_G_MAX);
    return lum_phase_hg_sample(of_side, d, u);
}

/* Walks in fog go on as far as they have light, but from so many points on by chance: what is left of them counts more.
 * In a room that is a few mean free paths wide most end at a surface before. */
#define FOG_POINTS 16u
#define FOG_SURVIVAL 0.8f

/* The walk of a path through fog, from surface to surface, is one bounce and one VPL: half of the slots for each point
 * would leave next to none for what fog that absorbs little scatters the tenth time. False: nobody needs the path any
 * more. */
static bool leave_fog(struct lum_vpl_walk *w, struct lum_vpl_path *path)
{
    if (path->fog.n_points == 0)
        return true;
    struct lum_surface s = {.p = path->fog.p, .instance = LUM_NO_OBJECT};
    struct lum_rgb flux = path->flux;
    uint32_t slot;
    path->flux = path->fog.flux;
    if (leave_vpl(w, path, &s, path->fog.n, lum_grey(1.0f), &slot))
        set_lobe(w->set, slot, (struct lum_gloss_lobe){LOBE_LEAST, 1.0f, 1.0f}, path->fog.n, path->fog.wo, 0.0f);
    path->flux = flux;
    path->fog.n_points = 0;
    return path->bounce++ != path->last;
}

/* Fog of asymmetry g scatters at p light of direction d. */
static void add_point(struct lum_vpl_path *path, struct lum_vec3 p, float g, struct lum_vec3 d, struct lum_vec2 u_side,
                      float u)
{
    struct lum_rgb before = path->fog.n_points++ > 0 ? path->fog.flux : lum_grey(0.0f);
    path->fog.flux = lum_rgb_add(before, path->flux);
    if (!(u * lum_luminance(path->fog.flux) < lum_luminance(path->flux)))
        return;
    path->fog.p = p;
    path->fog.n = side_in_fog(g, d, u_side);
    path->fog.wo = lum_v3_neg(d);
}

/* Ray i of the batch is dimmed, or scattered, up to where it ends. True: it is scattered, and goes on from there. Where
 * that is does not depend on colours: paint moves no VPL. */
static bool cross_fog(struct lum_vpl_walk *w, struct lum_vpl_path *path, uint32_t i, struct lum_vec3 d)
{
    struct lum_vec3 o = {w->rays.ox[i], w->rays.oy[i], w->rays.oz[i]};
    float length = w->hits.object[i] == LUM_NO_OBJECT ? INFINITY : w->hits.t[i];
    if (path->fog.n_rays == 0 &&
        lum_light_is_from_afar(&w->snapshot->lights.lights[path->share])) /* to where it began */
        path->flux = lum_rgb_mul(path->flux, lum_media_transmittance(w->snapshot, o, lum_v3_neg(d), INFINITY));
    struct lum_collider c = {.pass = 1.0f};
    struct lum_collision hit;
    uint32_t pair = PAIR_FOG + path->fog.n_rays++ * PAIRS_PER_FOG;
    if (w->scatters && path->reaches == 0.0f)
        lum_collider_init(&c, w->snapshot, o, d, length, lum_grey(1.0f));
    if (c.on.n == 0 || !lum_collider_sample(&c, lum_sampler_2d(&path->sampler, pair), &hit)) {
        path->flux = lum_rgb_mul(path->flux, lum_media_transmittance(w->snapshot, o, d, length));
        path->flux = c.pass > 0.0f ? lum_rgb_scale(path->flux, 1.0f / c.pass) : lum_grey(0.0f);
        return false;
    }
    float g = w->snapshot->media[hit.medium].g;
    struct lum_vec3 p = lum_v3_mad(o, d, hit.t);
    struct lum_vec2 chance = lum_sampler_2d(&path->sampler, pair + 3);
    path->flux = lum_rgb_mul(path->flux, hit.weight);
    bool far = !lum_ray_can_start(p); /* nobody sees that */
    if (!far && !lum_rgb_black(path->flux))
        add_point(path, p, g, d, lum_sampler_2d(&path->sampler, pair + 1), chance.x);
    if (path->fog.n_points > FOG_POINTS)
        path->flux = lum_rgb_scale(path->flux, 1.0f / FOG_SURVIVAL);
    if (far || lum_rgb_black(path->flux) || (path->fog.n_points > FOG_POINTS && chance.y >= FOG_SURVIVAL)) {
        leave_fog(w, path);
        return true;
    }
    path->found = true;
    path->density = 0.0f; /* what fog has scattered comes from afar no more */
    w->path[w->rays.n] = *path;
    lum_rays_push(&w->rays, p, lum_phase_hg_sample(g, d, lum_sampler_2d(&path->sampler, pair + 2)), INFINITY);
    return true;
}

/* Ray i of the batch came back. What escapes, or meets an emitter's shape or an unlit surface, is gone. */
static void visit(struct lum_vpl_walk *w, uint32_t i)
{
    bool escapes = w->hits.object[i] == LUM_NO_OBJECT;
    if (escapes && !w->scatters)
        return;
    struct lum_vpl_path path = w->path[i];
    struct lum_vec3 d = lum_rays_direction(&w->rays, i), wo = lum_v3_neg(d);
    if (path.looks_out) {
        if (!escapes)
            lum_vpl_send_light(w, path, i, d);
        return;
    }
    if (path.reaches > 0.0f &&
        !(fabsf(w->hits.t[i] - path.reaches) <= LUM_VPL_SAME_PLACE)) /* something is in the way */
        return;
    if (w->media && (cross_fog(w, &path, i, d) || !leave_fog(w, &path)))
        return;
    if (escapes)
        return;
    struct lum_surface s;
    lum_snapshot_surface(w->snapshot, &w->hits, i, d, &s);
    if (s.instance == LUM_NO_OBJECT || w->snapshot->materials[s.material].unlit)
        return;
    if (path.density > 0.0f && path.n_segments == 0 && path.reaches == 0.0f && w->set->portals.n > 0)
        lum_vpl_weigh_by_looks(w, &path, &s, d);
    path.reaches = 0.0f;
    const struct lum_material *m = &w->snapshot->materials[s.material];
    if (s.backface)
        path.flux = lum_rgb_mul(path.flux, lum_material_transmittance(m, w->hits.t[i]));
    struct lum_bsdf b;
    lum_bsdf_init(&b, m, &s, wo);
    if (w->snapshot->has_sheets && !(w->set->lobes_off & LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION)))
        lum_bsdf_add_far_side(&b);
    if (leave_one(w, &path, &s, &b, wo)) {
        if (path.bounce++ == path.last)
            return;
        path.left *= ALBEDO_GUESS;
    }
    scatter(w, path, &b, &s, wo);
}

/* Path number `index` of all leaves its light. */
static void start(struct lum_vpl_walk *w, uint32_t index)
{
    struct lum_vpl_path path = {0};
    uint32_t salt;
    lum_vpl_plan_path(w->plan, index, &path.share, &path.number, &path.last, &salt);
    path.sampler = lum_sampler_at(salt, 0, path.number, w->plan->seed);
    struct lum_light_ray shot;
    struct lum_vec2 u = lum_sampler_2d(&path.sampler, PAIR_POSITION);
    if (lum_vpl_look_out(w, &path, &u))
        return;
    if (!lum_light_emit(w->snapshot, path.share, &w->set->portals, u, lum_sampler_2d(&path.sampler, PAIR_DIRECTION),
                        &shot))
        return;
    lum_vpl_set_off(w, &path, &shot);
    w->path[w->rays.n] = path;
    lum_rays_push(&w->rays, shot.o, shot.d, INFINITY);
}

static void walk_batch(struct lum_vpl_walk *w, uint32_t first, uint32_t n)
{
    w->rays.n = 0;
    for (uint32_t i = 0; i < n; i++)
        start(w, first + i);
    struct lum_trace trace = lum_trace_of(w->snapshot, w->counters);
    while (w->rays.n > 0) {
        uint32_t n_rays = w->rays.n;
        w->counters->rays[LUM_RAY_VPL] += lum_known_closest(w->known, &trace, &w->rays, &w->hits);
        w->rays.n = 0;
        for (uint32_t i = 0; i < n_rays; i++) { /* path i is read before a path j <= i is written */
            lum_snapshot_ask_ahead(w->snapshot, &w->hits, i, n_rays);
            visit(w, i);
        }
    }
}

/* ---- over the pool ---- */

struct jobs {
    void (*run)(void *ctx, uint32_t job, struct lum_counters *counters);
    void *ctx;
    struct lum_counters *counters; /* by worker */
};

static void run_job(void *ctx, uint32_t job, uint32_t worker)
{
    const struct jobs *jobs = ctx;
    jobs->run(jobs->ctx, job, &jobs->counters[worker]);
}

static void add_counters(struct lum_counters *sum, const struct lum_counters *c)
{
    sum->rays[LUM_RAY_VPL] += c->rays[LUM_RAY_VPL];
    sum->nonfinite += c->nonfinite;
    sum->bad_rays += c->bad_rays;
}

enum lum_status lum_vpl_run(const struct lum_vpl_request *rq, uint32_t n_jobs,
                            void (*run)(void *ctx, uint32_t job, struct lum_counters *counters), void *ctx,
                            struct lum_error *err)
{
    uint32_t n_workers = rq->pool && n_jobs > 1 ? lum_pool_size(rq->pool) : 1;
    struct lum_counters *counters = lum_calloc(n_workers, sizeof *counters);
    if (!counters)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the counters of %u workers", n_workers);
    struct jobs jobs = {run, ctx, counters};
    enum lum_status status = LUM_OK;
    if (n_workers > 1)
        status = lum_pool_run(rq->pool, n_jobs, run_job, &jobs, NULL);
    else
        for (uint32_t job = 0; job < n_jobs; job++)
            run_job(&jobs, job, 0);
    for (uint32_t i = 0; i < n_workers; i++)
        add_counters(rq->counters, &counters[i]);
    lum_free(counters);
    return status;
}

struct emission {
    const struct lum_vpl_request *request;
    const struct lum_vpl_plan *plan;
    struct lum_vpl_set *set;
};

static void emit_batch(void *ctx, uint32_t batch, struct lum_counters *counters)
{
    const struct emission *emission = ctx;
    struct lum_vpl_walk w;
    w.snapshot = emission->request->snapshot;
    w.known = &emission->request->known;
    w.plan = emission->plan;
    w.set = emission->set;
    w.counters = counters;
    w.media = emission->set->versions.medium != 0;
    w.scatters = w.media && emission->set->scatters;
    uint32_t first = batch * LUM_RAY_BATCH, left = w.plan->n_paths - first;
    walk_batch(&w, first, left < LUM_RAY_BATCH ? left : LUM_RAY_BATCH);
}

enum lum_status lum_vpl_emit(const struct lum_vpl_request *rq, const struct lum_vpl_plan *plan, struct lum_vpl_set *set,
                             struct lum_error *err)
{
    struct emission emission = {rq, plan, set};
    return lum_vpl_run(rq, (plan->n_paths + LUM_RAY_BATCH - 1) / LUM_RAY_BATCH, emit_batch, &emission, err);
}
