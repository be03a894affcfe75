# VP9 video for thin lines, by libvpx. Without it they have WebP tiles, as for clients that read no VP9.
# Sets LUM_NOT_VP9 (sources that stay out) and LUM_VP9_LIBRARY.
option(LUMEND_VP9 "Send VP9 over thin lines, where there is libvpx" ON)
if(LUMEND_VP9)
    pkg_check_modules(VPX IMPORTED_TARGET GLOBAL vpx)
endif()
if(LUMEND_VP9 AND VPX_FOUND)
    set(LUM_NOT_VP9 "stream/vp9_none\\.c$")
    set(LUM_VP9_LIBRARY PkgConfig::VPX)
else()
    message(STATUS "lumend without VP9")
    set(LUM_NOT_VP9 "stream/vp9\\.c$")
    set(LUM_VP9_LIBRARY "")
endif()
