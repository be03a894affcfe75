#include "tests/bench/variants.h"

#include <string.h>

#include "tests/bench/bench.h"

#define HEAD "{\"lumend\":1,\"kind\":\"scene\"}\n"
#define SET(id, path, value) "{\"op\":\"set\",\"id\":\"" id "\",\"path\":\"" path "\",\"value\":" value "}\n"

/* The fogs have the strength of those that are built in: half of a room's length of them is seen through. */
static const struct variant {
    const char *name, *base, *what, *ops;
} variants[] = {
    {"cornell-mirrors", "cornell", "\"Cornell specular\" of table 6.5: the tall statue is a mirror",
     HEAD SET("marble", "/metallic", "1") SET("marble", "/roughness", "0") SET("marble", "/specular", "1")},
    {"shirley6-media", "shirley6", "Shirley6PM of table 5.1: fog",
     HEAD "{\"op\":\"add\",\"type\":\"medium\",\"id\":\"fog\",\"sigma_s\":[0.11,0.11,0.11],"
          "\"sigma_a\":[0.004,0.004,0.004],\"g\":0.35,\"box\":{\"min\":[-3,0,-3],\"max\":[3,3,3]}}\n"},
};

static const struct variant *variant_of(const char *scene)
{
    for (size_t i = 0; i < LUM_ARRAY_LEN(variants); i++)
        if (strcmp(variants[i].name, scene) == 0)
            return &variants[i];
    return NULL;
}

const char *lum_bench_variant_base(const char *scene)
{
    const struct variant *v = variant_of(scene);
    return v ? v->base : scene;
}

bool lum_bench_vary(struct lum_world *world, const char *scene, struct lum_proto_error *err)
{
    const struct variant *v = variant_of(scene);
    struct lum_ops ops;
    struct lum_changes changes;
    struct lum_error core_err = {0};
    if (!v)
        return true;
    if (!lum_ops_from_jsonl(v->ops, strlen(v->ops), &ops, err))
        return false;
    bool ok = lum_world_apply(world, &(struct lum_edit){.user = "bench", .ops = &ops}, &changes, err);
    lum_ops_finish(&ops);
    if (!ok)
        return false;
    lum_changes_finish(&changes);
    if (lum_world_commit(world, &core_err) == LUM_OK)
        return true;
    snprintf(err->text, sizeof err->text, "%s", core_err.text);
    return false;
}

void lum_bench_print_variants(FILE *to)
{
    for (size_t i = 0; i < LUM_ARRAY_LEN(variants); i++)
        fprintf(to, "  %-16s %s\n", variants[i].name, variants[i].what);
}
