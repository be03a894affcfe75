#include "server/cli/compare_page.h"

#include "core/metric/heat.h"
#include "server/report/page.h"

enum { PNG_LEVEL = 6 }; /* zlib's own choice: a page is kept, and nobody waits as for a frame */

static const char head[] =
    "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>lumend compare</title>\n<style>\n"
    "body { font: 15px/1.45 sans-serif; margin: 1.5em auto; padding: 0 1.5em; background: #1d1d1f; color: #ddd; "
    "max-width: 1280px }\n"
    "h1 { font-size: 1.3em } h2 { font-size: 1.1em; margin: 1.6em 0 .5em }\n"
    ".path, pre { font-family: monospace; overflow-wrap: anywhere }\n"
    "table { border-collapse: collapse } td, th { padding: .2em 1em .2em 0; text-align: left; vertical-align: top }\n"
    "td:nth-child(2) { font-variant-numeric: tabular-nums; white-space: nowrap }\n"
    "#pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(380px, 100%), 1fr)); gap: 16px }\n"
    "figure { margin: 0 } img { display: block; width: 100%; height: auto } figcaption { margin-top: .2em }\n"
    "#wipe { position: relative; max-width: 900px; touch-action: none; cursor: ew-resize }\n"
    "#over { position: absolute; top: 0; left: 0 }\n"
    "#line { position: absolute; top: 0; bottom: 0; width: 1px; background: #fff }\n"
    "#cut { width: 100%; max-width: 900px; margin: .5em 0 } .scale { display: inline-block; width: 256px; height: 12px "
    "}\n"
    "pre { white-space: pre-wrap; color: #aaa }\n</style>\n";

/* The slider, the keys that move it and the mouse say one number: where the left picture ends. */
static const char script[] =
    "<script>\n"
    "const at = (id) => document.getElementById(id);\n"
    "function show() {\n"
    "  at('under').src = at(at('left').value).src;\n"
    "  at('over').src = at(at('right').value).src;\n"
    "  at('over').style.clipPath = `inset(0 0 0 ${at('cut').value}%)`;\n"
    "  at('line').style.left = at('cut').value + '%';\n"
    "}\n"
    "function point(event) {\n"
    "  const box = at('wipe').getBoundingClientRect();\n"
    "  if (event.buttons) at('cut').value = 100 * (event.clientX - box.left) / box.width;\n"
    "  show();\n"
    "}\n"
    "for (const id of ['left', 'right', 'cut']) at(id).addEventListener('input', show);\n"
    "for (const kind of ['pointerdown', 'pointermove']) at('wipe').addEventListener(kind, point);\n"
    "at('wipe').addEventListener('dragstart', (event) => event.preventDefault());\n"
    "show();\n"
    "</script>\n";

/* ---- pictures ---- */

static enum lum_status put_picture(FILE *f, const char *id, const struct lum_png *png, const char *caption,
                                   const char *detail, struct lum_error *err)
{
    fprintf(f, "<figure><img id=\"%s\"", id);
    enum lum_status st = lum_page_image(f, png, caption, err);
    fputs("><figcaption>", f);
    lum_page_text(f, caption);
    fputs(detail[0] ? ": <span class=\"path\">" : "", f);
    lum_page_text(f, detail);
    fputs(detail[0] ? "</span></figcaption></figure>\n" : "</figcaption></figure>\n", f);
    return st;
}

static const char *const map_captions[LUM_COMPARE_METRICS] = {
    [LUM_COMPARE_RELMSE] = "Relative squared error, over four decades: from 0.0001 to 1",
    [LUM_COMPARE_FLIP] = "FLIP: 0 to 1",
    [LUM_COMPARE_HDRFLIP] = "HDR-FLIP: 0 to 1",
    [LUM_COMPARE_HDRVDP] = "HDR-VDP: the probability, 0 to 1, that one sees a difference",
};

static enum lum_status put_pictures(FILE *f, const struct lum_comparison *c, struct lum_error *err)
{
    const struct lum_compared *a = &c->pictures[LUM_COMPARE_A], *b = &c->pictures[LUM_COMPARE_B];
    enum lum_status st =
        put_picture(f, "a", &(struct lum_png){a->shown, a->w, a->h, PNG_LEVEL}, "A, compared", a->path, err);
    if (!st)
        st = put_picture(f, "b", &(struct lum_png){b->shown, b->w, b->h, PNG_LEVEL}, "B, the reference", b->path, err);
    for (int m = 0; !st && m < LUM_COMPARE_METRICS; m++) {
        if (!c->maps[m])
            continue;
        uint8_t *rgb = lum_compare_paint(c, (enum lum_compare_metric)m);
        st = rgb ? put_picture(f, lum_compare_names[m], &(struct lum_png){rgb, a->w, a->h, PNG_LEVEL}, map_captions[m],
                               "", err)
                 : lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a heat map");
        lum_free(rgb);
    }
    return st;
}

static void put_choice(FILE *f, const struct lum_comparison *c, const char *id, const char *label, const char *chosen)
{
    fprintf(f, "<label>%s <select id=\"%s\">\n<option value=\"a\"%s>A</option><option value=\"b\"%s>B</option>", label,
            id, chosen[0] == 'a' ? " selected" : "", chosen[0] == 'b' ? " selected" : "");
    for (int m = 0; m < LUM_COMPARE_METRICS; m++)
        if (c->maps[m])
            fprintf(f, "<option value=\"%s\">map of %s</option>", lum_compare_names[m], lum_compare_names[m]);
    fputs("</select></label>\n", f);
}

static void put_wipe(FILE *f, const struct lum_comparison *c)
{
    fputs("<h2>Wipe</h2>\n<p>", f);
    put_choice(f, c, "left", "left:", "a");
    put_choice(f, c, "right", "right:", "b");
    fputs("</p>\n<div id=\"wipe\"><img id=\"under\" alt=\"\"><img id=\"over\" alt=\"\"><div id=\"line\"></div></div>\n"
          "<p><input id=\"cut\" type=\"range\" min=\"0\" max=\"100\" step=\"0.5\" value=\"50\" "
          "aria-label=\"where the left picture ends\"></p>\n",
          f);
}

static void put_scale(FILE *f)
{
    struct lum_heat heat;
    lum_heat_init(&heat);
    fputs("<p>Maps: 0 <span class=\"scale\" style=\"background: linear-gradient(90deg", f);
    for (uint32_t i = 0; i < LUM_HEAT_COLORS; i += 15)
        fprintf(f, ", rgb(%u %u %u)", heat.srgb[i][0], heat.srgb[i][1], heat.srgb[i][2]);
    fputs(")\"></span> 1; cyan: not finite</p>\n", f);
}

/* ---- figures ---- */

static void put_row(FILE *f, const char *name, double value, const char *meaning)
{
    fprintf(f, "<tr><td>%s<td>%.6g<td>%s</tr>\n", name, value, meaning);
}

static void put_figures(FILE *f, const struct lum_comparison *c)
{
    const bool *w = c->wanted;
    fputs("<h2>Figures</h2>\n<table>\n<tr><th>metric<th>value<th>meaning</tr>\n", f);
    if (w[LUM_COMPARE_RELMSE])
        put_row(f, "relMSE", c->relative.relmse, "mean of (a - b)&sup2; / (b&sup2; + 0.01)");
    if (w[LUM_COMPARE_RMSE])
        put_row(f, "RMSE", c->relative.rmse, "root of the mean of (a - b)&sup2;, in the pictures' unit");
    if (w[LUM_COMPARE_SMAPE])
        put_row(f, "SMAPE", c->relative.smape, "mean of |a - b| / (|a| + |b| + 0.01), 0 to 1");
    if (w[LUM_COMPARE_FLIP])
        put_row(f, "FLIP", c->flip.mean, "mean over pixels, 0 to 1, of what a display shows");
    if (w[LUM_COMPARE_HDRFLIP])
        put_row(f, "HDR-FLIP", c->hdrflip.mean, "mean over pixels of the largest FLIP at any exposure");
    if (w[LUM_COMPARE_HDRVDP]) {
        put_row(f, "HDR-VDP, P &ge; 75 %", 100.0 * c->hdrvdp.p75,
                "% of pixels: a difference is seen with at least this probability");
        put_row(f, "HDR-VDP, P &ge; 95 %", 100.0 * c->hdrvdp.p95, "% of pixels");
    }
    if (w[LUM_COMPARE_BLOCKS]) {
        put_row(f, "blocks, mean", c->blocks.mean, "mean luminance of A over that of B");
        put_row(f, "blocks, 5 %", c->blocks.p5, "the same of squares of 1/24 of the width");
        put_row(f, "blocks, 95 %", c->blocks.p95, "");
    }
    if (c->relative.n_nonfinite)
        put_row(f, "not finite", (double)c->relative.n_nonfinite,
                "values left out: they are an error of who made the picture");
    fputs("</table>\n", f);
}

/* ---- the page ---- */

static enum lum_status put_page(FILE *f, const struct lum_comparison *c, const char *json, struct lum_error *err)
{
    fputs(head, f);
    fputs("<h1>A <span class=\"path\">", f);
    lum_page_text(f, c->pictures[LUM_COMPARE_A].path);
    fputs("</span> against B <span class=\"path\">", f);
    lum_page_text(f, c->pictures[LUM_COMPARE_B].path);
    fputs("</span></h1>\n", f);
    put_figures(f, c);
    put_wipe(f, c);
    fputs("<h2>Side by side</h2>\n<div id=\"pictures\">\n", f);
    enum lum_status st = put_pictures(f, c, err);
    if (st)
        return st;
    fputs("</div>\n", f);
    put_scale(f);
    if (!c->pictures[LUM_COMPARE_B].is_png)
        fprintf(f, "<p>Both are exposed by EV100 %.2f, which fits B, and tone mapped by AgX.</p>\n", c->ev100);
    fputs("<h2>As lumend compare printed it</h2>\n<pre>", f);
    lum_page_text(f, json);
    fputs("</pre>\n", f);
    fputs(script, f);
    return LUM_OK;
}

enum lum_status lum_compare_page_write(const char *path, const struct lum_comparison *c, const char *json,
                                       struct lum_error *err)
{
    struct lum_page page;
    enum lum_status st = lum_page_begin(&page, err);
    if (st)
        return st;
    st = put_page(page.f, c, json, err);
    return lum_page_end_file(&page, path, st, err);
}
