#include "server/net/downloads.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/net/auth.h"

static void let_go(struct lum_download *d)
{
    free(d->bytes);
    *d = (struct lum_download){0};
}

void lum_downloads_drop(struct lum_downloads *all, struct lum_session_ref by)
{
    for (size_t i = 0; i < LUM_LIMIT_DOWNLOADS; i++)
        if (all->list[i].bytes && lum_session_same(all->list[i].by, by))
            let_go(&all->list[i]);
}

void lum_downloads_forget(struct lum_downloads *all, int64_t now_ns)
{
    for (size_t i = 0; i < LUM_LIMIT_DOWNLOADS; i++)
        if (all->list[i].bytes && now_ns >= all->list[i].until_ns)
            let_go(&all->list[i]);
}

void lum_downloads_finish(struct lum_downloads *all)
{
    for (size_t i = 0; i < LUM_LIMIT_DOWNLOADS; i++)
        let_go(&all->list[i]);
}

/* NULL: they take all the room. */
static struct lum_download *place_for(struct lum_downloads *all, size_t n)
{
    struct lum_download *free_one = NULL;
    uint64_t kept = n;
    for (size_t i = 0; i < LUM_LIMIT_DOWNLOADS; i++) {
        kept += all->list[i].n;
        if (!all->list[i].bytes)
            free_one = &all->list[i];
    }
    return kept <= LUM_LIMIT_EXPORT_BYTES ? free_one : NULL;
}

bool lum_downloads_keep(struct lum_downloads *all, struct lum_session_ref by, uint8_t *bytes, size_t n,
                        char ret_ticket[LUM_DOWNLOAD_TICKET_BYTES + 1], struct lum_proto_error *err)
{
    struct lum_auth random; /* a ticket is as hard to guess as a token */
    int64_t now_ns = lum_clock_ns();
    lum_downloads_drop(all, by);
    lum_downloads_forget(all, now_ns);
    struct lum_download *d = place_for(all, n);
    if (!d) {
        free(bytes);
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "busy", "",
                              "files that others have not fetched yet take all the room; try again in a minute");
    }
    if (lum_auth_random(&random, NULL)) {
        free(bytes);
        return lum_proto_fail(err, LUM_PROTO_INTERNAL, "internal", "", "no random numbers for a ticket");
    }
    *d = (struct lum_download){.by = by, .bytes = bytes, .n = n};
    d->until_ns = now_ns + LUM_LIMIT_DOWNLOAD_BEGIN_S * 1000000000ll;
    snprintf(d->ticket, sizeof d->ticket, "%.*s", LUM_DOWNLOAD_TICKET_BYTES, random.token);
    memcpy(ret_ticket, d->ticket, sizeof d->ticket);
    return true;
}

/* In the same time, whatever it is. */
static bool is_ticket(const struct lum_download *d, const char *given)
{
    unsigned char differs = 0;
    if (!d->bytes || strlen(given) != LUM_DOWNLOAD_TICKET_BYTES)
        return false;
    for (size_t i = 0; i < LUM_DOWNLOAD_TICKET_BYTES; i++)
        differs = (unsigned char)(differs | (d->ticket[i] ^ given[i]));
    return differs == 0;
}

uint8_t *lum_downloads_take(struct lum_downloads *all, const char *ticket, size_t *ret_n)
{
    lum_downloads_forget(all, lum_clock_ns());
    for (size_t i = 0; i < LUM_LIMIT_DOWNLOADS; i++) {
        struct lum_download *d = &all->list[i];
        if (!is_ticket(d, ticket))
            continue;
        uint8_t *bytes = d->bytes;
        *ret_n = d->n;
        *d = (struct lum_download){0};
        return bytes;
    }
    return NULL;
}
