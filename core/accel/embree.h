/* Private to core/accel: Embree, version 3 or 4, and the objects behind the opaque types. */
#ifndef LUM_CORE_ACCEL_EMBREE_H
#define LUM_CORE_ACCEL_EMBREE_H

#include <pthread.h>

#if LUM_EMBREE_MAJOR >= 4 /* the version that CMake found and links */
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "core/accel/accel.h"

/* Lets a trace call bring its own filter (the alpha test). */
#if RTC_VERSION_MAJOR >= 4
#define LUM_SCENE_FLAG_FILTER RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS
#else
#define LUM_SCENE_FLAG_FILTER RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION
#endif

/* Ray masks: everything is seen by every ray, but hidden shapes are not seen by camera rays. */
#define LUM_MASK_CAMERA 1u
#define LUM_MASK_OTHER 2u
#define LUM_MASK_ALL (LUM_MASK_CAMERA | LUM_MASK_OTHER)

struct lum_device {
    RTCDevice rtc;
    RTCScene unit_shapes[LUM_UNIT_COUNT]; /* what emitter shapes are instances of (emitter_shape.c) */
    char isa[16], version[32];
    bool singly; /* rays are traced one by one */
    /* guarded by lock */
    pthread_mutex_t lock;
    char message[128]; /* last error text from Embree, which may report from a build thread */
};

struct lum_accel_mesh {
    struct lum_refs refs;
    struct lum_device *device;
    RTCScene scene;
    RTCGeometry geometry;
    struct lum_triangles *triangles; /* what it is built of; deforming: but for the positions */
    float *positions;                /* deforming: Embree's own buffer, 3 per vertex; else NULL */
};

struct lum_accel_top {
    struct lum_refs refs;
    struct lum_device *device;
    RTCScene scene;
    struct lum_accel_mesh **meshes; /* one reference per instance; NULL: not in this part */
    struct lum_accel_shape *shapes;
    bool *specks; /* by object: so small that it was left out (top.c) */
    uint32_t n_instances, n_shapes, n_attached;
};

bool lum_unit_shapes_create(struct lum_device *device);
void lum_unit_shapes_destroy(struct lum_device *device);

/* Turns Embree's pending error of this thread into a status; LUM_OK when there is none. */
enum lum_status lum_device_check(struct lum_device *device, const char *what, struct lum_error *err);

#endif
