#include "server/importer/ids.h"

#include <stdio.h>
#include <string.h>

#include "core/math/sampler.h"

/* An open-addressed hash table of the ids given out; n_slots is a power of two, at most half full. */
struct lum_id_slot {
    lum_id id;            /* "": free */
    uint32_t number;      /* lum_ids_take's */
    uint32_t next_suffix; /* the number to try first when this id is asked for again: 100 000 equal names stay linear */
};

#define SUFFIX_BYTES 11u /* "-" and ten digits */

void lum_ids_init(struct lum_ids *ids, const char *import_id)
{
    memset(ids, 0, sizeof *ids);
    snprintf(ids->prefix, sizeof ids->prefix, "%.*s/", (int)LUM_LIMIT_ID_BYTES - 1, import_id);
}

void lum_ids_finish(struct lum_ids *ids)
{
    lum_free(ids->slots);
    memset(ids, 0, sizeof *ids);
}

static struct lum_id_slot *find_slot(struct lum_id_slot *slots, uint32_t n_slots, const char *id)
{
    uint32_t i = lum_hash_text(id) & (n_slots - 1);
    while (slots[i].id[0] && strcmp(slots[i].id, id) != 0)
        i = (i + 1) & (n_slots - 1);
    return &slots[i];
}

static bool grow(struct lum_ids *ids)
{
    uint32_t n_slots = ids->n_slots ? ids->n_slots * 2 : 256;
    struct lum_id_slot *slots = lum_calloc(n_slots, sizeof *slots);
    if (!slots)
        return false;
    for (uint32_t i = 0; i < ids->n_slots; i++)
        if (ids->slots[i].id[0])
            *find_slot(slots, n_slots, ids->slots[i].id) = ids->slots[i];
    lum_free(ids->slots);
    ids->slots = slots;
    ids->n_slots = n_slots;
    return true;
}

static bool id_char(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' ||
           c == ':' || c == '-';
}

static void base_id(const struct lum_ids *ids, const struct lum_id_request *r, char *ret_id)
{
    const size_t room = LUM_LIMIT_ID_BYTES - SUFFIX_BYTES;
    size_t n = (size_t)snprintf(ret_id, room + 1, "%s%s", ids->prefix, r->group);
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

enum lum_status lum_ids_make(struct lum_ids *ids, const struct lum_id_request *r, char *ret_id, struct lum_error *err)
{
    if ((ids->n_used + 1) * 2 >= ids->n_slots && !grow(ids))
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for names");
    lum_id id;
    base_id(ids, r, id);
    struct lum_id_slot *base = find_slot(ids->slots, ids->n_slots, id);
    struct lum_id_slot *slot = base;
    size_t n = strlen(id);
    while (slot->id[0]) {
        snprintf(id + n, sizeof id - n, "-%u", base->next_suffix++);
        slot = find_slot(ids->slots, ids->n_slots, id);
    }
    memcpy(slot->id, id, sizeof id);
    slot->next_suffix = 2;
    ids->n_used++;
    memcpy(ret_id, id, strlen(id) + 1);
    return LUM_OK;
}

bool lum_ids_again(const struct lum_ids *ids, const char *id, char *ret_id)
{
    size_t n_prefix = strlen(ids->prefix), n = strlen(id);
    bool ok = n > 0;
    for (const char *p = id; *p && ok; p++)
        ok = id_char(*p) || *p == '/';
    if (!ok)
        return false;
    if (n_prefix + n <= LUM_LIMIT_ID_BYTES)
        snprintf(ret_id, LUM_LIMIT_ID_BYTES + 1, "%.*s%.*s", (int)n_prefix, ids->prefix, (int)n, id);
    else
        snprintf(ret_id, LUM_LIMIT_ID_BYTES + 1, "%.*s%.*s-%08x", (int)n_prefix, ids->prefix,
                 (int)(LUM_LIMIT_ID_BYTES - n_prefix - 9), id, lum_hash_text(id));
    return true;
}

bool lum_ids_find(const struct lum_ids *ids, const char *id, uint32_t *ret_number)
{
    const struct lum_id_slot *slot = ids->n_slots ? find_slot(ids->slots, ids->n_slots, id) : NULL;
    if (!slot || !slot->id[0])
        return false;
    if (ret_number)
        *ret_number = slot->number;
    return true;
}

enum lum_status lum_ids_take(struct lum_ids *ids, const char *id, uint32_t number, struct lum_error *err)
{
    if ((ids->n_used + 1) * 2 >= ids->n_slots && !grow(ids))
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for names");
    struct lum_id_slot *slot = find_slot(ids->slots, ids->n_slots, id);
    if (slot->id[0])
        return lum_fail(err, LUM_ERR_CONFLICT, "", "%s is there twice", id);
    memcpy(slot->id, id, strlen(id) + 1);
    slot->number = number;
    slot->next_suffix = 2;
    ids->n_used++;
    return LUM_OK;
}
