# cmake -DRUNNER=... -DFOLDER=... -DSCENE=... -P check_full_disk.cmake
#
# gravel-run must end with 1 and say so where a disk is full: under summary.txt, and under what it prints. What an
# earlier run left must not stand there as its own, nor half a file.
cmake_minimum_required(VERSION 3.25)
if(NOT EXISTS /dev/full)
  message("no /dev/full here: skipped")
  return()
endif()
file(REMOVE_RECURSE "${FOLDER}")
file(MAKE_DIRECTORY "${FOLDER}/summary")
file(CREATE_LINK /dev/full "${FOLDER}/summary/summary.txt.part" SYMBOLIC)
file(MAKE_DIRECTORY "${FOLDER}/summary/frames")
foreach(earlier IN ITEMS summary.txt picture.png frames/long_steps.pvd)
  file(WRITE "${FOLDER}/summary/${earlier}" "of an earlier run")
endforeach()

function(refuses words)
  execute_process(COMMAND "${RUNNER}" "${SCENE}" --no-picture ${ARGN}
    RESULT_VARIABLE status ERROR_VARIABLE said)
  if(NOT status EQUAL 1 OR NOT said MATCHES "${words}")
    message(FATAL_ERROR "gravel-run ended with ${status}, not 1 and \"${words}\": ${said}")
  endif()
endfunction()
refuses("cannot write .*summary\\.txt" -q --frames 0 -o "${FOLDER}/summary")
file(GLOB_RECURSE left RELATIVE "${FOLDER}/summary" "${FOLDER}/summary/*")
if(NOT left STREQUAL "diagnostics.csv")
  message(FATAL_ERROR "beside the table of a run that failed stands ${left}")
endif()
refuses("cannot write to the standard output" -o "${FOLDER}/printed" OUTPUT_FILE /dev/full)
