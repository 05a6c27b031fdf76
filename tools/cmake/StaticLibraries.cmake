# What the program links besides the C library it holds itself, where Debian has archives: thirty shared
# libraries less to find and relocate, which took longer than a calibration's estimate. Changes imported
# targets within this build alone: who uses the installed library links as Debian's packages say.
option(TRUETRIAD_STATIC "Link libraries from their archives, where these are installed" ON)
if(NOT TRUETRIAD_STATIC OR TRUETRIAD_SANITIZE OR TRUETRIAD_FUZZ)
  return()
endif()

# Most archives are of code that may not be part of a module (no -fPIC): Python's links the shared ones.
# What stands for a library is chosen by what is linked, so that the imported target itself is empty.
set(nothing ${PROJECT_BINARY_DIR}/libnothing.a)
file(WRITE ${nothing} "!<arch>\n")

# truetriad_link_archive(target archive [needs...]): the imported target is linked from lib<archive>.a, if
# there, which needs what follows.
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
# Linked by name: an imported target of that name stands for the archive.
foreach(name IN ITEMS nettle GeographicLib)
  add_library(${name} STATIC IMPORTED)
  truetriad_link_archive(${name} ${name})
endforeach()

# The C++ library, too.
add_link_options($<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-static-libstdc++>
                 $<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-static-libgcc>)

# Ceres itself is an archive, and most of what starts with the program are sparse solvers and LAPACK,
# which the dense Eigen solver (src/solve) never calls.
set_target_properties(Ceres::ceres PROPERTIES INTERFACE_LINK_LIBRARIES
  "Threads::Threads;glog::glog;gflags;Eigen3::Eigen;truetriad_unreached")
