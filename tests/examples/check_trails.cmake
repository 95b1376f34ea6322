# cmake -DRUNNER=... -DFOLDER=... -P check_trails.cmake
#
# A body that leaves a periodic box by a face and comes in by the opposite one has no path between them: a picture of
# the middle of the box alone is the same with trails and without.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE "${FOLDER}")
foreach(trails IN ITEMS true false)
  file(WRITE "${FOLDER}/${trails}.toml" "duration = 0.4
simulation = {G = 0, timeStep = 0.01, adaptiveTimeStep = false}
domain = {kind = 'periodic', lengths = [1, 1, 1]}
output.frames = 0
[[body]]
position = [0.3, 0, 0]
velocity = [1, 0, 0]
mass = 1
radius = 0.01
[picture]
direction = [0, 0, 1]
up = [0, 1, 0]
target = [0, 0, 0]
span = 0.1
width = 120
height = 80
trails = ${trails}
")
  execute_process(COMMAND "${RUNNER}" "${FOLDER}/${trails}.toml" -q -o "${FOLDER}/${trails}"
    RESULT_VARIABLE status ERROR_VARIABLE said)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "gravel-run ended with ${status}: ${said}")
  endif()
  file(SHA256 "${FOLDER}/${trails}/picture.png" ${trails})
endforeach()
if(NOT "${true}" STREQUAL "${false}")
  message(FATAL_ERROR "a path is drawn through the middle of the box")
endif()
