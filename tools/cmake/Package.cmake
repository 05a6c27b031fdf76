# Debian packages, made by cpack (tools/package.sh): truetriad holds the program, python3-truetriad
# the Python module, libtruetriad-dev the library.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME truetriad)
set(CPACK_PACKAGE_CONTACT "truetriad <truetriad@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
# With DESTDIR, the install script knows the final prefix.
set(CPACK_SET_DESTDIR ON)
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL program development)
if(TARGET truetriad_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME truetriad)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
# libpq is loaded at run time, if a store is in PostgreSQL.
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS libpq5)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS nodejs)

if(TARGET truetriad_python)
  math(EXPR next_python "${Python_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-truetriad)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  # The module works only with the Python version that it was built for.
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}), python3 (<< ${Python_VERSION_MAJOR}.${next_python}), python3-numpy")
endif()

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libtruetriad-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "cmake, libeigen3-dev, libceres-dev, libgoogle-glog-dev, libyaml-cpp-dev, libgeographiclib-dev, zlib1g-dev, nettle-dev")
include(CPack)
