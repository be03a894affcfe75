/* Can light go from one surface of the scene to another? */
#ifndef LUM_CORE_TRACE_FACING_H
#define LUM_CORE_TRACE_FACING_H

struct lum_snapshot;

enum lum_facing {
    LUM_FACING_NOTHING, /* no surface reflects */
    LUM_FACING_FLAT,    /* all that reflect lie in one plane */
    LUM_FACING_CONVEX,  /* one opaque convex solid reflects, and every light is outside */
    LUM_FACING_EACH_OTHER,
};

/* Conservative: says LUM_FACING_EACH_OTHER unless it is certain that no two places see each other. Cheap: usually
 * decided by a few triangles. */
enum lum_facing lum_surfaces_facing(const struct lum_snapshot *snapshot);

#endif
