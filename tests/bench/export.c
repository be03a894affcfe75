/* The scene's geometry in world space as one OBJ: an object per instance, materials by name only. Colour temperatures
 * that the built-in scenes use are listed as comments, so that another renderer can give its lights the same colour. */
#include "core/math/color.h"
#include "tests/bench/bench.h"

static void write_colors(FILE *f)
{
    for (int kelvin = 1800; kelvin <= 10000; kelvin += 100) {
        struct lum_rgb c = lum_cct_to_rgb((double)kelvin);
        fprintf(f, "# cct %d %.9g %.9g %.9g\n", kelvin, (double)c.r, (double)c.g, (double)c.b);
    }
}

static struct lum_vec3d to_world(const struct lum_snapshot *s, struct lum_vec3 p)
{
    return (struct lum_vec3d){(double)p.x / s->norm.scale + s->norm.centre.x,
                              (double)p.y / s->norm.scale + s->norm.centre.y,
                              (double)p.z / s->norm.scale + s->norm.centre.z};
}

static void write_instance(FILE *f, const struct lum_snapshot *s, const struct lum_instance *in, uint32_t first)
{
    const struct lum_mesh *m = in->mesh;
    fprintf(f, "o %s\n", in->id);
    for (uint32_t i = 0; i < m->n_vertices; i++) {
        const float *v = m->positions + 3 * (size_t)i;
        struct lum_vec3d p = to_world(s, lum_affine_point(&in->local_to_scene, lum_v3(v[0], v[1], v[2])));
        fprintf(f, "v %.9g %.9g %.9g\n", p.x, p.y, p.z);
    }
    for (uint32_t i = 0; m->normals && i < m->n_vertices; i++) {
        const float *n = m->normals + 3 * (size_t)i;
        struct lum_vec3 w = lum_instance_normal(in, lum_v3(n[0], n[1], n[2]));
        fprintf(f, "vn %.7g %.7g %.7g\n", (double)w.x, (double)w.y, (double)w.z);
    }
    fprintf(f, "usemtl %s\n", s->materials[in->material].id);
    for (uint32_t i = 0; i < m->n_triangles; i++) {
        fputc('f', f);
        for (int k = 0; k < 3; k++) {
            uint32_t v = first + m->indices[3 * (size_t)i + (size_t)k];
            if (m->normals)
                fprintf(f, " %u//%u", v, v);
            else
                fprintf(f, " %u", v);
        }
        fputc('\n', f);
    }
}

int lum_bench_export(const struct lum_bench_options *options)
{
    struct lum_world world;
    if (!lum_bench_world(options->scene, 1, &world))
        return 1;
    int status = 1;
    FILE *f = lum_bench_open(options, "scene.obj");
    if (!f)
        goto out;
    write_colors(f);
    uint32_t first = 1; /* OBJ counts from 1; normals are written for every vertex or for none of a mesh */
    bool normals = true;
    for (uint32_t i = 0; i < world.snapshot->n_instances; i++)
        normals = normals && world.snapshot->instances[i].mesh->normals;
    if (!normals) {
        fprintf(stderr, "lumend-bench: export needs normals on every mesh\n");
        goto out;
    }
    for (uint32_t i = 0; i < world.snapshot->n_instances; i++) {
        write_instance(f, world.snapshot, &world.snapshot->instances[i], first);
        first += world.snapshot->instances[i].mesh->n_vertices;
    }
    status = 0;
out:
    if (f && fclose(f) != 0)
        status = 1;
    lum_world_finish(&world);
    return status;
}
