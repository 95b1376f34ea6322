# cmake -DRUNNER=... -DFOLDER=... -P check_words.cmake
#
# The summary holds the name of a unit whole, however long it is, and does not speak of steps of changing length where
# the integrator takes equal ones. Whole numbers are read whether or not a double holds all their digits. Times
# are told in the unit that fits their rounded number.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE "${FOLDER}")
include("${CMAKE_CURRENT_LIST_DIR}/scene_runs.cmake")
string(REPEAT "mile " 150 mile)
run_scene(words "duration = 1
simulation = {G = 1, timeStep = 0.25, integrator = 'WisdomHolman'}
units.length = '${mile}'
output.frames = 0
[[body]]
mass = 1
[[body]]
mass = 1e-3
position = [1, 0, 0]
velocity = [0, 1, 0]
")
if(NOT words MATCHES "in 4 steps of equal length.*axis [0-9.]+ ${mile}, eccentricity 0")
  message(FATAL_ERROR "a summary that is cut or wrong: ${words}")
endif()
# Seen to fail: 1e+03 ms.
run_scene(nearly_a_second "duration = 0.9999999
simulation = {G = 0, timeStep = 1, adaptiveTimeStep = false}
output.frames = 0
body = [{mass = 1}]
")
if(NOT words MATCHES "followed for 1 s in")
  message(FATAL_ERROR "a second in other words: ${words}")
endif()
# Seen to fail: 7e-310 kg, by a number that was not there.
run_scene(whole_numbers "duration = 1
simulation = {G = 0, timeStep = 1, adaptiveTimeStep = false}
output.frames = 0
body = [{mass = 10660000000000001, position = [9007199254740993, 0, 0]}]
")
if(NOT words MATCHES "^1 body of 1.066e.16 kg together")
  message(FATAL_ERROR "a whole number was not read: ${words}")
endif()
