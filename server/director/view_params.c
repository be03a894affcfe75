#include "server/director/view_params.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "core/trace/effect.h"
#include "protocol/json/json.h"
#include "protocol/message/frame.h"
#include "protocol/record/field.h"
#include "server/base/suggest.h"

#define COUNT(a) (sizeof(a) / sizeof((a)[0]))
#define AT(s, m) .name = #m, .offset = offsetof(s, m)
#define ROW(m, k) AT(struct lum_view_params, m), .kind = LUM_FIELD_##k
#define BYTES(m) .n = sizeof((struct lum_view_params *)0)->m

static const struct lum_field budget_rows[] = {
    {AT(struct lum_view_budget, time_ms), .kind = LUM_FIELD_OPT, .min = 1, .max = 60000},
    {AT(struct lum_view_budget, error), .kind = LUM_FIELD_OPT, .min = 1e-4, .max = 10},
};
#define FALSE_COLOR(m, k) AT(struct lum_view_false_color, m), .kind = LUM_FIELD_##k
#define FALSE_COLOR_BYTES(m) .n = sizeof((struct lum_view_false_color *)0)->m
static const struct lum_field false_color_rows[] = {
    {FALSE_COLOR(scale, CHOICE), FALSE_COLOR_BYTES(scale), .text = "log|linear"},
    {FALSE_COLOR(palette, CHOICE), FALSE_COLOR_BYTES(palette), .text = "even|spectrum"},
    {FALSE_COLOR(lines, CHOICE), FALSE_COLOR_BYTES(lines), .text = "off|on|only"},
    {FALSE_COLOR(min, OPT), .min = 0, .max = LUM_LIMIT_FALSE_COLOR},
    {FALSE_COLOR(max, OPT), .min = 0, .max = LUM_LIMIT_FALSE_COLOR},
    {FALSE_COLOR(smooth, BOOL)},
};
static const struct lum_fields false_color_fields = {false_color_rows, COUNT(false_color_rows)};

static const struct lum_fields budget_fields = {budget_rows, COUNT(budget_rows)};

/* clang-format off */
static const struct lum_field rows[LUM_VIEW_PARAM_COUNT] = {
    [LUM_VIEW_SIZE] = {ROW(size, VECTOR), .n = 2, .flags = LUM_FIELD_WHOLE,
                       .min = LUM_LIMIT_VIEW_MIN, .max = LUM_LIMIT_VIEW_SIDE},
    [LUM_VIEW_REST_SIZE] = {ROW(rest_size, VECTOR), .n = 2, .flags = LUM_FIELD_WHOLE,
                            .min = LUM_LIMIT_VIEW_MIN, .max = LUM_LIMIT_VIEW_SIDE},
    [LUM_VIEW_CAMERA] = {ROW(camera, PARTS), BYTES(camera), .parts = &lum_camera_fields, .group = LUM_GROUP_CAMERA},
    [LUM_VIEW_CAMERA_ID] = {ROW(camera_id, ID), BYTES(camera_id), .group = LUM_GROUP_CAMERA},
    [LUM_VIEW_CAMERA_SEQ] = {ROW(camera_seq, U32), .max = UINT32_MAX},
    [LUM_VIEW_CODEC] = {ROW(codec, CHOICE), BYTES(codec), .text = "jpeg|png|rgba8|half_deflate|webp"},
    [LUM_VIEW_QUALITY] = {ROW(quality, U32), .min = 1, .max = 100, .def = {80}},
    [LUM_VIEW_DOWNSCALE] = {ROW(downscale, U32), .max = 2},
    [LUM_VIEW_METHOD] = {ROW(method, NAME), BYTES(method), .text = ""},
    [LUM_VIEW_SPP] = {ROW(spp, U32), .min = 1, .max = LUM_LIMIT_SPP},
    [LUM_VIEW_EXPOSURE_EV] = {ROW(exposure_ev, OPT), .min = -LUM_LIMIT_VIEW_EV, .max = LUM_LIMIT_VIEW_EV},
    [LUM_VIEW_TONE_MAP] = {ROW(tone_map, CHOICE), BYTES(tone_map), .text = "agx|aces|reinhard|none"},
    [LUM_VIEW_WHITE_BALANCE_K] = {ROW(white_balance_k, OPT), .min = 1667, .max = 25000},
    [LUM_VIEW_MOMENT] = {ROW(moment, OPT), .flags = LUM_FIELD_WHOLE, .max = 0x1p53},
    [LUM_VIEW_OVERLAY] = {ROW(overlay, CHOICE), BYTES(overlay),
                          .text = "none|luminance|illuminance|error|shapes|guidance_soft_shadow|guidance_indirect_diffuse|guidance_media"},
    [LUM_VIEW_FALSE_COLOR] = {ROW(false_color, PARTS), BYTES(false_color), .parts = &false_color_fields},
    [LUM_VIEW_BUDGET] = {ROW(budget, PARTS), BYTES(budget), .parts = &budget_fields},
    [LUM_VIEW_STATS] = {ROW(stats, BOOL), .def = {true}},
    [LUM_VIEW_RESEND] = {ROW(resend, BOOL)},
};
/* clang-format on */
const struct lum_fields lum_view_fields = {rows, COUNT(rows)};

struct lum_view_params lum_view_params_default(void)
{
    struct lum_view_params p = {0};
    for (size_t i = 0; i < COUNT(rows); i++)
        lum_field_reset(&rows[i], &p);
    return p;
}

/* {"soft_shadow":"off", "media":"auto", ...} */
static void read_effects(struct lum_json_reader *r, struct lum_view_params *p)
{
    struct lum_json_reader effects;
    if (!lum_json_object(r, "effects", &effects))
        return;
    for (const struct cJSON *m = effects.object->child; m; m = m->next) {
        enum lum_effect e;
        unsigned choice = 0;
        if (!lum_effect_find(m->string, strlen(m->string), &e)) {
            char near[LUM_SUGGEST_BYTES];
            lum_suggest_effect(m->string, near);
            lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "unknown_field", m->string, "unknown effect \"%.64s\"%s",
                           m->string, near);
            lum_json_fail(&effects);
            break;
        }
        if (!lum_json_choice(&effects, m->string, "auto|off|on", &choice))
            continue; /* null, or refused: then so are all that follow */
        p->effects_named |= LUM_EFFECT_BIT(e);
        p->effects_off |= choice == 1 ? LUM_EFFECT_BIT(e) : 0;
        p->effects_on |= choice == 2 ? LUM_EFFECT_BIT(e) : 0;
    }
    if (!lum_json_end(&effects))
        r->failed = true;
}

/* ["lamp", "group", ...]; null: as an empty one */
static void read_solo(struct lum_json_reader *r, struct lum_view_params *p)
{
    const struct cJSON *solo = lum_json_any_member(r, "solo");
    if (!solo || r->failed)
        return;
    p->solo_given = true;
    if (cJSON_IsNull(solo))
        return;
    if (!cJSON_IsArray(solo) || cJSON_GetArraySize(solo) > (int)LUM_LIMIT_SOLO) {
        lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "invalid_value", "solo",
                       "solo must be a list of at most %u ids of lamps or groups", LUM_LIMIT_SOLO);
        lum_json_fail(r);
        return;
    }
    for (const struct cJSON *id = solo->child; id; id = id->next)
        if (!lum_json_to_id(id, "solo", p->solo[p->n_solo++], r->err)) {
            lum_json_fail(r);
            return;
        }
}

/* ["jpeg", "webp", ...]; null: as an empty one. Names of codecs to come are none of ours. */
static void read_codecs(struct lum_json_reader *r, struct lum_view_params *p)
{
    const struct cJSON *codecs = lum_json_any_member(r, "codecs");
    if (!codecs || r->failed)
        return;
    p->codecs_given = true;
    bool ok = cJSON_IsNull(codecs) || (cJSON_IsArray(codecs) && cJSON_GetArraySize(codecs) <= (int)LUM_LIMIT_CODECS);
    for (const struct cJSON *name = codecs->child; ok && name; name = name->next) {
        uint8_t codec;
        ok = cJSON_IsString(name);
        if (ok && lum_codec_find(name->valuestring, &codec))
            p->codecs |= 1u << codec;
    }
    if (ok)
        return;
    lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "invalid_value", "codecs",
                   "codecs must be a list of at most %u names of codecs", LUM_LIMIT_CODECS);
    lum_json_fail(r);
}

/* A scale has an extent, and one in decades no 0. */
static bool check_scale(const struct lum_view_false_color *f, struct lum_proto_error *err)
{
    bool log = strcmp(f->scale, "log") == 0;
    if (log && f->min.set && !(f->min.value > 0.0))
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "false_color/min",
                              "false_color/min of a logarithmic scale must be above 0: give another, or scale linear");
    if (f->max.set && !(f->max.value > (f->min.set ? f->min.value : 0.0)))
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "false_color/max",
                              "false_color/max must be above %s, not %g", f->min.set ? "false_color/min" : "0",
                              f->max.value);
    return true;
}

/* What no row says alone. */
static bool check(struct lum_json_reader *r, const struct lum_view_params *p)
{
    const uint32_t both = LUM_VIEW_BIT(CAMERA) | LUM_VIEW_BIT(CAMERA_ID);
    if ((p->given & both) == both)
        lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "invalid_value", "camera_id",
                       "camera and camera_id exclude each other");
    else if (p->given & LUM_VIEW_BIT(CAMERA) && !lum_camera_validate(&p->camera, r->err))
        lum_proto_prefix(r->err, "camera");
    else if (p->size[0] * p->size[1] > LUM_LIMIT_VIEW_PIXELS)
        lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "limit_exceeded", "size", "a view has at most %u pixels",
                       LUM_LIMIT_VIEW_PIXELS);
    else if (p->rest_size[0] * p->rest_size[1] > LUM_LIMIT_VIEW_PIXELS)
        lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "limit_exceeded", "rest_size", "a view has at most %u pixels",
                       LUM_LIMIT_VIEW_PIXELS);
    else if (!(p->given & LUM_VIEW_BIT(FALSE_COLOR)) || check_scale(&p->false_color, r->err))
        return true;
    return lum_json_fail(r);
}

bool lum_view_params_read(struct lum_json_reader *r, struct lum_view_params *ret_params)
{
    struct lum_view_params p = {0};
    for (size_t i = 0; i < COUNT(rows); i++)
        if (lum_field_take(&rows[i], &p, r))
            p.given |= 1u << i;
    read_effects(r, &p);
    read_solo(r, &p);
    read_codecs(r, &p);
    if (r->failed || !check(r, &p))
        return false;
    *ret_params = p;
    return true;
}

void lum_view_params_merge(struct lum_view_params *params, const struct lum_view_params *more)
{
    for (size_t i = 0; i < COUNT(rows); i++) {
        if (!(more->given & 1u << i))
            continue;
        for (size_t k = 0; rows[i].group && k < COUNT(rows); k++)
            if (rows[k].group == rows[i].group) /* the named camera replaces the explicit one, and the other way */
                params->given &= ~(1u << k);
        lum_field_copy(&rows[i], params, more);
        params->given |= 1u << i;
    }
    if (more->solo_given) {
        params->n_solo = more->n_solo;
        memcpy(params->solo, more->solo, sizeof params->solo);
    }
    if (more->codecs_given)
        params->codecs = more->codecs;
    params->effects_off = (params->effects_off & ~more->effects_named) | more->effects_off;
    params->effects_on = (params->effects_on & ~more->effects_named) | more->effects_on;
}
