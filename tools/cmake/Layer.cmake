# truetriad_layer(name SOURCES ... DEPENDS lower layers ... LIBS PRIVATE third-party ...)
#
# Each layer is a static library, `truetriad::<name>`. A layer links only the layers below it, so an
# upward call does not link. Private headers are beside their .cc and are included from src/.
#
# OF_PROGRAM: the layer is not installed; only the program and the tests use it. BATCH n: compiles n
# sources at a time as one, since headers take most of every compilation. Names in unnamed
# namespaces must then differ within the layer. -DCMAKE_UNITY_BUILD=OFF compiles each alone.
function(truetriad_layer name)
  cmake_parse_arguments(ARG "OF_PROGRAM" "BATCH" "SOURCES;DEPENDS;LIBS;PUBLIC_LIBS" ${ARGN})
  set(target truetriad_${name})
  add_library(${target} STATIC ${ARG_SOURCES})
  add_library(truetriad::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  truetriad_compile_options(${target})
  target_include_directories(${target}
    PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${PROJECT_SOURCE_DIR}/src)
  foreach(lower ${ARG_DEPENDS})
    target_link_libraries(${target} PUBLIC truetriad::${lower})
  endforeach()
  target_link_libraries(${target} PUBLIC ${ARG_PUBLIC_LIBS} PRIVATE ${ARG_LIBS})
  if(ARG_BATCH)
    truetriad_batch(${target} ${ARG_BATCH})
  endif()
  truetriad_precompiled(${target})
  if(NOT ARG_OF_PROGRAM)
    install(TARGETS ${target} EXPORT truetriadTargets
      ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
  endif()
endfunction()

# truetriad_batch(target n): compiles n sources at a time as one.
function(truetriad_batch target size)
  if(DEFINED CMAKE_UNITY_BUILD)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${size})
endfunction()

# truetriad_precompiled(target): Eigen and the standard library take most of every compilation. They
# are compiled once, by truetriad_base, for all layers.
function(truetriad_precompiled target)
  if(target STREQUAL truetriad_base)
    target_precompile_headers(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src/base/precompiled.h)
  else()
    target_precompile_headers(${target} REUSE_FROM truetriad_base)
  endif()
endfunction()

# truetriad_test(name SOURCES ... LIBS ...): one GoogleTest program per folder, known to CTest.
#
# Several sources are compiled as one. So that helpers of the same name do not clash, the names of a
# test x_test.cc are in a namespace x_test.
#
# TOGETHER pattern: CTest runs tests of such names as one test, since they share a long preparation.
function(truetriad_test name)
  cmake_parse_arguments(ARG "" "TOGETHER" "SOURCES;LIBS;LABELS" ${ARGN})
  set(target ${name}_test)
  add_executable(${target} ${ARG_SOURCES})
  truetriad_compile_options(${target})
  # The slow code is in the libraries, so -O1 is enough; tests compile in a third of the time.
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  truetriad_batch(${target} 6)
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(${target} PRIVATE ${ARG_LIBS} GTest::gmock GTest::gtest_main)
  target_compile_definitions(${target} PRIVATE
    TRUETRIAD_SHARED_DATASETS="${TRUETRIAD_SHARED_DATASETS}"
    TRUETRIAD_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    TRUETRIAD_BINARY="$<TARGET_FILE:truetriad>")
  # The first test program precompiles headers for all test programs.
  if(TARGET truetriad_base_test AND NOT target STREQUAL truetriad_base_test)
    target_precompile_headers(${target} REUSE_FROM truetriad_base_test)
  else()
    target_precompile_headers(${target} PRIVATE <Eigen/Dense> <gtest/gtest.h> <gmock/gmock.h>)
  endif()
  set(apart "")
  if(ARG_TOGETHER)
    set(apart TEST_FILTER "-${ARG_TOGETHER}")
    add_test(NAME ${target}.Together COMMAND ${target} "--gtest_filter=${ARG_TOGETHER}")
    set_tests_properties(${target}.Together PROPERTIES SKIP_REGULAR_EXPRESSION "\\[  SKIPPED \\]"
      ENVIRONMENT "TRUETRIAD_LIBEXEC=${PROJECT_BINARY_DIR}")
  endif()
  include(GoogleTest)
  gtest_discover_tests(${target} DISCOVERY_TIMEOUT 600 ${apart}
    PROPERTIES ENVIRONMENT "TRUETRIAD_LIBEXEC=${PROJECT_BINARY_DIR}"
               LABELS "${ARG_LABELS}")  # last, as it may be empty
endfunction()
