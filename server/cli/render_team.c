#include "server/cli/render_team.h"

#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "core/accel/accel.h"
#include "protocol/json/json.h"

double lum_render_spent_ms(struct lum_team *team, int64_t start_ns, struct lum_pass_stats *inout_pass)
{
    double spent_ms = (double)(lum_clock_ns() - start_ns) * 1e-6;
    if (!team)
        return spent_ms;
    inout_pass->ms = lum_team_agree(team, inout_pass->ms);
    return lum_team_agree(team, spent_ms);
}

bool lum_render_add_told(struct cJSON *run, const struct lum_team *team, const struct lum_render_told *told)
{
    if (!team)
        return true;
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_number(o, "ranks", team->size) &&
              lum_json_add_number(o, "scene_bytes", (double)told->scene_bytes) &&
              lum_json_add_number(o, "edits_bytes", (double)told->edits_bytes);
    return lum_json_add(run, "team", o) && ok;
}

bool lum_render_add_heard(struct cJSON *frame, const struct lum_team *team, struct lum_render_told *inout_told)
{
    if (!team)
        return true;
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_number(o, "heard_bytes", (double)(team->heard_bytes - inout_told->heard_bytes));
    inout_told->heard_bytes = team->heard_bytes;
    return lum_json_add(frame, "team", o) && ok;
}

/* FNV-1a, of words. */
static uint64_t hash_more(uint64_t hash, const void *data, size_t n_bytes)
{
    const unsigned char *at = data;
    for (; n_bytes > 0; at += sizeof hash) {
        uint64_t word = 0;
        size_t n = n_bytes < sizeof word ? n_bytes : sizeof word;
        memcpy(&word, at, n);
        hash = (hash ^ word) * UINT64_C(0x100000001b3);
        hash ^= hash >> 32;
        n_bytes -= n;
    }
    return hash;
}
#define HASH_BEGIN UINT64_C(0xcbf29ce484222325)

bool lum_render_compare_scenes(struct lum_team *team, const struct lum_world *world, struct lum_proto_error *err)
{
    const char *isa = lum_device_isa(world->device);
    size_t n;
    cJSON *ops = lum_document_to_json(world->doc, false);
    char *text = ops ? lum_json_print(ops, &n) : NULL;
    cJSON_Delete(ops);
    if (!text)
        return lum_proto_fail_memory(err);
    lum_team_compare(team, hash_more(HASH_BEGIN, isa, strlen(isa)), "--isa: the instruction set of the ray tracing");
    lum_team_compare(team, hash_more(HASH_BEGIN, text, n), "the scene");
    free(text);
    return true;
}

void lum_render_compare_films(struct lum_team *team, const struct lum_film *film, const char *what)
{
    if (!team)
        return;
    size_t n = (size_t)film->w * film->h;
    uint64_t hash = HASH_BEGIN;
    for (int i = 0; i < 2; i++) {
        hash = hash_more(hash, film->half[i], 3 * n * sizeof *film->half[i]);
        hash = hash_more(hash, film->n[i], n * sizeof *film->n[i]);
    }
    lum_team_compare(team, hash, what);
}
