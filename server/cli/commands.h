/* The subcommands of lumend. Each parses its own arguments (argv[0] is the subcommand's name) and returns the exit
 * status. A result goes to stdout, a failure is one line on stderr that says what and where. */
#ifndef LUM_SERVER_CLI_COMMANDS_H
#define LUM_SERVER_CLI_COMMANDS_H

struct lum_help;

enum lum_exit {
    LUM_EXIT_OK = 0,
    LUM_EXIT_FAILED = 1,
    LUM_EXIT_USAGE = 2,
    LUM_EXIT_MISSED = 3 /* all was done, and a picture is not within its --error */
};

struct lum_command {
    const char *name;
    int (*run)(int argc, char **argv);
    void (*help)(const struct lum_help *h); /* all that --help says */
};

int lum_cmd_render(int argc, char **argv);     /* an image or a sequence, without network */
int lum_cmd_compare(int argc, char **argv);    /* metrics of two images */
int lum_cmd_measure(int argc, char **argv);    /* illuminance on a grid */
int lum_cmd_export(int argc, char **argv);     /* the scene as a glTF file */
int lum_cmd_scenes(int argc, char **argv);     /* lists the built-in scenes and replays, or prints one */
int lum_cmd_state(int argc, char **argv);      /* check, export or compact what --state kept */
int lum_cmd_token(int argc, char **argv);      /* makes somebody's token, and its line for --tokens */
int lum_cmd_methods(int argc, char **argv);    /* lists the rendering methods */
int lum_cmd_photometry(int argc, char **argv); /* what IES and EULUMDAT files say */

void lum_help_render(const struct lum_help *h);
void lum_help_compare(const struct lum_help *h);
void lum_help_measure(const struct lum_help *h);
void lum_help_export(const struct lum_help *h);
void lum_help_scenes(const struct lum_help *h);
void lum_help_state(const struct lum_help *h);
void lum_help_token(const struct lum_help *h);
void lum_help_methods(const struct lum_help *h);
void lum_help_photometry(const struct lum_help *h);

#endif
