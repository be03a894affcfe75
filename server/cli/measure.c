/* lumend measure: what the sensors of a scene show, or a grid over its floor, without network. */
#include "server/cli/commands.h"
#include "server/cli/help.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "server/base/write_file.h"
#include "server/cli/load.h"
#include "server/cli/measure_options.h"
#include "server/cli/measure_report.h"
#include "server/cli/progress.h"
#include "server/report/schedule.h"
#include "server/report/shot.h"
#include "server/world/apply.h"
#include "server/world/work_plane.h"

#define SLICE_SAMPLES 65536u /* between two looks at the clock */

struct measuring {
    struct lum_measure_options options;
    struct lum_world world;
    struct lum_measured *measured;
    size_t n_measured;
    struct lum_progress progress;
    bool line_open;
    const char *reading; /* the file that an error is about; NULL: none */
};

static bool core_failed(const struct lum_error *e, struct lum_proto_error *err)
{
    return lum_apply_error(e, "", err);
}

/* ---- the scene ---- */

static bool load(struct measuring *m, struct lum_proto_error *err)
{
    const struct lum_measure_options *o = &m->options;
    const struct lum_cli_scene what = {o->scene, o->edits, o->assets, o->isa, o->threads};
    struct lum_error e;
    if ((o->csv && lum_may_write_file(o->csv, &e)) || (o->json && lum_may_write_file(o->json, &e)) ||
        (o->html && lum_may_write_file(o->html, &e)))
        return core_failed(&e, err);
    return lum_cli_load(&m->world, &what, &m->reading, err);
}

/* ---- what is measured ---- */

/* The grid of the command line. */
static bool place_grid(struct measuring *m, struct lum_proto_error *err)
{
    const struct lum_measure_options *o = &m->options;
    struct lum_work_plane plane = {o->on, o->has_area ? o->area : NULL, o->height_m, o->border_m};
    m->measured = lum_calloc(1, sizeof *m->measured);
    if (!m->measured)
        return lum_proto_fail_memory(err);
    m->n_measured = 1;
    struct lum_measured *one = m->measured;
    if (!lum_work_plane_place(&m->world, &plane, &one->desc, err))
        return false;
    one->desc.quantity = o->ugr ? LUM_METER_EYE : o->cylindrical ? LUM_METER_CYLINDER : LUM_METER_PLANE;
    one->desc.facing = lum_v3(0, 0, -1);
    one->desc.n_directions = o->directions;
    one->desc.modelling = o->modelling;
    one->desc.spacing_m = o->spacing_m;
    one->targets = (struct lum_sensor_targets){.lx = o->target_lx, .uo = o->uniformity, .ugr = o->most_ugr};
    return true;
}

struct finding {
    struct lum_measured *measured;
    size_t n;
};

static void take_sensor(void *user, const struct lum_record *r)
{
    struct finding *f = user;
    if (r->type == LUM_RECORD_SENSOR)
        f->measured[f->n++] = (struct lum_measured){
            .id = r->id, .name = r->sensor.name, .desc = lum_sensor_desc_of(r), .targets = lum_sensor_targets_of(r)};
}

/* The scene's own, unless the command line names a place. */
static bool find_sensors(struct measuring *m, struct lum_proto_error *err)
{
    struct finding f = {.measured = lum_calloc(LUM_LIMIT_SENSORS, sizeof *f.measured)};
    if (!f.measured || !lum_document_each(m->world.doc, take_sensor, &f)) {
        lum_free(f.measured);
        return lum_proto_fail_memory(err);
    }
    if (f.n == 0 || m->options.has_grid) {
        lum_free(f.measured);
        return place_grid(m, err);
    }
    m->measured = f.measured;
    m->n_measured = f.n;
    return true;
}

/* ---- measuring ---- */

static void tell_progress(struct measuring *m, size_t i)
{
    if (!lum_progress_due(&m->progress, lum_clock_ns()))
        return;
    uint32_t nu, nv;
    lum_sensor_size(m->measured[i].sensor, &nu, &nv);
    fprintf(stderr, "%slumend measure: sensor %zu of %zu, %u points, %llu paths%s", m->progress.tty ? "\r" : "", i + 1,
            m->n_measured, nu * nv, (unsigned long long)lum_sensor_samples(m->measured[i].sensor),
            m->progress.tty ? "" : "\n");
    m->line_open = m->progress.tty;
}

static bool measure_one(struct measuring *m, size_t i, struct lum_proto_error *err)
{
    struct lum_measured *one = &m->measured[i];
    const struct lum_meter_goal goal = {m->options.error, LUM_SENSOR_DARK, LUM_SENSOR_SAMPLES_MAX};
    struct lum_error e;
    one->desc.seed = m->options.seed;
    if (lum_sensor_create(&one->desc, LUM_SENSOR_POINTS_MAX, &one->sensor, &e))
        return core_failed(&e, err);
    lum_sensor_aim(one->sensor, m->world.snapshot);
    (void)lum_sensor_look(one->sensor, m->world.pool, LUM_SENSOR_POINTS_MAX, false); /* at all */
    for (bool more = true; more; tell_progress(m, i))
        if (lum_sensor_refine(one->sensor, m->world.pool, &goal, SLICE_SAMPLES, &more, &e))
            return core_failed(&e, err);
    return lum_sensor_result(one->sensor, &one->result) || one->id || /* a sensor of the scene says so itself */
           lum_proto_fail(err, LUM_PROTO_APPLICATION, "invalid_value", "",
                          "nothing to measure: all points lie inside furniture or walls, or right below something");
}

static void tell_picture(struct measuring *m, uint32_t spp)
{
    if (!lum_progress_due(&m->progress, lum_clock_ns()))
        return;
    fprintf(stderr, "%slumend measure: pictures, %u samples%s", m->progress.tty ? "\r" : "", spp,
            m->progress.tty ? "                    " : "\n");
    m->line_open = m->progress.tty;
}

static enum lum_status take_picture(struct measuring *m, bool illuminance, struct lum_canvas *ret_canvas,
                                    struct lum_error *err)
{
    const struct lum_shot_desc desc = {LUM_REPORT_PICTURE_W, LUM_REPORT_PICTURE_H, m->options.pictures_spp, illuminance,
                                       NULL};
    struct lum_shot *shot;
    enum lum_status st = lum_shot_create(&m->world, &desc, &shot, err);
    if (st)
        return st;
    for (bool done = false; !done && !st; tell_picture(m, lum_shot_spp(shot)))
        st = lum_shot_pass(shot, NULL, &done, err);
    if (!st)
        st = lum_shot_paint(shot, ret_canvas, err);
    lum_shot_destroy(shot);
    return st;
}

static enum lum_status make_page(struct measuring *m, const struct lum_schedule *schedule, struct lum_error *err)
{
    struct lum_report report = {
        .scene = m->options.scene, .measured = m->measured, .n = m->n_measured, .schedule = schedule};
    char *html = NULL;
    size_t n = 0;
    enum lum_status st = LUM_OK;
    for (int i = 0; i < LUM_REPORT_PICTURES && !st && m->options.pictures_spp > 0; i++)
        st = take_picture(m, i == LUM_REPORT_ILLUMINANCE, &report.pictures[i], err);
    if (!st)
        st = lum_report_write(&report, &html, &n, err);
    if (!st)
        st = lum_write_file(m->options.html, html, n, err);
    free(html);
    for (int i = 0; i < LUM_REPORT_PICTURES; i++)
        lum_free(report.pictures[i].rgb);
    return st;
}

static bool write_page(struct measuring *m, struct lum_proto_error *err)
{
    struct lum_error e;
    struct lum_schedule schedule;
    enum lum_status st = lum_schedule_make(&m->world, &schedule, &e);
    if (!st) {
        st = make_page(m, &schedule, &e);
        lum_schedule_finish(&schedule);
    }
    return !st || core_failed(&e, err);
}

static bool run(struct measuring *m, bool *ret_reached, struct lum_proto_error *err)
{
    if (!load(m, err) || !find_sensors(m, err))
        return false;
    for (size_t i = 0; i < m->n_measured; i++)
        if (!measure_one(m, i, err))
            return false;
    if (m->line_open)
        fputc('\n', stderr);
    m->line_open = false;
    *ret_reached = true;
    for (size_t i = 0; i < m->n_measured; i++)
        *ret_reached = lum_measure_print(&m->measured[i]) && *ret_reached;
    struct lum_load load;
    lum_load_of(&m->world, &load);
    lum_measure_print_worst(m->measured, m->n_measured);
    lum_measure_print_power(m->measured, m->n_measured, &load);
    const struct lum_measure_options *o = &m->options;
    return (!o->csv || lum_measure_write_csv(o->csv, m->measured, m->n_measured, err)) &&
           (!o->json || lum_measure_write_json(o->json, o->scene, m->measured, m->n_measured, &load, err)) &&
           (!o->html || write_page(m, err));
}

int lum_cmd_measure(int argc, char **argv)
{
    struct measuring m = {.progress = {.start_ns = lum_clock_ns(), .tty = isatty(STDERR_FILENO)}};
    struct lum_error usage;
    if (lum_measure_options_parse(argc, argv, &m.options, &usage)) {
        fprintf(stderr, "lumend measure: %s\n", usage.text);
        return LUM_EXIT_USAGE;
    }
    if (m.options.help) {
        lum_help_measure(&(struct lum_help){stdout, false});
        return LUM_EXIT_OK;
    }
    struct lum_proto_error err = {0};
    bool reached = false, ok = run(&m, &reached, &err);
    if (m.line_open)
        fputc('\n', stderr);
    if (!ok)
        fprintf(stderr, "lumend measure: %s%s%s\n", m.reading ? m.reading : "", m.reading ? ": " : "", err.text);
    for (size_t i = 0; i < m.n_measured; i++)
        lum_sensor_destroy(m.measured[i].sensor);
    lum_free(m.measured);
    lum_world_finish(&m.world);
    return ok && reached ? LUM_EXIT_OK : LUM_EXIT_FAILED;
}
