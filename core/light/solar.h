/* Where the sun stands, and how much light it and the sky give where nobody measured it. */
#ifndef LUM_CORE_LIGHT_SOLAR_H
#define LUM_CORE_LIGHT_SOLAR_H

#include "core/math/vec.h"

struct lum_solar_position {
    double declination_deg, equation_of_time_min; /* of the moment, wherever one is */
    double elevation_deg;                         /* of its centre, without air; -90..90 */
    double apparent_deg;                          /* the same, raised by refraction: where it is seen */
    double azimuth_deg;                           /* from north by east; 0..360 */
};

/* Julian day of a date of the Gregorian calendar; hour: of universal time, may be outside 0..24. */
double lum_julian_day(int year, int month, int day, double hour);
int lum_day_of_year(int year, int month, int day); /* 1: 1 January */

/* Meeus, Astronomical Algorithms, 2nd ed., chapters 13, 16, 22, 25 and 28, the sun's place of low accuracy: to 0.01
 * degrees from 1900 to 2100. Universal time stands for dynamical time: a minute, in which the sun moves by 0.0007.
 * longitude_deg: east is positive. */
struct lum_solar_position lum_solar_position(double julian_day, double latitude_deg, double longitude_deg);

/* Unit vector from the scene to the sun: +Y is up, north along -Z, turned by north_deg towards +X (east). */
struct lum_vec3d lum_solar_direction(double elevation_deg, double azimuth_deg, double north_deg);

/* lx on a plane that faces the sun, by the IES (Recommended Practice for the Calculation of Daylight Availability,
 * 1984): 127.5 klx (1 + 0.034 cos(2 pi (day - 2) / 365)) exp(-extinction m) with the relative air mass m of Kasten and
 * Young (1989). extinction: 0.21 in clear air, 0.80 through thin clouds. day_of_year 0: at the mean distance. 0 where
 * the sun is not up. */
double lum_sun_illuminance(double elevation_deg, double extinction, int day_of_year);

/* lx of a sky on the open horizontal plane, by the same source: A + B sin(elevation)^C for clear, partly cloudy and
 * overcast skies, which types 11 to 15, 6 to 10, and 1 to 5 and 16 are taken for. After sunset it fades to the 1 to 3
 * lx of the end of civil twilight, at -6 degrees, and on; below -18 degrees it is 0. */
double lum_sky_illuminance(int cie_type, double sun_elevation_rad);

#endif
