#include "server/world/luminaires.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

static bool same_triple(const double a[3], const double b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

static void triples(const struct lum_luminaire *l, double ret_color[3], double ret_centre[3])
{
    const double color[3] = {(double)l->color.r, (double)l->color.g, (double)l->color.b};
    const double centre[3] = {l->centre.x, l->centre.y, l->centre.z};
    memcpy(ret_color, color, sizeof color);
    memcpy(ret_centre, centre, sizeof centre);
}

/* The members in which it is not as it was; was NULL: all. */
static cJSON *difference(const struct lum_luminaire *was, const struct lum_luminaire *now)
{
    double color[2][3] = {{0}}, centre[2][3] = {{0}};
    triples(now, color[0], centre[0]);
    if (was)
        triples(was, color[1], centre[1]);
    cJSON *o = cJSON_CreateObject();
    bool ok = o != NULL;
    if (!was || was->flux_lm != now->flux_lm)
        ok = ok && lum_json_add_number(o, "flux_lm", now->flux_lm);
    if (!was || was->material_flux_lm != now->material_flux_lm)
        ok = ok && lum_json_add_number(o, "material_flux_lm", now->material_flux_lm);
    if (!was || was->luminance_cd_m2 != now->luminance_cd_m2)
        ok = ok && lum_json_add_number(o, "luminance_cd_m2", now->luminance_cd_m2);
    if (!was || was->area_m2 != now->area_m2)
        ok = ok && lum_json_add_number(o, "area_m2", now->area_m2);
    if (!was || !same_triple(color[0], color[1]))
        ok = ok && lum_json_add(o, "color", cJSON_CreateDoubleArray(color[0], 3));
    if (!was || !same_triple(centre[0], centre[1]))
        ok = ok && lum_json_add(o, "centre", cJSON_CreateDoubleArray(centre[0], 3));
    if (!was || was->both_sides != now->both_sides)
        ok = ok && lum_json_add_string(o, "sides", now->both_sides ? "both" : "front");
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

/* Number of the first luminaire in the table of lights: those that are records of their own come before. */
static uint32_t first_of(const struct lum_snapshot *s)
{
    uint32_t i = 0;
    while (s && i < s->lights.n_lights && s->lights.lights[i].kind != &lum_emitter_mesh)
        i++;
    return i;
}

bool lum_luminaire_describe(const struct lum_snapshot *s, const char *id, struct cJSON **ret_emits)
{
    struct lum_luminaire l;
    uint32_t lo = first_of(s), hi = s->lights.n_lights; /* sorted by id */
    *ret_emits = NULL;
    while (lo < hi) {
        uint32_t middle = lo + (hi - lo) / 2;
        if (strcmp(s->lights.lights[middle].id, id) < 0)
            lo = middle + 1;
        else
            hi = middle;
    }
    if (lo == s->lights.n_lights || strcmp(s->lights.lights[lo].id, id) != 0 || !lum_snapshot_luminaire(s, lo, &l))
        return true;
    *ret_emits = difference(NULL, &l);
    return *ret_emits != NULL;
}

/* Adds what became of the luminaire of this id; either may be NULL. */
static bool add_change(cJSON *changes, const struct lum_luminaire *was, const struct lum_luminaire *now)
{
    if (!now)
        return lum_json_add(changes, was->id, cJSON_CreateNull());
    cJSON *o = difference(was, now);
    if (o && !o->child) {
        cJSON_Delete(o);
        return true;
    }
    return lum_json_add(changes, now->id, o);
}

struct cJSON *lum_luminaires_changes(const struct lum_snapshot *was, const struct lum_snapshot *now)
{
    cJSON *changes = cJSON_CreateObject();
    uint32_t n_was = was ? was->lights.n_lights : 0, n_now = now->lights.n_lights;
    bool ok = changes != NULL, shared = was && was->lights.lights == now->lights.lights;
    for (uint32_t i = first_of(was), j = first_of(now); ok && !shared && (i < n_was || j < n_now);) {
        struct lum_luminaire a, b;
        bool has_a = i < n_was && lum_snapshot_luminaire(was, i, &a);
        bool has_b = j < n_now && lum_snapshot_luminaire(now, j, &b);
        int order = !has_a ? 1 : !has_b ? -1 : strcmp(a.id, b.id);
        ok = add_change(changes, order <= 0 ? &a : NULL, order >= 0 ? &b : NULL);
        i += order <= 0;
        j += order >= 0;
    }
    if (ok && changes->child)
        return changes;
    cJSON_Delete(changes);
    return NULL;
}
