/* A whole scene, in the order of what is referred to. */
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "server/export/internal.h"

/* ---- records ---- */

static int compare(const void *a, const void *b)
{
    const struct lum_record *p = ((const struct lum_export_entry *)a)->record,
                            *q = ((const struct lum_export_entry *)b)->record;
    return p->type != q->type ? (p->type < q->type ? -1 : 1) : strcmp(p->id, q->id);
}

struct lum_export_entry *lum_export_find(struct lum_exporting *x, enum lum_record_type type, const char *id)
{
    size_t lo = 0, hi = x->n;
    while (lo < hi) {
        size_t mid = lo + (hi - lo) / 2;
        const struct lum_record *r = x->entries[mid].record;
        int order = r->type != type ? (r->type < type ? -1 : 1) : strcmp(r->id, id);
        if (order == 0)
            return &x->entries[mid];
        lo = order < 0 ? mid + 1 : lo;
        hi = order < 0 ? hi : mid;
    }
    return NULL;
}

void lum_export_bytes(struct lum_exporting *x, struct cJSON *o, const char *key, const void *bytes, size_t n,
                      unsigned bits)
{
    cJSON *in = cJSON_CreateObject();
    bool ok =
        lum_json_add_number(in, bits == 64 ? "bufferView64" : "bufferView", lum_glb_bytes(x->glb, bytes, n, NULL));
    if (!lum_json_add(o, key, in) || !ok)
        lum_glb_fail_memory(x->glb);
}

/* The web of a light as its arrays are: text would round them, and has no word for webs that are dark beyond an angle.
 */
static bool add_web(struct lum_exporting *x, cJSON *record, const struct lum_record_web *w)
{
    cJSON *o = cJSON_CreateObject();
    bool ok = (!w->name[0] || lum_json_add_string(o, "name", w->name)) && lum_json_add_string(o, "type", w->type) &&
              lum_json_add_string(o, "opening", w->opening) &&
              lum_json_add(o, "size", cJSON_CreateDoubleArray(w->size, 3)) &&
              (!w->rated_lm.set || lum_json_add_number(o, "rated_lm", w->rated_lm.value)) &&
              (!w->watts.set || lum_json_add_number(o, "watts", w->watts.value));
    if (ok) {
        lum_export_bytes(x, o, "c_deg", w->c_deg.f32, w->c_deg.n * sizeof(float), 32);
        lum_export_bytes(x, o, "gamma_deg", w->gamma_deg.f32, w->gamma_deg.n * sizeof(float), 32);
        lum_export_bytes(x, o, "candela", w->candela.f32, w->candela.n * sizeof(float), 32);
    }
    return lum_json_add(record, "web", o) && ok;
}

static cJSON *record_json(struct lum_exporting *x, const struct lum_record *r)
{
    struct lum_record *bare = NULL;
    const struct lum_record *written = r;
    if (r->type == LUM_RECORD_LIGHT && r->light.web) {
        written = bare = lum_record_clone(r);
        if (!bare)
            return NULL;
        lum_record_web_unref(bare->light.web);
        bare->light.web = NULL;
        bare->light.asset[0] = '\0';
    }
    cJSON *o = lum_record_to_json(written, false);
    cJSON_DeleteItemFromObjectCaseSensitive(o, "op");
    bool ok = o && (!bare || add_web(x, o, r->light.web));
    lum_record_unref(bare);
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

struct cJSON *lum_export_extras(struct lum_exporting *x, struct cJSON *o, const struct lum_record *r)
{
    cJSON *extras = cJSON_CreateObject(), *ours = cJSON_CreateObject();
    bool ok = lum_json_add(ours, "record", record_json(x, r));
    ok = lum_json_add(extras, "lumend", ours) && ok;
    if (lum_json_add(o, "extras", extras) && ok)
        return ours;
    lum_glb_fail_memory(x->glb);
    return NULL;
}

/* ---- the scene ---- */

/* The camera of the first view comes first: where nothing says more, that is who looks. */
static void export_cameras(struct lum_exporting *x)
{
    const struct lum_export_entry *render = lum_export_find(x, LUM_RECORD_RENDER, "render");
    const char *name = render && render->record->render.camera[0] ? render->record->render.camera : "main";
    const struct lum_export_entry *first = lum_export_find(x, LUM_RECORD_CAMERA, name);
    if (first)
        lum_export_camera(x, first->record);
    for (size_t i = 0; i < x->n; i++)
        if (x->entries[i].record->type == LUM_RECORD_CAMERA && &x->entries[i] != first)
            lum_export_camera(x, x->entries[i].record);
}

static void export_one(struct lum_exporting *x, struct lum_export_entry *e)
{
    switch (e->record->type) {
    case LUM_RECORD_MATERIAL:
        (void)lum_export_material(x, e);
        break;
    case LUM_RECORD_OBJECT:
        lum_export_object(x, e->record);
        break;
    case LUM_RECORD_LIGHT:
        lum_export_light(x, e->record);
        break;
    case LUM_RECORD_MEDIUM:
    case LUM_RECORD_SENSOR:
    case LUM_RECORD_PATCH:
    case LUM_RECORD_PRESET:
        lum_export_loose(x, e->record);
        break;
    default: /* meshes and images with what uses them; imports are what they brought */
        break;
    }
}

/* {"lumend":{"version":1,"records":[..],"settings":{..}}} */
static cJSON *scene_extras(struct lum_exporting *x)
{
    const struct lum_export_entry *render = lum_export_find(x, LUM_RECORD_RENDER, "render");
    cJSON *extras = cJSON_CreateObject(), *ours = cJSON_CreateObject(),
          *set = render ? lum_record_to_json(render->record, false) : NULL, *records = x->records;
    cJSON *settings = render ? cJSON_DetachItemFromObjectCaseSensitive(set, "value") : cJSON_CreateObject();
    cJSON_Delete(set);
    bool ok = lum_json_add_number(ours, "version", 1);
    x->records = NULL;
    ok = lum_json_add(ours, "records", records) && ok;
    ok = lum_json_add(ours, "settings", settings) && ok;
    ok = lum_json_add(extras, "lumend", ours) && ok;
    if (ok)
        return extras;
    cJSON_Delete(extras);
    return NULL;
}

static bool cancelled(const struct lum_exporting *x, const _Atomic bool *cancel)
{
    if (!cancel || !atomic_load_explicit(cancel, memory_order_relaxed))
        return !lum_glb_ok(x->glb);
    struct lum_error err;
    (void)lum_fail(&err, LUM_ERR_CANCELLED, "", "the export was stopped");
    lum_glb_fail(x->glb, &err);
    return true;
}

static enum lum_status export_all(struct lum_exporting *x, const _Atomic bool *cancel, struct lum_error *err)
{
    export_cameras(x);
    for (size_t i = 0; i < x->n && !cancelled(x, cancel); i++)
        export_one(x, &x->entries[i]);
    cJSON *extras = lum_glb_ok(x->glb) ? scene_extras(x) : NULL;
    if (!extras)
        lum_glb_fail_memory(x->glb);
    return lum_glb_finish(x->glb, extras, err);
}

static void finish(struct lum_exporting *x)
{
    for (size_t i = 0; x->entries && i < x->n; i++) {
        struct lum_export_entry *e = &x->entries[i];
        for (struct lum_export_pair *p = e->pairs, *next; p; p = next) {
            next = p->next;
            lum_free(p);
        }
        for (struct lum_export_variant *v = e->variants, *next; v; v = next) {
            next = v->next;
            lum_free(v);
        }
        cJSON_Delete(e->exact);
    }
    cJSON_Delete(x->records);
    lum_web_unref(x->web);
    free(x->ies);
    lum_free(x->entries);
}

enum lum_status lum_export_scene(const struct lum_export_source *source, struct lum_glb **ret_glb,
                                 struct lum_error *err)
{
    struct lum_exporting x = {.n = source->n, .glb = lum_glb_create(source->max_bytes)};
    enum lum_status status = LUM_ERR_NOMEM;
    memset(x.samplers, 0xff, sizeof x.samplers);
    x.entries = lum_calloc(source->n, sizeof *x.entries);
    x.records = cJSON_CreateArray();
    if (!x.glb || !x.entries || !x.records) {
        (void)lum_fail(err, status, "", "no memory for the glTF file");
        goto out;
    }
    for (size_t i = 0; i < source->n; i++)
        x.entries[i] = (struct lum_export_entry){.record = source->records[i], .index = LUM_EXPORT_NONE};
    qsort(x.entries, x.n, sizeof *x.entries, compare);
    status = export_all(&x, source->cancel, err);
out:
    if (status)
        lum_glb_destroy(x.glb);
    else
        *ret_glb = x.glb;
    finish(&x);
    return status;
}
