#include "server/net/metrics.h"

#include "core/base/base.h"
#include "server/net/projects.h"

struct metric {
    const char *name, *type, *help;
    double value;
};

static void print_metrics(FILE *out, const struct metric *metrics, size_t n)
{
    for (size_t i = 0; i < n; i++)
        fprintf(out, "# HELP lumend_%s %s\n# TYPE lumend_%s %s\nlumend_%s %.17g\n", metrics[i].name, metrics[i].help,
                metrics[i].name, metrics[i].type, metrics[i].name, metrics[i].value);
}

/* Of all scenes together: gauges of those that are open, counters of those that were, too. */
static void print_director_metrics(FILE *out, const struct lum_director_metrics *sum)
{
    const struct lum_director_metrics m = *sum;
    const struct metric metrics[] = {
        {"views", "gauge", "Open views", (double)m.views},
        {"triangles", "gauge", "Triangles in the scene, instances counted", (double)m.triangles},
        {"lights", "gauge", "Lights in the scene", (double)m.lights},
        {"passes_total", "counter", "Rendering passes", (double)m.passes},
        {"last_pass_seconds", "gauge", "Time of the newest pass", m.last_pass_ms * 1e-3},
        {"rays_total", "counter", "Rays traced", (double)m.rays},
        {"frames_published_total", "counter", "Frames given to streams", (double)m.frames_published},
        {"tiles_encoded_total", "counter", "Tiles encoded", (double)m.tiles_encoded},
        {"tile_bytes_total", "counter", "Bytes of encoded tiles", (double)m.tile_bytes},
        {"edits_total", "counter", "Edits accepted", (double)m.edits},
        {"edits_refused_total", "counter", "Edits refused", (double)m.edits_refused},
        {"imports_total", "counter", "Imports read", (double)m.imports},
        {"imports_failed_total", "counter", "Imports failed", (double)m.imports_failed},
        {"nonfinite_total", "counter", "Radiance values that were not finite: 0 unless there is a bug",
         (double)m.nonfinite},
        {"state_read_only", "gauge", "1 while edits are refused because they cannot be saved",
         (double)m.journal.read_only},
        {"state_edits_total", "counter", "Edits that the journal was given", (double)m.journal.n_entries},
        {"state_syncs_total", "counter", "Writes to disk that were waited for", (double)m.journal.n_syncs},
        {"state_snapshots_total", "counter", "Snapshots written", (double)m.journal.n_snapshots},
        {"state_failures_total", "counter", "Writes that failed", (double)m.journal.n_failures},
    };
    print_metrics(out, metrics, LUM_ARRAY_LEN(metrics));
}

static void print_one_scene(FILE *out, const struct lum_projects *projects, const struct lum_projects_metrics *m)
{
    const struct lum_project *p = lum_projects_at(projects, 0);
    const struct metric metrics[] = {
        {"scene_rev", "gauge", "Revision of the scene", (double)lum_director_scene_rev(lum_project_director(p))},
        {"saved_rev", "gauge", "Revision up to which the scene is on disk; 0 without --state",
         (double)m->sum.journal.saved_rev},
    };
    print_metrics(out, metrics, LUM_ARRAY_LEN(metrics));
}

static void print_projects(FILE *out, const struct lum_projects *projects, const struct lum_projects_metrics *m)
{
    const struct metric metrics[] = {
        {"projects", "gauge", "Projects, those in the trash, too", (double)lum_projects_count(projects)},
        {"projects_open", "gauge", "Open projects", (double)m->n_open},
        {"projects_opened_total", "counter", "Times a project was opened", (double)m->opened},
        {"projects_closed_total", "counter", "Times a project was closed", (double)m->closed},
        {"projects_refused_total", "counter", "Times a project was not opened: too many, or no memory",
         (double)m->refused},
    };
    print_metrics(out, metrics, LUM_ARRAY_LEN(metrics));
    fprintf(out, "# HELP lumend_project_scene_rev Revision of its scene\n# TYPE lumend_project_scene_rev gauge\n");
    for (unsigned i = 0; i < LUM_LIMIT_PROJECTS_OPEN; i++) {
        const struct lum_project *p = lum_projects_at(projects, i);
        if (p)
            fprintf(out, "lumend_project_scene_rev{project=\"%s\"} %llu\n", lum_project_info(p)->id,
                    (unsigned long long)lum_director_scene_rev(lum_project_director(p)));
    }
}

static void print_net_metrics(FILE *out, const struct lum_net_counters *c, int64_t started_ns)
{
    const struct metric metrics[] = {
        {"uptime_seconds", "gauge", "Since the start", (double)(lum_clock_ns() - started_ns) * 1e-9},
        {"connections_total", "counter", "TCP connections accepted", (double)c->connections},
        {"connections_refused_total", "counter", "TCP connections over a limit", (double)c->connections_refused},
        {"connections_turned_out_total", "counter", "TCP connections without hello that made room for new ones",
         (double)c->connections_turned_out},
        {"http_requests_total", "counter", "HTTP requests", (double)c->http_requests},
        {"sessions", "gauge", "Open WebSocket sessions", (double)c->sessions_open},
        {"sessions_total", "counter", "WebSocket sessions opened", (double)c->sessions},
        {"sessions_refused_total", "counter", "WebSocket sessions refused: wrong token, no hello, limits",
         (double)c->sessions_refused},
        {"messages_total", "counter", "Text messages received", (double)c->messages},
        {"messages_refused_total", "counter", "Text messages answered with an error here", (double)c->messages_refused},
        {"tiles_sent_total", "counter", "Tiles sent", (double)c->tiles_sent},
        {"frames_acked_total", "counter", "Frame acknowledgements", (double)c->frames_acked},
        {"ws_tx_bytes_total", "counter", "Bytes sent in WebSocket messages", (double)c->tx_bytes},
        {"ws_rx_bytes_total", "counter", "Bytes received in WebSocket messages", (double)c->rx_bytes},
        {"ws_rx_rest_bytes_total", "counter", "Bytes received that were of no message, beyond what is free",
         (double)c->rx_rest},
        {"ws_rx_waits_total", "counter", "Times a session sent too fast and was read later", (double)c->rx_waits},
    };
    const struct metric tls[] = {
        {"tls_certificate_ends_seconds", "gauge", "When its time ends, of the Unix epoch",
         (double)c->certificate_ends_s},
        {"tls_handshakes_total", "counter", "Handshakes begun", (double)c->handshakes},
        {"tls_handshakes_refused_total", "counter", "Handshakes, and connections before one, over a limit",
         (double)c->handshakes_refused},
    };
    print_metrics(out, metrics, LUM_ARRAY_LEN(metrics));
    print_metrics(out, tls, c->certificate_ends_s != 0 ? LUM_ARRAY_LEN(tls) : 0);
    fprintf(out,
            "# HELP lumend_build_info Version\n# TYPE lumend_build_info gauge\nlumend_build_info{version=\"%s\"} 1\n",
            LUMEND_VERSION);
}

void lum_metrics_print(FILE *out, const struct lum_net_counters *counters, const struct lum_projects *projects,
                       int64_t started_ns)
{
    struct lum_projects_metrics m;
    lum_projects_metrics(projects, &m);
    print_net_metrics(out, counters, started_ns);
    print_director_metrics(out, &m.sum);
    (lum_projects_are_many(projects) ? print_projects : print_one_scene)(out, projects, &m);
}
