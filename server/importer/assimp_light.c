/* Lights and cameras of an Assimp scene. Both hang on the node that has their name. */
#include <math.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "server/importer/assimp.h"

#define DEG_PER_RAD 57.295779513082320877

void lum_assimp_warn_units(struct lum_assimp *a)
{
    if (!a->warned_units)
        lum_emit_warning(&a->im->emit, "the format gives light no photometric unit: 1 is taken as 1 watt, %.0f lm",
                         LUM_LUMENS_PER_WATT);
    a->warned_units = true;
}

static struct lum_affined to_world_of(const struct lum_assimp *a, const struct aiString *name)
{
    for (size_t i = 0; i < a->n_nodes; i++)
        if (strcmp(a->nodes[i].node->mName.data, name->data) == 0)
            return a->nodes[i].to_world;
    return lum_affined_identity();
}

static bool point_of(const struct lum_affined *m, const struct aiVector3D *p, double ret_point[3])
{
    struct lum_vec3d q = lum_affined_point(m, (struct lum_vec3d){(double)p->x, (double)p->y, (double)p->z});
    const double v[3] = {q.x, q.y, q.z};
    for (int i = 0; i < 3; i++)
        if (!(fabs(v[i]) <= LUM_LIMIT_COORD_M))
            return false;
    memcpy(ret_point, v, sizeof v);
    return true;
}

/* Unit length; false for the zero vector. */
static bool direction_of(const struct lum_affined *m, const struct aiVector3D *d, double ret_direction[3])
{
    double v[3], n = 0.0;
    for (int i = 0; i < 3; i++) {
        v[i] = m->m[i][0] * (double)d->x + m->m[i][1] * (double)d->y + m->m[i][2] * (double)d->z;
        n += v[i] * v[i];
    }
    if (!(n > 0.0) || !isfinite(n))
        return false;
    for (int i = 0; i < 3; i++)
        ret_direction[i] = v[i] / sqrt(n);
    return true;
}

static const char *kind_of(enum aiLightSourceType type)
{
    switch (type) {
    case aiLightSource_POINT:
        return "point";
    case aiLightSource_SPOT:
        return "spot";
    case aiLightSource_DIRECTIONAL:
        return "directional";
    case aiLightSource_AREA:
        return "quad";
    default:
        return NULL;
    }
}

static void put_cone(struct lum_op_text *op, const struct aiLight *l)
{
    /* whole angles; 2 pi where the file says nothing */
    double outer = (double)l->mAngleOuterCone * 0.5 * DEG_PER_RAD,
           inner = (double)l->mAngleInnerCone * 0.5 * DEG_PER_RAD;
    outer = isfinite(outer) ? fmin(fmax(outer, 0.01), 90.0) : 45.0;
    inner = isfinite(inner) ? fmin(fmax(inner, 0.0), outer) : 0.0;
    lum_op_number(op, "inner_cone_deg", inner);
    lum_op_number(op, "outer_cone_deg", outer);
}

/* The quad's edges: along up and across it, emitting along the light's direction (u x v). */
static bool put_quad(struct lum_op_text *op, const struct aiLight *l, const struct lum_affined *m)
{
    double d[3], up[3], u[3], v[3];
    double width = (double)l->mSize.x, height = (double)l->mSize.y;
    if (!direction_of(m, &l->mDirection, d) || !direction_of(m, &l->mUp, up) || !(width > 0.0) || !(height > 0.0))
        return false;
    const double side[3] = {up[1] * d[2] - up[2] * d[1], up[2] * d[0] - up[0] * d[2], up[0] * d[1] - up[1] * d[0]};
    for (int i = 0; i < 3; i++) {
        u[i] = side[i] * width;
        v[i] = -up[i] * height; /* side x -up = up x side, which points along d */
    }
    lum_op_numbers(op, "u", u, 3);
    lum_op_numbers(op, "v", v, 3);
    return true;
}

/* False: the light cannot be described. */
static bool describe(struct lum_op_text *op, const struct aiLight *l, const char *kind, const struct lum_affined *m)
{
    double p[3], d[3];
    bool directional = strcmp(kind, "directional") == 0;
    lum_op_string(op, "kind", kind);
    if (!directional) {
        if (!point_of(m, &l->mPosition, p))
            return false;
        lum_op_numbers(op, "position", p, 3);
    }
    if (strcmp(kind, "quad") == 0)
        return put_quad(op, l, m);
    if (strcmp(kind, "point") == 0)
        return true;
    if (!direction_of(m, &l->mDirection, d))
        return false;
    lum_op_numbers(op, "direction", d, 3);
    if (!directional)
        put_cone(op, l);
    return true;
}

static enum lum_status send_light(struct lum_assimp *a, uint32_t i, struct lum_error *err)
{
    const struct aiLight *l = a->scene->mLights[i];
    const char *kind = kind_of(l->mType);
    double c[3] = {(double)l->mColorDiffuse.r, (double)l->mColorDiffuse.g, (double)l->mColorDiffuse.b};
    double y = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    struct lum_affined to_world = to_world_of(a, &l->mName);
    struct lum_id_request name = {"", l->mName.data, "light", i};
    struct lum_op_text op;
    lum_id id;
    enum lum_status status = lum_ids_make(&a->im->ids, &name, id, err);
    if (status)
        return status;
    lum_op_begin(&op, "light", id);
    if (!kind || !(y > 0.0) || y > 1e9 || !describe(&op, l, kind, &to_world)) {
        lum_emit_warning(&a->im->emit, "light %.60s is left out: its kind, colour or place is not usable",
                         l->mName.data);
        return LUM_OK;
    }
    for (int k = 0; k < 3; k++)
        c[k] = fmin(fmax(c[k] / y, 0.0), 1e6);
    lum_op_numbers(&op, "color", c, 3);
    const char *quantity = strcmp(kind, "directional") == 0 ? "illuminance_lx"
                           : strcmp(kind, "quad") == 0      ? "luminance_cd_m2"
                                                            : "intensity_cd";
    lum_op_number(&op, quantity, y * LUM_LUMENS_PER_WATT);
    lum_assimp_warn_units(a);
    return lum_emit_op(&a->im->emit, &op, err);
}

enum lum_status lum_assimp_lights(struct lum_assimp *a, struct lum_error *err)
{
    enum lum_status status = LUM_OK;
    if (a->scene->mNumLights > LUM_LIMIT_LIGHTS)
        return lum_fail(err, LUM_ERR_LIMIT, "", "has more than %u lights", LUM_LIMIT_LIGHTS);
    for (unsigned i = 0; i < a->scene->mNumLights && !status; i++)
        status = send_light(a, i, err);
    return status;
}

static enum lum_status send_camera(struct lum_assimp *a, uint32_t i, struct lum_error *err)
{
    const struct aiCamera *c = a->scene->mCameras[i];
    struct lum_affined to_world = to_world_of(a, &c->mName);
    double p[3], d[3], up[3], target[3];
    double hfov = (double)c->mHorizontalFOV, aspect = c->mAspect > 0.0f ? (double)c->mAspect : 1.5;
    double vfov_deg = 2.0 * atan(tan(0.5 * hfov) / aspect) * DEG_PER_RAD;
    if (!point_of(&to_world, &c->mPosition, p) || !direction_of(&to_world, &c->mLookAt, d) ||
        !direction_of(&to_world, &c->mUp, up) || !(vfov_deg > 0.0)) {
        lum_emit_warning(&a->im->emit, "camera %.60s is left out: its angle or place is not usable", c->mName.data);
        return LUM_OK;
    }
    double along = d[0] * up[0] + d[1] * up[1] + d[2] * up[2];
    if (fabs(along) > 0.999) { /* up along the view: any other axis does */
        up[0] = up[1] = up[2] = 0.0;
        up[fabs(d[1]) < 0.9 ? 1 : 2] = 1.0;
    }
    for (int k = 0; k < 3; k++)
        target[k] = p[k] + d[k];
    struct lum_id_request name = {"", c->mName.data, "camera", i};
    struct lum_op_text op;
    lum_id id;
    enum lum_status status = lum_ids_make(&a->im->ids, &name, id, err);
    if (status)
        return status;
    lum_op_begin(&op, "camera", id);
    lum_op_numbers(&op, "position", p, 3);
    lum_op_numbers(&op, "target", target, 3);
    lum_op_numbers(&op, "up", up, 3);
    lum_op_number(&op, "vfov_deg", fmin(fmax(vfov_deg, 1.0), 179.0));
    return lum_emit_op(&a->im->emit, &op, err);
}

enum lum_status lum_assimp_cameras(struct lum_assimp *a, struct lum_error *err)
{
    enum lum_status status = LUM_OK;
    for (unsigned i = 0; i < a->scene->mNumCameras && !status; i++)
        status = send_camera(a, i, err);
    return status;
}
