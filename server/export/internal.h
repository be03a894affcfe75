/* Between the sources of this room: one struct lum_exporting lives for one file. */
#ifndef LUM_SERVER_EXPORT_INTERNAL_H
#define LUM_SERVER_EXPORT_INTERNAL_H

#include "core/light/web.h"
#include "core/math/affine.h"
#include "server/export/export.h"

#define LUM_EXPORT_NONE UINT32_MAX

/* The same mesh with another material is another mesh of glTF, of the same arrays. */
struct lum_export_pair {
    struct lum_export_pair *next;
    uint32_t material, mesh;
};
/* The light of a material as some objects have it: a material of glTF of its own. */
struct lum_export_variant {
    struct lum_export_variant *next;
    double emission[3]; /* cd/m2 by channel */
    uint32_t material;
};

/* What became of a record. */
struct lum_export_entry {
    const struct lum_record *record;
    uint32_t index; /* image, material: in their list. LUM_EXPORT_NONE: not written yet */
    /* mesh: accessors; LUM_EXPORT_NONE: none */
    bool written, empty;
    uint32_t positions, normals, uvs, tangents, colors, indices;
    struct cJSON *exact; /* arrays that glTF would not have as they are; borrowed by what it is added to */
    struct lum_export_pair *pairs;
    struct lum_export_variant *variants;
};

struct lum_exporting {
    struct lum_glb *glb;
    struct lum_export_entry *entries; /* by type, then id */
    size_t n;
    uint32_t samplers[3][3]; /* by wrapping; LUM_EXPORT_NONE: not written yet */
    struct cJSON *records;   /* of what is nowhere in the room; owned */
    uint32_t *ies;           /* views of files of EXT_lights_ies, by their lights; free() */
    size_t n_ies;
    struct lum_web *web; /* of the file that was read last */
    const struct lum_record_web *web_file;
};

/* NULL: there is none. */
struct lum_export_entry *lum_export_find(struct lum_exporting *x, enum lum_record_type type, const char *id);
/* {"lumend":{"record":..}} as extras of o: of the record without bulk arrays. The inner object, NULL: failed. */
struct cJSON *lum_export_extras(struct lum_exporting *x, struct cJSON *o, const struct lum_record *r);
/* {"bufferView":i} as a member; bits: 64 for doubles. */
void lum_export_bytes(struct lum_exporting *x, struct cJSON *o, const char *key, const void *bytes, size_t n,
                      unsigned bits);

/* ---- picture.c ---- */
uint32_t lum_export_image(struct lum_exporting *x, struct lum_export_entry *e);
/* {"index":..} of a texture, as member key of o. */
void lum_export_texture(struct lum_exporting *x, struct cJSON *o, const char *key, const struct lum_record_texture *t);

/* ---- material.c ---- */
/* The record as it is. */
uint32_t lum_export_material(struct lum_exporting *x, struct lum_export_entry *e);
/* With that light in place of its own. */
uint32_t lum_export_variant(struct lum_exporting *x, struct lum_export_entry *e, const double emission[3]);
/* cd/m2 by channel. */
void lum_export_emission(const struct lum_record_material *m, double ret_emission[3]);

/* ---- mesh.c ---- */
/* LUM_EXPORT_NONE: it has no triangles. */
uint32_t lum_export_mesh(struct lum_exporting *x, struct lum_export_entry *e, uint32_t material);
/* m2 where it stands so. */
double lum_export_area(const struct lum_record_mesh *m, const struct lum_affined *place);

/* ---- light.c, node.c ---- */
void lum_export_light(struct lum_exporting *x, const struct lum_record *r);
void lum_export_camera(struct lum_exporting *x, const struct lum_record *r);
void lum_export_loose(struct lum_exporting *x, const struct lum_record *r); /* what stands nowhere */
void lum_export_object(struct lum_exporting *x, const struct lum_record *r);
/* A node, or two where turning and stretching cannot be said in one: content, an object that passes over, is of the
 * node that stands at place. Its extras say of which record it is; placed: and where that stood. */
void lum_export_node(struct lum_exporting *x, const struct lum_record *r, const struct lum_affined *place, bool placed,
                     struct cJSON *content);

/* ---- web.c ---- */
/* LM-63-2002 text, which the caller frees with free(); NULL: memory is short. */
char *lum_export_ies(const struct lum_record_web *web, size_t *ret_n);

#endif
