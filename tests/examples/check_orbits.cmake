# cmake -DRUNNER=... -DFOLDER=... -P check_orbits.cmake
#
# The summary tells the orbit that a body follows: about a fixed centre, which is not pulled in turn, about the body
# that holds it, and none where no ellipse of two bodies is one.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE "${FOLDER}")

function(summary_of name scene)
  file(WRITE "${FOLDER}/${name}.toml" "duration = 1e-3\noutput.frames = 0\n${scene}")
  execute_process(COMMAND "${RUNNER}" "${FOLDER}/${name}.toml" -q --no-picture -o "${FOLDER}/${name}"
    RESULT_VARIABLE status ERROR_VARIABLE said)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${name}: gravel-run ended with ${status}: ${said}")
  endif()
  file(READ "${FOLDER}/${name}/summary.txt" words)
  set(words "${words}" PARENT_SCOPE)
endfunction()
function(says name words scene)
  set(expected "${words}")
  summary_of(${name} "${scene}")
  if(NOT words MATCHES "${expected}")
    message(FATAL_ERROR "${name}: the summary has no \"${expected}\": ${words}")
  endif()
endfunction()
function(says_nothing name unwanted scene)
  summary_of(${name} "${scene}")
  if(words MATCHES "${unwanted}")
    message(FATAL_ERROR "${name}: the summary has \"${unwanted}\": ${words}")
  endif()
endfunction()

says(fixed_sun "planet +semi-major axis 1 m, eccentricity 0\\.0000, period 6\\.28 s" "simulation = {G = 1}
[[body]]
name = 'Sun'
fixed = true
mass = 1
[[body]]
name = 'planet'
position = [1, 0, 0]
velocity = [0, 1, 0]
mass = 0.5
")
# In units of AU, years and solar masses; the moon goes about the planet at 0.001 AU.
says(moon "Sun:\n +planet +semi-major axis 0\\.9999 m, .*moon +about planet: semi-major axis 0\\.001 m, eccentricity 0\\.000"
"simulation = {G = 39.4784176, timeStep = 1e-5}
[[body]]
name = 'Sun'
mass = 1
[[body]]
name = 'planet'
position = [1, 0, 0]
velocity = [0, 6.283185307, 0]
mass = 1e-4
[[body]]
name = 'moon'
position = [1.001, 0, 0]
velocity = [0, 8.27010312, 0]
mass = 0
")
says_nothing(about_a_binary "tracer" "simulation = {G = 1}
[[body]]
position = [-0.5, 0, 0]
velocity = [0, -0.7071, 0]
mass = 1
[[body]]
position = [0.5, 0, 0]
velocity = [0, 0.7071, 0]
mass = 1
[[body]]
name = 'tracer'
position = [20, 0, 0]
velocity = [0, 0.316, 0]
mass = 0
")
set(pair "[[body]]
mass = 1
[[body]]
position = [1, 0, 0]
velocity = [0, 0.6, 0]
mass = 1e-9
")
says(two_points "semi-major axis" "simulation = {G = 1}\n${pair}")
says_nothing(softened "semi-major axis" "simulation = {G = 1, softening = 1}\n${pair}")
says_nothing(in_a_field "semi-major axis" "simulation = {G = 1}\nfield = {acceleration = [0, 0, -1]}\n${pair}")
says_nothing(over_a_floor "semi-major axis" "simulation = {G = 1}\n[[plane]]\noffset = -1\n${pair}")
# Seen to fail: both fly past.
says_nothing(massless "Orbits" "simulation = {G = 1}
body = [{mass = 0}, {position = [1, 0, 0], velocity = [0, 1, 0], mass = 0}]
")
says_nothing(at_one_place "Orbits" "simulation = {G = 1}\nbody = [{mass = 1}, {mass = 1}]\n")
