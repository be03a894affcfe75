/* Scenes put together at random from what is odd but allowed, and made smaller while they still show a fault.
 *
 * A scene is a list of items, each told by its own number. What an item is like is picked from short tables whose first
 * entry is the plain one; a fault is made smaller by taking items away and by making picks of the others plain. The
 * report names what is left. */
#ifndef LUM_TESTS_SUPPORT_RANDOM_SCENE_H
#define LUM_TESTS_SUPPORT_RANDOM_SCENE_H

#include "tests/support/rig.h"

#define RANDOM_ITEMS 14u

struct random_item {
    uint64_t seed;
    uint32_t plain; /* bit k: pick k is the first of its table */
    bool gone;
};

struct random_scene {
    uint64_t seed;
    double light; /* times what every light gives */
    double scale; /* times all lengths; what is per length follows, so that all looks alike */
    bool all_lit; /* nothing is shown as it is, whatever the light */
    bool clear;   /* no fog leaves less of light than a float can hold */
    struct random_item items[RANDOM_ITEMS];
};

struct random_scene random_scene_make(uint64_t seed);
/* Puts it into a rig that was just begun, camera too, and commits. */
void random_scene_put(struct rig *r, const struct random_scene *s);
/* One item of a scene that is already there: put as told, or taken away if it is gone. Not committed. */
void random_scene_put_item(struct rig *r, const struct random_scene *s, uint32_t item);

/* What is asked of a scene: false with a message when it does not hold. */
typedef bool random_property(const struct random_scene *s, const struct lum_method *method, char ret_what[256]);

/* Asks it of scenes from, from + 1 .. by every method. The first that fails of each method is made as small as it can
 * be, and told. $LUMEND_RANDOM_SCENES: so many scenes in place of n, to look for faults at length. */
void random_scenes_hold(const char *name, uint64_t from, uint32_t n, random_property *property);

#endif
