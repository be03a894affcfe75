#include "server/importer/assimp.h"

#include <assimp/cimport.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <string.h>

/* Triangles only, vertices shared, normals where the file has none (smooth below the crease angle, over hard edges
 * flat), texture coordinates from the top left with their transforms applied, and the file's unit as metres (FBX). */
#define STEPS                                                                                                          \
    (aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_GenSmoothNormals | aiProcess_JoinIdenticalVertices |    \
     aiProcess_FindInvalidData | aiProcess_GenUVCoords | aiProcess_TransformUVCoords | aiProcess_FlipUVs |             \
     aiProcess_GlobalScale)

#define CREASE_DEG 40.0f /* keeps the edges of an octagonal column (45 degrees), smooths a 12-sided one (30) */

static const struct aiScene *parse(struct lum_assimp *a)
{
    struct aiFileIO io = lum_assimp_io(a);
    struct aiPropertyStore *settings = aiCreatePropertyStore();
    if (!settings)
        return NULL;
    aiSetImportPropertyInteger(settings, AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    aiSetImportPropertyFloat(settings, AI_CONFIG_PP_GSN_MAX_SMOOTHING_ANGLE, CREASE_DEG);
    aiSetImportPropertyInteger(settings, AI_CONFIG_IMPORT_NO_SKELETON_MESHES, 1);
    const struct aiScene *scene = aiImportFileExWithProperties(a->im->asset, STEPS, &io, settings);
    aiReleasePropertyStore(settings);
    return scene;
}

static enum lum_status explain(struct lum_error *err)
{
    const char *why = aiGetErrorString();
    if (strstr(why, "bad_alloc") || strstr(why, "length_error"))
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory");
    if (strstr(why, "No suitable reader"))
        return lum_fail(err, LUM_ERR_UNSUPPORTED, "",
                        "is no model format that is known: give a .glb, .gltf or .obj, or a .jsonl scene");
    return lum_fail(err, LUM_ERR_INVALID, "", "%.200s", why[0] ? why : "cannot be read");
}

static enum lum_status convert(struct lum_assimp *a, struct lum_error *err)
{
    a->meshes = lum_calloc(a->scene->mNumMeshes, sizeof *a->meshes);
    a->n_shown = lum_calloc(a->scene->mNumMeshes, sizeof *a->n_shown);
    a->materials = lum_calloc(a->scene->mNumMaterials, sizeof *a->materials);
    if (!a->meshes || !a->n_shown || !a->materials)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory");
    lum_emit_progress(&a->im->emit, "build", 0.0);
    enum lum_status status = lum_assimp_flatten_nodes(a, err);
    if (!status)
        status = lum_assimp_nodes(a, err);
    if (!status)
        status = lum_assimp_lights(a, err);
    if (!status)
        status = lum_assimp_cameras(a, err);
    return status;
}

enum lum_status lum_assimp_import(struct lum_importer *im, const struct lum_bytes *file, struct lum_error *err)
{
    struct lum_assimp a = {.im = im, .file = file};
    lum_emit_progress(&im->emit, "parse", 0.0);
    a.scene = parse(&a);
    if (!a.scene)
        return explain(err);
    enum lum_status status = convert(&a, err);
    if (!status && im->emit.n_ops == 0)
        lum_emit_warning(&im->emit, "the file shows nothing");
    for (unsigned i = 0; a.meshes && i < a.scene->mNumMeshes; i++)
        lum_mesh_parts_finish(&a.meshes[i]);
    lum_free(a.meshes);
    lum_free(a.n_shown);
    lum_free(a.materials);
    lum_free(a.images);
    lum_free(a.nodes);
    aiReleaseImport(a.scene);
    return status;
}
