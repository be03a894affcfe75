/* Sessions without sockets: hello, order of sending, bounds, and what happens when the director is full or gone ahead.
 * The director is a fake that records what is posted and plays its outbox. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <setjmp.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/net/metrics.h"
#include "server/net/session_internal.h"
#include "tests/support/fake_director.h"

#define TOKEN "0123456789abcdef0123"

static struct lum_out *push(struct lum_director *d, enum lum_out_kind kind, struct lum_session_ref ref,
                            const char *text)
{
    struct lum_out *o = lum_calloc(1, sizeof *o);
    assert_non_null(o);
    o->kind = kind;
    o->session = ref;
    o->text = text ? strdup(text) : NULL;
    *d->last = o;
    d->last = &o->next;
    return o;
}

/* ---- fixture ---- */

struct fixture {
    struct lum_director director;
    struct lum_auth auth;
    struct lum_net_counters counters;
    struct lum_projects *projects;
    struct lum_sessions *sessions;
    char lines[16][128]; /* the newest of the log */
    unsigned n_lines;
    struct lum_session *s; /* has said hello */
    struct lum_session_ref ref;
};

static void receive(struct lum_session *s, const char *text)
{
    lum_session_receive(s, text, strlen(text));
}

/* The next message as a string that the caller frees; NULL: none. */
static char *next_text(struct lum_session *s)
{
    struct lum_message m;
    if (!lum_session_next(s, &m))
        return NULL;
    assert_false(m.binary);
    char *text = calloc(1, m.n_body + 1);
    assert_non_null(text);
    memcpy(text, m.body, m.n_body);
    lum_session_sent(s);
    return text;
}

static void expect_text(struct lum_session *s, const char *part)
{
    char *text = next_text(s);
    assert_non_null(text);
    if (!strstr(text, part))
        fail_msg("\"%s\" does not hold \"%s\"", text, part);
    free(text);
}

static struct lum_session *open_greeted(struct fixture *f)
{
    struct lum_session *s = lum_session_open(f->sessions, "192.0.2.7");
    assert_non_null(s);
    receive(s, "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"session.hello\",\"params\":{\"token\":\"" TOKEN "\"}}");
    expect_text(s, "\"scene_rev\":41");
    assert_true(lum_session_greeted(s));
    return s;
}

static void note_line(void *user, int level, const char *component, const char *text)
{
    struct fixture *f = user;
    (void)level;
    (void)component;
    snprintf(f->lines[f->n_lines++ % LUM_ARRAY_LEN(f->lines)], sizeof f->lines[0], "%s", text);
}

static int set_up(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    fake_director_init(&f->director);
    f->auth.required = true;
    strcpy(f->auth.token, TOKEN);
    assert_int_equal(lum_projects_of_one(&f->director, NULL, &f->projects, NULL), LUM_OK);
    const struct lum_sessions_config config = {
        .projects = f->projects, .auth = &f->auth, .counters = &f->counters, .log = {.write = note_line, .user = f}};
    assert_int_equal(lum_sessions_create(&config, &f->sessions, NULL), LUM_OK);
    f->s = open_greeted(f);
    receive(f->s, "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"scene.undo\"}"); /* a command tells the session's name */
    f->ref = f->director.posted[0]->session;
    fake_director_forget(&f->director);
    *state = f;
    return 0;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    lum_sessions_destroy(f->sessions);
    assert_true(lum_projects_destroy(f->projects));
    fake_director_finish(&f->director);
    free(f);
    return 0;
}

/* ---- tests ---- */

static void test_requests_become_commands(void **state)
{
    struct fixture *f = *state;
    receive(f->s,
            "{\"jsonrpc\":\"2.0\",\"id\":\"a\",\"method\":\"pick\",\"params\":{\"view_id\":7,\"x\":3,\"y\":4.5}}");
    assert_int_equal(f->director.n_posted, 1);
    const struct lum_request *c = f->director.posted[0];
    assert_ptr_equal(c->type, &lum_request_pick);
    assert_int_equal(c->view_id, 7);
    assert_true(c->x == 3.0 && c->y == 4.5);
    assert_string_equal(c->rpc_id, "\"a\"");
    assert_int_equal(c->session.slot, lum_session_slot(f->s));
    assert_true(c->received_ns > 0);
    assert_false(lum_session_pending(f->s));
}

static void test_a_full_inbox_is_said(void **state)
{
    struct fixture *f = *state;
    f->director.capacity = 0;
    receive(f->s, "{\"jsonrpc\":\"2.0\",\"id\":2,\"method\":\"scene.undo\"}");
    expect_text(f->s, "\"code\":\"busy\"");
    receive(f->s, "{\"jsonrpc\":\"2.0\",\"method\":\"scene.undo\"}"); /* a notification: lost in silence */
    assert_null(next_text(f->s));
    f->director.capacity = 64;
    receive(f->s, "{\"jsonrpc\":\"2.0\",\"id\":3,\"method\":\"scene.undo\"}");
    assert_int_equal(f->director.n_posted, 1);
}

static void test_the_director_learns_of_a_close_even_when_it_was_full(void **state)
{
    struct fixture *f = *state;
    f->director.capacity = 0;
    lum_session_close(f->s);
    lum_sessions_deliver(f->sessions);
    assert_int_equal(f->director.n_posted, 0);
    struct lum_session *other = lum_session_open(f->sessions, "192.0.2.7");
    assert_int_not_equal(lum_session_slot(other), f->ref.slot); /* the slot is kept until then */
    f->director.capacity = 64;
    lum_sessions_deliver(f->sessions);
    assert_int_equal(f->director.n_posted, 1);
    assert_ptr_equal(f->director.posted[0]->type, &lum_request_session_lost);
    assert_int_equal(f->director.posted[0]->session.generation, f->ref.generation);
    lum_sessions_deliver(f->sessions);
    assert_int_equal(f->director.n_posted, 1);
}

static void test_answers_for_those_who_left_reach_nobody(void **state)
{
    struct fixture *f = *state;
    lum_session_close(f->s);
    struct lum_session *next = open_greeted(f);
    assert_int_equal(lum_session_slot(next), f->ref.slot); /* the slot is used again, by another generation */
    push(&f->director, LUM_OUT_TEXT, f->ref, "\"for the one before\"");
    push(&f->director, LUM_OUT_VIEW_OPENED, f->ref, NULL)->stream = lum_stream_create(1, 1);
    push(&f->director, LUM_OUT_TEXT, (struct lum_session_ref){.slot = UINT32_MAX}, "\"for nobody\"");
    lum_sessions_deliver(f->sessions);
    assert_null(next_text(next));
}

static void test_broadcasts_go_to_those_who_said_hello(void **state)
{
    struct fixture *f = *state;
    struct lum_session *guest = lum_session_open(f->sessions, "192.0.2.7"), *other = open_greeted(f);
    push(&f->director, LUM_OUT_BROADCAST, (struct lum_session_ref){0}, "\"news\"");
    lum_sessions_deliver(f->sessions);
    expect_text(f->s, "news");
    expect_text(other, "news");
    assert_null(next_text(guest));
}

static struct lum_stream *add_view(struct fixture *f, uint32_t view_id)
{
    struct lum_stream *stream = lum_stream_create(view_id, 2);
    push(&f->director, LUM_OUT_VIEW_OPENED, f->ref, NULL)->stream = lum_stream_ref(stream);
    lum_sessions_deliver(f->sessions);
    return stream;
}

static void publish(struct lum_stream *stream, uint64_t seq)
{
    struct lum_encoded_tile *tiles[2];
    for (int i = 0; i < 2; i++) {
        tiles[i] = lum_encoded_tile_create(4);
        tiles[i]->header =
            (struct lum_frame_header){.kind = LUM_FRAME_TILE, .frame_seq = seq, .view_id = lum_stream_view_id(stream)};
    }
    assert_true(lum_stream_publish(stream, seq, tiles));
}

/* The view of the next message, which must be a tile. */
static uint32_t next_view(struct lum_session *s)
{
    struct lum_message m;
    struct lum_frame_header header;
    uint8_t bytes[LUM_FRAME_HEADER_BYTES + 4];
    size_t offset;
    assert_true(lum_session_next(s, &m));
    assert_true(m.binary);
    assert_int_equal(m.n_body, 4);
    memcpy(bytes, m.head, sizeof m.head);
    memcpy(bytes + sizeof m.head, m.body, 4);
    assert_true(lum_frame_header_unpack(bytes, sizeof bytes, &header, &offset));
    lum_session_sent(s);
    return header.view_id;
}

static void test_text_before_tiles_and_views_in_turn(void **state)
{
    struct fixture *f = *state;
    struct lum_stream *a = add_view(f, 10), *b = add_view(f, 20);
    publish(a, 1);
    publish(b, 1);
    push(&f->director, LUM_OUT_TEXT, f->ref, "\"reply\"");
    assert_int_equal(next_view(f->s), 10);
    lum_sessions_deliver(f->sessions);
    expect_text(f->s, "reply"); /* in the middle of a frame, between two tiles */
    assert_int_equal(next_view(f->s), 20);
    assert_int_equal(next_view(f->s), 10);
    assert_int_equal(next_view(f->s), 20);
    assert_false(lum_session_pending(f->s));
    lum_stream_unref(a);
    lum_stream_unref(b);
}

static void test_acknowledgements_wake_the_director(void **state)
{
    struct fixture *f = *state;
    struct lum_stream *stream = add_view(f, 10);
    for (uint64_t seq = 1; seq <= LUM_LIMIT_UNACKED_FRAMES; seq++) {
        publish(stream, seq);
        next_view(f->s);
        next_view(f->s);
    }
    fake_director_forget(&f->director);
    receive(f->s, "{\"jsonrpc\":\"2.0\",\"method\":\"frame.ack\",\"params\":{\"view_id\":11,\"frame_seq\":1}}");
    assert_int_equal(f->director.n_posted, 0);
    receive(f->s, "{\"jsonrpc\":\"2.0\",\"method\":\"frame.ack\",\"params\":{\"view_id\":10,\"frame_seq\":1}}");
    assert_int_equal(f->director.n_posted, 1);
    assert_ptr_equal(f->director.posted[0]->type, &lum_request_wake);
    receive(f->s, "{\"jsonrpc\":\"2.0\",\"method\":\"frame.ack\",\"params\":{\"view_id\":10,\"frame_seq\":1}}");
    assert_int_equal(f->director.n_posted, 1);
    assert_null(next_text(f->s));
    lum_stream_unref(stream);
}

/* Of a time that makes no sense: the frame is there all the same. */
static void test_acknowledgements_are_taken_with_any_number(void **state)
{
    struct fixture *f = *state;
    struct lum_stream *stream = add_view(f, 10);
    const char *held[] = {"-1", "0", "12.5", "1e9", "1000000001", "1e308", "-1e308", "null"};
    uint64_t seq = 0;
    for (size_t i = 0; i < sizeof held / sizeof held[0]; i++) {
        char text[160];
        publish(stream, ++seq);
        next_view(f->s);
        next_view(f->s);
        snprintf(text, sizeof text,
                 "{\"jsonrpc\":\"2.0\",\"method\":\"frame.ack\",\"params\":{\"view_id\":10,\"frame_seq\":%u,"
                 "\"held_ms\":%s}}",
                 (unsigned)seq, held[i]);
        receive(f->s, text);
        if (f->counters.frames_acked != seq)
            fail_msg("held_ms %s: the acknowledgement was not taken", held[i]);
    }
    assert_int_equal(f->counters.messages_refused, 0);
    publish(stream, ++seq);
    const char *none[] = {"\"1\"", "[1]", "true", "1e999"}; /* the last is refused as no number of any message */
    for (uint64_t i = 0; i < sizeof none / sizeof none[0]; i++) {
        char text[160];
        snprintf(text, sizeof text,
                 "{\"jsonrpc\":\"2.0\",\"method\":\"frame.ack\",\"params\":{\"view_id\":10,\"frame_seq\":%u,"
                 "\"held_ms\":%s}}",
                 (unsigned)seq, none[i]);
        receive(f->s, text);
        assert_int_equal(f->counters.messages_refused, i + 1);
    }
    assert_int_equal(f->counters.frames_acked, seq - 1);
    lum_stream_unref(stream);
}

/* Else the view of a client that drags too fast would stand still for good. */
static void test_acknowledgements_are_never_refused_for_their_rate(void **state)
{
    struct fixture *f = *state;
    struct lum_stream *stream = add_view(f, 10);
    publish(stream, 1);
    next_view(f->s);
    next_view(f->s);
    while (f->counters.messages_refused == 0) /* those that say nothing new are charged */
        receive(f->s, "{\"jsonrpc\":\"2.0\",\"method\":\"frame.ack\",\"params\":{\"view_id\":10,\"frame_seq\":2}}");
    f->counters.messages_refused = 0;
    receive(f->s, "{\"jsonrpc\":\"2.0\",\"method\":\"frame.ack\",\"params\":{\"view_id\":10,\"frame_seq\":1}}");
    assert_int_equal(f->counters.messages_refused, 0);
    assert_int_equal(f->counters.frames_acked, 1);
    lum_stream_unref(stream);
}

static void test_closed_views_are_forgotten(void **state)
{
    struct fixture *f = *state;
    struct lum_stream *stream = add_view(f, 10);
    publish(stream, 1);
    assert_true(lum_session_pending(f->s));
    push(&f->director, LUM_OUT_VIEW_CLOSED, f->ref, NULL)->view_id = 10;
    lum_sessions_deliver(f->sessions);
    assert_false(lum_session_pending(f->s));
    lum_stream_unref(stream);
}

static void test_the_queue_of_one_who_does_not_read_is_bounded(void **state)
{
    struct fixture *f = *state;
    struct lum_session *other = open_greeted(f);
    const size_t n_text = 1u << 20;
    char *text = malloc(n_text + 1);
    memset(text, 'x', n_text);
    text[n_text] = '\0';
    for (unsigned i = 0; i <= LUM_LIMIT_CONTROL_QUEUE_BYTES / n_text; i++) {
        assert_int_equal(lum_session_close_now(f->s), LUM_CLOSE_NONE);
        push(&f->director, LUM_OUT_BROADCAST, f->ref, text);
        lum_sessions_deliver(f->sessions);
        free(next_text(other)); /* this one reads */
    }
    assert_int_equal(lum_session_close_now(f->s), LUM_CLOSE_SLOW);
    assert_int_equal(lum_session_close_now(other), LUM_CLOSE_NONE);
    free(text);
}

static void say_hello_with(struct fixture *f, const char *params)
{
    char text[256];
    struct lum_session *s = lum_session_open(f->sessions, "192.0.2.7");
    assert_non_null(s);
    snprintf(text, sizeof text, "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"session.hello\",\"params\":%s}", params);
    receive(s, text);
    expect_text(s, "not_authorised");
    lum_session_close(s);
}

static void test_wrong_tokens_are_logged_and_do_not_flood(void **state)
{
    struct fixture *f = *state;
    f->n_lines = 0;
    int64_t start = lum_clock_ns();
    say_hello_with(f, "{}");
    assert_int_equal(f->n_lines, 1);
    assert_string_equal(f->lines[0], "192.0.2.7 turned away: no token");
    for (int i = 0; i < 1000; i++)
        say_hello_with(f, "{\"token\":\"guess-of-somebody\"}");
    unsigned seconds = (unsigned)((lum_clock_ns() - start) / 1000000000);
    if (f->n_lines > 1 + seconds)
        fail_msg("%u lines in %u s", f->n_lines, seconds);
    for (size_t i = 0; i < LUM_ARRAY_LEN(f->lines); i++)
        assert_null(strstr(f->lines[i], "guess"));
}

/* How many of these bytes a new session may send before it has to wait. */
static size_t bytes_before_wait(struct fixture *f, const char *bytes, size_t n, bool whole_frames)
{
    struct lum_session *s = open_greeted(f);
    uint64_t before = f->counters.rx_waits;
    size_t sum = 0;
    while (lum_session_charge(s, bytes, n, whole_frames) == 0)
        sum += n;
    assert_int_equal(f->counters.rx_waits, before + 1);
    lum_session_close(s);
    return sum;
}

static void test_what_is_no_message_is_paid_for_as_messages_are(void **state)
{
    struct fixture *f = *state;
    assert_int_equal(lum_session_charge_rest(f->s, LUM_LIMIT_RX_BURST_BYTES / 2), 0);
    assert_true(lum_session_charge_rest(f->s, LUM_LIMIT_RX_BURST_BYTES) > 0);
    assert_true(lum_session_charge(f->s, "x", 1, true) > 0); /* one purse */
    assert_int_equal(f->counters.rx_rest, LUM_LIMIT_RX_BURST_BYTES / 2 + LUM_LIMIT_RX_BURST_BYTES);
    assert_int_equal(f->counters.rx_waits, 2);
}

static void test_bytes_are_paid_for_before_they_are_read(void **state)
{
    struct fixture *f = *state;
    char text[1u << 16], values[1u << 16];
    memset(text, 'a', sizeof text);
    for (size_t i = 0; i < sizeof values; i++)
        values[i] = "0,"[i % 2];
    size_t n_text = bytes_before_wait(f, text, sizeof text, false),
           n_values = bytes_before_wait(f, values, sizeof text, false), n_frames = bytes_before_wait(f, text, 1, true);
    assert_true(n_text >= LUM_LIMIT_RX_BURST_BYTES - sizeof text);
    assert_true(n_text >= 2 * LUM_LIMIT_MESSAGE_BYTES);
    assert_true(n_values >= LUM_LIMIT_RX_BURST_BYTES / (1 + LUM_LIMIT_VALUE_COST_BYTES / 2) - sizeof text);
    assert_true(n_frames >= LUM_LIMIT_RX_BURST_BYTES / (1 + LUM_LIMIT_FRAME_COST_BYTES) - 1);
}

static void test_drain(void **state)
{
    struct fixture *f = *state;
    struct lum_session *guest = lum_session_open(f->sessions, "192.0.2.7");
    push(&f->director, LUM_OUT_TEXT, f->ref, "\"reply\"");
    lum_sessions_deliver(f->sessions);
    lum_sessions_begin_drain(f->sessions);
    assert_int_equal(lum_session_close_now(guest), LUM_CLOSE_RESTART);
    assert_int_equal(lum_session_close_now(f->s), LUM_CLOSE_NONE); /* text first */
    expect_text(f->s, "reply");
    expect_text(f->s, "session.closing");
    assert_int_equal(lum_session_close_now(f->s), LUM_CLOSE_RESTART);
    receive(f->s, "{\"jsonrpc\":\"2.0\",\"id\":2,\"method\":\"scene.undo\"}"); /* too late */
    assert_int_equal(f->director.n_posted, 0);
    assert_int_equal(lum_session_close_now(lum_session_open(f->sessions, "192.0.2.7")), LUM_CLOSE_RESTART);
}

/* Whoever stays when the time of her token is over neither changes nor hears anything any more. */
static void test_a_token_ends_while_its_session_goes_on(void **state)
{
    struct fixture *f = *state;
    struct lum_session *other = open_greeted(f);
    f->s->person.ends_s = 1;
    receive(f->s, "{\"jsonrpc\":\"2.0\",\"id\":2,\"method\":\"scene.undo\"}");
    assert_int_equal(f->director.n_posted, 0);
    assert_int_equal(lum_session_close_now(f->s), LUM_CLOSE_REVOKED);
    other->person.ends_s = 1;
    push(&f->director, LUM_OUT_BROADCAST, (struct lum_session_ref){0}, "\"news\"");
    lum_sessions_deliver(f->sessions);
    assert_null(next_text(other));
    assert_int_equal(lum_session_close_now(other), LUM_CLOSE_REVOKED);
}

/* One who says nothing when her time is over is not told of as if she were here, and goes. */
static void test_who_is_silent_when_her_token_ends_is_not_listed(void **state)
{
    struct fixture *f = *state;
    struct lum_session *silent = open_greeted(f);
    f->s->person.role = LUM_ROLE_ADMIN;
    silent->person.ends_s = 1;
    receive(f->s, "{\"jsonrpc\":\"2.0\",\"id\":2,\"method\":\"session.list\"}");
    char *text = next_text(f->s), name[LUM_LIMIT_ID_BYTES + 3];
    assert_non_null(text);
    snprintf(name, sizeof name, "\"%s\"", f->s->user);
    assert_non_null(strstr(text, name));
    snprintf(name, sizeof name, "\"%s\"", silent->user);
    assert_null(strstr(text, name));
    free(text);
    assert_int_equal(lum_session_close_now(silent), LUM_CLOSE_REVOKED);
    assert_true(lum_sessions_take_ended(f->sessions)); /* so that her connection is looked at */
}

/* Who was cut off is remembered for so long, and then all of her is forgotten; the director hears both. */
static void test_who_does_not_come_back_is_forgotten(void **state)
{
    struct fixture *f = *state;
    char user[sizeof f->s->user];
    memcpy(user, f->s->user, sizeof user);
    lum_session_close(f->s);
    assert_int_equal(f->director.n_posted, 1);
    assert_ptr_equal(f->director.posted[0]->type, &lum_request_session_lost);
    assert_true(lum_sessions_have_parked(f->sessions, user));
    int64_t end_ns = f->sessions->parked[0].until_ns;
    lum_sessions_forget_parked(f->sessions, end_ns - 1);
    assert_int_equal(f->director.n_posted, 1);
    f->director.capacity = 1; /* is full: it is told later */
    lum_sessions_forget_parked(f->sessions, end_ns);
    assert_true(lum_sessions_have_parked(f->sessions, user));
    f->director.capacity = 64;
    lum_sessions_forget_parked(f->sessions, end_ns);
    assert_int_equal(f->director.n_posted, 2);
    assert_ptr_equal(f->director.posted[1]->type, &lum_request_user_gone);
    assert_string_equal(f->director.posted[1]->user, user);
    assert_false(lum_sessions_have_parked(f->sessions, user));
}

/* Where all places are taken, who is cut off anew takes that of the same person, however long others wait. */
static void test_nobody_takes_the_places_of_others(void **state)
{
    struct fixture *f = *state;
    for (uint32_t i = 0; i <= LUM_LIMIT_PARKED; i++) {
        strcpy(f->s->person.name, i == 0 ? "ann" : "bob");
        snprintf(f->s->user, sizeof f->s->user, "%s.%u-1", f->s->person.name, i);
        lum_session_park(f->s, i + 1);
    }
    unsigned n_ann = 0, n_oldest = 0;
    for (uint32_t i = 0; i < LUM_LIMIT_PARKED; i++) {
        n_ann += strcmp(f->sessions->parked[i].person.name, "ann") == 0;
        n_oldest += f->sessions->parked[i].until_ns == LUM_LIMIT_RESUME_S * 1000000000ll + 2; /* of bob */
    }
    assert_int_equal(n_ann, 1);
    assert_int_equal(n_oldest, 0);
}

/* Late by a moment is too late, also where nobody has cleared away yet. */
static void test_a_session_is_kept_until_its_time_is_over(void **state)
{
    struct fixture *f = *state;
    char user[sizeof f->s->user], key[sizeof f->s->key];
    memcpy(user, f->s->user, sizeof user);
    memcpy(key, f->s->key, sizeof key);
    lum_session_close(f->s);
    int64_t end_ns = f->sessions->parked[0].until_ns;
    struct lum_session *late = lum_session_open(f->sessions, "192.0.2.7");
    assert_int_equal(lum_projects_enter(f->projects, "", 0, &late->project, NULL), LUM_PROJECT_IN);
    assert_false(lum_session_resume(late, user, key, end_ns));
    assert_true(lum_session_resume(late, user, key, end_ns - 1));
    assert_string_equal(late->user, user);
    assert_false(lum_sessions_have_parked(f->sessions, user));
    assert_false(lum_session_resume(late, user, key, end_ns - 1)); /* once */
}

static void tell_change(struct fixture *f, uint64_t rev, const char *text)
{
    push(&f->director, LUM_OUT_BROADCAST, (struct lum_session_ref){0}, text)->scene_rev = rev;
    lum_sessions_deliver(f->sessions);
    lum_text_queue_clear(&f->s->text);
}

static int missed_since(struct fixture *f, uint64_t scene_rev)
{
    return lum_changes_kept_missed(lum_project_changes(lum_projects_at(f->projects, 0)), scene_rev);
}

/* The scene was at 41 when the table was made. */
static void test_changes_are_kept_up_to_so_many_bytes(void **state)
{
    struct fixture *f = *state;
    const size_t n = LUM_LIMIT_CHANGES_KEPT_BYTES / 4;
    char *quarter = calloc(1, n + 1), *huge = calloc(1, LUM_LIMIT_CHANGES_KEPT_BYTES + 2);
    memset(quarter, 'x', n);
    memset(huge, 'x', LUM_LIMIT_CHANGES_KEPT_BYTES + 1);
    assert_int_equal(missed_since(f, 41), 0);
    assert_int_equal(missed_since(f, 40), -1);
    for (uint64_t rev = 42; rev < 46; rev++)
        tell_change(f, rev, quarter);
    assert_int_equal(missed_since(f, 41), 4);
    tell_change(f, 46, quarter);
    assert_int_equal(missed_since(f, 41), -1);
    assert_int_equal(missed_since(f, 42), 4);
    tell_change(f, 47, huge); /* nobody can be told that */
    assert_int_equal(missed_since(f, 46), -1);
    assert_int_equal(missed_since(f, 47), 0);
    tell_change(f, 48, "\"small\"");
    assert_int_equal(missed_since(f, 47), 1);
    assert_int_equal(missed_since(f, 49), -1); /* there is no such revision yet */
    lum_session_say_missed(f->s, 1);
    expect_text(f->s, "small");
    assert_null(next_text(f->s));
    free(quarter);
    free(huge);
}

static void test_table_is_bounded(void **state)
{
    struct fixture *f = *state;
    for (unsigned i = 1; i < LUM_LIMIT_CONNECTIONS; i++)
        assert_non_null(lum_session_open(f->sessions, "192.0.2.7"));
    assert_null(lum_session_open(f->sessions, "192.0.2.7"));
    lum_session_close(f->s);
    assert_non_null(lum_session_open(f->sessions, "192.0.2.7"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_requests_become_commands, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_a_full_inbox_is_said, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_the_director_learns_of_a_close_even_when_it_was_full, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_answers_for_those_who_left_reach_nobody, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_broadcasts_go_to_those_who_said_hello, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_text_before_tiles_and_views_in_turn, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_acknowledgements_wake_the_director, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_acknowledgements_are_taken_with_any_number, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_acknowledgements_are_never_refused_for_their_rate, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_closed_views_are_forgotten, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_the_queue_of_one_who_does_not_read_is_bounded, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_wrong_tokens_are_logged_and_do_not_flood, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_what_is_no_message_is_paid_for_as_messages_are, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_bytes_are_paid_for_before_they_are_read, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_drain, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_a_token_ends_while_its_session_goes_on, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_who_is_silent_when_her_token_ends_is_not_listed, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_who_does_not_come_back_is_forgotten, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_nobody_takes_the_places_of_others, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_a_session_is_kept_until_its_time_is_over, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_changes_are_kept_up_to_so_many_bytes, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_table_is_bounded, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
