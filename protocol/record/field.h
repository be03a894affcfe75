/* Field tables: what each record type holds. One row serves add, set, scene.get, comparison, copying, freeing and the
 * tables of PROTOCOL.md. Requests with many members use the same rows. */
#ifndef LUM_PROTOCOL_RECORD_FIELD_H
#define LUM_PROTOCOL_RECORD_FIELD_H

#include "protocol/base/error.h"
#include "protocol/record/record.h"

struct cJSON;
struct lum_json_reader;

enum lum_field_kind {
    LUM_FIELD_NUMBER,    /* double */
    LUM_FIELD_INTEGER,   /* double that holds an integer */
    LUM_FIELD_U32,       /* uint32_t */
    LUM_FIELD_OPT,       /* struct lum_opt; null when not set */
    LUM_FIELD_BOOL,      /* bool */
    LUM_FIELD_VECTOR,    /* n doubles */
    LUM_FIELD_CHOICE,    /* char[n]: one word of `text`, "a|b|c"; the first is the default */
    LUM_FIELD_NAME,      /* char[n]: [a-z0-9_-]*; the renderer knows which names exist */
    LUM_FIELD_TEXT,      /* char[n]: one line for people, null when empty */
    LUM_FIELD_ASSET,     /* char[n]: relative path without "..", null when empty */
    LUM_FIELD_ID,        /* lum_id, null when empty */
    LUM_FIELD_REF,       /* lum_id of an existing record of type ref, null when empty */
    LUM_FIELD_FLOATS,    /* struct lum_floats, n numbers per vertex */
    LUM_FIELD_INDICES,   /* struct lum_indices */
    LUM_FIELD_PIXELS,    /* uint8_t * and size_t of struct lum_record_image; base64 in JSON */
    LUM_FIELD_WEB,       /* struct lum_record_web *; an object in JSON, whose fields are lum_web_fields */
    LUM_FIELD_LAMPS,     /* struct lum_lamps; a list of objects in JSON, whose fields are lum_lamp_fields */
    LUM_FIELD_TEXTURE,   /* struct lum_record_texture, null when it names no image */
    LUM_FIELD_TRANSFORM, /* struct lum_record_transform */
    LUM_FIELD_BOX,       /* struct lum_record_box, null when not set */
    LUM_FIELD_PARTS,     /* struct of n bytes, whose fields are `parts` */
};

enum lum_field_flag {
    LUM_FIELD_REQUIRED = 1, /* add must give it, and it can never be null */
    LUM_FIELD_WHOLE = 2,    /* vector of integers */
    LUM_FIELD_DOUBLE = 4,   /* floats: JSON numbers keep double precision */
    LUM_FIELD_NULLABLE = 8, /* vector: null where all are 0, which is no value of it */
};

/* Fields of one group exclude each other: setting one sets the others to their default. */
enum lum_field_group { LUM_GROUP_NONE, LUM_GROUP_PHOTOMETRIC, LUM_GROUP_COLOR, LUM_GROUP_FILE, LUM_GROUP_CAMERA };

struct lum_fields;

struct lum_field {
    const char *name;
    enum lum_field_kind kind;
    unsigned flags;
    enum lum_field_group group;
    enum lum_record_type ref;
    size_t offset; /* in the type's own struct */
    unsigned n;    /* vector: numbers; char arrays, parts: bytes; floats: numbers per vertex */
    double min, max;
    double def[3];    /* vector: def[2] repeats */
    const char *text; /* choice: the words; name: the default */
    unsigned has;     /* of lights: the kinds that have this have it (light_kinds.h); 0: all */
    const char *only; /* of sensors: the kinds that have it, "line|grid"; NULL: all */
    const struct lum_fields *parts;
    const char *unit, *doc;
};

struct lum_fields {
    const struct lum_field *fields;
    size_t n;
};
const struct lum_fields *lum_fields_of(enum lum_record_type type);
extern const struct lum_fields lum_texture_fields, lum_transform_fields, lum_box_fields, lum_web_fields,
    lum_lamp_fields, lum_camera_fields;

/* The sub-table of what has one; else NULL. */
const struct lum_fields *lum_field_parts(const struct lum_field *f);
const struct lum_field *lum_fields_find(const struct lum_fields *t, const char *name);
/* Fills err with "unknown_field" and the nearest name, or what became of a field that there was once; returns false. */
bool lum_fields_unknown(const struct lum_fields *t, const char *name, struct lum_proto_error *err);

/* The struct that the offsets of a record's fields count from. */
static inline void *lum_record_body(const struct lum_record *r)
{
    return (char *)(uintptr_t)r + offsetof(struct lum_record, mesh);
}

/* base: the struct that holds the field. read may leave a half-read value behind when it fails; copy and reset leave a
 * whole one. The target of copy must not own bulk data. */
bool lum_field_read(const struct lum_field *f, void *base, const struct cJSON *json, const struct lum_blobs *blobs,
                    struct lum_proto_error *err);
bool lum_field_read_bulk(const struct lum_field *f, void *base, const struct cJSON *json, const struct lum_blobs *blobs,
                         struct lum_proto_error *err);
/* The field's member of the reader's object. True when it is there and right; null counts as absent, but for
 * LUM_FIELD_OPT. */
bool lum_field_take(const struct lum_field *f, void *base, struct lum_json_reader *r);
struct cJSON *lum_field_write(const struct lum_field *f, const void *base); /* NULL: memory is short */
struct cJSON *lum_field_write_bulk(const struct lum_field *f, const void *base);
/* {"blob":k}, and the array as blob k of out, borrowed from base. */
struct cJSON *lum_field_write_blob(const struct lum_field *f, const void *base, struct lum_blobs_out *out);
bool lum_field_equal(const struct lum_field *f, const void *a, const void *b);
void lum_field_copy(const struct lum_field *f, void *to, const void *from); /* bulk data is shared */
void lum_field_reset(const struct lum_field *f, void *base);
bool lum_field_is_null(const struct lum_field *f, const void *base);
bool lum_field_is_bulk(const struct lum_field *f); /* it owns memory, which copies share */
bool lum_field_is_long(const struct lum_field *f); /* bulk that messages to clients leave out */
/* The members of an object into parts of f, which have been reset. */
bool lum_field_read_members(const struct lum_field *f, const struct lum_fields *parts, void *base,
                            const struct cJSON *json, const struct lum_blobs *blobs, struct lum_proto_error *err);

/* Calls fn for each id that the record refers to; stops and returns false when fn does. */
typedef bool (*lum_ref_fn)(void *user, enum lum_record_type type, const char *id, const char *path);
bool lum_record_each_ref(const struct lum_record *r, lum_ref_fn fn, void *user);

/* What no single field can say: exactly one photometric quantity, a camera that looks somewhere, whole meshes. */
bool lum_record_validate(const struct lum_record *r, struct lum_proto_error *err);
bool lum_camera_validate(const struct lum_record_camera *c, struct lum_proto_error *err);

#endif
