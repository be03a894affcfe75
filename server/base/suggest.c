#include "server/base/suggest.h"

#include <stdio.h>
#include <string.h>

#include "core/method/method.h"
#include "protocol/base/limits.h"
#include "protocol/base/nearest.h"
#include "server/base/embed.h"

#define MOST 64u /* methods, or scenes and replays; the tables are ours */

void lum_suggest_method(const char *name, char ret_text[LUM_SUGGEST_BYTES])
{
    const char *names[MOST];
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t i = 0; i < n && i < MOST; i++)
        names[i] = methods[i].name;
    lum_nearest_among(name, names, n < MOST ? n : MOST, ret_text, LUM_SUGGEST_BYTES);
}

void lum_suggest_effect(const char *name, char ret_text[LUM_SUGGEST_BYTES])
{
    lum_nearest_among(name, lum_effect_names, LUM_EFFECT_COUNT, ret_text, LUM_SUGGEST_BYTES);
}

void lum_suggest_scene(const char *name, char ret_text[LUM_SUGGEST_BYTES])
{
    static const struct lum_embedded *const tables[] = {lum_embedded_scenes, lum_embedded_replays};
    char names[MOST][LUM_LIMIT_ID_BYTES]; /* without their .jsonl */
    struct lum_nearest near = {.given = name};
    for (size_t t = 0, n = 0; t < LUM_ARRAY_LEN(tables); t++)
        for (const struct lum_embedded *e = tables[t]; e->key && n < MOST; e++, n++) {
            snprintf(names[n], sizeof names[n], "%.*s", (int)strcspn(e->key, "."), e->key);
            lum_nearest_offer(&near, names[n]);
        }
    lum_nearest_text(&near, ret_text, LUM_SUGGEST_BYTES);
    if (near.n == 0)
        snprintf(ret_text, LUM_SUGGEST_BYTES, " (see: lumend scenes)");
}
