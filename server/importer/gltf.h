/* The glTF 2.0 reader, inside. One struct lum_gltf lives for one import. */
#ifndef LUM_SERVER_IMPORTER_GLTF_H
#define LUM_SERVER_IMPORTER_GLTF_H

#include <cjson/cJSON.h>

#include "core/math/affine.h"
#include "server/importer/mesh.h"
#include "server/importer/photometry.h"

#define LUM_GLTF_NONE UINT32_MAX

enum lum_gltf_kind {
    LUM_GLTF_ACCESSORS,
    LUM_GLTF_BUFFERS,
    LUM_GLTF_BUFFER_VIEWS,
    LUM_GLTF_CAMERAS,
    LUM_GLTF_IMAGES,
    LUM_GLTF_LIGHTS,
    LUM_GLTF_IES_LIGHTS,
    LUM_GLTF_MATERIALS,
    LUM_GLTF_MESHES,
    LUM_GLTF_NODES,
    LUM_GLTF_SAMPLERS,
    LUM_GLTF_SCENES,
    LUM_GLTF_SKINS,
    LUM_GLTF_TEXTURES,
    LUM_GLTF_KIND_COUNT
};

struct lum_gltf_array {
    const cJSON **items; /* cJSON's own arrays are linked lists */
    uint32_t n;
};

struct lum_gltf_material {
    bool done;
    lum_id id;
    uint32_t uv_set;     /* the TEXCOORD_n its textures use */
    bool shines, evenly; /* it is a light; without a texture that says where */
    bool turns;          /* it looks different along tangents and across */
};

struct lum_gltf_mesh {
    struct lum_mesh_parts *parts; /* of each primitive; NULL: not sent yet */
    uint32_t n_primitives;
};

struct lum_gltf_image {
    bool done;
    lum_id id; /* "": could not be read */
};

/* A photometric file that was read: lamps of a room have few. */
#define LUM_GLTF_PROFILES 16u
struct lum_gltf_profile {
    char key[256];          /* file, or number of the light; "": free */
    enum lum_status status; /* LUM_ERR_INTERNAL: not read yet */
    struct lum_photometry photometry;
};

struct lum_gltf_node {
    struct lum_affined to_world;
    uint32_t parent;
    bool in_scene, hidden;
};

struct lum_gltf {
    struct lum_importer *im;
    struct lum_error error;     /* status LUM_OK: none yet */
    enum lum_gltf_kind at_kind; /* what is being read, for messages */
    uint32_t at_index;
    cJSON *root;
    struct lum_gltf_array arrays[LUM_GLTF_KIND_COUNT];
    struct lum_bytes glb_bin;            /* borrowed from the file */
    struct lum_bytes *buffers;           /* by buffer; data NULL: not loaded yet */
    struct lum_bytes *decoded;           /* by buffer view: what EXT_meshopt_compression unpacked */
    struct lum_gltf_image (*images)[2];  /* by image: read as sRGB, as linear */
    struct lum_gltf_material *materials; /* n + 1: the last is the default material */
    struct lum_gltf_mesh *meshes;
    uint32_t *n_shown; /* by mesh: nodes that show it */
    struct lum_gltf_node *nodes;
    struct lum_gltf_profile profiles[LUM_GLTF_PROFILES];
    uint32_t n_profiles;          /* read so far */
    bool warned_clamped, is_ours; /* as lumend wrote it: what its extras say of buffer views holds */
};

/* ---- gltf_buffer.c ---- */
struct lum_gltf_view {
    const uint8_t *data;
    size_t n, stride; /* stride 0: tightly packed */
};
bool lum_gltf_view(struct lum_gltf *g, uint32_t index, struct lum_gltf_view *ret_view);
/* Bytes of a "data:" URI (owned, lum_free), or of a file beside the asset. */
enum lum_status lum_gltf_load_uri(struct lum_gltf *g, const char *uri, struct lum_bytes *ret_bytes,
                                  struct lum_error *err);

/* What "uri" or "bufferView" of o holds; owned: lum_free. */
bool lum_gltf_bytes(struct lum_gltf *g, const cJSON *o, struct lum_bytes *ret_bytes, bool *ret_owned,
                    struct lum_error *err);

/* ---- gltf_accessor.c ---- */
/* n_components floats an element, freed by lum_free; sparse and normalised values resolved, all finite. An accessor
 * with more components gives its first ones. */
bool lum_gltf_floats(struct lum_gltf *g, uint32_t accessor, uint32_t n_components, float **ret_values,
                     uint32_t *ret_count);
bool lum_gltf_uints(struct lum_gltf *g, uint32_t accessor, uint32_t n_components, uint32_t **ret_values,
                    uint32_t *ret_count);

/* ---- gltf_material.c, gltf_image.c ---- */
/* Sends the material (LUM_GLTF_NONE: the default one) at its first use; NULL: refused. */
const struct lum_gltf_material *lum_gltf_material(struct lum_gltf *g, uint32_t index);
/* Sends the image at its first use; NULL: it cannot be read, and a warning says why. */
const char *lum_gltf_image(struct lum_gltf *g, uint32_t index, bool linear);

/* ---- gltf_mesh.c, gltf_deform.c ---- */
/* What a node adds to its mesh. A deformed mesh belongs to its node, a plain one is shared. */
struct lum_gltf_pose {
    uint32_t skin;        /* LUM_GLTF_NONE: none */
    const cJSON *weights; /* of morph targets; NULL: the mesh's own */
};
void lum_gltf_mesh_finish(struct lum_gltf_mesh *mesh);
/* Sends the mesh's primitives, at first use; the caller finishes ret_mesh only if it owns it: a posed one. */
bool lum_gltf_mesh(struct lum_gltf *g, uint32_t index, const struct lum_gltf_pose *pose, struct lum_gltf_mesh *ret_mesh,
                   bool *ret_owned);
uint32_t lum_gltf_mesh_material(struct lum_gltf *g, uint32_t mesh, uint32_t primitive);

struct lum_gltf_vertices {
    float *positions, *normals, *uvs, *tangents, *colors; /* 3, 3, 2, 4, 3 each; all but positions NULL when absent */
    uint32_t n;
};
bool lum_gltf_morph(struct lum_gltf *g, const cJSON *primitive, const cJSON *weights, struct lum_gltf_vertices *v);
bool lum_gltf_skin(struct lum_gltf *g, const cJSON *primitive, uint32_t skin, struct lum_gltf_vertices *v);

/* ---- gltf_node.c, gltf_light.c ---- */
bool lum_gltf_flatten_nodes(struct lum_gltf *g); /* fills g->nodes */
bool lum_gltf_emit_nodes(struct lum_gltf *g);
bool lum_gltf_emit_light(struct lum_gltf *g, uint32_t light, uint32_t node);
bool lum_gltf_emit_camera(struct lum_gltf *g, uint32_t camera, uint32_t node);
/* Position and unit direction of a node's -Z; false when they are not finite, too far, or the axis has no length. */
bool lum_gltf_axis(const struct lum_affined *a, double ret_position[3], double ret_direction[3]);

/* ---- gltf_ies.c ---- */
bool lum_gltf_emit_ies_light(struct lum_gltf *g, const cJSON *extension, uint32_t node, bool *ret_sent);
/* A lamp of the file that the node's extras name. Of both, sent: it takes the place of the node's punctual light. */
bool lum_gltf_emit_ies_extras(struct lum_gltf *g, uint32_t node, uint32_t punctual, bool *ret_sent);
void lum_gltf_profiles_finish(struct lum_gltf *g);

#endif
