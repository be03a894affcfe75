#include "server/world/photometry.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "core/measure/ugr_table.h"
#include "protocol/json/json.h"
#include "server/base/web_desc.h"

#define POLAR_STEP_DEG 5 /* fine enough for a small drawing: 37 values each way */
#define POLAR_ANGLES (180 / POLAR_STEP_DEG + 1)

static bool add_polar(cJSON *o, const struct lum_web *web)
{
    static const char *const names[4] = {"c0", "c90", "c180", "c270"};
    cJSON *polar = cJSON_CreateObject();
    double v[POLAR_ANGLES];
    for (int k = 0; k < POLAR_ANGLES; k++)
        v[k] = POLAR_STEP_DEG * k;
    bool ok = polar && lum_json_add(polar, "gamma_deg", cJSON_CreateDoubleArray(v, POLAR_ANGLES));
    for (int i = 0; i < 4 && ok; i++) {
        for (int k = 0; k < POLAR_ANGLES; k++)
            v[k] = lum_web_polar_cd(web, 90.0 * i, POLAR_STEP_DEG * k);
        ok = lum_json_add(polar, names[i], cJSON_CreateDoubleArray(v, POLAR_ANGLES));
    }
    if (ok)
        return lum_json_add(o, "polar_cd", polar);
    cJSON_Delete(polar);
    return false;
}

/* ---- glare ---- */

static bool has_opening(const struct lum_record_web *file)
{
    return strcmp(file->opening, "point") != 0 && file->size[0] > 0.0 && file->size[1] > 0.0;
}

static struct lum_ugr_luminaire luminaire_of(const struct lum_record_web *file, const struct lum_web *web)
{
    bool sphere = strcmp(file->opening, "sphere") == 0;
    return (struct lum_ugr_luminaire){.web = web,
                                      .round = sphere || strcmp(file->opening, "disc") == 0,
                                      .sphere = sphere,
                                      .size_m = {file->size[0], file->size[1], file->size[2]}};
}

/* In the room that luminaires are compared by. */
static bool add_glare(cJSON *o, const struct lum_record_web *file, const struct lum_web *web)
{
    struct lum_ugr_luminaire l = luminaire_of(file, web);
    struct lum_ugr_cells cells;
    if (!has_opening(file))
        return true;
    lum_ugr_room_of(&l, LUM_UGR_4H_8H, LUM_UGR_SPACING_H, &cells);
    double ugr[LUM_UGR_VIEWS] = {cells.ugr[LUM_UGR_CROSSWISE][0], cells.ugr[LUM_UGR_ENDWISE][0]};
    return !isfinite(ugr[0]) || !isfinite(ugr[1]) ||
           lum_json_add(o, "ugr", cJSON_CreateDoubleArray(ugr, LUM_UGR_VIEWS));
}

static bool add_numbers(cJSON *o, const char *name, const double *v, uint32_t n)
{
    cJSON *list = cJSON_CreateArray();
    bool ok = list != NULL;
    for (uint32_t i = 0; i < n && ok; i++)
        ok = lum_json_add(list, NULL, isfinite(v[i]) ? cJSON_CreateNumber(v[i]) : cJSON_CreateNull());
    if (ok)
        return lum_json_add(o, name, list);
    cJSON_Delete(list);
    return false;
}

static bool add_room(cJSON *rooms, const struct lum_ugr_luminaire *l, uint32_t i)
{
    struct lum_ugr_cells cells;
    lum_ugr_room_of(l, i, LUM_UGR_SPACING_H, &cells);
    cJSON *room = cJSON_CreateObject();
    const double size[2] = {lum_ugr_rooms[i].x_h, lum_ugr_rooms[i].y_h};
    return lum_json_add(rooms, NULL, room) && lum_json_add(room, "size_h", cJSON_CreateDoubleArray(size, 2)) &&
           add_numbers(room, "crosswise", cells.ugr[LUM_UGR_CROSSWISE], LUM_UGR_PAINTS) &&
           add_numbers(room, "endwise", cells.ugr[LUM_UGR_ENDWISE], LUM_UGR_PAINTS);
}

static bool add_rooms(cJSON *o, const struct lum_ugr_luminaire *l)
{
    cJSON *paints = cJSON_CreateArray(), *rooms = cJSON_CreateArray();
    bool ok = lum_json_add(o, "reflectances", paints);
    ok = lum_json_add(o, "rooms", rooms) && ok && lum_json_add_number(o, "spacing_h", LUM_UGR_SPACING_H);
    for (uint32_t i = 0; i < LUM_UGR_PAINTS && ok; i++) {
        const struct lum_ugr_paint *p = &lum_ugr_paints[i];
        ok = lum_json_add(paints, NULL, cJSON_CreateDoubleArray((double[]){p->ceiling, p->walls, p->floor}, 3));
    }
    for (uint32_t i = 0; i < LUM_UGR_ROOMS && ok; i++)
        ok = add_room(rooms, l, i);
    return ok;
}

struct cJSON *lum_photometry_ugr(const struct lum_record_web *file)
{
    struct lum_web_desc desc = lum_web_desc_of(file);
    struct lum_web *web = NULL;
    if (lum_web_create(&desc, &web, NULL))
        return NULL;
    struct lum_ugr_luminaire l = luminaire_of(file, web);
    cJSON *o = cJSON_CreateObject();
    bool ok = o && (!has_opening(file) || add_rooms(o, &l));
    lum_web_unref(web);
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

/* ---- all else ---- */

static bool add_facts(cJSON *o, const struct lum_record_web *file, const struct lum_web_facts *f)
{
    bool ok = lum_json_add_number(o, "flux_lm", f->flux_lm);
    if (file->name[0])
        ok = ok && lum_json_add_string(o, "name", file->name);
    if (file->rated_lm.set)
        ok = ok && lum_json_add_number(o, "rated_lm", file->rated_lm.value);
    if (file->watts.set && file->watts.value > 0.0)
        ok = ok && lum_json_add_number(o, "watts", file->watts.value) &&
             lum_json_add_number(o, "lm_per_w", f->flux_lm / file->watts.value);
    return ok && lum_json_add_number(o, "up", f->up) && lum_json_add_number(o, "peak_cd", f->peak_cd) &&
           lum_json_add_number(o, "peak_c_deg", f->peak_c_deg) &&
           lum_json_add_number(o, "peak_gamma_deg", f->peak_gamma_deg) &&
           lum_json_add(o, "beam_deg", cJSON_CreateDoubleArray(f->beam_deg, 2)) &&
           lum_json_add(o, "field_deg", cJSON_CreateDoubleArray(f->field_deg, 2)) &&
           lum_json_add_string(o, "symmetry", lum_web_symmetry_names[f->symmetry]) &&
           lum_json_add_string(o, "type", file->type) && lum_json_add_string(o, "opening", file->opening) &&
           lum_json_add(o, "size", cJSON_CreateDoubleArray(file->size, 3)) &&
           lum_json_add_number(o, "planes", (double)file->c_deg.n) &&
           lum_json_add_number(o, "angles", (double)file->gamma_deg.n);
}

struct cJSON *lum_photometry_describe(const struct lum_record_web *file, bool polar, bool ugr)
{
    struct lum_web_desc desc = lum_web_desc_of(file);
    struct lum_web *web = NULL;
    struct lum_web_facts facts;
    if (lum_web_create(&desc, &web, NULL))
        return NULL;
    cJSON *o = cJSON_CreateObject();
    lum_web_facts(web, &facts);
    bool ok = o && add_facts(o, file, &facts) && (!ugr || add_glare(o, file, web)) && (!polar || add_polar(o, web));
    lum_web_unref(web);
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

bool lum_photometry_describe_lights(const struct lum_document *doc, struct cJSON *ops)
{
    const struct lum_record_web *last = NULL; /* lamps of one file often follow each other: it is described once */
    cJSON *op, *described = NULL;
    bool ok = true;
    cJSON_ArrayForEach(op, ops)
    {
        const char *id = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(op, "id"));
        const struct lum_record *r = id ? lum_document_find(doc, id) : NULL;
        if (!ok || !r || r->type != LUM_RECORD_LIGHT || !r->light.web ||
            !cJSON_HasObjectItem(op, "type")) /* a set has none */
            continue;
        if (r->light.web != last) {
            cJSON_Delete(described);
            described = lum_photometry_describe(r->light.web, false, false);
            last = r->light.web;
        }
        ok = described && lum_json_add(op, "photometry", cJSON_Duplicate(described, true));
    }
    cJSON_Delete(described);
    return ok;
}
