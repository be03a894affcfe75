# cmake -DOUT=file -DWEB=bool -DNPM=npm -DWEB_DIR=clients/web -P embed_web.cmake: see web.cmake
set(KEYS index.html)
set(FILES ${CMAKE_CURRENT_LIST_DIR}/no_client.html)
if(WEB)
    # npm's own record of what it installed: older than the lock file, or absent, means that it must run
    if(NOT EXISTS ${WEB_DIR}/node_modules/.package-lock.json OR
       ${WEB_DIR}/package-lock.json IS_NEWER_THAN ${WEB_DIR}/node_modules/.package-lock.json)
        execute_process(COMMAND ${NPM} ci --no-audit --no-fund --loglevel=error
            WORKING_DIRECTORY ${WEB_DIR} OUTPUT_QUIET RESULT_VARIABLE failed)
        if(failed)
            message(FATAL_ERROR "npm ci failed in clients/web; -DLUMEND_WEB=OFF builds without the browser client")
        endif()
        file(TOUCH ${WEB_DIR}/node_modules/.package-lock.json)
    endif()
    execute_process(COMMAND ${NPM} run --silent build WORKING_DIRECTORY ${WEB_DIR} OUTPUT_QUIET RESULT_VARIABLE failed)
    if(failed)
        message(FATAL_ERROR "npm run build failed in clients/web; -DLUMEND_WEB=OFF builds without the browser client")
    endif()
    file(GLOB_RECURSE KEYS RELATIVE ${WEB_DIR}/dist ${WEB_DIR}/dist/*)
    set(FILES ${KEYS})
    list(TRANSFORM FILES PREPEND ${WEB_DIR}/dist/)
endif()
set(NAME lum_embedded_web)
include(${CMAKE_CURRENT_LIST_DIR}/embed.cmake)
