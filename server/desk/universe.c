#include "server/desk/universe.h"

#include <string.h>

#define RATE_NS 1000000000ll /* over which packets are counted: desks send up to 44 a second, and few at rest */

static uint32_t most_sources(const struct lum_universe *u)
{
    return u->protocol == LUM_DESK_ARTNET ? 2u : LUM_DESK_SOURCES;
}

static int64_t silence_ns(const struct lum_universe *u)
{
    return u->protocol == LUM_DESK_ARTNET ? LUM_ARTNET_SILENCE_NS : LUM_SACN_SILENCE_NS;
}

uint32_t lum_universe_sources(const struct lum_universe *u)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < LUM_DESK_SOURCES; i++)
        n += u->sources[i].here;
    return n;
}

/* ---- what counts ---- */

static int highest_priority(const struct lum_universe *u)
{
    int highest = -1;
    for (uint32_t i = 0; i < LUM_DESK_SOURCES; i++)
        if (u->sources[i].here && u->sources[i].priority > highest)
            highest = u->sources[i].priority;
    return highest;
}

static bool differs(const struct lum_universe *u, const uint8_t *slots, uint16_t n_slots)
{
    for (uint16_t k = 0; k < n_slots; k++)
        if (!u->unwanted[k] && u->slots[k] != slots[k])
            return true;
    return n_slots > u->n_slots;
}

/* Slots that none of those who count sends stay as they are. */
static bool merge(struct lum_universe *u)
{
    uint8_t slots[LUM_DESK_SLOTS] = {0};
    uint16_t n_slots = 0;
    int priority = highest_priority(u);
    for (uint32_t i = 0; i < LUM_DESK_SOURCES; i++) {
        const struct lum_desk_source *s = &u->sources[i];
        if (!s->here || s->priority != priority)
            continue;
        for (uint16_t k = 0; k < s->n_slots; k++)
            slots[k] = s->slots[k] > slots[k] ? s->slots[k] : slots[k];
        n_slots = s->n_slots > n_slots ? s->n_slots : n_slots;
    }
    bool changed = differs(u, slots, n_slots);
    memcpy(u->slots, slots, n_slots);
    u->n_slots = n_slots > u->n_slots ? n_slots : u->n_slots;
    return changed;
}

/* ---- sources ---- */

static struct lum_desk_source *find(struct lum_universe *u, const uint8_t id[16])
{
    for (uint32_t i = 0; i < LUM_DESK_SOURCES; i++)
        if (u->sources[i].here && memcmp(u->sources[i].id, id, sizeof u->sources[i].id) == 0)
            return &u->sources[i];
    return NULL;
}

/* A free place, or that of the least priority, if the newcomer's is higher. NULL: no room. */
static struct lum_desk_source *make_room(struct lum_universe *u, const struct lum_desk_packet *p)
{
    struct lum_desk_source *least = &u->sources[0];
    for (uint32_t i = 0; i < most_sources(u); i++) {
        if (!u->sources[i].here)
            return &u->sources[i];
        if (u->sources[i].priority < least->priority)
            least = &u->sources[i];
    }
    return p->priority > least->priority ? least : NULL;
}

/* As E1.31 6.7.2: a number behind the last one by less than 20 is old; one further behind is that of a restart. */
static bool is_late(const struct lum_desk_source *s, const struct lum_desk_packet *p)
{
    int8_t ahead = (int8_t)(uint8_t)(p->sequence - s->sequence);
    return s->sequenced && p->sequenced && ahead <= 0 && ahead > -20;
}

static uint32_t count_lost(const struct lum_desk_source *s, const struct lum_desk_packet *p)
{
    uint8_t ahead = (uint8_t)(p->sequence - s->sequence);
    if (p->protocol == LUM_DESK_ARTNET && p->sequence < s->sequence)
        ahead--; /* it counts from 255 to 1 */
    return s->sequenced && p->sequenced && ahead < 128 ? ahead - 1u : 0u;
}

static void count_rate(struct lum_desk_source *s, int64_t now_ns)
{
    int64_t since = now_ns - s->rate_from_ns;
    if (since >= RATE_NS) {
        s->rate_hz = (double)s->rate_packets * 1e9 / (double)since;
        s->rate_from_ns = now_ns;
        s->rate_packets = 0;
    }
    s->rate_packets++;
}

double lum_desk_source_rate(const struct lum_desk_source *s, int64_t now_ns)
{
    return now_ns - s->heard_ns >= 2 * RATE_NS ? 0.0 : s->rate_hz;
}

static void begin(struct lum_desk_source *s, const struct lum_desk_packet *p, int64_t now_ns)
{
    *s = (struct lum_desk_source){.here = true, .rate_from_ns = now_ns};
    memcpy(s->id, p->source, sizeof s->id);
}

bool lum_universe_take(struct lum_universe *u, const struct lum_desk_packet *p, int64_t now_ns)
{
    bool changed = lum_universe_expire(u, now_ns);
    if (p->preview) {
        u->previews++;
        return changed;
    }
    struct lum_desk_source *s = find(u, p->source);
    if (s && is_late(s, p)) {
        s->late++;
        u->late++;
        return changed;
    }
    if (p->terminated) {
        if (s)
            s->here = false;
        return (s && merge(u)) || changed;
    }
    if (!s && !(s = make_room(u, p))) {
        u->turned_away++;
        return changed;
    }
    if (!s->here || memcmp(s->id, p->source, sizeof s->id) != 0)
        begin(s, p, now_ns);
    uint32_t lost = count_lost(s, p);
    s->lost += lost;
    u->lost += lost;
    s->packets++;
    u->packets++;
    count_rate(s, now_ns);
    memcpy(s->name, p->name, sizeof s->name);
    s->priority = p->priority;
    s->sequence = p->sequence;
    s->sequenced = p->sequenced;
    s->n_slots = p->n_slots;
    if (p->n_slots)
        memcpy(s->slots, p->slots, p->n_slots);
    s->heard_ns = u->heard_ns = now_ns;
    return merge(u) || changed;
}

bool lum_universe_expire(struct lum_universe *u, int64_t now_ns)
{
    bool lost = false;
    for (uint32_t i = 0; i < LUM_DESK_SOURCES; i++) {
        struct lum_desk_source *s = &u->sources[i];
        if (!s->here || now_ns - s->heard_ns < silence_ns(u))
            continue;
        s->here = false;
        lost = true;
    }
    return lost && merge(u);
}
