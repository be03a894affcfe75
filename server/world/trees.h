/* Better trees for meshes that were put in a hurry (lum_scene_hurry), made beside the pictures on a thread of its own.
 */
#ifndef LUM_SERVER_WORLD_TREES_H
#define LUM_SERVER_WORLD_TREES_H

#include <stdbool.h>

struct lum_device;
struct lum_scene;
struct lum_trees;

/* Called on that thread when there is something to take. */
struct lum_trees_ready {
    void (*tell)(void *user);
    void *user;
};

/* Gives the scene the trees that are ready, and begins with the next meshes if none is under way. True: the scene is to
 * be committed. Without memory for it, what is quickly made stays; without that for
 * the thread, until another mesh is put: then it is tried again. Thread: who writes the scene. */
bool lum_trees_turn(struct lum_trees **inout_trees, struct lum_device *device, struct lum_scene *scene,
                    const struct lum_trees_ready *ready);
void lum_trees_stop(struct lum_trees *trees); /* accepts NULL; returns when its thread has ended */

#endif
