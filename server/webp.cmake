# WebP tiles for thin lines, by libwebp. Without it views are JPEG, as they are for clients that read no WebP.
# Sets LUM_NOT_WEBP (sources that stay out) and LUM_WEBP_LIBRARY.
option(LUMEND_WEBP "Send WebP over thin lines, where there is libwebp" ON)
if(LUMEND_WEBP)
    pkg_check_modules(WEBP IMPORTED_TARGET GLOBAL libwebp)
endif()
if(LUMEND_WEBP AND WEBP_FOUND)
    set(LUM_NOT_WEBP "stream/webp_none\\.c$")
    set(LUM_WEBP_LIBRARY PkgConfig::WEBP)
else()
    message(STATUS "lumend without WebP")
    set(LUM_NOT_WEBP "stream/webp\\.c$")
    set(LUM_WEBP_LIBRARY "")
endif()
