# What the program links besides the C library it holds itself, where Debian has archives: thirty shared
# libraries less to find and relocate, which took longer than a calibration's estimate. Changes imported
# targets within this build alone: who uses the installed library links as Debian's packages say.
option(TRUETRIAD_STATIC "Link libraries from their archives, where these are installed" ON)
if(NOT TRUETRIAD_STATIC OR TRUETRIAD_SANITIZE OR TRUETRIAD_FUZZ)
  return()
endif()

# truetriad_link_archive(target archive): the imported target is linked from lib<archive>.a, if there.
function(truetriad_link_archive target archive)
  find_library(TRUETRIAD_ARCHIVE_${archive} lib${archive}.a)
  mark_as_advanced(TRUETRIAD_ARCHIVE_${archive})
  if(NOT TRUETRIAD_ARCHIVE_${archive})
    message(STATUS "lib${archive}.a is not installed: the shared library is linked")
    return()
  endif()
  # Most archives are of code that may not be part of a module (no -fPIC); modules link these.
  find_library(TRUETRIAD_SHARED_${archive} lib${archive}.so)
  mark_as_advanced(TRUETRIAD_SHARED_${archive})
  if(TRUETRIAD_SHARED_${archive})
    set_property(GLOBAL APPEND PROPERTY TRUETRIAD_SHARED_LIBRARIES ${TRUETRIAD_SHARED_${archive}})
  endif()
  get_target_property(configurations ${target} IMPORTED_CONFIGURATIONS)
  if(configurations)
    foreach(configuration IN LISTS configurations)
      set_target_properties(${target} PROPERTIES
        IMPORTED_LOCATION_${configuration} ${TRUETRIAD_ARCHIVE_${archive}})
    endforeach()
  endif()
  set_target_properties(${target} PROPERTIES IMPORTED_LOCATION ${TRUETRIAD_ARCHIVE_${archive}})
endfunction()
truetriad_link_archive(glog::glog glog)
set_property(TARGET glog::glog APPEND PROPERTY INTERFACE_LINK_LIBRARIES truetriad_unreached)
if(NOT CMAKE_SYSTEM_PROCESSOR STREQUAL x86_64)
  set_property(TARGET glog::glog APPEND PROPERTY INTERFACE_LINK_LIBRARIES unwind)
endif()
truetriad_link_archive(gflags gflags)
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
