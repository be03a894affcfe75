#include "tests/bench/places.h"

#include <string.h>
#include <sys/stat.h>

#include "server/base/embed.h"
#include "server/world/apply.h"

/* Models, and the camera that they are looked at through: its id's end. */
static const struct {
    const char *path, *camera;
} models[] = {
    {"interiors/office.glb", "model_vp"},
    {"interiors/office.glb", "room"},
    {"interiors/conf_lbl_mgf.glb", "current_vf"},
    {"interiors/conference_mcguire.glb", "corner"},
    {"interiors/crytek_sponza.glb", "atrium_floor"},
    {"interiors/dabrovic_sponza.glb", "atrium"},
    {"interiors/sibenik.glb", "nave"},
    {"classic_gi/erw_scene6.glb", "viewing_ps"},
    {"classic_gi/erw_scene8.glb", "viewing_ps"},
    {"cornell/cornell_measured.glb", "cornell_camera"},
    {"cornell/CornellBox-Sphere.glb", "cornell_view"},
    {"cornell/CornellBox-Glossy.glb", "cornell_view"},
    {"cornell/CornellBox-Water.glb", "cornell_view"},
};
static const char *const quick_scenes[] = {"desk"}; /* light of all kinds */

static bool ends_with(const char *text, const char *end)
{
    size_t n = strlen(text), n_end = strlen(end);
    return n >= n_end && strcmp(text + n - n_end, end) == 0;
}

static void add_place(struct lum_bench_places *p, const char *source, const char *name, const char *camera)
{
    struct lum_bench_place *place = &p->items[p->n++];
    snprintf(place->source, sizeof place->source, "%s", source);
    if (camera)
        snprintf(place->scene, sizeof place->scene, "%.40s (%.20s)", name, camera);
    else
        snprintf(place->scene, sizeof place->scene, "%.60s", name);
    place->camera = camera;
}

static void list_all(const struct lum_bench_options *o, struct lum_bench_places *ret_places)
{
    char path[4096];
    struct stat st;
    for (const struct lum_embedded *e = lum_embedded_scenes; e->key && ret_places->n < LUM_BENCH_PLACES; e++) {
        snprintf(path, sizeof path, "%.*s", (int)strcspn(e->key, "."), e->key);
        add_place(ret_places, path, path, NULL);
    }
    for (size_t i = 0; i < LUM_ARRAY_LEN(models) && ret_places->n < LUM_BENCH_PLACES; i++) {
        snprintf(path, sizeof path, "%s/%s", o->models, models[i].path);
        if (stat(path, &st) == 0)
            add_place(ret_places, path, models[i].path, models[i].camera);
        else
            printf("skipped: no %s\n", path);
    }
}

/* A model of the list through the first camera that it is listed with. */
static void list_one(const struct lum_bench_options *o, struct lum_bench_places *ret_places)
{
    const char *camera = o->camera, *name = lum_bench_scene_name(o->scene);
    for (size_t i = 0; i < LUM_ARRAY_LEN(models); i++)
        if (ends_with(o->scene, models[i].path)) {
            camera = camera ? camera : models[i].camera;
            name = models[i].path;
        }
    add_place(ret_places, o->scene, name, camera);
}

void lum_bench_list_places(const struct lum_bench_options *o, struct lum_bench_places *ret_places)
{
    ret_places->n = 0;
    if (o->scene)
        list_one(o, ret_places);
    else if (o->quick)
        for (size_t i = 0; i < LUM_ARRAY_LEN(quick_scenes); i++)
            add_place(ret_places, quick_scenes[i], quick_scenes[i], NULL);
    else
        list_all(o, ret_places);
}

bool lum_bench_find_methods(const char *list, const struct lum_method *ret_methods[LUM_BENCH_METHODS], size_t *ret_n)
{
    for (*ret_n = 0; *ret_n < LUM_BENCH_METHODS;) {
        char name[32];
        size_t n = strcspn(list, ",");
        snprintf(name, sizeof name, "%.*s", n < sizeof name ? (int)n : 0, list);
        if (!(ret_methods[(*ret_n)++] = lum_method_find(name))) {
            fprintf(stderr, "lumend-bench: --methods: no method '%.*s' (see: lumend methods)\n", (int)n, list);
            return false;
        }
        if (!list[n])
            return true;
        list += n + 1;
    }
    fprintf(stderr, "lumend-bench: --methods has more than %d\n", LUM_BENCH_METHODS);
    return false;
}

struct wanted {
    const char *camera;
    const struct lum_record *found;
};

static void note_camera(void *user, const struct lum_record *r)
{
    struct wanted *w = user;
    if (r->type == LUM_RECORD_CAMERA && !w->found && ends_with(r->id, w->camera))
        w->found = r;
}

bool lum_bench_place_camera(const struct lum_bench_place *place, struct lum_world *world, struct lum_camera *ret_camera)
{
    struct lum_proto_error err;
    struct wanted wanted = {.camera = place->camera};
    if (!place->camera)
        return lum_world_camera(world, NULL, ret_camera, &err);
    if (!lum_document_each(world->doc, note_camera, &wanted)) {
        fprintf(stderr, "lumend-bench: out of memory\n");
        return false;
    }
    if (!wanted.found) {
        fprintf(stderr, "lumend-bench: %s has no camera '%s'\n", place->scene, place->camera);
        return false;
    }
    *ret_camera = lum_apply_camera(&wanted.found->camera);
    return true;
}

/* ---- a study's way through all places ---- */

bool lum_bench_stand_open(struct lum_bench_stand *stand, const uint32_t whole[2], const uint32_t quick[2])
{
    struct lum_error err = {0};
    if (!lum_bench_world(stand->place->source, 0, &stand->world))
        return false;
    stand->settings = lum_view_settings_default();
    if (lum_apply_settings(lum_world_render(&stand->world), &stand->settings, &err) != LUM_OK)
        return lum_bench_failed(err.text);
    lum_bench_size(stand->options, whole, quick, &stand->settings);
    stand->picture = lum_calloc(3 * (size_t)stand->settings.w * stand->settings.h, sizeof *stand->picture);
    return stand->picture ? lum_bench_place_camera(stand->place, &stand->world, &stand->settings.camera)
                          : lum_bench_failed("out of memory");
}

void lum_bench_stand_close(struct lum_bench_stand *stand)
{
    lum_free(stand->picture);
    lum_world_finish(&stand->world);
}

bool lum_bench_go(const struct lum_bench_tour *tour, const struct lum_bench_options *options, void *results)
{
    const struct lum_method *methods[LUM_BENCH_METHODS];
    size_t n_methods;
    struct lum_bench_places *places = lum_calloc(1, sizeof *places);
    struct lum_bench_stand *rig = lum_calloc(1, tour->rig_bytes);
    bool ok = places && rig
                  ? lum_bench_find_methods(options->methods ? options->methods : tour->methods, methods, &n_methods)
                  : lum_bench_failed("out of memory");
    if (ok)
        lum_bench_list_places(options, places);
    for (size_t i = 0; ok && i < places->n; i++) {
        memset(rig, 0, tour->rig_bytes);
        *rig = (struct lum_bench_stand){.options = options, .place = &places->items[i], .n_methods = n_methods};
        memcpy(rig->methods, methods, sizeof methods);
        ok = tour->measure(rig, results);
        tour->close(rig);
    }
    lum_free(rig);
    lum_free(places);
    return ok;
}
