/* lumend compare: how far one picture is from another. */
#include "server/cli/commands.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "server/cli/compare_options.h"
#include "server/cli/compare_page.h"
#include "server/cli/help.h"
#include "server/stream/png.h"

/* ---- pictures ---- */

static enum lum_status check_kind(const struct lum_comparison *c, const struct lum_compared *p, struct lum_error *err)
{
    const struct lum_compared *a = &c->pictures[LUM_COMPARE_A];
    if (p->w != a->w || p->h != a->h)
        return lum_fail(err, LUM_ERR_INVALID, "", "the sizes differ: %u x %u and %u x %u", a->w, a->h, p->w, p->h);
    if (p->is_png != a->is_png)
        return lum_fail(err, LUM_ERR_INVALID, "",
                        "one picture is a PNG, the other holds light: compare two EXR files, or what was made of both");
    for (int m = LUM_COMPARE_HDRFLIP; m <= LUM_COMPARE_HDRVDP; m++)
        if (p->is_png && c->wanted[m])
            return lum_fail(err, LUM_ERR_UNSUPPORTED, "metric",
                            "%s needs light, and %.100s holds what a display shows: give EXR files, or take flip",
                            lum_compare_names[m], p->path);
    if (p->is_png && p == &c->pictures[LUM_COMPARE_SECOND])
        return lum_fail(err, LUM_ERR_UNSUPPORTED, "second", "--second is for EXR files");
    return LUM_OK;
}

static enum lum_status load(const struct lum_compare_options *o, struct lum_comparison *c, struct lum_error *err)
{
    for (int i = 0; i < LUM_COMPARE_PICTURES && o->paths[i]; i++) {
        enum lum_status st = lum_compared_read(o->paths[i], &c->pictures[i], err);
        if (st || (st = check_kind(c, &c->pictures[i], err)))
            return st;
    }
    return LUM_OK;
}

static enum lum_status write_heatmap(const struct lum_compare_options *o, const struct lum_comparison *c,
                                     struct lum_error *err)
{
    const struct lum_compared *a = &c->pictures[LUM_COMPARE_A];
    uint8_t *rgb = lum_compare_paint(c, lum_compare_map_of(o->first));
    if (!rgb)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the heat map");
    enum lum_status st = lum_png_write(o->heatmap, &(struct lum_png){rgb, a->w, a->h, 6}, err);
    lum_free(rgb);
    return st;
}

/* ---- the result ---- */

static cJSON *pair(double a, double b)
{
    cJSON *array = cJSON_CreateArray();
    lum_json_add(array, NULL, cJSON_CreateNumber(a));
    lum_json_add(array, NULL, cJSON_CreateNumber(b));
    return array;
}

static bool add_numbers(cJSON *object, const char *const *names, const double *values, size_t n)
{
    bool ok = true;
    for (size_t i = 0; ok && i < n; i++)
        ok = lum_json_add_number(object, names[i], values[i]);
    return ok;
}

/* NULL when memory is short. */
static cJSON *blocks_json(const struct lum_blocks_result *m)
{
    static const char *const names[] = {"side", "counted", "dark", "mean",   "median", "p5",
                                        "p25",  "p75",     "p95",  "lowest", "highest"};
    static const char *const error_names[] = {"mean", "median", "p95"};
    const double values[] = {m->grid.side, m->n_counted, m->n_dark, m->mean,   m->median, m->p5,
                             m->p25,       m->p75,       m->p95,    m->lowest, m->highest};
    const double errors[] = {m->mean_stderr, m->stderr_median, m->stderr_p95};
    cJSON *o = cJSON_CreateObject(), *e = cJSON_CreateObject();
    bool ok = add_numbers(e, error_names, errors, LUM_ARRAY_LEN(errors));
    ok = lum_json_add(o, "grid", pair(m->grid.nx, m->grid.ny)) && ok;
    ok = add_numbers(o, names, values, LUM_ARRAY_LEN(values)) && ok;
    if (lum_json_add(o, "stderr", e) && ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

static cJSON *object_of(const char *const *names, const double *values, size_t n)
{
    cJSON *o = cJSON_CreateObject();
    if (add_numbers(o, names, values, n))
        return o;
    cJSON_Delete(o);
    return NULL;
}

static double pixels_per_degree(const struct lum_comparison *c, double usual)
{
    return c->pixels_per_degree > 0.0 ? c->pixels_per_degree : usual;
}

static cJSON *flip_json(const struct lum_comparison *c)
{
    static const char *const names[] = {"mean", "weighted_median", "max", "pixels_per_degree", "ev100"};
    const double values[] = {c->flip.mean, c->flip.weighted_median, c->flip.max,
                             pixels_per_degree(c, LUM_FLIP_PIXELS_PER_DEGREE), c->ev100};
    bool is_png = c->pictures[LUM_COMPARE_B].is_png; /* then there is no exposure */
    return object_of(names, values, LUM_ARRAY_LEN(values) - is_png);
}

static cJSON *hdrflip_json(const struct lum_comparison *c)
{
    static const char *const names[] = {"mean",           "weighted_median", "max",      "pixels_per_degree",
                                        "start_exposure", "stop_exposure",   "exposures"};
    const double values[] = {c->hdrflip.mean,    c->hdrflip.weighted_median,
                             c->hdrflip.max,     pixels_per_degree(c, LUM_FLIP_PIXELS_PER_DEGREE),
                             c->exposures.start, c->exposures.stop,
                             c->exposures.n};
    return object_of(names, values, LUM_ARRAY_LEN(values));
}

static cJSON *hdrvdp_json(const struct lum_comparison *c)
{
    static const char *const names[] = {"p75_percent", "p95_percent", "mean_p",    "pixels_per_degree",
                                        "multiplier",  "mean_cd_m2",  "peak_cd_m2"};
    const double values[] = {100.0 * c->hdrvdp.p75, 100.0 * c->hdrvdp.p95,
                             c->hdrvdp.mean,        pixels_per_degree(c, LUM_HDRVDP_PIXELS_PER_DEGREE),
                             c->multiplier,         c->mean_cd_m2,
                             c->peak_cd_m2};
    return object_of(names, values, LUM_ARRAY_LEN(values));
}

static bool add_metric(cJSON *o, const struct lum_comparison *c, enum lum_compare_metric metric)
{
    const char *name = lum_compare_names[metric];
    switch (metric) {
    case LUM_COMPARE_RELMSE:
        return lum_json_add_number(o, name, c->relative.relmse);
    case LUM_COMPARE_RMSE:
        return lum_json_add_number(o, name, c->relative.rmse);
    case LUM_COMPARE_SMAPE:
        return lum_json_add_number(o, name, c->relative.smape);
    case LUM_COMPARE_FLIP:
        return lum_json_add(o, name, flip_json(c));
    case LUM_COMPARE_HDRFLIP:
        return lum_json_add(o, name, hdrflip_json(c));
    case LUM_COMPARE_HDRVDP:
        return lum_json_add(o, name, hdrvdp_json(c));
    case LUM_COMPARE_BLOCKS:
        return lum_json_add(o, name, blocks_json(&c->blocks));
    case LUM_COMPARE_METRICS:
        break;
    }
    return false;
}

/* free() it; NULL when memory is short. */
static char *result_text(const struct lum_comparison *c)
{
    const struct lum_compared *p = c->pictures;
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_string(o, "a", p[LUM_COMPARE_A].path) &&
              lum_json_add_string(o, "b", p[LUM_COMPARE_B].path) &&
              (!p[LUM_COMPARE_SECOND].path || lum_json_add_string(o, "second", p[LUM_COMPARE_SECOND].path)) &&
              lum_json_add(o, "size", pair(p->w, p->h)) &&
              lum_json_add_number(o, "nonfinite", (double)c->relative.n_nonfinite);
    for (int i = 0; ok && i < LUM_COMPARE_METRICS; i++)
        ok = !c->wanted[i] || add_metric(o, c, (enum lum_compare_metric)i);
    char *text = ok ? lum_json_print(o, NULL) : NULL;
    cJSON_Delete(o);
    return text;
}

static enum lum_status run(const struct lum_compare_options *o, struct lum_comparison *c, struct lum_error *err)
{
    enum lum_status st = load(o, c, err);
    if (st || (st = lum_compare_measure(c, err)))
        return st;
    char *text = result_text(c);
    if (!text)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the result");
    puts(text);
    if (o->heatmap)
        st = write_heatmap(o, c, err);
    if (!st && o->html)
        st = lum_compare_page_write(o->html, c, text, err);
    free(text);
    return st;
}

int lum_cmd_compare(int argc, char **argv)
{
    struct lum_compare_options o;
    struct lum_error err;
    if (lum_compare_options_parse(argc, argv, &o, &err)) {
        fprintf(stderr, "lumend compare: %s\n", err.text);
        return LUM_EXIT_USAGE;
    }
    if (o.help) {
        lum_help_compare(&(struct lum_help){stdout, false});
        return LUM_EXIT_OK;
    }
    struct lum_comparison c = {.maps_wanted = o.heatmap || o.html,
                               .shown_wanted = o.html,
                               .pixels_per_degree = o.pixels_per_degree,
                               .multiplier = o.multiplier};
    memcpy(c.wanted, o.wanted, sizeof c.wanted);
    enum lum_status st = run(&o, &c, &err);
    if (st)
        fprintf(stderr, "lumend compare: %s\n", err.text);
    lum_comparison_finish(&c);
    return st ? LUM_EXIT_FAILED : LUM_EXIT_OK;
}
