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

/* Narrowest first. */
enum isa { ISA_SSE2, ISA_SSE42, ISA_AVX, ISA_AVX2, ISA_AVX512, ISA_COUNT };
static const char *const isa_names[ISA_COUNT] = {"sse2", "sse4.2", "avx", "avx2", "avx512"};

/* Does this processor have all that Embree's kernels of that name use? Embree itself would take our word for it. */
static bool isa_present(enum isa isa)
{
    switch (isa) {
    case ISA_AVX512:
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512bw") &&
               __builtin_cpu_supports("avx512vl");
    case ISA_AVX2:
        return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
               __builtin_cpu_supports("bmi2");
    case ISA_AVX:
        return __builtin_cpu_supports("avx");
    case ISA_SSE42:
        return __builtin_cpu_supports("sse4.2");
    default:
        return true;
    }
}

enum lum_status lum_isa_check(const char *what, const char *isa, struct lum_error *err)
{
    int i = 0;
    while (i < ISA_COUNT && strcmp(isa, isa_names[i]) != 0)
        i++;
    if (i == ISA_COUNT)
        return lum_fail(err, LUM_ERR_INVALID, "isa", "%s must be one of sse2, sse4.2, avx, avx2, avx512, not '%.40s'",
                        what, isa);
    if (!isa_present((enum isa)i))
        return lum_fail(err, LUM_ERR_UNSUPPORTED, "isa", "%s is refused: this processor has no %s", what, isa);
    return LUM_OK;
}

/* What Embree takes when none is named. It tells packet widths, not the name, and may be built without the widest. */
static const char *isa_chosen(RTCDevice rtc)
{
    enum isa widest = rtcGetDeviceProperty(rtc, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)  ? ISA_AVX512
                      : rtcGetDeviceProperty(rtc, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? ISA_AVX2
                                                                                             : ISA_SSE42;
    while (!isa_present(widest))
        widest--;
    return isa_names[widest];
}

enum lum_status lum_device_create(uint32_t n_threads, const char *isa, struct lum_device **ret_device,
                                  struct lum_error *err)
{
    enum lum_status status = isa ? lum_isa_check("the instruction set", isa, err) : LUM_OK;
    if (status)
        return status;
    /* On processors that slow down for wide vectors Embree traces single rays, and not packets, with kernels of SSE:
     * with a named set both are of that set, on every processor. user_threads: who joins a build (mesh.c) has all its
     * places for callers, and so none of Embree's threads in it. */
    char config[96];
    snprintf(config, sizeof config, "threads=%u,user_threads=%u%s%s", n_threads, n_threads,
             isa ? ",frequency_level=simd256,isa=" : "", isa ? isa : "");
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
    snprintf(device->isa, sizeof device->isa, "%s", isa ? isa : isa_chosen(device->rtc));
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
