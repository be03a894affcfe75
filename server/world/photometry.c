#include "server/world/photometry.h"

#include <string.h>

#include <cjson/cJSON.h>

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

struct cJSON *lum_photometry_describe(const struct lum_record_web *file, bool polar)
{
    struct lum_web_desc desc = lum_web_desc_of(file);
    struct lum_web *web = NULL;
    struct lum_web_facts facts;
    if (lum_web_create(&desc, &web, NULL))
        return NULL;
    cJSON *o = cJSON_CreateObject();
    lum_web_facts(web, &facts);
    bool ok = o && add_facts(o, file, &facts) && (!polar || add_polar(o, web));
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
            described = lum_photometry_describe(r->light.web, false);
            last = r->light.web;
        }
        ok = described && lum_json_add(op, "photometry", cJSON_Duplicate(described, true));
    }
    cJSON_Delete(described);
    return ok;
}
