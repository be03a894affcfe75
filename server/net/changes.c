#include "server/net/changes.h"

static void drop_oldest(struct lum_changes_kept *c)
{
    c->n_bytes -= c->ring[c->first].text->n_bytes;
    lum_text_unref(c->ring[c->first].text);
    c->before = c->ring[c->first].scene_rev;
    c->first = (c->first + 1) % LUM_LIMIT_CHANGES_KEPT;
    c->n--;
}

void lum_changes_kept_add(struct lum_changes_kept *c, uint64_t scene_rev, struct lum_text *text)
{
    if (!text || text->n_bytes > LUM_LIMIT_CHANGES_KEPT_BYTES) { /* from here on they are known again */
        lum_changes_kept_drop(c);
        c->before = scene_rev;
        return;
    }
    while (c->n == LUM_LIMIT_CHANGES_KEPT || (c->n > 0 && c->n_bytes + text->n_bytes > LUM_LIMIT_CHANGES_KEPT_BYTES))
        drop_oldest(c);
    uint32_t at = (c->first + c->n) % LUM_LIMIT_CHANGES_KEPT;
    c->ring[at].scene_rev = scene_rev;
    c->ring[at].text = text;
    text->refs++;
    c->n_bytes += text->n_bytes;
    c->n++;
}

int lum_changes_kept_missed(const struct lum_changes_kept *c, uint64_t scene_rev)
{
    uint64_t newest = c->n ? c->ring[(c->first + c->n - 1) % LUM_LIMIT_CHANGES_KEPT].scene_rev : c->before;
    int n = 0;
    if (scene_rev < c->before || scene_rev > newest)
        return -1;
    while ((uint32_t)n < c->n &&
           c->ring[(c->first + c->n - 1 - (uint32_t)n) % LUM_LIMIT_CHANGES_KEPT].scene_rev > scene_rev)
        n++;
    return n;
}

struct lum_text *lum_changes_kept_last(const struct lum_changes_kept *c, uint32_t n, uint32_t i)
{
    return c->ring[(c->first + c->n - n + i) % LUM_LIMIT_CHANGES_KEPT].text;
}

void lum_changes_kept_drop(struct lum_changes_kept *c)
{
    while (c->n > 0)
        drop_oldest(c);
}
