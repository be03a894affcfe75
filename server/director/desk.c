/* The light of a desk: the newest values of its channels, taken whenever the director comes by. No edit, no undo, no
 * journal; what came in between is never shown. */
#include "server/director/internal.h"

#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "server/base/log.h"

/* On the desk's thread. A pass that nobody waits for is cancelled, as by an edit. */
void lum_director_desk_changed(void *director)
{
    struct lum_director *d = director;
    pthread_mutex_lock(&d->lock);
    d->rung = true;
    if (d->rendering && lum_clock_ns() >= d->shielded_until_ns)
        atomic_store_explicit(&d->cancel, true, memory_order_relaxed);
    pthread_cond_signal(&d->bell);
    pthread_mutex_unlock(&d->lock);
}

/* A chase on channels that control nothing is no reason to look, nor to end a pass. */
static void leave_unpatched(const struct lum_patches *patches, const struct lum_desk_key *keys,
                            uint8_t (*ret_unwanted)[LUM_DESK_SLOTS], size_t n)
{
    memset(ret_unwanted, 1, n * sizeof *ret_unwanted);
    for (size_t i = 0; i < patches->n; i++) {
        const struct lum_patch *p = &patches->items[i];
        const struct lum_desk_key *at = bsearch(&p->key, keys, n, sizeof *keys, lum_desk_key_order);
        memset(ret_unwanted[at - keys] + p->address, 0, lum_patch_width(p));
    }
}

/* The universes that patches name. */
static bool watch(struct lum_director *d)
{
    const struct lum_patches *patches = &d->world.patches;
    struct lum_desk_key *keys = lum_calloc(patches->n, sizeof *keys);
    uint8_t(*unwanted)[LUM_DESK_SLOTS] = NULL;
    size_t n = 0;
    for (size_t i = 0; keys && i < patches->n; i++)
        keys[i] = patches->items[i].key;
    if (keys && patches->n > 0)
        qsort(keys, patches->n, sizeof *keys, lum_desk_key_order);
    for (size_t i = 0; keys && i < patches->n; i++)
        if (i == 0 || lum_desk_key_order(&keys[i - 1], &keys[i]) != 0)
            keys[n++] = keys[i];
    unwanted = keys ? lum_calloc(n, sizeof *unwanted) : NULL;
    if (unwanted)
        leave_unpatched(patches, keys, unwanted, n);
    bool ok = unwanted && lum_desk_watch(d->config.desk, keys, (const uint8_t(*)[LUM_DESK_SLOTS])unwanted, n);
    lum_free(unwanted);
    lum_free(keys);
    return ok;
}

/* True: some value is another. */
static bool read_values(struct lum_director *d)
{
    struct lum_patches *patches = &d->world.patches;
    uint8_t slots[LUM_DESK_SLOTS];
    uint32_t n = 0;
    bool changed = false;
    for (size_t i = 0; i < patches->n; i++) {
        struct lum_patch *p = &patches->items[i];
        int64_t heard_ns = 0;
        if (i == 0 || lum_desk_key_order(&p[-1].key, &p->key) != 0)
            n = lum_desk_read(d->config.desk, p->key, slots, &heard_ns);
        if (heard_ns > d->desk.heard_ns)
            d->desk.heard_ns = heard_ns;
        changed = lum_patch_read(p, slots, n) || changed;
    }
    return changed;
}

bool lum_director_follow_desk(struct lum_director *d)
{
    if (!d->config.desk)
        return false;
    uint64_t changes = lum_desk_changes(d->config.desk);
    bool repatched = d->desk.generation != d->world.patches.generation;
    if (!repatched && changes == d->desk.changes)
        return false;
    if (repatched && !watch(d)) {
        lum_log(&d->config.log, LUM_LOG_WARNING, "director", "no memory for the universes of a desk");
        return false;
    }
    d->desk.generation = d->world.patches.generation;
    d->desk.changes = changes;
    if (!read_values(d))
        return false;
    lum_world_relight(&d->world);
    d->desk.looks++;
    return true;
}

void lum_director_turn_desk(struct lum_director *d)
{
    if (lum_director_follow_desk(d))
        lum_director_refresh_views(d, d->desk.heard_ns);
}

/* ---- what is told of it ---- */

static cJSON *source_json(const struct lum_desk_source *s, int64_t now_ns)
{
    cJSON *o = cJSON_CreateObject();
    lum_json_add_string(o, "name", s->name);
    lum_json_add_number(o, "priority", s->priority);
    lum_json_add_number(o, "rate_hz", lum_desk_source_rate(s, now_ns));
    lum_json_add_number(o, "age_ms", (double)(now_ns - s->heard_ns) * 1e-6);
    lum_json_add_number(o, "packets", (double)s->packets);
    lum_json_add_number(o, "late", (double)s->late);
    lum_json_add_number(o, "lost", (double)s->lost);
    return o;
}

static cJSON *universe_json(const struct lum_universe *u, int64_t now_ns)
{
    cJSON *o = cJSON_CreateObject(), *sources = cJSON_CreateArray();
    lum_json_add_string(o, "protocol", lum_desk_protocol_names[u->protocol]);
    lum_json_add_number(o, "universe", u->number);
    lum_json_add_number(o, "channels", u->n_slots);
    lum_json_add_number(o, "packets", (double)u->packets);
    lum_json_add_number(o, "late", (double)u->late);
    lum_json_add_number(o, "lost", (double)u->lost);
    lum_json_add_number(o, "previews", (double)u->previews);
    lum_json_add_number(o, "turned_away", (double)u->turned_away);
    for (uint32_t i = 0; i < LUM_DESK_SOURCES; i++)
        if (u->sources[i].here)
            lum_json_add(sources, NULL, source_json(&u->sources[i], now_ns));
    lum_json_add(o, "sources", sources);
    return o;
}

static cJSON *universes_json(struct lum_director *d)
{
    int64_t now = lum_clock_ns();
    struct lum_desk_key key = {0};
    struct lum_universe u;
    cJSON *list = cJSON_CreateArray();
    for (bool first = true; lum_desk_next(d->config.desk, first ? NULL : &key, &u); first = false) {
        key = (struct lum_desk_key){u.protocol, u.number};
        lum_json_add(list, NULL, universe_json(&u, now));
    }
    return list;
}

static cJSON *ear_json(const struct lum_desk_counts *c)
{
    if (c->port == 0)
        return cJSON_CreateNull();
    cJSON *o = cJSON_CreateObject();
    lum_json_add_number(o, "port", c->port);
    lum_json_add_number(o, "packets", (double)c->packets);
    lum_json_add_number(o, "bad", (double)c->bad);
    lum_json_add_number(o, "other", (double)c->other);
    lum_json_add_number(o, "unpatched", (double)c->unwatched);
    lum_json_add_number(o, "dropped", (double)c->dropped);
    return o;
}

struct cJSON *lum_director_desk_json(struct lum_director *d)
{
    if (!d->config.desk)
        return cJSON_CreateNull();
    cJSON *o = cJSON_CreateObject();
    size_t n_known = 0;
    for (int p = 0; p < LUM_DESK_PROTOCOL_COUNT; p++) {
        struct lum_desk_counts counts = lum_desk_counts(d->config.desk, (enum lum_desk_protocol)p);
        lum_json_add(o, lum_desk_protocol_names[p], ear_json(&counts));
    }
    for (size_t i = 0; i < d->world.patches.n; i++)
        n_known += d->world.patches.items[i].known;
    lum_json_add_number(o, "patches", (double)d->world.patches.n);
    lum_json_add_number(o, "patches_heard", (double)n_known);
    lum_json_add_number(o, "looks", (double)d->desk.looks);
    lum_json_add(o, "universes", universes_json(d));
    return o;
}
