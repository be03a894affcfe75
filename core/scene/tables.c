#include "core/scene/tables.h"

#include <stdio.h>
#include <string.h>

#include "core/light/web.h"
#include "core/material/brushed.h"
#include "core/math/vec3d.h"
#include "core/scene/parts.h"

/* ---- tables ---- */

uint32_t lum_table_lower_bound(const struct lum_table *table, const char *id)
{
    uint32_t lo = 0, hi = table->n;
    while (lo < hi) {
        uint32_t mid = lo + (hi - lo) / 2;
        if (strcmp(table->rows[mid]->id, id) < 0)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

struct lum_entry *lum_entry_find(const struct lum_table *table, const char *id)
{
    uint32_t i = lum_table_lower_bound(table, id);
    return i < table->n && strcmp(table->rows[i]->id, id) == 0 ? table->rows[i] : NULL;
}

size_t lum_bounded_length(const char *text, size_t limit)
{
    const char *end = text ? memchr(text, 0, limit) : NULL;
    return end ? (size_t)(end - text) : text ? limit : 0;
}

static enum lum_status check_id(const char *id, struct lum_error *err)
{
    size_t n = lum_bounded_length(id, LUM_ID_MAX + 1);
    if (n == 0 || n > LUM_ID_MAX)
        return lum_fail(err, LUM_ERR_INVALID, "id", "an id has 1 to %d bytes", LUM_ID_MAX);
    for (size_t i = 0; i < n; i++)
        if ((unsigned char)id[i] < 0x20 || id[i] == 0x7f)
            return lum_fail(err, LUM_ERR_INVALID, "id", "an id has no control characters");
    return LUM_OK;
}

static enum lum_status reserve_row(struct lum_table *table, struct lum_error *err)
{
    if (table->n < table->capacity)
        return LUM_OK;
    uint32_t capacity = table->capacity ? 2 * table->capacity : 16;
    struct lum_entry **rows = lum_calloc(capacity, sizeof(struct lum_entry *));
    if (!rows)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u entries", capacity);
    if (table->n)
        memcpy(rows, table->rows, table->n * sizeof(struct lum_entry *));
    lum_free(table->rows);
    table->rows = rows;
    table->capacity = capacity;
    return LUM_OK;
}

enum lum_status lum_table_open(struct lum_table *table, const char *id, size_t entry_size, struct lum_entry **ret_entry,
                               struct lum_error *err)
{
    enum lum_status status = check_id(id, err);
    if (status != LUM_OK)
        return status;
    struct lum_entry *entry = lum_entry_find(table, id);
    if (!entry) {
        status = reserve_row(table, err);
        if (status != LUM_OK)
            return status;
        entry = lum_calloc(1, entry_size);
        if (!entry)
            return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for \"%s\"", id);
        snprintf(entry->id, sizeof entry->id, "%s", id);
    }
    *ret_entry = entry;
    return LUM_OK;
}

void lum_table_keep(struct lum_table *table, struct lum_entry *entry)
{
    uint32_t at = lum_table_lower_bound(table, entry->id);
    if (at < table->n && table->rows[at] == entry)
        return;
    memmove(table->rows + at + 1, table->rows + at, (table->n - at) * sizeof(struct lum_entry *));
    table->rows[at] = entry;
    table->n++;
}

void lum_table_drop(struct lum_table *table, struct lum_entry *entry)
{
    if (lum_entry_find(table, entry->id) != entry)
        lum_free(entry);
}

/* ---- references and checks ---- */

static const char *const entity_names[LUM_ENTITY_COUNT] = {
    [LUM_ENTITY_MESH] = "mesh",     [LUM_ENTITY_IMAGE] = "image", [LUM_ENTITY_MATERIAL] = "material",
    [LUM_ENTITY_OBJECT] = "object", [LUM_ENTITY_LIGHT] = "light", [LUM_ENTITY_CAMERA] = "camera",
    [LUM_ENTITY_MEDIUM] = "medium",
};

enum lum_status lum_scene_lookup(const struct lum_scene *scene, enum lum_entity kind, const char *id, const char *field,
                                 struct lum_entry **ret_entry, struct lum_error *err)
{
    struct lum_entry *entry = id ? lum_entry_find(&scene->tables[kind], id) : NULL;
    if (!entry)
        return lum_fail(err, LUM_ERR_NOT_FOUND, field, "there is no %s \"%.*s\"", entity_names[kind], LUM_ID_MAX,
                        id ? id : "");
    *ret_entry = entry;
    return LUM_OK;
}

void lum_entry_move_use(void *from, void *to)
{
    if (to)
        ((struct lum_entry *)to)->users++;
    if (from)
        ((struct lum_entry *)from)->users--;
}

enum lum_status lum_check_range(const char *field, double value, double lo, double hi, struct lum_error *err)
{
    if (value >= lo && value <= hi)
        return LUM_OK;
    return lum_fail(err, LUM_ERR_INVALID, field, "%s must be from %g to %g, not %g", field, lo, hi, value);
}

enum lum_status lum_check_vec(const char *field, struct lum_vec3d v, struct lum_error *err)
{
    if (lum_v3d_within(v, LUM_LENGTH_MAX))
        return LUM_OK;
    return lum_fail(err, LUM_ERR_INVALID, field, "%s must be finite and at most %g, not (%g, %g, %g)", field,
                    LUM_LENGTH_MAX, v.x, v.y, v.z);
}

enum lum_status lum_check_rgb(const char *field, struct lum_rgb c, float hi, struct lum_error *err)
{
    if (c.r >= 0.0f && c.g >= 0.0f && c.b >= 0.0f && lum_rgb_max(c) <= hi)
        return LUM_OK;
    return lum_fail(err, LUM_ERR_INVALID, field, "%s must be from 0 to %g, not (%g, %g, %g)", field, (double)hi,
                    (double)c.r, (double)c.g, (double)c.b);
}

/* ---- the scene ---- */

enum lum_status lum_scene_create(struct lum_device *device, struct lum_scene **ret_scene, struct lum_error *err)
{
    struct lum_scene *scene = lum_calloc(1, sizeof *scene);
    if (!scene)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a scene");
    scene->device = device;
    *ret_scene = scene;
    return LUM_OK;
}

void lum_scene_straighten_glass(struct lum_scene *scene, bool straight)
{
    scene->straight_glass = straight;
}

void lum_scene_succeed(struct lum_scene *scene, const struct lum_scene *previous)
{
    scene->previous = previous->last ? previous->last->versions : previous->previous;
}

/* Gives back what an entry owns and refers to, then the entry. */
static void entry_destroy(enum lum_entity kind, struct lum_entry *entry)
{
    switch (kind) {
    case LUM_ENTITY_MESH:
        lum_mesh_unref(((struct lum_mesh_entry *)entry)->mesh);
        lum_accel_mesh_unref(((struct lum_mesh_entry *)entry)->spare);
        break;
    case LUM_ENTITY_IMAGE:
        lum_image_unref(((struct lum_image_entry *)entry)->image);
        lum_env_part_unref(((struct lum_image_entry *)entry)->env);
        break;
    case LUM_ENTITY_MATERIAL:
        for (int i = 0; i < LUM_SLOT_COUNT; i++)
            lum_entry_move_use(((struct lum_material_entry *)entry)->images[i], NULL);
        lum_brushed_table_unref(((struct lum_material_entry *)entry)->brushed);
        break;
    case LUM_ENTITY_OBJECT:
        lum_entry_move_use(((struct lum_object_entry *)entry)->mesh, NULL);
        lum_entry_move_use(((struct lum_object_entry *)entry)->material, NULL);
        break;
    case LUM_ENTITY_LIGHT:
        lum_entry_move_use(((struct lum_light_entry *)entry)->image, NULL);
        lum_web_unref(((struct lum_light_entry *)entry)->desc.web);
        break;
    case LUM_ENTITY_CAMERA:
    case LUM_ENTITY_MEDIUM:
        break;
    }
    lum_free(entry);
}

void lum_scene_destroy(struct lum_scene *scene)
{
    if (!scene)
        return;
    /* those that refer before those that are referred to */
    for (int kind = LUM_ENTITY_COUNT; kind-- > 0;) {
        struct lum_table *table = &scene->tables[kind];
        for (uint32_t i = 0; i < table->n; i++)
            entry_destroy((enum lum_entity)kind, table->rows[i]);
        lum_free(table->rows);
    }
    lum_snapshot_unref(scene->last);
    lum_free(scene);
}

enum lum_status lum_scene_remove(struct lum_scene *scene, enum lum_entity kind, const char *id, struct lum_error *err)
{
    struct lum_entry *entry = NULL;
    enum lum_status status = lum_scene_lookup(scene, kind, id, "id", &entry, err);
    if (status != LUM_OK)
        return status;
    if (entry->users)
        return lum_fail(err, LUM_ERR_CONFLICT, "id", "%s \"%s\" is used %u times", entity_names[kind], id,
                        entry->users);
    struct lum_table *table = &scene->tables[kind];
    uint32_t at = lum_table_lower_bound(table, id);
    memmove(table->rows + at, table->rows + at + 1, (table->n - at - 1) * sizeof(struct lum_entry *));
    table->n--;
    entry_destroy(kind, entry);
    return LUM_OK;
}

uint64_t lum_scene_dropped_triangles(const struct lum_scene *scene)
{
    return scene->dropped_triangles;
}

uint64_t lum_scene_dropped_texels(const struct lum_scene *scene)
{
    return scene->dropped_texels;
}
