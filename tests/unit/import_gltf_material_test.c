/* Materials of glTF, with their extensions, and what shines by them: each on a file of a few lines, through the real,
 * sandboxed lumend-import. */
#include <stdio.h>
#include <string.h>

#include "tests/unit/gltf_text.h"

/* A file may say that nothing is to be shown that lacks them. */
#define REQUIRED                                                                                                       \
    "\"extensionsRequired\":[\"KHR_materials_anisotropy\",\"KHR_materials_clearcoat\",\"KHR_materials_sheen\","        \
    "\"KHR_materials_diffuse_transmission\"],"

/* A file with one triangle of the given material. */
static const struct lum_record_material *import_material(struct kit *k, const char *material)
{
    char json[4096];
    snprintf(json, sizeof json,
             TRIANGLE(SCENE0) REQUIRED
             "\"materials\":[%s],\"images\":[{\"uri\":\"p.png\",\"name\":\"pic\"}],"
             "\"samplers\":[{\"wrapS\":33071,\"wrapT\":33648}],\"textures\":[{\"source\":0,\"sampler\":0}],"
             "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"material\":0}]}],"
             "\"nodes\":[{\"mesh\":0}]}",
             material);
    assert_true(kit_import_gltf(k, json, triangle, 36));
    return &kit_only(k, LUM_RECORD_MATERIAL)->material;
}

static void emission_is_cd_m2(void **state)
{
    const struct lum_record_material *m =
        import_material(*state, "{\"emissiveFactor\":[1,0.5,0],\"extensions\":{\"KHR_materials_emissive_strength\":{"
                                "\"emissiveStrength\":200}}}");
    double y = 200.0 * (0.2126 * 1.0 + 0.7152 * 0.5);
    assert_near_all(&m->emission_cd_m2, &y, 1);
    for (int i = 0; i < 3; i++) /* radiance by channel is factor times strength, whatever colour is normalised to */
        assert_near_all((double[]){m->emission_color[i] * m->emission_cd_m2},
                        (double[]){200.0 * (i == 0   ? 1
                                            : i == 1 ? 0.5
                                                     : 0)},
                        1);
}

static void the_back_shines_where_it_is_shown(void **state)
{
    const struct lum_record_material *m = import_material(*state, "{\"emissiveFactor\":[1,1,1]}");
    assert_string_equal(m->emission_sides, "front");
    m = import_material(*state, "{\"emissiveFactor\":[1,1,1],\"doubleSided\":true}");
    assert_string_equal(m->emission_sides, "both");
}

/* Two triangles far from each other in one primitive that shines: two objects, of one group; with a texture that says
 * where it shines, or dark: one. Of a mesh of two materials each object that shines is named after both. */
static void fixtures_are_objects(void **state)
{
    static const float pair[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 9, 0, 0, 10, 0, 0, 9, 1, 0};
#define PAIR(materials, primitives)                                                                                    \
    ASSET SCENE0 "\"buffers\":[{\"uri\":\"b.bin\",\"byteLength\":72}],"                                                \
                 "\"bufferViews\":[{\"buffer\":0,\"byteLength\":72}],"                                                 \
                 "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":6,\"type\":\"VEC3\"}],"            \
                 "\"materials\":[" materials "],\"meshes\":[{\"primitives\":[" primitives "]}],"                       \
                 "\"nodes\":[{\"name\":\"ceiling\",\"mesh\":0}]}"
#define GLOW "{\"name\":\"neon\",\"emissiveFactor\":[1,1,1]}"
#define PRIMITIVE(material) "{\"attributes\":{\"POSITION\":0},\"material\":" #material "}"
    struct kit *k = *state;
    assert_true(kit_import_gltf(k, PAIR(GLOW, PRIMITIVE(0)), pair, 72));
    for (int i = 0; i < 2; i++) {
        const struct lum_record *object = kit_find(k, i ? "m/ceiling-2" : "m/ceiling");
        const struct lum_record *mesh = kit_find(k, object->object.mesh);
        assert_floats(&mesh->mesh.positions, pair + 9 * i, 9);
        assert_indices(&mesh->mesh.indices, (uint32_t[]){0, 1, 2}, 3);
        assert_string_equal(object->object.group, "m/material/neon");
    }
    assert_true(kit_import_gltf(k, PAIR("{\"name\":\"paint\"}", PRIMITIVE(0)), pair, 72));
    assert_int_equal(kit_find(k, "m/mesh/mesh-0")->mesh.positions.n, 18);
    assert_string_equal(kit_find(k, "m/ceiling")->object.group, "");
    assert_true(kit_import_gltf(k, PAIR("{\"name\":\"paint\"}," GLOW, PRIMITIVE(0) "," PRIMITIVE(1)), pair, 72));
    kit_find(k, "m/ceiling");
    kit_find(k, "m/ceiling.neon");
    kit_find(k, "m/ceiling.neon-2");
}

/* Two fixtures that 600 nodes show would be more objects than there may be: they stay one. By 500 they are two each. */
static void many_fixtures_stay_whole(void **state)
{
    static const float pair[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 9, 0, 0, 10, 0, 0, 9, 1, 0};
    static char json[65536];
    struct kit *k = *state;
    for (int n = 500; n <= 600; n += 100) {
        int at = snprintf(json, sizeof json,
                          ASSET "\"buffers\":[{\"uri\":\"b.bin\",\"byteLength\":72}],\"bufferViews\":[{\"buffer\":0,"
                                "\"byteLength\":72}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,"
                                "\"count\":6,\"type\":\"VEC3\"}],\"materials\":[" GLOW "],\"meshes\":[{\"primitives\":"
                                "[" PRIMITIVE(0) "]}],\"nodes\":[{\"mesh\":0}");
        for (int i = 1; i < n; i++)
            at += snprintf(json + at, sizeof json - (size_t)at, ",{\"mesh\":0}");
        snprintf(json + at, sizeof json - (size_t)at, "]}");
        assert_true(kit_import_gltf(k, json, pair, 72));
        assert_int_equal(kit_count(k, LUM_RECORD_OBJECT), n == 500 ? 1000 : 600);
    }
}

static void dielectric_extensions(void **state)
{
    const struct lum_record_material *m = import_material(
        *state, "{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.1,0.2,0.3,0.4],\"metallicFactor\":0.25,"
                "\"roughnessFactor\":0.5},\"alphaMode\":\"MASK\",\"alphaCutoff\":0.75,\"extensions\":{"
                "\"KHR_materials_ior\":{\"ior\":1.25},"
                "\"KHR_materials_specular\":{\"specularFactor\":0.5,\"specularColorFactor\":[1,2,3]},"
                "\"KHR_materials_transmission\":{\"transmissionFactor\":0.75},"
                "\"KHR_materials_volume\":{\"thicknessFactor\":1,\"attenuationDistance\":2,"
                "\"attenuationColor\":[0.5,0.25,1]},\"KHR_materials_iridescence\":{}}}");
    assert_near_all(m->base_color, (double[]){0.1, 0.2, 0.3}, 3);
    assert_true(m->alpha == 0.4 && m->metallic == 0.25 && m->roughness == 0.5 && m->ior == 1.25 && m->specular == 0.5);
    assert_near_all(m->specular_color, (double[]){1, 2, 3}, 3);
    assert_true(m->transmission == 0.75 && !m->thin);
    assert_near_all(m->attenuation_color, (double[]){0.5, 0.25, 1}, 3);
    assert_true(m->attenuation_distance.set && m->attenuation_distance.value == 2.0);
    assert_string_equal(m->alpha_mode, "mask");
    assert_true(m->alpha_cutoff == 0.75 && !m->unlit);
    assert_true(kit_warned(*state, "KHR_materials_iridescence"));
    m = import_material(*state, "{\"extensions\":{\"KHR_materials_transmission\":{\"transmissionFactor\":1}}}");
    assert_true(m->thin && m->transmission == 1.0); /* no volume: the surface bends nothing */
}

/* What glTF shows alike in any light is lit by the scene's, as matt paint. */
static void unlit(void **state)
{
    const struct lum_record_material *m = import_material(
        *state,
        "{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.1,0.2,0.3,1],\"roughnessFactor\":0.5},\"emissiveFactor\":"
        "[1,1,1],\"extensions\":{\"KHR_materials_transmission\":{\"transmissionFactor\":1},"
        "\"KHR_materials_unlit\":{}}}");
    assert_near_all(m->base_color, (double[]){0.1, 0.2, 0.3}, 3);
    assert_true(!m->unlit && m->metallic == 0.0 && m->specular == 0.0 && m->roughness == 1.0);
    assert_true(m->transmission == 0.0 && m->emission_cd_m2 == 0.0);
    assert_true(kit_warned(*state, "KHR_materials_unlit"));
}

/* What is transmitted is not reflected: the sum is what the base reflected, where the colours are alike. */
static void diffuse_transmission(void **state)
{
    const struct lum_record_material *m = import_material(
        *state, "{\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,0.5,0.2,1],\"metallicFactor\":0},\"extensions\":{"
                "\"KHR_materials_diffuse_transmission\":{\"diffuseTransmissionFactor\":0.75,"
                "\"diffuseTransmissionColorFactor\":[1,0.8,2],\"diffuseTransmissionColorTexture\":{\"index\":0}}}}");
    assert_near_all(m->base_color, (double[]){0.25, 0.125, 0.05}, 3);
    assert_near_all(m->diffuse_transmittance, (double[]){0.75, 0.6, 0.75}, 3);
    assert_true(kit_warned(*state, "diffuseTransmissionColorTexture"));
    m = import_material(*state, "{\"extensions\":{\"KHR_materials_diffuse_transmission\":{}}}");
    assert_near_all(m->base_color, (double[]){1, 1, 1}, 3);
    assert_near_all(m->diffuse_transmittance, (double[]){0, 0, 0}, 3);
    /* where there is no diffuse base nothing of it transmits, and nothing else gets darker */
    static const char *const bare[] = {
        "{\"extensions\":{\"KHR_materials_diffuse_transmission\":{\"diffuseTransmissionFactor\":1}}}",
        "{\"pbrMetallicRoughness\":{\"metallicFactor\":0},\"extensions\":{\"KHR_materials_unlit\":{},"
        "\"KHR_materials_diffuse_transmission\":{\"diffuseTransmissionFactor\":1}}}",
        "{\"pbrMetallicRoughness\":{\"metallicFactor\":0},\"extensions\":{\"KHR_materials_transmission\":{"
        "\"transmissionFactor\":1},\"KHR_materials_diffuse_transmission\":{\"diffuseTransmissionFactor\":1}}}",
    };
    for (size_t i = 0; i < sizeof bare / sizeof bare[0]; i++) {
        m = import_material(*state, bare[i]);
        assert_near_all(m->base_color, (double[]){1, 1, 1}, 3);
        assert_near_all(m->diffuse_transmittance, (double[]){0, 0, 0}, 3);
    }
}

static void clearcoat(void **state)
{
    const struct lum_record_material *m =
        import_material(*state, "{\"extensions\":{\"KHR_materials_clearcoat\":{\"clearcoatFactor\":0.75,"
                                "\"clearcoatRoughnessFactor\":0.25}}}");
    assert_true(m->clearcoat == 0.75 && m->clearcoat_roughness == 0.25 && m->clearcoat_normal_scale == 1.0);
    assert_string_equal(m->clearcoat_texture.image, "");
    static const char *const bare[] = {
        "{\"extensions\":{\"KHR_materials_clearcoat\":{\"clearcoatRoughnessFactor\":0.25}}}", /* the factor's default is
                                                                                                 0 */
        "{\"extensions\":{\"KHR_materials_unlit\":{},\"KHR_materials_clearcoat\":{\"clearcoatFactor\":1}}}",
        "{}",
    };
    for (size_t i = 0; i < sizeof bare / sizeof bare[0]; i++)
        assert_true(import_material(*state, bare[i])->clearcoat == 0.0);
}

static void sheen(void **state)
{
    const struct lum_record_material *m =
        import_material(*state, "{\"extensions\":{\"KHR_materials_sheen\":{\"sheenColorFactor\":[0.75,0.5,2],"
                                "\"sheenRoughnessFactor\":0.25,\"sheenColorTexture\":{\"index\":0}}}}");
    assert_near_all(m->sheen_color, (double[]){0.75, 0.5, 1}, 3);
    assert_true(m->sheen_roughness == 0.25);
    assert_true(kit_warned(*state, "KHR_materials_sheen"));
    m = import_material(*state, "{\"extensions\":{\"KHR_materials_sheen\":{}}}");
    assert_near_all(m->sheen_color, (double[]){0, 0, 0}, 3);
}

static void anisotropy(void **state)
{
    const struct lum_record_material *m =
        import_material(*state, "{\"extensions\":{\"KHR_materials_anisotropy\":{\"anisotropyStrength\":0.75,"
                                "\"anisotropyRotation\":-1.5707963267948966}}}");
    assert_true(m->anisotropy == 0.75);
    assert_near_all(&m->anisotropy_rotation_deg, (double[]){-90.0}, 1);
    assert_string_equal(m->anisotropy_texture.image, "");
    static const char *const bare[] = {
        "{\"extensions\":{\"KHR_materials_anisotropy\":{\"anisotropyRotation\":1}}}",
        "{\"extensions\":{\"KHR_materials_unlit\":{},\"KHR_materials_anisotropy\":{\"anisotropyStrength\":1}}}",
        "{}",
    };
    for (size_t i = 0; i < sizeof bare / sizeof bare[0]; i++)
        assert_true(import_material(*state, bare[i])->anisotropy == 0.0);
    assert_false(kit_warned(*state, "KHR_materials_anisotropy"));
}

static void specular_glossiness(void **state)
{
    const struct lum_record_material *m = import_material(
        *state, "{\"extensions\":{\"KHR_materials_pbrSpecularGlossiness\":{\"diffuseFactor\":[0.5,0.5,0.5,1],"
                "\"specularFactor\":[0.04,0.04,0.04],\"glossinessFactor\":0.75}}}");
    assert_true(m->metallic == 0.0 && m->roughness == 0.25);
    assert_near_all(&m->ior, (double[]){1.5}, 1); /* F0 = 0.04 is glass */
    m = import_material(*state, "{\"extensions\":{\"KHR_materials_pbrSpecularGlossiness\":{\"diffuseFactor\":[0,0,0,1],"
                                "\"specularFactor\":[1,0.8,0.3]}}}");
    assert_true(m->metallic == 1.0);
    assert_near_all(m->base_color, (double[]){1, 0.8, 0.3}, 3);
}

/* 2 x 1 texels: (255, 0, 0, 255), (0, 128, 0, 64) */
static const uint8_t png[] = {
    0x89, 'P',  'N',  'G',  '\r', '\n', 0x1a, '\n', 0,    0,    0,    13,   'I',  'H',  'D',  'R',  0,    0,    0,
    2,    0,    0,    0,    1,    8,    6,    0,    0,    0,    0xf4, 0x22, 0x7f, 0x8a, 0,    0,    0,    0x11, 'I',
    'D',  'A',  'T',  0x78, 0xda, 0x63, 0xf8, 0xcf, 0xc0, 0xf0, 0x9f, 0xa1, 0x81, 0xc1, 0x01, 0,    0x0e, 0xbc, 0x02,
    0xbf, 0xc0, 0x5a, 0x48, 0xb1, 0,    0,    0,    0,    'I',  'E',  'N',  'D',  0xae, 0x42, 0x60, 0x82,
};

static void textures(void **state)
{
    struct kit *k = *state;
    kit_write(k, "p.png", png, sizeof png);
    const struct lum_record_material *m = import_material(
        k, "{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0,\"extensions\":{\"KHR_texture_transform\":{"
           "\"offset\":[0.5,0.25],\"rotation\":1.5,\"scale\":[2,3]}}}},\"normalTexture\":{\"index\":0,\"scale\":0.5}}");
    assert_string_equal(m->base_color_texture.image, "m/image/pic");
    assert_string_equal(m->base_color_texture.wrap_u, "clamp");
    assert_string_equal(m->base_color_texture.wrap_v, "mirror");
    assert_near_all(m->base_color_texture.offset, (double[]){0.5, 0.25}, 2);
    assert_near_all(m->base_color_texture.scale, (double[]){2, 3}, 2);
    assert_true(m->base_color_texture.rotation_rad == 1.5);
    assert_string_equal(m->normal_texture.image, "m/image/pic-2");
    assert_true(m->normal_scale == 0.5);
    const struct lum_record_image *color = &kit_find(k, "m/image/pic")->image,
                                  *normal = &kit_find(k, "m/image/pic-2")->image;
    assert_string_equal(color->texel, "srgb8");
    assert_string_equal(normal->texel, "linear8"); /* the same file, read as what it is used for */
    assert_int_equal(color->width, 2);
    assert_int_equal(color->height, 1);
    assert_memory_equal(color->pixels, ((uint8_t[]){255, 0, 0, 255, 0, 128, 0, 64}), 8);
}

/* Shares are no colours. Without a coat there is nothing to say of it. */
static void textures_of_a_clear_coat(void **state)
{
    struct kit *k = *state;
    kit_write(k, "p.png", png, sizeof png);
    const struct lum_record_material *m = import_material(
        k, "{\"extensions\":{\"KHR_materials_clearcoat\":{\"clearcoatFactor\":0.5,\"clearcoatTexture\":{\"index\":0},"
           "\"clearcoatRoughnessTexture\":{\"index\":0,\"extensions\":{\"KHR_texture_transform\":{\"scale\":[2,3]}}},"
           "\"clearcoatNormalTexture\":{\"index\":0,\"scale\":0.25}}}}");
    assert_string_equal(m->clearcoat_texture.image, "m/image/pic");
    assert_string_equal(m->clearcoat_roughness_texture.image, "m/image/pic");
    assert_string_equal(m->clearcoat_normal_texture.image, "m/image/pic");
    assert_near_all(m->clearcoat_roughness_texture.scale, (double[]){2, 3}, 2);
    assert_true(m->clearcoat_normal_scale == 0.25);
    assert_string_equal(kit_find(k, "m/image/pic")->image.texel, "linear8");
    assert_false(kit_warned(k, "clearcoat"));
    m = import_material(k, "{\"extensions\":{\"KHR_materials_clearcoat\":{\"clearcoatTexture\":{\"index\":0}}}}");
    assert_string_equal(m->clearcoat_texture.image, "");
}

/* Of gloss, glass and sheets. How much is alpha, or no colour; one picture may say how much reflects and of which
 * colour. */
static void textures_of_shares(void **state)
{
    struct kit *k = *state;
    kit_write(k, "p.png", png, sizeof png);
    const struct lum_record_material *m =
        import_material(k, "{\"extensions\":{\"KHR_materials_specular\":{\"specularTexture\":{\"index\":0},"
                           "\"specularColorTexture\":{\"index\":0}}}}");
    assert_string_equal(m->specular_texture.image, "m/image/pic");
    assert_string_equal(m->specular_color_texture.image, "m/image/pic");
    assert_true(m->specular == 1.0);
    assert_string_equal(kit_find(k, "m/image/pic")->image.texel, "srgb8");
    assert_false(kit_warned(k, "specular"));
    m = import_material(k, "{\"extensions\":{\"KHR_materials_transmission\":{\"transmissionFactor\":0.5,"
                           "\"transmissionTexture\":{\"index\":0,\"extensions\":{\"KHR_texture_transform\":{"
                           "\"scale\":[2,3]}}}}}}");
    assert_string_equal(m->transmission_texture.image, "m/image/pic");
    assert_near_all(m->transmission_texture.scale, (double[]){2, 3}, 2);
    assert_string_equal(kit_find(k, "m/image/pic")->image.texel, "linear8");
    m = import_material(k, "{\"extensions\":{\"KHR_materials_transmission\":{\"transmissionTexture\":{\"index\":0}}}}");
    assert_string_equal(m->transmission_texture.image, "");
}

/* The share is kept: where the texture says 0, the base has all of its colour again. Of a share of all there would be
 * nothing left to say so. Glass in part is a sheet in part. */
static void texture_of_a_sheet(void **state)
{
    struct kit *k = *state;
    kit_write(k, "p.png", png, sizeof png);
    const struct lum_record_material *m = import_material(
        k, "{\"pbrMetallicRoughness\":{\"metallicFactor\":0,\"baseColorFactor\":[1,0.5,0.2,1]},\"extensions\":{"
           "\"KHR_materials_diffuse_transmission\":{\"diffuseTransmissionFactor\":0.75,"
           "\"diffuseTransmissionColorFactor\":[0.4,0.8,0.2],\"diffuseTransmissionTexture\":{\"index\":0}}}}");
    assert_string_equal(m->diffuse_transmission_texture.image, "m/image/pic");
    assert_near_all(m->base_color, (double[]){0.25, 0.125, 0.05}, 3);
    assert_near_all(m->diffuse_transmittance, (double[]){0.3, 0.6, 0.15}, 3);
    assert_true(m->diffuse_transmission_share == 0.75);
    assert_false(kit_warned(k, "iffuse"));
    m = import_material(k, "{\"pbrMetallicRoughness\":{\"metallicFactor\":0},\"extensions\":{"
                           "\"KHR_materials_transmission\":{\"transmissionFactor\":1,\"transmissionTexture\":{"
                           "\"index\":0}},\"KHR_materials_diffuse_transmission\":{\"diffuseTransmissionFactor\":1,"
                           "\"diffuseTransmissionTexture\":{\"index\":0}}}}");
    assert_true(m->diffuse_transmission_share == 0.999);
    assert_near_all(m->base_color, (double[]){0.001, 0.001, 0.001}, 3);
    assert_near_all(m->diffuse_transmittance, (double[]){0.999, 0.999, 0.999}, 3);
}

/* Directions are no colours. Without a strength there is nothing to direct. */
static void texture_of_brushing(void **state)
{
    struct kit *k = *state;
    kit_write(k, "p.png", png, sizeof png);
    const struct lum_record_material *m = import_material(
        k, "{\"extensions\":{\"KHR_materials_anisotropy\":{\"anisotropyStrength\":0.5,\"anisotropyTexture\":{"
           "\"index\":0,\"extensions\":{\"KHR_texture_transform\":{\"scale\":[2,3]}}}}}}");
    assert_string_equal(m->anisotropy_texture.image, "m/image/pic");
    assert_near_all(m->anisotropy_texture.scale, (double[]){2, 3}, 2);
    assert_string_equal(kit_find(k, "m/image/pic")->image.texel, "linear8");
    assert_false(kit_warned(k, "KHR_materials_anisotropy"));
    m = import_material(k, "{\"extensions\":{\"KHR_materials_anisotropy\":{\"anisotropyTexture\":{\"index\":0}}}}");
    assert_string_equal(m->anisotropy_texture.image, "");
    assert_int_equal(kit_count(k, LUM_RECORD_IMAGE), 0);
}

static void missing_picture_is_a_warning(void **state)
{
    const struct lum_record_material *m =
        import_material(*state, "{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}");
    assert_string_equal(m->base_color_texture.image, "");
    assert_true(kit_warned(*state, "p.png: no such file"));
}

int main(void)
{
#define TEST(f) cmocka_unit_test_setup_teardown(f, gltf_setup, gltf_teardown)
    const struct CMUnitTest tests[] = {
        TEST(emission_is_cd_m2),
        TEST(the_back_shines_where_it_is_shown),
        TEST(fixtures_are_objects),
        TEST(many_fixtures_stay_whole),
        TEST(dielectric_extensions),
        TEST(unlit),
        TEST(diffuse_transmission),
        TEST(clearcoat),
        TEST(sheen),
        TEST(anisotropy),
        TEST(specular_glossiness),
        TEST(textures),
        TEST(texture_of_brushing),
        TEST(textures_of_a_clear_coat),
        TEST(textures_of_shares),
        TEST(texture_of_a_sheet),
        TEST(missing_picture_is_a_warning),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
