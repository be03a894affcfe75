/* Pictures at the edge of what is allowed, by every method: sizes that no tile or pattern divides, scenes without
 * lights or objects, a camera inside a wall, fog that touches the eye, lights inside of things, in their surfaces,
 * without power or area, glass that does not bend (NOTES H13, H14, H15, H19, H40, H41). Everything is finite
 * (rig_pass asserts that no sample was dropped and no ray refused), every pixel has its samples, and counters say what
 * was done. */
#include "tests/support/effects_room.h"
#include "tests/support/effort.h"

struct odd {
    struct rig r;
    const struct lum_method *method;
    const char *what;
    uint64_t rays[LUM_RAY_KIND_COUNT]; /* of all passes of the last picture */
    uint32_t n_passes;
};

static void begin(struct odd *o, const struct lum_method *method)
{
    rig_begin(&o->r, 2);
    o->method = o->r.settings.method = method;
    o->r.settings.max_spp = 3;
    o->r.settings.n_vpls = 32;
}

/* A complete picture; the brightest component of any pixel. */
static float render(struct odd *o, const char *what)
{
    struct rig *r = &o->r;
    struct lum_pass_stats stats;
    float brightest = 0.0f;
    o->what = what;
    memset(o->rays, 0, sizeof o->rays);
    o->n_passes = 0;
    rig_fresh_view(r);
    do {
        stats = rig_pass(r);
        o->n_passes++;
        for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
            o->rays[k] += stats.rays[k];
    } while (!stats.complete);
    for (uint32_t y = 0; y < r->settings.h; y++)
        for (uint32_t x = 0; x < r->settings.w; x++) {
            struct lum_rgb c = lum_film_mean(lum_view_film(r->view), x, y);
            if (!(isfinite(c.r) && isfinite(c.g) && isfinite(c.b) && c.r >= 0.0f && c.g >= 0.0f && c.b >= 0.0f))
                fail_msg("%s, %s: pixel %u,%u is %g %g %g", o->method->name, what, x, y, (double)c.r, (double)c.g,
                         (double)c.b);
            brightest = fmaxf(brightest, lum_rgb_max(c));
        }
    /* one primary ray for each pixel of a frame, one for each sample of path tracing */
    uint64_t pixels = (uint64_t)r->settings.w * r->settings.h;
    if (o->rays[LUM_RAY_PRIMARY] != pixels * o->n_passes)
        fail_msg("%s, %s: %llu primary rays in %u passes of %llu pixels", o->method->name, what,
                 (unsigned long long)o->rays[LUM_RAY_PRIMARY], o->n_passes, (unsigned long long)pixels);
    return brightest;
}

static void assert_idle(const struct odd *o)
{
    for (int k = LUM_RAY_PRIMARY + 1; k < LUM_RAY_KIND_COUNT; k++)
        if (o->rays[k] && k != LUM_RAY_ANTIALIAS)
            fail_msg("%s, %s: %llu %s rays", o->method->name, o->what, (unsigned long long)o->rays[k],
                     lum_ray_kind_name((enum lum_ray_kind)k));
}

static void sizes(struct odd *o)
{
    static const uint32_t rows[][2] = {{1, 1}, {1, 7}, {7, 1}, {2, 2}, {3, 50}, {17, 1}, {49, 47}, {97, 5}};
    effects_room_furnish(&o->r, &(struct effects_room){LUM_EFFECT_DIRECT, STRENGTH_FULL});
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        char what[32];
        snprintf(what, sizeof what, "%u x %u", rows[i][0], rows[i][1]);
        o->r.settings.w = rows[i][0];
        o->r.settings.h = rows[i][1];
        assert_true(render(o, what) > 0.0f);
    }
}

static void no_lights(struct odd *o)
{
    rig_room(&o->r);
    rig_commit(&o->r);
    assert_true(render(o, "no light") == 0.0f);
    assert_idle(o);
}

static void no_objects(struct odd *o)
{
    rig_commit(&o->r);
    assert_true(render(o, "nothing at all") == 0.0f);
    assert_idle(o);
    rig_bulb(&o->r, "bulb", rig_v(0, 2, 0), 50);
    rig_commit(&o->r);
    assert_true(render(o, "a bulb alone") == 0.0f);
    assert_idle(o);
    struct lum_light_desc sky = {
        .kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 3, .on = true, .camera_visible = true};
    rig_light(&o->r, "sky", &sky);
    rig_commit(&o->r);
    assert_true(fabsf(render(o, "sky and a bulb") - 3.0f) <= 3e-6f);
    assert_idle(o);
}

/* Closed, and all lights are outside: black. Its own surface, from inside. */
static void inside_a_wall(struct odd *o)
{
    effects_room_furnish(&o->r, &(struct effects_room){LUM_EFFECT_INDIRECT_DIFFUSE, STRENGTH_FULL});
    rig_camera(&o->r, rig_v(0.3, 0.25, -0.6), rig_v(2, 0.3, 0), 60);
    assert_true(render(o, "camera inside a box") == 0.0f);
    for (int k = -1; k <= 1; k++) {
        rig_camera(&o->r, rig_v(0.3, k * 1e-7, 0.5), rig_v(2, 0.0, 0), 60);
        render(o, "camera in the floor, or beside it");
    }
    rig_camera(&o->r, rig_v(-1, 2, 0.5), rig_v(0, 0, 0), 60);
    render(o, "camera at the bulb");
}

static void fog(struct odd *o, struct lum_vec3d lo, struct lum_vec3d hi, bool everywhere, const char *what)
{
    struct lum_medium_desc d = {.sigma_s = lum_grey(0.2f), .everywhere = everywhere, .lo = lo, .hi = hi};
    RIG_OK(lum_scene_put_medium(o->r.scene, "fog", &d, &err));
    rig_commit(&o->r);
    assert_true(render(o, what) > 0.0f);
}

static void touching_fog(struct odd *o)
{
    effects_room_furnish(&o->r, &(struct effects_room){LUM_EFFECT_DIRECT, STRENGTH_FULL});
    const double z = o->r.settings.camera.position.z;
    fog(o, rig_v(-2, 0, -2), rig_v(2, 2, z), false, "fog up to the eye");
    fog(o, rig_v(-2, 0, -2), rig_v(2, 2, nextafter(z, 9)), false, "fog just past the eye");
    fog(o, rig_v(-2, 0, -2), rig_v(2, 2, nextafter(z, 0)), false, "fog just before the eye");
    fog(o, rig_v(-2, 0, z), rig_v(2, 2, z + 1), false, "fog behind the eye");
    fog(o, rig_v(-2, 1.1, -2), rig_v(2, 2, 9), false, "a layer that begins at the eye");
    fog(o, rig_v(-9, -9, -9), rig_v(9, 9, 9), false, "fog around everything");
    fog(o, rig_v(0, 0, 0), rig_v(0, 0, 0), true, "fog everywhere");
}

static const struct lum_light_desc lamps[] = {
    {.kind = &lum_light_kind_point, .intensity = 90},
    {.kind = &lum_light_kind_spot, .direction = {1, -2, 0}, .outer_cone_rad = 0.5, .intensity = 90},
    {.kind = &lum_light_kind_quad, .u = {0.1, 0, 0}, .v = {0, 0, 0.1}, .intensity = 900},
    {.kind = &lum_light_kind_disc, .direction = {0, -1, 0}, .radius_m = 0.1, .intensity = 900},
    {.kind = &lum_light_kind_sphere, .radius_m = 0.1, .intensity = 900},
};

static void put_lamp(struct odd *o, size_t k, struct lum_vec3d at, double share)
{
    struct lum_light_desc lamp = lamps[k];
    lamp.position = at;
    lamp.intensity *= share;
    lamp.color = lum_grey(1);
    lamp.on = lamp.camera_visible = true;
    rig_light(&o->r, "lamp", &lamp);
    rig_commit(&o->r);
}

/* Shut in, in the crate of a room, seen from the room. */
static void shut_in(struct odd *o)
{
    rig_room(&o->r);
    for (size_t k = 0; k < LUM_ARRAY_LEN(lamps); k++) {
        put_lamp(o, k, rig_v(0.55, 0.45, -0.35), 1.0);
        assert_true(render(o, "a lamp inside a box") == 0.0f);
    }
}

/* In the top of the crate and in a corner of it; as near beside them as numbers lie; and where the eye looks. */
static void in_a_surface(struct odd *o)
{
    rig_room(&o->r);
    const struct lum_vec3d places[] = {{0.5, 1, -0.4}, {0.5, nextafter(1, 2), -0.4}, {0.5, nextafter(1, 0), -0.4},
                                       {0.9, 1, 0},    {0.5, 1 + 1e-7, -0.4},        {0.5, 1 - 1e-7, -0.4}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(lamps); k++)
        for (size_t i = 0; i < LUM_ARRAY_LEN(places); i++) {
            put_lamp(o, k, places[i], 1.0);
            render(o, "a lamp in a surface");
        }
    o->r.settings.w = o->r.settings.h = 1;
    rig_camera(&o->r, rig_v(0.5, 2, -0.4), rig_v(0.5, 1, -0.4), 20);
    put_lamp(o, 0, places[0], 1.0);
    render(o, "a lamp in the only point that is seen");
}

/* So far away that the room is a speck beside the distance. */
static void far_away(struct odd *o)
{
    rig_room(&o->r);
    for (double far = 1e5; far <= 1e9; far *= 10.0) {
        for (size_t k = 0; k < LUM_ARRAY_LEN(lamps); k++) {
            put_lamp(o, k, rig_v(far, far, far), 1.0);
            render(o, "a lamp far away");
        }
        rig_box(&o->r, "moon", 0.5, 0.5, 0.5);
        rig_diffuse_object(&o->r, "moon", "dust", 0.5f, rig_v(-far, far, 0));
        rig_commit(&o->r);
        render(o, "a box far away, too");
    }
}

/* Without power, or without area: not one ray but the eye's. */
static void without_strength(struct odd *o)
{
    struct lum_error err;
    rig_room(&o->r);
    for (size_t k = 0; k < LUM_ARRAY_LEN(lamps); k++) {
        put_lamp(o, k, rig_v(0, 2, 0.5), 0.0);
        assert_true(render(o, "a lamp without power") == 0.0f);
        assert_idle(o);
        struct lum_light_desc flat = lamps[k];
        flat.u = flat.v;
        flat.radius_m = 0.0;
        flat.color = lum_grey(1);
        if (flat.kind != &lum_light_kind_point && flat.kind != &lum_light_kind_spot)
            assert_int_equal(lum_scene_put_light(o->r.scene, "flat", &flat, &err), LUM_ERR_INVALID);
    }
    const double line[] = {0, 1, 0, 1, 1, 0, 2, 1, 0};
    const uint32_t indices[] = {0, 1, 2, 1, 1, 1};
    struct lum_material_desc glow = rig_diffuse(0.5f);
    glow.emission_cd_m2 = 1e6;
    rig_material(&o->r, "glow", &glow);
    rig_mesh(&o->r, "line", line, 3, indices, 2);
    rig_object(&o->r, "line", "line", "glow", rig_v(0, 0, 0));
    rig_commit(&o->r);
    assert_true(render(o, "a mesh without area that shines") == 0.0f);
    assert_idle(o);
}

/* A solid of the index around it is not there. */
static void without_refraction(struct odd *o)
{
    rig_room(&o->r);
    put_lamp(o, 4, rig_v(-0.5, 2, 0.5), 1.0);
    render(o, "an empty room");
    struct lum_rgb *empty = rig_picture(&o->r);
    struct lum_material_desc matched = lum_material_default();
    matched.transmission = 1.0f;
    matched.roughness = 0.0f;
    matched.ior = 1.0f;
    rig_material(&o->r, "matched", &matched);
    rig_box(&o->r, "block", 0.5, 0.5, 0.25);
    rig_object(&o->r, "block", "block", "matched", rig_v(-0.5, 0.75, 0.5));
    rig_commit(&o->r);
    render(o, "a room with glass of index 1");
    rig_assert_picture(&o->r, empty, o->method->name);
    assert_int_equal(o->rays[LUM_RAY_REFLECTION] + o->rays[LUM_RAY_TRANSMISSION], 0);
    lum_free(empty);
}

/* What a rough surface of index 1 lets through goes straight on, and is counted once: a quarter of a floor is seen
 * through a square that is half metal, a quarter glass and a quarter matt, with nothing above to reflect. What the
 * square, seen from the floor as 2e-4 of a sphere, sends back down is less than 1 %. */
static void straight_through_what_is_rough(struct odd *o)
{
    struct rig *r = &o->r;
    struct lum_material_desc matt = rig_diffuse(0.6f), veil = rig_diffuse(1.0f);
    veil.metallic = veil.transmission = 0.5f;
    veil.roughness = 0.6f;
    veil.ior = 1.0f;
    veil.thin = true;
    rig_material(r, "matt", &matt);
    rig_material(r, "veil", &veil);
    rig_square(r, "floor", 4);
    rig_square(r, "square", 0.1);
    rig_object(r, "floor", "floor", "matt", rig_v(0, 0, 0));
    rig_object(r, "square", "square", "veil", rig_v(0, 2, 0.2));
    rig_bulb(r, "lamp", rig_v(0.5, 0.75, 0), 100);
    rig_camera(r, rig_v(0, 3, 0.3), rig_v(0, 0, 0), 1);
    r->settings.w = r->settings.h = 12;
    r->settings.max_spp = o->method->refines ? 1 : 16; /* else samples replace what its frame shows */
    rig_commit(r);
    render(o, "a floor through what is rough");
    double d2 = 0.5 * 0.5 + 0.75 * 0.75, want = 0.25 * 0.6 / (double)LUM_PI * 100 * 0.75 / sqrt(d2) / d2;
    double mean = (double)rig_mean(r).g;
    if (!(fabs(mean - want) <= 0.01 * want))
        fail_msg("%s: %.4f is seen of a floor through what lets a quarter straight through, expected %.4f",
                 o->method->name, mean, want);
}

/* A chequered floor. */
static void put_chequers(struct odd *o, const struct lum_material_desc *first, float other)
{
    struct rig *r = &o->r;
    struct lum_material_desc second = rig_diffuse(other);
    rig_material(r, "first", first);
    rig_material(r, "other", &second);
    rig_square(r, "chequer", 0.05);
    for (int k = 0; k < 100; k++) {
        char id[16];
        snprintf(id, sizeof id, "floor-%d", k);
        int x = k % 10, z = k / 10;
        rig_object(r, id, "chequer", (x + z) % 2 ? "other" : "first", rig_v(0.1 * x - 0.45, 0, 0.1 * z - 0.45));
    }
    rig_camera(r, rig_v(0, 1.5, 0), rig_v(0, 0, 0), 24); /* sees nothing else */
    r->settings.antialias = false;
    r->settings.max_spp = 1;
    rig_commit(r);
}

/* Light that reaches the floor by way of the ceiling alone. */
static void hang_ceiling(struct odd *o)
{
    struct rig *r = &o->r;
    rig_box(r, "ceiling", 1, 0.1, 1);
    rig_diffuse_object(r, "ceiling", "plaster", 0.8f, rig_v(0, 2, 0));
    struct lum_light_desc lamp = {.kind = &lum_light_kind_spot,
                                  .position = rig_v(0, 0.5, 0),
                                  .direction = rig_v(0, 1, 0),
                                  .color = lum_grey(1),
                                  .intensity = 100,
                                  .inner_cone_rad = 0.3,
                                  .outer_cone_rad = 0.4,
                                  .on = true};
    rig_light(r, "lamp", &lamp);
    r->settings.max_depth = 2; /* light, ceiling, floor, eye */
    r->settings.n_vpls = 16;
}

/* An object that shines: a light without a closed form. */
static void hang_panel(struct odd *o)
{
    struct rig *r = &o->r;
    struct lum_material_desc glow = rig_diffuse(0.0f);
    glow.emission_cd_m2 = 100.0;
    rig_material(r, "glow", &glow);
    rig_square(r, "panel", 0.5);
    rig_object(r, "panel", "panel", "glow", rig_v(0, 3, 0));
    r->settings.max_depth = 1;
}

/* What does not reflect has no light to lend: white chequers look the same among black ones as among white ones.
 * Windows reach 10 pixels of 25 mm, and the nearest virtual light is 1.9 m away: what it gives varies with r^-4 cos^2
 * by less than 4 * 0.25 / 1.9 = 53 % even if all of a window lay at one end of it; a window that counts black ones in
 * loses a half on average, at every pixel. So on average, where the ends cancel, a fifth tells the two apart. Under the
 * sky nothing varies but the samples: 16 of each of some 500 pixels, of a variance about the square of their mean, 1 %.
 */
static void compare_chequers(struct odd *o)
{
    double sum[2] = {0};
    const struct lum_material_desc first = rig_diffuse(0.8f);
    put_chequers(o, &first, 0.8f);
    render(o, "white chequers");
    struct lum_rgb *white = rig_picture(&o->r);
    put_chequers(o, &first, 0.0f);
    render(o, "black and white chequers");
    for (uint32_t i = 0; i < o->r.settings.w * o->r.settings.h; i++) {
        struct lum_rgb c = lum_film_mean(lum_view_film(o->r.view), i % o->r.settings.w, i / o->r.settings.w);
        if (!(c.r > 0.0f))
            continue;
        sum[0] += (double)c.r;
        sum[1] += (double)white[i].r;
    }
    lum_free(white);
    if (fabs(sum[0] - sum[1]) > 0.2 * sum[1])
        fail_msg("%s: white chequers give %g among black ones, %g among white ones", o->method->name, sum[0], sum[1]);
}

static void black_neighbours(struct odd *o)
{
    hang_ceiling(o);
    compare_chequers(o);
}

static void black_neighbours_in_direct_light(struct odd *o)
{
    hang_panel(o);
    compare_chequers(o);
}

/* Nothing of what mirrors show gets onto what lies beside them: the black half of the floor stays black, but for the
 * pixels of its edges. */
static void black_among_mirrors(struct odd *o)
{
    struct lum_material_desc mirror = lum_material_default();
    mirror.metallic = 1.0f;
    mirror.roughness = 0.0f;
    hang_ceiling(o);
    rig_square(&o->r, "ground", 2.0); /* what lights the ceiling */
    rig_object(&o->r, "ground", "ground", "plaster", rig_v(0, -0.5, 0));
    put_chequers(o, &mirror, 0.0f);
    o->r.settings.max_depth = 3;
    render(o, "black and mirroring chequers");
    uint32_t black = 0, n = o->r.settings.w * o->r.settings.h;
    for (uint32_t i = 0; i < n; i++)
        black += lum_film_mean(lum_view_film(o->r.view), i % o->r.settings.w, i / o->r.settings.w).r == 0.0f;
    if (black < 0.45 * n)
        fail_msg("%s: %u of %u pixels are black, expected half", o->method->name, black, n);
}

/* A mirror that fills the picture, and in it a wall that is lit by way of the ceiling alone. Filters put the sets of
 * virtual lights together in mirrors, too: neighbouring windows hold each set once and share all pixels but those of a
 * column, and differ by as much as the wall's light does over the window: of some 5 m and 48 pixels across, a few per
 * cent. Without them neighbours differ by as much as single lights do: by about as much as they give. */
static void mirrored_light(struct odd *o)
{
    struct rig *r = &o->r;
    hang_ceiling(o);
    rig_box(r, "wall", 4, 4, 0.1);
    rig_object(r, "wall", "wall", "plaster", rig_v(0, 0, 2.5));
    struct lum_material_desc mirror = lum_material_default();
    mirror.metallic = 1.0f;
    mirror.roughness = 0.0f;
    rig_material(r, "mirror", &mirror);
    rig_object(r, "mirror", "wall", "mirror", rig_v(0, 0, -1.5));
    rig_camera(r, rig_v(0, 0.6, 0.8), rig_v(0, 0.6, -1), 30);
    r->settings.max_depth = 3;
    r->settings.antialias = false;
    r->settings.max_spp = 1;
    rig_commit(r);
    render(o, "a mirrored wall");
    if (!o->method->pattern)
        return;
    const struct lum_film *f = lum_view_film(r->view);
    double sum = 0.0, differences = 0.0;
    for (uint32_t y = 0; y < f->h; y++)
        for (uint32_t x = 1; x < f->w; x++) {
            double here = (double)lum_film_mean(f, x, y).g;
            sum += here;
            differences += fabs(here - (double)lum_film_mean(f, x - 1, y).g);
        }
    if (!(sum > 0.0 && differences < 0.1 * sum))
        fail_msg("%s: neighbours in a mirror differ by %g of what they are", o->method->name, differences / sum);
}

/* ---- all of them, with every method ---- */

static struct odd_case {
    const char *name;
    void (*checks[2])(struct odd *); /* NULL: one is enough */
} cases[] = {
    {"pictures_of_any_size", {sizes}},
    {"scenes_without_lights", {no_lights}},
    {"scenes_without_objects", {no_objects}},
    {"cameras_inside_walls", {inside_a_wall}},
    {"media_that_touch_the_camera", {touching_fog}},
    {"lamps_inside_of_things", {shut_in}},
    {"lamps_in_surfaces", {in_a_surface}},
    {"far_away", {far_away}},
    {"lamps_without_strength", {without_strength}},
    {"glass_without_refraction", {without_refraction, straight_through_what_is_rough}},
    {"black_does_not_bleed", {black_neighbours, black_neighbours_in_direct_light}},
    {"mirrors_are_filtered", {mirrored_light, black_among_mirrors}},
};

static void with_every_method(void **state)
{
    const struct odd_case *c = *state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t k = 0; k < LUM_ARRAY_LEN(c->checks) && c->checks[k]; k++)
        for (size_t m = 0; m < n; m++) {
            if (!TEST_TAKES(m, (size_t)(c - cases) + k))
                continue;
            struct odd o = {0};
            begin(&o, &methods[m]);
            c->checks[k](&o);
            rig_end(&o.r);
        }
}

int main(void)
{
    struct CMUnitTest tests[LUM_ARRAY_LEN(cases)];
    for (size_t i = 0; i < LUM_ARRAY_LEN(cases); i++)
        tests[i] = (struct CMUnitTest){cases[i].name, with_every_method, NULL, NULL, &cases[i]};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
