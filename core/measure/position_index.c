#include "core/measure/position_index.h"

static double degrees(double rad)
{
    return rad * (180.0 / LUM_PI_D);
}

/* Where a source lies, by the frame of the eye. */
struct bearing {
    double ahead, above, aside; /* aside is not negative */
};

static struct bearing bearing_of(struct lum_vec3 sight, struct lum_vec3 up, struct lum_vec3 wi)
{
    return (struct bearing){(double)lum_dot(wi, sight), (double)lum_dot(wi, up),
                            (double)fabsf(lum_dot(wi, lum_cross(sight, up)))};
}

static double closed_form(const struct bearing *b)
{
    if (!(b->ahead > 0.0))
        return (double)INFINITY;
    /* s: between the line of sight and the source; t: of the plane of both from the vertical */
    double out = hypot(b->above, b->aside), s = degrees(atan2(out, b->ahead)),
           t = degrees(atan2(b->aside, fabs(b->above)));
    double index;
    if (b->above >= 0.0) {
        index = exp((35.2 - 0.31889 * t - 1.22 * exp(-2.0 * t / 9.0)) * 1e-3 * s +
                    (21.0 + 0.26667 * t - 0.002963 * t * t) * 1e-5 * s * s);
    } else {
        double c = fabs(b->above) / out, a = degrees(atan2(out * sqrt(1.0 + 0.3225 * c * c), b->ahead));
        index = exp(6.49e-3 * a + 21e-5 * a * a);
    }
    return fmin(index, LUM_POSITION_INDEX_MAX);
}

double lum_position_index(struct lum_vec3 sight, struct lum_vec3 up, struct lum_vec3 wi)
{
    struct bearing b = bearing_of(sight, up, wi);
    return closed_form(&b);
}

/* ---- the table of CIE 117:1995 (its table 4.1) ---- */

#define N_ASIDE 31
#define N_ABOVE 20
#define STEP 0.1

/* In hundredths. Rows: T/R from 0 to 3; columns: H/R from 0 to 1.9. 0: the standard has no value. 7.50 at (2.7, 0.6) is
 * as printed there, though its neighbours have some 7.05: tables are computed with it everywhere. */
static const uint16_t table[N_ASIDE][N_ABOVE] = {
    // clang-format off
    {100, 126, 153, 190, 235, 286, 350, 420, 500, 600, 700, 810, 925, 1035, 1170, 1315, 1470, 1620, 0, 0},
    {105, 122, 146, 180, 220, 275, 340, 410, 480, 580, 680, 800, 910, 1030, 1160, 1300, 1460, 1610, 0, 0},
    {112, 130, 150, 180, 220, 266, 318, 388, 460, 550, 650, 760, 875, 985, 1120, 1270, 1400, 1570, 0, 0},
    {122, 138, 160, 197, 225, 270, 325, 390, 460, 545, 645, 740, 840, 950, 1085, 1210, 1370, 1500, 0, 0},
    {132, 147, 170, 196, 235, 280, 330, 390, 460, 540, 640, 730, 830, 940, 1060, 1190, 1320, 1460, 1600, 0},
    {143, 160, 182, 210, 248, 291, 340, 398, 470, 550, 640, 730, 830, 940, 1050, 1175, 1300, 1440, 1570, 0},
    {155, 172, 198, 230, 265, 310, 360, 410, 480, 550, 640, 735, 840, 940, 1050, 1170, 1300, 1410, 1540, 0},
    {170, 188, 212, 248, 287, 330, 378, 430, 488, 560, 650, 740, 850, 950, 1050, 1170, 1285, 1400, 1520, 0},
    {182, 200, 232, 270, 308, 350, 392, 450, 510, 575, 660, 750, 860, 950, 1060, 1175, 1280, 1400, 1510, 0},
    {196, 220, 254, 290, 330, 370, 420, 475, 530, 600, 675, 770, 870, 965, 1075, 1180, 1290, 1400, 1500, 1600},
    {211, 240, 275, 310, 350, 391, 440, 500, 560, 620, 700, 790, 880, 975, 1080, 1190, 1295, 1400, 1500, 1600},
    {230, 255, 292, 330, 372, 420, 470, 525, 580, 655, 720, 815, 900, 990, 1095, 1200, 1300, 1400, 1500, 1600},
    {240, 275, 312, 350, 390, 435, 485, 550, 605, 670, 750, 830, 920, 1000, 1102, 1210, 1310, 1400, 1500, 1600},
    {255, 290, 330, 370, 420, 465, 520, 570, 630, 700, 770, 855, 935, 1020, 1120, 1225, 1320, 1400, 1500, 1600},
    {270, 310, 350, 390, 435, 485, 535, 585, 650, 725, 800, 870, 950, 1040, 1140, 1240, 1325, 1405, 1500, 1600},
    {285, 315, 365, 410, 455, 500, 550, 620, 680, 750, 820, 885, 970, 1055, 1150, 1250, 1330, 1405, 1502, 1600},
    {295, 340, 380, 425, 475, 520, 575, 630, 700, 765, 840, 900, 980, 1080, 1175, 1260, 1340, 1420, 1510, 1600},
    {310, 355, 400, 450, 490, 540, 595, 650, 720, 780, 850, 920, 1000, 1085, 1185, 1275, 1345, 1420, 1510, 1600},
    {325, 370, 420, 465, 510, 560, 610, 675, 740, 800, 865, 935, 1010, 1100, 1190, 1280, 1350, 1420, 1510, 1600},
    {343, 386, 430, 475, 520, 570, 630, 690, 750, 817, 880, 950, 1020, 1100, 1200, 1282, 1355, 1420, 1510, 1600},
    {350, 400, 450, 490, 535, 580, 640, 710, 770, 830, 890, 960, 1040, 1110, 1200, 1285, 1360, 1430, 1510, 1600},
    {360, 417, 465, 505, 550, 600, 660, 720, 782, 845, 900, 975, 1050, 1120, 1210, 1290, 1370, 1435, 1510, 1600},
    {375, 425, 472, 520, 560, 610, 670, 735, 800, 855, 915, 985, 1060, 1130, 1210, 1290, 1370, 1440, 1515, 1600},
    {385, 435, 480, 525, 570, 622, 680, 740, 810, 865, 930, 990, 1070, 1140, 1220, 1295, 1370, 1440, 1520, 1600},
    {395, 440, 490, 535, 580, 630, 690, 750, 820, 880, 940, 1000, 1080, 1150, 1225, 1300, 1375, 1445, 1520, 1600},
    {400, 450, 496, 540, 585, 640, 695, 755, 825, 885, 950, 1005, 1085, 1155, 1230, 1300, 1380, 1450, 1525, 1600},
    {407, 455, 505, 547, 595, 646, 700, 765, 835, 895, 955, 1010, 1090, 1160, 1232, 1300, 1380, 1450, 1525, 1600},
    {410, 460, 510, 553, 600, 650, 750, 770, 840, 900, 960, 1016, 1092, 1163, 1235, 1300, 1380, 1450, 1525, 1600},
    {415, 462, 515, 556, 605, 655, 708, 773, 845, 905, 965, 1020, 1095, 1165, 1235, 1300, 1380, 1450, 1525, 1600},
    {420, 465, 517, 560, 607, 657, 712, 775, 850, 910, 970, 1023, 1095, 1165, 1235, 1300, 1380, 1450, 1525, 1600},
    {422, 467, 520, 565, 612, 660, 715, 780, 855, 912, 970, 1023, 1095, 1165, 1235, 1300, 1380, 1450, 1525, 1600},
    // clang-format on
};

double lum_position_index_table(double t_r, double h_r)
{
    double x = t_r / STEP, y = h_r / STEP;
    if (!(x >= 0.0 && y >= 0.0 && x <= N_ASIDE - 1 && y <= N_ABOVE - 1))
        return (double)INFINITY;
    int i = x < N_ASIDE - 2 ? (int)x : N_ASIDE - 2, k = y < N_ABOVE - 2 ? (int)y : N_ABOVE - 2;
    x -= i, y -= k;
    const double v[4] = {table[i][k], table[i][k + 1], table[i + 1][k], table[i + 1][k + 1]};
    const double weights[4] = {(1.0 - x) * (1.0 - y), (1.0 - x) * y, x * (1.0 - y), x * y};
    double sum = 0.0;
    for (int j = 0; j < 4; j++) {
        if (weights[j] > 0.0 && !(v[j] > 0.0))
            return (double)INFINITY;
        sum += weights[j] * v[j];
    }
    return 0.01 * sum;
}

double lum_position_index_ugr(struct lum_vec3 sight, struct lum_vec3 up, struct lum_vec3 wi)
{
    struct bearing b = bearing_of(sight, up, wi);
    if (!(b.ahead > 0.0) || b.above < 0.0)
        return closed_form(&b);
    return lum_position_index_table(b.aside / b.ahead, b.above / b.ahead);
}
