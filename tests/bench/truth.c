/* How right the light is: every built-in scene and third-party models, for `live`, `path` and whatever methods are
 * asked for, against `path` of another seed, anti-aliased like them, 600 x 400.
 *
 * By blocks (core/metric/blocks.h), so that light that is missing shows and noise does not; SMAPE and relMSE beside
 * them. Of the rough picture before it, at the first full frame, while something moves, and after 0.1 to 30 seconds at
 * rest; what each effect alone has of its light; the cost of the first frame in samples of `path`, in turns. A figure
 * says how sure its reference is.
 *
 * Others may use the machine: time is that of a machine of its own (truth_time), and rays are exact. */
#include "tests/bench/truth.h"

#include <stdlib.h>
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
static const char *const quick_scenes[] = {"cornell", "desk"};

enum { MAX_SCENES = 64 };
struct place {
    char source[4096];  /* name or file */
    char scene[64];     /* as it is called */
    const char *camera; /* NULL: the scene's own */
};
struct places {
    struct place items[MAX_SCENES];
    size_t n;
};

static bool failed(const char *text)
{
    fprintf(stderr, "lumend-bench: %s\n", text);
    return false;
}

/* ---- which scenes ---- */

static bool ends_with(const char *text, const char *end)
{
    size_t n = strlen(text), n_end = strlen(end);
    return n >= n_end && strcmp(text + n - n_end, end) == 0;
}

static void add_place(struct places *p, const char *source, const char *name, const char *camera)
{
    struct place *place = &p->items[p->n++];
    snprintf(place->source, sizeof place->source, "%s", source);
    if (camera)
        snprintf(place->scene, sizeof place->scene, "%.40s (%.20s)", name, camera);
    else
        snprintf(place->scene, sizeof place->scene, "%.60s", name);
    place->camera = camera;
}

static void list_all(const struct lum_bench_options *o, struct places *ret_places)
{
    char path[4096];
    struct stat st;
    for (const struct lum_embedded *e = lum_embedded_scenes; e->key && ret_places->n < MAX_SCENES; e++) {
        snprintf(path, sizeof path, "%.*s", (int)strcspn(e->key, "."), e->key);
        add_place(ret_places, path, path, NULL);
    }
    for (size_t i = 0; i < LUM_ARRAY_LEN(models) && ret_places->n < MAX_SCENES; i++) {
        snprintf(path, sizeof path, "%s/%s", o->models, models[i].path);
        if (stat(path, &st) == 0)
            add_place(ret_places, path, models[i].path, models[i].camera);
        else
            printf("skipped: no %s\n", path);
    }
}

/* A model of the list through the first camera that it is listed with. */
static void list_one(const struct lum_bench_options *o, struct places *ret_places)
{
    const char *camera = o->camera, *name = lum_bench_scene_name(o->scene);
    for (size_t i = 0; i < LUM_ARRAY_LEN(models); i++)
        if (ends_with(o->scene, models[i].path)) {
            camera = camera ? camera : models[i].camera;
            name = models[i].path;
        }
    add_place(ret_places, o->scene, name, camera);
}

static void list_places(const struct lum_bench_options *o, struct places *ret_places)
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

/* ---- a scene ---- */

static bool find_methods(struct truth_rig *rig)
{
    const char *list = rig->options->methods;
    for (rig->n_methods = 0; rig->n_methods < TRUTH_METHODS;) {
        char name[32];
        size_t n = strcspn(list, ",");
        snprintf(name, sizeof name, "%.*s", n < sizeof name ? (int)n : 0, list);
        if (!(rig->methods[rig->n_methods++] = lum_method_find(name))) {
            fprintf(stderr, "lumend-bench: --methods: no method '%.*s' (see: lumend methods)\n", (int)n, list);
            return false;
        }
        if (!list[n])
            return true;
        list += n + 1;
    }
    return failed("--methods has too many");
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

static bool find_camera(struct truth_rig *rig, const char *camera)
{
    struct lum_proto_error err;
    struct wanted wanted = {.camera = camera};
    if (!camera)
        return lum_world_camera(&rig->world, NULL, &rig->settings.camera, &err);
    if (!lum_document_each(rig->world.doc, note_camera, &wanted))
        return failed("out of memory");
    if (!wanted.found) {
        fprintf(stderr, "lumend-bench: %s has no camera '%s'\n", rig->scene, camera);
        return false;
    }
    rig->settings.camera = lum_apply_camera(&wanted.found->camera);
    return true;
}

static bool open_rig(struct truth_rig *rig, const struct place *place)
{
    struct lum_error err = {0};
    snprintf(rig->scene, sizeof rig->scene, "%s", place->scene);
    if (!lum_bench_world(place->source, 0, &rig->world))
        return false;
    rig->settings = lum_view_settings_default();
    if (lum_apply_settings(lum_world_render(&rig->world), &rig->settings, &err) != LUM_OK)
        return failed(err.text);
    rig->settings.w = rig->options->quick ? 120 : 600;
    rig->settings.h = rig->options->quick ? 80 : 400;
    rig->settings.max_spp = LUM_LIMIT_SPP;
    lum_bench_machine(&rig->world, rig->study->machine, sizeof rig->study->machine);
    return find_camera(rig, place->camera);
}

static bool measure_scene(struct truth_rig *rig, const struct place *place)
{
    lum_bench_progress("truth: %s", place->scene);
    if (!open_rig(rig, place)) {
        printf("skipped: %s\n", place->scene);
        return true;
    }
    uint32_t spp = rig->options->quick ? 8 : rig->options->reference_spp;
    lum_bench_progress("truth: %s: reference", rig->scene);
    if (!truth_reference_make(rig, &rig->settings, spp, &rig->reference) || !truth_page_scene(rig))
        return false;
    return truth_measure_rest(rig) && truth_measure_costs(rig) && truth_measure_effects(rig) &&
           truth_measure_moving(rig);
}

/* ---- the study ---- */

static bool make_room(struct truth_study *s, size_t n_scenes)
{
    s->max_rows = n_scenes * TRUTH_METHODS * (TRUTH_TIMES + 3);
    s->max_costs = n_scenes * TRUTH_METHODS;
    s->max_effects = n_scenes * TRUTH_METHODS * LUM_EFFECT_COUNT;
    s->rows = lum_calloc(s->max_rows, sizeof *s->rows);
    s->costs = lum_calloc(s->max_costs, sizeof *s->costs);
    s->effects = lum_calloc(s->max_effects, sizeof *s->effects);
    return (s->rows && s->costs && s->effects) || failed("out of memory");
}

static void free_study(struct truth_study *s)
{
    lum_free(s->rows);
    lum_free(s->costs);
    lum_free(s->effects);
}

int lum_bench_truth_study(const struct lum_bench_options *options)
{
    struct truth_study study = {0};
    struct truth_rig methods = {.options = options};
    struct places *places = lum_calloc(1, sizeof *places);
    bool ok = places ? find_methods(&methods) : failed("out of memory");
    if (ok) {
        list_places(options, places);
        ok = make_room(&study, places->n) && truth_page_open(&study, options);
    }
    for (size_t i = 0; i < (ok ? places->n : 0) && ok; i++) {
        struct truth_rig rig = methods;
        rig.study = &study;
        ok = measure_scene(&rig, &places->items[i]);
        truth_reference_finish(&rig.reference);
        lum_world_finish(&rig.world);
    }
    ok = ok && truth_report(&study, options);
    ok = truth_page_close(&study) && ok;
    free_study(&study);
    lum_free(places);
    return ok ? 0 : 1;
}
