/* What must not matter does not (NOTES H2, H3, H4, H7, H8, H36, H38): one scene that calls for every effect, told
 * in other ways - elsewhere, in other units, in another order, by other numbers of threads, with other kernels - makes
 * the same picture by every method; bit for bit, unless said. rig_pass asserts that no sample was dropped and no ray
 * refused. */
#include "core/cache/kind.h"
#include "core/effect/ais/ais.h"
#include "tests/support/effort.h"
#include "tests/support/rig.h"

/* A way to tell the scene. */
struct telling {
    const char *what;
    double scale;           /* of all lengths; what is per length follows */
    struct lum_vec3d shift; /* then moved */
    bool backwards;         /* lights, objects, media in the opposite order */
    bool flipped;           /* every winding turned round */
    bool junk;              /* meshes have triangles that are none */
    bool rounded;           /* what rays meet differs in the last bits: no face coincides with another (put_things) */
    uint32_t threads;
    const char *isa; /* NULL: the one that is tested */
};

static const struct telling plain = {.what = "plain", .scale = 1.0, .threads = 2};

static struct lum_vec3d place(const struct telling *t, double x, double y, double z)
{
    return rig_v(x * t->scale + t->shift.x, y * t->scale + t->shift.y, z * t->scale + t->shift.z);
}

/* A closed box around the origin. */
static void put_box(struct rig *r, const struct telling *t, const char *id, struct lum_vec3d half)
{
    const uint32_t indices[36] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                  2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
    double p[27];
    uint32_t list[48], n = 0;
    for (int k = 0; k < 8; k++) {
        p[3 * k] = (k & 1 ? half.x : -half.x) * t->scale;
        p[3 * k + 1] = (k & 2 ? half.y : -half.y) * t->scale;
        p[3 * k + 2] = (k & 4 ? half.z : -half.z) * t->scale;
    }
    p[24] = p[25] = p[26] = NAN;
    const uint32_t junk[12] = {0, 0, 0, 1, 2, 1, 3, 4, 8, 5, 6, 99}; /* a point, a line, not a number, no such vertex */
    for (uint32_t k = 0; k < 36; k++) {
        if (t->junk && k == 18)
            for (uint32_t j = 0; j < 12; j++)
                list[n++] = junk[j];
        list[n++] = indices[t->flipped && k % 3 ? k / 3 * 3 + 3 - k % 3 : k];
    }
    rig_mesh(r, id, p, t->junk ? 9 : 8, list, n / 3);
}

/* Where rounding may decide nothing may be a tie, as things that stand on a floor are: through the pane a ray meets the
 * pane's underside and the floor at one distance. Then all are lifted, each by another height, and shifted off the
 * lines of the others' faces. */
static void put_things(struct rig *r, const struct telling *t)
{
    struct lum_material_desc white = rig_diffuse(0.75f), red = rig_diffuse(0.5f), mirror = lum_material_default(),
                             pane = lum_material_default(), vase = rig_diffuse(0.4f);
    red.base_color = lum_rgb(0.6f, 0.05f, 0.05f);
    mirror.metallic = 1.0f;
    mirror.roughness = 0.0f;
    pane.transmission = 1.0f;
    pane.roughness = 0.0f;
    pane.thin = true;
    pane.base_color = lum_rgb(0.6f, 0.9f, 0.7f);
    vase.specular = 1.0f;
    vase.roughness = 0.4f;
    const struct {
        const char *id;
        struct lum_material_desc m;
        struct lum_vec3d half, at;
    } rows[] = {
        {"wall", white, {2, 0.0625, 2}, {0, -0.0625, 0}},
        {"back", white, {2, 1, 0.0625}, {0, 1, -1.5}},
        {"crate", red, {0.25, 0.25, 0.25}, {0.25, 0.25, -0.5}},
        {"twin", white, {0.25, 0.25, 0.25}, {0.375, 0.25, -0.5}}, /* its front lies in the crate's */
        {"mirror", mirror, {0.25, 0.375, 0.25}, {-0.75, 0.375, -0.5}},
        {"pane",
         pane,
         {0.25, 0.25, 0.0625},
         {0, 0.3125, 0.5}}, /* clear of the floor: what it lets through shows there */
        {"vase", vase, {0.125, 0.25, 0.125}, {0.8125, 0.25, 0.25}},
    };
    for (size_t k = 0; k < LUM_ARRAY_LEN(rows); k++) {
        size_t i = t->backwards ? LUM_ARRAY_LEN(rows) - 1 - k : k;
        if (t->rounded && strcmp(rows[i].id, "twin") == 0)
            continue;
        rig_material(r, rows[i].id, &rows[i].m);
        put_box(r, t, rows[i].id, rows[i].half);
        double gap = t->rounded ? 0.01 * (double)(i + 1) : 0.0;
        rig_object(r, rows[i].id, rows[i].id, rows[i].id,
                   place(t, rows[i].at.x + gap / 7.0, rows[i].at.y + gap, rows[i].at.z + gap / 3.0));
    }
}

static void put_lights(struct rig *r, const struct telling *t)
{
    const double s = t->scale;
    const struct lum_light_desc rows[] = {
        rig_point(place(t, -1, 1.75, 0.5), 40 * s * s),
        rig_point(place(t, 0.5, 1.25, 1), 10 * s * s),
        rig_quad(place(t, 0.5, 2, 0), rig_v(0.5 * s, 0, 0), rig_v(0, 0, 0.5 * s), 90),
        {.kind = &lum_light_kind_sphere,
         .position = place(t, -0.5, 1.5, -0.75),
         .radius_m = 0.125 * s,
         .color = lum_grey(1),
         .intensity = 80,
         .on = true,
         .camera_visible = true},
        {.kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 2, .on = true, .camera_visible = true},
    };
    const char *ids[] = {"bulb", "candle", "panel", "ball", "sky"};
    for (size_t k = 0; k < LUM_ARRAY_LEN(rows); k++) {
        size_t i = t->backwards ? LUM_ARRAY_LEN(rows) - 1 - k : k;
        rig_light(r, ids[i], &rows[i]);
    }
}

static void put_media(struct rig *r, const struct telling *t)
{
    for (int k = 0; k < 2; k++) {
        bool mist = (k == 1) != t->backwards;
        struct lum_medium_desc d = {.sigma_s = lum_grey((float)(0.125 / t->scale)),
                                    .sigma_a = lum_grey((float)(0.03125 / t->scale)),
                                    .g = mist ? 0.5f : 0.0f,
                                    .lo = place(t, mist ? -0.5 : -1.5, 0, -1.25),
                                    .hi = place(t, 1.5, mist ? 0.75 : 1, 1)};
        RIG_OK(lum_scene_put_medium(r->scene, mist ? "mist" : "fog", &d, &err));
    }
}

static void begin(struct rig *r, const struct telling *t)
{
    rig_begin_on(r, t->threads, t->isa ? t->isa : test_isa());
    if (t->backwards)
        put_lights(r, t);
    put_media(r, t);
    put_things(r, t);
    if (!t->backwards)
        put_lights(r, t);
    rig_camera(r, place(t, 0.1875, 1.125, 2.625), place(t, 0, 0.4375, -0.1875), 45);
    r->settings.n_vpls = 64;
    r->settings.shadow_samples = 4;
    rig_commit(r);
}

/* All passes of a picture: a fast frame is followed by samples where the method takes them. */
static struct lum_rgb *render_on(struct rig *r, const struct lum_method *method)
{
    r->settings.method = method;
    r->settings.max_spp = 2;
    while (!rig_pass(r).complete)
        continue;
    assert_true(rig_mean(r).g > 0.0f);
    return rig_picture(r);
}

static struct lum_rgb *render(struct rig *r, const struct lum_method *method)
{
    rig_fresh_view(r);
    return render_on(r, method);
}

/* Pictures of two tellings by a method. */
typedef void compare(const char *what, const struct lum_rgb *want, const struct lum_rgb *got, uint32_t n);

static void same_bits(const char *what, const struct lum_rgb *want, const struct lum_rgb *got, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        if (memcmp(&want[i], &got[i], sizeof *want) != 0)
            fail_msg("%s: pixel %u is %.9g %.9g %.9g, not %.9g %.9g %.9g", what, i, (double)got[i].r, (double)got[i].g,
                     (double)got[i].b, (double)want[i].r, (double)want[i].g, (double)want[i].b);
}

/* Hits that differ in the last of 24 bits move every value by some 1e-6, far below 1e-4. But a ray that passes that
 * near to an edge may meet something else, and its path forks. How many do: in 4 m hits are off by 1e-6 m; all edges
 * together are 40 m long and are seen on 10 m2, so that 2 * 1e-6 * 40 / 10 of all rays pass so near, of at most 1e5
 * that a picture takes: 0.8, and more than 4 once in 700 pictures. Filters spread one over 9 pixels, so 36 may be
 * others. What these change: both of a forked pixel's values are draws of the same light, so that their difference has
 * a mean of 0 and at most twice the mean square of a draw; three deviations of the sum. */
static void same_but_at_edges(const char *what, const struct lum_rgb *want, const struct lum_rgb *got, uint32_t n)
{
    uint32_t n_others = 0;
    double sum = 0.0, squares = 0.0, change = 0.0;
    for (uint32_t i = 0; i < n; i++) {
        double x = (double)want[i].g, y = (double)got[i].g;
        n_others += !(fabs(x - y) <= 1e-4 * x);
        sum += x;
        squares += x * x;
        change += y - x;
    }
    double forked = 3.0 * sqrt(2.0 * n_others * squares / n);
    if (n_others > 36 || !(fabs(change) <= 1e-4 * sum + forked))
        fail_msg("%s: %u of %u pixels differ, the mean by %g", what, n_others, n, change / sum);
}

/* Records of `irrcache` sample the hemisphere with numbers that are drawn from where they lie, to the last bit: 64
 * rays, each of a deviation of twice its mean at most, are off by 1/4, and some 100 records by 2.5 %; three times that.
 * Those of `live` draw 128 VPLs and more by the cell of space that they are in, which another scale cuts elsewhere;
 * less. */
static void same_on_the_whole(const char *what, const struct lum_rgb *want, const struct lum_rgb *got, uint32_t n)
{
    double sum = 0.0, change = 0.0;
    for (uint32_t i = 0; i < n; i++) {
        sum += (double)want[i].g;
        change += (double)got[i].g - (double)want[i].g;
    }
    if (!(fabs(change) <= 0.075 * sum))
        fail_msg("%s: the mean differs by %g", what, change / sum);
}

static void by_every_method(const struct telling *first, const struct telling *second, compare *check)
{
    struct rig a, b;
    begin(&a, first);
    begin(&b, second);
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t m = strlen(second->what) % TEST_STRIDE; m < n; m += TEST_STRIDE) { /* each telling by others */
        /* listing 5.4 compares with one metre, whatever the size of the scene (NOTES R3): its guidance alone may differ
         */
        bool in_metres = methods[m].ais && methods[m].ais->adaptive && second->scale != 1.0;
        a.settings.effects_off = b.settings.effects_off = in_metres ? LUM_EFFECT_BIT(LUM_EFFECT_MEDIA) : 0;
        /* so does the metric of 6.2.5, which places all records (NOTES R2) */
        if ((methods[m].cache == &lum_cache_instant || methods[m].cache == &lum_cache_temporal) && second->scale != 1.0)
            continue;
        char what[80];
        snprintf(what, sizeof what, "%s, %s", methods[m].name, second->what);
        struct lum_rgb *want = render(&a, &methods[m]), *got = render(&b, &methods[m]);
        bool drawn =
            methods[m].cache == &lum_cache_irradiance || (methods[m].cache == &lum_cache_live && second->scale != 1.0);
        drawn = drawn && check == same_but_at_edges;
        (drawn ? same_on_the_whole : check)(what, want, got, a.settings.w * a.settings.h);
        lum_free(want);
        lum_free(got);
    }
    rig_end(&a);
    rig_end(&b);
}

static void assert_same(const struct telling *t)
{
    by_every_method(&plain, t, same_bits);
}

static void assert_alike(struct telling *t)
{
    struct telling first = plain;
    first.rounded = t->rounded = true;
    by_every_method(&first, t, same_but_at_edges);
}

static void scaled_by_powers_of_two(void **state)
{
    (void)state;
    for (int k = -20; k <= 12; k += 32) {
        struct telling t = plain;
        t.scale = exp2(k);
        t.what = k == -20 ? "scaled by 2^-20" : "scaled by 2^12";
        assert_same(&t);
    }
}

static void scaled_by_thousand(void **state)
{
    (void)state;
    struct telling t = plain;
    t.scale = 1e3;
    t.what = "scaled by 1000";
    assert_alike(&t);
}

static void moved(void **state)
{
    (void)state;
    struct telling t = plain;
    t.what = "moved";
    t.shift = rig_v(0x1p20, -0x1p18, 3 * 0x1p19);
    assert_same(&t);
}

static void told_backwards(void **state)
{
    (void)state;
    struct telling t = plain;
    t.what = "lights and objects in the opposite order";
    t.backwards = true;
    assert_same(&t);
}

/* A hit is blended from the corners in another order, so that its last bits differ. */
static void flipped(void **state)
{
    (void)state;
    struct telling t = plain;
    t.what = "windings flipped";
    t.flipped = true;
    assert_alike(&t);
}

static void with_junk(void **state)
{
    (void)state;
    struct telling t = plain;
    t.what = "with triangles that are none";
    t.junk = true;
    assert_same(&t);
}

static void by_any_number_of_threads(void **state)
{
    (void)state;
    const uint32_t counts[] = {1, 3, 7, 16};
    for (size_t k = 0; k < LUM_ARRAY_LEN(counts); k++) {
        struct telling t = plain;
        t.what = "other number of threads";
        t.threads = counts[k];
        assert_same(&t);
    }
}

/* Kernels of other instruction sets round differently: nothing else may come of it. Compared with sse4.2, which all
 * processors have; `.ci/run` repeats all of this with avx2. */
static void by_other_kernels(void **state)
{
    (void)state;
    struct telling t = plain;
    t.what = "traced by sse4.2";
    t.isa = "sse4.2";
    assert_alike(&t);
}

/* A picture has no memory of what was there before: edits, each followed by a frame in the same view, and then undone,
 * leave the bits of a view that saw none of them (NOTES H42: nothing that once was in a buffer can come back). */
static void after_edits(void **state)
{
    (void)state;
    struct rig r;
    begin(&r, &plain);
    const struct lum_camera camera = r.settings.camera;
    struct lum_light_desc sun = {.kind = &lum_light_kind_directional,
                                 .direction = {1, -2, -1},
                                 .color = lum_grey(1),
                                 .intensity = 20,
                                 .on = true};
    struct lum_material_desc clay = rig_diffuse(0.2f);
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t m = 0; m < n; m++) {
        if (methods[m].cache && methods[m].cache->lasting)
            continue; /* records lie where the edited scene wanted them */
        struct lum_rgb *want = render(&r, &methods[m]);
        rig_object(&r, "crate", "crate", "crate", rig_v(0.25, 0.75, -0.5));
        rig_commit(&r);
        lum_free(render_on(&r, &methods[m]));
        rig_material(&r, "wall", &clay);
        rig_commit(&r);
        lum_free(render_on(&r, &methods[m]));
        rig_light(&r, "sun", &sun);
        rig_commit(&r);
        lum_free(render_on(&r, &methods[m]));
        rig_camera(&r, rig_v(1, 1.5, 2), rig_v(0, 0.5, 0), 60);
        lum_free(render_on(&r, &methods[m]));
        r.settings.camera = camera;
        RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "sun", &err));
        put_things(&r, &plain);
        rig_commit(&r);
        struct lum_rgb *got = render_on(&r, &methods[m]);
        same_bits(methods[m].name, want, got, r.settings.w * r.settings.h);
        lum_free(got);
        lum_free(want);
    }
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scaled_by_powers_of_two),
        cmocka_unit_test(scaled_by_thousand),
        cmocka_unit_test(moved),
        cmocka_unit_test(told_backwards),
        cmocka_unit_test(flipped),
        cmocka_unit_test(with_junk),
        cmocka_unit_test(by_any_number_of_threads),
        cmocka_unit_test(by_other_kernels),
        cmocka_unit_test(after_edits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
