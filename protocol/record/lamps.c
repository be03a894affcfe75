#include "protocol/record/lamps.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/record/bulk.h"
#include "protocol/record/field.h"

bool lum_lamps_read(const struct lum_field *f, struct lum_lamps *ret_lamps, const cJSON *json,
                    struct lum_proto_error *err)
{
    if (!cJSON_IsArray(json))
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", f->name, "%s must be a list of objects",
                              f->name);
    size_t n = (size_t)cJSON_GetArraySize(json);
    if (n > LUM_LIMIT_LIGHTS)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "limit_exceeded", f->name, "%s may have %u members", f->name,
                              LUM_LIMIT_LIGHTS);
    struct lum_lamp *items = lum_bulk_create(n * sizeof *items);
    if (!items)
        return lum_proto_fail_memory(err);
    *ret_lamps = (struct lum_lamps){items, n};
    struct lum_lamp *to = items;
    for (const cJSON *c = json->child; c; c = c->next, to++) {
        char name[64];
        snprintf(name, sizeof name, "%s/%zu", f->name, (size_t)(to - items));
        struct lum_field member = {.name = name, .kind = LUM_FIELD_LAMPS};
        for (size_t i = 0; i < lum_lamp_fields.n; i++)
            lum_field_reset(&lum_lamp_fields.fields[i], to);
        if (!lum_field_read_members(&member, &lum_lamp_fields, to, c, NULL, err))
            return false;
    }
    return true;
}

static bool write_one(cJSON *list, const struct lum_lamp *lamp)
{
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add(list, NULL, o);
    for (size_t i = 0; i < lum_lamp_fields.n && ok; i++)
        if (!lum_field_is_null(&lum_lamp_fields.fields[i], lamp))
            ok = lum_json_add(o, lum_lamp_fields.fields[i].name, lum_field_write(&lum_lamp_fields.fields[i], lamp));
    return ok;
}

struct cJSON *lum_lamps_write(const struct lum_lamps *lamps)
{
    cJSON *list = cJSON_CreateArray();
    for (size_t i = 0; list && i < lamps->n; i++)
        if (!write_one(list, &lamps->items[i])) {
            cJSON_Delete(list);
            return NULL;
        }
    return list;
}

static bool lamp_equal(const struct lum_lamp *a, const struct lum_lamp *b)
{
    for (size_t i = 0; i < lum_lamp_fields.n; i++)
        if (!lum_field_equal(&lum_lamp_fields.fields[i], a, b))
            return false;
    return true;
}

bool lum_lamps_equal(const struct lum_lamps *a, const struct lum_lamps *b)
{
    if (a->n != b->n)
        return false;
    for (size_t i = 0; i < a->n && a->items != b->items; i++)
        if (!lamp_equal(&a->items[i], &b->items[i]))
            return false;
    return true;
}

static int by_id(const void *a, const void *b)
{
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

/* One that is there twice; NULL: none. False: memory is short. */
static bool find_twice(const struct lum_lamps *lamps, const char **ret_id)
{
    const char **ids = calloc(lamps->n ? lamps->n : 1, sizeof *ids);
    *ret_id = NULL;
    if (!ids)
        return false;
    for (size_t i = 0; i < lamps->n; i++)
        ids[i] = lamps->items[i].id;
    qsort(ids, lamps->n, sizeof *ids, by_id);
    for (size_t i = 1; i < lamps->n && !*ret_id; i++)
        if (strcmp(ids[i - 1], ids[i]) == 0)
            *ret_id = ids[i];
    free(ids);
    return true;
}

bool lum_lamps_validate(const struct lum_lamps *lamps, struct lum_proto_error *err)
{
    const char *twice;
    for (size_t i = 0; i < lamps->n; i++) {
        int given[LUM_GROUP_CAMERA + 1] = {0};
        for (size_t k = 0; k < lum_lamp_fields.n; k++)
            given[lum_lamp_fields.fields[k].group] += !lum_field_is_null(&lum_lamp_fields.fields[k], &lamps->items[i]);
        bool colors = given[LUM_GROUP_COLOR] > 1;
        if (colors || given[LUM_GROUP_PHOTOMETRIC] > 1)
            return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "lamps",
                                  "lamps/%zu: \"%s\" has more than one %s", i, lamps->items[i].id,
                                  colors ? "colour" : "photometric quantity");
    }
    if (!find_twice(lamps, &twice))
        return lum_proto_fail_memory(err);
    return !twice ||
           lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "lamps", "lamps: \"%s\" is there twice", twice);
}
