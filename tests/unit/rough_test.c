/* Rough pictures: the edges of the full picture, and no trace in what follows. */
#include "tests/support/effort.h"
#include "tests/support/lit_room.h"

/* Sunlight on floors in one plane is albedo over pi times one illuminance, so interpolating light over albedo is exact:
 * the rough picture is the full one to rounding, at the edges of floors of any albedo, too. */
static void edges_are_those_of_the_full_picture(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    rig_square(&r, "dark", 20);
    rig_square(&r, "bright", 0.7); /* no multiple of a block wide */
    rig_diffuse_object(&r, "dark", "grey", 0.1f, rig_v(0, 0, 0));
    rig_diffuse_object(&r, "bright", "white", 0.9f, rig_v(0.3, 1e-4, 0.2));
    struct lum_light_desc sun = {.kind = &lum_light_kind_directional,
                                 .direction = {1, -2, 1},
                                 .color = lum_grey(1),
                                 .intensity = 5000.0,
                                 .on = true};
    rig_light(&r, "sun", &sun);
    rig_camera(&r, rig_v(0, 3, 0), rig_v(0, 0, 0), 60);
    rig_commit(&r);
    use_method(&r, "live");
    r.settings.w = 75, r.settings.h = 53; /* no multiple of a block or a tile */
    r.settings.antialias = false;         /* of the full picture: rough ones have none */
    r.settings.max_spp = 1;
    rig_pass(&r);
    struct lum_rgb *full = rig_picture(&r);
    for (uint32_t side = 2; side <= 16; side *= 2) {
        rig_fresh_view(&r);
        r.settings.preview = side;
        assert_int_equal(rig_pass(&r).preview, side);
        const struct lum_film *film = lum_view_film(r.view);
        for (uint32_t i = 0; i < film->w * film->h; i++) {
            float got = lum_film_mean(film, i % film->w, i / film->w).g, want = full[i].g;
            /* a neighbour of the other floor counts with its light over (albedo + 1e-3), at most 1 % off */
            if (!(fabsf(got - want) <= 0.01f * want))
                fail_msg("blocks of %u: pixel %u,%u is %g, in the full picture %g", side, i % film->w, i / film->w,
                         (double)got, (double)want);
        }
    }
    lum_free(full);
    rig_end(&r);
}

/* What a picture's four pixels around a point of one twice as large span. */
struct span {
    float lo, hi;
};

static uint32_t within(double at, uint32_t n)
{
    return (uint32_t)fmin(fmax(at, 0.0), n - 1.0);
}

/* Both show all of the view: the centre of pixel x of W lies (x + 1/2) w / W from the left edge of one of w. */
static struct span around(const struct lum_rgb *half, uint32_t w, uint32_t h, const struct lum_film *of, uint32_t x,
                          uint32_t y)
{
    double fx = floor((x + 0.5) * w / of->w - 0.5), fy = floor((y + 0.5) * h / of->h - 0.5);
    uint32_t xs[2] = {within(fx, w), within(fx + 1.0, w)}, ys[2] = {within(fy, h), within(fy + 1.0, h)};
    struct span s = {INFINITY, 0.0f};
    for (int i = 0; i < 4; i++) {
        float g = half[ys[i / 2] * w + xs[i % 2]].g;
        s = (struct span){fminf(s.lo, g), fmaxf(s.hi, g)};
    }
    return s;
}

/* Beyond blocks of LUM_PREVIEW_WHOLE the surfaces are those of a picture of half the size: each pixel lies between the
 * four of that around it, wherever the size is odd, too; and the eye sees half of the pixels a side. */
static void rougher_ones_are_of_half_the_size(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use_method(&r, "live");
    r.settings.max_spp = 1;
    r.settings.antialias = false;
    for (uint32_t w = 74; w <= 75; w++) {
        r.settings.w = (w + 1) / 2, r.settings.h = 27;
        r.settings.preview = LUM_PREVIEW_MAX / 2;
        rig_fresh_view(&r);
        uint64_t primary = rig_pass(&r).rays[LUM_RAY_PRIMARY];
        struct lum_rgb *half = rig_picture(&r);
        rig_fresh_view(&r);
        r.settings.w = w, r.settings.h = 53;
        r.settings.preview = LUM_PREVIEW_MAX;
        struct lum_pass_stats s = rig_pass(&r);
        assert_int_equal(s.preview, LUM_PREVIEW_MAX);
        assert_int_equal(s.rays[LUM_RAY_PRIMARY], primary);
        const struct lum_film *film = lum_view_film(r.view);
        for (uint32_t i = 0; i < film->w * film->h; i++) {
            struct span around_it = around(half, (w + 1) / 2, 27, film, i % w, i / w);
            float got = lum_film_mean(film, i % w, i / w).g;
            if (!(got >= around_it.lo * (1.0f - 1e-5f) && got <= around_it.hi * (1.0f + 1e-5f)))
                fail_msg("%u wide: pixel %u,%u is %g, around it %g to %g", w, i % w, i / w, (double)got,
                         (double)around_it.lo, (double)around_it.hi);
        }
        lum_free(half);
    }
    rig_end(&r);
}

/* In a furnace all shines and reflects: the rough picture is as bright as the full one. */
static void what_shines_reflects_too(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    rig_furnace(&r, 1, 0.5f, 100);
    rig_camera(&r, rig_v(0, 0, 0), rig_v(0, 0, -1), 60);
    rig_commit(&r);
    use_method(&r, "live");
    r.settings.max_spp = 1;
    rig_pass(&r);
    double full = (double)rig_mean(&r).g;
    rig_fresh_view(&r);
    r.settings.preview = 4;
    assert_int_equal(rig_pass(&r).preview, 4);
    double rough = (double)rig_mean(&r).g;
    print_message("furnace: %g, roughly %g\n", full, rough);
    assert_true(fabs(rough / full - 1.0) < 0.05); /* the noise of fewer pixels' soft light */
    rig_end(&r);
}

/* Frames after rough pictures of every edit are those of a view that makes none. Without records, whose places are the
 * rough pass's first. */
static void frames_after_rough_pictures_are_as_without(uint32_t side)
{
    struct rig r;
    lit_room(&r, 2);
    use_method(&r, "live");
    r.settings.w = 75, r.settings.h = 53;
    r.settings.max_spp = 1;
    r.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
    r.settings.preview = side;
    for (int edit = 0; edit < 6; edit++) {
        if (edit % 3 == 0)
            rig_bulb(&r, "bulb", rig_v(-1, 2, 0.5 - 0.1 * edit), 60);
        else if (edit % 3 == 1)
            rig_object(&r, "crate", "crate", "red", rig_v(0.5 - 0.1 * edit, 0.5, -0.4));
        else
            rig_camera(&r, rig_v(-0.3, 1.4, 1.8 - 0.1 * edit), rig_v(0.2, 0.9, -0.5), 60);
        rig_commit(&r);
        r.settings.preview_eased = edit % 2 == 1; /* of rough pictures alone */
        assert_int_equal(rig_pass(&r).preview, side);
        if (edit == 3) /* nobody waited for the frame: the next edit comes first */
            continue;
        struct lum_pass_stats s = rig_pass(&r);
        assert_int_equal(s.preview, 0);
        assert_int_equal(s.spp, 1);
        struct lum_view *kept = r.view;
        struct lum_rgb *picture = rig_picture(&r);
        r.view = NULL;
        r.settings.preview = 0;
        rig_fresh_view(&r);
        rig_pass(&r);
        char what[32];
        snprintf(what, sizeof what, "edit %d", edit);
        rig_assert_picture(&r, picture, what);
        lum_free(picture);
        lum_view_destroy(r.view);
        r.view = kept;
        r.settings.preview = side;
    }
    rig_end(&r);
}

static void frames_after_rough_pictures(void **state)
{
    (void)state;
    frames_after_rough_pictures_are_as_without(4);
}

static void frames_after_rougher_pictures(void **state)
{
    (void)state;
    frames_after_rough_pictures_are_as_without(LUM_PREVIEW_MAX);
}

/* A drag on which both serve, as time allows. The whole picture that it began with is a base for the first one, but no
 * more after one of half the size, which told it of no motion: from then on each is that of a view which has seen
 * nothing before. */
static void sizes_take_turns(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use_method(&r, "live");
    r.settings.w = 75, r.settings.h = 53;
    r.settings.max_spp = 1;
    r.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
    rig_pass(&r);
    for (int edit = 0; edit < 6; edit++) {
        r.settings.preview = edit % 2 == 0 ? 8 : LUM_PREVIEW_MAX;
        rig_object(&r, "crate", "crate", "red", rig_v(0.4 - 0.2 * edit, 0.5, -0.4));
        rig_commit(&r);
        assert_int_equal(rig_pass(&r).preview, r.settings.preview);
        if (edit == 0)
            continue;
        struct lum_rgb *rough = rig_picture(&r);
        struct lum_view *kept = r.view;
        char what[32];
        r.view = NULL;
        rig_fresh_view(&r);
        rig_pass(&r);
        snprintf(what, sizeof what, "edit %d", edit);
        rig_assert_picture(&r, rough, what);
        lum_view_destroy(r.view);
        r.view = kept;
        lum_free(rough);
    }
    rig_end(&r);
}

/* Root mean square error of luminance over the mean of the picture, against a better one. */
static double rms_against(struct rig *r, const struct lum_rgb *truth)
{
    const struct lum_film *film = lum_view_film(r->view);
    double sum = 0.0, mean = 0.0;
    for (uint32_t i = 0; i < film->w * film->h; i++) {
        double y = (double)lum_luminance(lum_film_mean(film, i % film->w, i / film->w));
        double d = y - (double)lum_luminance(truth[i]);
        sum += d * d;
        mean += y;
    }
    return sqrt(sum * film->w * film->h) / mean;
}

/* Rough pictures say how far they are off from what they will be: of ten draws one may be outside of a bound that holds
 * for 95 in a hundred. Rays are counted, as in a deterministic world, so that nothing hangs on time. */
static void rough_pictures_say_their_error(void **state)
{
    (void)state;
    static const uint32_t sides[] = {8, LUM_PREVIEW_MAX};
    struct rig r;
    lit_room(&r, 2);
    r.settings.w = 48, r.settings.h = 32;
    use_method(&r, "path");
    r.settings.max_spp = 256; /* its error is a twentieth of what is measured here */
    while (!rig_pass(&r).complete)
        continue;
    struct lum_rgb *truth = rig_picture(&r);
    use_method(&r, "live");
    r.settings.max_spp = 1;
    r.settings.deterministic = true;
    r.settings.error_share = 2.0;
    for (size_t k = 0; k < LUM_ARRAY_LEN(sides); k++) {
        uint32_t n_covered = 0, n = 10;
        double bounds = 0.0, errors = 0.0;
        for (uint32_t seed = 1; seed <= n; seed++) {
            rig_fresh_view(&r);
            r.settings.seed = seed;
            r.settings.preview = sides[k];
            struct lum_pass_stats s = rig_pass(&r);
            assert_int_equal(s.preview, sides[k]);
            assert_true(s.rays[LUM_RAY_PROBE] > 0 && isfinite(s.error.bound) && s.error.fresh == 1.0);
            double is = rms_against(&r, truth);
            n_covered += is <= s.error.bound;
            bounds += s.error.bound / n;
            errors += is / n;
        }
        print_message("blocks of %u: off by %.3f, at most %.3f said, %u of %u covered\n", sides[k], errors, bounds,
                      n_covered, n);
        assert_true(n_covered >= 9 && bounds < 6.0 * errors);
    }
    lum_free(truth);
    rig_end(&r);
}

static uint64_t rays_of_rough(const char *method, bool eased, enum lum_ray_kind kind)
{
    struct rig r;
    lit_room(&r, 2);
    use_method(&r, method);
    r.settings.w = 75, r.settings.h = 53;
    r.settings.preview = 4;
    r.settings.preview_eased = eased;
    uint64_t rays = rig_pass(&r).rays[kind];
    rig_end(&r);
    return rays;
}

static void eased_pictures_take_fewer_rays(void **state)
{
    (void)state;
    assert_true(2 * rays_of_rough("irrcache", true, LUM_RAY_INDIRECT_DIFFUSE) <
                rays_of_rough("irrcache", false, LUM_RAY_INDIRECT_DIFFUSE));
    assert_true(rays_of_rough("live", true, LUM_RAY_SOFT_SHADOW) < rays_of_rough("live", false, LUM_RAY_SOFT_SHADOW));
}

/* Whatever the method: first a rough picture, of a part of the rays, then the whole one. */
static void every_method_can_be_rough(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t m = 0; m < n; m += TEST_STRIDE) {
        struct rig r;
        lit_room(&r, 2);
        use_method(&r, methods[m].name);
        r.settings.w = 75, r.settings.h = 53;
        r.settings.max_spp = 1;
        struct lum_pass_stats whole = rig_pass(&r);
        double light = (double)rig_mean(&r).g;
        rig_fresh_view(&r);
        r.settings.preview = 4;
        struct lum_pass_stats rough = rig_pass(&r);
        if (rough.preview != 4 || rough.spp != 0 || !rough.changed || rough.complete)
            fail_msg("%s: preview %u, spp %u", methods[m].name, rough.preview, rough.spp);
        /* 19 x 14 pixels of 75 x 53, and three quarters of the lights' for what counts tiles */
        uint64_t rays = rough.rays[LUM_RAY_SOFT_SHADOW], all = whole.rays[LUM_RAY_SOFT_SHADOW];
        if (!(rays * 4 < all) || !((double)rig_mean(&r).g > 0.5 * light))
            fail_msg("%s: %llu rays of %llu, mean %g of %g", methods[m].name, (unsigned long long)rays,
                     (unsigned long long)all, (double)rig_mean(&r).g, light);
        struct lum_pass_stats then = rig_pass(&r);
        assert_true(then.preview <= 1 && then.spp == 1 && then.nonfinite == 0);
        rig_bulb(&r, "bulb", rig_v(-0.8, 1.9, 0.3), 50); /* now there is a whole picture before it */
        rig_commit(&r);
        rough = rig_pass(&r);
        light = (double)rig_mean(&r).g;
        then = rig_pass(&r);
        double ratio = light / (double)rig_mean(&r).g;
        if (rough.preview != 4 || rough.nonfinite || then.nonfinite || fabs(ratio - 1.0) > 0.1)
            fail_msg("%s: roughly %g of the light", methods[m].name, ratio);
        rig_end(&r);
    }
}

static void look_at_sunlit_floor(struct rig *r)
{
    struct lum_light_desc sun = {.kind = &lum_light_kind_directional,
                                 .direction = {0, -1, 0},
                                 .color = lum_grey(1),
                                 .intensity = 5000.0,
                                 .on = true};
    rig_light(r, "sun", &sun);
    rig_camera(r, rig_v(0, 3, 0), rig_v(0.9, 0, 0.4), 60);
    use_method(r, "live");
    r->settings.w = 150, r->settings.h = 106;
    r->settings.max_spp = 1;
    r->settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
}

/* A stripe of sun that is thinner than a block is met by few of them, which are no dots as bright as the sun: what they
 * have is that of the pixels around. None of the light is lost: over stripes at many places a block meets as much as
 * its pixels do. */
static void thin_stripes_are_no_dots(void **state)
{
    (void)state;
    enum { PLACES = 24 };
    struct rig r;
    double full = 0.0, rough = 0.0, sunlit = 0.0, brightest = 0.0;
    rig_begin(&r, 2);
    rig_square(&r, "floor", 40);
    rig_square(&r, "left", 10);
    rig_square(&r, "right", 10);
    rig_diffuse_object(&r, "floor", "grey", 0.5f, rig_v(0, 0, 0));
    look_at_sunlit_floor(&r);
    for (int place = 0; place < PLACES; place++) {
        double x = 0.5 * place / PLACES;
        rig_diffuse_object(&r, "left", "black", 0.0f, rig_v(x - 10, 4, 0));
        rig_diffuse_object(&r, "right", "black", 0.0f, rig_v(x + 10.05, 4, 0));
        rig_commit(&r);
        r.settings.preview = 0;
        rig_fresh_view(&r);
        rig_pass(&r);
        full += (double)rig_mean(&r).g / PLACES;
        r.settings.preview = 8;
        rig_fresh_view(&r);
        assert_int_equal(rig_pass(&r).preview, 8);
        rough += (double)rig_mean(&r).g / PLACES;
        const struct lum_film *film = lum_view_film(r.view);
        for (uint32_t i = 0; i < film->w * film->h; i++)
            brightest = fmax(brightest, (double)lum_film_mean(film, i % film->w, i / film->w).g);
    }
    sunlit = 0.5 / LUM_PI_D * 5000.0;
    print_message("mean %g, roughly %g; brightest %.3f of what the sun lights\n", full, rough, brightest / sunlit);
    assert_true(brightest < 0.6 * sunlit);
    assert_true(fabs(rough / full - 1.0) < 0.15);
    rig_end(&r);
}

/* A lamp that is dragged makes a picture rough, but not the sun's stripes: what has not changed is as sharp as before.
 * Whether the lamp has a shape, which is then something that moves, or none. */
static void what_does_not_change_stays_sharp(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    rig_square(&r, "floor", 40);
    rig_square(&r, "slat", 0.05);
    rig_diffuse_object(&r, "floor", "grey", 0.5f, rig_v(0, 0, 0));
    for (int i = 0; i < 12; i++) {
        char id[16];
        snprintf(id, sizeof id, "slat-%d", i);
        rig_object(&r, id, "slat", "grey", rig_v(0.15 * i, 1, 0.4));
    }
    look_at_sunlit_floor(&r);
    for (int shape = 0; shape <= 1; shape++) {
        struct lum_light_desc lamp = rig_point(rig_v(-2, 0.5, -2), 1e-3);
        lamp.kind = shape ? &lum_light_kind_sphere : lamp.kind;
        lamp.radius_m = 0.05;
        rig_light(&r, "lamp", &lamp);
        rig_commit(&r);
        r.settings.preview = 8;
        rig_fresh_view(&r);
        rig_pass(&r);
        rig_pass(&r);
        struct lum_rgb *before = rig_picture(&r);
        lamp.position.x += 0.1;
        rig_light(&r, "lamp", &lamp);
        rig_commit(&r);
        assert_int_equal(rig_pass(&r).preview, 8);
        double off = 0.0;
        const struct lum_film *film = lum_view_film(r.view);
        for (uint32_t i = 0; i < film->w * film->h; i++)
            off = fmax(off, fabs((double)(lum_film_mean(film, i % film->w, i / film->w).g - before[i].g)));
        print_message("%s: off by %.2e of what the sun lights\n", shape ? "ball" : "point",
                      off / (0.5 / LUM_PI_D * 5000.0));
        assert_true(off < 1e-3 * 0.5 / LUM_PI_D * 5000.0); /* the lamp brings 1e-6 of it a metre away */
        lum_free(before);
    }
    rig_end(&r);
}

/* Of a room with all that layers do not keep: many lamps, indirect light, gloss, mirrors, smooth edges. */
static void begin_rich_room(struct rig *r)
{
    lit_room(r, 2);
    use_method(r, "live");
    r->settings.w = 120, r->settings.h = 84;
    r->settings.max_spp = 1;
    struct lum_material_desc glossy = rig_diffuse(0.4f), mirror = rig_diffuse(0.1f);
    glossy.specular = 1, glossy.roughness = 0.3f;
    mirror.metallic = 1, mirror.base_color = lum_grey(0.9f), mirror.roughness = 0;
    rig_material(r, "red", &glossy);
    rig_material(r, "mirror", &mirror);
    rig_box(r, "post", 0.1, 0.6, 0.1);
    rig_object(r, "post", "post", "mirror", rig_v(-0.6, 0.6, -0.5));
    for (int i = 0; i < 10; i++) {
        char id[16];
        struct lum_light_desc lamp = rig_point(rig_v(-1.5 + 0.3 * i, 2.6, -1.2), 2);
        lamp.kind = &lum_light_kind_sphere;
        lamp.radius_m = 0.04;
        snprintf(id, sizeof id, "lamp-%d", i);
        rig_light(r, id, &lamp);
    }
}

static void make_whole(struct rig *r, uint32_t side)
{
    struct lum_pass_stats stats;
    r->settings.preview = 8;
    rig_pass(r);
    assert_int_equal(rig_pass(r).spp, 1);
    r->settings.preview = 0; /* nothing will be rough */
    RIG_OK(lum_view_prepare(r->view, r->snapshot, &r->settings, NULL, &stats, &err));
    assert_int_equal(stats.rays[LUM_RAY_PRIMARY], 0);
    r->settings.preview = side;
    RIG_OK(lum_view_prepare(r->view, r->snapshot, &r->settings, NULL, &stats, &err));
    assert_true(stats.rays[LUM_RAY_PRIMARY] > 0); /* by all records of the whole picture, of which the first had few */
    RIG_OK(lum_view_prepare(r->view, r->snapshot, &r->settings, NULL, &stats, &err));
    assert_int_equal(stats.rays[LUM_RAY_PRIMARY], 0);
}

static double difference(const struct rig *r, const struct lum_rgb *from)
{
    const struct lum_film *film = lum_view_film(r->view);
    double off = 0.0, mean = 0.0;
    for (uint32_t i = 0; i < film->w * film->h; i++) {
        off += fabs((double)(lum_film_mean(film, i % film->w, i / film->w).g - from[i].g));
        mean += (double)from[i].g;
    }
    return off / mean;
}

/* A lamp that brings next to nothing moves: the rough picture is the whole one before it. Whether it is made of blocks
 * of the size that the last one had, or of those that were prepared. */
static void what_an_edit_leaves_is_as_it_was(void **state)
{
    (void)state;
    for (uint32_t side = 4; side <= 8; side += 4) {
        struct rig r;
        begin_rich_room(&r);
        struct lum_light_desc lamp = rig_point(rig_v(1, 0.4, 1), 1e-6);
        lamp.kind = &lum_light_kind_sphere;
        lamp.radius_m = 0.02;
        rig_light(&r, "mote", &lamp);
        rig_commit(&r);
        make_whole(&r, side);
        struct lum_rgb *before = rig_picture(&r);
        lamp.position.x += 0.1;
        rig_light(&r, "mote", &lamp);
        rig_commit(&r);
        assert_int_equal(rig_pass(&r).preview, side);
        double off = difference(&r, before);
        print_message("blocks of %u: %.2e of the light is another\n", side, off);
        assert_true(off <
                    0.03); /* many lights are sampled anew, and VPLs near the mote; without the whole picture .085 */
        lum_free(before);
        rig_end(&r);
    }
}

/* The eye goes elsewhere, and comes back: what it saw there is not what rough pictures here are compared with. */
static void another_view_is_no_base(void **state)
{
    (void)state;
    struct rig r;
    begin_rich_room(&r);
    rig_commit(&r);
    make_whole(&r, 8);
    struct lum_rgb *here = rig_picture(&r);
    struct lum_camera camera = r.settings.camera;
    rig_camera(&r, rig_v(0.6, 1.2, 1.5), rig_v(-0.6, 0.8, -0.5), 60);
    r.settings.preview = 1;
    assert_int_equal(rig_pass(&r).spp, 1);
    double elsewhere = difference(&r, here);
    r.settings.camera = camera;
    r.settings.preview = 8;
    assert_int_equal(rig_pass(&r).preview, 8);
    double off = difference(&r, here);
    print_message("off by %.3f, the other view by %.3f\n", off, elsewhere);
    assert_true(off < 0.5 * elsewhere);
    lum_free(here);
    rig_end(&r);
}

/* Whatever an edit does, a rough picture after a whole one is as bright as the frame that follows, and nearer to it
 * than one that has no whole picture before it. */
static void a_whole_picture_before_makes_rough_ones_better(void **state)
{
    (void)state;
    double with = 0.0, without = 0.0;
    for (int edit = 0; edit < TEST_EFFORT(4); edit++) {
        struct rig r;
        begin_rich_room(&r);
        struct lum_light_desc lamp = rig_point(rig_v(1, 1.5, 1), 30);
        rig_light(&r, "lamp", &lamp);
        rig_commit(&r);
        make_whole(&r, 4);
        lamp.position = edit == 0 ? rig_v(0.5, 1.5, 0.5) : lamp.position;
        lamp.intensity = edit == 1 ? 1e-3 : lamp.intensity;
        rig_light(&r, "lamp", &lamp);
        if (edit == 2)
            rig_object(&r, "crate", "crate", "red", rig_v(0.1, 0.5, 0.1));
        if (edit == 3) {
            struct lum_material_desc blue = rig_diffuse(0.2f);
            blue.base_color = lum_rgb(0.05f, 0.2f, 0.8f);
            rig_material(&r, "white", &blue);
        }
        if (edit == 1) /* of another colour too: or the frame would be another sum, and come at once */
            rig_bulb(&r, "far", rig_v(-1, 2, 1), 1e-3);
        rig_commit(&r);
        assert_int_equal(rig_pass(&r).preview, 4);
        struct lum_rgb *rough = rig_picture(&r);
        double bright = (double)rig_mean(&r).g;
        assert_int_equal(rig_pass(&r).spp, 1);
        double off = difference(&r, rough), full = (double)rig_mean(&r).g;
        rig_fresh_view(&r);
        assert_int_equal(rig_pass(&r).preview, 4);
        struct lum_rgb *alone = rig_picture(&r);
        rig_pass(&r);
        double off_alone = difference(&r, alone);
        print_message("edit %d: roughly %.4f of the light, off by %.4f, without by %.4f\n", edit, bright / full, off,
                      off_alone);
        assert_true(fabs(bright / full - 1.0) < 0.03);
        with += off / 4;
        without += off_alone / 4;
        lum_free(rough);
        lum_free(alone);
        rig_end(&r);
    }
    assert_true(!TEST_TELLS || with < 0.8 * without);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(edges_are_those_of_the_full_picture),
        cmocka_unit_test(what_shines_reflects_too),
        cmocka_unit_test(thin_stripes_are_no_dots),
        cmocka_unit_test(what_does_not_change_stays_sharp),
        cmocka_unit_test(what_an_edit_leaves_is_as_it_was),
        cmocka_unit_test(another_view_is_no_base),
        cmocka_unit_test(a_whole_picture_before_makes_rough_ones_better),
        cmocka_unit_test(rougher_ones_are_of_half_the_size),
        cmocka_unit_test(frames_after_rough_pictures),
        cmocka_unit_test(frames_after_rougher_pictures),
        cmocka_unit_test(sizes_take_turns),
        cmocka_unit_test(rough_pictures_say_their_error),
        cmocka_unit_test(eased_pictures_take_fewer_rays),
        cmocka_unit_test(every_method_can_be_rough),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
