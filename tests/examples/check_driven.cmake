# cmake -DRUNNER=... -DFOLDER=... -P check_driven.cmake
#
# What a scene moves: a plate that shakes carries a ball, a field turns, and bodies that meet merge.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE "${FOLDER}")

# The last row's entry in a column, in millionths, is as expected to a thousandth. A fifth argument has more settings.
function(ends name column expected scene)
  file(WRITE "${FOLDER}/${name}.toml" "duration = 1
simulation = {G = 0, timeStep = 0.001953125, adaptiveTimeStep = false, coeffRestitution = 0${ARGV4}}
output.frames = 0
${scene}")
  execute_process(COMMAND "${RUNNER}" "${FOLDER}/${name}.toml" -q --no-picture -o "${FOLDER}/${name}"
    RESULT_VARIABLE status OUTPUT_VARIABLE printed ERROR_VARIABLE printed)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${name}: gravel-run ended with ${status}: ${printed}")
  endif()
  file(STRINGS "${FOLDER}/${name}/diagnostics.csv" rows)
  list(GET rows 0 names)
  list(GET rows -1 row)
  string(REPLACE "," ";" names "${names}")
  string(REPLACE "," ";" row "${row}")
  list(FIND names "${column}" place)
  list(GET row ${place} found)
  if(NOT "${found}000000" MATCHES "^0[.]([0-9][0-9][0-9][0-9][0-9][0-9])")
    message(FATAL_ERROR "${name}: ${column} is ${found}, which is no number from 0 to 1")
  endif()
  math(EXPR off "(1${CMAKE_MATCH_1} - 1000000 - ${expected}) * 1000 / ${expected}")
  if(off LESS -1 OR off GREATER 1)
    message(FATAL_ERROR "${name}: ${column} is ${found}, not ${expected} millionths")
  endif()
endfunction()

# After two swings the plate has A w = 0.08 pi along the normal, which the ball has, too, and 0.04 pi across, of which a
# ball that rolls has 2/7, and 5/7 as the speed of its surface.
set(shaken "field.acceleration = [0, 0, -9.81]
[[plane]]
shake = [0.01, 0, 0.02]
shakePeriod = 0.5
friction = 1
[[body]]
position = [0, 0, 0.1]
radius = 0.1
mass = 1
")
ends(carried kinetic 32227 "${shaken}")
ends(rolling rotational 1611 "${shaken}")
# v = (g/w) (1 - cos wt, sin wt) across and along: kinetic energy g^2 (1 - cos wt)/w^2.
ends(turned kinetic 354037 "field = {acceleration = [0, 0, -1], turn = [0, 2, 0]}
body = [{mass = 1}]
")
# Both at 1 m/s, of masses 1/4 and 1/2: head-on they keep (1/4)^2/(2 3/4), and lose the rest.
set(two "[[body]]
position = [-0.5, 0, 0]
velocity = [1, 0, 0]
radius = 0.1
mass = 0.25
[[body]]
position = [0.5, 0, 0]
velocity = [-1, 0, 0]
radius = 0.1
mass = 0.5
")
ends(merged kinetic 41667 "collisions.outcome = 'merge'\n${two}")
ends(merged restitution 333333 "collisions.outcome = 'merge'\n${two}")
file(READ "${FOLDER}/merged/summary.txt" words)
if(NOT words MATCHES "1 body of 2 merged into others[.]")
  message(FATAL_ERROR "the summary does not tell of the merger: ${words}")
endif()
# What is at rest in the flow stays there: (3/2 x)^2/2 at a fifth of a length from the middle.
ends(flowing kinetic 45000 "domain = {kind = 'shearPeriodic', lengths = [1, 1, 1], omega = 1}
body = [{position = [0.2, 0, 0], mass = 1, flow = true}]
" ", integrator = 'SymplecticEpicycle'")
# There is no escape speed without gravity.
ends(bounced restitution 333333 "collisions.outcome = 'mergeBelowEscape'\n${two}")
file(READ "${FOLDER}/bounced/summary.txt" words)
if(words MATCHES "merged")
  message(FATAL_ERROR "without gravity what meets merges below the escape speed: ${words}")
endif()
