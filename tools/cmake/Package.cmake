# Debian packages by cpack (tools/package.sh): truetriad is the program, libtruetriad-dev the library.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME truetriad)
set(CPACK_PACKAGE_CONTACT "truetriad <truetriad@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
# By DESTDIR, so that the install script knows the final prefix.
set(CPACK_SET_DESTDIR ON)
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME truetriad)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS nodejs)

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libtruetriad-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "cmake, libeigen3-dev, libceres-dev, libgoogle-glog-dev, libyaml-cpp-dev, libgeographiclib-dev, zlib1g-dev, nettle-dev")
include(CPack)
