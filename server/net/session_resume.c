/* Sessions that go on after their connection broke: who may take one up, and what was changed meanwhile. */
#include <ctype.h>
#include <stdio.h>
#include <string.h>

#include "server/base/log.h"
#include "server/net/session_internal.h"

/* ---- keys and names ---- */

void lum_session_make_key(struct lum_session *s)
{
    struct lum_auth random; /* a key is as hard to guess as a token */
    s->key[0] = '\0';
    if (!lum_auth_random(&random, NULL))
        snprintf(s->key, sizeof s->key, "%.*s", LUM_RESUME_KEY_BYTES, random.token);
}

/* Takes the same time for every wrong key. */
static bool key_opens(const char *key, const char *given)
{
    volatile unsigned char differs = 0; /* volatile: no early exit by the optimiser */
    if (key[0] == '\0' || strlen(given) != strlen(key))
        return false;
    for (size_t i = 0; key[i]; i++)
        differs = (unsigned char)(differs | (key[i] ^ given[i]));
    return differs == 0;
}

static bool same_person(const struct lum_person *a, const struct lum_person *b)
{
    return strcmp(a->name, b->name) == 0;
}

/* "ann.3-1", "ann.3-1.2", "ann.3-1_" are ann's (user_name.h). */
static bool is_name_of(const char *user, const char *person)
{
    size_t n = strlen(person);
    if (strncmp(user, person, n) != 0 || user[n] != '.')
        return false;
    const char *rest = user + n + 1;
    size_t slot = strspn(rest, "0123456789");
    return slot > 0 && rest[slot] == '-' && isdigit((unsigned char)rest[slot + 1]) &&
           rest[slot + 1 + strspn(rest + slot + 1, "0123456789._")] == '\0';
}

bool lum_session_may_be(const struct lum_session *s, const char *name)
{
    const struct lum_people *people = s->table->config.auth->people;
    if (s->person.name[0])
        return is_name_of(name, s->person.name);
    for (size_t i = 0; people && i < people->n; i++)
        if (is_name_of(name, people->list[i].name) || strcmp(name, people->list[i].name) == 0)
            return false;
    return true;
}

/* ---- those who were cut off ---- */

static struct lum_parked *find_parked(struct lum_sessions *t, const char *user)
{
    for (uint32_t i = 0; i < LUM_LIMIT_PARKED; i++)
        if (t->parked[i].user[0] && strcmp(t->parked[i].user, user) == 0)
            return &t->parked[i];
    return NULL;
}

bool lum_sessions_have_parked(const struct lum_sessions *t, const char *user)
{
    return find_parked((struct lum_sessions *)t, user) != NULL;
}

/* False: the director could not be told, and the place is kept. */
static bool forget(struct lum_sessions *t, struct lum_parked *p)
{
    struct lum_request *q = lum_request_create(&lum_request_user_gone);
    if (!q)
        return false;
    strcpy(q->user, p->user);
    if (!lum_director_post(t->config.director, q)) {
        lum_request_destroy(q);
        return false;
    }
    lum_log(&t->config.log, LUM_LOG_DEBUG, "session", "%s did not come back", p->user);
    memset(p, 0, sizeof *p);
    return true;
}

void lum_sessions_forget_parked(struct lum_sessions *t, int64_t now_ns)
{
    for (uint32_t i = 0; i < LUM_LIMIT_PARKED; i++)
        if (t->parked[i].user[0] && now_ns >= t->parked[i].until_ns)
            (void)forget(t, &t->parked[i]);
}

static struct lum_parked *older(struct lum_parked *a, struct lum_parked *b)
{
    return !a || b->until_ns < a->until_ns ? b : a;
}

/* A free place, or that of who was cut off longest: of this person if there is one, so that nobody who breaks off again
 * and again takes the places of others. */
static struct lum_parked *make_place(struct lum_sessions *t, const struct lum_person *person)
{
    struct lum_parked *oldest = NULL, *own = NULL;
    for (uint32_t i = 0; i < LUM_LIMIT_PARKED; i++) {
        struct lum_parked *p = &t->parked[i];
        if (!p->user[0])
            return p;
        oldest = older(oldest, p);
        if (same_person(&p->person, person))
            own = older(own, p);
    }
    oldest = own ? own : oldest;
    return forget(t, oldest) ? oldest : NULL;
}

void lum_session_park(struct lum_session *s, int64_t now_ns)
{
    struct lum_parked *p = s->key[0] ? make_place(s->table, &s->person) : NULL;
    if (!p) {
        s->farewell = &lum_request_session_closed;
        return;
    }
    p->person = s->person;
    p->until_ns = now_ns + LUM_LIMIT_RESUME_S * 1000000000ll;
    memcpy(p->user, s->user, sizeof p->user);
    memcpy(p->key, s->key, sizeof p->key);
}

/* ---- coming back ---- */

/* The server may not have noticed yet that a connection broke: it ends then. */
static struct lum_session *find_open(struct lum_sessions *t, const char *user)
{
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++) {
        struct lum_session *s = &t->slots[i];
        if (s->open && s->greeted && !s->superseded && strcmp(s->user, user) == 0)
            return s;
    }
    return NULL;
}

bool lum_session_resume(struct lum_session *s, const char *name, const char *key, int64_t now_ns)
{
    struct lum_sessions *t = s->table;
    struct lum_session *open = find_open(t, name);
    struct lum_parked *parked = open ? NULL : find_parked(t, name);
    if (open && !lum_close_is_for_good(open->close) && key_opens(open->key, key) &&
        same_person(&open->person, &s->person)) {
        memcpy(s->key, open->key, sizeof s->key);
        open->superseded = true;
        lum_session_abort(open, LUM_CLOSE_RESUMED);
        t->ended = true;
    } else if (parked && now_ns < parked->until_ns && key_opens(parked->key, key) &&
               same_person(&parked->person, &s->person)) {
        memcpy(s->key, parked->key, sizeof s->key);
        memset(parked, 0, sizeof *parked);
    } else {
        return false;
    }
    snprintf(s->user, sizeof s->user, "%s", name);
    return true;
}

/* ---- what was changed meanwhile ---- */

static void drop_oldest(struct lum_changes_kept *c)
{
    c->n_bytes -= c->ring[c->first].text->n_bytes;
    lum_text_unref(c->ring[c->first].text);
    c->before = c->ring[c->first].scene_rev;
    c->first = (c->first + 1) % LUM_LIMIT_CHANGES_KEPT;
    c->n--;
}

void lum_sessions_keep_change(struct lum_sessions *t, uint64_t scene_rev, struct lum_text *text)
{
    struct lum_changes_kept *c = &t->changes;
    if (!text || text->n_bytes > LUM_LIMIT_CHANGES_KEPT_BYTES) { /* from here on they are known again */
        lum_sessions_drop_changes(t);
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

int lum_sessions_missed(const struct lum_sessions *t, uint64_t scene_rev)
{
    const struct lum_changes_kept *c = &t->changes;
    uint64_t newest = c->n ? c->ring[(c->first + c->n - 1) % LUM_LIMIT_CHANGES_KEPT].scene_rev : c->before;
    int n = 0;
    if (scene_rev < c->before || scene_rev > newest)
        return -1;
    while ((uint32_t)n < c->n &&
           c->ring[(c->first + c->n - 1 - (uint32_t)n) % LUM_LIMIT_CHANGES_KEPT].scene_rev > scene_rev)
        n++;
    return n;
}

void lum_session_say_missed(struct lum_session *s, int n)
{
    const struct lum_changes_kept *c = &s->table->changes;
    for (uint32_t i = n > 0 ? c->n - (uint32_t)n : c->n; i < c->n; i++)
        lum_session_queue_text(s, c->ring[(c->first + i) % LUM_LIMIT_CHANGES_KEPT].text);
}

void lum_sessions_drop_changes(struct lum_sessions *t)
{
    while (t->changes.n > 0)
        drop_oldest(&t->changes);
}
