# The browser client, compiled into the daemon as embedded_web.c and .s: built by npm from clients/web, or, without npm or with
# LUMEND_WEB=OFF, one page that says how to build it.
find_program(NPM npm)
set(web_dir ${PROJECT_SOURCE_DIR}/clients/web)
if(NPM)
    set(web_default ON)
else()
    set(web_default OFF)
endif()
option(LUMEND_WEB "Build the browser client with npm and compile it in" ${web_default})

if(LUMEND_WEB)
    file(GLOB_RECURSE web_sources CONFIGURE_DEPENDS ${web_dir}/src/* ${web_dir}/public/* ${PROJECT_SOURCE_DIR}/clients/js/src/*)
    list(APPEND web_sources ${web_dir}/index.html ${web_dir}/package.json ${web_dir}/package-lock.json)
else()
    set(web_sources ${CMAKE_CURRENT_SOURCE_DIR}/no_client.html)
endif()
add_custom_command(OUTPUT embedded_web.c embedded_web.s
    COMMAND ${CMAKE_COMMAND} -DOUT=embedded_web -DWEB=${LUMEND_WEB} -DNPM=${NPM} -DWEB_DIR=${web_dir}
            -P ${CMAKE_CURRENT_SOURCE_DIR}/embed_web.cmake
    DEPENDS ${web_sources} embed.cmake embed_web.cmake
    VERBATIM)
