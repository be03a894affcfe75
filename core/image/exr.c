#include "core/image/exr.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include <OpenEXR/OpenEXRConfig.h>
#include <OpenEXR/openexr.h>

#define HALF_MAX 65504.0f /* the largest finite half float */
#define CHANNELS_MAX 1024 /* of a file that is read: 64 light groups times a few AOVs fit many times over */

/* OpenEXRCore reports through a callback on the calling thread, with the context's user data only for streams; the text
 * goes by a thread-local pointer that is set for the length of one call into this file. */
static _Thread_local char *message_sink;
#define MESSAGE_MAX 160 /* what is longer is cut: it ends up in a line of text with the file's name */

static void keep_message(exr_const_context_t ctx, exr_result_t code, const char *text)
{
    (void)ctx;
    (void)code;
    if (message_sink && !message_sink[0])
        snprintf(message_sink, MESSAGE_MAX, "%s", text);
}

static exr_context_initializer_t quiet_initializer(char message[MESSAGE_MAX])
{
    message[0] = 0;
    message_sink = message;
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = keep_message;
    return init;
}

static enum lum_status exr_fail(struct lum_error *err, const char *verb, const char *path, exr_result_t r,
                                const char *message)
{
    enum lum_status status = r == EXR_ERR_OUT_OF_MEMORY             ? LUM_ERR_NOMEM
                             : r == EXR_ERR_FEATURE_NOT_IMPLEMENTED ? LUM_ERR_UNSUPPORTED /* DWAA, DWAB */
                                                                    : LUM_ERR_IO;
    return lum_fail(err, status, "path", "cannot %s %s: %s", verb, path,
                    message[0] ? message : exr_get_default_error_message(r));
}

/* ---- writing ---- */

static exr_result_t write_header(exr_context_t ctx, uint32_t w, uint32_t h, const struct lum_exr_channel *channels,
                                 uint32_t n_channels)
{
    int part = 0;
    exr_result_t r = exr_add_part(ctx, NULL, EXR_STORAGE_SCANLINE, &part);
    if (r == EXR_ERR_SUCCESS)
        r = exr_initialize_required_attr_simple(ctx, part, (int32_t)w, (int32_t)h, EXR_COMPRESSION_ZIP);
    for (uint32_t i = 0; i < n_channels && r == EXR_ERR_SUCCESS; i++)
        r = exr_add_channel(ctx, part, channels[i].name, channels[i].half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT,
                            EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    /* Rec.709 primaries and D65; Y = 1 stands for 1 cd/m2: the picture is absolute. */
    static const exr_attr_chromaticities_t rec709 = {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f};
    if (r == EXR_ERR_SUCCESS)
        r = exr_attr_set_chromaticities(ctx, part, "chromaticities", &rec709);
    if (r == EXR_ERR_SUCCESS)
        r = exr_attr_set_float(ctx, part, "whiteLuminance", 1.0f);
    return r;
}

/* Copies the rows of one channel that make a chunk; half channels saturate instead of becoming infinite. */
static void stage_rows(const struct lum_exr_channel *c, size_t first, size_t n, float *ret_rows)
{
    for (size_t i = 0; i < n; i++) {
        float v = c->pixels[(first + i) * c->stride];
        ret_rows[i] = c->half && fabsf(v) > HALF_MAX ? copysignf(HALF_MAX, v) : v;
    }
}

static const struct lum_exr_channel *channel_by_name(const struct lum_exr_channel *channels, uint32_t n,
                                                     const char *name)
{
    for (uint32_t i = 0; i < n; i++)
        if (strcmp(channels[i].name, name) == 0)
            return &channels[i];
    return NULL;
}

struct exr_rows {
    uint32_t w, h;
    const struct lum_exr_channel *channels;
    uint32_t n_channels;
    int32_t per_chunk;
    float *staging; /* n_channels * per_chunk * w */
};

static exr_result_t write_chunk(exr_context_t ctx, exr_encode_pipeline_t *pipe, const struct exr_rows *rows, uint32_t y)
{
    exr_chunk_info_t info;
    exr_result_t r = exr_write_scanline_chunk_info(ctx, 0, (int)y, &info);
    if (r != EXR_ERR_SUCCESS)
        return r;
    r = y == 0 ? exr_encoding_initialize(ctx, 0, &info, pipe) : exr_encoding_update(ctx, 0, &info, pipe);
    uint32_t n_rows = rows->h - y < (uint32_t)rows->per_chunk ? rows->h - y : (uint32_t)rows->per_chunk;
    size_t plane = (size_t)rows->per_chunk * rows->w;
    for (int16_t i = 0; i < pipe->channel_count && r == EXR_ERR_SUCCESS; i++) {
        exr_coding_channel_info_t *c = &pipe->channels[i];
        float *to = rows->staging + (size_t)i * plane;
        stage_rows(channel_by_name(rows->channels, rows->n_channels, c->channel_name), (size_t)y * rows->w,
                   (size_t)n_rows * rows->w, to);
        c->user_data_type = EXR_PIXEL_FLOAT;
        c->user_bytes_per_element = sizeof(float);
        c->user_pixel_stride = sizeof(float);
        c->user_line_stride = (int32_t)(rows->w * sizeof(float));
        c->encode_from_ptr = (const uint8_t *)to;
    }
    if (r == EXR_ERR_SUCCESS && y == 0)
        r = exr_encoding_choose_default_routines(ctx, 0, pipe);
    if (r == EXR_ERR_SUCCESS)
        r = exr_encoding_run(ctx, 0, pipe);
    return r;
}

static exr_result_t write_pixels(exr_context_t ctx, struct exr_rows *rows)
{
    exr_result_t r = exr_get_scanlines_per_chunk(ctx, 0, &rows->per_chunk);
    if (r != EXR_ERR_SUCCESS)
        return r;
    rows->staging = lum_calloc((size_t)rows->n_channels * (size_t)rows->per_chunk, rows->w * sizeof(float));
    if (!rows->staging)
        return EXR_ERR_OUT_OF_MEMORY;
    exr_encode_pipeline_t pipe = EXR_ENCODE_PIPELINE_INITIALIZER;
    for (uint32_t y = 0; y < rows->h && r == EXR_ERR_SUCCESS; y += (uint32_t)rows->per_chunk)
        r = write_chunk(ctx, &pipe, rows, y);
    exr_encoding_destroy(ctx, &pipe);
    lum_free(rows->staging);
    return r;
}

static enum lum_status check_request(uint32_t w, uint32_t h, const struct lum_exr_channel *channels,
                                     uint32_t n_channels, struct lum_error *err)
{
    if (w < 1 || h < 1 || w > INT32_MAX / sizeof(float) || h > INT32_MAX || n_channels < 1)
        return lum_fail(err, LUM_ERR_INVALID, "size", "an EXR needs pixels and channels, not %u x %u x %u", w, h,
                        n_channels);
    for (uint32_t i = 0; i < n_channels; i++)
        if (channel_by_name(channels, n_channels, channels[i].name) != &channels[i])
            return lum_fail(err, LUM_ERR_CONFLICT, "channels", "two channels are named %s", channels[i].name);
    return LUM_OK;
}

enum lum_status lum_exr_write(const char *path, uint32_t w, uint32_t h, const struct lum_exr_channel *channels,
                              uint32_t n_channels, const struct lum_exr_attribute *attributes, uint32_t n_attributes,
                              struct lum_error *err)
{
    enum lum_status status = check_request(w, h, channels, n_channels, err);
    if (status != LUM_OK)
        return status;
    char message[MESSAGE_MAX];
    exr_context_initializer_t init = quiet_initializer(message);
    exr_context_t ctx = NULL;
    /* Through a temporary file: a file that was there before stays whole when writing fails half way. */
    exr_result_t r = exr_start_write(&ctx, path, EXR_INTERMEDIATE_TEMP_FILE, &init);
    if (r == EXR_ERR_SUCCESS) {
        r = write_header(ctx, w, h, channels, n_channels);
        for (uint32_t i = 0; i < n_attributes && r == EXR_ERR_SUCCESS; i++)
            r = exr_attr_set_string(ctx, 0, attributes[i].name, attributes[i].text);
        if (r == EXR_ERR_SUCCESS)
            r = exr_write_header(ctx);
        struct exr_rows rows = {.w = w, .h = h, .channels = channels, .n_channels = n_channels};
        if (r == EXR_ERR_SUCCESS)
            r = write_pixels(ctx, &rows);
        exr_result_t closed = exr_finish(&ctx);
        if (r == EXR_ERR_SUCCESS)
            r = closed;
    }
    if (r != EXR_ERR_SUCCESS)
        status = exr_fail(err, "write", path, r, message);
    message_sink = NULL;
    return status;
}

/* ---- reading ---- */

static enum lum_status check_kind(exr_context_t ctx, const char *path, struct lum_error *err)
{
    int parts = 0;
    exr_storage_t storage = EXR_STORAGE_LAST_TYPE;
    if (exr_get_count(ctx, &parts) != EXR_ERR_SUCCESS || parts != 1)
        return lum_fail(err, LUM_ERR_UNSUPPORTED, "path", "%s has %d parts; only single-part files are read", path,
                        parts);
    if (exr_get_storage(ctx, 0, &storage) != EXR_ERR_SUCCESS || storage != EXR_STORAGE_SCANLINE)
        return lum_fail(err, LUM_ERR_UNSUPPORTED, "path", "%s is tiled or deep; only scanline files are read", path);
    return LUM_OK;
}

/* Fills w, h, names and allocates the pixels, after all refusals. */
static enum lum_status read_layout(exr_context_t ctx, const char *path, const uint32_t max_size[2],
                                   struct lum_exr_image *image, struct lum_error *err)
{
    exr_attr_box2i_t box;
    const exr_attr_chlist_t *list = NULL;
    if (exr_get_data_window(ctx, 0, &box) != EXR_ERR_SUCCESS || exr_get_channels(ctx, 0, &list) != EXR_ERR_SUCCESS)
        return lum_fail(err, LUM_ERR_IO, "path", "%s has no data window or channels", path);
    int64_t w = (int64_t)box.max.x - box.min.x + 1, h = (int64_t)box.max.y - box.min.y + 1;
    if (w < 1 || h < 1 || w > max_size[0] || h > max_size[1])
        return lum_fail(err, LUM_ERR_LIMIT, "path", "%s is %lld x %lld pixels; the limit is %u x %u", path,
                        (long long)w, (long long)h, max_size[0], max_size[1]);
    if (list->num_channels < 1 || list->num_channels > CHANNELS_MAX)
        return lum_fail(err, LUM_ERR_LIMIT, "path", "%s has %d channels; 1 to %d are read", path, list->num_channels,
                        CHANNELS_MAX);
    uint32_t n = (uint32_t)list->num_channels;
    for (uint32_t i = 0; i < n; i++) {
        const exr_attr_chlist_entry_t *c = &list->entries[i];
        if (c->x_sampling != 1 || c->y_sampling != 1)
            return lum_fail(err, LUM_ERR_UNSUPPORTED, "path", "%s: channel %.64s is subsampled", path, c->name.str);
        if (c->name.length >= (int32_t)sizeof image->names[0])
            return lum_fail(err, LUM_ERR_LIMIT, "path", "%s: a channel name is longer than 63 bytes", path);
    }
    image->names = lum_calloc(n, sizeof image->names[0]);
    image->pixels = lum_calloc((size_t)w * (size_t)h, n * sizeof(float));
    if (!image->names || !image->pixels)
        return lum_fail(err, LUM_ERR_NOMEM, "path", "out of memory for %s", path);
    for (uint32_t i = 0; i < n; i++)
        memcpy(image->names[i], list->entries[i].name.str, (size_t)list->entries[i].name.length);
    image->w = (uint32_t)w;
    image->h = (uint32_t)h;
    image->n_channels = n;
    return LUM_OK;
}

static exr_result_t read_chunk(exr_context_t ctx, exr_decode_pipeline_t *pipe, int32_t min_y, uint32_t y,
                               const struct lum_exr_image *image)
{
    exr_chunk_info_t info;
    exr_result_t r = exr_read_scanline_chunk_info(ctx, 0, (int)((int64_t)min_y + y), &info);
    if (r != EXR_ERR_SUCCESS)
        return r;
    r = y == 0 ? exr_decoding_initialize(ctx, 0, &info, pipe) : exr_decoding_update(ctx, 0, &info, pipe);
    for (int16_t i = 0; i < pipe->channel_count && r == EXR_ERR_SUCCESS; i++) {
        exr_coding_channel_info_t *c = &pipe->channels[i];
        c->user_data_type = EXR_PIXEL_FLOAT;
        c->user_bytes_per_element = sizeof(float);
        c->user_pixel_stride = sizeof(float);
        c->user_line_stride = (int32_t)(image->w * sizeof(float));
        c->decode_to_ptr = (uint8_t *)(image->pixels + ((size_t)i * image->h + y) * image->w);
    }
    if (r == EXR_ERR_SUCCESS && y == 0)
        r = exr_decoding_choose_default_routines(ctx, 0, pipe);
    if (r == EXR_ERR_SUCCESS)
        r = exr_decoding_run(ctx, 0, pipe);
    return r;
}

static exr_result_t read_pixels(exr_context_t ctx, const struct lum_exr_image *image)
{
    int32_t per_chunk = 0;
    exr_attr_box2i_t box;
    exr_result_t r = exr_get_scanlines_per_chunk(ctx, 0, &per_chunk);
    if (r == EXR_ERR_SUCCESS)
        r = exr_get_data_window(ctx, 0, &box);
    if (r != EXR_ERR_SUCCESS)
        return r;
    if (per_chunk < 1)
        return EXR_ERR_FILE_BAD_HEADER;
    exr_decode_pipeline_t pipe = EXR_DECODE_PIPELINE_INITIALIZER;
    for (uint32_t y = 0; y < image->h && r == EXR_ERR_SUCCESS; y += (uint32_t)per_chunk)
        r = read_chunk(ctx, &pipe, box.min.y, y, image);
    exr_decoding_destroy(ctx, &pipe);
    return r;
}

/* name: the file's path, or what to call it in messages when init reads it from elsewhere. */
static enum lum_status read_image(exr_context_initializer_t *init, const char *message, const char *name,
                                  const uint32_t max_size[2], struct lum_exr_image *ret_image, struct lum_error *err)
{
    exr_context_t ctx = NULL;
    struct lum_exr_image image = {0};
    enum lum_status status;
    exr_result_t r = exr_start_read(&ctx, name, init);
    if (r != EXR_ERR_SUCCESS) {
        status = exr_fail(err, "read", name, r, message);
        goto out;
    }
    status = check_kind(ctx, name, err);
    if (status == LUM_OK)
        status = read_layout(ctx, name, max_size, &image, err);
    if (status == LUM_OK) {
        r = read_pixels(ctx, &image);
        if (r != EXR_ERR_SUCCESS)
            status = exr_fail(err, "read", name, r, message);
    }
    exr_finish(&ctx);
out:
    message_sink = NULL;
    if (status == LUM_OK)
        *ret_image = image;
    else
        lum_exr_finish(&image);
    return status;
}

enum lum_status lum_exr_read(const char *path, uint32_t max_w, uint32_t max_h, struct lum_exr_image *ret_image,
                             struct lum_error *err)
{
    char message[MESSAGE_MAX];
    exr_context_initializer_t init = quiet_initializer(message);
    return read_image(&init, message, path, (const uint32_t[2]){max_w, max_h}, ret_image, err);
}

struct memory_file {
    const uint8_t *bytes;
    size_t n;
};

static int64_t read_memory(exr_const_context_t ctx, void *user, void *buffer, uint64_t n, uint64_t offset,
                           exr_stream_error_func_ptr_t report)
{
    const struct memory_file *file = user;
    (void)ctx;
    (void)report;
    if (offset >= file->n)
        return 0;
    uint64_t left = file->n - offset;
    n = n < left ? n : left;
    memcpy(buffer, file->bytes + offset, n);
    return (int64_t)n;
}

static int64_t memory_size(exr_const_context_t ctx, void *user)
{
    (void)ctx;
    return (int64_t)((const struct memory_file *)user)->n;
}

enum lum_status lum_exr_read_memory(const void *bytes, size_t n_bytes, const uint32_t max_size[2],
                                    struct lum_exr_image *ret_image, struct lum_error *err)
{
    char message[MESSAGE_MAX];
    struct memory_file file = {bytes, n_bytes};
    exr_context_initializer_t init = quiet_initializer(message);
    init.user_data = &file;
    init.read_fn = read_memory;
    init.size_fn = memory_size;
    return read_image(&init, message, "the picture", max_size, ret_image, err);
}

void lum_exr_finish(struct lum_exr_image *image)
{
    lum_free(image->names);
    lum_free(image->pixels);
    *image = (struct lum_exr_image){0};
}

const char *lum_exr_library(void)
{
    return "OpenEXR " OPENEXR_VERSION_STRING;
}
