/* Ends of messages about names of what is built in: which are near to one that does not exist, or else all there are.
 */
#ifndef LUM_SERVER_BASE_SUGGEST_H
#define LUM_SERVER_BASE_SUGGEST_H

#define LUM_SUGGEST_BYTES 144 /* leaves room for what a message says before */

/* ": did you mean \"path\"?", ": there are a, b, c", or nothing where neither fits. */
void lum_suggest_method(const char *name, char ret_text[LUM_SUGGEST_BYTES]);
void lum_suggest_effect(const char *name, char ret_text[LUM_SUGGEST_BYTES]);
/* Scenes and replays; "(see: lumend scenes)" where none is near. */
void lum_suggest_scene(const char *name, char ret_text[LUM_SUGGEST_BYTES]);

#endif
