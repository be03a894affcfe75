/* What was, for people: names of moments. Which edits led to now, by whom and when: timeline_get.h. How views show one:
 * view_moment.h; how the scene goes back to one: scene.revert, an edit. */
#include "server/director/internal.h"

#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "server/director/read_request.h"
#include "server/director/saving.h"
#include "server/project/store.h"

static bool read_name(struct lum_json_reader *r, struct lum_request *q)
{
    bool ok = lum_json_require(r, "scene_rev") && lum_json_u64(r, "scene_rev", &q->rev) &&
              lum_json_require(r, "name") && lum_json_string(r, "name", q->name, sizeof q->name) && lum_json_end(r);
    if (!ok || !q->name[0] || lum_project_name_shows(q->name))
        return ok;
    lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "invalid_value", "name",
                   "name must be 1 to %u bytes of text that can be seen, without a space before or after it, or empty",
                   LUM_LIMIT_MOMENT_NAME_BYTES);
    return lum_json_fail(r);
}

static void name(struct lum_director *d, const struct lum_request *q)
{
    struct lum_proto_error err;
    struct lum_moment_name was;
    if (!lum_director_may_edit(d, &err) ||
        !lum_document_name_moment(d->world.doc, q->user, q->rev, q->name, &was, &err)) {
        lum_director_refuse(d, q, &err);
        return;
    }
    uint64_t seq = lum_director_note_name(d, q, &was);
    lum_director_reply_edit(d, q, cJSON_CreateObject(), seq);
    lum_director_tell_name(d, was.rev, q->name, q->user);
}

const struct lum_request_type lum_request_timeline_name = {.name = "timeline.name", .read = read_name, .answer = name};
