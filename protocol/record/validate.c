/* Rules that span the fields of a record. */
#include "protocol/record/field.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "protocol/record/date.h"
#include "protocol/record/light_kinds.h"

static bool invalid(struct lum_proto_error *err, const char *path, const char *text)
{
    return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", path, "%s", text);
}

static double norm_of_cross(const double a[3], const double b[3])
{
    return hypot(hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2]), a[0] * b[1] - a[1] * b[0]);
}

static double norm(const double a[3])
{
    return hypot(hypot(a[0], a[1]), a[2]);
}

static bool black(const double color[3])
{
    return color[0] == 0.0 && color[1] == 0.0 && color[2] == 0.0;
}

static bool validate_transform(const struct lum_record_transform *t, struct lum_proto_error *err)
{
    if (t->is_matrix && (t->matrix[12] != 0 || t->matrix[13] != 0 || t->matrix[14] != 0 || t->matrix[15] != 1))
        return invalid(err, "transform", "the last row of a matrix must be 0 0 0 1");
    double m[3][4];
    lum_record_transform_affine(t, m);
    double det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                 m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    if (det == 0.0 || !isfinite(1.0 / det))
        return invalid(err, "transform", "transform must be invertible: no scale may be 0");
    return true;
}

static bool validate_indices(const struct lum_record_mesh *m, struct lum_proto_error *err)
{
    size_t n_vertices = m->positions.n / 3;
    if (m->indices.n == 0 || m->indices.n % 3 != 0)
        return invalid(err, "indices", "indices must hold three numbers per triangle, and one triangle at least");
    for (size_t i = 0; i < m->indices.n; i++)
        if (m->indices.u32[i] >= n_vertices)
            return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "indices",
                                  "indices/%zu is %u, but there are %zu vertices", i, m->indices.u32[i], n_vertices);
    return true;
}

static bool validate_mesh(const struct lum_record_mesh *m, struct lum_proto_error *err)
{
    if ((m->shape[0] != '\0') == (m->positions.n > 0))
        return invalid(err, "shape", "a mesh needs either shape or positions");
    if (m->shape[0] != '\0') {
        if (m->indices.n || m->normals.n || m->uvs.n || m->tangents.n || m->colors.n)
            return invalid(err, "shape", "a shape brings its own arrays: give shape or arrays");
        return true;
    }
    size_t n_vertices = m->positions.n / 3;
    if (m->positions.n % 3 != 0)
        return invalid(err, "positions", "positions must hold three numbers per vertex");
    if (n_vertices > LUM_LIMIT_VERTICES || m->indices.n / 3 > LUM_LIMIT_TRIANGLES)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "limit_exceeded", "positions",
                              "a mesh may have %u vertices and %u triangles", LUM_LIMIT_VERTICES, LUM_LIMIT_TRIANGLES);
    if (m->normals.n && m->normals.n != 3 * n_vertices)
        return invalid(err, "normals", "normals must hold three numbers per vertex");
    if (m->uvs.n && m->uvs.n != 2 * n_vertices)
        return invalid(err, "uvs", "uvs must hold two numbers per vertex");
    if (m->tangents.n && m->tangents.n != 4 * n_vertices)
        return invalid(err, "tangents", "tangents must hold four numbers per vertex");
    if (m->colors.n && m->colors.n != 3 * n_vertices)
        return invalid(err, "colors", "colors must hold three numbers per vertex");
    return validate_indices(m, err);
}

static bool validate_image(const struct lum_record_image *m, struct lum_proto_error *err)
{
    size_t texel = strcmp(m->texel, "rgb32f") == 0 ? 12 : 4;
    if (m->asset[0] == '\0' && m->n_bytes == 0)
        return invalid(err, "asset", "an image needs either asset or pixels");
    if (m->n_bytes == 0)
        return true;
    if ((uint64_t)m->width * m->height > LUM_LIMIT_IMAGE_TEXELS)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "limit_exceeded", "width", "an image may have %u texels",
                              LUM_LIMIT_IMAGE_TEXELS);
    if (m->n_bytes != (size_t)m->width * m->height * texel)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "pixels",
                              "%u x %u texels of %s take %zu bytes, not %zu", m->width, m->height, m->texel,
                              (size_t)m->width * m->height * texel, m->n_bytes);
    for (size_t i = 0; texel == 12 && i < m->n_bytes; i += 4) {
        float v;
        memcpy(&v, m->pixels + i, 4);
        if (!(v >= 0.0f) || !isfinite(v))
            return invalid(err, "pixels", "pixels must be finite and not negative");
    }
    return true;
}

/* ---- lights ---- */

static bool validate_photometric(const struct lum_record_light *l, struct lum_proto_error *err)
{
    const struct lum_fields *fields = lum_fields_of(LUM_RECORD_LIGHT);
    char wanted[64] = "";
    const char *given = NULL, *first = NULL;
    bool natural = false;
    unsigned has = lum_light_kind_has(l->kind);
    for (const struct lum_field *f = fields->fields; f < fields->fields + fields->n; f++) {
        if (f->group != LUM_GROUP_PHOTOMETRIC)
            continue;
        bool fits = f->has & has;
        if (fits) {
            size_t n = strlen(wanted);
            snprintf(wanted + n, sizeof wanted - n, "%s%s", first ? " or " : "", f->name);
            first = first ? first : f->name;
        }
        if (((const struct lum_opt *)((const char *)l + f->offset))->set) {
            given = f->name;
            natural = fits;
        }
    }
    if (natural || (!given && (has & LUM_HAS_AMOUNT)))
        return true;
    return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, given ? "invalid_value" : "missing_field", given ? given : first,
                          "a %s light takes %s%s%s", l->kind, wanted, given ? ", not " : "", given ? given : "");
}

static bool validate_sun(const struct lum_record_light *l, struct lum_proto_error *err)
{
    int ymd[3];
    bool directed = l->azimuth_deg.set && l->elevation_deg.set;
    if (l->azimuth_deg.set != l->elevation_deg.set)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "missing_field",
                              l->azimuth_deg.set ? "elevation_deg" : "azimuth_deg",
                              "azimuth_deg and elevation_deg go together");
    if (l->date[0] == '\0' && !directed)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "missing_field", "date",
                              "a sun takes a date, or azimuth_deg and elevation_deg");
    if (l->date[0] == '\0' || lum_date_read(l->date, ymd))
        return true;
    return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "date",
                          "there is no date %s from %d to %d: date is YYYY-MM-DD", l->date, LUM_DATE_FIRST_YEAR,
                          LUM_DATE_LAST_YEAR);
}

static bool validate_light(const struct lum_record_light *l, struct lum_proto_error *err)
{
    unsigned has = lum_light_kind_has(l->kind);
    if (!validate_photometric(l, err))
        return false;
    if ((has & LUM_HAS_DIRECTION) && norm(l->direction) == 0.0)
        return invalid(err, "direction", "direction must not be 0 0 0");
    if ((has & LUM_HAS_EDGES) && norm_of_cross(l->u, l->v) == 0.0)
        return invalid(err, "u", "the edges u and v must span an area");
    if ((has & LUM_HAS_RADIUS) && l->radius == 0.0)
        return invalid(err, "radius", "radius must be more than 0");
    if ((has & LUM_HAS_CONES) && l->inner_cone_deg > l->outer_cone_deg)
        return invalid(err, "inner_cone_deg", "inner_cone_deg must not be more than outer_cone_deg");
    if (black(l->color))
        return invalid(err, "color", "color gives a hue: it must not be black; use on or the photometric quantity");
    bool measured = l->asset[0] != '\0' || l->web;
    if ((has & LUM_HAS_WEB) && !measured)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "missing_field", "asset", "an ies light takes asset or web");
    if (measured && !(has & LUM_HAS_WEB))
        return invalid(err, l->asset[0] != '\0' ? "asset" : "web", "only an ies light takes asset or web");
    if (l->image[0] != '\0' && !(has & LUM_HAS_IMAGE))
        return invalid(err, "image", "only an environment light takes an image");
    return !(has & LUM_HAS_SUN) || validate_sun(l, err);
}

static bool validate_object(const struct lum_record_object *o, struct lum_proto_error *err)
{
    if (o->flux_lm.set && o->luminance_cd_m2.set)
        return invalid(err, "luminance_cd_m2", "an object takes flux_lm or luminance_cd_m2, not both");
    if (o->cct_k.set && !black(o->color))
        return invalid(err, "cct_k", "an object takes color or cct_k, not both");
    return validate_transform(&o->transform, err);
}

bool lum_camera_validate(const struct lum_record_camera *c, struct lum_proto_error *err)
{
    double d[3];
    for (int i = 0; i < 3; i++)
        d[i] = c->target[i] - c->position[i];
    if (norm(d) == 0.0)
        return invalid(err, "target", "target must differ from position");
    /* sin of the angle below 1e-6: at a metre's distance the picture's right vector would be known to a micrometre */
    if (!(norm_of_cross(d, c->up) > 1e-6 * norm(d) * norm(c->up)))
        return invalid(err, "up", "up must not be parallel to the view direction");
    return true;
}

static bool validate_medium(const struct lum_record_medium *m, struct lum_proto_error *err)
{
    for (int i = 0; m->box.set && i < 3; i++)
        if (!(m->box.min[i] < m->box.max[i]))
            return invalid(err, "box", "box: min must be below max on every axis");
    return true;
}

static bool is_given(const struct lum_record_sensor *s, const struct lum_field *f)
{
    return f->kind == LUM_FIELD_OPT && ((const struct lum_opt *)((const char *)s + f->offset))->set;
}

/* Eyes at points want no lux, and other points no UGR. */
static bool validate_glare(const struct lum_record_sensor *s, bool observer, struct lum_proto_error *err)
{
    static const double upright[3] = {0.0, 1.0, 0.0};
    bool eyes = !observer && strcmp(s->quantity, "ugr") == 0;
    if (!observer && !eyes && s->target_ugr.set)
        return invalid(err, "target_ugr", "target_ugr is for observers and for quantity ugr");
    if (!eyes)
        return true;
    if (s->target_lx.set || s->target_uo.set)
        return invalid(err, s->target_lx.set ? "target_lx" : "target_uo",
                       "a sensor of quantity ugr has no target of illuminance");
    if (s->directions > 1.0 && !(norm_of_cross(s->direction, upright) > 1e-6 * norm(s->direction)))
        return invalid(err, "direction",
                       "lines of sight along the vertical do not turn about it: give one that does, or "
                       "directions 1");
    return true;
}

/* True when the kind is among those that have the field. */
static bool is_for(const struct lum_field *f, const char *kind)
{
    size_t n = strlen(kind);
    for (const char *w = f->only; w; w = strchr(w, '|') ? strchr(w, '|') + 1 : NULL)
        if (strncmp(w, kind, n) == 0 && (w[n] == '|' || w[n] == '\0'))
            return true;
    return !f->only;
}

static bool validate_sensor(const struct lum_record_sensor *s, struct lum_proto_error *err)
{
    const struct lum_fields *t = lum_fields_of(LUM_RECORD_SENSOR);
    bool observer = strcmp(s->kind, "observer") == 0, grid = strcmp(s->kind, "grid") == 0;
    bool faces = observer || strcmp(s->quantity, "semicylindrical") == 0;
    for (const struct lum_field *f = t->fields; f < t->fields + t->n; f++)
        if (is_given(s, f) && !is_for(f, s->kind))
            return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", f->name, "a sensor of kind %s has no %s",
                                  s->kind, f->name);
    if (norm(s->normal) == 0.0)
        return invalid(err, "normal", "normal must not be 0 0 0");
    if (norm(s->direction) == 0.0)
        return invalid(err, "direction", "direction must not be 0 0 0");
    if (!validate_glare(s, observer, err))
        return false;
    if (faces && !observer && !(norm_of_cross(s->direction, s->normal) > 1e-6 * norm(s->direction) * norm(s->normal)))
        return invalid(err, "direction", "a half cylinder cannot face along its axis, which is normal");
    if (strcmp(s->kind, "line") == 0 && norm(s->u) == 0.0)
        return invalid(err, "u", "u must not be 0 0 0: it is the line");
    if (grid && norm_of_cross(s->u, s->v) == 0.0)
        return invalid(err, "u", "the edges u and v must span an area");
    return true;
}

unsigned lum_patch_channels(const struct lum_record_patch *p)
{
    unsigned n = strncmp(p->channels, "rgb", 3) == 0 ? 3 : 1;
    return strcmp(p->channels + strlen(p->channels) - 2, "16") == 0 ? 2 * n : n;
}

static bool validate_patch(const struct lum_record_patch *p, struct lum_proto_error *err)
{
    bool artnet = strcmp(p->protocol, "artnet") == 0;
    unsigned n = lum_patch_channels(p);
    if (artnet ? p->universe > 32767.0 : p->universe < 1.0)
        return invalid(err, "universe",
                       artnet ? "universe of artnet is a port address: 0 to 32767"
                              : "universe of sacn must be 1 to 63999");
    if (p->address + n <= 513.0)
        return true;
    return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "address",
                          "%s takes %u channels of 512: address must be 1 to %u", p->channels, n, 513 - n);
}

/* What is transmitted is not reflected. Sums that are above 1 by rounding alone are let pass. */
static bool validate_material(const struct lum_record_material *m, struct lum_proto_error *err)
{
    if (black(m->emission_color) && m->emission_cd_m2 != 0.0)
        return invalid(err, "emission_color", "emission_color gives a hue: it must not be black");
    for (int c = 0; c < 3; c++)
        if (m->diffuse_transmittance[c] > 0.0 && !(m->base_color[c] + m->diffuse_transmittance[c] <= 1.0 + 5e-7))
            return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "diffuse_transmittance",
                                  "diffuse_transmittance/%d is %g, where base_color leaves at most %g: lower "
                                  "base_color, which is what the sheet reflects",
                                  c, m->diffuse_transmittance[c], 1.0 - m->base_color[c]);
    return true;
}

static bool validate_render(const struct lum_record_render *r, struct lum_proto_error *err)
{
    double root = floor(sqrt(r->shadow_samples) + 0.5);
    if (root * root != r->shadow_samples)
        return invalid(err, "shadow_samples", "shadow_samples must be 1, 4, 9 or 16");
    return true;
}

bool lum_record_validate(const struct lum_record *r, struct lum_proto_error *err)
{
    switch (r->type) {
    case LUM_RECORD_MESH:
        return validate_mesh(&r->mesh, err);
    case LUM_RECORD_IMAGE:
        return validate_image(&r->image, err);
    case LUM_RECORD_MATERIAL:
        return validate_material(&r->material, err);
    case LUM_RECORD_OBJECT:
        return validate_object(&r->object, err);
    case LUM_RECORD_LIGHT:
        return validate_light(&r->light, err);
    case LUM_RECORD_MEDIUM:
        return validate_medium(&r->medium, err);
    case LUM_RECORD_CAMERA:
        return lum_camera_validate(&r->camera, err);
    case LUM_RECORD_SENSOR:
        return validate_sensor(&r->sensor, err);
    case LUM_RECORD_PATCH:
        return validate_patch(&r->patch, err);
    case LUM_RECORD_PRESET:
        return lum_lamps_validate(&r->preset.lamps, err);
    case LUM_RECORD_RENDER:
        return validate_render(&r->render, err);
    case LUM_RECORD_IMPORT:
        return validate_transform(&r->import.transform, err);
    case LUM_RECORD_TYPE_COUNT:
        break;
    }
    return false;
}
