#include "server/world/fade.h"

#include <stdlib.h>
#include <string.h>

static int by_name(const void *a, const void *b)
{
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

static int by_id(const void *a, const void *b)
{
    return strcmp(((const struct lum_fading *)a)->id, ((const struct lum_fading *)b)->id);
}

static int id_of(const void *id, const void *item)
{
    return strcmp(id, ((const struct lum_fading *)item)->id);
}

static const struct lum_fading *find(const struct lum_fading *items, size_t n, const char *id)
{
    return n ? bsearch(id, items, n, sizeof *items, id_of) : NULL;
}

static struct lum_rgb shining(const struct lum_light *l)
{
    return l->on ? l->power : lum_grey(0.0f);
}

static bool same(struct lum_rgb a, struct lum_rgb b)
{
    return a.r == b.r && a.g == b.g && a.b == b.b;
}

const struct lum_fading *lum_fade_of(const struct lum_fade *fade, const char *id)
{
    return find(fade->items, fade->n, id);
}

void lum_fade_shine(const struct lum_fade *fade, struct lum_light *light)
{
    const struct lum_fading *f = find(fade->items, fade->n, light->id);
    if (!f)
        return;
    double done = (double)(fade->now_ns - f->start_ns) / (double)(f->end_ns - f->start_ns);
    float t = (float)(done < 0.0 ? 0.0 : done > 1.0 ? 1.0 : done);
    light->power = lum_rgb_add(lum_rgb_scale(f->from, 1.0f - t), lum_rgb_scale(f->to, t));
    light->on = !same(light->power, lum_grey(0.0f));
}

struct lum_fading *lum_fade_shown(const struct lum_fade *fade, const struct lum_light_table *table)
{
    struct lum_fading *all = lum_calloc(table->n_lights ? table->n_lights : 1, sizeof *all);
    for (uint32_t i = 0; all && i < table->n_lights; i++) {
        struct lum_light l = table->lights[i];
        lum_fade_shine(fade, &l);
        memcpy(all[i].id, l.id, sizeof all[i].id);
        all[i].from = shining(&l);
    }
    if (all && table->n_lights)
        qsort(all, table->n_lights, sizeof *all, by_id);
    return all;
}

void lum_fade_begin(struct lum_fade *fade, const struct lum_fading *shown, size_t n_shown,
                    const struct lum_light_table *now, const char **ids, size_t n_ids, int64_t start_ns,
                    int64_t duration_ns)
{
    struct lum_fading *items = lum_calloc(fade->n + now->n_lights + 1, sizeof *items);
    size_t n = 0;
    if (n_ids)
        qsort(ids, n_ids, sizeof *ids, by_name);
    for (size_t i = 0; items && i < fade->n; i++) {
        const char *id = fade->items[i].id;
        if (!n_ids || !bsearch(&id, ids, n_ids, sizeof *ids, by_name))
            items[n++] = fade->items[i];
    }
    for (uint32_t i = 0; items && duration_ns > 0 && i < now->n_lights; i++) {
        const char *id = now->lights[i].id;
        const struct lum_fading *f = find(shown, n_shown, id);
        struct lum_rgb to = shining(&now->lights[i]);
        if (!f || same(f->from, to) || !n_ids || !bsearch(&id, ids, n_ids, sizeof *ids, by_name))
            continue;
        items[n] = (struct lum_fading){.from = f->from, .to = to, .start_ns = start_ns};
        items[n].end_ns = start_ns + duration_ns;
        memcpy(items[n++].id, f->id, sizeof f->id);
    }
    lum_fade_finish(fade);
    fade->items = items;
    fade->n = items ? n : 0;
    fade->now_ns = start_ns;
    if (n)
        qsort(items, n, sizeof *items, by_id);
}

void lum_fade_follow(struct lum_fade *fade, const struct lum_light_table *now)
{
    size_t n = 0;
    for (size_t i = 0; i < fade->n; i++)
        fade->items[i].holds = false;
    for (uint32_t i = 0; fade->n && i < now->n_lights; i++) {
        struct lum_fading *f = bsearch(now->lights[i].id, fade->items, fade->n, sizeof *f, id_of);
        if (f)
            f->holds = same(f->to, shining(&now->lights[i]));
    }
    for (size_t i = 0; i < fade->n; i++)
        if (fade->items[i].holds)
            fade->items[n++] = fade->items[i];
    fade->n = n;
}

void lum_fade_turn(struct lum_fade *fade, int64_t now_ns)
{
    size_t n = 0;
    for (size_t i = 0; i < fade->n; i++)
        if (fade->items[i].end_ns > now_ns)
            fade->items[n++] = fade->items[i];
    fade->n = n;
    fade->now_ns = now_ns;
}

void lum_fade_finish(struct lum_fade *fade)
{
    lum_free(fade->items);
    *fade = (struct lum_fade){0};
}
