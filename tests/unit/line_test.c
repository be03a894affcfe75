/* What acknowledgements tell of a line, on lines whose rate and length are known: frames queue, take bytes / rate each,
 * and are answered a round trip later. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "server/stream/line.h"

#define MS 1000000.0

struct sim {
    double bytes_s, rtt_ns;
    double free_ns; /* the line has nothing to send any more */
    double now_ns;  /* of the server */
    uint64_t seq;
    struct lum_line line;
};

static struct sim sim_of(double bytes_s, double rtt_ms)
{
    return (struct sim){.bytes_s = bytes_s, .rtt_ns = rtt_ms * MS};
}

/* Sends a frame now, whole, into a buffer that takes it at once. When its answer comes. */
static double send(struct sim *s, double bytes)
{
    lum_line_begin(&s->line, ++s->seq, (int64_t)s->now_ns);
    lum_line_add(&s->line, (uint64_t)bytes / 2, false);
    lum_line_add(&s->line, (uint64_t)bytes - (uint64_t)bytes / 2, true);
    double there = s->now_ns + s->rtt_ns / 2;
    s->free_ns = (s->free_ns > there ? s->free_ns : there) + bytes / s->bytes_s * 1e9;
    return s->free_ns + s->rtt_ns / 2;
}

static void answer(struct sim *s, uint64_t seq, double at_ns)
{
    s->now_ns = at_ns;
    lum_line_answer(&s->line, seq, 0, (int64_t)at_ns);
}

static void alone(struct sim *s, double bytes)
{
    double at = send(s, bytes);
    answer(s, s->seq, at);
    s->now_ns += 5 * MS; /* nothing is sent for a while */
}

/* Times are whole nanoseconds, of frames that take milliseconds. */
static void assert_rate(const struct sim *s, double bytes_s)
{
    if (!(fabs(s->line.bytes_s - bytes_s) < 1e-4 * bytes_s))
        fail_msg("%.0f bytes a second, not %.0f (rtt %g ms)", s->line.bytes_s, bytes_s, s->rtt_ns / MS);
}

static const double rates[] = {2e4, 1.25e5, 1e6, 1e7}, rtts_ms[] = {0, 1, 30, 400};
#define EACH_LINE(rate, rtt)                                                                                           \
    for (size_t rate = 0; rate < 4; rate++)                                                                            \
        for (size_t rtt = 0; rtt < 4; rtt++)

static void two_sizes_tell_the_rate(void **state)
{
    (void)state;
    EACH_LINE(i, k)
    {
        struct sim s = sim_of(rates[i], rtts_ms[k]);
        for (int n = 0; n < 120; n++) /* each second tells it: 0.75^60 of the first bound is left */
            alone(&s, n % 2 ? 6000 : 100000);
        assert_rate(&s, rates[i]);
    }
}

/* A frame alone says no more than that the line is at least so fast. */
static void one_size_is_a_bound(void **state)
{
    (void)state;
    EACH_LINE(i, k)
    {
        struct sim s = sim_of(rates[i], rtts_ms[k]);
        for (int n = 0; n < 5; n++)
            alone(&s, 50000);
        double bound = 50000 / (50000 / rates[i] + rtts_ms[k] * 1e-3);
        assert_rate(&s, bound);
    }
}

/* The next frame is sent when there are fewer than two without an answer. */
static void busy(struct sim *s, double bytes, int n_frames)
{
    double at[2] = {send(s, bytes), send(s, bytes)};
    for (int n = 0; n < n_frames; n++) {
        answer(s, s->seq - 1, at[0]);
        at[0] = at[1];
        at[1] = send(s, bytes);
    }
    answer(s, s->seq - 1, at[0]);
    answer(s, s->seq, at[1]);
}

static void a_busy_line_tells_its_rate(void **state)
{
    (void)state;
    EACH_LINE(i, k)
    {
        double bytes = 1.5 * rates[i] * rtts_ms[k] * 1e-3 + 20000; /* two of them fill the line */
        struct sim s = sim_of(rates[i], rtts_ms[k]);
        busy(&s, bytes, 30);
        assert_rate(&s, rates[i]);
    }
}

/* Whatever is sent: no frame comes sooner than the line lets it. */
static void it_is_never_thought_faster(void **state)
{
    (void)state;
    uint32_t random = 1;
    EACH_LINE(i, k)
    {
        struct sim s = sim_of(rates[i], rtts_ms[k]);
        for (int n = 0; n < 200; n++) {
            random = random * 1664525u + 1013904223u;
            double bytes = 100 + (double)(random >> 8) / 100;
            if (random & 0x80)
                busy(&s, bytes, (int)(random % 5));
            else
                alone(&s, bytes);
            assert_true(s.line.bytes_s <= rates[i] * 1.0001);
        }
        assert_true(s.line.bytes_s > 0.0);
    }
}

static double fraction(uint32_t *random)
{
    *random = *random * 1664525u + 1013904223u;
    return (double)(*random >> 8) / (1 << 24);
}

/* One answer in twenty comes up to 200 ms late, and those behind it with it: two frames on their way on a line of
 * 4 Mbit/s and 40 ms. Answers that come together do not make the line ten times as fast: what was late is in the time
 * before. That it is thought over three times as fast for one frame in fifty is more than what is seen. */
static void answers_that_come_together_do_not_mislead(void **state)
{
    (void)state;
    const double rate = 5e5;
    enum { FRAMES = 2000 };
    for (uint32_t seed = 1; seed <= 20; seed++) {
        struct sim s = sim_of(rate, 40);
        uint32_t random = seed, n_fast = 0, n_slow = 0;
        double at[2] = {send(&s, 20000), send(&s, 20000)}, last = 0.0;
        for (int n = 0; n < FRAMES; n++) {
            double late = fraction(&random) < 0.05 ? fraction(&random) * 200 * MS : 0.0;
            last = fmax(at[0] + late, last + 1000.0); /* in order */
            answer(&s, s.seq - 1, last);
            n_fast += s.line.bytes_s > 3 * rate;
            n_slow += s.line.bytes_s < rate / 3;
            at[0] = at[1];
            at[1] = send(&s, 8000 + 24000 * fraction(&random));
        }
        if (n_fast > FRAMES / 50 || n_slow > FRAMES / 10)
            fail_msg("seed %u: %u of %d frames were thought too fast, %u too slow", seed, n_fast, FRAMES, n_slow);
    }
}

/* Frames of one size, each alone, tell no more than a bound; what was known before is not believed for ever. */
static void bounds_alone_end_what_was_known(void **state)
{
    (void)state;
    struct sim s = sim_of(1e7, 10);
    busy(&s, 300000, 60);
    assert_rate(&s, 1e7);
    s.bytes_s = 1e5;
    s.now_ns += 1e9;
    s.line.soonest.ns = 0.0; /* none: they have one size */
    for (int n = 0; n < 15; n++)
        alone(&s, 5000);
    assert_rate(&s, 1e7);
    alone(&s, 5000);
    assert_rate(&s, 5000 / (5000 / 1e5 + 0.01));
    /* Few frames, over ten seconds. */
    s = sim_of(1e7, 10);
    busy(&s, 300000, 60);
    s.bytes_s = 1e5;
    s.line.soonest.ns = 0.0;
    s.now_ns += 5e9;
    alone(&s, 50000);
    assert_rate(&s, 1e7);
    s.now_ns += 5e9;
    alone(&s, 50000);
    assert_rate(&s, 50000 / (50000 / 1e5 + 0.01));
}

static void what_is_owed_takes_its_time(void **state)
{
    (void)state;
    struct sim s = sim_of(1e6, 0);
    assert_true(lum_line_owed_s(&s.line) == 0.0);
    send(&s, 50000);
    assert_true(lum_line_owed_s(&s.line) == 0.0); /* nothing is known of the line */
    answer(&s, 1, 50 * MS);
    assert_true(lum_line_owed_s(&s.line) == 0.0);
    send(&s, 200000);
    send(&s, 100000);
    assert_true(fabs(lum_line_owed_s(&s.line) - 0.3) < 1e-4);
}

/* Slow frames take the more of the time that is averaged: after n of them less than 2^-n of the difference is left. */
static void a_line_that_slows_down_is_noticed(void **state)
{
    (void)state;
    struct sim s = sim_of(1e7, 10);
    busy(&s, 300000, 20);
    s.bytes_s = 1e5;
    s.now_ns += 1e9;
    busy(&s, 300000, 5); /* the first of its seven answers is of a frame alone: a bound */
    assert_true(s.line.bytes_s <= 1e5 + 1e7 / 64 * 1.01);
    busy(&s, 300000, 20);
    assert_true(fabs(s.line.bytes_s - 1e5) < 100);
}

/* Four frames in a row that tell of more than twice the rate are all that is known then: the first, which was alone,
 * has the round trip in its time. Their times, of .03 s, would else be averaged with some of 3 s for twenty frames. */
static void a_line_that_grows_wide_is_noticed(void **state)
{
    (void)state;
    struct sim s = sim_of(1e5, 10);
    busy(&s, 300000, 20);
    s.bytes_s = 1e7;
    s.now_ns += 1e9;
    busy(&s, 300000, 2); /* four answers */
    assert_rate(&s, 4 * 300000 / (4 * 300000 / 1e7 + 0.01));
    busy(&s, 300000, 20);
    assert_true(fabs(s.line.bytes_s - 1e7) < 0.01 * 1e7);
}

/* A client that draws for 80 ms, and says so, has no slower line. */
static void what_the_client_held_is_not_the_lines(void **state)
{
    (void)state;
    struct sim honest = sim_of(1e6, 20), drawing = honest;
    for (int n = 0; n < 60; n++) {
        double bytes = n % 2 ? 10000 : 150000;
        alone(&honest, bytes);
        double at = send(&drawing, bytes) + 80 * MS;
        drawing.now_ns = at;
        lum_line_answer(&drawing.line, drawing.seq, (int64_t)(80 * MS), (int64_t)at);
        drawing.now_ns += 5 * MS;
    }
    assert_rate(&honest, 1e6);
    assert_rate(&drawing, 1e6);
    /* More than it can have been is not believed. */
    double before = drawing.line.bytes_s;
    double at = send(&drawing, 150000);
    lum_line_answer(&drawing.line, drawing.seq, (int64_t)(60000 * MS), (int64_t)at);
    assert_true(drawing.line.bytes_s == before);
}

/* An answer before the end, one that covers several, one that covers none, and a frame that has no end. */
static void odd_answers_do_no_harm(void **state)
{
    (void)state;
    struct lum_line line = {0};
    lum_line_answer(&line, 5, 0, 100);
    lum_line_begin(&line, 6, 1000);
    lum_line_add(&line, 100000, false);
    lum_line_answer(&line, 6, 0, 2000);
    assert_true(line.bytes_s == 0.0 && line.n == 0);
    lum_line_begin(&line, 7, 3000);
    lum_line_add(&line, 100000, false);
    lum_line_cut(&line);
    assert_int_equal(line.n, 0);
    lum_line_cut(&line);
    lum_line_begin(&line, 8, 10000000);
    lum_line_add(&line, 50000, true);
    lum_line_cut(&line); /* it has its end */
    lum_line_begin(&line, 9, 10000000);
    lum_line_add(&line, 50000, true);
    lum_line_answer(&line, 9, 0, 110000000); /* both: 100 000 bytes in 0.1 s */
    assert_true(fabs(line.bytes_s - 1e6) < 1.0);
    for (uint64_t seq = 10; seq < 20; seq++) { /* more than may be on their way */
        lum_line_begin(&line, seq, 200000000);
        lum_line_add(&line, 10, true);
    }
    assert_int_equal(line.n, LUM_LIMIT_UNACKED_FRAMES);
    lum_line_answer(&line, 100, 0, 300000000);
    assert_int_equal(line.n, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_sizes_tell_the_rate),
        cmocka_unit_test(one_size_is_a_bound),
        cmocka_unit_test(a_busy_line_tells_its_rate),
        cmocka_unit_test(it_is_never_thought_faster),
        cmocka_unit_test(answers_that_come_together_do_not_mislead),
        cmocka_unit_test(bounds_alone_end_what_was_known),
        cmocka_unit_test(what_is_owed_takes_its_time),
        cmocka_unit_test(a_line_that_slows_down_is_noticed),
        cmocka_unit_test(a_line_that_grows_wide_is_noticed),
        cmocka_unit_test(what_the_client_held_is_not_the_lines),
        cmocka_unit_test(odd_answers_do_no_harm),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
