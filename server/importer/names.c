#include "server/importer/names.h"

#include <stdio.h>
#include <string.h>

/* An open-addressed hash table of the ids given out; n_slots is a power of two, at most half full. */
struct lum_name_slot {
    lum_id id;            /* "": free */
    uint32_t next_suffix; /* the number to try first when this id is asked for again: 100 000 equal names stay linear */
};

#define SUFFIX_BYTES 11u /* "-" and ten digits */

void lum_names_init(struct lum_names *names, const char *import_id)
{
    memset(names, 0, sizeof *names);
    snprintf(names->prefix, sizeof names->prefix, "%.*s/", (int)LUM_LIMIT_ID_BYTES - 1, import_id);
}

void lum_names_finish(struct lum_names *names)
{
    lum_free(names->slots);
    memset(names, 0, sizeof *names);
}

static uint32_t hash_text(const char *s)
{
    uint32_t h = 2166136261u; /* FNV-1a */
    for (; *s; s++)
        h = (h ^ (unsigned char)*s) * 16777619u;
    return h;
}

static struct lum_name_slot *find_slot(struct lum_name_slot *slots, uint32_t n_slots, const char *id)
{
    uint32_t i = hash_text(id) & (n_slots - 1);
    while (slots[i].id[0] && strcmp(slots[i].id, id) != 0)
        i = (i + 1) & (n_slots - 1);
    return &slots[i];
}

static bool grow(struct lum_names *names)
{
    uint32_t n_slots = names->n_slots ? names->n_slots * 2 : 256;
    struct lum_name_slot *slots = lum_calloc(n_slots, sizeof *slots);
    if (!slots)
        return false;
    for (uint32_t i = 0; i < names->n_slots; i++)
        if (names->slots[i].id[0])
            *find_slot(slots, n_slots, names->slots[i].id) = names->slots[i];
    lum_free(names->slots);
    names->slots = slots;
    names->n_slots = n_slots;
    return true;
}

static bool id_char(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' ||
           c == ':' || c == '-';
}

static void base_id(const struct lum_names *names, const struct lum_name_request *r, char *ret_id)
{
    const size_t room = LUM_LIMIT_ID_BYTES - SUFFIX_BYTES;
    size_t n = (size_t)snprintf(ret_id, room + 1, "%s%s", names->prefix, r->group);
    if (n > room)
        n = room;
    size_t start = n;
    bool usable = false;
    for (const char *p = r->name ? r->name : ""; *p && n < room; p++) {
        usable |= id_char(*p);
        ret_id[n++] = id_char(*p) ? *p : '_';
    }
    ret_id[n] = 0;
    if (!usable)
        snprintf(ret_id + start, room + 1 - start, "%s-%u", r->fallback, r->number);
}

enum lum_status lum_names_make(struct lum_names *names, const struct lum_name_request *r, char *ret_id,
                               struct lum_error *err)
{
    if ((names->n_used + 1) * 2 >= names->n_slots && !grow(names))
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for names");
    lum_id id;
    base_id(names, r, id);
    struct lum_name_slot *base = find_slot(names->slots, names->n_slots, id);
    struct lum_name_slot *slot = base;
    size_t n = strlen(id);
    while (slot->id[0]) {
        snprintf(id + n, sizeof id - n, "-%u", base->next_suffix++);
        slot = find_slot(names->slots, names->n_slots, id);
    }
    memcpy(slot->id, id, sizeof id);
    slot->next_suffix = 2;
    names->n_used++;
    memcpy(ret_id, id, strlen(id) + 1);
    return LUM_OK;
}
