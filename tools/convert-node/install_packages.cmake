# Installs the packages of the lock file in FOLDER with NPM, and links the programs NAMES into the
# folder PROGRAMS. If that fails, only these programs are missing.
execute_process(COMMAND ${NPM} ci --omit=dev --loglevel=error --prefer-offline --fetch-retries=0 WORKING_DIRECTORY ${FOLDER}
  RESULT_VARIABLE result OUTPUT_QUIET ERROR_VARIABLE error)
foreach(name ${NAMES})
  set(program ${PROGRAMS}/${name})
  file(REMOVE ${program})
  if(result EQUAL 0)
    file(CREATE_LINK convert-node/bin/${name} ${program} SYMBOLIC)
  endif()
endforeach()
if(result EQUAL 0)
  file(TOUCH ${FOLDER}/packages.stamp)
else()
  message("The converters of ULog and Parquet are left out: npm ci failed\n${error}")
endif()
