# Installs BUILD into a fresh prefix, builds a user's project against it, and runs what a user would
# run. Variables: BUILD SOURCE WORK CONFIG GENERATOR VERSION.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE ${WORK})
set(prefix ${WORK}/prefix)

function(run)
  cmake_parse_arguments(ARG "" "OUTPUT;FOLDER" "COMMAND" ${ARGN})
  if(NOT ARG_FOLDER)
    set(ARG_FOLDER ${WORK})
  endif()
  file(MAKE_DIRECTORY ${ARG_FOLDER})
  execute_process(COMMAND ${ARG_COMMAND} WORKING_DIRECTORY ${ARG_FOLDER}
    OUTPUT_VARIABLE out ERROR_VARIABLE err RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    list(JOIN ARG_COMMAND " " line)
    message(FATAL_ERROR "${line}: ${result}\n${out}\n${err}")
  endif()
  if(ARG_OUTPUT)
    set(${ARG_OUTPUT} "${out}" PARENT_SCOPE)
  endif()
endfunction()

function(expect text)
  foreach(part ${ARGN})
    string(FIND "${text}" "${part}" at)
    if(at EQUAL -1)
      message(FATAL_ERROR "expected `${part}` in:\n${text}")
    endif()
  endforeach()
endfunction()

run(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix} --config ${CONFIG})

# What is installed must not depend on where it was built. (The libraries hold paths of the source
# in their assertions, which nobody opens.)
file(GLOB_RECURSE texts ${prefix}/lib/*.cmake ${prefix}/share/*)
foreach(file ${texts})
  file(READ ${file} text)
  string(REPLACE "${prefix}/" "" text "${text}")  # The pages say where they are installed.
  foreach(folder ${SOURCE} ${BUILD})
    string(FIND "${text}" "${folder}/" at)
    if(NOT at EQUAL -1)
      message(FATAL_ERROR "${file} names ${folder}")
    endif()
  endforeach()
endforeach()

# The docs are about the installed program, and their links lead somewhere.
file(GLOB pages ${prefix}/share/doc/truetriad/*.md ${prefix}/share/doc/truetriad/docs/*.md
  ${prefix}/share/doc/truetriad/docs/tables/*.md)
foreach(page ${pages} ${prefix}/share/man/man1/truetriad.1)
  file(READ ${page} text)
  if(text MATCHES "build/truetriad|[ =](configs|datasets)/[a-z]")
    message(FATAL_ERROR "${page}: ${CMAKE_MATCH_0}")
  endif()
  get_filename_component(folder ${page} DIRECTORY)
  # A bracket would hold the items of a list together.
  string(REPLACE "](" "<to>" text "${text}")
  string(REGEX MATCHALL "<to>[^)# ]+" links "${text}")
  list(FILTER links EXCLUDE REGEX "https?:")
  foreach(link ${links})
    string(REPLACE "<to>" "${folder}/" link "${link}")
    if(NOT EXISTS "${link}")
      message(FATAL_ERROR "${page} leads to ${link}, which is not installed")
    endif()
  endforeach()
endforeach()
file(STRINGS ${prefix}/share/doc/truetriad/README.md first_result REGEX "^    truetriad calibrate .*out/first")
separate_arguments(first_result UNIX_COMMAND "${first_result}")
list(TRANSFORM first_result REPLACE "^truetriad$" ${prefix}/bin/truetriad)
run(COMMAND ${first_result})

# The library, from a prefix that was moved.
file(RENAME ${prefix} ${WORK}/moved)
set(prefix ${WORK}/moved)
run(COMMAND ${CMAKE_COMMAND} -S ${SOURCE}/tests/consumer/project -B ${WORK}/build -G ${GENERATOR}
  -DCMAKE_PREFIX_PATH=${prefix} -DEXAMPLES=${SOURCE}/examples -DWANTED_VERSION=${VERSION}
  -DCMAKE_BUILD_TYPE=Debug "-DCMAKE_CXX_FLAGS=-O0 ${FLAGS}")
run(COMMAND ${CMAKE_COMMAND} --build ${WORK}/build)
run(COMMAND ${WORK}/build/examples/calibrate_poses
  ${prefix}/share/truetriad/datasets/six-rows/poses.csv 9.8 OUTPUT printed)
# Half the difference of each axis' readings up and down, over g, is 1.00092, 1.00131 and 1.00676; tilts
# of half a degree about both axes hide nearly their square, 7e-5, on average.
if(NOT printed MATCHES "gain 1\\.0009[89].*gain 1\\.00140.*gain 1\\.006[89]")
  message(FATAL_ERROR "wrong gains:\n${printed}")
endif()

# A known angle of a tenth of a degree moves a bias by less than its sigma of 0.6 mm/s^2.
run(COMMAND ${WORK}/build/examples/known_angle
  ${prefix}/share/truetriad/datasets/demo/recording.csv 90 10 OUTPUT printed)
if(NOT printed MATCHES "without +bias 0\\.309.*with +bias 0\\.309")
  message(FATAL_ERROR "wrong biases:\n${printed}")
endif()

# The program, with its examples and data.
set(truetriad ${prefix}/bin/truetriad)
run(COMMAND ${truetriad} version OUTPUT printed)
expect("${printed}" "truetriad ${VERSION}")
run(COMMAND ${truetriad} calibrate --config=${prefix}/share/truetriad/configs/experiments/joint.yaml
  --output=${WORK}/out OUTPUT printed)
expect("${printed}" "PASS, ")
run(COMMAND ${truetriad} help calibrate OUTPUT printed)
expect("${printed}" " truetriad calibrate ${prefix}/share/truetriad/datasets/demo/recording.csv -o")
file(WRITE ${WORK}/clean.yaml "experiment: 1
input: ${prefix}/share/truetriad/datasets/demo/recording.csv
sensors: { accelerometer: {}, magnetometer: {} }
reference:
  position: { latitude_deg: 47, longitude_deg: 8, height_m: 400, date: 2026-01-01 }
  field: { site: clean }
")
run(COMMAND ${truetriad} calibrate --config=${WORK}/clean.yaml --output=${WORK}/out OUTPUT printed)
expect("${printed}" "48.21")

if(EXISTS ${BUILD}/truetriad-convert-parquet)
  run(COMMAND ${prefix}/libexec/truetriad/truetriad-convert-parquet
    ${SOURCE}/tests/convert_node/table.parquet --output=${WORK}/table OUTPUT printed)
  expect("${printed}" "table/recording.yaml")
endif()

foreach(file share/man/man1/truetriad.1 share/bash-completion/completions/truetriad
    share/doc/truetriad/LICENSE share/truetriad/magnetic/README.md)
  if(NOT EXISTS ${prefix}/${file})
    message(FATAL_ERROR "${file} is not installed")
  endif()
endforeach()
file(REMOVE_RECURSE ${WORK})
