/* lumend-import --to-jsonl FILE: imports as the daemon does, sandbox included, and prints a .jsonl scene. */
#ifndef LUM_SERVER_IMPORTER_TO_JSONL_H
#define LUM_SERVER_IMPORTER_TO_JSONL_H

/* Exit status of the program. */
int lum_to_jsonl(const char *path);

#endif
