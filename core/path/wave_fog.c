/* Paths in fog (medium/medium.h, medium/collide.h).
 *
 * On each segment one point in each medium scatters the light of one light, at a distance that is drawn for it: by the
 * angle under which the light sees the segment, half the time, or the variance near a lamp would have no bound. A light
 * that a path meets after fog has scattered it is weighed against that point, by the densities of distance and
 * direction together. So no light is sampled from where a path is scattered.
 *
 * On segments that the eye sees, straight or by mirrors and clear glass, what shines or is lit at the end is always
 * looked at, dimmed; how the path goes on is a matter of chance: from the end, or from where fog scatters it. On others
 * the end, or the fog, is all that there is of a path. Without the effect `scattering` segments that the eye sees have
 * their points, others do not, and no path is scattered. */
#include "core/path/vertex.h"

#include "core/light/tree.h"
#include "core/math/warp.h"

/* Fog that only scatters ends no path by what it takes: from so many times on each time is the end of one in a hundred.
 * In a room that is 20 mean free paths wide nearly all have left its fog before (it takes them some hundred); in much
 * denser fog what is lit at the far side becomes noise that few samples tell. */
#define LONG_WALK 512u
#define LONG_WALK_SURVIVAL 0.99f

/* Light that medium m scatters into the segment. collider: NULL: the path is not scattered in it. */
static void queue_scatter(struct lum_wave *w, const struct lum_path *path, struct lum_scatter_query q, uint32_t depth,
                          const struct lum_collider *collider)
{
    uint32_t pair = LUM_PAIRS_PATH_MEDIA + (depth * LUM_MEDIA_MAX + q.medium) * LUM_WAVE_PAIRS_PER_MEDIUM;
    float pick = lum_sampler_1d(&path->sampler, pair), prob;
    q.light = lum_lights_pick(&q.snapshot->lights, &pick, &prob);
    if (q.light == LUM_NO_OBJECT)
        return;
    struct lum_vec2 u_light = {0.5f, 0.5f};
    if (!q.snapshot->lights.lights[q.light].delta)
        u_light = lum_sampler_2d(&path->sampler, pair + 2);
    struct lum_scatter s;
    if (!lum_medium_scatter(&q, lum_sampler_2d(&path->sampler, pair + 1), u_light, &s))
        return;
    float weight = 1.0f;
    if (collider && s.pdf > 0.0f) {
        float phase = lum_phase_hg(q.snapshot->media[q.medium].g, lum_dot(q.d, s.wi));
        weight = lum_power_heuristic(prob * s.pdf, lum_collider_pdf(collider, s.t, q.medium) * phase);
    }
    struct lum_rgb value = lum_rgb_mul(path->throughput, lum_rgb_scale(s.radiance, weight / prob));
    if (lum_rgb_black(value))
        return;
    if (w->shadow_rays.n == LUM_RAY_BATCH)
        lum_wave_trace_shadows(w);
    bool has_ray = lum_shadow_ray(&w->shadow_rays, s.p, lum_v3(0, 0, 0), s.wi, s.distance);
    enum lum_effect of = path->seen ? LUM_EFFECT_MEDIA : LUM_EFFECT_SCATTERING;
    lum_wave_keep_light(w, &(struct lum_gain){path->slot, q.light, value}, lum_effect_ray_kind(of),
                        lum_path_effect(path, of), has_ray);
}

float lum_wave_origin_pdf(const struct lum_wave *w, const struct lum_path *path, uint32_t light, float pdf_sa)
{
    const struct lum_path_origin *from = &path->from;
    struct lum_scatter_query q = {w->snapshot, from->medium, light, from->o, from->d, from->tmax};
    return pdf_sa * lum_medium_scatter_pdf(&q, from->t) * w->snapshot->lights.pick_pdf[light];
}

/* Is path i scattered, and what does it carry at the end if not. */
static void collide(struct lum_wave *w, uint32_t i, const struct lum_collider *c, uint32_t depth)
{
    struct lum_path *path = &w->path[i];
    struct lum_wave_fog *fog = &w->fog[i];
    *fog = (struct lum_wave_fog){.seen = path->seen, .pass = 1.0f, .throughput = path->throughput};
    struct lum_rgb left = lum_media_transmittance(w->snapshot, c->o, c->d, c->tmax);
    if (c->on.n > 0) {
        fog->pass = c->pass;
        struct lum_vec2 u = lum_sampler_2d(&path->sampler, LUM_PAIRS_PATH_COLLIDE + depth);
        fog->scatters = lum_collider_sample(c, u, &fog->hit);
        if (!path->seen)
            left = fog->pass > 0.0f ? lum_rgb_scale(left, 1.0f / fog->pass) : lum_grey(0.0f);
    }
    path->throughput = lum_rgb_mul(path->throughput, left);
}

void lum_wave_cross_media(struct lum_wave *w, uint32_t depth)
{
    for (uint32_t i = 0; i < w->rays.n; i++) {
        struct lum_path *path = &w->path[i];
        struct lum_scatter_query q = {
            .snapshot = w->snapshot,
            .o = lum_v3(w->rays.ox[i], w->rays.oy[i], w->rays.oz[i]),
            .d = lum_rays_direction(&w->rays, i),
            .tmax = w->hits.object[i] == LUM_NO_OBJECT ? INFINITY : w->hits.t[i],
        };
        path->seen = path->seen && !(path->pdf_sa > 0.0f);
        struct lum_collider c = {.on.n = 0};
        bool collides = w->in_fog && lum_path_depth(path, depth) < w->max_depth && w->snapshot->lights.n_active > 0 &&
                        !lum_rgb_black(path->throughput);
        if (collides)
            lum_collider_init(&c, q.snapshot, q.o, q.d, q.tmax, path->throughput);
        if (collides ? c.on.n > 0 : path->seen && depth < w->max_depth)
            for (q.medium = 0; q.medium < w->snapshot->n_media; q.medium++)
                queue_scatter(w, path, q, depth, collides ? &c : NULL);
        if (collides) {
            collide(w, i, &c, depth);
            continue;
        }
        w->fog[i] = (struct lum_wave_fog){.pass = 1.0f};
        path->throughput = lum_rgb_mul(path->throughput, lum_media_transmittance(w->snapshot, q.o, q.d, q.tmax));
    }
    lum_wave_trace_shadows(w);
}

/* Its own rounding must not take the path through the surface at the end of its segment. */
static float before_end(float t, float tmax)
{
    return lum_max(lum_min(t, tmax - LUM_RAY_OFFSET), lum_min(t, 0.5f * tmax));
}

void lum_wave_scatter_in_fog(struct lum_wave *w, uint32_t i, uint32_t depth)
{
    const struct lum_wave_fog *fog = &w->fog[i];
    struct lum_path path = w->path[i];
    struct lum_vec3 o = lum_v3(w->rays.ox[i], w->rays.oy[i], w->rays.oz[i]), d = lum_rays_direction(&w->rays, i);
    float tmax = w->hits.object[i] == LUM_NO_OBJECT ? INFINITY : w->hits.t[i];
    float g = w->snapshot->media[fog->hit.medium].g;
    struct lum_vec3 p = lum_v3_mad(o, d, before_end(fog->hit.t, tmax));
    if (!lum_ray_can_start(p))
        return; /* nobody sees that far */
    path.throughput = lum_rgb_mul(fog->throughput, fog->hit.weight);
    path.effect = lum_path_effect(&path, LUM_EFFECT_SCATTERING);
    path.n_scattered++;
    if (path.n_scattered >= LONG_WALK)
        path.roulette_scale /= LONG_WALK_SURVIVAL;
    if (lum_rgb_black(path.throughput) || !lum_wave_roulette(w, &path, depth))
        return;
    struct lum_vec3 wi =
        lum_phase_hg_sample(g, d, lum_sampler_2d(&path.sampler, lum_wave_pair(depth, LUM_WAVE_PAIR_BSDF)));
    path.p = p;
    path.pdf_sa = lum_phase_hg(g, lum_dot(d, wi));
    path.from = (struct lum_path_origin){o, d, tmax, fog->hit.t, fog->hit.medium, fog->seen, fog->hit.pdf};
    path.every_light = path.plain = false;
    path.direct_apart = false;
    path.indirect = path.was_indirect = true; /* its lights are no surface's direct light */
    w->counters->rays[LUM_RAY_SCATTERING]++;
    w->path[w->rays.n] = path;
    lum_rays_push(&w->rays, p, wi, INFINITY);
}
