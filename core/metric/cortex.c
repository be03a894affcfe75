#include "core/metric/cortex.h"

#include <math.h>

#include "core/math/vec.h"

float lum_cortex_low_pass(float frequency, int octave)
{
    float half = ldexpf(1.0f, -octave), width = half * (2.0f / 3.0f), begin = half - 0.5f * width;
    if (frequency <= begin)
        return 1.0f;
    return frequency < begin + width ? 0.5f + 0.5f * cosf(LUM_PI * (frequency - begin) / width) : 0.0f;
}

float lum_cortex_base(float frequency)
{
    float end = ldexpf(4.0f / 3.0f, -LUM_CORTEX_BANDS), sigma = end / 3.0f;
    return frequency < end ? expf(-0.5f * frequency * frequency / (sigma * sigma)) : 0.0f;
}

float lum_cortex_ring(float frequency, int band)
{
    float below = band + 1 < LUM_CORTEX_BANDS ? lum_cortex_low_pass(frequency, band + 1) : lum_cortex_base(frequency);
    return lum_cortex_low_pass(frequency, band) - below;
}

float lum_cortex_fan(float angle_deg, int orientation)
{
    const float width = 180.0f / LUM_CORTEX_ORIENTATIONS;
    float away = fabsf(remainderf(angle_deg - width * (float)orientation, 180.0f));
    return away < width ? 0.5f + 0.5f * cosf(LUM_PI * away / width) : 0.0f;
}
