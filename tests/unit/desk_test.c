/* Packets of lighting desks byte by byte as E1.31 and Art-Net lay them out, and what sources make of a universe. Time
 * is what the test says. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "server/desk/desk.h"

#define MS 1000000ll

static void put16(uint8_t *p, uint32_t v)
{
    p[0] = (uint8_t)(v >> 8);
    p[1] = (uint8_t)v;
}

struct sacn {
    uint8_t bytes[700];
    size_t n;
};

/* A data packet of 3 slots a, b, c; source: first byte of the CID. */
static struct sacn sacn(uint8_t source, uint8_t sequence, uint8_t a, uint8_t b, uint8_t c)
{
    static const uint8_t acn[] = {'A', 'S', 'C', '-', 'E', '1', '.', '1', '7', 0, 0, 0};
    struct sacn s = {.n = 129};
    uint8_t *p = s.bytes;
    put16(p, 0x0010); /* preamble */
    memcpy(p + 4, acn, sizeof acn);
    put16(p + 16, 0x7000 | (129 - 16));
    p[21] = 4; /* root vector */
    p[22] = source;
    put16(p + 38, 0x7000 | (129 - 38));
    p[43] = 2; /* framing vector */
    memcpy(p + 44, "desk", 4);
    p[108] = 100; /* priority */
    p[111] = sequence;
    put16(p + 113, 7); /* universe */
    put16(p + 115, 0x7000 | (129 - 115));
    p[117] = 2;
    p[118] = 0xa1;
    put16(p + 121, 1);
    put16(p + 123, 4); /* start code and slots */
    p[126] = a;
    p[127] = b;
    p[128] = c;
    return s;
}

static enum lum_packet_kind read_sacn(const struct sacn *s, struct lum_desk_packet *p)
{
    return lum_packet_read(LUM_DESK_SACN, s->bytes, s->n, p);
}

static void a_packet_says_what_the_standard_lays_out(void **state)
{
    (void)state;
    struct sacn s = sacn(9, 200, 1, 2, 255);
    struct lum_desk_packet p;
    s.bytes[112] = 0xc0;
    assert_int_equal(read_sacn(&s, &p), LUM_PACKET_SLOTS);
    assert_int_equal(p.universe, 7);
    assert_int_equal(p.source[0], 9);
    assert_string_equal(p.name, "desk");
    assert_int_equal(p.priority, 100);
    assert_int_equal(p.sequence, 200);
    assert_true(p.preview && p.terminated);
    assert_int_equal(p.n_slots, 3);
    assert_int_equal(p.slots[2], 255);
    s.bytes[125] = 0xdd; /* priorities of addresses: another start code */
    assert_int_equal(read_sacn(&s, &p), LUM_PACKET_OTHER);
    memset(s.bytes + 44, 'x', 64); /* a name without end is none */
    s.bytes[125] = 0;
    assert_int_equal(read_sacn(&s, &p), LUM_PACKET_SLOTS);
    assert_string_equal(p.name, "");
    s = sacn(9, 0, 0, 0, 0);
    memcpy(s.bytes + 44, "a\"\x1b[2J", 7); /* nor one with controls */
    assert_int_equal(read_sacn(&s, &p), LUM_PACKET_SLOTS);
    assert_string_equal(p.name, "");
    s.bytes[21] = 8; /* synchronisation, discovery */
    assert_int_equal(read_sacn(&s, &p), LUM_PACKET_OTHER);
}

/* Every byte that the layout fixes, one by one, and every length. */
static void what_is_not_of_the_form_is_refused(void **state)
{
    (void)state;
    static const uint8_t fixed[] = {0,  1,  2,  3,  4,   15,  16,  17,  18,  19,  20,  21,  38,  39,
                                    40, 41, 42, 43, 115, 116, 117, 118, 119, 120, 121, 122, 123, 124};
    struct lum_desk_packet p;
    for (size_t i = 0; i < sizeof fixed; i++) {
        struct sacn s = sacn(1, 1, 0, 0, 0);
        s.bytes[fixed[i]] ^= 0x10;
        if (read_sacn(&s, &p) != LUM_PACKET_BAD)
            fail_msg("byte %u may be anything", fixed[i]);
    }
    for (size_t n = 0; n < 700; n++) {
        struct sacn s = sacn(1, 1, 0, 0, 0);
        s.n = n;
        assert_int_equal(read_sacn(&s, &p) == LUM_PACKET_SLOTS, n == 129);
    }
    static const uint32_t universes[][2] = {{0, 0}, {1, 1}, {63999, 1}, {64000, 0}, {65535, 0}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(universes); i++) {
        struct sacn s = sacn(1, 1, 0, 0, 0);
        put16(s.bytes + 113, universes[i][0]);
        assert_int_equal(read_sacn(&s, &p) == LUM_PACKET_SLOTS, universes[i][1]);
    }
    for (int priority = 0; priority < 256; priority++) {
        struct sacn s = sacn(1, 1, 0, 0, 0);
        s.bytes[108] = (uint8_t)priority;
        assert_int_equal(read_sacn(&s, &p) == LUM_PACKET_SLOTS, priority <= 200);
    }
}

static void artnet_says_what_its_layout_has(void **state)
{
    (void)state;
    uint8_t d[20] = {'A', 'r', 't', '-', 'N', 'e', 't', 0, 0, 0x50, 0, 14, 33, 0, 0x21, 0x7f, 0, 2, 10, 20};
    struct lum_desk_packet p;
    assert_int_equal(lum_packet_read(LUM_DESK_ARTNET, d, 20, &p), LUM_PACKET_SLOTS);
    assert_int_equal(p.universe, 0x7f21);
    assert_int_equal(p.sequence, 33);
    assert_true(p.sequenced);
    assert_int_equal(p.n_slots, 2);
    assert_int_equal(p.slots[1], 20);
    d[12] = 0;
    assert_int_equal(lum_packet_read(LUM_DESK_ARTNET, d, 20, &p), LUM_PACKET_SLOTS);
    assert_false(p.sequenced);
    static const struct {
        uint8_t at, value;
    } broken[] = {{0, 'a'}, {7, 1}, {11, 13}, {15, 0x80}, {16, 1}, {17, 0}, {17, 1}, {17, 4}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(broken); i++) {
        uint8_t was = d[broken[i].at];
        d[broken[i].at] = broken[i].value;
        assert_int_equal(lum_packet_read(LUM_DESK_ARTNET, d, 20, &p), LUM_PACKET_BAD);
        d[broken[i].at] = was;
    }
    for (size_t n = 0; n < 20; n++)
        assert_int_equal(lum_packet_read(LUM_DESK_ARTNET, d, n, &p), LUM_PACKET_BAD);
    d[9] = 0x20; /* a poll */
    assert_int_equal(lum_packet_read(LUM_DESK_ARTNET, d, 14, &p), LUM_PACKET_OTHER);
}

/* ---- sources ---- */

static bool take(struct lum_universe *u, const struct sacn *s, int64_t now_ms)
{
    struct lum_desk_packet p;
    assert_int_equal(read_sacn(s, &p), LUM_PACKET_SLOTS);
    return lum_universe_take(u, &p, now_ms * MS);
}

static void assert_slots(const struct lum_universe *u, uint8_t a, uint8_t b, uint8_t c)
{
    const uint8_t want[3] = {a, b, c};
    assert_memory_equal(u->slots, want, 3);
}

static void the_highest_priority_wins_and_equals_give_the_highest_value(void **state)
{
    (void)state;
    struct lum_universe u = {.protocol = LUM_DESK_SACN, .number = 7};
    struct sacn a = sacn(1, 0, 10, 200, 0), b = sacn(2, 0, 50, 60, 0), c = sacn(3, 0, 1, 2, 3);
    assert_true(take(&u, &a, 0));
    assert_slots(&u, 10, 200, 0);
    assert_true(take(&u, &b, 1));
    assert_slots(&u, 50, 200, 0);
    c.bytes[108] = 101;
    assert_true(take(&u, &c, 2));
    assert_slots(&u, 1, 2, 3);
    a.bytes[111] = 1;
    assert_false(take(&u, &a, 3)); /* it counts no more */
    c.bytes[111] = 1;
    c.bytes[108] = 99; /* its priority falls below */
    assert_true(take(&u, &c, 4));
    assert_slots(&u, 50, 200, 0);
    assert_int_equal(lum_universe_sources(&u), 3);
}

static void a_source_is_lost_after_two_and_a_half_seconds_of_silence(void **state)
{
    (void)state;
    struct lum_universe u = {.protocol = LUM_DESK_SACN, .number = 7};
    struct sacn a = sacn(1, 0, 10, 20, 30), b = sacn(2, 0, 90, 0, 0);
    b.bytes[108] = 150;
    take(&u, &a, 0);
    take(&u, &b, 0);
    a.bytes[111] = 1;
    take(&u, &a, 2000);
    assert_false(lum_universe_expire(&u, 2499 * MS));
    assert_slots(&u, 90, 0, 0);
    assert_true(lum_universe_expire(&u, 2500 * MS));
    assert_slots(&u, 10, 20, 30);
    assert_false(lum_universe_expire(&u, 4500 * MS)); /* the last one, too: the last look holds */
    assert_int_equal(lum_universe_sources(&u), 0);
    assert_slots(&u, 10, 20, 30);
    b.bytes[111] = 200; /* whoever comes next begins anew, whatever its number */
    assert_true(take(&u, &b, 9000));
    assert_slots(&u, 90, 0, 0);
}

static void a_source_that_says_that_it_ends_is_gone_at_once(void **state)
{
    (void)state;
    struct lum_universe u = {.protocol = LUM_DESK_SACN, .number = 7};
    struct sacn a = sacn(1, 0, 10, 20, 30), b = sacn(2, 0, 90, 90, 90);
    take(&u, &a, 0);
    take(&u, &b, 0);
    b.bytes[111] = 1;
    b.bytes[112] = 0x40;
    b.bytes[126] = 255; /* values of such a packet do not count */
    assert_true(take(&u, &b, 10));
    assert_slots(&u, 10, 20, 30);
    a.bytes[111] = 1;
    a.bytes[112] = 0x40;
    assert_false(take(&u, &a, 20));
    assert_slots(&u, 10, 20, 30);
    assert_int_equal(lum_universe_sources(&u), 0);
    a.bytes[111] = 2; /* once more, of nobody */
    assert_false(take(&u, &a, 30));
}

static void previews_are_not_for_output(void **state)
{
    (void)state;
    struct lum_universe u = {.protocol = LUM_DESK_SACN, .number = 7};
    struct sacn a = sacn(1, 0, 10, 20, 30);
    a.bytes[112] = 0x80;
    assert_false(take(&u, &a, 0));
    assert_int_equal(u.n_slots, 0);
    assert_int_equal(u.previews, 1);
}

/* All 256 differences of the number to the last one: -19 to 0 are late. */
static void late_numbers_are_left_out(void **state)
{
    (void)state;
    for (int last = 0; last < 256; last += 51)
        for (int ahead = -128; ahead < 128; ahead++) {
            struct lum_universe u = {.protocol = LUM_DESK_SACN, .number = 7};
            struct sacn a = sacn(1, (uint8_t)last, 1, 1, 1), b = sacn(1, (uint8_t)(last + ahead), 2, 2, 2);
            take(&u, &a, 0);
            bool late = ahead > -20 && ahead <= 0;
            assert_int_equal(take(&u, &b, 10), !late);
            assert_int_equal(u.late, late);
            assert_int_equal(u.lost, ahead > 0 ? ahead - 1 : 0);
        }
}

static void ninth_sources_are_turned_away_but_for_a_higher_priority(void **state)
{
    (void)state;
    struct lum_universe u = {.protocol = LUM_DESK_SACN, .number = 7};
    for (uint8_t i = 0; i < LUM_DESK_SOURCES; i++) {
        struct sacn s = sacn(i, 0, i, 0, 0);
        take(&u, &s, 0);
    }
    struct sacn s = sacn(100, 0, 255, 255, 255);
    assert_false(take(&u, &s, 1));
    assert_int_equal(u.turned_away, 1);
    s.bytes[108] = 101;
    assert_true(take(&u, &s, 2));
    assert_slots(&u, 255, 255, 255);
    assert_int_equal(lum_universe_sources(&u), LUM_DESK_SOURCES);
}

/* A source of fewer slots says nothing of the others. */
static void slots_that_nobody_sends_stay(void **state)
{
    (void)state;
    struct lum_universe u = {.protocol = LUM_DESK_SACN, .number = 7};
    struct sacn a = sacn(1, 0, 10, 20, 30);
    take(&u, &a, 0);
    struct lum_desk_packet p;
    read_sacn(&a, &p);
    p.sequence = 1;
    p.n_slots = 1;
    lum_universe_take(&u, &p, 1);
    assert_slots(&u, 10, 20, 30);
    assert_int_equal(u.n_slots, 3);
}

static void artnet_merges_two_and_waits_for_ten_seconds(void **state)
{
    (void)state;
    struct lum_universe u = {.protocol = LUM_DESK_ARTNET};
    uint8_t slots[3][2] = {{10, 200}, {20, 100}, {255, 255}};
    for (uint8_t i = 0; i < 3; i++) {
        struct lum_desk_packet p = {.protocol = LUM_DESK_ARTNET, .priority = 100, .n_slots = 2, .slots = slots[i]};
        p.source[0] = i;
        lum_universe_take(&u, &p, i * 1000 * MS);
    }
    assert_int_equal(u.slots[0], 20);
    assert_int_equal(u.slots[1], 200);
    assert_int_equal(u.turned_away, 1);
    assert_false(lum_universe_expire(&u, 9999 * MS));
    assert_true(lum_universe_expire(&u, 10000 * MS));
    assert_int_equal(u.slots[1], 100);
    assert_false(lum_universe_expire(&u, 11000 * MS));
    assert_int_equal(u.slots[1], 100);
}

/* It counts from 255 to 1: 0 stands for not at all. */
static void artnet_numbers_go_round_without_loss(void **state)
{
    (void)state;
    struct lum_universe u = {.protocol = LUM_DESK_ARTNET};
    uint8_t slots[2] = {0, 0};
    for (int i = 0; i < 600; i++) {
        struct lum_desk_packet p = {.protocol = LUM_DESK_ARTNET, .priority = 100, .n_slots = 2, .slots = slots};
        p.sequence = (uint8_t)(1 + i % 255);
        p.sequenced = true;
        lum_universe_take(&u, &p, i * 20 * MS);
    }
    assert_int_equal(u.packets, 600);
    assert_int_equal(u.lost, 0);
    assert_int_equal(u.late, 0);
    double rate = lum_desk_source_rate(&u.sources[0], 599 * 20 * MS);
    assert_true(rate > 49.0 && rate < 51.0);
    assert_true(lum_desk_source_rate(&u.sources[0], 14000 * MS) == 0.0);
}

/* ---- the desk, without its sockets ---- */

static void count(void *user)
{
    ++*(int *)user;
}

static void only_universes_that_are_watched_are_kept(void **state)
{
    (void)state;
    struct lum_desk *desk;
    struct lum_desk_config config = {0};
    struct lum_desk_key seven = {LUM_DESK_SACN, 7}, both[2] = {{LUM_DESK_SACN, 7}, {LUM_DESK_ARTNET, 7}};
    struct lum_universe u;
    uint8_t slots[LUM_DESK_SLOTS];
    int64_t heard_ns = 0;
    int n_told = 0;
    assert_int_equal(lum_desk_create(&config, &desk, NULL), LUM_OK);
    assert_int_equal(lum_desk_start(desk, count, &n_told, NULL), LUM_OK);
    lum_desk_stop(desk); /* no thread: what the test tells is all that is heard */
    struct sacn s = sacn(1, 0, 1, 2, 3);
    lum_desk_take(desk, LUM_DESK_SACN, s.bytes, s.n, 0, 0);
    assert_int_equal(lum_desk_read(desk, seven, slots, &heard_ns), 0);
    assert_int_equal(lum_desk_counts(desk, LUM_DESK_SACN).unwatched, 1);
    assert_true(lum_desk_watch(desk, &seven, NULL, 1));
    for (uint8_t i = 1; i < 4; i++) { /* of the same look: it is told once */
        s.bytes[111] = i;
        lum_desk_take(desk, LUM_DESK_SACN, s.bytes, s.n, 0, i * 25 * MS);
    }
    assert_int_equal(n_told, 1);
    assert_int_equal(lum_desk_changes(desk), 1);
    assert_int_equal(lum_desk_read(desk, seven, slots, &heard_ns), 3);
    assert_int_equal(slots[2], 3);
    assert_int_equal(heard_ns, 75 * MS);
    uint8_t unwanted[1][LUM_DESK_SLOTS] = {{0, 1, 1}};
    assert_true(lum_desk_watch(desk, &seven, (const uint8_t(*)[LUM_DESK_SLOTS])unwanted, 1));
    s.bytes[111] = 4;
    s.bytes[127] = 200; /* the second: nobody's */
    lum_desk_take(desk, LUM_DESK_SACN, s.bytes, s.n, 0, 100 * MS);
    assert_int_equal(n_told, 1);
    assert_int_equal(lum_desk_read(desk, seven, slots, &heard_ns), 3);
    assert_int_equal(slots[1], 200); /* but it is kept */
    s.bytes[111] = 5;
    s.bytes[126] = 9;
    lum_desk_take(desk, LUM_DESK_SACN, s.bytes, s.n, 0, 125 * MS);
    assert_int_equal(n_told, 2);
    assert_true(lum_desk_watch(desk, both, NULL, 2)); /* what was watched goes on */
    assert_int_equal(lum_desk_read(desk, seven, slots, &heard_ns), 3);
    assert_true(lum_desk_next(desk, &seven, &u));
    assert_int_equal(u.protocol, LUM_DESK_ARTNET);
    assert_false(lum_desk_next(desk, &both[1], &u));
    assert_true(lum_desk_watch(desk, NULL, NULL, 0));
    assert_int_equal(lum_desk_read(desk, seven, slots, &heard_ns), 0);
    lum_desk_destroy(desk);
}

/* This process's groups are among those of the machine; 239.255.0.7 is written from its last byte on. */
static bool joined(const char *group)
{
    char line[256];
    bool found = false;
    FILE *f = fopen("/proc/net/igmp", "r");
    if (!f)
        skip();
    while (fgets(line, sizeof line, f))
        found = found || strstr(line, group);
    fclose(f);
    return found;
}

static void groups_of_watched_universes_are_joined_when_asked(void **state)
{
    (void)state;
    struct lum_desk *desk;
    struct lum_desk_config config = {.ears[LUM_DESK_SACN] = {.open = true, .host = "127.0.0.1"}};
    const struct lum_desk_key key = {LUM_DESK_SACN, 0xe6a7}; /* that nobody else here uses */
    for (int asked = 0; asked < 2; asked++) {
        strcpy(config.ears[LUM_DESK_SACN].interface, asked ? "127.0.0.1" : "");
        assert_int_equal(lum_desk_create(&config, &desk, NULL), LUM_OK);
        assert_true(lum_desk_watch(desk, &key, NULL, 1));
        assert_int_equal(joined("A7E6FFEF"), asked);
        assert_true(lum_desk_watch(desk, NULL, NULL, 0));
        assert_false(joined("A7E6FFEF"));
        lum_desk_destroy(desk);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_packet_says_what_the_standard_lays_out),
        cmocka_unit_test(what_is_not_of_the_form_is_refused),
        cmocka_unit_test(artnet_says_what_its_layout_has),
        cmocka_unit_test(the_highest_priority_wins_and_equals_give_the_highest_value),
        cmocka_unit_test(a_source_is_lost_after_two_and_a_half_seconds_of_silence),
        cmocka_unit_test(a_source_that_says_that_it_ends_is_gone_at_once),
        cmocka_unit_test(previews_are_not_for_output),
        cmocka_unit_test(late_numbers_are_left_out),
        cmocka_unit_test(ninth_sources_are_turned_away_but_for_a_higher_priority),
        cmocka_unit_test(slots_that_nobody_sends_stay),
        cmocka_unit_test(artnet_merges_two_and_waits_for_ten_seconds),
        cmocka_unit_test(artnet_numbers_go_round_without_loss),
        cmocka_unit_test(only_universes_that_are_watched_are_kept),
        cmocka_unit_test(groups_of_watched_universes_are_joined_when_asked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
