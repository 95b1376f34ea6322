# cmake -DRUNNER=... -DFOLDER=... -DSCENE=... -P check_full_disk.cmake
#
# gravel-run must end with 1 and say so where a disk is full: under summary.txt, and under what it prints.
cmake_minimum_required(VERSION 3.25)
if(NOT EXISTS /dev/full)
  message("no /dev/full here: skipped")
  return()
endif()
file(REMOVE_RECURSE "${FOLDER}")
file(MAKE_DIRECTORY "${FOLDER}/summary")
file(CREATE_LINK /dev/full "${FOLDER}/summary/summary.txt" SYMBOLIC)

function(refuses words)
  execute_process(COMMAND "${RUNNER}" "${SCENE}" --no-picture ${ARGN}
    RESULT_VARIABLE status ERROR_VARIABLE said)
  if(NOT status EQUAL 1 OR NOT said MATCHES "${words}")
    message(FATAL_ERROR "gravel-run ended with ${status}, not 1 and \"${words}\": ${said}")
  endif()
endfunction()
refuses("cannot write .*summary\\.txt" -q -o "${FOLDER}/summary")
refuses("cannot write to the standard output" -o "${FOLDER}/printed" OUTPUT_FILE /dev/full)
