/* Only what the scene calls for is simulated: for every method and every effect,
 *   (a) an effect that nothing calls for has counters of exactly 0,
 *   (b) its picture is bit for bit that of the same frame with the effect forced off ("compiled out" is realised as
 * forced off: both run without a trace of it), (d) at strength 0 (a lamp of power 0, matched glass, black surfaces, fog
 * without particles) the same holds, and the picture is that of the scene without it, (e) adding a glossy object
 * changes only pixels that can see it; and buffers exist for effects that are on only. (c), the count of instructions,
 * is tests/e2e/effects_ir_test.py. */
#include "tests/support/effects_room.h"
#include "tests/support/effort.h"

#include <stdatomic.h>

#include "core/cache/kind.h"
#include "core/pass/pass.h"

/* ---- memory: every lum_calloc of the renderer comes by here (linked with --wrap) ---- */

static _Atomic uint64_t allocated_bytes;

void *__real_lum_calloc(size_t n, size_t size);
void *__wrap_lum_calloc(size_t n, size_t size);
void *__wrap_lum_calloc(size_t n, size_t size)
{
    atomic_fetch_add(&allocated_bytes, n * size);
    return __real_lum_calloc(n, size);
}

/* ---- pictures ---- */

/* Large enough for a tile of the coarsest pattern to lie on the objects that reflect light. */
enum { W = 72, H = 48, N_PIXELS = W * H };

struct picture {
    struct lum_rgb *pixels;
    struct lum_pass_stats stats;                       /* of the last pass */
    struct lum_effect_stats effects[LUM_EFFECT_COUNT]; /* of all passes */
    uint64_t rays[LUM_RAY_KIND_COUNT];
    uint64_t bytes; /* allocated by the view */
};

/* Passes until the picture is complete. spp: methods that refine have a frame first, then samples, which blend in twos.
 */
static struct picture render(struct rig *r, const struct lum_method *method, uint32_t off, uint32_t spp)
{
    struct picture p = {0};
    rig_fresh_view(r);
    r->settings.method = method;
    r->settings.w = W;
    r->settings.h = H;
    r->settings.max_spp = spp;
    r->settings.effects_off = off;
    uint64_t before = atomic_load(&allocated_bytes);
    do {
        p.stats = rig_pass(r);
        for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
            p.rays[k] += p.stats.rays[k];
        for (int e = 0; e < LUM_EFFECT_COUNT; e++) {
            p.effects[e].rays += p.stats.effects[e].rays;
            p.effects[e].tiles += p.stats.effects[e].tiles;
            p.effects[e].ns += p.stats.effects[e].ns;
        }
    } while (!p.stats.complete);
    p.bytes = atomic_load(&allocated_bytes) - before;
    p.pixels = rig_picture(r);
    return p;
}

static struct picture render_room(enum lum_effect varied, enum strength strength, const struct lum_method *method,
                                  uint32_t off)
{
    struct rig r;
    rig_begin(&r, 2);
    effects_room_furnish(&r, &(struct effects_room){varied, strength});
    struct picture p = render(&r, method, off, 3);
    rig_end(&r);
    return p;
}

/* What is checked, and how much of it was wrong: everything is told, not only the first. */
struct place {
    const struct lum_method *method;
    enum lum_effect effect;
    const char *what;
    uint32_t n_failures;
};

#define FAIL_AT(at, ...)                                                                                               \
    do {                                                                                                               \
        print_error("%s, %s, %s: ", (at)->method->name, lum_effect_names[(at)->effect], (at)->what);                   \
        print_error(__VA_ARGS__);                                                                                      \
        print_error("\n");                                                                                             \
        (at)->n_failures++;                                                                                            \
    } while (0)

static void assert_no_trace(const struct picture *p, struct place *at)
{
    const struct lum_effect_stats *s = &p->effects[at->effect];
    if (p->stats.demand.on[at->effect])
        FAIL_AT(at, "called for: %s", p->stats.demand.why[at->effect]);
    if (s->rays || s->tiles || s->ns)
        FAIL_AT(at, "%llu rays, %llu tiles, %lld ns", (unsigned long long)s->rays, (unsigned long long)s->tiles,
                (long long)s->ns);
}

static size_t first_difference(const struct picture *a, const struct picture *b, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (memcmp(&a->pixels[i], &b->pixels[i], sizeof *a->pixels) != 0)
            return i;
    return n;
}

static void assert_same(const struct picture *a, const struct picture *b, struct place *at)
{
    size_t i = first_difference(a, b, N_PIXELS);
    if (i < N_PIXELS)
        FAIL_AT(at, "pixel %zu is %.9g, not %.9g", i, (double)a->pixels[i].g, (double)b->pixels[i].g);
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        if (a->rays[k] != b->rays[k])
            FAIL_AT(at, "%llu %s rays, not %llu", (unsigned long long)a->rays[k],
                    lum_ray_kind_name((enum lum_ray_kind)k), (unsigned long long)b->rays[k]);
    if (a->bytes != b->bytes)
        FAIL_AT(at, "%llu bytes, not %llu", (unsigned long long)a->bytes, (unsigned long long)b->bytes);
}

/* ---- (a), (b), (d) ---- */

/* Effects that may do without rays of their own: anti-aliasing shares those of all, gloss those of the lights it
 * reflects, and one that suits every method may need no more than what the eye sees. */
static bool may_share_rays(enum lum_effect e)
{
    return e == LUM_EFFECT_ANTIALIAS || e == LUM_EFFECT_GLOSSY || lum_effect_rows[e]->usual;
}

/* At full strength it costs rays and shows, if the method serves it: or the other checks would say nothing. */
static void assert_present(const struct picture *full, const struct picture *absent, struct place *at)
{
    if (!full->stats.demand.on[at->effect])
        FAIL_AT(at, "not called for: %s", full->stats.demand.why[at->effect]);
    if (!lum_method_serves(at->method, at->effect))
        return;
    if (!may_share_rays(at->effect) && full->effects[at->effect].rays == 0)
        FAIL_AT(at, "no rays");
    if (first_difference(full, absent, N_PIXELS) == N_PIXELS)
        FAIL_AT(at, "it does not show");
}

static uint32_t filled_by(const struct lum_estimator *e)
{
    return e->components | e->joins;
}

/* Bytes of the component buffers that the effect alone calls for. */
static uint64_t own_buffer_bytes(const struct lum_method *method, enum lum_effect effect)
{
    uint32_t own = lum_method_serves(method, effect) ? filled_by(lum_method_serves(method, effect)) : 0;
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (e != (int)effect && lum_method_serves(method, e))
            own &= ~filled_by(lum_method_serves(method, e));
    uint64_t n = 0;
    for (; own; own &= own - 1)
        n += N_PIXELS * 2 * sizeof(struct lum_rgb); /* raw and smooth */
    return n;
}

static uint32_t check_effect(const struct lum_method *method, enum lum_effect e)
{
    uint32_t bit = LUM_EFFECT_BIT(e);
    struct picture absent = render_room(e, STRENGTH_ABSENT, method, 0);
    struct picture absent_off = render_room(e, STRENGTH_ABSENT, method, bit);
    struct picture full = render_room(e, STRENGTH_FULL, method, 0);
    struct picture full_off = render_room(e, STRENGTH_FULL, method, bit);
    struct place at = {method, e, "absent", 0};
    assert_no_trace(&absent, &at);
    at.what = "absent and forced off";
    assert_no_trace(&absent_off, &at);
    assert_same(&absent_off, &absent, &at);
    at.what = "full";
    assert_present(&full, &absent, &at);
    /* Records that keep what panes leave are larger: fewer fit, and less is set aside to find them by. Without fog
     * mirrors keep what they show of indirect light (echo.h), which may be more than fog's buffers. */
    bool fewer_fit = e == LUM_EFFECT_TRANSMISSION && method->cache && method->cache->left;
    if (!fewer_fit && e != LUM_EFFECT_MEDIA && full.bytes < full_off.bytes + own_buffer_bytes(method, e))
        FAIL_AT(&at, "%llu bytes, %llu when it is off", (unsigned long long)full.bytes,
                (unsigned long long)full_off.bytes);
    at.what = "full, but forced off";
    assert_no_trace(&full_off, &at);
    if (e != LUM_EFFECT_ANTIALIAS) { /* a choice of the view, which has no strength */
        struct picture zero = render_room(e, STRENGTH_ZERO, method, 0);
        at.what = "strength 0";
        assert_no_trace(&zero, &at);
        if (first_difference(&zero, &absent, N_PIXELS) < N_PIXELS)
            FAIL_AT(&at, "pixel %zu differs", first_difference(&zero, &absent, N_PIXELS));
        lum_free(zero.pixels);
    }
    lum_free(absent.pixels);
    lum_free(absent_off.pixels);
    lum_free(full.pixels);
    lum_free(full_off.pixels);
    return at.n_failures;
}

static void absent_effects_leave_no_trace(void **state)
{
    (void)state;
    size_t n;
    uint32_t n_failures = 0;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t m = 0; m < n; m++)
        for (int e = 0; e < LUM_EFFECT_COUNT; e++)
            if ((m + (size_t)e) % TEST_STRIDE == 0) /* each method and each effect, but not each by each */
                n_failures += check_effect(&methods[m], (enum lum_effect)e);
    assert_int_equal(n_failures, 0);
}

/* ---- (e) ---- */

struct slab_box {
    double lo[3], hi[3];
};

/* Does o + t d, 0 <= t <= t_max, meet the box? */
static bool meets(const struct slab_box *box, const double o[3], const double d[3], double t_max)
{
    double t0 = 0.0, t1 = t_max;
    for (int k = 0; k < 3; k++) {
        if (d[k] == 0.0 && (o[k] < box->lo[k] || o[k] > box->hi[k]))
            return false;
        if (d[k] == 0.0)
            continue;
        double a = (box->lo[k] - o[k]) / d[k], b = (box->hi[k] - o[k]) / d[k];
        t0 = fmax(t0, fmin(a, b));
        t1 = fmin(t1, fmax(a, b));
    }
    return t0 <= t1;
}

/* Pixels that see the box, or look at a place of the floor from where it hides the bulb. The floor is the plane y = 0.
 */
static void mark_seeing(const struct rig *r, const struct slab_box *box, struct lum_vec3d bulb,
                        bool ret_seeing[N_PIXELS])
{
    const struct lum_vec3d eye = r->settings.camera.position;
    struct lum_eye e;
    RIG_OK(lum_eye_init(&e, &r->settings.camera, &(struct lum_normalisation){.scale = 1.0}, W, H, &err));
    for (uint32_t i = 0; i < N_PIXELS; i++) {
        struct lum_vec3 f = lum_eye_direction(&e, (float)(i % W) + 0.5f, (float)(i / W) + 0.5f);
        double o[3] = {eye.x, eye.y, eye.z}, d[3] = {(double)f.x, (double)f.y, (double)f.z};
        double t = d[1] < 0.0 ? -o[1] / d[1] : 1e9;
        double p[3] = {o[0] + t * d[0], 0.0, o[2] + t * d[2]};
        double to_bulb[3] = {bulb.x - p[0], bulb.y - p[1], bulb.z - p[2]};
        ret_seeing[i] = meets(box, o, d, t) || meets(box, p, to_bulb, 1.0);
    }
}

static bool any_within(const bool seeing[N_PIXELS], uint32_t x, uint32_t y, int reach)
{
    for (int j = (int)y - reach; j <= (int)y + reach; j++)
        for (int i = (int)x - reach; i <= (int)x + reach; i++)
            if (i >= 0 && j >= 0 && i < W && j < H && seeing[j * W + i])
                return true;
    return false;
}

/* Filters look this far: two windows of a pattern of 4 that follow each other. Without a pattern one pixel, for what
 * lies on the box's very edge. */
static int filter_reach(const struct lum_method *m)
{
    return m->pattern ? 2 * (int)m->pattern : 1;
}

/* Light by way of the floor is off: by it the whole floor sees the box. One sample: the weights of a blend are of
 * tiles, and would differ by an ulp far around. */
static void a_glossy_object_changes_what_sees_it(void **state)
{
    (void)state;
    const struct lum_vec3d at = {0.5, 0.25, -0.2}, bulb = {-1, 2, 0.5};
    const struct slab_box box = {{0.25 - 1e-4, -1e-4, -0.45 - 1e-4}, {0.75 + 1e-4, 0.5 + 1e-4, 0.05 + 1e-4}};
    size_t n_methods;
    const struct lum_method *methods = lum_methods(&n_methods);
    for (size_t m = 0; m < n_methods; m++) {
        struct rig r;
        rig_begin(&r, 2);
        struct lum_material_desc floor = rig_diffuse(0.7f), vase = rig_diffuse(0.4f);
        vase.roughness = 0.4f;
        vase.specular = 1.0f;
        rig_material(&r, "floor", &floor);
        rig_material(&r, "vase", &vase);
        rig_square(&r, "floor", 2.0);
        rig_box(&r, "item", 0.25, 0.25, 0.25);
        rig_object(&r, "floor", "floor", "floor", rig_v(0, 0, 0));
        rig_bulb(&r, "bulb", bulb, 60);
        rig_camera(&r, rig_v(0.2, 1.1, 2.6), rig_v(0, 0.4, -0.2), 45);
        r.settings.antialias = false;
        rig_commit(&r);
        uint32_t off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE), n_changed = 0;
        struct picture before = render(&r, &methods[m], off, 1);
        rig_object(&r, "vase", "item", "vase", at);
        rig_commit(&r);
        struct picture after = render(&r, &methods[m], off, 1);
        bool seeing[N_PIXELS];
        mark_seeing(&r, &box, bulb, seeing);
        for (uint32_t i = 0; i < N_PIXELS; i++) {
            if (memcmp(&before.pixels[i], &after.pixels[i], sizeof before.pixels[i]) == 0)
                continue;
            n_changed++;
            if (!any_within(seeing, i % W, i / W, filter_reach(&methods[m])))
                fail_msg("%s: pixel %u,%u does not see the object, but went from %.9g to %.9g", methods[m].name, i % W,
                         i / W, (double)before.pixels[i].g, (double)after.pixels[i].g);
        }
        assert_true(n_changed > 20);
        lum_free(before.pixels);
        lum_free(after.pixels);
        rig_end(&r);
    }
}

/* ---- path tracing leaves out exactly what it is told to ---- */

enum { N_SEEDS = TEST_EFFORT(12) };

/* Mean luminance of the picture and its standard error, from pictures of different seeds. */
static double mean_of_seeds(struct rig *r, uint32_t off, double *ret_error)
{
    double sum = 0.0, squares = 0.0;
    for (uint32_t seed = 0; seed < N_SEEDS; seed++) {
        r->settings.seed = seed;
        struct picture p = render(r, lum_method_find("path"), off, 16);
        lum_free(p.pixels);
        double mean = (double)lum_luminance(rig_mean(r));
        sum += mean;
        squares += mean * mean;
    }
    double mean = sum / N_SEEDS;
    *ret_error = sqrt(fmax(squares / N_SEEDS - mean * mean, 0.0) / (N_SEEDS - 1));
    return mean;
}

/* With one bounce there is no light but the lamp's own, and no lobe that paths do not go on by may change it: what its
 * samples carried, light sampling carries. Five standard errors of the difference. */
static void direct_light_does_not_depend_on_lobes(void **state)
{
    (void)state;
    static const float roughness[] = {0.0f, 0.3f, 0.8f}, metallic[] = {0.0f, 0.5f, 1.0f};
    const uint32_t diffuse = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE), gloss = LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY);
    const uint32_t offs[] = {diffuse, gloss, diffuse | gloss};
    for (size_t k = 0; k < LUM_ARRAY_LEN(roughness); k++) {
        struct rig r;
        rig_begin(&r, 2);
        struct lum_material_desc m = rig_diffuse(0.6f);
        m.specular = 1.0f;
        m.roughness = roughness[k];
        m.metallic = metallic[k];
        rig_material(&r, "floor", &m);
        rig_square(&r, "floor", 2.0);
        rig_object(&r, "floor", "floor", "floor", rig_v(0, 0, 0));
        struct lum_light_desc panel = rig_quad(rig_v(0, 1.5, -0.5), rig_v(1, 0, 0), rig_v(0, 0, 1), 90.0);
        rig_light(&r, "panel", &panel);
        rig_camera(&r, rig_v(0.2, 1.1, 2.6), rig_v(0, 0.4, -0.2), 45);
        r.settings.max_depth = 1;
        rig_commit(&r);
        double error, error_off, all = mean_of_seeds(&r, 0, &error);
        for (size_t i = 0; i < LUM_ARRAY_LEN(offs); i++) {
            double part = mean_of_seeds(&r, offs[i], &error_off), tolerance = 5.0 * hypot(error, error_off);
            if (TEST_TELLS && !(fabs(part - all) <= tolerance))
                fail_msg("roughness %g, effects_off %x: %.6f, not %.6f +- %.6f", (double)roughness[k], offs[i], part,
                         all, tolerance);
        }
        rig_end(&r);
    }
}

/* One lamp without size, no mirror: without the light of surfaces both methods add up the same terms, pixel by pixel.
 */
static void without_indirect_light_path_is_whitted(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    effects_room_furnish(&r, &(struct effects_room){LUM_EFFECT_INDIRECT_DIFFUSE, STRENGTH_FULL});
    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "panel", &err));
    RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "sky", &err));
    struct lum_material_desc m = rig_diffuse(0.5f);
    m.specular = 1.0f;
    m.roughness = 0.5f;
    rig_material(&r, "crate", &m);
    rig_commit(&r);
    uint32_t off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE) | LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY) |
                   LUM_EFFECT_BIT(LUM_EFFECT_ANTIALIAS);
    struct picture whitted = render(&r, lum_method_find("whitted"), 0, 1);
    struct picture path = render(&r, lum_method_find("path"), off, 1);
    for (uint32_t i = 0; i < N_PIXELS; i++) {
        /* both round a few products of floats, each by 2^-24 */
        float want = whitted.pixels[i].g, got = path.pixels[i].g;
        if (!(fabsf(got - want) <= 1e-6f * want))
            fail_msg("pixel %u: %.9g, not %.9g", i, (double)got, (double)want);
    }
    lum_free(whitted.pixels);
    lum_free(path.pixels);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(absent_effects_leave_no_trace),
        cmocka_unit_test(a_glossy_object_changes_what_sees_it),
        cmocka_unit_test(direct_light_does_not_depend_on_lobes),
        cmocka_unit_test(without_indirect_light_path_is_whitted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
