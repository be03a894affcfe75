/* The cortex transform (Watson 1987, as modified by Daly 1993): filters that part a picture into bands of spatial
 * frequency and orientation, whose sum is the picture. Frequencies in cycles per pixel. */
#ifndef LUM_CORE_METRIC_CORTEX_H
#define LUM_CORE_METRIC_CORTEX_H

#define LUM_CORTEX_BANDS 5        /* 0: the finest, around half a cycle per pixel; each next an octave coarser */
#define LUM_CORTEX_ORIENTATIONS 6 /* every 30 degrees */

/* 1 below 2^-octave, 0 above, a cosine between. */
float lum_cortex_low_pass(float frequency, int octave);
/* What is coarser than all bands; a Gaussian. */
float lum_cortex_base(float frequency);
/* One ring of frequencies: low_pass(band) - low_pass(band + 1), the last down to the base. */
float lum_cortex_ring(float frequency, int band);
/* The part of a ring in one direction; those of all orientations sum to 1. angle_deg: -180 to 180. */
float lum_cortex_fan(float angle_deg, int orientation);

#endif
