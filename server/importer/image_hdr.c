/* Radiance pictures (.hdr, .pic): RGBE with flat, old and new run-length scanlines, all eight orientations.
 *
 * Greg Ward, "Real Pixels", Graphics Gems II, 1991; format as Radiance's ray/doc/filefmts describes it. EXPOSURE lines
 * divide, since pixels are to be read as absolute values. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/importer/image.h"

/* Widths whose rows may be run-length encoded by channel, as Radiance writes them: the length takes 15 bits. */
#define RLE_MIN 8u
#define RLE_MAX 0x7fffu

struct reader {
    const uint8_t *p, *end;
};

struct header {
    double exposure;       /* product of the EXPOSURE lines */
    uint32_t n_lines, len; /* scanlines in file order, and pixels in each */
    bool y_major, flip_x, flip_y;
};

/* One header line without its newline; false at the end of the file or when it is unreasonably long. */
static bool read_line(struct reader *r, char *ret_line, size_t cap)
{
    size_t n = 0;
    while (r->p < r->end && *r->p != '\n' && n + 1 < cap)
        ret_line[n++] = (char)*r->p++;
    ret_line[n] = 0;
    if (r->p == r->end || *r->p != '\n')
        return false;
    r->p++;
    return true;
}

/* "-Y 512 +X 1024": the first axis is that of the scanlines; -Y means top first, +X left first. */
static bool parse_resolution(const char *line, struct header *h)
{
    char sign[2], axis[2];
    unsigned long long n[2];
    if (sscanf(line, "%c%c %8llu %c%c %8llu", &sign[0], &axis[0], &n[0], &sign[1], &axis[1], &n[1]) != 6)
        return false;
    for (int i = 0; i < 2; i++)
        if ((sign[i] != '+' && sign[i] != '-') || (axis[i] != 'X' && axis[i] != 'Y') || n[i] == 0 || n[i] > UINT32_MAX)
            return false;
    if (axis[0] == axis[1])
        return false;
    h->n_lines = (uint32_t)n[0];
    h->len = (uint32_t)n[1];
    h->y_major = axis[0] == 'Y';
    h->flip_y = sign[h->y_major ? 0 : 1] == '+';
    h->flip_x = sign[h->y_major ? 1 : 0] == '-';
    return true;
}

static enum lum_status parse_header(struct reader *r, struct header *h, struct lum_error *err)
{
    char line[512];
    bool rgbe = true;
    h->exposure = 1.0;
    while (read_line(r, line, sizeof line) && line[0]) {
        if (strncmp(line, "FORMAT=", 7) == 0)
            rgbe = strncmp(line + 7, "32-bit_rle_rgbe", 15) == 0;
        else if (strncmp(line, "EXPOSURE=", 9) == 0)
            h->exposure *= strtod(line + 9, NULL);
    }
    if (!rgbe)
        return lum_fail(err, LUM_ERR_UNSUPPORTED, "", "HDR: only FORMAT=32-bit_rle_rgbe is supported");
    if (!isfinite(h->exposure) || h->exposure <= 0.0)
        return lum_fail(err, LUM_ERR_INVALID, "", "HDR: EXPOSURE must be above 0");
    if (!read_line(r, line, sizeof line) || !parse_resolution(line, h))
        return lum_fail(err, LUM_ERR_INVALID, "", "HDR: no resolution line");
    return LUM_OK;
}

/* New format: each of the four components run-length coded by itself. */
static bool read_components(struct reader *r, uint8_t *scan, uint32_t len)
{
    for (uint32_t c = 0; c < 4; c++)
        for (uint32_t x = 0; x < len;) {
            if (r->p == r->end)
                return false;
            uint32_t code = *r->p++;
            bool run = code > 128;
            uint32_t n = run ? code - 128 : code;
            if (n == 0 || n > len - x || (size_t)(r->end - r->p) < (run ? 1 : n))
                return false;
            for (uint32_t i = 0; i < n; i++)
                scan[4 * (x + i) + c] = run ? *r->p : r->p[i];
            r->p += run ? 1 : n;
            x += n;
        }
    return true;
}

/* Flat pixels, where (1,1,1,n) repeats the one before n << shift times (old run-length coding). */
static bool read_pixels(struct reader *r, uint8_t *scan, uint32_t len)
{
    unsigned shift = 0;
    for (uint32_t x = 0; x < len;) {
        if (r->end - r->p < 4)
            return false;
        const uint8_t *px = r->p;
        r->p += 4;
        if (px[0] != 1 || px[1] != 1 || px[2] != 1) {
            memcpy(scan + 4 * (size_t)x++, px, 4);
            shift = 0;
            continue;
        }
        if (x == 0 || shift > 24)
            return false;
        uint64_t n = (uint64_t)px[3] << shift;
        if (n > len - x)
            return false;
        for (uint64_t i = 0; i < n; i++, x++)
            memcpy(scan + 4 * (size_t)x, scan + 4 * (size_t)(x - 1), 4);
        shift += 8;
    }
    return true;
}

static bool read_scanline(struct reader *r, uint8_t *scan, uint32_t len)
{
    if (len >= RLE_MIN && len <= RLE_MAX && r->end - r->p >= 4 && r->p[0] == 2 && r->p[1] == 2 && r->p[2] < 128) {
        if ((uint32_t)(r->p[2] << 8 | r->p[3]) != len)
            return false;
        r->p += 4;
        return read_components(r, scan, len);
    }
    return read_pixels(r, scan, len);
}

static void convert_scanline(const struct header *h, const uint8_t *scan, uint32_t line, struct lum_texels *t)
{
    for (uint32_t i = 0; i < h->len; i++) {
        const uint8_t *rgbe = scan + 4 * (size_t)i;
        uint32_t x = h->y_major ? i : line, y = h->y_major ? line : i;
        if (h->flip_x)
            x = t->width - 1 - x;
        if (h->flip_y)
            y = t->height - 1 - y;
        float *px = (float *)t->pixels + 3 * ((size_t)y * t->width + x);
        /* (m + 1/2) 2^(e - 136), exponent 0 is black (color.c of Radiance) */
        double scale = rgbe[3] ? ldexp(1.0, rgbe[3] - 136) / h->exposure : 0.0;
        for (int c = 0; c < 3; c++)
            px[c] = (float)fmin((rgbe[c] + 0.5) * scale, 3.0e38);
    }
}

enum lum_status lum_hdr_decode(const struct lum_bytes *file, struct lum_texels *ret_texels, struct lum_error *err)
{
    struct reader r = {file->data, file->data + file->n};
    struct header h = {0};
    enum lum_status status = parse_header(&r, &h, err);
    if (status)
        return status;
    /* The shortest coding of a scanline is 4 + 4 * 2 bytes per 127 pixels; the old one repeats 2^24 pixels in 4 bytes,
     * so what is left of the file bounds the lines only. */
    if ((uint64_t)h.n_lines * 4 > file->n)
        return lum_fail(err, LUM_ERR_INVALID, "", "HDR: the file is too short for its size");
    struct lum_texels texels = {0};
    status = lum_texels_alloc(h.y_major ? h.len : h.n_lines, h.y_major ? h.n_lines : h.len, true, &texels, err);
    if (status)
        return status;
    uint8_t *scan = lum_calloc(h.len, 4);
    if (!scan)
        status = lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for an HDR image");
    for (uint32_t line = 0; !status && line < h.n_lines; line++) {
        if (read_scanline(&r, scan, h.len))
            convert_scanline(&h, scan, line, &texels);
        else
            status =
                lum_fail(err, LUM_ERR_INVALID, "", "HDR: scanline %u of %u is damaged or missing", line, h.n_lines);
    }
    lum_free(scan);
    if (status)
        lum_free(texels.pixels);
    else
        *ret_texels = texels;
    return status;
}
