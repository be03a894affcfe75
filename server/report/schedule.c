#include "server/report/schedule.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/light/emit.h"

/* What a web's record says of itself: a name, a file. */
static void describe_web(const struct lum_record_light *l, struct lum_schedule_row *row)
{
    const struct lum_record_web *web = l->web;
    const char *file = strrchr(l->asset, '/');
    file = file ? file + 1 : l->asset;
    snprintf(row->what, sizeof row->what, "%.90s%s%.32s", web->name, web->name[0] && file[0] ? ", " : "", file);
    if (!row->what[0])
        snprintf(row->what, sizeof row->what, "photometric lamp");
    if (web->watts.set)
        row->watts = web->watts.value;
}

static double flux_of(const struct lum_snapshot *s, const struct lum_light *l)
{
    const struct lum_vec3 none = {0}; /* bounds count for light from afar alone */
    double scale = s->norm.scale;     /* of power and areas: metres to scene units */
    return (double)lum_luminance(l->power) * lum_light_flux_unit(l, none, none) / (scale * scale);
}

/* False: it is none. */
static bool describe(const struct lum_world *w, uint32_t i, struct lum_schedule_row *ret_row)
{
    const struct lum_light *l = &w->snapshot->lights.lights[i];
    struct lum_luminaire shines;
    *ret_row = (struct lum_schedule_row){.n = 1, .n_on = l->on, .watts = NAN};
    snprintf(ret_row->first, sizeof ret_row->first, "%s", l->id);
    if (lum_snapshot_luminaire(w->snapshot, i, &shines)) {
        const struct lum_record *r = lum_document_find(w->doc, l->id);
        ret_row->flux_lm = shines.flux_lm;
        snprintf(ret_row->what, sizeof ret_row->what, "luminous surface%s%s", r ? ", material " : "",
                 r ? r->object.material : "");
        return true;
    }
    const struct lum_record *r = lum_document_find(w->doc, l->id);
    if (!r || r->type != LUM_RECORD_LIGHT || lum_light_is_from_afar(l))
        return false;
    ret_row->flux_lm = flux_of(w->snapshot, l);
    if (r->light.web)
        describe_web(&r->light, ret_row);
    else
        snprintf(ret_row->what, sizeof ret_row->what, "%s", r->light.kind);
    return true;
}

static bool is_same(double a, double b)
{
    return (isnan(a) && isnan(b)) || fabs(a - b) <= 1e-3 * fmax(fabs(a), fabs(b));
}

static void name_unknown(struct lum_load *load, const struct lum_schedule_row *row)
{
    uint32_t i = 0;
    while (i < load->n_names && strcmp(load->names[i].what, row->what) != 0)
        i++;
    if (i == LUM_LOAD_NAMES)
        return;
    if (i == load->n_names) {
        snprintf(load->names[i].what, sizeof load->names[i].what, "%s", row->what);
        snprintf(load->names[i].first, sizeof load->names[i].first, "%s", row->first);
        load->n_names++;
    }
    load->names[i].n++;
}

static void add_load(struct lum_load *load, const struct lum_schedule_row *row)
{
    load->n_on++;
    if (!isnan(row->watts)) {
        load->watts += row->watts;
        return;
    }
    load->n_unknown++;
    name_unknown(load, row);
}

void lum_load_of(const struct lum_world *w, struct lum_load *ret)
{
    *ret = (struct lum_load){0};
    for (uint32_t i = 0; i < w->snapshot->lights.n_lights; i++) {
        struct lum_schedule_row row;
        if (w->snapshot->lights.lights[i].on && describe(w, i, &row))
            add_load(ret, &row);
    }
}

static void add(struct lum_schedule *s, const struct lum_schedule_row *row)
{
    size_t i = 0;
    while (i < s->n && (strcmp(s->rows[i].what, row->what) != 0 || !is_same(s->rows[i].flux_lm, row->flux_lm) ||
                        !is_same(s->rows[i].watts, row->watts)))
        i++;
    if (i == s->n) {
        s->rows[s->n++] = *row;
    } else {
        s->rows[i].n++;
        s->rows[i].n_on += row->n_on;
    }
    if (!row->n_on)
        return;
    s->flux_lm += row->flux_lm;
    add_load(&s->load, row);
}

enum lum_status lum_schedule_make(const struct lum_world *w, struct lum_schedule *ret_schedule, struct lum_error *err)
{
    uint32_t n = w->snapshot->lights.n_lights;
    struct lum_schedule s = {.rows = lum_calloc(n ? n : 1, sizeof *s.rows)};
    if (!s.rows)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a list of %u lights", n);
    for (uint32_t i = 0; i < n; i++) {
        struct lum_schedule_row row;
        if (describe(w, i, &row))
            add(&s, &row);
    }
    *ret_schedule = s;
    return LUM_OK;
}

void lum_schedule_finish(struct lum_schedule *s)
{
    lum_free(s->rows);
    *s = (struct lum_schedule){0};
}
