/* Projects: who asks for the list, and for something to be done with one. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/base/nearest.h"
#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/base/log.h"
#include "server/base/suggest.h"
#include "server/net/session_internal.h"
#include "server/world/scene_source.h"

/* ---- the list ---- */

/* p NULL: it is not open. */
static cJSON *people_in(const struct lum_sessions *t, const struct lum_project *p)
{
    cJSON *people = cJSON_CreateArray();
    for (uint32_t i = 0; p && people && i < LUM_LIMIT_CONNECTIONS; i++) {
        const struct lum_session *s = &t->slots[i];
        if (!lum_session_is_here(s) || s->project != p)
            continue;
        if (lum_json_add(people, NULL, cJSON_CreateString(s->user)))
            continue;
        cJSON_Delete(people);
        return NULL;
    }
    return people;
}

static cJSON *describe(const struct lum_sessions *t, const struct lum_project_info *info)
{
    const struct lum_project *p = lum_projects_find_open(t->config.projects, info->id);
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_string(o, "id", info->id) && lum_json_add_string(o, "name", info->name) &&
              lum_json_add_number(o, "changed_s", (double)info->changed_s);
    if (ok && info->deleted_s)
        ok = lum_json_add_number(o, "deleted_s", (double)info->deleted_s);
    else if (ok)
        ok = lum_json_add_bool(o, "open", p != NULL) && lum_json_add(o, "people", people_in(t, p));
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

static bool read_nothing(const struct lum_session *s, const struct lum_rpc *rpc, struct lum_proto_error *err)
{
    struct lum_json_reader r;
    lum_json_begin(&r, rpc->params, "", err);
    return lum_json_end(&r) && (lum_projects_are_many(s->table->config.projects) ||
                                lum_proto_fail(err, LUM_PROTO_APPLICATION, "unsupported", "method",
                                               "this server has one scene, and no projects"));
}

static cJSON *built_in_scenes(void)
{
    cJSON *scenes = cJSON_CreateArray();
    for (const struct lum_embedded *s = lum_embedded_scenes; scenes && s->key; s++) {
        char name[LUM_PROJECT_SCENE_BYTES + 1];
        snprintf(name, sizeof name, "%.*s", (int)strcspn(s->key, "."), s->key);
        if (lum_json_add(scenes, NULL, cJSON_CreateString(name)))
            continue;
        cJSON_Delete(scenes);
        return NULL;
    }
    return scenes;
}

static cJSON *list(const struct lum_sessions *t)
{
    const struct lum_projects *projects = t->config.projects;
    cJSON *result = cJSON_CreateObject(), *here = cJSON_CreateArray(), *trash = cJSON_CreateArray();
    bool ok = here && trash;
    for (size_t i = 0; i < lum_projects_count(projects) && ok; i++) {
        const struct lum_project_info *info = lum_projects_nth(projects, i);
        ok = lum_json_add(info->deleted_s ? trash : here, NULL, describe(t, info));
    }
    ok = lum_json_add(result, "scenes", built_in_scenes()) && ok;
    ok = lum_json_add(result, "projects", here) && ok;
    ok = lum_json_add(result, "trash", trash) && ok;
    if (ok)
        return result;
    cJSON_Delete(result);
    return NULL;
}

/* Pages that show the list ask every other second: it is written once, until something of it is otherwise. */
static const char *list_text(struct lum_sessions *t)
{
    uint64_t rev = lum_projects_list_rev(t->config.projects);
    if (t->list_text && t->list_rev == rev && t->list_people_rev == t->people_rev)
        return t->list_text;
    cJSON *now = list(t);
    free(t->list_text);
    t->list_text = now ? lum_json_print(now, NULL) : NULL;
    t->list_rev = rev;
    t->list_people_rev = t->people_rev;
    cJSON_Delete(now);
    return t->list_text;
}

struct cJSON *lum_session_list_projects(struct lum_session *s, const struct lum_rpc *rpc, struct lum_proto_error *err)
{
    if (!read_nothing(s, rpc, err))
        return NULL;
    const char *text = list_text(s->table);
    cJSON *result = text ? cJSON_CreateRaw(text) : NULL;
    if (!result)
        lum_proto_fail_memory(err);
    return result;
}

/* ---- orders ---- */

static bool read_name(struct lum_json_reader *r, char ret_name[LUM_LIMIT_PROJECT_NAME_BYTES + 1],
                      struct lum_proto_error *err)
{
    if (!lum_json_require(r, "name") || !lum_json_string(r, "name", ret_name, LUM_LIMIT_PROJECT_NAME_BYTES + 1))
        return false;
    if (lum_project_name_shows(ret_name))
        return true;
    lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "name",
                   "name must be 1 to %u bytes of text that can be seen, without a space before or after it",
                   LUM_LIMIT_PROJECT_NAME_BYTES);
    return lum_json_fail(r);
}

static bool read_scene(struct lum_json_reader *r, struct lum_project_info *info, struct lum_proto_error *err)
{
    char near[LUM_SUGGEST_BYTES];
    if (!lum_json_string(r, "scene", info->scene, sizeof info->scene) || !info->scene[0] ||
        lum_scene_builtin(info->scene))
        return true;
    lum_suggest_scene(info->scene, near);
    lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "not_found", "scene", "no built-in scene has this name%s", near);
    return lum_json_fail(r);
}

/* Paths are made of it. */
static bool read_id(struct lum_json_reader *r, const char *member, lum_project_id ret_id, struct lum_proto_error *err)
{
    if (!lum_json_string(r, member, ret_id, sizeof(lum_project_id)))
        return false;
    if (lum_project_id_is(ret_id))
        return true;
    lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", member, "%s must be an id as this server makes them",
                   member);
    return lum_json_fail(r);
}

/* Nothing, a scene that is built in, or one that is here. */
static bool read_beginning(struct lum_json_reader *r, struct lum_project_order *o, struct lum_proto_error *err)
{
    bool scene = lum_json_member(r, "scene") != NULL, from = lum_json_member(r, "from") != NULL;
    bool version = lum_json_member(r, "version") != NULL;
    if ((scene && from) || (version && !from)) {
        lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", scene ? "scene" : "version",
                       scene ? "scene and from exclude each other" : "version goes with from");
        return lum_json_fail(r);
    }
    return scene ? read_scene(r, &o->info, err)
                 : (!from || read_id(r, "from", o->from, err)) && (!version || read_id(r, "version", o->version, err));
}

static bool read_order(const struct lum_rpc *rpc, struct lum_project_order *o, struct lum_proto_error *err)
{
    struct lum_json_reader r;
    lum_json_begin(&r, rpc->params, "", err);
    bool of_one = o->verb != LUM_PROJECT_CREATE && o->verb != LUM_TRASH_EMPTY;
    if (of_one && lum_json_require(&r, "project"))
        (void)read_id(&r, "project", o->info.id, err);
    if (o->verb == LUM_VERSION_REMOVE && lum_json_require(&r, "version"))
        (void)read_id(&r, "version", o->version, err);
    if (o->verb == LUM_PROJECT_CREATE || o->verb == LUM_PROJECT_RENAME)
        (void)read_name(&r, o->info.name, err);
    if (o->verb == LUM_VERSION_KEEP)
        (void)read_name(&r, o->version_name, err);
    if (o->verb == LUM_PROJECT_CREATE)
        (void)read_beginning(&r, o, err);
    return lum_json_end(&r);
}

bool lum_session_order_project(struct lum_session *s, struct lum_rpc *rpc, enum lum_project_verb verb,
                               struct lum_proto_error *err)
{
    struct lum_project_order o = {.by = s->ref, .rpc_id = rpc->id, .verb = verb};
    memcpy(o.user, s->user, sizeof o.user);
    if (!read_order(rpc, &o, err) || !lum_projects_order(s->table->config.projects, &o, err))
        return false;
    rpc->id = NULL;
    return true;
}

static const char *const done_words[] = {[LUM_PROJECT_CREATE] = "made",
                                         [LUM_PROJECT_RENAME] = "renamed",
                                         [LUM_PROJECT_DELETE] = "deleted",
                                         [LUM_PROJECT_RESTORE] = "brought back",
                                         [LUM_PROJECT_ERASE] = "removed for ever",
                                         [LUM_VERSION_KEEP] = "kept as a version",
                                         [LUM_VERSION_REMOVE] = "rid of a version"};

static cJSON *describe_versions(const struct lum_version_list *list)
{
    cJSON *versions = cJSON_CreateArray();
    bool ok = versions != NULL;
    for (size_t i = 0; i < list->n && ok; i++) {
        cJSON *o = cJSON_CreateObject();
        ok = lum_json_add_string(o, "version", list->versions[i].id) &&
             lum_json_add_string(o, "name", list->versions[i].name) &&
             lum_json_add_number(o, "kept_s", (double)list->versions[i].changed_s);
        if (!ok)
            cJSON_Delete(o);
        ok = ok && lum_json_add(versions, NULL, o);
    }
    if (ok)
        return versions;
    cJSON_Delete(versions);
    return NULL;
}

static void refuse(struct lum_session *s, const char *id, enum lum_status status, const struct lum_error *why)
{
    struct lum_proto_error err;
    const char *app = status == LUM_ERR_NOT_FOUND ? "not_found" : status == LUM_ERR_LIMIT ? "limit_exceeded" : "io";
    lum_proto_fail(&err, LUM_PROTO_APPLICATION, app, "", "%.200s", why->text);
    lum_session_refuse(s, id, &err);
}

static void log_deed(const struct lum_sessions *t, const struct lum_project_order *o)
{
    int level = t->config.audit ? LUM_LOG_AUDIT : LUM_LOG_INFO;
    const char *name = o->verb == LUM_VERSION_KEEP     ? o->version_name
                       : o->verb == LUM_VERSION_REMOVE ? o->version
                                                       : o->info.name;
    if (o->verb == LUM_TRASH_EMPTY)
        lum_log(&t->config.log, level, "projects", "the trash is emptied by %s: %u projects", o->user, o->n_erased);
    else
        lum_log(&t->config.log, level, "projects", "%s is %s by %s: \"%s\"", o->info.id, done_words[o->verb], o->user,
                name);
}

static void answer(struct lum_sessions *t, const struct lum_project_order *o, enum lum_status status,
                   const struct lum_error *why)
{
    struct lum_session *s = o->by.slot < LUM_LIMIT_CONNECTIONS ? &t->slots[o->by.slot] : NULL;
    if ((!status && o->verb != LUM_VERSION_LIST) || o->n_erased > 0)
        log_deed(t, o);
    if (!s || !s->open || s->ref.generation != o->by.generation || !o->rpc_id)
        return;
    if (status) {
        refuse(s, o->rpc_id, status, why);
        return;
    }
    cJSON *result = cJSON_CreateObject();
    bool ok = o->verb == LUM_VERSION_LIST   ? lum_json_add(result, "versions", describe_versions(o->versions))
              : o->verb == LUM_VERSION_KEEP ? lum_json_add_string(result, "version", o->version)
              : o->verb == LUM_TRASH_EMPTY  ? lum_json_add_number(result, "erased", o->n_erased)
                                            : lum_json_add_string(result, "project", o->info.id);
    if (!ok)
        cJSON_Delete(result);
    lum_session_say(s, ok ? lum_rpc_result(o->rpc_id, result) : NULL);
}

void lum_sessions_answer_orders(struct lum_sessions *t)
{
    struct lum_project_order o;
    enum lum_status status;
    struct lum_error err;
    while (lum_projects_next_done(t->config.projects, &o, &status, &err)) {
        answer(t, &o, status, &err);
        free(o.rpc_id);
        lum_free(o.versions);
    }
}
