/* lumend measure: illuminance on a grid, without network. */
#include "server/cli/commands.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "core/math/sampler.h"
#include "core/render/illuminance.h"
#include "core/render/view.h"
#include "protocol/json/json.h"
#include "server/base/write_file.h"
#include "server/cli/measure_options.h"
#include "server/cli/progress.h"
#include "server/import/expand.h"
#include "server/world/apply.h"
#include "server/world/scene_source.h"

#define POINTS_MAX 65536.0
#define SAMPLES_MAX (1u << 24) /* of a point: darker than it needs to be known, or lit by what is hardly ever found */
#define DARK 0.1               /* of the mean, so far: darker points are known to the same lux */

/* A rectangle at one height; points are in the middles of nx * nz equal cells. */
struct grid {
    double x0, z0, x1, z1, y;
    uint32_t nx, nz;
};

struct result {
    double mean, mean_stderr, least, least_stderr, most, most_stderr, uniformity, uniformity_stderr;
    size_t least_at;
};

struct measuring {
    struct lum_measure_options options;
    struct lum_world world;
    struct lum_ops edits;
    struct grid grid;
    struct lum_illuminance *points; /* nx * nz, row by row */
    struct result result;
    struct lum_progress progress;
    bool line_open;
    const char *reading; /* the file that an error is about; NULL: none */
};

static bool core_failed(const struct lum_error *e, struct lum_proto_error *err)
{
    return lum_apply_error(e, "", err);
}

static void log_to_stderr(void *user, int level, const char *component, const char *text)
{
    (void)user;
    if (level > 0 && level <= 2) /* errors are told once, at the end */
        fprintf(stderr, "lumend: %s: %s\n", component, text);
}

/* ---- the scene ---- */

static bool apply_edits(struct measuring *m, const struct lum_import_config *import, struct lum_proto_error *err)
{
    struct lum_expansion expansion = {0};
    struct lum_changes changes;
    struct lum_error e;
    if (lum_ops_need_import(&m->edits) &&
        !lum_ops_expand(&(struct lum_expand_context){.config = import}, &m->edits, &expansion, err))
        return false;
    struct lum_edit edit = {"(edits)", &m->edits, expansion.children, expansion.n};
    bool ok = lum_world_apply(&m->world, &edit, &changes, err);
    if (ok)
        lum_changes_finish(&changes);
    lum_expansion_finish(&expansion);
    return ok && (!lum_world_commit(&m->world, &e) || core_failed(&e, err));
}

static bool load(struct measuring *m, struct lum_proto_error *err)
{
    const struct lum_measure_options *o = &m->options;
    struct lum_log log = {log_to_stderr, NULL};
    struct lum_import_config import = {.assets_dir = o->assets, .log = log};
    struct lum_error e;
    if ((o->csv && lum_may_write_file(o->csv, &e)) || (o->json && lum_may_write_file(o->json, &e)))
        return core_failed(&e, err);
    if (lum_world_init(&m->world, o->threads, o->isa, &log, &e))
        return core_failed(&e, err);
    m->reading = o->scene;
    if (!lum_scene_load(&m->world, o->scene, &import, err))
        return false;
    m->reading = o->edits;
    if (o->edits && (!lum_edits_load(o->edits, &m->edits, err) || !apply_edits(m, &import, err)))
        return false;
    m->reading = NULL;
    return true;
}

/* ---- the grid ---- */

/* EN 12464-1, 4.4: p = 0.2 * 5^(log10 d), d the longer side, or the shorter where that is less than half of it; at most
 * 10 m. */
static double spacing_for(double a, double b)
{
    double longer = fmax(a, b), shorter = fmin(a, b), d = longer > 2.0 * shorter ? shorter : longer;
    return fmin(0.2 * pow(5.0, log10(d)), 10.0);
}

enum { GROUND_PROBES = 9 }; /* a side */

/* Height of the ground: the lowest that is met on the way down from half the height, so that the thickness of a floor
 * is not in it, nor furniture. */
static double ground_below(const struct lum_snapshot *s, const struct lum_box *all)
{
    double ground = (double)INFINITY, middle = 0.5 * (all->lo.y + all->hi.y);
    for (uint32_t i = 0; i < GROUND_PROBES * GROUND_PROBES; i++) {
        double u = (i % GROUND_PROBES + 0.5) / GROUND_PROBES, v = ((double)(i / GROUND_PROBES) + 0.5) / GROUND_PROBES;
        struct lum_vec3d from = {all->lo.x + u * (all->hi.x - all->lo.x), middle,
                                 all->lo.z + v * (all->hi.z - all->lo.z)};
        struct lum_camera down = {
            .position = from, .target = {from.x, from.y - 1.0, from.z}, .up = {0, 0, -1}, .vfov_deg = 10};
        struct lum_pick hit;
        lum_pick_at(s, &down, 1, 1, 0.5, 0.5, &hit);
        if (hit.hit)
            ground = fmin(ground, hit.point_world.y);
    }
    return isfinite(ground) ? ground : all->lo.y;
}

static bool find_object(const struct measuring *m, struct lum_box *ret_box, struct lum_proto_error *err)
{
    char near[sizeof err->text / 2];
    if (lum_snapshot_bounds(m->world.snapshot, m->options.on, ret_box))
        return true;
    lum_document_nearest(m->world.doc, LUM_RECORD_OBJECT, m->options.on, near, sizeof near);
    return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "on", "there is no object \"%.60s\" to be seen%s",
                          m->options.on, near);
}

static bool place_grid(struct measuring *m, struct lum_proto_error *err)
{
    const struct lum_measure_options *o = &m->options;
    struct grid *g = &m->grid;
    struct lum_box all, box;
    if (!lum_snapshot_bounds(m->world.snapshot, NULL, &all))
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "",
                              "the scene has no surface: nothing to measure");
    if (!find_object(m, &box, err))
        return false;
    *g = (struct grid){box.lo.x + o->border_m,
                       box.lo.z + o->border_m,
                       box.hi.x - o->border_m,
                       box.hi.z - o->border_m,
                       (o->on ? box.hi.y : ground_below(m->world.snapshot, &all)) + o->height_m,
                       0,
                       0};
    if (o->has_area)
        *g = (struct grid){o->area[0], o->area[1], o->area[2], o->area[3], g->y, 0, 0};
    if (g->x0 > all.hi.x || g->x1 < all.lo.x || g->z0 > all.hi.z || g->z1 < all.lo.z)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "invalid_value", "area",
                              "the area lies beside the scene, which spans x %.2f to %.2f and z %.2f to %.2f", all.lo.x,
                              all.hi.x, all.lo.z, all.hi.z);
    double w = g->x1 - g->x0, d = g->z1 - g->z0;
    if (!(w > 0.0 && d > 0.0))
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "invalid_value", "border",
                              "nothing is left of %.2f x %.2f m within a border of %g m: give --border",
                              box.hi.x - box.lo.x, box.hi.z - box.lo.z, o->border_m);
    double p = o->spacing_m > 0.0 ? o->spacing_m : spacing_for(w, d), nx = fmax(ceil(w / p - 1e-9), 1.0),
           nz = fmax(ceil(d / p - 1e-9), 1.0);
    if (!(nx * nz <= POINTS_MAX))
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "spacing",
                              "%.0f x %.0f points are more than %.0f: give a wider --spacing", nx, nz, POINTS_MAX);
    g->nx = (uint32_t)nx;
    g->nz = (uint32_t)nz;
    m->points = lum_calloc((size_t)g->nx * g->nz, sizeof *m->points);
    return m->points || lum_proto_fail_memory(err);
}

static struct lum_vec3d point_at(const struct grid *g, size_t i)
{
    double u = ((double)(i % g->nx) + 0.5) / g->nx, v = ((double)(i / g->nx) + 0.5) / g->nz;
    return (struct lum_vec3d){g->x0 + u * (g->x1 - g->x0), g->y, g->z0 + v * (g->z1 - g->z0)};
}

/* ---- measuring ---- */

static void tell_progress(struct measuring *m, size_t n_done, size_t n)
{
    if (!lum_progress_due(&m->progress, lum_clock_ns()))
        return;
    fprintf(stderr, "%slumend measure: %zu of %zu points%s", m->progress.tty ? "\r" : "", n_done, n,
            m->progress.tty ? "" : "\n");
    m->line_open = m->progress.tty;
}

/* Once coarsely, which says what is dark; then to what was asked for. */
static bool measure(struct measuring *m, struct lum_proto_error *err)
{
    size_t n = (size_t)m->grid.nx * m->grid.nz;
    double mean = 0.0;
    for (int round = 0; round < 2; round++)
        for (size_t i = 0; i < n; i++) {
            struct lum_place at = {point_at(&m->grid, i), {0.0f, 1.0f, 0.0f}, m->options.cylindrical};
            struct lum_illuminance_goal goal = {m->options.error, DARK * mean, round == 0 ? 1 : SAMPLES_MAX,
                                                lum_hash_combine(lum_hash_u32(m->options.seed), (uint32_t)i)};
            struct lum_error e;
            if (lum_illuminance_at(m->world.pool, m->world.snapshot, &at, &goal, &m->points[i], &e))
                return core_failed(&e, err);
            if (round == 0)
                mean += m->points[i].lx / (double)n;
            else
                tell_progress(m, i + 1, n);
        }
    return true;
}

/* The points' noise is independent. That of the least one is taken for Emin's: among points that are alike the least is
 * the one that noise made least, so that Emin and Uo are low by up to about two of them. */
static void summarise(struct measuring *m)
{
    struct result *r = &m->result;
    size_t n = (size_t)m->grid.nx * m->grid.nz;
    *r = (struct result){.least = (double)INFINITY, .most = -(double)INFINITY};
    for (size_t i = 0; i < n; i++) {
        const struct lum_illuminance *p = &m->points[i];
        r->mean += p->lx / (double)n;
        r->mean_stderr += p->stderr_lx * p->stderr_lx;
        if (p->lx < r->least) {
            r->least = p->lx;
            r->least_stderr = p->stderr_lx;
            r->least_at = i;
        }
        if (p->lx > r->most) {
            r->most = p->lx;
            r->most_stderr = p->stderr_lx;
        }
    }
    r->mean_stderr = sqrt(r->mean_stderr) / (double)n;
    if (r->mean > 0.0) {
        r->uniformity = r->least / r->mean;
        r->uniformity_stderr = hypot(r->least_stderr, r->uniformity * r->mean_stderr) / r->mean;
    }
}

/* ---- telling ---- */

enum { COLUMNS = 16 }; /* that fit a terminal */

static void print_grid(const struct measuring *m)
{
    const struct grid *g = &m->grid;
    printf("%s illuminance in lx, %s %.3f m, %u x %u points, %.3f x %.3f m apart\n",
           m->options.cylindrical ? "cylindrical" : "horizontal", "at y =", g->y, g->nx, g->nz, (g->x1 - g->x0) / g->nx,
           (g->z1 - g->z0) / g->nz);
    if (g->nx > COLUMNS) {
        printf("(more columns than fit a line: --csv has them)\n");
        return;
    }
    printf("%8s", "z \\ x");
    for (uint32_t x = 0; x < g->nx; x++)
        printf(" %8.2f", point_at(g, x).x);
    for (uint32_t z = 0; z < g->nz; z++) {
        printf("\n%8.2f", point_at(g, (size_t)z * g->nx).z);
        for (uint32_t x = 0; x < g->nx; x++)
            printf(" %8.4g", m->points[(size_t)z * g->nx + x].lx);
    }
    putchar('\n');
}

/* A target is reached, or missed; or too near to say, by two standard errors. Returns false where it is missed. */
static bool tell_target(const char *name, double value, double stderr_of, double target)
{
    if (!(target > 0.0))
        return true;
    bool sure = fabs(value - target) >= 2.0 * stderr_of, reached = value >= target;
    printf("%-5s %s %g%s\n", name, reached ? "reaches" : "misses", target,
           sure ? "" : ", within what noise leaves open: a smaller --error tells");
    return reached;
}

static bool print_result(const struct measuring *m)
{
    const struct result *r = &m->result;
    struct lum_vec3d at = point_at(&m->grid, r->least_at);
    printf("Em    %.4g lx +/- %.2g\n", r->mean, r->mean_stderr);
    printf("Emin  %.4g lx +/- %.2g, at x %.2f, z %.2f\n", r->least, r->least_stderr, at.x, at.z);
    printf("Emax  %.4g lx +/- %.2g\n", r->most, r->most_stderr);
    printf("Uo    %.3f +/- %.2g (Emin / Em)\n", r->uniformity, r->uniformity_stderr);
    bool mean = tell_target("Em", r->mean, r->mean_stderr, m->options.target_lx);
    bool uniformity = tell_target("Uo", r->uniformity, r->uniformity_stderr, m->options.uniformity);
    return mean && uniformity;
}

static bool close_file(FILE *f, const char *path, bool ok, struct lum_proto_error *err)
{
    if (f && fclose(f) != 0)
        ok = false;
    return ok || lum_proto_fail(err, LUM_PROTO_APPLICATION, "io", "", "cannot write %.150s: %s", path, strerror(errno));
}

static bool write_csv(const struct measuring *m, struct lum_proto_error *err)
{
    FILE *f = fopen(m->options.csv, "wb");
    bool ok = f && fputs("x_m,y_m,z_m,lx,stderr_lx\n", f) >= 0;
    for (size_t i = 0; ok && i < (size_t)m->grid.nx * m->grid.nz; i++) {
        struct lum_vec3d p = point_at(&m->grid, i);
        ok = fprintf(f, "%.6g,%.6g,%.6g,%.6g,%.3g\n", p.x, p.y, p.z, m->points[i].lx, m->points[i].stderr_lx) > 0;
    }
    return close_file(f, m->options.csv, ok, err);
}

static cJSON *points_json(const struct measuring *m)
{
    cJSON *list = cJSON_CreateArray();
    for (size_t i = 0; i < (size_t)m->grid.nx * m->grid.nz; i++) {
        struct lum_vec3d p = point_at(&m->grid, i);
        double at[3] = {p.x, p.y, p.z};
        cJSON *o = cJSON_CreateObject();
        lum_json_add(o, "point", cJSON_CreateDoubleArray(at, 3));
        lum_json_add_number(o, "lx", m->points[i].lx);
        lum_json_add_number(o, "stderr_lx", m->points[i].stderr_lx);
        cJSON_AddItemToArray(list, o);
    }
    return list;
}

static bool write_json(const struct measuring *m, struct lum_proto_error *err)
{
    const struct result *r = &m->result;
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_string(o, "scene", m->options.scene) &&
              lum_json_add_string(o, "quantity", m->options.cylindrical ? "cylindrical" : "horizontal") &&
              lum_json_add_number(o, "nx", m->grid.nx) && lum_json_add_number(o, "nz", m->grid.nz) &&
              lum_json_add_number(o, "em_lx", r->mean) && lum_json_add_number(o, "em_stderr_lx", r->mean_stderr) &&
              lum_json_add_number(o, "emin_lx", r->least) &&
              lum_json_add_number(o, "emin_stderr_lx", r->least_stderr) && lum_json_add_number(o, "emax_lx", r->most) &&
              lum_json_add_number(o, "emax_stderr_lx", r->most_stderr) && lum_json_add_number(o, "uo", r->uniformity) &&
              lum_json_add_number(o, "uo_stderr", r->uniformity_stderr) && lum_json_add(o, "points", points_json(m));
    char *text = ok ? lum_json_print(o, NULL) : NULL;
    cJSON_Delete(o);
    if (!text)
        return lum_proto_fail_memory(err);
    FILE *f = fopen(m->options.json, "wb");
    ok = f && fputs(text, f) >= 0 && fputc('\n', f) != EOF;
    free(text);
    return close_file(f, m->options.json, ok, err);
}

static bool run(struct measuring *m, bool *ret_reached, struct lum_proto_error *err)
{
    if (!load(m, err) || !place_grid(m, err) || !measure(m, err))
        return false;
    if (m->line_open)
        fputc('\n', stderr);
    m->line_open = false;
    summarise(m);
    print_grid(m);
    *ret_reached = print_result(m);
    return (!m->options.csv || write_csv(m, err)) && (!m->options.json || write_json(m, err));
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
        lum_measure_options_help(stdout);
        return LUM_EXIT_OK;
    }
    struct lum_proto_error err = {0};
    bool reached = false, ok = run(&m, &reached, &err);
    if (m.line_open)
        fputc('\n', stderr);
    if (!ok)
        fprintf(stderr, "lumend measure: %s%s%s\n", m.reading ? m.reading : "", m.reading ? ": " : "", err.text);
    lum_free(m.points);
    lum_ops_finish(&m.edits);
    lum_world_finish(&m.world);
    return ok && reached ? LUM_EXIT_OK : LUM_EXIT_FAILED;
}
