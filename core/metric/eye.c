#include "core/metric/eye.h"

#include <math.h>

double lum_eye_pupil_mm(double luminance)
{
    return 4.9 - 3.0 * tanh(0.4 * log10(luminance) + 1.0);
}

double lum_eye_transfer(double frequency, double pupil_mm)
{
    return exp(-pow(frequency / (20.9 - 2.1 * pupil_mm), 1.3 - 0.07 * pupil_mm));
}

double lum_eye_squeeze(double angle_rad)
{
    return 0.856 * pow(LUM_EYE_DISTANCE_M, 0.14) * (0.11 * cos(4.0 * angle_rad) + 0.89);
}

double lum_eye_curve(double frequency, double luminance, double picture_deg2)
{
    if (!(frequency > 0.0))
        return 0.0;
    double a = 0.801 * pow(1.0 + 0.7 / luminance, -0.2), b = 0.3 * pow(1.0 + 100.0 / luminance, 0.15);
    double f = 0.9 * frequency, area = 3.23 * pow(frequency * frequency * picture_deg2, -0.3);
    double low = pow(1.0 + area * area * area * area * area, -0.2);
    return low * a * f * exp(-b * f) * sqrt(1.0 + 0.06 * exp(b * f));
}

double lum_eye_sensitivity(double frequency, double angle_rad, double luminance, double picture_deg2)
{
    return fmin(lum_eye_curve(frequency / lum_eye_squeeze(angle_rad), luminance, picture_deg2),
                lum_eye_curve(frequency, luminance, picture_deg2));
}

/* The function rises to its peak and falls after it: thirds that cannot hold it are cut off. Frequencies 0.05 to 50,
 * over their logarithm; after 40 cuts the peak is known to 1e-6. */
double lum_eye_peak_sensitivity(double luminance, double picture_deg2)
{
    double lo = log(0.05), hi = log(50.0);
    for (int i = 0; i < 40; i++) {
        double a = lo + (hi - lo) / 3.0, b = hi - (hi - lo) / 3.0;
        if (lum_eye_sensitivity(exp(a), 0.0, luminance, picture_deg2) <
            lum_eye_sensitivity(exp(b), 0.0, luminance, picture_deg2))
            lo = a;
        else
            hi = b;
    }
    return lum_eye_sensitivity(exp(0.5 * (lo + hi)), 0.0, luminance, picture_deg2);
}

/* d(JND) = dL / (L threshold(L)), by trapezia. */
void lum_jnd_scale_init(struct lum_jnd_scale *scale, double picture_deg2)
{
    const double first = log(LUM_EYE_LUMINANCE_MIN),
                 step = log(LUM_EYE_LUMINANCE_MAX / LUM_EYE_LUMINANCE_MIN) / (LUM_JND_STEPS - 1);
    const double bright = lum_eye_peak_sensitivity(LUM_EYE_BRIGHT, picture_deg2) * LUM_EYE_PEAK_CONTRAST;
    double sum = 0.0, before = 0.0;
    for (uint32_t i = 0; i < LUM_JND_STEPS; i++) {
        double rate = lum_eye_peak_sensitivity(exp(first + step * i), picture_deg2) / bright;
        sum += i > 0 ? 0.5 * (before + rate) * step : 0.0;
        scale->at[i] = (float)sum;
        before = rate;
    }
}

float lum_jnd_of(const struct lum_jnd_scale *scale, float luminance)
{
    const float first = logf((float)LUM_EYE_LUMINANCE_MIN), last = logf((float)LUM_EYE_LUMINANCE_MAX);
    float t = (logf(fmaxf(luminance, (float)LUM_EYE_LUMINANCE_MIN)) - first) / (last - first) * (LUM_JND_STEPS - 1);
    t = fminf(fmaxf(t, 0.0f), (float)(LUM_JND_STEPS - 1));
    uint32_t i = (uint32_t)t < LUM_JND_STEPS - 2 ? (uint32_t)t : LUM_JND_STEPS - 2;
    return scale->at[i] + (t - (float)i) * (scale->at[i + 1] - scale->at[i]);
}
