# cmake -DRUNNER=... -DFOLDER=... -P check_moved_floor.cmake
#
# A plane is drawn where it has travelled to: the picture is that of one which stood there from the start.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE "${FOLDER}")
foreach(way IN ITEMS "offset = -1\nvelocity = [0, 0, 1]" "offset = 0" "offset = -1")
  string(MD5 name "${way}")
  list(APPEND names ${name})
  file(WRITE "${FOLDER}/${name}.toml" "duration = 1
simulation = {G = 0, timeStep = 0.25, adaptiveTimeStep = false}
output.frames = 0
[[plane]]
colour = '#4060a0'
${way}
[[body]]
position = [0, 0, 1]
mass = 1
radius = 0.5
fixed = true
[picture]
width = 120
height = 80
")
  execute_process(COMMAND "${RUNNER}" "${FOLDER}/${name}.toml" -q -o "${FOLDER}/${name}"
    RESULT_VARIABLE status ERROR_VARIABLE said)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "gravel-run ended with ${status}: ${said}")
  endif()
  file(SHA256 "${FOLDER}/${name}/picture.png" hash)
  list(APPEND hashes ${hash})
endforeach()
list(GET hashes 0 moved)
list(GET hashes 1 there)
list(GET hashes 2 before)
if(NOT moved STREQUAL there OR there STREQUAL before)
  message(FATAL_ERROR "a plane that moved is not drawn where it is")
endif()
