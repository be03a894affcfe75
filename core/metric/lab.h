/* Opponent colours of linear Rec.709 under D65: CIE L*a*b* (CIE 15:2004, 8.2.1) and its linear form YCxCz (Flohr,
 * Kolpatzik, Balasubramanian, Carrara, Bouman, Allebach 1993), in which light can be filtered. White (1, 1, 1) is 100,
 * 0, 0 in both. */
#ifndef LUM_CORE_METRIC_LAB_H
#define LUM_CORE_METRIC_LAB_H

struct lum_lab {
    float l, a, b; /* or Y, Cx, Cz */
};

struct lum_lab lum_ycxcz_of(const float rgb[3]);
void lum_ycxcz_to_rgb(struct lum_lab c, float ret_rgb[3]);
struct lum_lab lum_lab_of(const float rgb[3]);
void lum_lab_to_rgb(struct lum_lab c, float ret_rgb[3]);

#endif
