/* The truth study's page, truth.html: of each scene the reference and every method's pictures side by side, at one
 * exposure, each with the map of its blocks. Pictures are files beside it. */
#include <ctype.h>
#include <math.h>
#include <string.h>

#include "server/stream/png.h"
#include "tests/bench/truth.h"

bool truth_page_open(struct truth_study *study, const struct lum_bench_options *options)
{
    study->page = lum_bench_open(options, "truth.html");
    if (!study->page)
        return false;
    fputs("<!DOCTYPE html>\n<meta charset=\"utf-8\">\n<title>lumend-bench truth</title>\n<style>\n"
          "body { font: 13px sans-serif; margin: 1em; background: #222; color: #ddd }\n"
          "figure { display: inline-block; margin: 0 8px 8px 0; vertical-align: top }\n"
          "img { display: block; width: 400px } img.map { image-rendering: pixelated; margin-top: 2px }\n"
          "h2 { margin: 1em 0 .2em } p { margin: .2em 0 .6em }\n</style>\n"
          "<h1>Is the light right?</h1>\n"
          "<p>Below each picture: the mean luminance of its blocks over that of the reference. White is right, red too "
          "bright, blue too dark (both full at a factor of 2), grey not counted: too dark to tell.",
          study->page);
    if (options->quick)
        fputs(" Made with --quick: not for quoting.", study->page);
    fputs("</p>\n", study->page);
    return true;
}

bool truth_page_close(struct truth_study *study)
{
    return !study->page || lum_bench_close(study->page, "truth.html");
}

/* "interiors/office.glb (room)" as a part of a file's name: "interiors-office-glb--room-". */
static void file_name(const char *scene, const char *end, char *ret_name, size_t size)
{
    snprintf(ret_name, size, "truth-%s-%s.png", scene, end);
    for (char *c = ret_name; *c && strcmp(c, ".png") != 0; c++)
        if (!isalnum((unsigned char)*c) && *c != '_')
            *c = '-';
}

static bool write_png(const struct truth_rig *rig, const char *name, const struct lum_png *png)
{
    char path[4096];
    struct lum_error err = {0};
    snprintf(path, sizeof path, "%s/%s", rig->options->out, name);
    return lum_png_write(path, png, &err) == LUM_OK || lum_bench_failed(err.text);
}

/* White at 1, red above, blue below. */
static void map_color(double ratio, uint8_t ret_rgb[3])
{
    if (!isfinite(ratio)) {
        memset(ret_rgb, 110, 3);
        return;
    }
    double t = ratio > 0.0 ? fmin(fmax(log2(ratio), -1.0), 1.0) : -1.0;
    uint8_t rest = (uint8_t)(255.0 * (1.0 - fabs(t)) + 0.5);
    ret_rgb[0] = t < 0.0 ? rest : 255;
    ret_rgb[1] = rest;
    ret_rgb[2] = t > 0.0 ? rest : 255;
}

static bool write_map(const struct truth_rig *rig, const char *name, const double *ratios)
{
    struct lum_blocks_grid grid = lum_blocks_grid(rig->settings.w, rig->settings.h);
    size_t n = (size_t)grid.nx * grid.ny;
    uint8_t *rgb = lum_calloc(n, 3);
    if (!rgb)
        return lum_bench_failed("out of memory");
    for (size_t i = 0; i < n; i++)
        map_color(ratios[i], rgb + 3 * i);
    bool ok = write_png(rig, name, &(struct lum_png){rgb, grid.nx, grid.ny, 6});
    lum_free(rgb);
    return ok;
}

void truth_page_text(const struct truth_rig *rig, const char *text)
{
    fprintf(rig->study->page, "<p>%s</p>\n", text);
}

bool truth_page_picture(const struct truth_rig *rig, const char *title, const char *file, const float *picture,
                        const double *ratios)
{
    char name[256], map_end[64], map[256] = "";
    size_t n = (size_t)rig->settings.w * rig->settings.h;
    uint8_t *rgb = lum_calloc(n, 3);
    if (!rgb)
        return lum_bench_failed("out of memory");
    for (size_t i = 0; i < n; i++)
        lum_tone_pixel(lum_rgb(picture[3 * i], picture[3 * i + 1], picture[3 * i + 2]), rig->white, LUM_TONE_AGX,
                       rgb + 3 * i);
    file_name(rig->scene, file, name, sizeof name);
    bool ok = write_png(rig, name, &(struct lum_png){rgb, rig->settings.w, rig->settings.h, 6});
    lum_free(rgb);
    snprintf(map_end, sizeof map_end, "%s-map", file);
    file_name(rig->scene, map_end, map, sizeof map);
    ok = ok && (!ratios || write_map(rig, map, ratios));
    if (!ok)
        return false;
    FILE *f = rig->study->page;
    fprintf(f, "<figure><figcaption>%s</figcaption><a href=\"%s\"><img src=\"%s\" alt=\"\"></a>", title, name, name);
    if (ratios)
        fprintf(f, "<img class=\"map\" src=\"%s\" alt=\"\">", map);
    fputs("</figure>\n", f);
    return true;
}

/* As the daemon exposes by itself. */
static bool expose(struct truth_rig *rig)
{
    struct lum_film film;
    struct lum_error err = {0};
    uint64_t nonfinite = 0;
    if (lum_film_init(&film, rig->settings.w, rig->settings.h, &err) != LUM_OK)
        return lum_bench_failed(err.text);
    for (size_t i = 0; i < (size_t)film.w * film.h; i++) {
        const float *v = rig->reference.r.truth + 3 * i;
        lum_film_set(&film, (uint32_t)(i % film.w), (uint32_t)(i / film.w), lum_rgb(v[0], v[1], v[2]), &nonfinite);
    }
    rig->white = lum_exposure_white(lum_exposure_auto(&film));
    lum_film_finish(&film);
    return true;
}

bool truth_page_scene(struct truth_rig *rig)
{
    char title[64];
    if (!expose(rig))
        return false;
    fprintf(rig->study->page, "<h2>%s</h2>\n", rig->scene);
    snprintf(title, sizeof title, "path, %u samples: reference", rig->reference.r.spp);
    return truth_page_picture(rig, title, "reference", rig->reference.r.truth, NULL);
}
