/* Records: what a scene is made of, as plain data with stable string ids. Scene files, replay scripts, the journal and
 * live edits are the same ops over them (op.h). A field table per type serves add, set, scene.get and PROTOCOL.md. */
#ifndef LUM_PROTOCOL_RECORD_RECORD_H
#define LUM_PROTOCOL_RECORD_RECORD_H

#include <stdatomic.h>
#include <stddef.h>

#include "protocol/record/types.h"

enum lum_record_type {
    LUM_RECORD_MESH,
    LUM_RECORD_IMAGE,
    LUM_RECORD_MATERIAL,
    LUM_RECORD_OBJECT,
    LUM_RECORD_LIGHT,
    LUM_RECORD_MEDIUM,
    LUM_RECORD_CAMERA,
    LUM_RECORD_SENSOR,
    LUM_RECORD_PATCH,
    LUM_RECORD_PRESET,
    LUM_RECORD_RENDER, /* the one record of id "render": settings; always exists */
    LUM_RECORD_IMPORT,
    LUM_RECORD_TYPE_COUNT
};
/* For lum_json_choice, of those that clients add by themselves: the index is that of the type. */
#define LUM_RECORD_ADDED "mesh|image|material|object|light|medium|camera|sensor|patch|preset"
extern const char *const lum_record_type_names[LUM_RECORD_TYPE_COUNT]; /* "mesh", ... */

/* Immutable once shared. */
struct lum_record {
    _Atomic uint32_t refs;
    enum lum_record_type type;
    lum_id id;
    lum_id origin; /* id of the import that made it, or "" */
    union {
        struct lum_record_mesh mesh;
        struct lum_record_image image;
        struct lum_record_material material;
        struct lum_record_object object;
        struct lum_record_light light;
        struct lum_record_medium medium;
        struct lum_record_camera camera;
        struct lum_record_sensor sensor;
        struct lum_record_patch patch;
        struct lum_record_preset preset;
        struct lum_record_render render;
        struct lum_record_import import;
    };
};

/* With defaults filled in; one reference. NULL when memory is short. */
struct lum_record *lum_record_create(enum lum_record_type type, const char *id);
struct lum_record *lum_record_ref(struct lum_record *r);
void lum_record_unref(struct lum_record *r); /* accepts NULL */
/* A copy that may be changed, but for its bulk arrays: these are shared, and can only be replaced. */
struct lum_record *lum_record_clone(const struct lum_record *r);

/* How many channels it takes, from its address on. */
unsigned lum_patch_channels(const struct lum_record_patch *p);

/* Of one record without its arrays, about: the same in every build, for what is forgotten hangs on it. */
#define LUM_RECORD_BYTES 2048u
/* With its arrays, also those that it shares; of an import, not the records that it made. */
size_t lum_record_bytes(const struct lum_record *r);

#endif
