#include "server/net/hello.h"

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "server/net/session.h"

static struct cJSON *limits_object(void)
{
    static const struct {
        const char *name;
        double value;
    } limits[] = {
        {"message_bytes", LUM_LIMIT_MESSAGE_BYTES}, {"messages_per_s", LUM_LIMIT_MESSAGES_PER_S},
        {"bytes_per_s", LUM_LIMIT_RX_BYTES_PER_S},  {"burst_bytes", LUM_LIMIT_RX_BURST_BYTES},
        {"json_depth", LUM_LIMIT_JSON_DEPTH},       {"ops_per_message", LUM_LIMIT_OPS_PER_MESSAGE},
        {"views", LUM_LIMIT_VIEWS_PER_SESSION},     {"view_side", LUM_LIMIT_VIEW_SIDE},
        {"view_pixels", LUM_LIMIT_VIEW_PIXELS},     {"unacked_frames", LUM_LIMIT_UNACKED_FRAMES},
        {"tile_side", LUM_LIMIT_TILE_SIDE},         {"undo_steps", LUM_LIMIT_UNDO},
        {"undo_bytes", LUM_LIMIT_UNDO_BYTES},       {"upload_bytes", LUM_LIMIT_UPLOAD_BYTES},
        {"upload_files", LUM_LIMIT_UPLOAD_FILES},
    };
    struct cJSON *object = cJSON_CreateObject();
    for (size_t i = 0; object && i < LUM_ARRAY_LEN(limits); i++) {
        if (!lum_json_add_number(object, limits[i].name, limits[i].value)) {
            cJSON_Delete(object);
            return NULL;
        }
    }
    return object;
}

/* null: the one scene, or none. */
static struct cJSON *project_object(const struct lum_project *p)
{
    const struct lum_project_info *info = p ? lum_project_info(p) : NULL;
    if (!info || !info->id[0])
        return cJSON_CreateNull();
    struct cJSON *object = cJSON_CreateObject();
    if (lum_json_add_string(object, "id", info->id) && lum_json_add_string(object, "name", info->name))
        return object;
    cJSON_Delete(object);
    return NULL;
}

static struct cJSON *scene_rev(const struct lum_project *p)
{
    return cJSON_CreateNumber((double)lum_director_scene_rev(lum_project_director(p)));
}

struct cJSON *lum_hello_result(const struct lum_sessions_config *config, const struct lum_hello_answer *a)
{
    struct cJSON *result = cJSON_CreateObject();
    bool ok = lum_json_add_string(result, "session", a->user) &&
              lum_json_add_string(result, "role", lum_role_name(a->role)) &&
              lum_json_add_string(result, "key", a->key) && lum_json_add_bool(result, "resumed", a->resumed) &&
              (a->missed < 0 ? lum_json_add(result, "missed", cJSON_CreateNull())
                             : lum_json_add_number(result, "missed", a->missed)) &&
              lum_json_add_bool(result, "imports", config->imports) &&
              lum_json_add_bool(result, "uploads", a->project && lum_project_uploads(a->project)) &&
              lum_json_add_bool(result, "projects", lum_projects_are_many(config->projects)) &&
              lum_json_add(result, "project", project_object(a->project)) &&
              lum_json_add_string(result, "saved", config->saved ? config->saved : "no") &&
              lum_json_add(result, "limits", limits_object()) &&
              lum_json_add(result, "scene_rev", a->project ? scene_rev(a->project) : cJSON_CreateNull()) &&
              lum_json_add_number(result, "protocol", 1);
    if (ok)
        return result;
    cJSON_Delete(result);
    return NULL;
}

bool lum_hello_read(const struct lum_rpc *rpc, struct lum_hello *ret_hello, struct lum_proto_error *err)
{
    struct lum_json_reader r;
    struct lum_hello hello = {0};
    lum_json_begin(&r, rpc->params, "", err);
    lum_json_string(&r, "token", hello.token, sizeof hello.token);
    lum_json_string(&r, "client", hello.client, sizeof hello.client);
    lum_json_id(&r, "resume", hello.resume);
    lum_json_string(&r, "key", hello.key, sizeof hello.key);
    lum_json_string(&r, "project", hello.project, sizeof hello.project);
    hello.has_scene_rev = lum_json_u64(&r, "scene_rev", &hello.scene_rev);
    *ret_hello = hello;
    return lum_json_end(&r);
}
