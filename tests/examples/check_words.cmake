# cmake -DRUNNER=... -DFOLDER=... -P check_words.cmake
#
# The summary holds the name of a unit whole, however long it is, and does not speak of steps of changing length where
# the integrator takes equal ones.
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
