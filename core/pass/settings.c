#include "core/pass/settings.h"

#include "core/trace/stale.h"

bool lum_camera_equal(const struct lum_camera *a, const struct lum_camera *b)
{
    return a->position.x == b->position.x && a->position.y == b->position.y && a->position.z == b->position.z &&
           a->target.x == b->target.x && a->target.y == b->target.y && a->target.z == b->target.z &&
           a->up.x == b->up.x && a->up.y == b->up.y && a->up.z == b->up.z && a->vfov_deg == b->vfov_deg &&
           a->panorama == b->panorama;
}

uint32_t lum_edits_of_settings(const struct lum_view_settings *a, const struct lum_view_settings *b)
{
    bool same_eye = lum_camera_equal(&a->camera, &b->camera) && a->w == b->w && a->h == b->h;
    bool same_method = a->method == b->method && a->seed == b->seed && a->reproject_shadows == b->reproject_shadows &&
                       a->layers_bytes == b->layers_bytes;
    bool same_cache =
        a->storage == b->storage && a->cache_accuracy == b->cache_accuracy && a->deterministic == b->deterministic;
    return lum_edit_if(!same_eye, LUM_EDIT_CAMERA) | lum_edit_if(!same_method, LUM_EDIT_METHOD) |
           lum_edit_if(a->max_depth != b->max_depth, LUM_EDIT_DEPTH) |
           lum_edit_if(a->shadow_samples != b->shadow_samples, LUM_EDIT_SHADOW_SAMPLES) |
           lum_edit_if(a->n_vpls != b->n_vpls, LUM_EDIT_VPLS) | lum_edit_if(!same_cache, LUM_EDIT_CACHE) |
           lum_edit_if(a->illuminance != b->illuminance, LUM_EDIT_QUANTITY);
}

bool lum_view_same_picture(const struct lum_view_settings *a, const struct lum_view_settings *b)
{
    return lum_edits_of_settings(a, b) == 0 && a->antialias == b->antialias && a->effects_off == b->effects_off &&
           a->effects_on == b->effects_on;
}

bool lum_view_same_error(const struct lum_view_settings *a, const struct lum_view_settings *b)
{
    struct lum_view_settings moved = *a;
    moved.camera = b->camera;
    return lum_view_same_picture(&moved, b);
}
