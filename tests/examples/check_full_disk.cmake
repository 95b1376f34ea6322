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
file(MAKE_DIRECTORY "${FOLDER}/summary/frames")
foreach(earlier IN ITEMS summary.txt picture.png frames/long_words.pvd)
  file(WRITE "${FOLDER}/summary/${earlier}" "of an earlier run")
endforeach()

# refuses(<words> <command ...>): gravel-run ends with 1 and says so
function(refuses words)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status ERROR_VARIABLE said)
  if(NOT status EQUAL 1 OR NOT said MATCHES "${words}")
    message(FATAL_ERROR "gravel-run ended with ${status}, not 1 and \"${words}\": ${said}")
  endif()
endfunction()

# Files of 2048 bytes at most: enough for a table of two rows, but not for a summary of long words.
string(REPEAT "mile " 1000 mile)
file(WRITE "${FOLDER}/long_words.toml" "duration = 1
simulation = {G = 1, timeStep = 0.25, integrator = 'WisdomHolman'}
units.length = '${mile}'
output = {frames = 0, rows = 2}
body = [{mass = 1}, {mass = 1e-3, position = [1, 0, 0], velocity = [0, 1, 0]}]
")
refuses("cannot write .*summary\\.txt: File too large" sh -c [[trap '' XFSZ && ulimit -f 4 && exec "$0" "$@"]]
  "${RUNNER}" "${FOLDER}/long_words.toml" --no-picture -q -o "${FOLDER}/summary")
file(GLOB_RECURSE left RELATIVE "${FOLDER}/summary" "${FOLDER}/summary/*")
if(NOT left STREQUAL "diagnostics.csv")
  message(FATAL_ERROR "beside the table of a run that failed stands ${left}")
endif()
refuses("cannot write to the standard output" "${RUNNER}" "${SCENE}" --no-picture -o "${FOLDER}/printed"
  OUTPUT_FILE /dev/full)
