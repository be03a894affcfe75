/* Private to core/scene: instances whose surface shines, as lights. */
#ifndef LUM_CORE_SCENE_MESH_LIGHTS_H
#define LUM_CORE_SCENE_MESH_LIGHTS_H

#include "core/scene/parts.h"
#include "core/scene/tables.h"

struct lum_area_cdf;

/* lum_light.mean_emission, and what it was found for: holds references to the images. */
struct lum_emission_mean {
    struct lum_texture emission, alpha;
    enum lum_alpha_mode alpha_mode;
    float alpha_factor, alpha_cutoff;
    float mean;
};
/* What is known of such a surface. */
struct lum_mesh_surface {
    struct lum_area_cdf *cdf;
    struct lum_emission_mean mean; /* zero where there are neither textures nor holes */
};

uint32_t lum_mesh_lights_count(const struct lum_light_input *in);
/* Adds them behind the lights of the part, which has room; sets the light index of their instances. */
enum lum_status lum_mesh_lights_add(const struct lum_light_input *in, struct lum_light_part *part,
                                    struct lum_error *err);
/* Gives up what the part holds of one; of other lights that is nothing. */
void lum_mesh_light_drop(struct lum_light_part *part, uint32_t light);

/* Where one is and what it can light. */
struct lum_light_reach lum_mesh_light_reach(const struct lum_light_part *part, const struct lum_instance *instance,
                                            uint32_t light);

#endif
