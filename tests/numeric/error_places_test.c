/* Which pixels probes of the error are drawn from. */
#include "core/render/error_places.h"
#include "tests/support/rig.h"

/* However small or narrow a picture is, places lie in it. Where all of it is alike none is drawn rather than another,
 * and they stand for all of it: in the mean of the draws, as those that begin early have a row more. */
static void places_lie_in_pictures_of_any_size(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1}, {3, 2}, {1, 9000}, {9000, 1}, {37, 301}, {640, 400}};
    enum { PLACE_DRAWS = 256 };
    for (size_t k = 0; k < LUM_ARRAY_LEN(sizes); k++) {
        struct lum_film film = {0};
        struct lum_error_looks looks = {0};
        struct lum_error_place places[LUM_ERROR_PLACES];
        uint64_t nonfinite = 0;
        double mean = 0.0, x = 0.0;
        RIG_OK(lum_film_init(&film, sizes[k][0], sizes[k][1], &err));
        for (uint32_t i = 0; i < film.w * film.h; i++)
            lum_film_set(&film, i % film.w, i / film.w, lum_grey(1.0f), &nonfinite);
        for (uint32_t draw = 0; draw < PLACE_DRAWS; draw++) {
            RIG_OK(lum_error_places_draw(&looks, &film, 7, draw, places));
            for (uint32_t i = 0; i < LUM_ERROR_PLACES; i++) {
                assert_true(places[i].x < film.w && places[i].y < film.h);
                mean += (double)places[i].weight / (PLACE_DRAWS * LUM_ERROR_PLACES);
                x += (double)places[i].x / (PLACE_DRAWS * LUM_ERROR_PLACES);
            }
        }
        print_message("%u x %u: weight %g, in the middle at %g\n", film.w, film.h, mean, x);
        assert_true(fabs(mean - 1.0) < 0.02);
        assert_true(fabs(x - 0.5 * (film.w - 1)) <= 0.03 * film.w); /* 4 * sqrt(1 / 12 / 16384) = 0.009, and rows */
        lum_error_looks_finish(&looks);
        lum_film_finish(&film);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(places_lie_in_pictures_of_any_size)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
