/* Where things are. */
#ifndef LUM_PROTOCOL_RECORD_TRANSFORM_H
#define LUM_PROTOCOL_RECORD_TRANSFORM_H

#include <stdbool.h>

/* Either 16 numbers row-major, or translate / rotate_deg (XYZ Euler, applied X first) / scale; JSON form is kept. */
struct lum_record_transform {
    bool is_matrix;
    double matrix[16];
    double translate[3], rotate_deg[3], scale[3];
};
/* row-major 3x4 of either form */
void lum_record_transform_affine(const struct lum_record_transform *t, double ret_m[3][4]);

struct lum_record_box {
    bool set; /* null: everywhere */
    double min[3], max[3];
};

#endif
