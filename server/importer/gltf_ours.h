/* What lumend has written into a glTF file beside what glTF has words for (server/export): records in `extras`. */
#ifndef LUM_SERVER_IMPORTER_GLTF_OURS_H
#define LUM_SERVER_IMPORTER_GLTF_OURS_H

#include "server/importer/gltf.h"

/* extras.lumend, which lumend writes (server/export); NULL: there is none. */
const cJSON *lum_gltf_ours(const cJSON *o);
const char *lum_gltf_ours_text(const cJSON *ours, const char *key); /* NULL: no such text */
/* Of a mesh, an image or a material: the id that it had. False: none. */
bool lum_gltf_ours_id(struct lum_gltf *g, const cJSON *ours, lum_id ret_id);
/* Bytes of {"bufferView":i} or of doubles, {"bufferView64":i}, as member key of o. False: none. */
bool lum_gltf_ours_bytes(struct lum_gltf *g, const cJSON *o, const char *key, struct lum_gltf_view *ret_view,
                         bool *ret_doubles);
/* The record of a node's extras in place of what glTF says of it: moved, where the node was. mesh, material: of an
 * object. *ret_sent false: there is no record that it could be. */
bool lum_gltf_emit_ours(struct lum_gltf *g, uint32_t node, const char *mesh, const char *material, bool *ret_sent);
/* Images, or the other records, that stand nowhere. */
bool lum_gltf_emit_loose(struct lum_gltf *g, bool images);
bool lum_gltf_emit_settings(struct lum_gltf *g);
/* A mesh that was a built-in shape, from its record. */
enum lum_status lum_gltf_send_shape(struct lum_gltf *g, const cJSON *shape, const char *id, struct lum_error *err);

#endif
