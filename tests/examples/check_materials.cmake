# cmake -DRUNNER=... -DFOLDER=... -P check_materials.cmake
#
# Balls of several materials meet a floor of another at 1 m/s, each once: what the blows take is that of the mixed, and
# of the measured, coefficients.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE "${FOLDER}")
include("${CMAKE_CURRENT_LIST_DIR}/scene_runs.cmake")

set(head "duration = 0.2
simulation = {G = 0, timeStep = 0.01, adaptiveTimeStep = false, coeffRestitution = 1, coeffFriction = 0}
output.frames = 0
[[material]]
name = 'steel'
restitution = 0.81
[[material]]
name = 'putty'
restitution = 0.25
[[material]]
name = 'cork'
restitution = 0.36
")

# What blows took in joules, to nine digits, which CMake counts in nanojoules.
function(loses name expected scene)
  run_scene(${name} "${head}${scene}")
  last_value(lost ${name} restitution)
  if(NOT "${lost}000000000" MATCHES "^([0-9])[.]([0-9][0-9][0-9][0-9][0-9][0-9][0-9][0-9][0-9])")
    message(FATAL_ERROR "${name}: blows took ${lost}, which is no number below 10")
  endif()
  math(EXPR off "${CMAKE_MATCH_1}${CMAKE_MATCH_2} - ${expected}")
  if(off LESS -1 OR off GREATER 1)
    message(FATAL_ERROR "${name}: blows took ${lost} J, not ${expected} nJ")
  endif()
endfunction()

set(balls "")
foreach(place_and_words IN ITEMS "0|material = 'steel'" "5|material = 'putty'" "10|material = 'cork'" "15|")
  string(REGEX MATCH "^([0-9]+)[|](.*)$" ignored "${place_and_words}")
  string(APPEND balls "[[body]]
position = [${CMAKE_MATCH_1}, 0, 1.1]
velocity = [0, 0, -1]
radius = 1
mass = 2
${CMAKE_MATCH_2}
")
endforeach()

# 1 - e^2 of each ball: steel 1 - 0.81^2, putty 1 - 0.81 x 0.25, cork as measured, 1 - 0.5^2, the last one 1 - 0.81.
loses(mixed_and_measured 2081400000 "[[pair]]
materials = ['cork', 'steel']
restitution = 0.5
[[plane]]
material = 'steel'
${balls}")
# A floor of steel but for its restitution is of no pair: 1 - 0.49 e of each.
loses(floor_of_its_own 2814200000 "[[pair]]
materials = ['cork', 'steel']
restitution = 0.5
[[box]]
low = [-5, -5, 0]
high = [20, 5, 5]
material = 'steel'
restitution = 0.49
${balls}")
# What a pair does not say is mixed: e^2 = 0.81 x 0.25; bodies of generators have a material.
loses(cloud 797500000 "[[pair]]
materials = ['putty', 'steel']
tangentialRestitution = 0.5
[[plane]]
material = 'steel'
[[cloud]]
count = 1
position = [0, 0, 1.1]
velocity = [0, 0, -1]
radius = 1e-3
bodyRadius = 1
density = 0.477464829275686
material = 'putty'
")
