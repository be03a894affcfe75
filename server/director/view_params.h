/* What a client may say about a view in view.open and view.update: one row of a field table for each member, as records
 * have them (protocol/record/field.h). A row serves reading, limits, messages, defaults and merging. */
#ifndef LUM_SERVER_DIRECTOR_VIEW_PARAMS_H
#define LUM_SERVER_DIRECTOR_VIEW_PARAMS_H

#include "protocol/record/record.h"

struct lum_json_reader;

/* Rows of lum_view_fields, and bits of lum_view_params.given. */
enum lum_view_param {
    LUM_VIEW_SIZE,
    LUM_VIEW_REST_SIZE,
    LUM_VIEW_CAMERA,
    LUM_VIEW_CAMERA_ID,
    LUM_VIEW_CAMERA_SEQ,
    LUM_VIEW_CODEC,
    LUM_VIEW_QUALITY,
    LUM_VIEW_DOWNSCALE,
    LUM_VIEW_METHOD,
    LUM_VIEW_SPP,
    LUM_VIEW_EXPOSURE_EV,
    LUM_VIEW_TONE_MAP,
    LUM_VIEW_WHITE_BALANCE_K,
    LUM_VIEW_MOMENT,
    LUM_VIEW_OVERLAY,
    LUM_VIEW_FALSE_COLOR,
    LUM_VIEW_BUDGET,
    LUM_VIEW_STATS,
    LUM_VIEW_RESEND,
    LUM_VIEW_PARAM_COUNT
};
#define LUM_VIEW_BIT(param) (1u << LUM_VIEW_##param)
extern const struct lum_fields lum_view_fields;

struct lum_view_budget {
    struct lum_opt time_ms, error; /* both unset: none */
};

struct lum_view_false_color {
    char scale[8], palette[12], lines[8]; /* words */
    struct lum_opt min, max;              /* of the map's unit; null: as the picture has it */
    bool smooth;
};

struct lum_view_params {
    uint32_t given;      /* LUM_VIEW_BIT of what the client named */
    double size[2];      /* pixels */
    double rest_size[2]; /* once nothing moves; not larger than size: as that */
    struct lum_record_camera camera;
    lum_id camera_id;
    uint32_t camera_seq;
    char codec[16];
    uint32_t quality;
    uint32_t downscale; /* log2 */
    char method[16];    /* "": the scene's */
    uint32_t spp;
    struct lum_opt exposure_ev; /* null: automatic */
    char tone_map[12];
    struct lum_opt white_balance_k; /* light of this temperature is shown as white; null: none */
    struct lum_opt moment;          /* revision of the scene; null: now */
    char overlay[32];
    struct lum_view_false_color false_color; /* of the overlays luminance and illuminance */
    struct lum_view_budget budget;
    bool stats;  /* wants frame.stats */
    bool resend; /* of this message alone: all tiles go out anew */
    /* By name, not by row: lamps, and groups of them, that alone shine. */
    bool solo_given;
    uint32_t n_solo; /* 0: all that are on */
    lum_id solo[LUM_LIMIT_SOLO];
    bool codecs_given;
    uint32_t codecs; /* by name, not by row; bits 1 << enum lum_codec: what the client reads, beside codec and PNG */
    /* By effect, not by row; bits LUM_EFFECT_BIT: what something is said of, and of that what to force. The rest is
     * "auto". */
    uint32_t effects_named, effects_off, effects_on;
};

/* What a view has whose client says nothing. Nothing is given. */
struct lum_view_params lum_view_params_default(void);
/* Takes the members out of the reader's object; lum_json_end is the caller's. False: the reader has failed. */
bool lum_view_params_read(struct lum_json_reader *r, struct lum_view_params *ret_params);
/* Takes over what `more` gives. */
void lum_view_params_merge(struct lum_view_params *params, const struct lum_view_params *more);

#endif
