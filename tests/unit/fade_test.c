/* Lamps that fade: each goes evenly from how it was shown to how it is, whatever happens on the way. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "server/world/fade.h"

#define N 3
#define S 1000000000ll

struct bed {
    struct lum_light lights[N]; /* as the document has them: c, a, b */
    struct lum_fade fade;
};

static struct lum_light_table table_of(const struct bed *b, uint32_t n)
{
    return (struct lum_light_table){.lights = b->lights, .n_lights = n};
}

static void set(struct bed *b, int i, float r, float g, float blue, bool on)
{
    b->lights[i] = (struct lum_light){.power = lum_rgb(r, g, blue), .on = on};
    snprintf(b->lights[i].id, sizeof b->lights[i].id, "%c", "cab"[i]);
}

static struct bed bed_of(float level)
{
    struct bed b = {0};
    for (int i = 0; i < N; i++)
        set(&b, i, level, level, level, true);
    return b;
}

/* An edit of the named lamps, which takes seconds: the table is as the document has them then. */
static void recall(struct bed *b, const struct lum_fading *shown, const char *names, int64_t at_s, int64_t seconds)
{
    const char *ids[N];
    char text[N][2];
    struct lum_light_table now = table_of(b, N);
    size_t n = strlen(names);
    for (size_t i = 0; i < n; i++) {
        text[i][0] = names[i];
        text[i][1] = '\0';
        ids[i] = text[i];
    }
    lum_fade_follow(&b->fade, &now);
    lum_fade_begin(&b->fade, shown, N, &now, ids, n, at_s * S, seconds * S);
}

static struct lum_fading *shown(const struct bed *b)
{
    struct lum_light_table table = table_of(b, N);
    struct lum_fading *all = lum_fade_shown(&b->fade, &table);
    assert_non_null(all);
    return all;
}

static void assert_shines(const struct bed *b, int i, float r, float g, float blue)
{
    struct lum_light l = b->lights[i];
    lum_fade_shine(&b->fade, &l);
    struct lum_rgb p = l.on ? l.power : lum_grey(0.0f);
    if (p.r != r || p.g != g || p.b != blue)
        fail_msg("%s: %g %g %g, not %g %g %g", l.id, (double)p.r, (double)p.g, (double)p.b, (double)r, (double)g,
                 (double)blue);
}

/* Each primary is linear in time; the ends are exact; a lamp that goes out shines until it has. */
static void light_is_linear_in_time(void **state)
{
    (void)state;
    struct bed b = bed_of(8.0f);
    set(&b, 2, 8.0f, 8.0f, 8.0f, false);
    struct lum_fading *was = shown(&b);
    set(&b, 0, 0.0f, 4.0f, 16.0f, true);
    set(&b, 1, 8.0f, 8.0f, 8.0f, false);
    set(&b, 2, 8.0f, 8.0f, 8.0f, true);
    recall(&b, was, "abc", 10, 4);
    assert_int_equal(b.fade.n, 3);
    for (int t = 0; t < 4; t++) {
        float x = (float)t;
        lum_fade_turn(&b.fade, (10 + t) * S);
        assert_shines(&b, 0, 8.0f - 2.0f * x, 8.0f - x, 8.0f + 2.0f * x);
        assert_shines(&b, 1, 8.0f - 2.0f * x, 8.0f - 2.0f * x, 8.0f - 2.0f * x);
        assert_shines(&b, 2, 2.0f * x, 2.0f * x, 2.0f * x);
    }
    lum_fade_turn(&b.fade, 14 * S);
    assert_int_equal(b.fade.n, 0);
    assert_shines(&b, 0, 0.0f, 4.0f, 16.0f);
    assert_shines(&b, 1, 0.0f, 0.0f, 0.0f);
    lum_free(was);
    lum_fade_finish(&b.fade);
}

static void only_named_lamps_that_change_fade(void **state)
{
    (void)state;
    struct bed b = bed_of(8.0f);
    struct lum_fading *was = shown(&b);
    set(&b, 0, 4.0f, 4.0f, 4.0f, true);
    set(&b, 1, 4.0f, 4.0f, 4.0f, true);
    recall(&b, was, "cb", 0, 4);
    assert_int_equal(b.fade.n, 1);
    assert_shines(&b, 0, 8.0f, 8.0f, 8.0f);
    assert_shines(&b, 1, 4.0f, 4.0f, 4.0f);
    assert_non_null(lum_fade_of(&b.fade, "c"));
    assert_null(lum_fade_of(&b.fade, "a"));
    lum_free(was);
    lum_fade_finish(&b.fade);
}

/* Another recall on the way begins where lamps are; those that it does not name keep their own time. */
static void another_recall_goes_on_from_there(void **state)
{
    (void)state;
    struct bed b = bed_of(8.0f);
    struct lum_fading *was = shown(&b);
    set(&b, 0, 0.0f, 0.0f, 0.0f, true);
    set(&b, 1, 0.0f, 0.0f, 0.0f, true);
    recall(&b, was, "ac", 0, 4);
    lum_free(was);
    lum_fade_turn(&b.fade, 2 * S);
    was = shown(&b);
    set(&b, 1, 8.0f, 8.0f, 8.0f, true);
    recall(&b, was, "a", 2, 4);
    assert_int_equal(b.fade.n, 2);
    assert_shines(&b, 0, 4.0f, 4.0f, 4.0f);
    assert_shines(&b, 1, 4.0f, 4.0f, 4.0f);
    lum_fade_turn(&b.fade, 3 * S);
    assert_shines(&b, 0, 2.0f, 2.0f, 2.0f);
    assert_shines(&b, 1, 5.0f, 5.0f, 5.0f);
    lum_fade_turn(&b.fade, 4 * S);
    assert_int_equal(b.fade.n, 1);
    lum_free(was);
    was = shown(&b);
    recall(&b, was, "a", 4, 0); /* at once, though nothing changes */
    assert_int_equal(b.fade.n, 0);
    assert_shines(&b, 1, 8.0f, 8.0f, 8.0f);
    lum_free(was);
    lum_fade_finish(&b.fade);
}

/* Undo, another's hand, removal: what is not on its way to where the document says any more leaves the fade. */
static void whoever_is_edited_or_gone_leaves(void **state)
{
    (void)state;
    struct bed b = bed_of(8.0f);
    struct lum_fading *was = shown(&b);
    for (int i = 0; i < N; i++)
        set(&b, i, 0.0f, 0.0f, 0.0f, true);
    recall(&b, was, "abc", 0, 4);
    lum_fade_turn(&b.fade, 2 * S);
    set(&b, 0, 3.0f, 3.0f, 3.0f, true);
    struct lum_light_table now = table_of(&b, 2); /* b is gone */
    lum_fade_follow(&b.fade, &now);
    assert_int_equal(b.fade.n, 1);
    assert_shines(&b, 0, 3.0f, 3.0f, 3.0f);
    assert_shines(&b, 1, 4.0f, 4.0f, 4.0f);
    assert_null(lum_fade_of(&b.fade, "b"));
    lum_free(was);
    lum_fade_finish(&b.fade);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(light_is_linear_in_time),
        cmocka_unit_test(only_named_lamps_that_change_fade),
        cmocka_unit_test(another_recall_goes_on_from_there),
        cmocka_unit_test(whoever_is_edited_or_gone_leaves),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
