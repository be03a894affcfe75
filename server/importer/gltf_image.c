/* Images of a glTF file: sent at their first use, once as sRGB and once as linear where both are asked for. */
#include <string.h>

#include "server/importer/gltf.h"
#include "server/importer/gltf_json.h"
#include "server/importer/gltf_ours.h"
#include "server/importer/image.h"

/* The name for people: "name", else the file's name. */
static const char *readable_name(struct lum_gltf *g, const cJSON *o)
{
    const char *name = lum_gltf_string(g, o, "name"), *uri = lum_gltf_string(g, o, "uri");
    if (name && name[0])
        return name;
    if (!uri || strncmp(uri, "data:", 5) == 0)
        return NULL;
    const char *slash = strrchr(uri, '/');
    return slash ? slash + 1 : uri;
}

static bool send_image(struct lum_gltf *g, uint32_t index, bool linear, struct lum_gltf_image *image,
                       struct lum_error *err)
{
    const cJSON *o = lum_gltf_item(g, LUM_GLTF_IMAGES, index);
    struct lum_bytes bytes = {0};
    struct lum_texels texels = {0};
    bool owned = false;
    if (!lum_gltf_bytes(g, o, &bytes, &owned, err))
        return false;
    struct lum_id_request name = {"image/", readable_name(g, o), "image", index};
    const cJSON *ours = lum_gltf_ours(o);
    const char *texel = lum_gltf_ours_text(ours, "texel");
    bool known = lum_gltf_ours_id(g, ours, image->id) && !lum_ids_find(&g->im->ids, image->id, NULL);
    enum lum_status status = lum_image_decode(&bytes, &texels, err);
    if (!status)
        status =
            known ? lum_ids_take(&g->im->ids, image->id, index, err) : lum_ids_make(&g->im->ids, &name, image->id, err);
    if (known && texel)
        linear = strcmp(texel, "linear8") == 0;
    if (!status) {
        status = lum_image_emit(g->im, image->id, &texels, linear, err);
        if (status) /* the output is full or broken: the import cannot go on */
            lum_gltf_fail(g, status, "%s", err->text);
    }
    if (status)
        image->id[0] = 0;
    lum_free(texels.pixels);
    if (owned)
        lum_free(bytes.data);
    return !status;
}

const char *lum_gltf_image(struct lum_gltf *g, uint32_t index, bool linear)
{
    const cJSON *ours = lum_gltf_ours(lum_gltf_item(g, LUM_GLTF_IMAGES, index));
    struct lum_gltf_image *image = &g->images[index][ours ? 0 : linear]; /* ours are read as they are, however used */
    enum lum_gltf_kind kind = g->at_kind;
    uint32_t at = g->at_index;
    if (!image->done && g->is_ours && ours && lum_gltf_ours_id(g, ours, image->id) &&
        lum_ids_find(&g->im->ids, image->id, NULL))
        image->done = true; /* one of floats, which glTF has as a likeness only */
    if (!image->done) {
        struct lum_error err = {0};
        image->done = true;
        lum_gltf_at(g, LUM_GLTF_IMAGES, index);
        if (!send_image(g, index, linear, image, &err) && lum_gltf_ok(g))
            lum_gltf_warn(g, "left out: %s", err.text);
        if (lum_gltf_ok(g))
            lum_gltf_at(g, kind, at);
    }
    return image->id[0] ? image->id : NULL;
}
