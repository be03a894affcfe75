#include "server/cli/shot.h"

#include <math.h>

#include "core/pass/method.h"
#include "server/cli/image_output.h"
#include "server/world/apply.h"

static enum lum_status settings_of(const struct lum_world *w, const struct lum_shot *shot,
                                   struct lum_view_settings *ret_settings, struct lum_error *err)
{
    struct lum_proto_error camera;
    struct lum_view_settings s = lum_view_settings_default();
    enum lum_status st = lum_apply_settings(lum_world_render(w), &s, err);
    s.w = shot->w;
    s.h = shot->h;
    s.max_spp = shot->spp;
    s.method = lum_method_find("live");
    s.deterministic = w->deterministic;
    s.illuminance = shot->illuminance;
    if (!st && !lum_world_camera(w, NULL, &s.camera, &camera))
        st = lum_fail(err, LUM_ERR_INVALID, "camera", "%s", camera.text);
    *ret_settings = s;
    return st;
}

static enum lum_status refine(const struct lum_world *w, const struct lum_shot *shot, struct lum_view *view,
                              const struct lum_view_settings *settings, struct lum_error *err)
{
    struct lum_pass_stats pass = {0};
    while (!pass.complete) {
        enum lum_status st = lum_view_pass(view, w->snapshot, settings, NULL, &pass, err);
        if (st)
            return st;
        if (shot->tell)
            shot->tell(shot->user, pass.spp);
    }
    return LUM_OK;
}

static enum lum_status paint(const struct lum_world *w, const struct lum_shot *shot, struct lum_view *view,
                             const struct lum_view_settings *settings, struct lum_canvas *ret_canvas,
                             struct lum_error *err)
{
    struct lum_overlay overlay = {0};
    const struct lum_overlay_want want = {"illuminance", {.min = NAN, .max = NAN}, true, false};
    const struct lum_film *film = lum_view_film(view);
    enum lum_status st = LUM_OK;
    if (shot->illuminance)
        st = lum_overlay_make(&overlay, &want, &(struct lum_overlay_source){view, w->snapshot, settings}, err);
    const struct lum_opt ev = lum_world_render(w)->render.exposure_ev;
    const struct lum_png_output output = {
        .film = film,
        .display = {.ev100 = ev.set && !shot->illuminance ? ev.value : lum_exposure_auto(film), .tone = LUM_TONE_AGX},
        .overlay = &overlay,
        .legend = shot->illuminance};
    if (!st && (!shot->illuminance || overlay.classes))
        st = lum_paint_png(&output, ret_canvas, err);
    lum_overlay_finish(&overlay);
    return st;
}

enum lum_status lum_shot_take(const struct lum_world *w, const struct lum_shot *shot, struct lum_canvas *ret_canvas,
                              struct lum_error *err)
{
    struct lum_view_settings settings;
    struct lum_view *view = NULL;
    *ret_canvas = (struct lum_canvas){0};
    enum lum_status st = settings_of(w, shot, &settings, err);
    if (!st)
        st = lum_view_create(w->pool, &view, err);
    if (st)
        return st;
    lum_view_share(view, w->caches);
    st = refine(w, shot, view, &settings, err);
    if (!st)
        st = paint(w, shot, view, &settings, ret_canvas, err);
    lum_view_destroy(view);
    return st;
}
