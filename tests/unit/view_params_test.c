/* What a client may say of a view: each member by its row, and how one request is taken over into another. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "core/trace/effect.h"
#include "protocol/json/json.h"
#include "protocol/message/frame.h"
#include "protocol/record/field.h"
#include "server/director/view_params.h"

/* Of a text with ' for ". False: refused, and err says why. */
static bool read(const char *text, struct lum_view_params *ret, struct lum_proto_error *err)
{
    char quoted[512];
    size_t n = 0;
    for (; text[n] && n + 1 < sizeof quoted; n++)
        quoted[n] = text[n] == '\'' ? '"' : text[n];
    quoted[n] = '\0';
    cJSON *json = cJSON_Parse(quoted);
    assert_non_null(json);
    struct lum_json_reader r;
    lum_json_begin(&r, json, "", err);
    bool ok = lum_view_params_read(&r, ret) && lum_json_end(&r);
    cJSON_Delete(json);
    return ok;
}

static struct lum_view_params params(const char *text)
{
    struct lum_view_params p;
    struct lum_proto_error err = {0};
    if (!read(text, &p, &err))
        fail_msg("%s: %s at %s", text, err.text, err.path);
    return p;
}

static void every_member_sets_its_own_bit(void **state)
{
    static const char *const texts[LUM_VIEW_PARAM_COUNT] = {
        [LUM_VIEW_SIZE] = "{'size':[600,400]}",
        [LUM_VIEW_REST_SIZE] = "{'rest_size':[1200,800]}",
        [LUM_VIEW_CAMERA] = "{'camera':{'position':[0,1,4],'target':[0,1,0]}}",
        [LUM_VIEW_CAMERA_ID] = "{'camera_id':'main'}",
        [LUM_VIEW_CAMERA_SEQ] = "{'camera_seq':4294967295}",
        [LUM_VIEW_CODEC] = "{'codec':'half_deflate'}",
        [LUM_VIEW_QUALITY] = "{'quality':100}",
        [LUM_VIEW_DOWNSCALE] = "{'downscale':2}",
        [LUM_VIEW_METHOD] = "{'method':'ais-max'}",
        [LUM_VIEW_SPP] = "{'spp':65536}",
        [LUM_VIEW_EXPOSURE_EV] = "{'exposure_ev':null}",
        [LUM_VIEW_TONE_MAP] = "{'tone_map':'reinhard'}",
        [LUM_VIEW_WHITE_BALANCE_K] = "{'white_balance_k':25000}",
        [LUM_VIEW_MOMENT] = "{'moment':9007199254740992}",
        [LUM_VIEW_OVERLAY] = "{'overlay':'guidance_indirect_diffuse'}",
        [LUM_VIEW_FALSE_COLOR] = "{'false_color':{'scale':'linear','min':0,'max':1000,'smooth':true,'lines':'only'}}",
        [LUM_VIEW_BUDGET] = "{'budget':{'time_ms':50}}",
        [LUM_VIEW_STATS] = "{'stats':false}",
        [LUM_VIEW_RESEND] = "{'resend':true}",
    };
    (void)state;
    for (unsigned i = 0; i < LUM_VIEW_PARAM_COUNT; i++) {
        assert_non_null(lum_view_fields.fields[i].name);
        assert_int_equal(params(texts[i]).given, 1u << i);
    }
    struct lum_view_params p =
        params(texts[LUM_VIEW_CAMERA]); /* what it leaves out has the default of a camera's field */
    assert_true(p.camera.position[2] == 4.0 && p.camera.up[1] == 1.0 && p.camera.vfov_deg == 45.0);
    assert_int_equal(params("{'quality':null,'camera':null,'budget':null}").given, 0);
}

static void what_is_wrong_is_named(void **state)
{
    static const struct {
        const char *text, *app, *path;
    } cases[] = {
        {"{'size':[0,400]}", "invalid_value", "size/0"},
        {"{'size':[600,4097]}", "invalid_value", "size/1"},
        {"{'size':[600.5,400]}", "invalid_value", "size/0"},
        {"{'size':[4096,4096]}", "limit_exceeded", "size"},
        {"{'quality':0}", "invalid_value", "quality"},
        {"{'quality':101}", "invalid_value", "quality"},
        {"{'quality':1.5}", "invalid_value", "quality"},
        {"{'downscale':3}", "invalid_value", "downscale"},
        {"{'spp':65537}", "invalid_value", "spp"},
        {"{'codec':'avif'}", "invalid_value", "codec"},
        {"{'codecs':'webp'}", "invalid_value", "codecs"},
        {"{'codecs':{'webp':true}}", "invalid_value", "codecs"},
        {"{'codecs':['webp',1]}", "invalid_value", "codecs"},
        {"{'codecs':['1','2','3','4','5','6','7','8','9','10','11','12','13','14','15','16','17']}", "invalid_value",
         "codecs"},
        {"{'exposure_ev':41}", "invalid_value", "exposure_ev"},
        {"{'white_balance_k':1666}", "invalid_value", "white_balance_k"},
        {"{'moment':-1}", "invalid_value", "moment"},
        {"{'moment':1.5}", "invalid_value", "moment"},
        {"{'moment':9007199254740994}", "invalid_value", "moment"},
        {"{'stats':1}", "invalid_value", "stats"},
        {"{'camera':[]}", "invalid_value", "camera"},
        {"{'camera':{'position':[0,1,4]}}", "missing_field", "camera/target"},
        {"{'camera':{'position':[0,1,4],'target':[0,1,4]}}", "invalid_value", "camera/target"},
        {"{'camera':{'position':[0,1,4],'target':[0,1,0],'fov':3}}", "unknown_field", "camera/fov"},
        {"{'camera':{'position':[0,1,4],'target':[0,1,0]},'camera_id':'main'}", "invalid_value", "camera_id"},
        {"{'budget':{'time_ms':0}}", "invalid_value", "budget/time_ms"},
        {"{'budget':{'tme_ms':5}}", "unknown_field", "budget/tme_ms"},
        {"{'false_color':{'scale':'cubic'}}", "invalid_value", "false_color/scale"},
        {"{'false_color':{'min':-1}}", "invalid_value", "false_color/min"},
        {"{'false_color':{'min':0}}", "invalid_value", "false_color/min"},
        {"{'false_color':{'min':100,'max':100}}", "invalid_value", "false_color/max"},
        {"{'false_color':{'scale':'linear','max':0}}", "invalid_value", "false_color/max"},
        {"{'false_color':{'steps':3}}", "unknown_field", "false_color/steps"},
        {"{'effects':{'media':'of'}}", "invalid_value", "effects/media"},
        {"{'effects':{'fog':'off'}}", "unknown_field", "effects/fog"},
        {"{'solo':'lamp'}", "invalid_value", "solo"},
        {"{'solo':['a b']}", "invalid_value", "solo"},
        {"{'solo':[1]}", "invalid_value", "solo"},
        {"{'solo':['1','2','3','4','5','6','7','8','9','10','11','12','13','14','15','16','17']}", "invalid_value",
         "solo"},
        {"{'qualty':80}", "unknown_field", "qualty"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct lum_view_params p;
        struct lum_proto_error err = {0};
        if (read(cases[i].text, &p, &err) || strcmp(err.app, cases[i].app) != 0 || strcmp(err.path, cases[i].path) != 0)
            fail_msg("%s: \"%s\" at \"%s\": %s", cases[i].text, err.app, err.path, err.text);
    }
}

/* What the client reads: names that are none of ours stand for nothing. */
static void codecs_are_a_set(void **state)
{
    (void)state;
    assert_int_equal(params("{'codecs':['webp','jpeg','webp','h266','']}").codecs,
                     1u << LUM_CODEC_WEBP | 1u << LUM_CODEC_JPEG);
    assert_int_equal(
        params("{'codecs':['1','2','3','4','5','6','7','8','9','10','11','12','13','14','15','webp']}").codecs,
        1u << LUM_CODEC_WEBP); /* as many as there may be */
    struct lum_view_params p = lum_view_params_default(), more = params("{'codecs':['webp']}");
    lum_view_params_merge(&p, &more);
    more = params("{'quality':50}");
    lum_view_params_merge(&p, &more);
    assert_int_equal(p.codecs, 1u << LUM_CODEC_WEBP);
    more = params("{'codecs':null}");
    lum_view_params_merge(&p, &more);
    assert_int_equal(p.codecs, 0);
}

static void merging_takes_what_is_given(void **state)
{
    struct lum_view_params p = lum_view_params_default(), more;
    (void)state;
    assert_int_equal(p.given, 0);
    assert_true(p.quality == 80 && p.stats && strcmp(p.codec, "jpeg") == 0);
    more = params("{'size':[8,6],'quality':7,'budget':{'time_ms':50,'error':0.1}}");
    lum_view_params_merge(&p, &more);
    more = params("{'stats':false,'budget':{'error':0.2}}");
    lum_view_params_merge(&p, &more);
    assert_int_equal(p.given, LUM_VIEW_BIT(SIZE) | LUM_VIEW_BIT(QUALITY) | LUM_VIEW_BIT(BUDGET) | LUM_VIEW_BIT(STATS));
    assert_true(p.size[0] == 8.0 && p.size[1] == 6.0 && p.quality == 7 && !p.stats);
    assert_true(!p.budget.time_ms.set && p.budget.error.set && p.budget.error.value == 0.2);
}

static void one_camera_replaces_the_other(void **state)
{
    struct lum_view_params p = params("{'camera':{'position':[0,1,4],'target':[0,1,0]}}");
    struct lum_view_params named = params("{'camera_id':'main'}"), again = p;
    (void)state;
    lum_view_params_merge(&p, &named);
    assert_int_equal(p.given, LUM_VIEW_BIT(CAMERA_ID));
    lum_view_params_merge(&p, &again);
    assert_int_equal(p.given, LUM_VIEW_BIT(CAMERA));
}

static void effects_that_are_not_named_stay(void **state)
{
    struct lum_view_params p = params("{'effects':{'media':'off','glossy':'on','direct':'off'}}");
    struct lum_view_params more = params("{'effects':{'media':'on','direct':'auto'}}");
    (void)state;
    lum_view_params_merge(&p, &more);
    assert_int_equal(p.effects_off, 0);
    assert_int_equal(p.effects_on, LUM_EFFECT_BIT(LUM_EFFECT_MEDIA) | LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY));
}

static void solo_lasts_until_it_is_given_again(void **state)
{
    struct lum_view_params p = params("{'solo':['lamp','group']}"), other = params("{'quality':50}");
    struct lum_view_params none = params("{'solo':[]}"), null = params("{'solo':null}");
    (void)state;
    lum_view_params_merge(&p, &other);
    assert_int_equal(p.n_solo, 2);
    assert_string_equal(p.solo[1], "group");
    lum_view_params_merge(&p, &null);
    assert_int_equal(p.n_solo, 0);
    p = params("{'solo':['lamp']}");
    lum_view_params_merge(&p, &none);
    assert_int_equal(p.n_solo, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_member_sets_its_own_bit),      cmocka_unit_test(what_is_wrong_is_named),
        cmocka_unit_test(solo_lasts_until_it_is_given_again), cmocka_unit_test(codecs_are_a_set),
        cmocka_unit_test(merging_takes_what_is_given),        cmocka_unit_test(one_camera_replaces_the_other),
        cmocka_unit_test(effects_that_are_not_named_stay),
    };
    return cmocka_run_group_tests_name("view_params", tests, NULL, NULL);
}
