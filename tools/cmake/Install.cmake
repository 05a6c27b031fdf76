# States what `cmake --install` installs where. Components: `program`, the program; `python`, the
# module; `development`, all that a project needs to use the library.
include(CMakePackageConfigHelpers)

# --- program
install(TARGETS truetriad RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
set(share ${CMAKE_INSTALL_DATADIR}/truetriad)
install(DIRECTORY share/truetriad/ DESTINATION ${share} COMPONENT program)
install(DIRECTORY configs datasets DESTINATION ${share} COMPONENT program
  # Left out: experiments on recordings that are not part of the project.
  PATTERN recordings EXCLUDE)
set(doc ${CMAKE_INSTALL_DATADIR}/doc/truetriad)
install(FILES LICENSE README.md CHANGELOG.md DESTINATION ${doc} COMPONENT program)
install(DIRECTORY docs examples DESTINATION ${doc} COMPONENT program
  # Left out: the page for those who change the source.
  PATTERN code.md EXCLUDE)
install(DIRECTORY tools/slurm tools/parallel DESTINATION ${doc}/tools COMPONENT program
  USE_SOURCE_PERMISSIONS)
# The licences of libraries that the program contains, from Debian's packages.
foreach(package IN ITEMS libceres-dev libeigen3-dev libgoogle-glog-dev libgflags-dev libyaml-cpp-dev zlib1g-dev
                         libsqlite3-dev nettle-dev libgeographiclib-dev nlohmann-json3-dev libboost1.74-dev)
  if(EXISTS /usr/share/doc/${package}/copyright)
    install(FILES /usr/share/doc/${package}/copyright DESTINATION ${doc}/licences RENAME ${package}
      COMPONENT program)
  endif()
endforeach()
install(CODE "include(${CMAKE_CURRENT_LIST_DIR}/InstalledTexts.cmake)
  rewrite_installed_texts(${share} ${doc}/*.md ${doc}/docs/*.md
    ${doc}/docs/tables/*.md ${CMAKE_INSTALL_MANDIR}/man1/truetriad.1)"
  COMPONENT program)

# --- python
if(TARGET truetriad_python)
  set(TRUETRIAD_PYTHON_DIR lib/python3/dist-packages CACHE STRING
    "Where Python's packages go, below the prefix")
  install(TARGETS truetriad_python LIBRARY DESTINATION ${TRUETRIAD_PYTHON_DIR}/truetriad COMPONENT python)
  install(DIRECTORY python/truetriad DESTINATION ${TRUETRIAD_PYTHON_DIR} COMPONENT python
    PATTERN __pycache__ EXCLUDE)
  install(DIRECTORY share/truetriad/magnetic
    DESTINATION ${TRUETRIAD_PYTHON_DIR}/truetriad/share/truetriad COMPONENT python)
endif()

# --- development
install(DIRECTORY include/truetriad DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/truetriad)
install(EXPORT truetriadTargets NAMESPACE truetriad:: DESTINATION ${package} COMPONENT development)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/truetriadConfig.cmake.in
  ${PROJECT_BINARY_DIR}/package/truetriadConfig.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/package/truetriadConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/package/truetriadConfig.cmake
              ${PROJECT_BINARY_DIR}/package/truetriadConfigVersion.cmake
  DESTINATION ${package} COMPONENT development)
