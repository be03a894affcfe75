#include "server/report/shot.h"

#include <math.h>

#include "core/pass/method.h"
#include "server/report/paint.h"
#include "server/world/apply.h"

struct lum_shot {
    const struct lum_snapshot *snapshot;
    struct lum_view *view;
    struct lum_view_settings settings;
    struct lum_opt exposure_ev;
    uint32_t spp;
};

static enum lum_status settings_of(const struct lum_world *w, const struct lum_shot_desc *desc,
                                   struct lum_view_settings *ret_settings, struct lum_error *err)
{
    struct lum_proto_error camera;
    struct lum_view_settings s = lum_view_settings_default();
    enum lum_status st = lum_apply_settings(lum_world_render(w), &s, err);
    s.w = desc->w;
    s.h = desc->h;
    s.max_spp = desc->spp;
    s.method = lum_method_find("live");
    s.deterministic = w->deterministic;
    s.illuminance = desc->illuminance;
    if (desc->camera)
        s.camera = *desc->camera;
    else if (!st && !lum_world_camera(w, NULL, &s.camera, &camera))
        st = lum_fail(err, LUM_ERR_INVALID, "camera", "%s", camera.text);
    *ret_settings = s;
    return st;
}

enum lum_status lum_shot_create(const struct lum_world *w, const struct lum_shot_desc *desc, struct lum_shot **ret_shot,
                                struct lum_error *err)
{
    struct lum_shot *s = lum_calloc(1, sizeof *s);
    if (!s)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a picture");
    s->snapshot = lum_snapshot_ref(lum_world_lit(w));
    s->exposure_ev = lum_world_render(w)->render.exposure_ev;
    enum lum_status st = settings_of(w, desc, &s->settings, err);
    if (!st)
        st = lum_view_create(w->pool, &s->view, err);
    if (st) {
        lum_shot_destroy(s);
        return st;
    }
    lum_view_share(s->view, w->caches);
    *ret_shot = s;
    return LUM_OK;
}

void lum_shot_destroy(struct lum_shot *s)
{
    if (!s)
        return;
    lum_view_destroy(s->view);
    lum_snapshot_unref(s->snapshot);
    lum_free(s);
}

enum lum_status lum_shot_pass(struct lum_shot *s, const _Atomic bool *cancel, bool *ret_done, struct lum_error *err)
{
    struct lum_pass_stats pass = {0};
    enum lum_status st = lum_view_pass(s->view, s->snapshot, &s->settings, cancel, &pass, err);
    *ret_done = !st && pass.complete;
    if (!st)
        s->spp = pass.spp;
    return st;
}

uint32_t lum_shot_spp(const struct lum_shot *s)
{
    return s->spp;
}

enum lum_status lum_shot_paint(const struct lum_shot *s, struct lum_canvas *ret_canvas, struct lum_error *err)
{
    struct lum_overlay overlay = {0};
    const struct lum_overlay_want want = {"illuminance", {.min = NAN, .max = NAN}, true, false};
    const struct lum_film *film = lum_view_film(s->view);
    bool illuminance = s->settings.illuminance;
    enum lum_status st = LUM_OK;
    *ret_canvas = (struct lum_canvas){0};
    if (illuminance)
        st = lum_overlay_make(&overlay, &want, &(struct lum_overlay_source){s->view, s->snapshot, &s->settings}, err);
    const struct lum_png_output output = {
        .film = film,
        .display = {.ev100 = s->exposure_ev.set && !illuminance ? s->exposure_ev.value : lum_exposure_auto(film),
                    .tone = LUM_TONE_AGX},
        .overlay = &overlay,
        .legend = illuminance};
    if (!st && (!illuminance || overlay.classes))
        st = lum_paint_png(&output, ret_canvas, err);
    lum_overlay_finish(&overlay);
    return st;
}
