/* One mesh: a scene with a single triangle geometry. Rigid meshes get the MEDIUM builder, or at first the Morton
 * builder and leaves that refer to the corners; deforming ones a BVH that is refitted bottom-up when the positions
 * change, which costs a hundredth of a rebuild. */
#include "core/accel/embree.h"

#include <string.h>

/* Embree reads a vertex as 16 bytes: one number more than there are. */
struct lum_triangles *lum_triangles_create(uint32_t n_vertices, uint32_t n_triangles)
{
    struct lum_triangles *t = lum_calloc(1, sizeof *t);
    if (!t)
        return NULL;
    lum_refs_init(&t->refs);
    t->n_vertices = n_vertices;
    t->n_triangles = n_triangles;
    t->positions = lum_calloc(3 * (size_t)n_vertices + 1, sizeof *t->positions);
    t->indices = lum_calloc(n_triangles, 3 * sizeof *t->indices);
    if (t->positions && t->indices)
        return t;
    lum_triangles_unref(t);
    return NULL;
}

struct lum_triangles *lum_triangles_ref(struct lum_triangles *triangles)
{
    lum_refs_get(&triangles->refs);
    return triangles;
}

void lum_triangles_unref(struct lum_triangles *triangles)
{
    if (!triangles || !lum_refs_put(&triangles->refs))
        return;
    lum_free(triangles->positions);
    lum_free(triangles->indices);
    lum_free(triangles);
}

/* What refits writes positions, while others read those that were given. */
static enum lum_status set_buffers(struct lum_accel_mesh *mesh, bool deforming, struct lum_error *err)
{
    const struct lum_triangles *t = mesh->triangles;
    rtcSetSharedGeometryBuffer(mesh->geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, t->indices, 0,
                               3 * sizeof *t->indices, t->n_triangles);
    if (!deforming) {
        rtcSetSharedGeometryBuffer(mesh->geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, t->positions, 0,
                                   3 * sizeof *t->positions, t->n_vertices);
        return LUM_OK;
    }
    mesh->positions = rtcSetNewGeometryBuffer(mesh->geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                              3 * sizeof(float), t->n_vertices);
    if (!mesh->positions)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a mesh of %u triangles", t->n_triangles);
    memcpy(mesh->positions, t->positions, (size_t)t->n_vertices * 3 * sizeof *t->positions);
    return LUM_OK;
}

static void mesh_destroy(struct lum_accel_mesh *mesh)
{
    if (mesh->geometry)
        rtcReleaseGeometry(mesh->geometry);
    if (mesh->scene)
        rtcReleaseScene(mesh->scene);
    lum_triangles_unref(mesh->triangles);
    lum_free(mesh);
}

static const struct {
    enum RTCSceneFlags flags;
    enum RTCBuildQuality scene, geometry;
} trees[] = {
    [LUM_TREE_FAST] = {RTC_SCENE_FLAG_NONE, RTC_BUILD_QUALITY_MEDIUM, RTC_BUILD_QUALITY_MEDIUM},
    [LUM_TREE_QUICK] = {RTC_SCENE_FLAG_COMPACT, RTC_BUILD_QUALITY_LOW, RTC_BUILD_QUALITY_LOW},
    [LUM_TREE_REFIT] = {RTC_SCENE_FLAG_DYNAMIC, RTC_BUILD_QUALITY_LOW, RTC_BUILD_QUALITY_REFIT},
};

static bool goes_on(void *stop, double done)
{
    (void)done;
    return !atomic_load_explicit((const _Atomic bool *)stop, memory_order_relaxed);
}

static enum lum_status build(struct lum_accel_mesh *mesh, enum lum_tree tree, const _Atomic bool *stop,
                             struct lum_error *err)
{
    rtcSetSceneFlags(mesh->scene, RTC_SCENE_FLAG_ROBUST | LUM_SCENE_FLAG_FILTER | trees[tree].flags);
    rtcSetSceneBuildQuality(mesh->scene, trees[tree].scene);
    rtcSetGeometryBuildQuality(mesh->geometry, trees[tree].geometry);
    rtcSetGeometryMask(mesh->geometry, LUM_MASK_ALL);
#if RTC_VERSION_MAJOR >= 4
    rtcSetGeometryEnableFilterFunctionFromArguments(mesh->geometry, true);
#endif
    if (stop)
        rtcSetSceneProgressMonitorFunction(mesh->scene, goes_on, (void *)(uintptr_t)stop);
    rtcCommitGeometry(mesh->geometry);
    rtcAttachGeometryByID(mesh->scene, mesh->geometry, 0);
    if (stop)
        rtcJoinCommitScene(mesh->scene); /* nobody joins this thread (device.c) */
    else
        rtcCommitScene(mesh->scene);
    enum lum_status status = lum_device_check(mesh->device, "mesh build", err);
    rtcSetSceneProgressMonitorFunction(mesh->scene, NULL, NULL);
    if (status && stop && atomic_load(stop))
        return lum_fail(err, LUM_ERR_CANCELLED, "", "the building of a mesh was stopped");
    return status;
}

enum lum_status lum_accel_mesh_create(struct lum_device *device, struct lum_triangles *triangles, enum lum_tree tree,
                                      const _Atomic bool *stop, struct lum_accel_mesh **ret_mesh, struct lum_error *err)
{
    struct lum_accel_mesh *mesh = lum_calloc(1, sizeof *mesh);
    if (!mesh)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a mesh");
    lum_refs_init(&mesh->refs);
    mesh->device = device;
    mesh->triangles = lum_triangles_ref(triangles);
    mesh->scene = rtcNewScene(device->rtc);
    mesh->geometry = rtcNewGeometry(device->rtc, RTC_GEOMETRY_TYPE_TRIANGLE);
    enum lum_status status = LUM_ERR_NOMEM;
    if (!mesh->scene || !mesh->geometry) {
        lum_fail(err, status, "", "out of memory for a mesh");
        goto fail;
    }
    status = set_buffers(mesh, tree == LUM_TREE_REFIT, err);
    if (status == LUM_OK)
        status = build(mesh, tree, stop, err);
    if (status != LUM_OK)
        goto fail;
    *ret_mesh = mesh;
    return LUM_OK;
fail:
    mesh_destroy(mesh);
    return status;
}

enum lum_status lum_accel_mesh_refit(struct lum_accel_mesh *mesh, const float *positions, struct lum_error *err)
{
    memcpy(mesh->positions, positions, (size_t)mesh->triangles->n_vertices * 3 * sizeof *positions);
    rtcUpdateGeometryBuffer(mesh->geometry, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(mesh->geometry);
    rtcCommitScene(mesh->scene);
    return lum_device_check(mesh->device, "mesh refit", err);
}

struct lum_accel_mesh *lum_accel_mesh_ref(struct lum_accel_mesh *mesh)
{
    lum_refs_get(&mesh->refs);
    return mesh;
}

void lum_accel_mesh_unref(struct lum_accel_mesh *mesh)
{
    if (mesh && lum_refs_put(&mesh->refs))
        mesh_destroy(mesh);
}

bool lum_accel_mesh_unique(const struct lum_accel_mesh *mesh)
{
    return lum_refs_unique(&mesh->refs);
}
