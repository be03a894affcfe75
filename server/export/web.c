/* Photometric webs as LM-63-2002 text. */
#define _GNU_SOURCE
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/base/web_desc.h"
#include "server/export/internal.h"

#define WORDS_PER_LINE 10 /* of 20 bytes at most: LM-63-2002 allows 256 a line */
/* Of webs that are not measured as luminaires are: finer than what goniometers of floodlights have. */
#define STEP_C_DEG 5
#define STEP_GAMMA_DEG 2.5
#define PLANES (360 / STEP_C_DEG + 1)
#define ANGLES 73

static void put_numbers(FILE *out, const float *v, size_t n)
{
    for (size_t i = 0; i < n; i++)
        fprintf(out, "%.9g%c", (double)v[i], (i + 1) % WORDS_PER_LINE == 0 || i + 1 == n ? '\n' : ' ');
}

/* Planes that go all around, or one: what the file format says of them is what they are. Fewer would stand for their
 * mirror images. */
static bool is_plain(const struct lum_record_web *w)
{
    const float *c = w->c_deg.f32;
    size_t n = w->c_deg.n;
    return strcmp(w->type, "c") == 0 && (n == 1 || (c[n - 1] - c[0] == 360.0f && c[0] >= -360.0f && c[0] <= 0.0f));
}

/* Signs say the shape (LM-63-2002): a disc has both widths negative, a ball all three. */
static void put_head(FILE *out, const struct lum_record_web *w, size_t n_angles, size_t n_planes)
{
    bool sphere = strcmp(w->opening, "sphere") == 0, round = sphere || strcmp(w->opening, "disc") == 0,
         point = strcmp(w->opening, "point") == 0;
    double sign = point ? 0.0 : round ? -1.0 : 1.0;
    fprintf(out,
            "IESNA:LM-63-2002\n[TEST] not known\n[TESTLAB] not known\n[ISSUEDATE] not known\n[MANUFAC] not known\n");
    if (w->name[0])
        fprintf(out, "[LUMINAIRE] %s\n", w->name);
    fprintf(out, "TILT=NONE\n1 %.9g 1 %zu %zu 1 2 %.9g %.9g %.9g\n1 1 %.9g\n",
            w->rated_lm.set ? w->rated_lm.value : -1.0, n_angles, n_planes, sign * w->size[1], sign * w->size[0],
            point ? 0.0 : (sphere ? -1.0 : 1.0) * w->size[2], w->watts.set ? w->watts.value : 0.0);
}

/* By sampling, as intensities about the direction in which the lamp aims. */
static bool put_sampled(FILE *out, const struct lum_record_web *file)
{
    float planes[PLANES], angles[ANGLES], values[ANGLES];
    struct lum_web_desc desc = lum_web_desc_of(file);
    struct lum_web *web;
    if (lum_web_create(&desc, &web, NULL))
        return false;
    for (int k = 0; k < ANGLES; k++)
        angles[k] = (float)(k * STEP_GAMMA_DEG);
    for (int i = 0; i < PLANES; i++)
        planes[i] = (float)(i * STEP_C_DEG);
    put_head(out, file, ANGLES, PLANES);
    put_numbers(out, angles, ANGLES);
    put_numbers(out, planes, PLANES);
    for (int i = 0; i < PLANES; i++) {
        for (int k = 0; k < ANGLES; k++) {
            float c = planes[i] * (float)M_PI / 180.0f, g = angles[k] * (float)M_PI / 180.0f;
            float along_d = cosf(g), along_c0 = sinf(g) * cosf(c), along_c90 = sinf(g) * sinf(c);
            struct lum_vec3 v = desc.type == LUM_WEB_B   ? lum_v3(along_d, along_c0, -along_c90)
                                : desc.type == LUM_WEB_A ? lum_v3(along_d, -along_c90, along_c0)
                                                         : lum_v3(along_c0, along_c90, along_d);
            values[k] = (float)(web->peak_cd * (double)lum_web_share_along(web, v));
        }
        put_numbers(out, values, ANGLES);
    }
    lum_web_unref(web);
    return true;
}

char *lum_export_ies(const struct lum_record_web *web, size_t *ret_n)
{
    char *text = NULL;
    FILE *out = open_memstream(&text, ret_n);
    bool ok = out != NULL;
    if (ok && is_plain(web)) {
        put_head(out, web, web->gamma_deg.n, web->c_deg.n);
        put_numbers(out, web->gamma_deg.f32, web->gamma_deg.n);
        put_numbers(out, web->c_deg.f32, web->c_deg.n);
        for (size_t i = 0; i < web->c_deg.n; i++)
            put_numbers(out, web->candela.f32 + i * web->gamma_deg.n, web->gamma_deg.n);
    } else if (ok) {
        ok = put_sampled(out, web);
    }
    if (out && fclose(out))
        ok = false;
    if (ok)
        return text;
    free(text);
    return NULL;
}
