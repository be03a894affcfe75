#define _GNU_SOURCE /* open_memstream */
#include "server/report/page.h"

#include <stdlib.h>

#include "server/base/write_file.h"

enum lum_status lum_page_begin(struct lum_page *ret_page, struct lum_error *err)
{
    *ret_page = (struct lum_page){0};
    ret_page->f = open_memstream(&ret_page->text, &ret_page->n);
    return ret_page->f ? LUM_OK : lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a page");
}

enum lum_status lum_page_end(struct lum_page *p, enum lum_status status, char **ret_text, size_t *ret_n,
                             struct lum_error *err)
{
    bool whole = !ferror(p->f);
    if ((fclose(p->f) != 0 || !whole) && !status)
        status = lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a page");
    if (status) {
        free(p->text);
        return status;
    }
    *ret_text = p->text;
    *ret_n = p->n;
    return LUM_OK;
}

enum lum_status lum_page_end_file(struct lum_page *p, const char *path, enum lum_status status, struct lum_error *err)
{
    char *text;
    size_t n;
    status = lum_page_end(p, status, &text, &n, err);
    if (status)
        return status;
    status = lum_write_file(path, text, n, err);
    free(text);
    return status;
}

void lum_page_text(FILE *f, const char *text)
{
    for (; *text; text++)
        switch (*text) {
        case '&':
            fputs("&amp;", f);
            break;
        case '<':
            fputs("&lt;", f);
            break;
        case '>':
            fputs("&gt;", f);
            break;
        case '"':
            fputs("&quot;", f);
            break;
        default:
            fputc(*text, f);
        }
}

static void put_base64(FILE *f, const uint8_t *bytes, size_t n)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < n; i += 3) {
        uint32_t v = (uint32_t)bytes[i] << 16 | (i + 1 < n ? (uint32_t)bytes[i + 1] << 8 : 0) |
                     (i + 2 < n ? (uint32_t)bytes[i + 2] : 0);
        const char four[4] = {digits[v >> 18], digits[v >> 12 & 63], i + 1 < n ? digits[v >> 6 & 63] : '=',
                              i + 2 < n ? digits[v & 63] : '='};
        fwrite(four, 1, 4, f);
    }
}

enum lum_status lum_page_image(FILE *f, const struct lum_png *png, const char *alt, struct lum_error *err)
{
    uint8_t *bytes;
    size_t n;
    enum lum_status st = lum_png_encode(png, &bytes, &n, err);
    if (st)
        return st;
    fprintf(f, " width=\"%u\" height=\"%u\" alt=\"", png->w, png->h);
    lum_page_text(f, alt);
    fputs("\" src=\"data:image/png;base64,", f);
    put_base64(f, bytes, n);
    fputs("\"", f);
    free(bytes);
    return LUM_OK;
}
