#define _GNU_SOURCE
#include "server/import/child.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "server/base/log.h"
#include "server/import/asset.h"

#define POLL_MS 50 /* how soon a cancel is seen */
#define PIPE_BYTES (1 << 20)
/* Ops, progress, warnings, errors, settings: most are below 8 KiB, a preset of 4096 lamps a MiB. */
#define TEXT_CHUNK_BYTES (4u << 20)

enum { OUT, LOG, FILES, STREAMS };

struct child {
    const struct lum_import_run *run;
    pid_t pid;
    int fds[STREAMS]; /* stdout and stderr of the child, and its file socket; -1: closed */
    int dir_fd;       /* of the asset: what it may open lies below */
    const char *name; /* the asset's own file there */
    uint32_t n_files;
    int64_t deadline_ns;
    uint64_t n_bytes; /* of stdout so far */
    uint8_t head[8];  /* of the chunk being read */
    size_t n_head;
    enum lum_import_chunk kind;
    uint8_t *body; /* of a blob an array as in bulk.h, else from malloc */
    size_t n_body, body_bytes;
    bool done;
    char log[1024]; /* the first of what it printed on stderr */
    size_t n_log;
    struct lum_proto_error *err;
};

static bool refuse(struct child *c, const char *code, const char *text)
{
    return lum_proto_fail(c->err, LUM_PROTO_APPLICATION, code, "asset", "%.100s: %s", c->run->asset, text);
}

/* ---- starting ---- */

/* All descriptors here are close-on-exec; the child's are made by dup2 in posix_spawn, which a threaded process may
 * call. */
static int spawn(struct child *c, const int theirs[STREAMS])
{
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attr;
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    sigdelset(&all, SIGKILL);
    sigdelset(&all, SIGSTOP);
    int e = posix_spawn_file_actions_init(&actions);
    if (e)
        return e;
    e = posix_spawnattr_init(&attr);
    if (e) {
        posix_spawn_file_actions_destroy(&actions);
        return e;
    }
    e = posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    for (int i = 0; i < STREAMS && !e; i++)
        e = posix_spawn_file_actions_adddup2(&actions, theirs[i], i + 1);
    if (!e)
        e = posix_spawnattr_setflags(&attr, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    if (!e)
        e = posix_spawnattr_setsigmask(&attr, &none);
    if (!e)
        e = posix_spawnattr_setsigdefault(&attr, &all);
    char cpu_s[16];
    snprintf(cpu_s, sizeof cpu_s, "%u", c->run->cpu_s);
    char *const argv[] = {
        (char *)"lumend-import", (char *)c->run->kind, (char *)c->name, (char *)c->run->id, cpu_s, NULL};
    char *const envp[] = {NULL};
    if (!e)
        e = posix_spawn(&c->pid, c->run->importer, &actions, &attr, argv, envp);
    posix_spawnattr_destroy(&attr);
    posix_spawn_file_actions_destroy(&actions);
    return e;
}

static void close_fd(int *fd)
{
    if (*fd >= 0)
        close(*fd);
    *fd = -1;
}

/* dup2(n, n) would leave close-on-exec set, so the child's ends are moved above the numbers they go to. */
static bool raise_fd(int *fd)
{
    int high = fcntl(*fd, F_DUPFD_CLOEXEC, 10);
    close_fd(fd);
    *fd = high;
    return high >= 0;
}

static bool start(struct child *c)
{
    int pairs[STREAMS][2] = {{-1, -1}, {-1, -1}, {-1, -1}};
    int theirs[STREAMS] = {-1, -1, -1};
    bool ok = pipe2(pairs[OUT], O_CLOEXEC) == 0 && pipe2(pairs[LOG], O_CLOEXEC) == 0 &&
              socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pairs[FILES]) == 0;
    for (int i = 0; i < STREAMS; i++) {
        c->fds[i] = pairs[i][0];
        theirs[i] = pairs[i][1];
        ok = ok && raise_fd(&theirs[i]) && fcntl(c->fds[i], F_SETFL, O_NONBLOCK) == 0;
    }
    if (ok)
        fcntl(c->fds[OUT], F_SETPIPE_SZ, PIPE_BYTES); /* fewer turns; the default does as well */
    int e = ok ? spawn(c, theirs) : errno;
    for (int i = 0; i < STREAMS; i++)
        close_fd(&theirs[i]);
    if (!e)
        return true;
    return lum_proto_fail(c->err, LUM_PROTO_APPLICATION, "import_failed", "asset", "cannot start %.120s: %s",
                          c->run->importer, strerror(e));
}

/* ---- files ---- */

static void reply(struct child *c, enum lum_status status, int fd, uint64_t n_bytes)
{
    struct lum_file_reply r = {.status = (uint32_t)status, .n_bytes = n_bytes};
    union {
        char bytes[CMSG_SPACE(sizeof(int))];
        struct cmsghdr align;
    } control;
    struct iovec iov = {&r, sizeof r};
    struct msghdr msg = {.msg_iov = &iov, .msg_iovlen = 1};
    if (fd >= 0) {
        memset(&control, 0, sizeof control);
        msg.msg_control = &control;
        msg.msg_controllen = sizeof control.bytes;
        struct cmsghdr *h = CMSG_FIRSTHDR(&msg);
        h->cmsg_level = SOL_SOCKET;
        h->cmsg_type = SCM_RIGHTS;
        h->cmsg_len = CMSG_LEN(sizeof fd);
        memcpy(CMSG_DATA(h), &fd, sizeof fd);
    }
    if (sendmsg(c->fds[FILES], &msg, MSG_NOSIGNAL | MSG_DONTWAIT) < 0)
        close_fd(&c->fds[FILES]); /* the child went, or floods us without reading: it gets no more files */
}

static void serve_file(struct child *c)
{
    char datagram[1 + LUM_FILE_NAME_BYTES + 1];
    ssize_t n = recv(c->fds[FILES], datagram, sizeof datagram - 1, MSG_DONTWAIT);
    if (n < 0 && (errno == EAGAIN || errno == EINTR))
        return;
    if (n < 2) {
        close_fd(&c->fds[FILES]);
        return;
    }
    datagram[n] = 0;
    int fd = -1;
    uint64_t n_bytes = 0;
    enum lum_status status = LUM_ERR_LIMIT;
    if (strlen(datagram + 1) != (size_t)n - 1)
        status = LUM_ERR_INVALID;
    else if (c->n_files++ < LUM_LIMIT_IMPORT_FILES)
        status = lum_asset_open(c->dir_fd, datagram + 1, datagram[0] & (char)LUM_FILE_ANY_CASE, &fd, &n_bytes);
    if (!status && n_bytes > LUM_LIMIT_IMPORT_FILE_BYTES)
        status = LUM_ERR_LIMIT;
    reply(c, status, status ? -1 : fd, n_bytes);
    if (fd >= 0)
        close(fd);
}

/* ---- the stream ---- */

static bool own_error(struct child *c, const uint8_t *text, size_t n)
{
    struct lum_proto_error ignored;
    cJSON *json = lum_json_parse((const char *)text, n, &ignored);
    const cJSON *code = cJSON_GetObjectItemCaseSensitive(json, "code");
    const cJSON *why = cJSON_GetObjectItemCaseSensitive(json, "text");
    const char *told = cJSON_IsString(why) ? why->valuestring : "failed";
    size_t n_name = strlen(c->name); /* the importer names each file; the asset itself is named by us */
    if (strncmp(told, c->name, n_name) == 0 && strncmp(told + n_name, ": ", 2) == 0)
        told += n_name + 2;
    refuse(c, cJSON_IsString(code) ? code->valuestring : "import_failed", told);
    cJSON_Delete(json);
    return false;
}

static void free_body(enum lum_import_chunk kind, uint8_t *body)
{
    if (kind == LUM_CHUNK_BLOB)
        lum_bulk_unref(body);
    else
        free(body);
}

static bool take_chunk(struct child *c)
{
    bool ok = true;
    uint8_t *body = c->body;
    c->body = NULL;
    c->n_head = 0;
    if (c->kind == LUM_CHUNK_DONE)
        c->done = true;
    else if (c->kind == LUM_CHUNK_ERROR)
        ok = own_error(c, body, c->body_bytes);
    else
        ok = c->run->chunk(c->run->user, c->kind, body, c->body_bytes, c->err);
    if (!ok || c->kind != LUM_CHUNK_BLOB)
        free_body(c->kind, body);
    return ok;
}

/* A chunk head is complete: checks it and makes room. */
static bool begin_chunk(struct child *c)
{
    uint32_t kind, n;
    memcpy(&kind, c->head, sizeof kind);
    memcpy(&n, c->head + 4, sizeof n);
    if (kind < LUM_CHUNK_OP || kind > LUM_CHUNK_SETTINGS || c->done || (kind != LUM_CHUNK_BLOB && n > TEXT_CHUNK_BYTES))
        return refuse(c, "import_failed", "the importer's output is damaged");
    c->n_bytes += sizeof c->head + n;
    if (c->n_bytes > LUM_LIMIT_IMPORT_OUTPUT_BYTES + TEXT_CHUNK_BYTES)
        return refuse(c, "limit_exceeded", "the importer's output is over the limit");
    c->kind = (enum lum_import_chunk)kind;
    c->body = kind == LUM_CHUNK_BLOB ? lum_bulk_create(n) : calloc((size_t)n + 1, 1);
    if (!c->body)
        return refuse(c, "limit_exceeded", "out of memory");
    c->n_body = 0;
    c->body_bytes = n;
    return true;
}

/* Reads what is there, at most once per poll so that cancel and the deadline are seen. */
static bool read_output(struct child *c)
{
    bool in_head = c->n_head < sizeof c->head;
    uint8_t *to = in_head ? c->head + c->n_head : c->body + c->n_body;
    size_t want = in_head ? sizeof c->head - c->n_head : c->body_bytes - c->n_body;
    ssize_t n = read(c->fds[OUT], to, want);
    if (n < 0 && (errno == EAGAIN || errno == EINTR))
        return true;
    if (n <= 0) {
        close_fd(&c->fds[OUT]);
        return true;
    }
    if (in_head) {
        c->n_head += (size_t)n;
        if (c->n_head < sizeof c->head)
            return true;
        if (!begin_chunk(c))
            return false;
    } else {
        c->n_body += (size_t)n;
    }
    return c->n_body < c->body_bytes || take_chunk(c);
}

static void read_log(struct child *c)
{
    char text[512];
    ssize_t n = read(c->fds[LOG], text, sizeof text);
    if (n < 0 && (errno == EAGAIN || errno == EINTR))
        return;
    if (n <= 0) {
        close_fd(&c->fds[LOG]);
        return;
    }
    size_t room = sizeof c->log - 1 - c->n_log, keep = (size_t)n < room ? (size_t)n : room;
    memcpy(c->log + c->n_log, text, keep);
    c->n_log += keep;
}

static bool cancelled(const struct child *c)
{
    return c->run->cancel && atomic_load_explicit(c->run->cancel, memory_order_relaxed);
}

static bool pump(struct child *c)
{
    while (c->fds[OUT] >= 0 || c->fds[LOG] >= 0) {
        struct pollfd p[STREAMS];
        for (int i = 0; i < STREAMS; i++)
            p[i] = (struct pollfd){.fd = c->fds[i], .events = POLLIN};
        poll(p, STREAMS, POLL_MS);
        if (cancelled(c))
            return lum_proto_fail(c->err, LUM_PROTO_APPLICATION, "cancelled", "asset", "%.100s: cancelled",
                                  c->run->asset);
        if (lum_clock_ns() > c->deadline_ns) {
            char text[64];
            snprintf(text, sizeof text, "timed out after %u s", LUM_LIMIT_IMPORT_WALL_S);
            return refuse(c, "import_failed", text);
        }
        if (p[LOG].revents)
            read_log(c);
        if (p[FILES].revents)
            serve_file(c);
        if (p[OUT].revents && !read_output(c))
            return false;
    }
    return true;
}

/* ---- the end ---- */

static bool explain_signal(struct child *c, int sig)
{
    char text[96];
    if (sig == SIGXCPU)
        snprintf(text, sizeof text, "timed out after %u s of CPU", c->run->cpu_s);
    else if (sig == SIGSYS)
        snprintf(text, sizeof text, "the importer tried something its sandbox forbids (signal %d)", sig);
    else
        snprintf(text, sizeof text, "the importer crashed (signal %d)", sig);
    return refuse(c, "import_failed", text);
}

/* Reaps the child. kill: it is not wanted any more. False, with the reason, unless it ended well after `done`. */
static bool finish(struct child *c, bool kill_it)
{
    int status = 0;
    pid_t got = 0;
    if (kill_it)
        kill(c->pid, SIGKILL);
    while (got == 0 || (got < 0 && errno == EINTR)) {
        got = waitpid(c->pid, &status, kill_it ? 0 : WNOHANG);
        if (got == 0) { /* it closed its streams and stays */
            poll(NULL, 0, 1);
            if (lum_clock_ns() > c->deadline_ns || cancelled(c))
                kill(c->pid, SIGKILL);
        }
    }
    if (c->n_log)
        lum_log(c->run->log, LUM_LOG_WARNING, "import", "%s: importer says: %.400s", c->run->asset, c->log);
    if (kill_it)
        return false;
    if (got < 0)
        return refuse(c, "import_failed", "the importer was lost");
    if (WIFSIGNALED(status))
        return explain_signal(c, WTERMSIG(status));
    if (!c->done || WEXITSTATUS(status) != 0)
        return refuse(c, "import_failed", c->done ? "the importer failed at its end" : "the importer ended too early");
    return true;
}

static bool open_asset_dir(struct child *c)
{
    int root_fd = open(c->run->assets_dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (root_fd < 0)
        return lum_proto_fail(c->err, LUM_PROTO_APPLICATION, "io", "asset", "cannot open the folder of model files: %s",
                              strerror(errno));
    enum lum_status status = lum_asset_open_dir(root_fd, c->run->asset, &c->dir_fd);
    close(root_fd);
    if (status)
        return refuse(c, "not_found",
                      status == LUM_ERR_INVALID ? "must be a path below the asset directory" : "no such file");
    const char *slash = strrchr(c->run->asset, '/');
    c->name = slash ? slash + 1 : c->run->asset;
    return true;
}

bool lum_import_run(const struct lum_import_run *run, struct lum_proto_error *err)
{
    struct child c = {.run = run, .fds = {-1, -1, -1}, .dir_fd = -1, .err = err};
    bool ok = false;
    if (!run->assets_dir)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "unsupported", "asset",
                              "imports need a folder of model files: give one with --assets DIR");
    if (!open_asset_dir(&c))
        return false;
    c.deadline_ns = lum_clock_ns() + LUM_LIMIT_IMPORT_WALL_S * 1000000000ll;
    if (start(&c)) {
        ok = pump(&c);
        /* a child that reported an error or broke a limit is not waited for */
        ok = finish(&c, !ok);
    }
    for (int i = 0; i < STREAMS; i++)
        close_fd(&c.fds[i]);
    close_fd(&c.dir_fd);
    free_body(c.kind, c.body);
    return ok;
}
