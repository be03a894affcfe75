#include "server/world/scene_source.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "server/base/log.h"
#include "server/base/suggest.h"
#include "server/import/expand.h"
#include "server/world/apply.h"

#define LOADER "(scene)" /* not a user name that a session can have, so nobody undoes the scene away */

/* Light of a model that has none: that of a hazy day, so that automatic exposure has daylight to work with. Under the
 * even sky alone white things cannot be told from what is behind them; the sun gives them a bright and a dark side. */
#define DEFAULT_SKY_CD_M2 2000.0 /* pi times that, 6300 lx, on what sees all of it */
#define DEFAULT_SUN_LX 30000.0   /* across the sun; a clear noon has three times that */
#define SKY_ID "default-sky"
#define SUN_ID "default-sun"
#define LIT_CD_M2 10.0 /* a dim screen */
#define LIT_LX 0.3     /* a full moon */
#define CAMERA_ID "main"

static const struct lum_embedded *find_builtin(const struct lum_embedded *e, const char *name)
{
    size_t n = strlen(name);
    for (; e->key; e++)
        if (strncmp(e->key, name, n) == 0 && strcmp(e->key + n, ".jsonl") == 0)
            return e;
    return NULL;
}

const struct lum_embedded *lum_scene_builtin(const char *name)
{
    return find_builtin(lum_embedded_scenes, name);
}

const struct lum_embedded *lum_replay_builtin(const char *name)
{
    return find_builtin(lum_embedded_replays, name);
}

static bool ends_with(const char *s, const char *end)
{
    size_t n = strlen(s), n_end = strlen(end);
    return n >= n_end && strcmp(s + n - n_end, end) == 0;
}

static char *read_file(const char *path, size_t *ret_n, struct lum_proto_error *err)
{
    FILE *f = fopen(path, "rb");
    char *text = NULL;
    if (!f || fseek(f, 0, SEEK_END) != 0)
        goto fail;
    long size = ftell(f);
    if (size < 0 || fseek(f, 0, SEEK_SET) != 0)
        goto fail;
    if ((unsigned long)size > LUM_LIMIT_SCENE_BYTES) {
        lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "", "larger than %u bytes", LUM_LIMIT_SCENE_BYTES);
        fclose(f);
        return NULL;
    }
    text = malloc((size_t)size + 1);
    if (!text || fread(text, 1, (size_t)size, f) != (size_t)size)
        goto fail;
    text[size] = 0;
    fclose(f);
    *ret_n = (size_t)size;
    return text;
fail:
    lum_proto_fail(err, LUM_PROTO_APPLICATION, "io", "", "cannot be read: %s", strerror(errno));
    free(text);
    if (f)
        fclose(f);
    return NULL;
}

static bool read_ops(const char *path, struct lum_ops *ret_ops, struct lum_proto_error *err)
{
    size_t n;
    char *text = read_file(path, &n, err);
    if (!text)
        return false;
    bool ok = lum_ops_from_jsonl(text, n, ret_ops, err);
    free(text);
    return ok;
}

/* A name is a word; what has a slash or a dot is a file. */
static bool is_name(const char *text)
{
    return !strchr(text, '/') && !strchr(text, '.');
}

static bool builtin_ops(const struct lum_embedded *builtin, struct lum_ops *ret_ops, struct lum_proto_error *err)
{
    return lum_ops_from_jsonl((const char *)builtin->bytes, builtin->n, ret_ops, err);
}

/* Of bytes that are compiled in. */
static char *copy_of(const struct lum_embedded *e, size_t *ret_n, struct lum_proto_error *err)
{
    char *text = malloc(e->n + 1);
    if (!text) {
        lum_proto_fail_memory(err);
        return NULL;
    }
    memcpy(text, e->bytes, e->n);
    text[e->n] = 0;
    *ret_n = e->n;
    return text;
}

char *lum_edits_text(const char *replay, size_t *ret_n, struct lum_proto_error *err)
{
    const struct lum_embedded *builtin = lum_replay_builtin(replay);
    if (builtin)
        return copy_of(builtin, ret_n, err);
    char near[LUM_SUGGEST_BYTES];
    if (is_name(replay) && lum_scene_builtin(replay)) {
        lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "", "is a scene, not a replay (see: lumend scenes)");
    } else if (is_name(replay) && access(replay, F_OK) != 0) {
        lum_suggest_scene(replay, near);
        lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "", "no such file or built-in replay%s", near);
    } else {
        return read_file(replay, ret_n, err);
    }
    return NULL;
}

bool lum_edits_load(const char *replay, struct lum_ops *ret_ops, struct lum_proto_error *err)
{
    size_t n;
    char *text = lum_edits_text(replay, &n, err);
    bool ok = text && lum_ops_from_jsonl(text, n, ret_ops, err);
    free(text);
    return ok;
}

/* ---- a model file: one import op, and what the file lacks ---- */

/* Ids that every scene has, or that a bare model is given. */
static bool is_reserved(const char *id)
{
    return strcmp(id, "render") == 0 || strcmp(id, CAMERA_ID) == 0 || strcmp(id, SKY_ID) == 0 ||
           strcmp(id, SUN_ID) == 0;
}

/* An id from a file's name: "/x/Living room.glb" becomes "Living-room". */
static void id_from_path(const char *path, lum_id ret_id)
{
    const char *name = strrchr(path, '/');
    name = name ? name + 1 : path;
    size_t n = 0;
    for (; name[n] && name[n] != '.' && n < LUM_LIMIT_ID_BYTES / 2; n++) {
        char c = name[n];
        bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
        ret_id[n] = c;
        if (!plain)
            ret_id[n] = '-';
    }
    ret_id[n] = 0;
    if (n == 0 || is_reserved(ret_id))
        snprintf(ret_id, sizeof(lum_id), "model");
}

static bool one_op(enum lum_op_kind kind, struct lum_record *record, struct lum_ops *ret_ops,
                   struct lum_proto_error *err)
{
    struct lum_op *op = record ? calloc(1, sizeof *op) : NULL;
    if (!op) {
        lum_record_unref(record);
        return lum_proto_fail_memory(err);
    }
    op->kind = kind;
    memcpy(op->id, record->id, sizeof op->id);
    op->record = record;
    *ret_ops = (struct lum_ops){.ops = op, .n = 1};
    return true;
}

static bool import_op(const char *path, struct lum_ops *ret_ops, struct lum_proto_error *err)
{
    const char *name = strrchr(path, '/');
    name = name ? name + 1 : path;
    if (strlen(name) > LUM_LIMIT_ASSET_BYTES)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "", "a file name is at most %d bytes",
                              LUM_LIMIT_ASSET_BYTES);
    lum_id id;
    id_from_path(path, id);
    struct lum_record *r = lum_record_create(LUM_RECORD_IMPORT, id);
    if (r)
        snprintf(r->import.asset, sizeof r->import.asset, "%s", name);
    return one_op(LUM_OP_IMPORT, r, ret_ops, err);
}

static bool apply_ours(struct lum_world *w, const struct lum_ops *ops, struct lum_proto_error *err)
{
    struct lum_changes changes;
    bool ok = lum_world_apply(w, &(struct lum_edit){.user = LOADER, .ops = ops}, &changes, err);
    if (ok)
        lum_changes_finish(&changes);
    return ok;
}

static bool add_record(struct lum_world *w, struct lum_record *r, struct lum_proto_error *err)
{
    struct lum_ops ops;
    if (!one_op(LUM_OP_ADD, r, &ops, err))
        return false;
    bool ok = apply_ours(w, &ops, err);
    lum_ops_finish(&ops);
    return ok;
}

/* A scene that lumend has written was set so: exposure, samples, glass. Settings that this version does not know, or
 * that are wrong, leave its own. */
static void apply_settings(struct lum_world *w, const struct cJSON *settings)
{
    struct lum_proto_error err;
    struct lum_op *op = calloc(1, sizeof *op);
    struct lum_ops ops = {.ops = op, .n = 1};
    if (!op)
        return;
    op->kind = LUM_OP_SET;
    snprintf(op->id, sizeof op->id, "render");
    op->value = cJSON_Duplicate(settings, true);
    if (!op->value || !apply_ours(w, &ops, &err))
        lum_log(&w->log, LUM_LOG_WARNING, "scene", "the file's settings are not used: %s", op->value ? err.text : "");
    lum_ops_finish(&ops);
}

/* Views start with this camera. */
static bool choose_camera(struct lum_world *w, const char *id, struct lum_proto_error *err)
{
    char text[LUM_LIMIT_ID_BYTES + 128];
    int n = snprintf(text, sizeof text,
                     "{\"lumend\":1,\"kind\":\"scene\"}\n"
                     "{\"op\":\"set\",\"id\":\"render\",\"path\":\"/camera\",\"value\":\"%s\"}\n",
                     id);
    struct lum_ops ops = {0};
    bool ok = lum_ops_from_jsonl(text, (size_t)n, &ops, err) && apply_ours(w, &ops, err);
    lum_ops_finish(&ops);
    return ok;
}

/* The first camera that the file has, in its own order; "": none. */
static void find_first_camera(const struct lum_expansion *e, lum_id ret_id)
{
    ret_id[0] = '\0';
    for (size_t i = 0; i < e->n && !ret_id[0]; i++)
        for (size_t k = 0; k < e->children[i].n && !ret_id[0]; k++)
            if (e->children[i].records[k]->type == LUM_RECORD_CAMERA)
                memcpy(ret_id, e->children[i].records[k]->id, sizeof(lum_id));
}

static bool add_framing_camera(struct lum_world *w, struct lum_proto_error *err)
{
    struct lum_camera c = lum_snapshot_framing_camera(w->snapshot);
    struct lum_record *r = lum_record_create(LUM_RECORD_CAMERA, CAMERA_ID);
    if (r) {
        r->camera = (struct lum_record_camera){{c.position.x, c.position.y, c.position.z},
                                               {c.target.x, c.target.y, c.target.z},
                                               {c.up.x, c.up.y, c.up.z},
                                               c.vfov_deg,
                                               "perspective"};
        lum_log(&w->log, LUM_LOG_INFO, "scene", "the file has no camera: added camera main, which frames everything");
    }
    return add_record(w, r, err);
}

static bool add_sky(struct lum_world *w, struct lum_proto_error *err)
{
    struct lum_record *r = lum_record_create(LUM_RECORD_LIGHT, SKY_ID);
    if (r) {
        snprintf(r->light.kind, sizeof r->light.kind, "environment");
        r->light.flux_lm.set = r->light.intensity_cd.set = r->light.illuminance_lx.set = false;
        r->light.luminance_cd_m2 = (struct lum_opt){true, DEFAULT_SKY_CD_M2};
    }
    return add_record(w, r, err);
}

/* 45 degrees high, and as far to the left of who looks from the scene's camera: what is seen is lit, and so that its
 * sides differ. */
static bool add_sun(struct lum_world *w, struct lum_proto_error *err)
{
    struct lum_camera c;
    if (!lum_world_camera(w, NULL, &c, err))
        return false;
    double x = c.target.x - c.position.x, z = c.target.z - c.position.z, length = hypot(x, z);
    if (!(length > 0.0)) { /* straight up or down */
        x = 0.0;
        z = -1.0;
        length = 1.0;
    }
    struct lum_record *r = lum_record_create(LUM_RECORD_LIGHT, SUN_ID);
    if (r) {
        snprintf(r->light.kind, sizeof r->light.kind, "directional");
        r->light.flux_lm.set = r->light.intensity_cd.set = r->light.luminance_cd_m2.set = false;
        r->light.illuminance_lx = (struct lum_opt){true, DEFAULT_SUN_LX};
        r->light.direction[0] = (x - z) / length;
        r->light.direction[1] = -sqrt(2.0);
        r->light.direction[2] = (z + x) / length;
        lum_log(&w->log, LUM_LOG_INFO, "scene",
                "the file has no light: added default-sky, an even environment of %g cd/m2, and default-sun of %g lx",
                DEFAULT_SKY_CD_M2, DEFAULT_SUN_LX);
    }
    return add_record(w, r, err);
}

static bool commit(struct lum_world *w, struct lum_proto_error *err)
{
    struct lum_error e;
    return !lum_world_commit(w, &e) || lum_apply_error(&e, "", err);
}

/* Does something light the model? Lamps do. What merely glows leaves the rest black: status lights at glTF's unit
 * emission of 1 cd/m2, lava in a landscape. So a surface counts from the luminance of a dim screen up, and once all
 * that count would put the light of a full moon on the sides of the model's box. */
static bool is_lit(const struct lum_snapshot *s)
{
    struct lum_box b;
    struct lum_luminaire l;
    double flux_lm = 0.0;
    for (uint32_t i = 0; i < s->lights.n_lights; i++) {
        if (s->lights.lights[i].kind != &lum_emitter_mesh)
            return true;
        if (lum_snapshot_luminaire(s, i, &l) && l.luminance_cd_m2 >= LIT_CD_M2)
            flux_lm += l.flux_lm;
    }
    if (flux_lm <= 0.0 || !lum_snapshot_bounds(s, NULL, &b))
        return false;
    double x = b.hi.x - b.lo.x, y = b.hi.y - b.lo.y, z = b.hi.z - b.lo.z;
    return flux_lm >= LIT_LX * 2.0 * (x * y + y * z + z * x);
}

/* was_ours: it is a scene that lumend has written, as dark as it was. */
static bool add_what_a_model_lacks(struct lum_world *w, const char *camera, bool was_ours, struct lum_proto_error *err)
{
    return (camera[0] ? choose_camera(w, camera, err) : add_framing_camera(w, err)) &&
           (was_ours || is_lit(w->snapshot) || (add_sky(w, err) && commit(w, err) && add_sun(w, err))) &&
           commit(w, err);
}

/* ---- all kinds ---- */

struct source {
    struct lum_ops ops;
    bool is_model;
    lum_id camera;          /* the first that an import brought; "": none */
    struct cJSON *settings; /* that the file was written with; NULL: none. Owned */
    char dir[4096];         /* where assets are looked for when the configuration names no place; "": nowhere */
};

static bool open_source(const char *scene, struct source *ret_source, struct lum_proto_error *err)
{
    const struct lum_embedded *builtin = lum_scene_builtin(scene);
    if (builtin)
        return builtin_ops(builtin, &ret_source->ops, err);
    const char *slash = strrchr(scene, '/');
    int n_dir = slash ? (int)(slash - scene) + 1 : 0;
    if ((size_t)n_dir + 2 > sizeof ret_source->dir)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "", "the path of the scene is too long");
    snprintf(ret_source->dir, sizeof ret_source->dir, "%.*s", slash ? n_dir : 1, slash ? scene : ".");
    if (ends_with(scene, ".jsonl"))
        return read_ops(scene, &ret_source->ops, err);
    if (lum_replay_builtin(scene))
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "",
                              "is a replay, not a scene (see: lumend scenes)");
    if (is_name(scene)) {
        char near[LUM_SUGGEST_BYTES];
        lum_suggest_scene(scene, near);
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "", "no built-in scene has this name%s", near);
    }
    ret_source->is_model = true;
    return import_op(scene, &ret_source->ops, err);
}

static bool apply_source(struct lum_world *w, struct source *source, const struct lum_import_config *import,
                         struct lum_proto_error *err)
{
    struct lum_import_config config = *import;
    struct lum_totals_guard guard = {w->totals, w->limits};
    config.admit = lum_totals_admit;
    config.admit_user = &guard;
    if (source->dir[0] && (source->is_model || !config.assets_dir))
        config.assets_dir = source->dir;
    struct lum_expansion expansion = {0};
    if (!lum_ops_expand(&(struct lum_expand_context){.config = &config}, &source->ops, &expansion, err))
        return false;
    for (size_t i = 0; i < expansion.n_warnings; i++)
        lum_log(&w->log, LUM_LOG_WARNING, "import", "%s", expansion.warnings[i]);
    find_first_camera(&expansion, source->camera);
    source->settings = expansion.settings;
    expansion.settings = NULL;
    struct lum_changes changes;
    struct lum_edit edit = {LOADER, &source->ops, expansion.children, expansion.n};
    bool ok = lum_world_apply(w, &edit, &changes, err);
    if (ok)
        lum_changes_finish(&changes);
    lum_expansion_finish(&expansion);
    return ok && commit(w, err);
}

/* The user wrote no op that err->path could lead into, and knows the file as `scene`: its last part is not told again.
 */
static void forget_our_op(const char *scene, struct lum_proto_error *err)
{
    const char *slash = strrchr(scene, '/'), *name = slash ? slash + 1 : scene;
    size_t n = strlen(name);
    err->path[0] = '\0';
    if (strncmp(err->text, name, n) == 0 && strncmp(err->text + n, ": ", 2) == 0)
        memmove(err->text, err->text + n + 2, strlen(err->text + n + 2) + 1);
}

bool lum_scene_begin(struct lum_world *w, struct lum_proto_error *err)
{
    static const char camera[] = "{\"lumend\":1,\"kind\":\"scene\"}\n"
                                 "{\"op\":\"add\",\"type\":\"camera\",\"id\":\"main\",\"position\":[0,1.6,5],"
                                 "\"target\":[0,1.2,0],\"up\":[0,1,0],\"vfov_deg\":50}\n";
    struct source source = {0};
    bool ok = lum_ops_from_jsonl(camera, sizeof camera - 1, &source.ops, err) &&
              apply_source(w, &source, &(struct lum_import_config){0}, err);
    lum_ops_finish(&source.ops);
    return ok;
}

bool lum_scene_load(struct lum_world *w, const char *scene, const struct lum_import_config *import,
                    struct lum_proto_error *err)
{
    struct source source = {0};
    if (!open_source(scene, &source, err))
        return false;
    bool ok = apply_source(w, &source, import, err);
    if (ok && source.is_model && source.settings)
        apply_settings(w, source.settings);
    ok = ok && (!source.is_model || add_what_a_model_lacks(w, source.camera, source.settings, err));
    cJSON_Delete(source.settings);
    if (!ok)
        lum_ops_name_line(&source.ops, err);
    if (!ok && source.is_model)
        forget_our_op(scene, err);
    lum_ops_finish(&source.ops);
    return ok;
}
