#define _POSIX_C_SOURCE 200809L /* gmtime_r */
#include "server/report/report.h"

#include <math.h>
#include <string.h>
#include <time.h>

#include "core/film/false_color.h"
#include "core/math/vec3d.h"
#include "server/report/page.h"

enum {
    PNG_LEVEL = 6,            /* zlib's own choice: a report is kept, and nobody waits as for a frame */
    PLAN_WIDTH = 688,         /* px, that a plan may take: 182 mm, what is between the margins of A4 */
    PLAN_HEIGHT = 850,        /* px: 225 mm, which leaves room for its heading, caption and key on the page */
    CELL_MAX = 60,            /* px */
    CELL_WITH_NUMBER = 22,    /* px: four digits of 9 px, 7 point, are readable */
    CELL_WITH_LARGE = 30,     /* px: of 11 px */
    PLANS_MAX_POINTS = 16384, /* of one plan: beyond, --csv has them */
};

static const char head[] =
    "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n"
    "<meta name=\"viewport\" content=\"width=device-width\">\n<style>\n"
    "body { font: 15px/1.45 sans-serif; margin: 2em auto; padding: 0 1.5em; color: #111; background: #fff; max-width: "
    "1000px }\n"
    "h1 { font-size: 1.5em; margin-bottom: .2em; overflow-wrap: anywhere } h2 { font-size: 1.15em; margin: 2em 0 .5em "
    "}\n"
    "p.by { color: #444; margin-top: 0 }\n"
    "table { border-collapse: collapse; width: 100% } td, th { padding: .3em .8em .3em 0; text-align: left; "
    "vertical-align: top; border-bottom: 1px solid #bbb }\n"
    "td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }\n"
    "tfoot td { font-weight: bold; border-bottom: 0 } .misses { font-weight: bold }\n"
    "figure { margin: 0 0 1em } img, svg { display: block; max-width: 100%; height: auto } figcaption { color: #444; "
    "margin-top: .2em }\n"
    "svg text { font: 11px sans-serif; text-anchor: middle } svg.small text { font-size: 9px }\n"
    ".key span { display: inline-block; margin-right: .9em; white-space: nowrap } .key i { display: inline-block; "
    "width: "
    "1em; height: 1em; margin-right: .3em; border: 1px solid #777; vertical-align: -.15em }\n"
    "td:first-child { min-width: 7em; overflow-wrap: anywhere } .meets, .misses { white-space: nowrap }\n"
    "section, tr, figure, .key { break-inside: avoid } h1, h2 { break-after: avoid } tfoot { display: table-row-group "
    "}\n"
    "@page { size: A4; margin: 16mm 14mm }\n" /* PLAN_WIDTH and PLAN_HEIGHT fit in */
    "@media print { body { font-size: 9.5pt; margin: 0; padding: 0; max-width: none; -webkit-print-color-adjust: "
    "exact; "
    "print-color-adjust: exact } td, th { padding-right: .6em } img { width: 150mm } img, svg { max-height: 225mm } "
    "h1 { margin-top: 0 } }\n</style>\n";

static void put_name(FILE *f, const struct lum_measured *m)
{
    lum_page_text(f, m->name && m->name[0]           ? m->name
                     : m->id                         ? m->id
                     : lum_sensor_has_eyes(&m->desc) ? "Eyes"
                                                     : "Work plane");
}

/* So many digits, but never as a power of ten: people read this. */
static void put_number(FILE *f, double value, int digits)
{
    if (fabs(value) >= pow(10.0, digits) || value == 0.0)
        fprintf(f, "%.0f", value);
    else
        fprintf(f, "%.*g", digits, value);
}

/* ---- summary ---- */

static void put_amount(FILE *f, bool is_there, struct lum_amount a, int digits)
{
    bool known = is_there && isfinite(a.value);
    fputs(known ? "<td class=\"n\">" : "<td class=\"n\">&ndash;", f);
    if (!known)
        return;
    put_number(f, a.value, digits);
    fputs(" &plusmn; ", f);
    put_number(f, a.stderr_of, 2);
}

static void put_target(FILE *f, const char *what, double target, const struct lum_verdict *v, const char *bound)
{
    if (!v->asked)
        return;
    fprintf(f, "<span class=\"%s\">%s %s %g: %s%s</span><br>", v->passes ? "meets" : "misses", what, bound, target,
            v->passes ? "met" : "missed", v->sure ? "" : " (within noise)");
}

static bool has_dgp(const struct lum_measured *m)
{
    return m->desc.kind == LUM_SENSOR_OBSERVER && isfinite(m->result.dgp.dgp);
}

/* Too little light at the eye for DGP's formula. */
static bool is_dim(const struct lum_measured *m)
{
    return has_dgp(m) && !(m->result.eye.value > LUM_DGP_MIN_LX);
}

/* How DGP's number is called; with an asterisk where the formula is not made for it. */
static void put_band(FILE *f, const struct lum_measured *m)
{
    if (has_dgp(m))
        fprintf(f, "%s<br>%s", is_dim(m) ? "*" : "", lum_dgp_band_names[lum_dgp_band_of(m->result.dgp.dgp)]);
}

static void put_summary_row(FILE *f, const struct lum_measured *m)
{
    const struct lum_sensor_result *r = &m->result;
    bool is_observer = m->desc.kind == LUM_SENSOR_OBSERVER, is_eye = is_observer || lum_sensor_has_eyes(&m->desc);
    bool many = !is_eye && m->desc.kind != LUM_SENSOR_POINT;
    struct lum_sensor_verdicts v = lum_sensor_judge(r, &m->targets);
    fputs("<tr><td>", f);
    put_name(f, m);
    fprintf(f, "<td>%s", is_eye ? "glare" : lum_sensor_quantity_of(&m->desc));
    put_amount(f, !is_eye, r->mean, 4);
    put_amount(f, many, r->least, 4);
    put_amount(f, many, r->uniformity, 3);
    put_amount(f, is_eye, (struct lum_amount){r->ugr.ugr, r->ugr.stderr_of}, 3);
    put_amount(f, is_observer, (struct lum_amount){r->dgp.dgp, r->dgp.stderr_of}, 3);
    put_band(f, m);
    fputs("<td>", f);
    put_target(f, "E<sub>m</sub>", m->targets.lx, &v.lx, "&ge;");
    put_target(f, "U<sub>o</sub>", m->targets.uo, &v.uo, "&ge;");
    put_target(f, "UGR", m->targets.ugr, &v.ugr, "&le;");
    put_target(f, "DGP", m->targets.dgp, &v.dgp, "&le;");
    fputs("</tr>\n", f);
}

static void put_worst(FILE *f, const struct lum_report *p, bool by_day)
{
    size_t n;
    const struct lum_measured *worst = lum_report_worst(p->measured, p->n, by_day, &n);
    if (!worst)
        return;
    fprintf(f, "<p>Worst %s of %zu observers: ", by_day ? "DGP" : "UGR", n);
    put_number(f, by_day ? worst->result.dgp.dgp : worst->result.ugr.ugr, 3);
    fputs(", of ", f);
    put_name(f, worst);
    fputs(".</p>\n", f);
}

static void put_modelling(FILE *f, const struct lum_measured *m)
{
    const struct lum_sensor_result *r = &m->result;
    if (!m->desc.modelling || !isfinite(r->modelling.value))
        return;
    fputs("<p>", f);
    put_name(f, m);
    fputs(": modelling E<sub>z</sub> / E<sub>m</sub> = ", f);
    put_number(f, r->modelling.value, 3);
    fputs(" &plusmn; ", f);
    put_number(f, r->modelling.stderr_of, 2);
    fprintf(f, ", %s %.2f to %.2f as EN 12464-1 recommends; cylindrical illuminance E<sub>z</sub> ",
            lum_modelling_in_range(r) ? "within" : "<span class=\"misses\">not within</span>", LUM_MODELLING_LEAST,
            LUM_MODELLING_MOST);
    put_number(f, r->cylindrical.value, 4);
    fputs(" &plusmn; ", f);
    put_number(f, r->cylindrical.stderr_of, 2);
    fputs(" lx in the mean.</p>\n", f);
}

static void put_summary(FILE *f, const struct lum_report *p)
{
    fputs("<h2>Results</h2>\n<table>\n<thead><tr><th>sensor<th>illuminance<th class=\"n\">E<sub>m</sub>, lx"
          "<th class=\"n\">E<sub>min</sub>, lx<th class=\"n\">U<sub>o</sub><th class=\"n\">UGR<th class=\"n\">DGP"
          "<th>wanted</tr></thead>\n<tbody>\n",
          f);
    for (size_t i = 0; i < p->n; i++)
        put_summary_row(f, &p->measured[i]);
    fputs("</tbody></table>\n<p>Each value &plusmn; its standard error. E<sub>m</sub>: mean; E<sub>min</sub>: least; "
          "U<sub>o</sub> = E<sub>min</sub> / E<sub>m</sub>; UGR by formula (CIE 117); DGP: daylight glare probability, "
          "up to 0.35 imperceptible, to 0.40 perceptible, to 0.45 disturbing, beyond intolerable.</p>\n",
          f);
    put_worst(f, p, false);
    put_worst(f, p, true);
    for (size_t i = 0; i < p->n; i++)
        put_modelling(f, &p->measured[i]);
    bool any_dim = false;
    for (size_t i = 0; i < p->n; i++)
        any_dim = any_dim || is_dim(&p->measured[i]);
    if (any_dim)
        fprintf(f, "<p>* DGP is made for more than %g lx at the eye, and there is less.</p>\n", LUM_DGP_MIN_LX);
}

/* ---- pictures ---- */

static enum lum_status put_pictures(FILE *f, const struct lum_report *p, struct lum_error *err)
{
    static const char *const captions[LUM_REPORT_PICTURES] = {"As the eye sees it",
                                                              "Illuminance on every surface, in lx"};
    enum lum_status st = LUM_OK;
    for (int i = 0; i < LUM_REPORT_PICTURES && !st; i++) {
        const struct lum_canvas *c = &p->pictures[i];
        if (!c->rgb)
            continue;
        fputs("<figure><img", f);
        st = lum_page_image(f, &(struct lum_png){c->rgb, c->w, c->h, PNG_LEVEL}, captions[i], err);
        fprintf(f, "><figcaption>%s</figcaption></figure>\n", captions[i]);
    }
    return st;
}

/* ---- plans ---- */

static void put_color(FILE *f, const uint8_t rgb[3])
{
    fprintf(f, "#%02x%02x%02x", rgb[0], rgb[1], rgb[2]);
}

/* Of what luminance white is as far from as black (WCAG: (1.05) / (L + .05) = (L + .05) / .05), in sRGB's own values.
 */
static bool is_dark(const uint8_t rgb[3])
{
    double linear[3];
    for (int c = 0; c < 3; c++)
        linear[c] = pow(rgb[c] / 255.0, 2.2);
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2] < 0.18;
}

/* What a plan shows of a point: lx, or UGR of eyes, where there is one. */
struct shown {
    const char *left_out; /* why; NULL: it is not */
    const char *no_value; /* likewise */
    double value, stderr_of;
};

static struct shown shown_at(const struct lum_measured *m, uint32_t i)
{
    struct lum_meter_reading r = lum_sensor_reading(m->sensor, i);
    struct shown s = {lum_sensor_left_out(r.clearance), NULL, r.lx, r.stderr_lx};
    if (s.left_out || !lum_sensor_has_eyes(&m->desc))
        return s;
    struct lum_ugr ugr = lum_sensor_gaze(m->sensor, i).ugr;
    const char *none = isfinite(ugr.ugr) ? NULL
                       : isnan(ugr.ugr)  ? "not known"
                       : ugr.ugr > 0.0   ? "all is dark but the lamps"
                                         : "nothing glares";
    return (struct shown){NULL, none, ugr.ugr, ugr.stderr_of};
}

/* The steps of EN 12464-1. */
static void make_ugr_scale(struct lum_scale *ret)
{
    static const double limits[] = {10, 13, 16, 19, 22, 25, 28};
    *ret = (struct lum_scale){.kind = LUM_SCALE_LINEAR, .min = 7, .max = 31};
    for (ret->n_limits = 0; ret->n_limits < LUM_ARRAY_LEN(limits); ret->n_limits++)
        ret->limits[ret->n_limits] = limits[ret->n_limits];
    ret->n_colors = ret->n_limits + 1;
    for (uint32_t i = 0; i < ret->n_colors; i++)
        lum_palette_color(LUM_PALETTE_EVEN, ((double)i + 0.5) / ret->n_colors, ret->colors[i]);
}

/* Which way is down on a plan, of which u is to the right: v, and of a line what is level and square to it. None of one
 * that stands. */
static struct lum_vec3d down_of(const struct lum_sensor_desc *d)
{
    return d->kind == LUM_SENSOR_LINE ? (struct lum_vec3d){-d->u.z, 0.0, d->u.x} : d->v;
}

static double part_along(struct lum_vec3 d, struct lum_vec3d axis)
{
    double length = lum_v3d_length(axis);
    return length > 0.0 ? ((double)d.x * axis.x + (double)d.y * axis.y + (double)d.z * axis.z) / length : 0.0;
}

/* Which way an eye looks that is glared most: from the middle of its cell, as the plan lies. */
static void put_look(FILE *f, const struct lum_measured *m, uint32_t i, uint32_t x, uint32_t y, uint32_t side)
{
    struct lum_vec3 d = lum_sensor_direction(m->sensor, lum_sensor_gaze(m->sensor, i).direction);
    double dx = part_along(d, m->desc.u), dy = part_along(d, down_of(&m->desc));
    double length = hypot(dx, dy), cx = x + 0.5 * side, cy = y + 0.5 * side, r = 0.48 * side;
    if (!(length > 1e-3))
        return;
    dx /= length, dy /= length;
    fprintf(f, "<path d=\"M%.1f %.1fL%.1f %.1fL%.1f %.1fz\" fill=\"#000\" stroke=\"#fff\" stroke-width=\".7\"/>",
            cx + r * dx, cy + r * dy, cx + 0.78 * r * dx - 0.14 * r * dy, cy + 0.78 * r * dy + 0.14 * r * dx,
            cx + 0.78 * r * dx + 0.14 * r * dy, cy + 0.78 * r * dy - 0.14 * r * dx);
}

static void put_value(FILE *f, const struct lum_measured *m, const struct shown *is)
{
    if (is->left_out || is->no_value)
        fputs("&ndash;", f);
    else if (lum_sensor_has_eyes(&m->desc))
        fprintf(f, "%.1f", is->value);
    else
        fprintf(f, is->value < 10.0 ? "%.2g" : "%.0f", is->value);
}

static void put_cell(FILE *f, const struct lum_measured *m, const struct lum_scale *scale, uint32_t i, uint32_t x,
                     uint32_t y, uint32_t side)
{
    struct shown is = shown_at(m, i);
    bool eyes = lum_sensor_has_eyes(&m->desc), empty = is.left_out || is.no_value;
    const uint8_t *rgb = scale->colors[empty ? 0 : lum_scale_color(scale, is.value)];
    fprintf(f, "<rect x=\"%u\" y=\"%u\" width=\"%u\" height=\"%u\" fill=\"", x, y, side, side);
    if (empty)
        fputs(is.left_out ? "#ddd" : "#fff", f);
    else
        put_color(f, rgb);
    fputs("\"><title>", f);
    if (is.left_out)
        fprintf(f, "left out: %s", is.left_out);
    else if (empty)
        fputs(is.no_value, f);
    else
        fprintf(f, eyes ? "UGR %.3g &plusmn; %.2g" : "%.4g lx &plusmn; %.2g", is.value, is.stderr_of);
    fputs("</title></rect>", f);
    if (side < CELL_WITH_NUMBER)
        return;
    fprintf(f, "<text x=\"%u\" y=\"%u\" fill=\"%s\"%s>", x + side / 2, y + side / 2 + 4,
            !empty && is_dark(rgb) ? "#fff" : "#000",
            !empty && i == (eyes ? m->result.worst_at : m->result.least_at)
                ? " font-weight=\"bold\" text-decoration=\"underline\""
                : "");
    put_value(f, m, &is);
    fputs("</text>", f);
    if (eyes && !empty)
        put_look(f, m, i, x, y, side);
    fputc('\n', f);
}

static void put_key(FILE *f, const struct lum_scale *s, const char *unit)
{
    fprintf(f, "<p class=\"key\">%s: ", unit);
    for (uint32_t i = 0; i < s->n_colors; i++) {
        fputs("<span><i style=\"background: ", f);
        put_color(f, s->colors[i]);
        fputs("\"></i>", f);
        if (i < s->n_limits)
            fprintf(f, "below %g</span>", s->limits[i]);
        else
            fprintf(f, "%g and more</span>", s->n_limits > 0 ? s->limits[s->n_limits - 1] : s->min);
    }
    fputs("</p>\n", f);
}

static void put_cells(FILE *f, const struct lum_measured *m, const struct lum_scale *scale, uint32_t nu, uint32_t nv)
{
    uint32_t side = PLAN_WIDTH / nu < PLAN_HEIGHT / nv ? PLAN_WIDTH / nu : PLAN_HEIGHT / nv;
    side = side < 1 ? 1 : side > CELL_MAX ? CELL_MAX : side; /* what is wider still is made smaller by its style */
    bool eyes = lum_sensor_has_eyes(&m->desc);
    fprintf(f, "<figure><svg role=\"img\" aria-label=\"%s of each point\" ", eyes ? "UGR" : "illuminance");
    fputs(side < CELL_WITH_LARGE ? "class=\"small\" " : "", f);
    fprintf(f, "width=\"%u\" height=\"%u\" viewBox=\"0 0 %u %u\">\n", nu * side, nv * side, nu * side, nv * side);
    for (uint32_t i = 0; i < nu * nv; i++)
        put_cell(f, m, scale, i, i % nu * side, i / nu * side, side);
    struct lum_vec3d a = lum_sensor_point(m->sensor, 0), b = lum_sensor_point(m->sensor, nu * nv - 1);
    fprintf(f,
            "</svg><figcaption>%u x %u points, %.3g x %.3g m apart, from x %.2f, y %.2f, z %.2f m at the top left to x "
            "%.2f, y %.2f, z %.2f m at the bottom right; %s, grey is left out (%u inside furniture "
            "or walls, %u right below something)</figcaption></figure>\n",
            nu, nv, lum_v3d_length(m->desc.u) / nu, nv > 1 ? lum_v3d_length(m->desc.v) / nv : 0.0, a.x, a.y, a.z, b.x,
            b.y, b.z,
            eyes ? "of each eye the line of sight that is glared most, which a mark shows; the worst is underlined"
                 : "the least is underlined",
            m->result.n_inside, m->result.n_covered);
}

static enum lum_status put_plan(FILE *f, const struct lum_measured *m, struct lum_error *err)
{
    uint32_t nu, nv;
    struct lum_scale scale;
    lum_sensor_size(m->sensor, &nu, &nv);
    if (m->desc.kind == LUM_SENSOR_OBSERVER || m->desc.kind == LUM_SENSOR_POINT || nu * nv > PLANS_MAX_POINTS)
        return LUM_OK;
    float *lx = lum_calloc((size_t)nu * nv, sizeof *lx);
    if (!lx)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a plan of %u points", nu * nv);
    for (uint32_t i = 0; i < nu * nv; i++) {
        struct lum_meter_reading r = lum_sensor_reading(m->sensor, i);
        lx[i] = lum_sensor_left_out(r.clearance) ? NAN : (float)r.lx;
    }
    const struct lum_false_color colors = {.min = NAN, .max = NAN};
    bool eyes = lum_sensor_has_eyes(&m->desc);
    if (eyes)
        make_ugr_scale(&scale);
    if (eyes || lum_scale_make(&colors, lx, (size_t)nu * nv, &scale)) {
        fputs("<section><h2>", f);
        put_name(f, m);
        fputs("</h2>\n", f);
        put_cells(f, m, &scale, nu, nv);
        put_key(f, &scale, eyes ? "UGR" : "lx");
        fputs("</section>\n", f);
    }
    lum_free(lx);
    return LUM_OK;
}

/* ---- luminaires ---- */

static void put_lamps(FILE *f, const struct lum_schedule_row *r)
{
    fputs("<tr><td>", f);
    lum_page_text(f, r->what);
    fputs("<td>", f);
    lum_page_text(f, r->first);
    fprintf(f, "%s<td class=\"n\">%u<td class=\"n\">%u<td class=\"n\">", r->n > 1 ? " and others" : "", r->n, r->n_on);
    put_number(f, r->flux_lm, 4);
    bool known = !isnan(r->watts);
    fputs(known ? "<td class=\"n\">" : "<td class=\"n\">&ndash;<td class=\"n\">&ndash;</tr>\n", f);
    if (!known)
        return;
    put_number(f, r->watts, 4);
    fputs("<td class=\"n\">", f);
    put_number(f, r->watts > 0.0 ? r->flux_lm / r->watts : 0.0, 3);
    fputs("</tr>\n", f);
}

static void put_total(FILE *f, const struct lum_schedule *s)
{
    fprintf(f, "</tbody><tfoot><tr><td>All that are on<td><td><td class=\"n\">%u<td class=\"n\">", s->load.n_on);
    put_number(f, s->flux_lm, 4);
    fputs(" lm<td class=\"n\">", f);
    if (s->load.n_unknown < s->load.n_on) {
        put_number(f, s->load.watts, 4);
        fputs(s->load.n_unknown > 0 ? " W*" : " W", f);
    }
    fputs("<td></tr></tfoot></table>\n", f);
    if (s->load.n_unknown < s->load.n_on)
        fputs("<p>Watts are those of the luminaires' files, undimmed.</p>\n", f);
    char unknown[LUM_POWER_TEXT];
    lum_power_unknown(&s->load, unknown);
    if (s->load.n_unknown > 0 && s->load.n_unknown < s->load.n_on) {
        fprintf(f, "<p>* Without %u whose power is not known: ", s->load.n_unknown);
        lum_page_text(f, unknown);
        fputs("</p>\n", f);
    }
}

static void put_density(FILE *f, const struct lum_report *p)
{
    const struct lum_measured *room = lum_report_room(p->measured, p->n);
    if (!room || p->schedule->load.n_on == 0)
        return;
    struct lum_power power = lum_power_of(&p->schedule->load, &room->desc, &room->result);
    if (isnan(power.w_per_m2))
        return;
    fputs("<p>Power over the floor of \"", f);
    put_name(f, room);
    fputs("\", ", f);
    put_number(f, power.floor_m2, 3);
    fputs(" m<sup>2</sup>: ", f);
    put_number(f, power.w_per_m2, 3);
    fprintf(f, " W/m<sup>2</sup>%s", power.load.n_unknown > 0 ? "*" : "");
    if (isfinite(power.w_per_m2_100_lx.value)) {
        fputs(", or ", f);
        put_number(f, power.w_per_m2_100_lx.value, 3);
        fputs(" &plusmn; ", f);
        put_number(f, power.w_per_m2_100_lx.stderr_of, 2);
        fputs(" for each 100 lx of its E<sub>m</sub>", f);
    }
    fputs(".</p>\n", f);
}

static void put_luminaires(FILE *f, const struct lum_report *p)
{
    const struct lum_schedule *s = p->schedule;
    fputs("<section><h2>Luminaires</h2>\n", f);
    if (s->n == 0)
        fputs("<p>None.</p>\n", f);
    else
        fputs("<table>\n<thead><tr><th>luminaire<th>in the scene<th class=\"n\">number<th class=\"n\">on"
              "<th class=\"n\">lm each<th class=\"n\">W each<th class=\"n\">lm/W</tr></thead>\n<tbody>\n",
              f);
    for (size_t i = 0; i < s->n; i++)
        put_lamps(f, &s->rows[i]);
    if (s->n > 0)
        put_total(f, s);
    put_density(f, p);
    fputs("</section>\n", f);
}

/* ---- the page ---- */

static void put_head(FILE *f, const struct lum_report *p)
{
    char day[32] = "";
    time_t now = time(NULL);
    struct tm utc;
    if (gmtime_r(&now, &utc))
        strftime(day, sizeof day, "%Y-%m-%d", &utc);
    const char *name = strrchr(p->scene, '/');
    name = name ? name + 1 : p->scene;
    fputs(head, f);
    fputs("<title>Light in ", f);
    lum_page_text(f, name);
    fputs("</title>\n<h1>Light in ", f);
    lum_page_text(f, name);
    fprintf(f,
            "</h1>\n<p class=\"by\">Measured on %s by lumend %s: all light, direct and indirect, is path traced.</p>\n",
            day, LUMEND_VERSION);
}

static enum lum_status put_page(FILE *f, const struct lum_report *p, struct lum_error *err)
{
    put_head(f, p);
    put_summary(f, p);
    bool pictured = p->pictures[LUM_REPORT_PICTURE].rgb || p->pictures[LUM_REPORT_ILLUMINANCE].rgb;
    if (pictured)
        fputs("<h2>Pictures</h2>\n", f);
    enum lum_status st = put_pictures(f, p, err);
    for (size_t i = 0; i < p->n && !st; i++)
        st = put_plan(f, &p->measured[i], err);
    if (!st)
        put_luminaires(f, p);
    return st;
}

const struct lum_measured *lum_report_room(const struct lum_measured *measured, size_t n)
{
    const struct lum_measured *room = NULL;
    double most = 0.0;
    for (size_t i = 0; i < n; i++) {
        double floor_m2 = lum_power_floor(&measured[i].desc);
        if (!(floor_m2 > most))
            continue;
        most = floor_m2;
        room = &measured[i];
    }
    return room;
}

const struct lum_measured *lum_report_worst(const struct lum_measured *measured, size_t n, bool by_day,
                                            size_t *ret_observers)
{
    const struct lum_measured *worst = NULL;
    double most = -(double)INFINITY;
    *ret_observers = 0;
    for (size_t i = 0; i < n; i++) {
        const struct lum_sensor_result *r = &measured[i].result;
        if (measured[i].desc.kind != LUM_SENSOR_OBSERVER && (by_day || !lum_sensor_has_eyes(&measured[i].desc)))
            continue;
        ++*ret_observers;
        double glare = by_day ? r->dgp.dgp : r->ugr.ugr;
        if (!isfinite(glare) || !(glare > most))
            continue;
        most = glare;
        worst = &measured[i];
    }
    return *ret_observers > 1 ? worst : NULL;
}

enum lum_status lum_report_write(const struct lum_report *p, char **ret_html, size_t *ret_n, struct lum_error *err)
{
    struct lum_page page;
    enum lum_status st = lum_page_begin(&page, err);
    if (st)
        return st;
    st = put_page(page.f, p, err);
    return lum_page_end(&page, st, ret_html, ret_n, err);
}
