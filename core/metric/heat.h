/* Colours for maps of errors: black over violet, red and orange to nearly white. Equal steps are equal steps of
 * lightness (CIE L*), so that a map reads the same in grey and to those who see colours otherwise. */
#ifndef LUM_CORE_METRIC_HEAT_H
#define LUM_CORE_METRIC_HEAT_H

#include <stdint.h>

#define LUM_HEAT_COLORS 256u /* from black to L* = 98 in steps of .38: a grey of 8 bits has .39 */

struct lum_heat {
    uint8_t srgb[LUM_HEAT_COLORS][3];
};
void lum_heat_init(struct lum_heat *heat);
/* value: 0 to 1, others as the nearer of them. What is not finite is cyan, a colour that no value has. */
void lum_heat_color(const struct lum_heat *heat, double value, uint8_t ret_srgb[3]);

#endif
