#include "core/accel/embree.h"

#include <stdio.h>
#include <string.h>

static void on_error(void *user, enum RTCError code, const char *text)
{
    struct lum_device *device = user;
    (void)code;
    pthread_mutex_lock(&device->lock);
    snprintf(device->message, sizeof device->message, "%s", text ? text : "");
    pthread_mutex_unlock(&device->lock);
}

enum lum_status lum_device_check(struct lum_device *device, const char *what, struct lum_error *err)
{
    enum RTCError code = rtcGetDeviceError(device->rtc);
    if (code == RTC_ERROR_NONE)
        return LUM_OK;
    char message[sizeof device->message];
    pthread_mutex_lock(&device->lock);
    memcpy(message, device->message, sizeof message);
    pthread_mutex_unlock(&device->lock);
    enum lum_status status = code == RTC_ERROR_OUT_OF_MEMORY ? LUM_ERR_NOMEM : LUM_ERR_INTERNAL;
    return lum_fail(err, status, "", "%s: ray tracing library: %s", what, message);
}

/* Embree tells packet widths, not the name: 16 wide is AVX512, 8 wide AVX or AVX2, 4 wide SSE. */
static const char *isa_name(RTCDevice rtc, const char *requested)
{
    if (requested)
        return requested;
    if (rtcGetDeviceProperty(rtc, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED))
        return "avx512";
    if (rtcGetDeviceProperty(rtc, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED))
        return "avx2";
    return "sse";
}

static bool isa_known(const char *isa)
{
    static const char *const names[] = {"sse2", "sse4.2", "avx", "avx2", "avx512"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(names); i++)
        if (strcmp(isa, names[i]) == 0)
            return true;
    return false;
}

enum lum_status lum_device_create(uint32_t n_threads, const char *isa, struct lum_device **ret_device,
                                  struct lum_error *err)
{
    if (isa && !isa_known(isa))
        return lum_fail(err, LUM_ERR_INVALID, "isa", "must be one of sse2, sse4.2, avx, avx2, avx512");
    char config[64];
    snprintf(config, sizeof config, "threads=%u%s%s", n_threads, isa ? ",isa=" : "", isa ? isa : "");
    struct lum_device *device = lum_calloc(1, sizeof *device);
    if (!device)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the ray tracing device");
    device->rtc = rtcNewDevice(config);
    if (!device->rtc) {
        lum_free(device);
        return lum_fail(err, LUM_ERR_UNSUPPORTED, "isa", "the ray tracing library refused \"%s\" (error %d)", config,
                        (int)rtcGetDeviceError(NULL));
    }
    pthread_mutex_init(&device->lock, NULL);
    rtcSetDeviceErrorFunction(device->rtc, on_error, device);
    if (!lum_unit_shapes_create(device)) {
        lum_device_destroy(device);
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the ray tracing device");
    }
    snprintf(device->isa, sizeof device->isa, "%s", isa_name(device->rtc, isa));
    long v = (long)rtcGetDeviceProperty(device->rtc, RTC_DEVICE_PROPERTY_VERSION);
    snprintf(device->version, sizeof device->version, "Embree %ld.%ld.%ld", v / 10000, v / 100 % 100, v % 100);
    *ret_device = device;
    return LUM_OK;
}

void lum_device_destroy(struct lum_device *device)
{
    if (!device)
        return;
    lum_unit_shapes_destroy(device);
    rtcReleaseDevice(device->rtc);
    pthread_mutex_destroy(&device->lock);
    lum_free(device);
}

const char *lum_device_isa(const struct lum_device *device)
{
    return device->isa;
}

void lum_device_trace_singly(struct lum_device *device, bool singly)
{
    device->singly = singly;
}

bool lum_device_traces_singly(const struct lum_device *device)
{
    return device->singly;
}

const char *lum_accel_library(void)
{
    return "Embree " RTC_VERSION_STRING;
}

const char *lum_device_version(const struct lum_device *device)
{
    return device->version;
}
