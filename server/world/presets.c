#include "server/world/presets.h"

#include <math.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/record/field.h"
#include "server/world/light_groups.h"

static cJSON *op_of(const char *kind, const char *id)
{
    cJSON *op = cJSON_CreateObject();
    if (lum_json_add_string(op, "op", kind) && lum_json_add_string(op, "id", id))
        return op;
    cJSON_Delete(op);
    return NULL;
}

/* value passes over. */
static bool add_set(cJSON *ops, const char *id, cJSON *value)
{
    cJSON *op = op_of("set", id);
    bool ok = lum_json_add_string(op, "path", "");
    ok = lum_json_add(op, "value", value) && ok;
    return lum_json_add(ops, NULL, op) && ok;
}

/* ---- store ---- */

struct storing {
    const struct lum_document *doc;
    cJSON *lamps;
    double last_order;
    bool failed;
};

static void store_one(void *user, const struct lum_record *r)
{
    struct storing *s = user;
    if (r->type == LUM_RECORD_PRESET)
        s->last_order = fmax(s->last_order, r->preset.order);
    if (s->failed || !lum_record_is_lamp(s->doc, r))
        return;
    const struct lum_fields *t = lum_fields_of(r->type);
    bool by_temperature = r->type == LUM_RECORD_LIGHT ? r->light.cct_k.set : r->object.cct_k.set;
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add(s->lamps, NULL, o) && lum_json_add_string(o, "id", r->id);
    for (size_t i = 0; i < lum_lamp_fields.n && ok; i++) {
        const struct lum_field *f = lum_fields_find(t, lum_lamp_fields.fields[i].name);
        if (f && !lum_field_is_null(f, lum_record_body(r)) && !(by_temperature && f->kind == LUM_FIELD_VECTOR))
            ok = lum_json_add(o, f->name, lum_field_write(f, lum_record_body(r)));
    }
    s->failed = !ok;
}

struct cJSON *lum_preset_store_op(const struct lum_document *doc, const char *id, const char *name,
                                  struct lum_opt fade_s)
{
    const struct lum_record *there = lum_document_find(doc, id);
    bool update = there && there->type == LUM_RECORD_PRESET;
    struct storing s = {.doc = doc, .lamps = cJSON_CreateArray()};
    cJSON *op = op_of(update ? "set" : "add", id), *value = update ? cJSON_CreateObject() : op;
    bool ok = s.lamps && lum_document_each(doc, store_one, &s) && !s.failed;
    if (ok && update)
        ok = lum_json_add_string(op, "path", "");
    else if (ok)
        ok = lum_json_add_string(op, "type", "preset") && lum_json_add_number(op, "order", s.last_order + 1.0);
    if (ok && name[0])
        ok = lum_json_add_string(value, "name", name);
    if (ok && fade_s.set)
        ok = lum_json_add_number(value, "fade_s", fade_s.value);
    ok = lum_json_add(value, "lamps", s.lamps) && ok;
    if (update)
        ok = lum_json_add(op, "value", value) && ok;
    if (ok)
        return op;
    cJSON_Delete(op);
    return NULL;
}

/* ---- recall ---- */

static bool has_group(const struct lum_lamp *lamp, enum lum_field_group group)
{
    for (size_t i = 0; i < lum_lamp_fields.n; i++)
        if (lum_lamp_fields.fields[i].group == group && !lum_field_is_null(&lum_lamp_fields.fields[i], lamp))
            return true;
    return false;
}

/* What the lamp has of each group; where it has nothing of one, what stands for nothing in such a record. */
static cJSON *value_of(const struct lum_lamp *lamp, enum lum_record_type type)
{
    cJSON *value = cJSON_CreateObject();
    bool ok = value != NULL;
    for (size_t i = 0; i < lum_lamp_fields.n && ok; i++) {
        const struct lum_field *f = &lum_lamp_fields.fields[i];
        bool given = !lum_field_is_null(f, lamp), known = lum_fields_find(lum_fields_of(type), f->name) != NULL;
        if (f->kind == LUM_FIELD_ID || (!given && (!known || has_group(lamp, f->group))))
            continue;
        const double white[3] = {1.0, 1.0, 1.0};
        bool needs_color = !given && f->kind == LUM_FIELD_VECTOR && type == LUM_RECORD_LIGHT;
        ok = lum_json_add(value, f->name, needs_color ? cJSON_CreateDoubleArray(white, 3) : lum_field_write(f, lamp));
    }
    if (ok)
        return value;
    cJSON_Delete(value);
    return NULL;
}

static bool takes(const struct lum_record *r, const cJSON *value)
{
    struct lum_record *trial = lum_record_clone(r);
    struct lum_proto_error why;
    bool ok = trial && lum_record_set(trial, "", value, &why);
    lum_record_unref(trial);
    return ok;
}

struct cJSON *lum_preset_recall_ops(const struct lum_document *doc, const struct lum_record_preset *preset,
                                    struct cJSON *left_out)
{
    cJSON *ops = cJSON_CreateArray();
    bool ok = ops != NULL;
    for (size_t i = 0; i < preset->lamps.n && ok; i++) {
        const struct lum_lamp *lamp = &preset->lamps.items[i];
        const struct lum_record *r = lum_document_find(doc, lamp->id);
        bool may = r && (r->type == LUM_RECORD_LIGHT || r->type == LUM_RECORD_OBJECT);
        cJSON *value = may ? value_of(lamp, r->type) : NULL;
        if (value && takes(r, value)) {
            ok = add_set(ops, lamp->id, value);
            continue;
        }
        ok = !may || value;
        cJSON_Delete(value);
        ok = ok && lum_json_add(left_out, NULL, cJSON_CreateString(lamp->id));
    }
    if (ok)
        return ops;
    cJSON_Delete(ops);
    return NULL;
}

/* ---- stop ---- */

struct quantity {
    const char *name; /* which the light is in proportion to; NULL: nothing can be said */
    double value;
};

/* As the record says, else as its file or its material does. */
static struct quantity quantity_of(const struct lum_document *doc, const struct lum_record *r)
{
    const struct lum_fields *t = lum_fields_of(r->type);
    for (size_t i = 0; i < t->n; i++)
        if (t->fields[i].group == LUM_GROUP_PHOTOMETRIC && !lum_field_is_null(&t->fields[i], lum_record_body(r))) {
            const struct lum_opt *q = (const void *)((const char *)lum_record_body(r) + t->fields[i].offset);
            return (struct quantity){t->fields[i].name, q->value};
        }
    if (r->type == LUM_RECORD_LIGHT)
        return (struct quantity){strcmp(r->light.kind, "ies") == 0 ? "multiplier" : NULL, 1.0};
    const struct lum_record *m = lum_document_find(doc, r->object.material);
    bool even = m && !m->material.emission_texture.image[0];
    return (struct quantity){even ? "luminance_cd_m2" : NULL, m ? m->material.emission_cd_m2 : 0.0};
}

/* shown: how it shines; full: how it would, switched on, by its record. NULL: that cannot be said in its record. */
static cJSON *value_as_shown(struct quantity q, struct lum_rgb shown, struct lum_rgb full)
{
    float y = lum_luminance(shown), most = lum_luminance(full);
    if (y > 0.0f && (!q.name || !(most > 0.0f)))
        return NULL;
    cJSON *value = cJSON_CreateObject();
    if (!lum_json_add_bool(value, "on", y > 0.0f) || !(y > 0.0f))
        return value;
    lum_json_add_number(value, q.name, q.value * (double)(y / most));
    struct lum_rgb hue = lum_rgb_scale(shown, 1.0f / y), was = lum_rgb_scale(full, 1.0f / most);
    if (fabsf(hue.r - was.r) + fabsf(hue.g - was.g) + fabsf(hue.b - was.b) > 1e-5f) {
        const double color[3] = {(double)hue.r, (double)hue.g, (double)hue.b};
        lum_json_add(value, "color", cJSON_CreateDoubleArray(color, 3));
    }
    return value;
}

struct cJSON *lum_preset_stop_ops(const struct lum_world *w)
{
    const struct lum_light_table *lights = &w->snapshot->lights;
    cJSON *ops = cJSON_CreateArray();
    for (uint32_t i = 0; ops && i < lights->n_lights; i++) {
        struct lum_light l = lights->lights[i];
        const struct lum_record *r = lum_document_find(w->doc, l.id);
        if (!lum_fade_of(&w->fade, l.id) || !r || (r->type != LUM_RECORD_LIGHT && r->type != LUM_RECORD_OBJECT))
            continue;
        lum_fade_shine(&w->fade, &l);
        cJSON *value = value_as_shown(quantity_of(w->doc, r), l.on ? l.power : lum_grey(0.0f), lights->lights[i].power);
        if (value && takes(r, value)) {
            add_set(ops, r->id, value);
            continue;
        }
        cJSON_Delete(value);
    }
    return ops;
}
