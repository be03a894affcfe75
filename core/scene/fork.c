/* A scene beside another: its tables anew, and all that is heavy shared. */
#include "core/light/web.h"
#include "core/material/brushed.h"
#include "core/scene/parts.h"
#include "core/scene/tables.h"

#include <string.h>

static const size_t entry_sizes[LUM_ENTITY_COUNT] = {
    [LUM_ENTITY_MESH] = sizeof(struct lum_mesh_entry),         [LUM_ENTITY_IMAGE] = sizeof(struct lum_image_entry),
    [LUM_ENTITY_MATERIAL] = sizeof(struct lum_material_entry), [LUM_ENTITY_OBJECT] = sizeof(struct lum_object_entry),
    [LUM_ENTITY_LIGHT] = sizeof(struct lum_light_entry),       [LUM_ENTITY_CAMERA] = sizeof(struct lum_camera_entry),
    [LUM_ENTITY_MEDIUM] = sizeof(struct lum_medium_entry),
};

/* The fork's entry in place of the other scene's, which is there by now; NULL stays NULL. */
static void *own(const struct lum_scene *fork, enum lum_entity kind, void *theirs)
{
    struct lum_entry *entry = theirs;
    if (!entry)
        return NULL;
    entry = lum_entry_find(&fork->tables[kind], entry->id);
    lum_entry_move_use(NULL, entry);
    return entry;
}

/* References of its own to what the entry, a copy, owns and refers to. */
static void take(const struct lum_scene *fork, enum lum_entity kind, struct lum_entry *entry)
{
    struct lum_mesh_entry *mesh = (struct lum_mesh_entry *)entry;
    struct lum_image_entry *image = (struct lum_image_entry *)entry;
    struct lum_material_entry *material = (struct lum_material_entry *)entry;
    struct lum_object_entry *object = (struct lum_object_entry *)entry;
    struct lum_light_entry *light = (struct lum_light_entry *)entry;
    switch (kind) {
    case LUM_ENTITY_MESH:
        mesh->spare = NULL; /* whoever has it alone may refit it */
        lum_mesh_ref(mesh->mesh);
        break;
    case LUM_ENTITY_IMAGE:
        lum_image_ref(image->image);
        image->env = image->env ? lum_env_part_ref(image->env) : NULL;
        break;
    case LUM_ENTITY_MATERIAL:
        material->brushed = material->brushed ? lum_brushed_table_ref(material->brushed) : NULL;
        for (int i = 0; i < LUM_SLOT_COUNT; i++)
            material->images[i] = own(fork, LUM_ENTITY_IMAGE, material->images[i]);
        break;
    case LUM_ENTITY_OBJECT:
        object->mesh = own(fork, LUM_ENTITY_MESH, object->mesh);
        object->material = own(fork, LUM_ENTITY_MATERIAL, object->material);
        break;
    case LUM_ENTITY_LIGHT:
        light->image = own(fork, LUM_ENTITY_IMAGE, light->image);
        light->desc.web = light->desc.web ? lum_web_ref(light->desc.web) : NULL;
        break;
    case LUM_ENTITY_CAMERA:
    case LUM_ENTITY_MEDIUM:
        break;
    }
}

static bool copy_table(struct lum_scene *fork, const struct lum_scene *scene, enum lum_entity kind)
{
    const struct lum_table *from = &scene->tables[kind];
    struct lum_table *to = &fork->tables[kind];
    to->rows = lum_calloc(from->n, sizeof(struct lum_entry *));
    if (from->n && !to->rows)
        return false;
    to->capacity = from->n;
    for (; to->n < from->n; to->n++) {
        struct lum_entry *entry = lum_calloc(1, entry_sizes[kind]);
        if (!entry)
            return false;
        memcpy(entry, from->rows[to->n], entry_sizes[kind]);
        entry->users = 0;
        take(fork, kind, entry);
        to->rows[to->n] = entry;
    }
    return true;
}

enum lum_status lum_scene_fork(const struct lum_scene *scene, uint64_t version_step, struct lum_scene **ret_scene,
                               struct lum_error *err)
{
    struct lum_scene *fork = NULL;
    enum lum_status status = lum_scene_create(scene->device, &fork, err);
    if (status != LUM_OK)
        return status;
    fork->previous = scene->previous;
    fork->version_step = version_step;
    fork->straight_glass = scene->straight_glass;
    fork->last = scene->last ? lum_snapshot_ref(scene->last) : NULL;
    bool copied = true;
    for (int kind = 0; kind < LUM_ENTITY_COUNT && copied; kind++) /* what is referred to first */
        copied = copy_table(fork, scene, (enum lum_entity)kind);
    if (copied) {
        *ret_scene = fork;
        return LUM_OK;
    }
    lum_scene_destroy(fork);
    return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for another scene");
}
