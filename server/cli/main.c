/* lumend: subcommands, and the life of the daemon.
 *
 * - Start: options, log, token, listening socket (a taken port is found before a long load), signal thread, director
 *   (a thread loads the scene and starts the renderer; the net thread answers that it is not ready), sessions, then
 *   the ready line on stdout.
 * - Run: the main thread is the net thread. The director is a thread of its own; it has the worker pool and, for an
 *   import, a child process.
 * - Stop: the signal thread sees SIGTERM or SIGINT and calls lum_net_stop. The net thread refuses sessions, sends
 *   session.closing, closes every session, and returns. Then in reverse order of the start: sessions, director (cancels
 *   its pass, joins), network, log. A second signal exits at once.
 *
 * Signals are blocked in every thread before the first is started and taken by one thread with sigwait, so no handler
 * ever runs in the middle of anything. */
#define _GNU_SOURCE
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "core/accel/accel.h"
#include "core/image/exr.h"
#include "protocol/base/nearest.h"
#include "server/base/service.h"
#include "server/cli/help.h"
#include "server/cli/serve_options.h"
#include "server/director/director.h"
#include "server/net/auth.h"
#include "server/net/healthcheck.h"
#include "server/net/net.h"
#include "server/net/projects.h"
#include "server/net/tls.h"
#include "server/stream/vp9.h"
#include "server/stream/webp.h"

static void help_serve(const struct lum_help *h)
{
    lum_help_text(
        h, "lumend: a render server. Clients edit a scene over WebSocket and watch it with global illumination.\n"
           "\n"
           "  lumend [serve] [options]            serve a scene; open the printed URL in a browser\n"
           "  lumend render --scene S --out F     render without network: an .exr or .png\n"
           "  lumend compare A.exr B.exr          error metrics of two images, as JSON\n"
           "  lumend measure --scene S            illuminance on a work plane: Em, Emin, uniformity\n"
           "  lumend export --scene S --out F.glb the scene with its edits as a glTF file\n"
           "  lumend state check DIR              of what --state kept; also export, compact\n"
           "  lumend token NAME                   lets somebody in by a token of her own: for --tokens\n"
           "  lumend photometry F.ies             what a photometric file says: lumens, beam, symmetry\n"
           "  lumend scenes | methods             what is built in: scenes, replays for them, methods\n"
           "  lumend help --man                   all of this as a man page: lumend help --man | man -l -\n"
           "  lumend --version | --help           each command has its own --help\n"
           "\n"
           "Options of serve; each may also come from the environment (--token-file: LUMEND_TOKEN_FILE):\n");
    lum_serve_options_help(h);
    lum_help_text(h,
                  "\n"
                  "Try:\n"
                  "  lumend                              the Cornell box on this machine\n"
                  "  lumend --scene office --listen 127.0.0.1:0\n"
                  "  lumend --projects rooms             many scenes in the folder rooms\n"
                  "  lumend --scene room.glb --listen 0.0.0.0:9460 --token-file token --allow-host render.example \\\n"
                  "         --tls-cert render.pem --tls-key render.key\n");
}

static int version(void)
{
    const char *tls = lum_tls_library();
    printf("lumend %s (protocol 1)\n%s\n%s\n%s\n%s%s\n%s WebP\n%s VP9\ncJSON %s\ncompiler %s\n", LUMEND_VERSION,
           lum_accel_library(), lum_exr_library(), lum_net_library(), tls ? "OpenSSL " : "without TLS", tls ? tls : "",
           lum_webp_available() ? "with" : "without", lum_vp9_available() ? "with" : "without", cJSON_Version(),
           __VERSION__);
    return LUM_EXIT_OK;
}

static int fail(int status, const struct lum_error *err)
{
    fprintf(stderr, "lumend: %s\n", err->text);
    if (status == LUM_EXIT_USAGE)
        fprintf(stderr, "lumend --help lists the options\n");
    return status;
}

/* ---- signals ---- */

struct signal_watch {
    pthread_t thread;
    sigset_t signals;
    struct lum_net *net;
    const struct lum_service *service;
    const char *tokens; /* the file, which SIGHUP has read again; NULL: none */
    struct lum_auth *auth;
    struct lum_tls *tls; /* its files, too; NULL: none */
    struct lum_log log;
};

/* A file that is wrong changes nothing: who works goes on. */
static void read_tokens_again(const struct signal_watch *w)
{
    struct lum_people *people;
    struct lum_error err;
    if (lum_people_read(w->tokens, &people, &err)) {
        lum_log(&w->log, LUM_LOG_ERROR, "main", "SIGHUP: %s; the people stay who they were", err.text);
        return;
    }
    lum_log(&w->log, LUM_LOG_INFO, "main", "SIGHUP: %zu people may connect", people->n);
    lum_auth_offer(w->auth, people);
    lum_net_wake(w->net);
}

static void read_certificate_again(const struct signal_watch *w)
{
    struct lum_error err;
    if (lum_tls_read_again(w->tls, &err)) {
        lum_log(&w->log, LUM_LOG_ERROR, "main", "SIGHUP: %s; the certificate stays the one that it was", err.text);
        return;
    }
    lum_log(&w->log, LUM_LOG_INFO, "main", "SIGHUP: new connections have the certificate that was read");
    lum_net_wake(w->net);
}

/* SIGUSR1 comes from signals_finish: the daemon ended by itself. */
static void *watch_signals(void *arg)
{
    struct signal_watch *w = arg;
    int signal_number = 0, n_stops = 0;
    while (sigwait(&w->signals, &signal_number) == 0 && signal_number != SIGUSR1) {
        if (signal_number == SIGHUP) {
            if (w->tokens)
                read_tokens_again(w);
            if (w->tls)
                read_certificate_again(w);
            continue;
        }
        if (n_stops++ > 0)
            _exit(LUM_EXIT_FAILED); /* asked twice: nothing is waited for */
        lum_service_tell(w->service, "STOPPING=1");
        lum_net_stop(w->net);
    }
    return NULL;
}

/* Before any thread is started: they inherit the mask. Without a file to read again SIGHUP ends the daemon, as it does
 * where a terminal is closed. */
static void signals_block(struct signal_watch *w, bool rereads)
{
    sigemptyset(&w->signals);
    if (rereads)
        sigaddset(&w->signals, SIGHUP);
    sigaddset(&w->signals, SIGTERM);
    sigaddset(&w->signals, SIGINT);
    sigaddset(&w->signals, SIGUSR1);
    pthread_sigmask(SIG_BLOCK, &w->signals, NULL);
    signal(SIGPIPE, SIG_IGN); /* a peer that is gone is an error code, not a signal */
    signal(SIGXFSZ, SIG_IGN); /* so is a file that may not grow */
}

static bool signals_begin(struct signal_watch *w, struct lum_net *net, const struct lum_service *service)
{
    w->net = net;
    w->service = service;
    return pthread_create(&w->thread, NULL, watch_signals, w) == 0;
}

static void signals_finish(struct signal_watch *w)
{
    pthread_kill(w->thread, SIGUSR1);
    pthread_join(w->thread, NULL);
}

/* ---- serve ---- */

/* OpenSSL sets itself up when it is first used. Where memory is short then, it never tries again: not while people
 * wait. */
static enum lum_status begin_hashing(struct lum_error *err)
{
    uint8_t sha[LUM_TOKEN_SHA_BYTES];
    return lum_token_sha("", sha) ? LUM_OK : lum_fail(err, LUM_ERR_NOMEM, "", "no memory for SHA-256");
}

static enum lum_status make_auth(const struct lum_serve_options *o, struct lum_auth *ret_auth, struct lum_error *err)
{
    if (o->no_auth) {
        memset(ret_auth, 0, sizeof *ret_auth);
        return LUM_OK;
    }
    const char *file = o->token_file;
    enum lum_status status = LUM_OK;
    memset(ret_auth, 0, sizeof *ret_auth);
    if (file)
        status = lum_auth_from_file(file, ret_auth, err);
    else if (!o->tokens)
        status = lum_auth_random(ret_auth, err);
    ret_auth->required = true;
    return status || !o->tokens ? status : lum_people_read(o->tokens, &ret_auth->people, err);
}

/* The one line on stdout. A server on all addresses is opened by a local one. */
static void print_ready(const struct lum_serve_options *o, uint16_t port, const struct lum_auth *auth,
                        const struct lum_tls *tls)
{
    char name[256];
    const char *local = lum_address_local(&o->listen);
    const char *host = tls ? lum_tls_name(tls, local, o->listen.loopback, name, sizeof name) : local;
    bool v6 = strchr(host, ':') != NULL;
    printf("lumend ready %s://%s%s%s:%u/%s%s\n", tls ? "https" : "http", v6 ? "[" : "", host, v6 ? "]" : "", port,
           auth->token[0] ? "#t=" : "", auth->token);
    fflush(stdout);
}

/* *ret_tls stays NULL where none is spoken. */
static enum lum_status make_tls(const struct lum_serve_options *o, struct lum_log log, struct lum_tls **ret_tls,
                                struct lum_error *err)
{
    const struct lum_tls_config config = {
        .cert_path = o->tls_cert, .key_path = o->tls_key, .hosts = o->allow_host, .log = log};
    return o->tls_cert ? lum_tls_create(&config, ret_tls, err) : LUM_OK;
}

static enum lum_status make_net(const struct lum_serve_options *o, struct lum_auth *auth, struct lum_tls *tls,
                                struct lum_log log, const struct lum_service *service, struct lum_net **ret_net,
                                struct lum_error *err)
{
    const struct lum_net_config config = {
        .address = o->listen,
        .access = {.loopback = o->listen.loopback, .tls = tls, .hosts = o->allow_host, .origins = o->allow_origin},
        .auth = auth,
        .tls = tls,
        .service = service,
        .log = log,
    };
    return lum_net_create(&config, ret_net, err);
}

/* *ret_desk stays NULL where no desk is listened to. */
static enum lum_status make_desk(const struct lum_serve_options *o, struct lum_log log, struct lum_desk **ret_desk,
                                 struct lum_error *err)
{
    struct lum_desk_config config = {.log = log};
    bool any = false;
    for (int p = 0; p < LUM_DESK_PROTOCOL_COUNT; p++) {
        struct lum_desk_ear *ear = &config.ears[p];
        ear->open = o->desk[p].host[0] != '\0';
        ear->port = o->desk[p].port;
        snprintf(ear->host, sizeof ear->host, "%s", o->desk[p].host);
        any = any || ear->open;
    }
    snprintf(config.ears[LUM_DESK_SACN].interface, sizeof config.ears[0].interface, "%s",
             o->sacn_join ? o->sacn_join : "");
    return any ? lum_desk_create(&config, ret_desk, err) : LUM_OK;
}

static void tell_alive(void *service)
{
    lum_service_tell_alive(service);
}

static struct lum_director_config director_config(const struct lum_serve_options *o, struct lum_log log,
                                                  struct lum_net *net, struct lum_service *service)
{
    return (struct lum_director_config){
        .scene = o->scene,
        .assets_dir = o->assets,
        .state_dir = o->state,
        .durability = o->durability,
        .snapshot_bytes = 1024ull * o->snapshot_kib,
        .scene_asked = strcmp(o->given[LUM_SERVE_SCENE], "default") != 0,
        .importer = o->importer,
        .method = o->method,
        .isa = o->isa,
        .threads = o->threads,
        .deterministic = o->deterministic,
        .audit = o->audit,
        .log = log,
        .wake_net = lum_net_wake,
        .wake_user = net,
        .alive = service->alive_ns ? tell_alive : NULL,
        .alive_user = service,
        .alive_ns = service->alive_ns,
    };
}

/* A folder that is missing is not an error: the container names one that need not be mounted. */
static bool has_assets(const struct lum_serve_options *o, struct lum_log log)
{
    const char *dir = o->assets;
    struct stat st;
    bool found = dir && !stat(dir, &st) && S_ISDIR(st.st_mode);
    if (dir && !found)
        lum_log(&log, LUM_LOG_WARNING, "main", "%s %s is no folder: nothing can be imported",
                o->given[LUM_SERVE_ASSETS], dir);
    return found;
}

/* The scene is loaded beside the network, which says so meanwhile. */
struct loading {
    const struct lum_serve_options *options;
    struct lum_log log;
    struct lum_net *net;
    struct lum_service *service;
    struct lum_desk *desk;         /* NULL: none is listened to */
    const char *uploads_dir;       /* NULL: nobody may send files */
    struct lum_director *director; /* the result */
    enum lum_status status;
    struct lum_error *err;
    _Atomic bool done;
};

static void *load_main(void *arg)
{
    struct loading *l = arg;
    struct lum_director_config config = director_config(l->options, l->log, l->net, l->service);
    config.desk = l->desk;
    config.uploads_dir = l->uploads_dir;
    l->status = lum_director_create(&config, &l->director, l->err);
    atomic_store(&l->done, true);
    lum_net_wake(l->net);
    return NULL;
}

static enum lum_status load(struct loading *l)
{
    pthread_t thread;
    if (pthread_create(&thread, NULL, load_main, l))
        return lum_fail(l->err, LUM_ERR_INTERNAL, "", "cannot start a thread");
    bool failed;
    if (!lum_net_wait(l->net, &l->done, &failed)) { /* nobody was served: there is nothing to keep */
        lum_log(&l->log, failed ? LUM_LOG_ERROR : LUM_LOG_INFO, "main",
                failed ? "the network failed while the scene was being loaded"
                       : "stopped while the scene was being loaded");
        _exit(failed ? LUM_EXIT_FAILED : LUM_EXIT_OK);
    }
    pthread_join(thread, NULL);
    return l->status;
}

static struct lum_uploads_config uploads_config(const struct lum_serve_options *o, struct lum_log log,
                                                struct lum_net *net)
{
    return (struct lum_uploads_config){.max_bytes = (uint64_t)o->upload_mib << 20,
                                       .disk = &lum_disk_real,
                                       .audit = o->audit,
                                       .log = log,
                                       .wake = lum_net_wake,
                                       .wake_user = net};
}

/* Once the director has the folder of --state for itself. What cannot be kept is not taken; all else is served. */
static struct lum_uploads *make_uploads(const struct lum_serve_options *o, const char *dir, struct lum_log log,
                                        struct lum_net *net)
{
    struct lum_error err;
    struct lum_uploads *uploads = NULL;
    struct lum_uploads_config config = uploads_config(o, log, net);
    config.root = dir;
    if (dir && lum_uploads_create(&config, &uploads, &err))
        lum_log(&log, LUM_LOG_WARNING, "main", "no file can be sent: %s", err.text);
    return uploads;
}

/* From the ready line to the end. */
static enum lum_status serve_projects(const struct lum_serve_options *o, struct lum_projects *projects,
                                      const struct lum_auth *auth, struct lum_log log, struct lum_net *net,
                                      struct lum_service *service, struct lum_error *err)
{
    struct lum_sessions *sessions = NULL;
    const struct lum_sessions_config config = {.projects = projects,
                                               .auth = auth,
                                               .counters = lum_net_counters(net),
                                               .imports = has_assets(o, log),
                                               .saved =
                                                   o->state || o->projects ? lum_durability_names[o->durability] : NULL,
                                               .audit = o->audit,
                                               .log = log};
    enum lum_status status = lum_sessions_create(&config, &sessions, err);
    if (!status) {
        lum_serve_options_warn(&log);
        print_ready(o, lum_net_port(net), auth, lum_net_tls(net));
        lum_log(&log, LUM_LOG_INFO, "main", "listening on %s port %u", o->listen.host, lum_net_port(net));
        if (!o->listen.loopback && !lum_net_tls(net))
            lum_log(&log, LUM_LOG_WARNING, "main",
                    "clear text beyond this machine: without a proxy that speaks TLS, or --tls-cert, token, scene and "
                    "pictures can be read on the way");
        lum_service_tell(service, "READY=1");
        lum_net_run(net, sessions, projects);
        lum_log(&log, LUM_LOG_INFO, "main", "stopped");
    }
    lum_sessions_destroy(sessions);
    return status;
}

/* From the director to the end of the run; net and the signal thread are there. uploads_dir: where to keep what people
 * send; NULL: nobody may. */
static enum lum_status run(const struct lum_serve_options *o, const char *uploads_dir, const struct lum_auth *auth,
                           struct lum_log log, struct lum_net *net, struct lum_service *service, struct lum_error *err)
{
    struct loading loading = {
        .options = o, .log = log, .net = net, .service = service, .uploads_dir = uploads_dir, .err = err};
    struct lum_projects *projects = NULL;
    enum lum_status status = make_desk(o, log, &loading.desk, err);
    if (!status)
        status = load(&loading);
    if (status) {
        lum_desk_destroy(loading.desk);
        return status;
    }
    struct lum_uploads *uploads = make_uploads(o, uploads_dir, log, net);
    status = lum_projects_of_one(loading.director, uploads, &projects, err);
    if (!status)
        status = serve_projects(o, projects, auth, log, net, service, err);
    (void)lum_projects_destroy(projects);
    lum_uploads_destroy(uploads);
    lum_director_destroy(loading.director);
    lum_desk_destroy(loading.desk);
    return status;
}

/* 0: half of the machine's. */
static uint64_t memory_for(uint32_t mib)
{
    long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    return mib ? (uint64_t)mib << 20 : pages > 0 && page > 0 ? (uint64_t)pages * (uint64_t)page / 2 : 0;
}

/* Nothing is loaded before somebody comes. */
static enum lum_status run_projects(const struct lum_serve_options *o, const struct lum_auth *auth, struct lum_log log,
                                    struct lum_net *net, struct lum_service *service, struct lum_error *err)
{
    struct lum_projects *projects = NULL;
    const struct lum_projects_config config = {.path = o->projects,
                                               .director = director_config(o, log, net, service),
                                               .uploads = uploads_config(o, log, net),
                                               .max_open = o->open_projects,
                                               .max_bytes = memory_for(o->projects_mib),
                                               .unused_ns = o->close_unused_s * 1000000000ll};
    enum lum_status status = lum_projects_create(&config, &projects, err);
    if (!status)
        status = serve_projects(o, projects, auth, log, net, service, err);
    if (!lum_projects_destroy(projects)) {
        lum_log(&log, LUM_LOG_INFO, "main", "stopped while a project was being loaded");
        _exit(LUM_EXIT_OK);
    }
    return status;
}

static enum lum_status run_with_uploads(const struct lum_serve_options *o, const struct lum_auth *auth,
                                        struct lum_log log, struct lum_net *net, struct lum_service *service,
                                        struct lum_error *err)
{
    struct lum_upload_root root;
    struct lum_error why;
    if (o->projects)
        return run_projects(o, auth, log, net, service, err);
    if (o->state || o->upload_mib == 0)
        return run(o, o->upload_mib ? o->state : NULL, auth, log, net, service, err);
    bool made = !lum_upload_root_make(&root, &why);
    if (!made)
        lum_log(&log, LUM_LOG_WARNING, "main", "no file can be sent: %s", why.text);
    enum lum_status status = run(o, made ? root.path : NULL, auth, log, net, service, err);
    if (made)
        lum_upload_root_remove(&root);
    return status;
}

static enum lum_status serve(const struct lum_serve_options *o, struct lum_log log, struct lum_error *err)
{
    struct lum_auth auth = {0};
    struct lum_net *net = NULL;
    struct lum_service service;
    struct signal_watch watch = {.tokens = o->tokens, .auth = &auth, .log = log};
    signals_block(&watch, o->tokens || o->tls_cert);
    enum lum_status status = lum_service_open(&service, err);
    if (!status)
        status = begin_hashing(err);
    if (!status)
        status = make_auth(o, &auth, err);
    if (!status)
        status = make_tls(o, log, &watch.tls, err);
    if (!status)
        status = make_net(o, &auth, watch.tls, log, &service, &net, err);
    if (!status && !signals_begin(&watch, net, &service))
        status = lum_fail(err, LUM_ERR_INTERNAL, "", "cannot start a thread");
    else if (!status) {
        status = run_with_uploads(o, &auth, log, net, &service, err);
        signals_finish(&watch);
    }
    lum_net_destroy(net);
    lum_tls_destroy(watch.tls);
    lum_service_close(&service);
    lum_auth_finish(&auth);
    return status;
}

static int help_of(void (*help)(const struct lum_help *h))
{
    help(&(struct lum_help){stdout, false});
    return LUM_EXIT_OK;
}

static int cmd_serve(int argc, char **argv)
{
    struct lum_error err = {0};
    struct lum_serve_options options;
    struct lum_stderr_log stderr_log;
    if (argc > 1 && (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0))
        return help_of(help_serve);
    if (lum_serve_options_parse(argc, argv, &options, &err))
        return fail(LUM_EXIT_USAGE, &err);
    if (options.print_config) {
        lum_serve_options_print(&options, stdout);
        return LUM_EXIT_OK;
    }
    if (options.healthcheck)
        return lum_healthcheck(&options.listen, options.tls_cert, &err) ? fail(LUM_EXIT_FAILED, &err) : LUM_EXIT_OK;
    lum_stderr_log_init(&stderr_log, STDERR_FILENO, options.log);
    enum lum_status status = serve(&options, lum_stderr_log_sink(&stderr_log), &err);
    lum_stderr_log_finish(&stderr_log);
    return status ? fail(LUM_EXIT_FAILED, &err) : LUM_EXIT_OK;
}

/* In the order of the man page. */
static const struct lum_command commands[] = {
    {"serve", cmd_serve, help_serve},
    {"render", lum_cmd_render, lum_help_render},
    {"compare", lum_cmd_compare, lum_help_compare},
    {"measure", lum_cmd_measure, lum_help_measure},
    {"export", lum_cmd_export, lum_help_export},
    {"state", lum_cmd_state, lum_help_state},
    {"token", lum_cmd_token, lum_help_token},
    {"photometry", lum_cmd_photometry, lum_help_photometry},
    {"scenes", lum_cmd_scenes, lum_help_scenes},
    {"methods", lum_cmd_methods, lum_help_methods},
};

static const struct lum_command *find_command(const char *name)
{
    for (size_t i = 0; i < LUM_ARRAY_LEN(commands); i++)
        if (strcmp(name, commands[i].name) == 0)
            return &commands[i];
    return NULL;
}

static int no_command(const char *name)
{
    char text[128];
    struct lum_nearest near = {.given = name};
    for (size_t i = 0; i < LUM_ARRAY_LEN(commands); i++)
        lum_nearest_offer(&near, commands[i].name);
    lum_nearest_text(&near, text, sizeof text);
    fprintf(stderr, "lumend: no command '%.60s'%s (lumend --help lists them)\n", name, text);
    return LUM_EXIT_USAGE;
}

/* lumend help --man-of NAME SUMMARY: the build makes the pages of the other programs so, of their --help. */
static int man_of(const char *name, const char *summary)
{
    char text[65536];
    size_t n = fread(text, 1, sizeof text - 1, stdin);
    text[n] = '\0';
    if (n == 0 || n == sizeof text - 1)
        return LUM_EXIT_FAILED;
    lum_help_man_of(stdout, name, summary, text);
    return fflush(stdout) == 0 ? LUM_EXIT_OK : LUM_EXIT_FAILED;
}

/* lumend help [COMMAND|--man] */
static int cmd_help(const char *of)
{
    const struct lum_command *command = find_command(of);
    if (strcmp(of, "--man") == 0)
        lum_help_man(stdout, commands, LUM_ARRAY_LEN(commands));
    else if (of[0] == '\0')
        help_of(help_serve);
    else if (!command)
        return no_command(of);
    else
        help_of(command->help);
    return fflush(stdout) == 0 ? LUM_EXIT_OK : LUM_EXIT_FAILED;
}

int main(int argc, char **argv)
{
    const char *first = argc > 1 ? argv[1] : "";
    if (argc == 5 && strcmp(first, "help") == 0 && strcmp(argv[2], "--man-of") == 0)
        return man_of(argv[3], argv[4]);
    if (strcmp(first, "help") == 0)
        return cmd_help(argc > 2 ? argv[2] : "");
    if (strcmp(first, "--version") == 0)
        return version();
    if (first[0] == '\0' || first[0] == '-')
        return cmd_serve(argc, argv);
    const struct lum_command *command = find_command(first);
    return command ? command->run(argc - 1, argv + 1) : no_command(first);
}
