# TLS by libwebsockets, where its own is OpenSSL's (as in Debian). Without it --tls-cert is refused, and says so.
# Sets LUM_NOT_TLS (sources that stay out) and LUM_TLS_LIBRARY.
option(LUMEND_TLS "Speak https and wss where libwebsockets can" ON)
if(LUMEND_TLS)
    include(CheckCSourceCompiles)
    set(CMAKE_REQUIRED_LIBRARIES PkgConfig::LWS)
    check_c_source_compiles("
        #include <libwebsockets.h>
        #if !defined(LWS_WITH_TLS) || defined(LWS_WITH_MBEDTLS) || defined(USE_WOLFSSL) || defined(LWS_WITH_BORINGSSL)
        #error
        #endif
        int main(void) { return 0; }" LUM_LWS_HAS_TLS)
    unset(CMAKE_REQUIRED_LIBRARIES)
endif()
if(LUMEND_TLS AND LUM_LWS_HAS_TLS)
    pkg_check_modules(SSL REQUIRED IMPORTED_TARGET GLOBAL libssl)
    set(LUM_NOT_TLS "net/tls_none\\.c$")
    set(LUM_TLS_LIBRARY PkgConfig::SSL)
else()
    message(STATUS "lumend without TLS of its own")
    set(LUM_NOT_TLS "net/tls(_pair|_ask)?\\.c$")
    set(LUM_TLS_LIBRARY "")
endif()
