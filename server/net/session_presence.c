#include <stddef.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "protocol/record/field.h"
#include "server/net/session_internal.h"

#define TOLD_EVERY_NS (1000000000ll / LUM_LIMIT_PRESENCE_PER_S)

/* As a view has it. */
static const struct lum_field camera_row = {.name = "camera",
                                            .kind = LUM_FIELD_PARTS,
                                            .offset = offsetof(struct lum_presence, camera),
                                            .n = sizeof(struct lum_record_camera),
                                            .parts = &lum_camera_fields};

/* ---- what is said ---- */

static void read_camera(struct lum_json_reader *r, struct lum_presence *p)
{
    const cJSON *camera = lum_json_any_member(r, "camera");
    if (!camera)
        return;
    p->has_camera = lum_field_take(&camera_row, p, r);
    if (p->has_camera && !lum_camera_validate(&p->camera, r->err)) {
        lum_proto_prefix(r->err, "camera");
        lum_json_fail(r);
    }
}

static void read_point(struct lum_json_reader *r, struct lum_presence *p)
{
    const cJSON *point = lum_json_any_member(r, "point");
    if (point)
        p->has_point = lum_json_numbers(r, "point", 3, -LUM_LIMIT_COORD_M, LUM_LIMIT_COORD_M, p->point);
}

struct cJSON *lum_session_be_present(struct lum_session *s, const struct lum_rpc *rpc, struct lum_proto_error *err)
{
    struct lum_json_reader r;
    struct lum_presence p = s->presence;
    lum_json_begin(&r, rpc->params, "", err);
    read_camera(&r, &p);
    read_point(&r, &p);
    if (!lum_json_end(&r) || !lum_session_has_scene(s, err))
        return NULL;
    p.listens = true;
    s->presence = p;
    lum_session_stir(s);
    return cJSON_CreateObject();
}

/* ---- what is told ---- */

static bool waits(const struct lum_session *s)
{
    return s->presence.stale && s->presence.listens && s->project && lum_session_is_here(s);
}

void lum_session_stir(const struct lum_session *s)
{
    for (uint32_t i = 0; s->project && i < LUM_LIMIT_CONNECTIONS; i++)
        if (s->table->slots[i].project == s->project)
            s->table->slots[i].presence.stale = true;
}

bool lum_sessions_presence_waits(const struct lum_sessions *t)
{
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++)
        if (waits(&t->slots[i]))
            return true;
    return false;
}

static cJSON *describe(const struct lum_session *s)
{
    const struct lum_presence *p = &s->presence;
    cJSON *o = cJSON_CreateObject();
    if (lum_json_add_string(o, "session", s->user) && lum_json_add_string(o, "person", s->person.name) &&
        lum_json_add_string(o, "role", lum_role_name(s->person.role)) &&
        lum_json_add(o, "camera", p->has_camera ? lum_field_write(&camera_row, p) : cJSON_CreateNull()) &&
        lum_json_add(o, "point", p->has_point ? cJSON_CreateDoubleArray(p->point, 3) : cJSON_CreateNull()))
        return o;
    cJSON_Delete(o);
    return NULL;
}

/* Everybody in the project, as they stand now. NULL: memory is short. */
static struct lum_text *picture_of(struct lum_sessions *t, const struct lum_project *p)
{
    cJSON *params = cJSON_CreateObject(), *people = cJSON_CreateArray();
    bool ok = people != NULL;
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS && ok; i++)
        if (t->slots[i].project == p && !lum_session_outstayed(&t->slots[i]) && lum_session_is_here(&t->slots[i]))
            ok = lum_json_add(people, NULL, describe(&t->slots[i]));
    ok = lum_json_add(params, "people", people) && ok;
    if (!ok) {
        cJSON_Delete(params);
        return NULL;
    }
    return lum_text_create(lum_rpc_notification("presence", params));
}

/* Older text comes first, and the picture has as many bytes as the news: texts go before tiles, and on a line that
 * takes longer for one than it is until the next there would be nothing but news. */
static bool is_slow(const struct lum_session *s)
{
    if (s->text.first || s->sending_text)
        return true;
    for (uint32_t i = 0; i < s->n_streams; i++)
        if (lum_stream_pending(s->streams[i]))
            return s->presence.tile_bytes < s->presence.text_bytes;
    return false;
}

static void tell(struct lum_session *s, struct lum_text *text)
{
    s->presence.stale = false;
    s->presence.text_bytes = text->n_bytes;
    s->presence.tile_bytes = 0;
    lum_session_queue_text(s, text);
}

/* Tells all of one project that are due; one text serves them, which the first who takes it has made. Whom it does not
 * reach hears of what is newest the next time. */
static void tell_project(struct lum_sessions *t, const struct lum_project *p, int64_t tick)
{
    struct lum_text *text = NULL;
    bool made = false; /* text is NULL all the same where memory was short */
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++) {
        struct lum_session *s = &t->slots[i];
        if (s->project != p || !waits(s) || s->presence.told_tick == tick || lum_session_outstayed(s))
            continue;
        s->presence.told_tick = tick;
        if (is_slow(s))
            continue;
        if (!made)
            text = picture_of(t, p);
        made = true;
        if (text)
            tell(s, text);
    }
    lum_text_unref(text);
}

/* All are told by the ticks of one clock: what everybody moves between two of them is put into words once, not for
 * each who listens. */
int64_t lum_sessions_tell_presence(struct lum_sessions *t, int64_t now_ns)
{
    int64_t tick = now_ns / TOLD_EVERY_NS;
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++)
        if (waits(&t->slots[i]) && t->slots[i].presence.told_tick != tick)
            tell_project(t, t->slots[i].project, tick);
    return lum_sessions_presence_waits(t) ? (tick + 1) * TOLD_EVERY_NS - now_ns : INT64_MAX;
}
