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

/* The project was closed meanwhile: its director knows of nobody. */
static bool is_past(const struct lum_parked *p)
{
    return lum_project_opening(p->project) != p->opening;
}

static struct lum_parked *find_parked(struct lum_sessions *t, const char *user)
{
    for (uint32_t i = 0; i < LUM_LIMIT_PARKED; i++)
        if (t->parked[i].user[0] && !is_past(&t->parked[i]) && strcmp(t->parked[i].user, user) == 0)
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
    if (is_past(p)) {
        memset(p, 0, sizeof *p);
        return true;
    }
    struct lum_request *q = lum_request_create(&lum_request_user_gone);
    if (!q)
        return false;
    strcpy(q->user, p->user);
    if (!lum_director_post(lum_project_director(p->project), q)) {
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
        if (t->parked[i].user[0] && (now_ns >= t->parked[i].until_ns || is_past(&t->parked[i])))
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
    p->project = s->project;
    p->opening = lum_project_opening(s->project);
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
    if (parked && (parked->project != s->project || is_past(parked)))
        parked = NULL;
    if (open && open->project == s->project && !lum_close_is_for_good(open->close) && key_opens(open->key, key) &&
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

void lum_session_say_missed(struct lum_session *s, int n)
{
    for (int i = 0; i < n; i++)
        lum_session_queue_text(s, lum_changes_kept_last(lum_project_changes(s->project), (uint32_t)n, (uint32_t)i));
}
