/* Each feature of the glTF reader on a file of a few lines, through the real, sandboxed lumend-import. */
#include <stdio.h>
#include <string.h>

#include "tests/unit/gltf_text.h"

static void triangle_with_default_material(void **state)
{
    struct kit *k = *state;
    assert_true(
        kit_import_gltf(k, TRIANGLE(SCENE0 MESH0) "\"nodes\":[{\"name\":\"My Node\",\"mesh\":0}]}", triangle, 36));
    const struct lum_record *mesh = kit_find(k, "m/mesh/tri"), *object = kit_find(k, "m/My_Node");
    assert_floats(&mesh->mesh.positions, triangle, 9);
    assert_indices(&mesh->mesh.indices, (uint32_t[]){0, 1, 2}, 3);
    assert_int_equal(mesh->mesh.normals.n, 0); /* none given: flat */
    assert_string_equal(object->object.mesh, "m/mesh/tri");
    assert_string_equal(object->object.material, "m/material/default");
    assert_string_equal(object->origin, "m");
    const struct lum_record *material = kit_find(k, "m/material/default");
    assert_true(material->material.metallic == 1.0); /* glTF's default material */
    assert_true(material->material.roughness == 1.0);
    assert_int_equal(k->result.n_warnings, 0);
}

static void data_uri(void **state)
{
    struct kit *k = *state;
    /* the nine floats of `triangle` */
    assert_true(kit_import_gltf(k,
                                ASSET "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/octet-stream;base64,"
                                      "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}],"
                                      "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"
                                      "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":"
                                      "\"VEC3\"}]," MESH0 "\"nodes\":[{\"mesh\":0}]}",
                                "", 0));
    assert_floats(&kit_only(k, LUM_RECORD_MESH)->mesh.positions, triangle, 9);
}

static void sparse_values_override(void **state)
{
    struct kit *k = *state;
    struct {
        float base[9];
        uint16_t index[2];
        float value[3];
    } b = {.index = {1, 0}, .value = {7, 8, 9}};
    memcpy(b.base, triangle, sizeof b.base);
    assert_true(kit_import_gltf(k,
                                ASSET SCENE0 MESH0
                                "\"buffers\":[{\"uri\":\"b.bin\",\"byteLength\":52}],\"bufferViews\":["
                                "{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,\"byteLength\":4},"
                                "{\"buffer\":0,\"byteOffset\":40,\"byteLength\":12}],"
                                "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\","
                                "\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":1,\"componentType\":5123},"
                                "\"values\":{\"bufferView\":2}}}],\"nodes\":[{\"mesh\":0}]}",
                                &b, sizeof b));
    assert_floats(&kit_only(k, LUM_RECORD_MESH)->mesh.positions, (float[]){0, 0, 0, 7, 8, 9, 0, 1, 0}, 9);
}

static void quantised_and_normalised(void **state)
{
    struct kit *k = *state;
    /* positions as signed bytes with a stride of 4; colours as normalised bytes; texture coordinates as normalised
     * shorts */
    struct {
        int8_t p[3][4];
        uint8_t c[3][4];
        uint16_t uv[3][2];
    } b = {{{0, 0, 0}, {-127, 0, 0}, {0, 127, 0}}, {{255, 0, 51, 255}}, {{65535, 0}, {0, 65535}}};
    assert_true(kit_import_gltf(
        k,
        ASSET SCENE0
        "\"extensionsUsed\":[\"KHR_mesh_quantization\"],\"extensionsRequired\":[\"KHR_mesh_quantization\"],"
        "\"buffers\":[{\"uri\":\"b.bin\",\"byteLength\":36}],\"bufferViews\":["
        "{\"buffer\":0,\"byteLength\":12,\"byteStride\":4},{\"buffer\":0,\"byteOffset\":12,\"byteLength\":12},"
        "{\"buffer\":0,\"byteOffset\":24,\"byteLength\":12}],\"accessors\":["
        "{\"bufferView\":0,\"componentType\":5120,\"normalized\":true,\"count\":3,\"type\":\"VEC3\"},"
        "{\"bufferView\":1,\"componentType\":5121,\"normalized\":true,\"count\":3,\"type\":\"VEC4\"},"
        "{\"bufferView\":2,\"componentType\":5123,\"normalized\":true,\"count\":3,\"type\":\"VEC2\"}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"COLOR_0\":1,\"TEXCOORD_0\":2}}]}],"
        "\"nodes\":[{\"mesh\":0}]}",
        &b, sizeof b));
    const struct lum_record_mesh *m = &kit_only(k, LUM_RECORD_MESH)->mesh;
    assert_floats(&m->positions, (float[]){0, 0, 0, -1, 0, 0, 0, 1, 0}, 9);
    assert_floats(&m->colors, (float[]){1, 0, 51.0f / 255.0f, 0, 0, 0, 0, 0, 0}, 9);
    assert_floats(&m->uvs, (float[]){1, 0, 0, 1, 0, 0}, 6);
}

static void strips_fans_points(void **state)
{
    struct kit *k = *state;
    struct {
        float p[5][3];
        uint8_t i[4];
    } b = {{{0}}, {4, 3, 2, 1}};
    for (int i = 0; i < 5; i++)
        b.p[i][0] = (float)i;
    assert_true(kit_import_gltf(
        k,
        ASSET SCENE0
        "\"buffers\":[{\"uri\":\"b.bin\",\"byteLength\":64}],\"bufferViews\":["
        "{\"buffer\":0,\"byteLength\":60},{\"buffer\":0,\"byteOffset\":60,\"byteLength\":4}],\"accessors\":["
        "{\"bufferView\":0,\"componentType\":5126,\"count\":5,\"type\":\"VEC3\"},"
        "{\"bufferView\":1,\"componentType\":5121,\"count\":4,\"type\":\"SCALAR\"}],"
        "\"meshes\":[{\"name\":\"x\",\"primitives\":[{\"attributes\":{\"POSITION\":0},\"mode\":5},"
        "{\"attributes\":{\"POSITION\":0},\"mode\":6,\"indices\":1},{\"attributes\":{\"POSITION\":0},\"mode\":0}"
        "]}],\"nodes\":[{\"mesh\":0}]}",
        &b, sizeof b));
    /* glTF 2.0, 3.7.2.1 */
    assert_indices(&kit_find(k, "m/mesh/x")->mesh.indices, (uint32_t[]){0, 1, 2, 1, 3, 2, 2, 3, 4}, 9);
    assert_indices(&kit_find(k, "m/mesh/x-2")->mesh.indices, (uint32_t[]){3, 2, 4, 2, 1, 4}, 6);
    assert_int_equal(kit_count(k, LUM_RECORD_MESH), 2);
    assert_true(kit_warned(k, "points and lines"));
}

static void shared_mesh_in_a_hierarchy(void **state)
{
    struct kit *k = *state;
    /* b: a quarter turn about Y and a scale of 2 below a translation; c: a matrix, column-major */
    assert_true(kit_import_gltf(
        k,
        TRIANGLE(SCENE0 MESH0) "\"nodes\":[{\"name\":\"a\",\"translation\":[1,2,3],\"children\":[1,2]},"
                               "{\"name\":\"b\",\"mesh\":0,\"rotation\":[0,0.70710678118654752,0,0.70710678118654752],"
                               "\"scale\":[2,2,2]},"
                               "{\"name\":\"c\",\"mesh\":0,\"matrix\":[0,1,0,0,-1,0,0,0,0,0,1,0,5,6,7,1]},"
                               "{\"name\":\"outside the scene\",\"mesh\":0}]}",
        triangle, 36));
    assert_int_equal(kit_count(k, LUM_RECORD_MESH), 1);
    assert_int_equal(kit_count(k, LUM_RECORD_OBJECT), 2);
    assert_near_all(kit_find(k, "m/b")->object.transform.matrix,
                    (double[]){0, 0, 2, 1, 0, 2, 0, 2, -2, 0, 0, 3, 0, 0, 0, 1}, 16);
    assert_near_all(kit_find(k, "m/c")->object.transform.matrix,
                    (double[]){0, -1, 0, 6, 1, 0, 0, 8, 0, 0, 1, 10, 0, 0, 0, 1}, 16);
}

static void hopeless_transforms_are_left_out(void **state)
{
    struct kit *k = *state;
    assert_true(
        kit_import_gltf(k,
                        TRIANGLE(MESH0) "\"nodes\":[{\"mesh\":0,\"scale\":[0,1,1]},{\"mesh\":0,\"translation\":[1e300,"
                                        "0,0]},{\"name\":\"good\",\"mesh\":0,\"scale\":[-1,1,1]}]}",
                        triangle, 36));
    assert_string_equal(kit_only(k, LUM_RECORD_OBJECT)->id, "m/good");
    assert_int_equal(k->result.n_warnings, 2);
}

static void punctual_lights(void **state)
{
    struct kit *k = *state;
    assert_true(kit_import_gltf(
        k,
        ASSET
        "\"extensions\":{\"KHR_lights_punctual\":{\"lights\":["
        "{\"type\":\"point\",\"intensity\":100},"
        "{\"type\":\"spot\",\"intensity\":50,\"color\":[0.5,0.5,0.5],\"spot\":{\"innerConeAngle\":0.5,"
        "\"outerConeAngle\":1}},"
        "{\"type\":\"directional\",\"intensity\":1000,\"color\":[0,0,1]},{\"type\":\"laser\"}]}},"
        "\"nodes\":[{\"name\":\"p\",\"translation\":[1,2,3],\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}},"
        "{\"name\":\"s\",\"rotation\":[-0.70710678118654752,0,0,0.70710678118654752],\"scale\":[3,3,3],"
        "\"extensions\":{\"KHR_lights_punctual\":{\"light\":1}}},"
        "{\"name\":\"d\",\"extensions\":{\"KHR_lights_punctual\":{\"light\":2}}},"
        "{\"extensions\":{\"KHR_lights_punctual\":{\"light\":3}}}]}",
        "", 0));
    const struct lum_record_light *p = &kit_find(k, "m/p")->light, *s = &kit_find(k, "m/s")->light,
                                  *d = &kit_find(k, "m/d")->light;
    assert_string_equal(p->kind, "point");
    assert_near_all(p->position, (double[]){1, 2, 3}, 3);
    assert_true(p->intensity_cd.set && p->intensity_cd.value == 100.0);
    assert_string_equal(s->kind, "spot");
    assert_near_all(s->direction, (double[]){0, -1, 0}, 3); /* -Z turned down by a quarter turn about X */
    assert_near_all(&s->inner_cone_deg, (double[]){0.5 * 180.0 / 3.14159265358979}, 1);
    assert_near_all(&s->outer_cone_deg, (double[]){180.0 / 3.14159265358979}, 1);
    assert_near_all(&s->intensity_cd.value, (double[]){25.0}, 1); /* color * intensity has luminance 25 cd */
    assert_string_equal(d->kind, "directional");
    assert_near_all(d->direction, (double[]){0, 0, -1}, 3);
    assert_near_all(&d->illuminance_lx.value, (double[]){72.2}, 1); /* 1000 lx of blue: Y = 0.0722 */
    assert_near_all(d->color, (double[]){0, 0, 1.0 / 0.0722}, 3);   /* of luminance 1 */
    assert_int_equal(kit_count(k, LUM_RECORD_LIGHT), 3);
    assert_true(kit_warned(k, "laser"));
}

#define DOWNLIGHT "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0 1 1 9\n0 45 90\n0\n100 80 0\n"

static void photometric_lights(void **state)
{
    struct kit *k = *state;
    kit_write_text(k, "d.ies", DOWNLIGHT);
    kit_write_text(k, "bad.ies", "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 three\n");
    assert_true(kit_import_gltf(
        k,
        ASSET "\"extensionsRequired\":[\"EXT_lights_ies\"],\"buffers\":[{\"uri\":\"b.bin\",\"byteLength\":73}],"
              "\"bufferViews\":[{\"buffer\":0,\"byteLength\":73}],"
              "\"extensions\":{\"EXT_lights_ies\":{\"lights\":[{\"uri\":\"d.ies\"},"
              "{\"bufferView\":0,\"mimeType\":\"application/x-ies-lm-63\"},{\"uri\":\"bad.ies\"},{}]},"
              "\"KHR_lights_punctual\":{\"lights\":[{\"type\":\"point\",\"color\":[0.5,0.25,0]}]}},"
              "\"nodes\":[{\"name\":\"a\",\"translation\":[1,2,3],\"extensions\":{\"EXT_lights_ies\":{\"light\":0}}},"
              "{\"name\":\"b\",\"rotation\":[-0.70710678118654752,0,0,0.70710678118654752],\"extensions\":"
              "{\"EXT_lights_ies\":{\"light\":1,\"multiplier\":3,\"color\":[0.5,0.5,0.5]}}},"
              "{\"name\":\"c\",\"extensions\":{\"EXT_lights_ies\":{\"light\":2}}},"
              "{\"name\":\"e\",\"extensions\":{\"EXT_lights_ies\":{\"light\":3}}},"
              "{\"name\":\"f\",\"extras\":{\"ies\":\"photometric/mgf/D.IES\"},"
              "\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}},"
              "{\"name\":\"g\",\"extras\":{\"ies\":\"nowhere.ies\"},"
              "\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}},"
              "{\"name\":\"h\",\"extras\":{\"ies\":7},\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}}]}",
        DOWNLIGHT, sizeof DOWNLIGHT - 1));
    const struct lum_record_light *a = &kit_find(k, "m/a")->light, *b = &kit_find(k, "m/b")->light,
                                  *f = &kit_find(k, "m/f")->light;
    assert_string_equal(a->kind, "ies");
    assert_near_all(a->position, (double[]){1, 2, 3}, 3);
    assert_near_all(a->direction, (double[]){0, 0, -1}, 3);
    assert_near_all(&a->roll_deg, (double[]){0}, 1); /* carried from -Y to -Z, +X stays: as in the node */
    assert_true(!a->flux_lm.set && !a->multiplier.set && a->asset[0] == '\0');
    assert_int_equal(a->web->candela.n, 3);
    assert_true(a->web->candela.f32[1] == 80.0f && a->web->watts.value == 9.0);
    assert_near_all(b->direction, (double[]){0, -1, 0}, 3);
    assert_near_all(&b->multiplier.value, (double[]){1.5}, 1);
    assert_near_all(b->color, (double[]){1, 1, 1}, 3);
    assert_string_equal(f->kind, "ies"); /* in place of the point, with its hue */
    assert_near_all(f->color, (double[]){0.5 / 0.2851, 0.25 / 0.2851, 0}, 3);
    assert_near_all(&f->multiplier.value, (double[]){1}, f->multiplier.set);
    assert_string_equal(kit_find(k, "m/g")->light.kind, "point");
    assert_string_equal(kit_find(k, "m/h")->light.kind, "point");
    assert_int_equal(kit_count(k, LUM_RECORD_LIGHT), 5);
    assert_true(kit_warned(k, "IES light 2 is not used: line 3: \"three\" is no number"));
    assert_true(kit_warned(k, "IES light 3 is not used: has neither uri nor bufferView"));
    assert_true(kit_warned(k, "nowhere.ies is not used: no such file"));
}

static void cameras(void **state)
{
    struct kit *k = *state;
    assert_true(kit_import_gltf(
        k,
        ASSET "\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":1,\"znear\":0.1}},"
              "{\"type\":\"orthographic\",\"orthographic\":{\"xmag\":1,\"ymag\":1,\"zfar\":1,\"znear\":0}}],"
              "\"nodes\":[{\"name\":\"eye\",\"camera\":0,\"translation\":[0,1,5]},{\"camera\":1}]}",
        "", 0));
    const struct lum_record_camera *c = &kit_only(k, LUM_RECORD_CAMERA)->camera;
    assert_near_all(c->position, (double[]){0, 1, 5}, 3);
    assert_near_all(c->target, (double[]){0, 1, 4}, 3);
    assert_near_all(c->up, (double[]){0, 1, 0}, 3);
    assert_near_all(&c->vfov_deg, (double[]){180.0 / 3.14159265358979}, 1);
    assert_true(kit_warned(k, "orthographic"));
}

static void morph_targets_at_their_weights(void **state)
{
    struct kit *k = *state;
    float b[18];
    memcpy(b, triangle, 36);
    for (int i = 0; i < 9; i++)
        b[9 + i] = (float)i;
    assert_true(kit_import_gltf(
        k,
        ASSET "\"buffers\":[{\"uri\":\"b.bin\",\"byteLength\":72}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},"
              "{\"buffer\":0,\"byteOffset\":36,\"byteLength\":36}],\"accessors\":["
              "{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
              "{\"bufferView\":1,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}],"
              "\"meshes\":[{\"name\":\"x\",\"weights\":[0.5],\"primitives\":[{\"attributes\":{\"POSITION\":0},"
              "\"targets\":[{\"POSITION\":1}]}]}],\"nodes\":[{\"mesh\":0},{\"mesh\":0,\"weights\":[2]},{\"mesh\":0}]}",
        b, sizeof b));
    float half[9], twice[9];
    for (int i = 0; i < 9; i++) {
        half[i] = triangle[i] + 0.5f * (float)i;
        twice[i] = triangle[i] + 2.0f * (float)i;
    }
    assert_floats(&kit_find(k, "m/mesh/x")->mesh.positions, half, 9);
    assert_floats(&kit_find(k, "m/mesh/x-2")->mesh.positions, twice, 9);
    assert_int_equal(kit_count(k, LUM_RECORD_MESH), 2); /* the first and third node share theirs */
}

static void skin_at_rest_pose(void **state)
{
    struct kit *k = *state;
    struct {
        float p[9], inverse[2][16];
        uint8_t joints[3][4];
        float weights[3][4];
    } b = {.joints = {{0}, {1}, {0, 1}}, .weights = {{1}, {1}, {0.5f, 0.5f}}};
    memcpy(b.p, triangle, sizeof b.p);
    for (int i = 0; i < 4; i++)
        b.inverse[0][5 * i] = b.inverse[1][5 * i] = 1.0f;
    b.inverse[1][12] = -1.0f; /* joint 1 was bound at x = 1 */
    assert_true(kit_import_gltf(
        k,
        ASSET "\"buffers\":[{\"uri\":\"b.bin\",\"byteLength\":224}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},"
              "{\"buffer\":0,\"byteOffset\":36,\"byteLength\":128},{\"buffer\":0,\"byteOffset\":164,\"byteLength\":12},"
              "{\"buffer\":0,\"byteOffset\":176,\"byteLength\":48}],\"accessors\":["
              "{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
              "{\"bufferView\":1,\"componentType\":5126,\"count\":2,\"type\":\"MAT4\"},"
              "{\"bufferView\":2,\"componentType\":5121,\"count\":3,\"type\":\"VEC4\"},"
              "{\"bufferView\":3,\"componentType\":5126,\"count\":3,\"type\":\"VEC4\"}],"
              "\"skins\":[{\"joints\":[1,2],\"inverseBindMatrices\":1}],"
              "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"JOINTS_0\":2,\"WEIGHTS_0\":3}}]}],"
              "\"nodes\":[{\"name\":\"body\",\"mesh\":0,\"skin\":0,\"translation\":[100,0,0]},{\"translation\":[0,0,4],"
              "\"children\":[2]},{\"translation\":[1,2,0]}]}",
        &b, sizeof b));
    /* joint 0 moves by (0,0,4), joint 1 by (0,2,4); the node's own translation does not apply */
    assert_floats(&kit_only(k, LUM_RECORD_MESH)->mesh.positions, (float[]){0, 0, 4, 1, 2, 4, 0, 2, 4}, 9);
    assert_near_all(kit_find(k, "m/body")->object.transform.matrix,
                    (double[]){1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, 16);
}

/* A triangle with normals and tangents, in joints of which the second mirrors x. Values: from tangents of the file. */
static bool import_these_tangents(struct kit *k, const char *material, const char *attributes, const char *mesh,
                                  bool skin, float last, const char *type)
{
    struct {
        float p[9], n[9], t[12], delta[9];
        uint8_t joints[3][4];
        float weights[3][4];
    } b = {.n = {0, 0, 1, 0, 0, 1, 0, 0, 1},
           .t = {1, 0, 0, 1, 0, 1, 0, -1, last, 0, 0, 1},
           .delta = {0, 0, 0, 0, 2, 0, 0, 0, 0},
           .joints = {{0}, {0}, {0}},
           .weights = {{1}, {1}, {1}}};
    memcpy(b.p, triangle, sizeof b.p);
    char json[4096];
    snprintf(json, sizeof json,
             ASSET
             "\"buffers\":[{\"uri\":\"b.bin\",\"byteLength\":216}],\"bufferViews\":["
             "{\"buffer\":0,\"byteLength\":156},{\"buffer\":0,\"byteOffset\":156,\"byteLength\":60}],\"accessors\":["
             "{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
             "{\"bufferView\":0,\"byteOffset\":36,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
             "{\"bufferView\":0,\"byteOffset\":72,\"componentType\":5126,%s},"
             "{\"bufferView\":0,\"byteOffset\":120,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
             "{\"bufferView\":1,\"componentType\":5121,\"count\":3,\"type\":\"VEC4\"},"
             "{\"bufferView\":1,\"byteOffset\":12,\"componentType\":5126,\"count\":3,\"type\":\"VEC4\"}],"
             "\"materials\":[%s],\"skins\":[{\"joints\":[1]}],\"meshes\":[{\"primitives\":[{\"material\":0,"
             "\"attributes\":{\"POSITION\":0,\"TANGENT\":2%s},\"targets\":[{\"TANGENT\":3}]}]%s}],"
             "\"nodes\":[{\"mesh\":0%s},{\"scale\":[-1,1,1]}]}",
             type, material, attributes, mesh, skin ? ",\"skin\":0" : "");
    return kit_import_gltf(k, json, &b, sizeof b);
}

static bool import_tangents(struct kit *k, const char *material, const char *attributes, const char *mesh, bool skin)
{
    return import_these_tangents(k, material, attributes, mesh, skin, 0.5f, "\"count\":3,\"type\":\"VEC4\"");
}

#define BRUSHED "{\"extensions\":{\"KHR_materials_anisotropy\":{\"anisotropyStrength\":1}}}"

/* They come with what turns by them, as they are; a morph target adds to the direction, a joint moves it. Without
 * normals they are to be ignored, and where nothing turns they would be a burden. */
static void tangents(void **state)
{
    static const float as_given[12] = {1, 0, 0, 1, 0, 1, 0, -1, 0.5f, 0, 0, 1},
                       morphed[12] = {1, 0, 0, 1, 0, 2, 0, -1, 0.5f, 0, 0, 1},
                       mirrored[12] = {-1, 0, 0, 1, 0, 1, 0, -1, -1, 0, 0, 1};
    struct kit *k = *state;
    assert_true(import_tangents(k, BRUSHED, ",\"NORMAL\":1", "", false));
    assert_floats(&kit_only(k, LUM_RECORD_MESH)->mesh.tangents, as_given, 12);
    assert_true(import_tangents(k, BRUSHED, ",\"NORMAL\":1", ",\"weights\":[0.5]", false));
    assert_floats(&kit_only(k, LUM_RECORD_MESH)->mesh.tangents, morphed, 12);
    assert_true(import_tangents(k, BRUSHED, ",\"NORMAL\":1,\"JOINTS_0\":4,\"WEIGHTS_0\":5", "", true));
    const struct lum_record_mesh *m = &kit_only(k, LUM_RECORD_MESH)->mesh;
    assert_floats(&m->tangents, mirrored, 12);
    assert_floats(&m->normals, (float[]){0, 0, -1, 0, 0, -1, 0, 0, -1}, 9); /* n x t is mirrored by that */
    assert_true(import_tangents(k, BRUSHED, "", "", false));
    assert_int_equal(kit_only(k, LUM_RECORD_MESH)->mesh.tangents.n, 0);
    assert_true(import_tangents(k, "{}", ",\"NORMAL\":1", "", false));
    assert_int_equal(kit_only(k, LUM_RECORD_MESH)->mesh.tangents.n, 0);
}

/* One that is no number, too few of them, or without a side: all are left out, and told; the rest is imported. */
static void bad_tangents(void **state)
{
    static const struct {
        float last;
        const char *type, *told;
    } cases[] = {
        {NAN, "\"count\":3,\"type\":\"VEC4\"",
         "meshes[0]: tangents are not used: accessors[2]: element 2 is not finite"},
        {0.5f, "\"count\":2,\"type\":\"VEC4\"", "TANGENT has 2 elements, POSITION 3"},
        {0.5f, "\"count\":3,\"type\":\"VEC3\"", "has 3 components where 4 are needed"},
    };
    struct kit *k = *state;
    for (size_t i = 0; i < LUM_ARRAY_LEN(cases); i++) {
        assert_true(import_these_tangents(k, BRUSHED, ",\"NORMAL\":1", "", false, cases[i].last, cases[i].type));
        assert_true(kit_warned(k, cases[i].told));
        const struct lum_record_mesh *m = &kit_only(k, LUM_RECORD_MESH)->mesh;
        assert_int_equal(m->tangents.n, 0);
        assert_int_equal(m->normals.n, 9);
    }
    /* finite, but more than a mesh may hold */
    assert_true(import_these_tangents(k, BRUSHED, ",\"NORMAL\":1", "", false, 1e30f, cases[0].type));
    assert_floats(&kit_only(k, LUM_RECORD_MESH)->mesh.tangents, (float[]){1, 0, 0, 1, 0, 1, 0, -1, 0, 0, 0, 1}, 12);
}

static void ids_are_readable_and_unique(void **state)
{
    struct kit *k = *state;
    assert_true(kit_import_gltf(
        k,
        TRIANGLE(
            MESH0) "\"nodes\":[{\"name\":\"Lampe \\u00e4/1\",\"mesh\":0},{\"name\":\"x\",\"mesh\":0},{\"name\":\"x\","
                   "\"mesh\":0},{\"name\":\"x-2\",\"mesh\":0},{\"mesh\":0},{\"name\":\"%%%\",\"mesh\":0},"
                   "{\"name\":\"aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\","
                   "\"mesh\":0}]}",
        triangle, 36));
    kit_find(k, "m/Lampe____1");
    kit_find(k, "m/x");
    kit_find(k, "m/x-2");
    kit_find(k, "m/x-2-2");
    kit_find(k, "m/tri");    /* no name: the mesh's */
    kit_find(k, "m/node-5"); /* no usable character */
    assert_int_equal(kit_count(k, LUM_RECORD_OBJECT), 7);
    for (size_t i = 0; i < k->result.n_records; i++)
        assert_true(strlen(k->result.records[i]->id) <= LUM_LIMIT_ID_BYTES);
}

static void refusals_name_the_place(void **state)
{
    struct kit *k = *state;
    static const struct {
        const char *json, *text, *app;
    } cases[] = {
        {"", "damaged", "import_failed"},
        {"[]", "no object", "import_failed"},
        {"{\"asset\":{\"version\":\"1.0\"}}", "only 2.0", "unsupported"},
        {ASSET "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]}", "KHR_draco_mesh_compression", "unsupported"},
        {ASSET "\"nodes\":[{\"children\":[1]},{\"children\":[0]}]}", "cycle", "import_failed"},
        {ASSET "\"nodes\":[{\"children\":[2]},{\"children\":[2]},{}]}", "more than one parent", "import_failed"},
        {ASSET "\"nodes\":[{\"children\":[1,1]},{}]}", "more than one parent", "import_failed"},
        {ASSET "\"nodes\":[{\"mesh\":0}]}", "nodes[0]: mesh names none of the 0 meshes", "import_failed"},
        {ASSET "\"nodes\":[{\"translation\":[0,0]}]}", "nodes[0]: translation must be 3", "import_failed"},
        {ASSET "\"nodes\":[{\"scale\":[1e999,0,0]}]}", "nodes[0]: scale must be 3", "import_failed"},
        {ASSET "\"accessors\":{}}", "accessors must be an array", "import_failed"},
        {ASSET MESH0
         "\"accessors\":[{\"componentType\":5126,\"count\":1e9,\"type\":\"VEC3\"}],\"nodes\":[{\"mesh\":0}]}",
         "accessors[0]: count", "import_failed"},
        {ASSET MESH0
         "\"accessors\":[{\"componentType\":5126,\"count\":1e8,\"type\":\"VEC3\"}],\"nodes\":[{\"mesh\":0}]}",
         "without data", "limit_exceeded"},
        {ASSET MESH0 "\"buffers\":[{\"uri\":\"../b.bin\",\"byteLength\":36}],\"bufferViews\":[{\"buffer\":0,"
                     "\"byteLength\":36}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":"
                     "\"VEC3\"}],\"nodes\":[{\"mesh\":0}]}",
         "below the asset's directory", "import_failed"},
        {ASSET MESH0 "\"buffers\":[{\"uri\":\"none.bin\",\"byteLength\":36}],\"bufferViews\":[{\"buffer\":0,"
                     "\"byteLength\":36}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":"
                     "\"VEC3\"}],\"nodes\":[{\"mesh\":0}]}",
         "none.bin: no such file", "not_found"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        kit_write_text(k, "a.gltf", cases[i].json);
        if (kit_import(k, "a.gltf"))
            fail_msg("case %zu was accepted", i);
        if (!strstr(k->err.text, cases[i].text))
            fail_msg("case %zu: \"%s\" does not say \"%s\"", i, k->err.text, cases[i].text);
        assert_string_equal(k->err.app, cases[i].app);
        assert_int_equal(k->err.code, LUM_PROTO_APPLICATION);
    }
}

static void deep_chains_are_fine(void **state)
{
    struct kit *k = *state;
    static char json[1 << 20];
    size_t n = (size_t)snprintf(json, sizeof json, TRIANGLE(SCENE0 MESH0) "\"nodes\":[");
    for (int i = 0; i < 10000; i++)
        n += (size_t)snprintf(json + n, sizeof json - n, "{\"translation\":[0,1,0],\"children\":[%d]},", i + 1);
    snprintf(json + n, sizeof json - n, "{\"name\":\"end\",\"mesh\":0}]}");
    assert_true(kit_import_gltf(k, json, triangle, 36));
    assert_true(kit_find(k, "m/end")->object.transform.matrix[7] == 10000.0);
}

int main(void)
{
#define TEST(f) cmocka_unit_test_setup_teardown(f, gltf_setup, gltf_teardown)
    const struct CMUnitTest tests[] = {
        TEST(triangle_with_default_material),
        TEST(data_uri),
        TEST(sparse_values_override),
        TEST(quantised_and_normalised),
        TEST(strips_fans_points),
        TEST(shared_mesh_in_a_hierarchy),
        TEST(hopeless_transforms_are_left_out),
        TEST(punctual_lights),
        TEST(photometric_lights),
        TEST(cameras),
        TEST(morph_targets_at_their_weights),
        TEST(skin_at_rest_pose),
        TEST(tangents),
        TEST(bad_tangents),
        TEST(ids_are_readable_and_unique),
        TEST(refusals_name_the_place),
        TEST(deep_chains_are_fine),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
