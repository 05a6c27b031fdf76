# Installs the packages of the lock file in FOLDER with NPM, and makes the programs of FORMATS
# appear in the folder PROGRAMS. Where that fails, they are not there, and nothing else is missing.
execute_process(COMMAND ${NPM} ci --omit=dev --loglevel=error --prefer-offline --fetch-retries=0 WORKING_DIRECTORY ${FOLDER}
  RESULT_VARIABLE result OUTPUT_QUIET ERROR_VARIABLE error)
foreach(format ${FORMATS})
  set(program ${PROGRAMS}/truetriad-convert-${format})
  file(REMOVE ${program})
  if(result EQUAL 0)
    file(CREATE_LINK convert-node/bin/truetriad-convert-${format} ${program} SYMBOLIC)
  endif()
endforeach()
if(result EQUAL 0)
  file(TOUCH ${FOLDER}/packages.stamp)
else()
  message("The converters of ULog, MCAP and Parquet are left out: npm ci failed\n${error}")
endif()
