#include "core/light/solar.h"

static double wrapped(double deg)
{
    return deg - 360.0 * floor(deg / 360.0);
}

/* Meeus 7.1. */
double lum_julian_day(int year, int month, int day, double hour)
{
    int y = month > 2 ? year : year - 1, m = month > 2 ? month : month + 12;
    double century = floor(y / 100.0);
    return floor(365.25 * (y + 4716)) + floor(30.6001 * (m + 1)) + day + 2.0 - century + floor(century / 4.0) - 1524.5 +
           hour / 24.0;
}

int lum_day_of_year(int year, int month, int day)
{
    return (int)(lum_julian_day(year, month, day, 0.0) - lum_julian_day(year, 1, 1, 0.0)) + 1;
}

/* Of the sun, in degrees. */
struct place {
    double mean_longitude, declination, right_ascension, nutation, obliquity;
};

/* Meeus 25, with the corrections of the low accuracy for the apparent place. T: Julian centuries since 2000.0. */
static struct place place_of(double t)
{
    double l0 = wrapped(280.46646 + t * (36000.76983 + t * 0.0003032));
    double anomaly = LUM_RAD_PER_DEG * wrapped(357.52911 + t * (35999.05029 - t * 0.0001537));
    double centre = (1.914602 - t * (0.004817 + t * 0.000014)) * sin(anomaly) +
                    (0.019993 - t * 0.000101) * sin(2.0 * anomaly) + 0.000289 * sin(3.0 * anomaly);
    double node = LUM_RAD_PER_DEG * wrapped(125.04 - 1934.136 * t), nutation = -0.00478 * sin(node);
    double longitude = LUM_RAD_PER_DEG * (l0 + centre - 0.00569 + nutation);
    double obliquity = 23.4392911 - t * (0.0130042 + t * (1.64e-7 - t * 5.04e-7)) + 0.00256 * cos(node);
    double e = LUM_RAD_PER_DEG * obliquity;
    return (struct place){.mean_longitude = l0,
                          .declination = asin(sin(e) * sin(longitude)) / LUM_RAD_PER_DEG,
                          .right_ascension = wrapped(atan2(cos(e) * sin(longitude), cos(longitude)) / LUM_RAD_PER_DEG),
                          .nutation = nutation,
                          .obliquity = obliquity};
}

/* Meeus 16.4, of air at 10 degrees and 101 kPa. It does not hold far below the horizon, where nothing is seen: there it
 * fades. */
static double refraction_deg(double elevation_deg)
{
    double h = fmax(elevation_deg, -1.0), fade = fmin(fmax((elevation_deg + 6.0) / 5.0, 0.0), 1.0);
    return fade * fmax(1.02 / tan(LUM_RAD_PER_DEG * (h + 10.3 / (h + 5.11))), 0.0) / 60.0;
}

struct lum_solar_position lum_solar_position(double julian_day, double latitude_deg, double longitude_deg)
{
    double days = julian_day - 2451545.0, t = days / 36525.0;
    struct place p = place_of(t);
    /* apparent sidereal time at Greenwich: 12.4 */
    double sidereal = 280.46061837 + 360.98564736629 * days + t * t * (0.000387933 - t / 38710000.0) +
                      p.nutation * cos(LUM_RAD_PER_DEG * p.obliquity);
    double hour = LUM_RAD_PER_DEG * (wrapped(sidereal) + longitude_deg - p.right_ascension);
    double latitude = LUM_RAD_PER_DEG * latitude_deg, declination = LUM_RAD_PER_DEG * p.declination;
    /* to north, east and up: 13.5 and 13.6 */
    double north = sin(declination) * cos(latitude) - cos(declination) * sin(latitude) * cos(hour);
    double east = -cos(declination) * sin(hour);
    double up = sin(declination) * sin(latitude) + cos(declination) * cos(latitude) * cos(hour);
    double elevation = atan2(up, hypot(north, east)) / LUM_RAD_PER_DEG;
    double lead =
        wrapped(p.mean_longitude - 0.0057183 - p.right_ascension + p.nutation * cos(LUM_RAD_PER_DEG * p.obliquity));
    return (struct lum_solar_position){.declination_deg = p.declination,
                                       .equation_of_time_min = 4.0 * (lead > 180.0 ? lead - 360.0 : lead), /* 28.1 */
                                       .elevation_deg = elevation,
                                       .apparent_deg = fmin(elevation + refraction_deg(elevation), 90.0),
                                       .azimuth_deg = wrapped(atan2(east, north) / LUM_RAD_PER_DEG)};
}

struct lum_vec3d lum_solar_direction(double elevation_deg, double azimuth_deg, double north_deg)
{
    double e = LUM_RAD_PER_DEG * elevation_deg, a = LUM_RAD_PER_DEG * (azimuth_deg + north_deg);
    return (struct lum_vec3d){cos(e) * sin(a), sin(e), -cos(e) * cos(a)};
}

double lum_sun_illuminance(double elevation_deg, double extinction, int day_of_year)
{
    if (!(elevation_deg > 0.0))
        return 0.0;
    double mass = 1.0 / (sin(LUM_RAD_PER_DEG * elevation_deg) + 0.50572 * pow(elevation_deg + 6.07995, -1.6364));
    double near = day_of_year > 0 ? 1.0 + 0.034 * cos(2.0 * LUM_PI_D * (day_of_year - 2) / 365.0) : 1.0;
    return 127500.0 * near * exp(-extinction * mass);
}

double lum_sky_illuminance(int cie_type, double sun_elevation_rad)
{
    static const double clear[3] = {800.0, 15500.0, 0.5}, partly[3] = {300.0, 45000.0, 1.0},
                        overcast[3] = {300.0, 21000.0, 1.0};
    const double *c = cie_type >= 11 && cie_type <= 15 ? clear : cie_type >= 6 && cie_type <= 10 ? partly : overcast;
    if (sun_elevation_rad >= 0.0)
        return c[0] + c[1] * pow(sin(sun_elevation_rad), c[2]);
    double below = -sun_elevation_rad / LUM_RAD_PER_DEG;
    return below < 18.0 ? c[0] * exp(-0.91 * below) : 0.0; /* 0.91: 800 lx become 3.4 lx at 6 degrees */
}
