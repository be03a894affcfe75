#include "server/world/patches.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- from the document ---- */

static bool is(const char *word, const char *other)
{
    return strcmp(word, other) == 0;
}

struct collecting {
    struct lum_patch *items;
    size_t n, capacity;
    bool failed;
};

static void collect(void *user, const struct lum_record *r)
{
    struct collecting *c = user;
    const struct lum_record_patch *p = &r->patch;
    if (r->type != LUM_RECORD_PATCH || c->failed)
        return;
    if (c->n == c->capacity) {
        size_t capacity = c->capacity ? 2 * c->capacity : 16;
        struct lum_patch *more = lum_calloc(capacity, sizeof *more);
        c->failed = !more;
        if (!more)
            return;
        if (c->n)
            memcpy(more, c->items, c->n * sizeof *more);
        lum_free(c->items);
        c->items = more;
        c->capacity = capacity;
    }
    struct lum_patch *to = &c->items[c->n++];
    *to = (struct lum_patch){
        .key = {is(p->protocol, "artnet") ? LUM_DESK_ARTNET : LUM_DESK_SACN, (uint16_t)p->universe},
        .address = (uint16_t)(p->address - 1.0),
        .channels = is(p->channels, "rgb16")   ? LUM_PATCH_RGB16
                    : is(p->channels, "rgb")   ? LUM_PATCH_RGB
                    : is(p->channels, "dim16") ? LUM_PATCH_DIM16
                                               : LUM_PATCH_DIM,
        .curve = is(p->curve, "square") ? LUM_CURVE_SQUARE
                 : is(p->curve, "dali") ? LUM_CURVE_DALI
                                        : LUM_CURVE_LINEAR,
    };
    memcpy(to->target, p->target, sizeof to->target);
}

static int by_target(const void *a, const void *b)
{
    return strcmp(((const struct lum_patch *)a)->target, ((const struct lum_patch *)b)->target);
}

bool lum_patches_collect(struct lum_patches *patches, const struct lum_document *doc)
{
    struct collecting c = {0};
    if (!lum_document_each(doc, collect, &c) || c.failed) {
        lum_free(c.items);
        return false;
    }
    if (c.n)
        qsort(c.items, c.n, sizeof *c.items, by_target);
    lum_free(patches->items);
    patches->items = c.items;
    patches->n = c.n;
    patches->generation++;
    return true;
}

void lum_patches_finish(struct lum_patches *patches)
{
    lum_free(patches->items);
    *patches = (struct lum_patches){0};
}

/* ---- values ---- */

/* IEC 62386-102: levels 1 to 254 of control gear are 0.1 to 100 % of the light, each 2.8 % more than the one before; 0
 * is off. The whole range of the channels stands for levels 0 to 254. */
static float dali_light(float v)
{
    float level = 254.0f * v;
    return level > 0.0f ? powf(10.0f, 3.0f * (fmaxf(level, 1.0f) - 1.0f) / 253.0f - 3.0f) : 0.0f;
}

static float value_at(const struct lum_patch *p, const uint8_t *slots)
{
    bool fine = p->channels == LUM_PATCH_DIM16 || p->channels == LUM_PATCH_RGB16;
    float v = fine ? (float)(slots[0] * 256 + slots[1]) / 65535.0f : (float)slots[0] / 255.0f;
    switch (p->curve) {
    case LUM_CURVE_SQUARE:
        return v * v;
    case LUM_CURVE_DALI:
        return dali_light(v);
    default:
        return v;
    }
}

uint32_t lum_patch_width(const struct lum_patch *p)
{
    uint32_t n_values = p->channels == LUM_PATCH_RGB || p->channels == LUM_PATCH_RGB16 ? 3 : 1;
    return p->channels == LUM_PATCH_DIM16 || p->channels == LUM_PATCH_RGB16 ? 2 * n_values : n_values;
}

bool lum_patch_read(struct lum_patch *p, const uint8_t *slots, uint32_t n)
{
    uint32_t width = p->channels == LUM_PATCH_DIM16 || p->channels == LUM_PATCH_RGB16 ? 2 : 1;
    uint32_t n_values = p->channels == LUM_PATCH_RGB || p->channels == LUM_PATCH_RGB16 ? 3 : 1;
    struct lum_patch was = *p;
    p->known = n >= p->address + lum_patch_width(p);
    for (uint32_t k = 0; k < 3; k++)
        p->value[k] = p->known ? value_at(p, slots + p->address + (k < n_values ? k * width : 0)) : 0.0f;
    return p->known != was.known || memcmp(p->value, was.value, sizeof was.value) != 0;
}

bool lum_patches_known(const struct lum_patches *patches)
{
    for (size_t i = 0; i < patches->n; i++)
        if (patches->items[i].known)
            return true;
    return false;
}

/* ---- light ---- */

static size_t first_of(const struct lum_patches *patches, const char *target)
{
    size_t lo = 0, hi = patches->n;
    while (lo < hi) {
        size_t middle = lo + (hi - lo) / 2;
        if (strcmp(patches->items[middle].target, target) < 0)
            lo = middle + 1;
        else
            hi = middle;
    }
    return lo;
}

static void multiply(const struct lum_patches *patches, const char *target, struct lum_rgb *inout_factor,
                     bool *inout_color)
{
    for (size_t i = first_of(patches, target); i < patches->n && is(patches->items[i].target, target); i++) {
        const struct lum_patch *p = &patches->items[i];
        if (!p->known)
            continue;
        *inout_factor = lum_rgb_mul(*inout_factor, lum_rgb(p->value[0], p->value[1], p->value[2]));
        *inout_color = *inout_color || p->channels == LUM_PATCH_RGB || p->channels == LUM_PATCH_RGB16;
    }
}

void lum_patches_shine(void *user, struct lum_light *light)
{
    const struct lum_patches *patches = user;
    struct lum_rgb factor = lum_grey(1.0f);
    bool color = false;
    multiply(patches, light->id, &factor, &color);
    if (!is(light->group, light->id))
        multiply(patches, light->group, &factor, &color);
    struct lum_rgb full = color ? lum_grey(lum_luminance(light->power)) : light->power;
    light->power = lum_rgb_mul(full, factor);
}
