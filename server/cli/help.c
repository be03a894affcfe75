#include "server/cli/help.h"

#include <ctype.h>
#include <string.h>

#define HELP_INDENT 27 /* where texts begin: most options are shorter */
#define USAGE_INDENT 7 /* "usage: " */
#define TAG_INDENT_MAX 4
#define TEXT_INDENT_MIN 8

/* ---- for man(1) ---- */

static void put_word(FILE *out, char c)
{
    if (c == '\\')
        fputs("\\e", out);
    else if (c == '-') /* else a hyphen, which nobody can paste */
        fputs("\\-", out);
    else
        fputc(c, out);
}

/* What begins with a point or an apostrophe would be a request. */
static void put_roff(FILE *out, const char *text, size_t n)
{
    if (n > 0 && (text[0] == '.' || text[0] == '\''))
        fputs("\\&", out);
    for (size_t i = 0; i < n; i++)
        put_word(out, text[i]);
}

static void put_tag(FILE *out, const char *name, size_t n_name, const char *arg)
{
    fputs(".TP\n\\fB", out);
    put_roff(out, name, n_name);
    fputs("\\fR", out);
    if (arg) {
        fputs(" \\fI", out);
        put_roff(out, arg, strlen(arg));
        fputs("\\fR", out);
    }
    fputc('\n', out);
}

enum block { NO_BLOCK, USAGE, TAGS, EXAMPLE, PARAGRAPH };

/* How long the tag of such a line is; 0: it has none. */
static size_t tag_length(const char *line, size_t n)
{
    for (size_t i = 1; i + 2 < n; i++)
        if (line[i] == ' ' && line[i + 1] == ' ')
            return i;
    return 0;
}

static void open_block(FILE *out, enum block *at, enum block to)
{
    if (*at == EXAMPLE && to != EXAMPLE)
        fputs(".fi\n.RE\n", out);
    if (to == EXAMPLE && *at != EXAMPLE)
        fputs(".RS 2\n.nf\n", out);
    if (to == PARAGRAPH && *at != PARAGRAPH)
        fputs(".PP\n", out);
    *at = to;
}

static void put_usage(FILE *out, enum block *at, const char *line, size_t n)
{
    fputs(*at == USAGE ? ".br\n.B " : ".PP\n.B ", out);
    open_block(out, at, USAGE);
    put_roff(out, line, n);
    fputc('\n', out);
}

static void put_line(FILE *out, enum block *at, const char *line, size_t n)
{
    size_t indent = strspn(line, " "), n_tag;
    if (n == 0) {
        open_block(out, at, NO_BLOCK);
        return;
    }
    bool usage = strncmp(line, "usage: ", USAGE_INDENT) == 0;
    if (usage || (*at == USAGE && indent == USAGE_INDENT)) {
        put_usage(out, at, line + USAGE_INDENT, n - USAGE_INDENT);
        return;
    }
    line += indent;
    n -= indent;
    n_tag = indent <= TAG_INDENT_MAX ? tag_length(line, n) : 0;
    if (n_tag) {
        open_block(out, at, TAGS);
        put_tag(out, line, n_tag, NULL);
        line += n_tag;
        n -= n_tag;
        indent = strspn(line, " ");
        line += indent;
        n -= indent;
    } else if (*at != TAGS || indent < TEXT_INDENT_MIN) {
        open_block(out, at, indent > 0 ? EXAMPLE : PARAGRAPH);
    }
    put_roff(out, line, n);
    fputc('\n', out);
}

static void text_for_man(FILE *out, const char *text)
{
    enum block at = NO_BLOCK;
    while (*text) {
        size_t n = strcspn(text, "\n");
        put_line(out, &at, text, n);
        text += n + (text[n] == '\n');
    }
    open_block(out, &at, NO_BLOCK);
}

static void option_for_man(FILE *out, const struct lum_option_row *row)
{
    char name[64];
    snprintf(name, sizeof name, "--%s", row->name);
    put_tag(out, name, strlen(name), row->arg);
    for (const char *line = row->help;; line++) {
        size_t n = strcspn(line, "\n");
        put_roff(out, line, n);
        fputc('\n', out);
        line += n;
        if (!*line)
            break;
    }
    if (row->arg && row->fallback && *row->fallback) {
        fputc('[', out);
        put_roff(out, row->fallback, strlen(row->fallback));
        fputs("]\n", out);
    }
}

/* ---- for a terminal ---- */

static void print_option(FILE *out, const struct lum_option_row *row)
{
    char left[64];
    snprintf(left, sizeof left, "--%s%s%s", row->name, row->arg ? " " : "", row->arg ? row->arg : "");
    fprintf(out, "  %-*s ", HELP_INDENT - 3, left);
    for (const char *line = row->help;; line++) {
        size_t n = strcspn(line, "\n");
        fprintf(out, "%.*s", (int)n, line);
        line += n;
        if (!*line)
            break;
        fprintf(out, "\n%*s", HELP_INDENT, "");
    }
    if (row->arg && row->fallback && *row->fallback)
        fprintf(out, " [%s]", row->fallback);
    fputc('\n', out);
}

/* ---- both ---- */

void lum_help_text(const struct lum_help *h, const char *text)
{
    if (h->man)
        text_for_man(h->out, text);
    else
        fputs(text, h->out);
}

void lum_help_options(const struct lum_help *h, const struct lum_option_row *rows, size_t n_rows)
{
    for (size_t i = 0; i < n_rows; i++)
        (h->man ? option_for_man : print_option)(h->out, &rows[i]);
}

/* ---- the page ---- */

static const char after[] = ".SH SIGNALS\n"
                            ".TP\n"
                            ".BR SIGTERM \", \" SIGINT\n"
                            "Clients are told and closed with code 1012 (restart), edits that wait are written, and "
                            "lumend ends with 0. A client\n"
                            "that does not read is cut off after 5 seconds. A second signal ends it at once; no "
                            "acknowledged edit is lost then\n"
                            "either.\n"
                            ".TP\n"
                            ".B SIGHUP\n"
                            "With \\fB\\-\\-tokens\\fR or \\fB\\-\\-tls\\-cert\\fR their files are read again; "
                            "what is wrong changes nothing, and the log says\n"
                            "so. Without either it ends lumend.\n"
                            ".SH FILES\n"
                            "What \\fB\\-\\-state\\fR keeps is described by \\fBlumend state \\-\\-help\\fR.\n"
                            ".SH EXIT STATUS\n"
                            ".TP\n"
                            "0\n"
                            "Done.\n"
                            ".TP\n"
                            "1\n"
                            "Failed, or what was asked for is not so; one line on standard error says why.\n"
                            ".TP\n"
                            "2\n"
                            "The command line, or a variable of the environment, is wrong.\n";

void lum_help_man_of(FILE *out, const char *name, const char *summary, const char *help)
{
    fputs(".TH ", out);
    for (const char *c = name; *c; c++)
        fputc(toupper((unsigned char)*c), out);
    fprintf(out, " 1 \"\" \"lumend %s\" \"User Commands\"\n.nh\n.ad l\n.SH NAME\n", LUMEND_VERSION);
    put_roff(out, name, strlen(name));
    fprintf(out, " \\- %s\n.SH DESCRIPTION\n", summary);
    text_for_man(out, help);
    fputs(".SH SEE ALSO\n.BR lumend (1)\n", out);
}

void lum_help_man(FILE *out, const struct lum_command *commands, size_t n_commands)
{
    const struct lum_help h = {out, .man = true};
    fprintf(out,
            ".TH LUMEND 1 \"\" \"lumend %s\" \"User Commands\"\n"
            ".nh\n.ad l\n"
            ".SH NAME\nlumend \\- render server: edit one 3D scene together and watch it with global illumination\n",
            LUMEND_VERSION);
    for (size_t i = 0; i < n_commands; i++) {
        if (i == 0)
            fputs(".SH DESCRIPTION\n", out);
        else
            fprintf(out, ".SH COMMAND %s\n", commands[i].name);
        commands[i].help(&h);
    }
    fputs(after, out);
}
