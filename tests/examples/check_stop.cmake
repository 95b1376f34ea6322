# cmake -DRUNNER=... -DFOLDER=... -P check_stop.cmake
#
# Ctrl-C must end gravel-run at once where no run is under way that could end in order: while the bodies of a scene
# are made (these take half a minute), and while the picture is drawn (this one takes a minute).
cmake_minimum_required(VERSION 3.25)
find_program(timeout NAMES timeout)  # of GNU coreutils
if(NOT timeout)
  message("no timeout here: skipped")
  return()
endif()
file(REMOVE_RECURSE "${FOLDER}")
file(WRITE "${FOLDER}/making.toml" "duration = 1
simulation.G = 0
[[cloud]]
count = 3_000_000
radius = 10_000
bodyRadius = 1
")
file(WRITE "${FOLDER}/drawing.toml" "duration = 1e-3
output.frames = 0
picture = {width = 10_000, height = 10_000}
[[body]]
mass = 1
radius = 1
")
foreach(scene IN ITEMS making drawing)
  execute_process(COMMAND "${timeout}" --preserve-status -s INT -k 10 3
    "${RUNNER}" "${FOLDER}/${scene}.toml" -q -o "${FOLDER}/${scene}"
    RESULT_VARIABLE status ERROR_VARIABLE said)
  if(NOT status EQUAL 130)
    message(FATAL_ERROR "${scene}: gravel-run ended with ${status}, not 130: ${said}")
  endif()
endforeach()
