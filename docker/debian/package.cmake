# `cpack -G DEB` in the build folder makes the Debian package: the programs with the browser client in lumend, the man page, the unit.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON) # packs what is built; tests need not be
set(debian ${CMAKE_CURRENT_LIST_DIR})
# Only in the package (component debian): elsewhere there is no /etc.
install(FILES ${debian}/lumend.default DESTINATION /etc/default RENAME lumend COMPONENT debian EXCLUDE_FROM_ALL)
install(FILES ${debian}/copyright DESTINATION share/doc/lumend COMPONENT debian EXCLUDE_FROM_ALL)
install(FILES ${PROJECT_SOURCE_DIR}/server/OPERATIONS.md ${PROJECT_SOURCE_DIR}/protocol/PROTOCOL.md
    DESTINATION share/doc/lumend COMPONENT debian EXCLUDE_FROM_ALL)
# The unit names the program where the package puts it.
set(LUM_BINDIR /usr/bin)
configure_file(${debian}/lumend.service.in ${CMAKE_BINARY_DIR}/debian/lumend.service @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/debian/lumend.service DESTINATION lib/systemd/system COMPONENT debian EXCLUDE_FROM_ALL)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME lumend)
set(CPACK_PACKAGE_VENDOR lumend)
set(CPACK_PACKAGE_CONTACT "lumend <lumend@localhost>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
# What everybody gets first, then what is of the package alone, which takes the place of the unit.
set(CPACK_INSTALL_CMAKE_PROJECTS
    "${CMAKE_BINARY_DIR};lumend;Unspecified;/" "${CMAKE_BINARY_DIR};lumend;debian;/")
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${debian}/conffiles ${debian}/postinst ${debian}/prerm ${debian}/postrm)
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "render server for lighting design
Holds one 3D scene, which people edit together in browsers, and renders it on
the CPU with global illumination, in photometric units. Comes with a service
for systemd, which is not started by itself, an importer for models, and
commands that render, measure and compare without a browser.

Needs a processor with AVX2 and FMA.")
include(CPack)
