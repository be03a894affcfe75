/* Edit to the first frame that contains it, through the programs that users run: starts lumend on a free loopback port,
 * has lumend-replay make one kind of edit at a time, each when the one before is shown, and reads its report.
 *
 * server_us is what the frame's header says: receipt of the edit to the frame encoded. client is lumend-replay's own
 * clock: request sent to last tile of a frame with that scene_rev or camera_seq received and decoded. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "tests/bench/table.h"

extern char **environ;

struct server {
    pid_t pid;
    FILE *out;
    char url[256], token[128];
};

/* posix_spawn promises not to write the arguments. */
static pid_t spawn(const char *const *argv, int *ret_stdout)
{
    int fds[2];
    pid_t pid = -1;
    posix_spawn_file_actions_t actions;
    if (pipe2(fds, O_CLOEXEC) != 0)
        return -1;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, fds[1], 1);
    if (posix_spawn(&pid, argv[0], &actions, NULL, (char *const *)argv, environ) != 0)
        pid = -1;
    posix_spawn_file_actions_destroy(&actions);
    close(fds[1]);
    if (pid < 0)
        close(fds[0]);
    *ret_stdout = fds[0];
    return pid;
}

/* Waits for the ready line: "lumend ready http://HOST:PORT/#t=TOKEN". */
static bool server_start(const struct lum_bench_options *o, struct server *s)
{
    char program[4200], line[512], address[200];
    snprintf(program, sizeof program, "%s/lumend", o->bin);
    const char *argv[] = {program, "serve", "--scene", o->scene, "--listen", "127.0.0.1:0", "--log", "error", NULL};
    int fd;
    memset(s, 0, sizeof *s);
    s->pid = spawn(argv, &fd);
    s->out = s->pid > 0 ? fdopen(fd, "r") : NULL;
    if (!s->out || !fgets(line, sizeof line, s->out) ||
        sscanf(line, "lumend ready http://%199[^/]/#t=%127s", address, s->token) != 2) {
        fprintf(stderr, "lumend-bench: %s did not start\n", program);
        return false;
    }
    snprintf(s->url, sizeof s->url, "ws://%s", address);
    return true;
}

static void server_stop(struct server *s)
{
    if (s->pid > 0) {
        kill(s->pid, SIGTERM);
        waitpid(s->pid, NULL, 0);
    }
    if (s->out)
        fclose(s->out);
}

/* lumend-replay's JSON report; NULL after a message. extra: NULL-terminated arguments. */
static cJSON *replay(const struct lum_bench_options *o, const struct server *s, const char *const *extra)
{
    static char text[1 << 16];
    char program[4200];
    snprintf(program, sizeof program, "%s/lumend-replay", o->bin);
    const char *argv[16] = {program, "--url", s->url, "--token", s->token, "--speed", "0", "--json"};
    size_t n = 8;
    for (size_t i = 0; extra[i]; i++)
        argv[n++] = extra[i];
    int fd, status = 0;
    pid_t pid = spawn(argv, &fd);
    FILE *out = pid > 0 ? fdopen(fd, "r") : NULL;
    size_t size = out ? fread(text, 1, sizeof text - 1, out) : 0;
    text[size] = 0;
    if (out)
        fclose(out);
    if (pid < 0 || waitpid(pid, &status, 0) != pid || !WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        fprintf(stderr, "lumend-bench: lumend-replay failed\n");
        return NULL;
    }
    return cJSON_Parse(text);
}

enum { DIM, MOVE, CAMERA, N_EDITS };
static const char *const edit_names[N_EDITS] = {"light dimmed", "object moved", "camera moved"};

static bool write_edits(const struct lum_bench_options *o, int edit, int count, char *ret_path, size_t size)
{
    char name[32];
    snprintf(name, sizeof name, "stream-%d.jsonl", edit);
    snprintf(ret_path, size, "%s/%s", o->out, name);
    FILE *f = lum_bench_open(o, name);
    if (!f)
        return false;
    fprintf(f, "{\"lumend\":1,\"kind\":\"replay\"}\n");
    for (int i = 1; i <= count; i++) {
        if (edit == DIM)
            fprintf(f, "{\"t_ms\":%d,\"op\":\"set\",\"id\":\"ceiling-panel\",\"path\":\"/flux_lm\",\"value\":%d}\n",
                    40 * i, 4000 + 100 * (i % 70));
        else
            fprintf(f,
                    "{\"t_ms\":%d,\"op\":\"set\",\"id\":\"tall-statue\",\"path\":\"/transform/"
                    "rotate_deg\",\"value\":[0,%d,0]}\n",
                    40 * i, i * 2 % 360);
    }
    return fclose(f) == 0;
}

static const struct lum_bench_column columns[] = {
    {"edit", "edit", LUM_BENCH_TEXT}, {"method", "method", LUM_BENCH_TEXT}, {"server_p50_ms", "server p50", 1},
    {"server_p95_ms", "p95", 1},      {"server_max_ms", "max", 1},          {"client_p50_ms", "client p50", 1},
    {"client_p95_ms", "p95", 1},      {"client_max_ms", "max", 1},
};

static void put_row(struct lum_bench_table *t, const char *edit, const char *method, const cJSON *json,
                    const char *client_key)
{
    const cJSON *sides[2] = {cJSON_GetObjectItem(json, "server_us"), cJSON_GetObjectItem(json, client_key)};
    const char *const keys[3] = {"p50", "p95", "max"};
    LUM_BENCH_TEXTS(t, edit, method);
    for (int i = 0; i < 6; i++) {
        const cJSON *us = cJSON_GetObjectItem(sides[i / 3], keys[i % 3]);
        lum_bench_table_number(t, us ? us->valuedouble * 1e-3 : (double)NAN);
    }
}

static bool measure(const struct lum_bench_options *o, const struct server *s, const char *method,
                    struct lum_bench_table *t)
{
    int count = o->quick ? 6 : 100;
    char path[4200], steps[16];
    snprintf(steps, sizeof steps, "%d", count);
    for (int edit = 0; edit < N_EDITS; edit++) {
        lum_bench_progress("stream: %s: %s", method, edit_names[edit]);
        const char *camera[] = {"--method", method, "--camera-orbit", steps, NULL};
        const char *edits[] = {"--method", method, path, NULL};
        if (edit != CAMERA && !write_edits(o, edit, count, path, sizeof path))
            return false;
        cJSON *json = replay(o, s, edit == CAMERA ? camera : edits);
        if (!json)
            return false;
        put_row(t, edit_names[edit], method, json, edit == CAMERA ? "camera_to_frame_us" : "edit_to_frame_us");
        cJSON_Delete(json);
    }
    return true;
}

int lum_bench_stream(const struct lum_bench_options *options)
{
    struct server server;
    if (strcmp(options->scene, "cornell") != 0) {
        fprintf(stderr, "lumend-bench: stream edits ceiling-panel and tall-statue: --scene cornell\n");
        return 2;
    }
    struct lum_bench_table t = LUM_BENCH_TABLE(columns);
    bool ok = server_start(options, &server) && measure(options, &server, "live", &t) &&
              measure(options, &server, "path", &t) && measure(options, &server, "whitted", &t);
    server_stop(&server);
    printf("%s at 600x400, milliseconds\n", options->scene);
    return lum_bench_table_finish(&t, options, ok ? "stream" : NULL) && ok ? 0 : 1;
}
