# If Debian has archives of libraries, the program contains these (but not the C library). So thirty
# fewer shared libraries are found and relocated at the start, which took longer than estimation.
# Imported targets change only in this build: users of the library link as Debian's packages state.
option(TRUETRIAD_STATIC "Link libraries from their archives, where these are installed" ON)
if(NOT TRUETRIAD_STATIC OR TRUETRIAD_SANITIZE OR TRUETRIAD_FUZZ)
  return()
endif()

# Most archives have no -fPIC and cannot be part of a module: Python's module links shared
# libraries. The type of the linking target chooses; the imported target itself becomes an empty
# archive.
set(nothing ${PROJECT_BINARY_DIR}/libnothing.a)
file(WRITE ${nothing} "!<arch>\n")

# truetriad_link_archive(target archive [needs...]): links the imported target from lib<archive>.a,
# if this is installed; `needs` are the libraries that the archive needs.
function(truetriad_link_archive target archive)
  find_library(TRUETRIAD_ARCHIVE_${archive} lib${archive}.a)
  find_library(TRUETRIAD_SHARED_${archive} lib${archive}.so)
  mark_as_advanced(TRUETRIAD_ARCHIVE_${archive} TRUETRIAD_SHARED_${archive})
  if(NOT TRUETRIAD_ARCHIVE_${archive} OR NOT TRUETRIAD_SHARED_${archive})
    message(STATUS "lib${archive}.a is not installed: the shared library is linked")
    return()
  endif()
  get_target_property(configurations ${target} IMPORTED_CONFIGURATIONS)
  if(configurations)
    foreach(configuration IN LISTS configurations)
      set_target_properties(${target} PROPERTIES IMPORTED_LOCATION_${configuration} ${nothing})
    endforeach()
  endif()
  set_target_properties(${target} PROPERTIES IMPORTED_LOCATION ${nothing})
  add_library(${archive}_archive STATIC IMPORTED)
  set_target_properties(${archive}_archive PROPERTIES IMPORTED_LOCATION ${TRUETRIAD_ARCHIVE_${archive}}
    INTERFACE_LINK_LIBRARIES "${ARGN}")
  set_property(TARGET ${target} APPEND PROPERTY INTERFACE_LINK_LIBRARIES
    $<IF:$<STREQUAL:$<TARGET_PROPERTY:TYPE>,MODULE_LIBRARY>,${TRUETRIAD_SHARED_${archive}},${archive}_archive>)
endfunction()
truetriad_link_archive(gflags gflags)
truetriad_link_archive(glog::glog glog
  gflags truetriad_unreached $<$<NOT:$<STREQUAL:${CMAKE_SYSTEM_PROCESSOR},x86_64>>:unwind>)
truetriad_link_archive(yaml-cpp yaml-cpp)
truetriad_link_archive(ZLIB::ZLIB z)
truetriad_link_archive(SQLite::SQLite3 sqlite3)
# These libraries are linked by name, so an imported target of that name stands for the archive.
foreach(name IN ITEMS nettle GeographicLib)
  add_library(${name} STATIC IMPORTED)
  truetriad_link_archive(${name} ${name})
endforeach()

# Programs contain the C++ library, too.
add_link_options($<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-static-libstdc++>
                 $<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-static-libgcc>)

# Ceres is an archive already. Most libraries that it needs are sparse solvers and LAPACK, which the
# dense Eigen solver (src/solve) never calls; so they are not linked.
set_target_properties(Ceres::ceres PROPERTIES INTERFACE_LINK_LIBRARIES
  "Threads::Threads;glog::glog;gflags;Eigen3::Eigen;truetriad_unreached")
