/* Skies: what one is depends on the scene's sun. */
#include "core/light/cie_sky.h"
#include "core/light/environment.h"
#include "core/light/solar.h"
#include "core/math/vec3d.h"
#include "core/scene/light_kind.h"
#include "core/scene/parts.h"
#include "core/scene/tables.h"

/* Unit vector to where the sun stands; the first by id. */
static struct lum_vec3d sun_of(const struct lum_table *lights)
{
    for (uint32_t i = 0; i < lights->n; i++) {
        const struct lum_light_desc *d = &((const struct lum_light_entry *)lights->rows[i])->desc;
        double length = lum_v3d_length(d->direction);
        if (d->kind == &lum_light_kind_sun)
            return (struct lum_vec3d){-d->direction.x / length, -d->direction.y / length, -d->direction.z / length};
    }
    return (struct lum_vec3d){0.0, sqrt(0.5), sqrt(0.5)};
}

/* The part of the snapshot before that is of the same sky; NULL: none. */
static struct lum_env_part *find_previous(const struct lum_light_part *previous, const struct lum_cie_sky *sky)
{
    for (uint32_t i = 0; previous && i < previous->n; i++)
        if (previous->items[i].env_hash == sky->hash)
            return lum_env_part_ref(previous->envs[i]);
    return NULL;
}

static struct lum_env_part *part_of(const struct lum_light_part *previous, const struct lum_cie_sky *sky)
{
    struct lum_env_part *env = find_previous(previous, sky);
    if (env)
        return env;
    env = lum_calloc(1, sizeof *env);
    if (!env)
        return NULL;
    lum_refs_init(&env->refs);
    env->map = lum_env_map_create_sky(sky);
    if (env->map)
        return env;
    lum_env_part_unref(env);
    return NULL;
}

static double zenith_of(const struct lum_light_desc *d, const struct lum_cie_sky *sky, double sun_elevation_rad)
{
    double zenith = d->intensity;
    if (d->sky_amount == LUM_SKY_HORIZONTAL)
        zenith = d->intensity / sky->horizontal;
    if (d->sky_amount == LUM_SKY_BY_SUN)
        zenith = lum_sky_illuminance(d->cie_type, sun_elevation_rad) / sky->horizontal;
    return fmin(zenith, LUM_POWER_MAX);
}

enum lum_status lum_sky_resolve(const struct lum_light_input *in, const struct lum_light_desc *d, struct lum_light *l,
                                struct lum_env_part **ret_env, struct lum_error *err)
{
    struct lum_vec3d sun = sun_of(&in->scene->tables[LUM_ENTITY_LIGHT]);
    double across = hypot(sun.x, sun.z), elevation = atan2(sun.y, across);
    struct lum_cie_sky sky = lum_cie_sky_make(d->cie_type, elevation, d->ground_albedo);
    *ret_env = part_of(in->previous, &sky);
    if (!*ret_env)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the sky \"%s\"", l->id);
    l->env = (*ret_env)->map;
    l->env_hash = sky.hash;
    float x = across > 0.0 ? (float)(sun.x / across) : 1.0f, z = across > 0.0 ? (float)(sun.z / across) : 0.0f;
    l->frame = (struct lum_frame){{x, 0.0f, z}, {0.0f, 1.0f, 0.0f}, {-z, 0.0f, x}};
    l->power = lum_rgb_scale(d->color, (float)zenith_of(d, &sky, elevation));
    return LUM_OK;
}
