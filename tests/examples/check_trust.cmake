# cmake -DRUNNER=... -DFOLDER=... -P check_trust.cmake
#
# A run whose energy goes wrong says so: two points that fall onto each other in steps that are far too long. One whose
# energies are not finite fails. A right one says nothing of the kind; what friction put in is no loss; what moved
# between two rows of the table counts. What the shear of a patch does by gravity is no fault of the step.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE "${FOLDER}")

function(expects name status words scene)
  file(WRITE "${FOLDER}/${name}.toml" "${scene}")
  execute_process(COMMAND "${RUNNER}" "${FOLDER}/${name}.toml" --no-picture -o "${FOLDER}/${name}"
    RESULT_VARIABLE ended OUTPUT_VARIABLE printed ERROR_VARIABLE printed)
  if(NOT ended EQUAL status OR NOT printed MATCHES "${words}")
    message(FATAL_ERROR "${name}: gravel-run ended with ${ended}, not ${status} and \"${words}\": ${printed}")
  endif()
  set(printed "${printed}" PARENT_SCOPE)
endfunction()

function(points step)
  set(scene "duration = 3
simulation = {G = 1, timeStep = ${step}, adaptiveTimeStep = false}
[[body]]
position = [-0.5, 0, 0]
velocity = [0, -0.3, 0]
mass = 1
[[body]]
position = [0.5, 0, 0]
velocity = [0, 0.3, 0]
mass = 1
" PARENT_SCOPE)
endfunction()
points(0.05)
expects(blow_up 0 "off by [0-9.]+e.0[01] .*This run is not to be trusted" "${scene}")
points(0.0001)
expects(right 0 "The energy ledger is off by" "${scene}")
if(printed MATCHES "not to be trusted")
  message(FATAL_ERROR "a right run is not trusted: ${printed}")
endif()

expects(not_finite 1 "gravel-run: The energies or places are not finite: this run is not to be trusted" "duration = 1
simulation = {G = 0, timeStep = 0.1, adaptiveTimeStep = false}
[[body]]
mass = 1e200
velocity = [1e60, 0, 0]
")
# Seen to fail: saved, and refused by --restart.
expects(out_of_range 1 "gravel-run: The energies or places are not finite" "duration = 1e300
simulation = {G = 0, timeStep = 1e300, adaptiveTimeStep = false}
body = [{mass = 1, velocity = [1e10, 0, 0]}]
")
# Eight balls jammed into each other. How much each process takes hangs on rounding; that friction puts in does not.
expects(jammed 0 "Friction put in [0-9.]+e.[0-9]+ of" "duration = 0.3
simulation = {G = 0, timeStep = 1e-3, adaptiveTimeStep = false}
domain = {kind = 'periodic', lengths = [1.2, 1.2, 1.2]}
body = [
  {position = [-0.1, 0.0, -0.1], velocity = [0.2, 0.3, -0.9], radius = 0.5, mass = 1},
  {position = [-0.2, 0.1, -0.1], velocity = [-0.5, 1.0, -0.1], radius = 0.5, mass = 1},
  {position = [0.1, 0.0, 0.1], velocity = [-0.7, 0.3, 0.7], radius = 0.5, mass = 1},
  {position = [0.0, 0.1, 0.1], velocity = [-0.9, 0.5, 0.2], radius = 0.5, mass = 1},
  {position = [-0.1, -0.2, 0.1], velocity = [-0.1, 0.4, 0.8], radius = 0.5, mass = 1},
  {position = [0.1, 0.2, 0.0], velocity = [0.6, -0.1, 0.9], radius = 0.5, mass = 1},
  {position = [0.2, -0.2, -0.1], velocity = [-0.6, 0.9, -0.1], radius = 0.5, mass = 1},
  {position = [0.1, -0.1, 0.0], velocity = [-0.2, -0.3, 0.2], radius = 0.5, mass = 1},
]
")
if(printed MATCHES "lost,[^\n]* friction ")
  message(FATAL_ERROR "what friction put in is told as a loss: ${printed}")
endif()
# The ball rests at the start and at the end.
expects(between_rows 0 "All has come to rest: [-+0-9.e]+ of the most kinetic energy seen is left" "duration = 2
simulation = {G = 0, timeStep = 1e-3, adaptiveTimeStep = false, coeffRestitution = 0}
field.acceleration = [0, 0, -9.81]
output.rows = 2
[[plane]]
[[body]]
position = [0, 0, 1]
radius = 0.1
mass = 1
")
# The energy of two bodies that hardly move changes as images shear past them.
expects(sheared 0 "[0-9.]+e-01 at most, the work of the shear by gravity" "duration = 0.6
simulation = {G = 1e-6, timeStep = 0.01, adaptiveTimeStep = false, integrator = 'SymplecticEpicycle'}
domain = {kind = 'shearPeriodic', lengths = [10, 10, 10], omega = 1}
body = [{position = [0, -0.64, 0], mass = 1}, {position = [0, 0.64, 0], mass = 1}]
")
if(printed MATCHES "not to be trusted")
  message(FATAL_ERROR "a right run of a patch is not trusted: ${printed}")
endif()
# Little motion alone is no rest. Seen to fail: all three had come to rest.
set(floor "field.acceleration = [0, 0, -10]\noutput.frames = 0\n")
set(thrown "${floor}duration = 1
simulation = {G = 0, timeStep = 0.01}
body = [{mass = 1, velocity = [0, 0, 10]}]
")
set(between_bounces "${floor}duration = 3.1819805
simulation = {G = 0, timeStep = 1e-3, adaptiveTimeStep = false, coeffRestitution = 0.5}
plane = [{}]
body = [{mass = 1, radius = 0.1, position = [0, 0, 10.1]}]
")
set(comet "output.frames = 0
duration = 6.283185307179586
simulation = {G = 1, timeStep = 0.01, integrator = 'BlanesMoan6'}
body = [{mass = 1}, {mass = 1e-6, position = [1.99, 0, 0], velocity = [0, 0.0708881205, 0]}]
")
foreach(scene IN ITEMS thrown between_bounces comet)
  expects(${scene} 0 "[0-9]e-[0-9]+ of the most kinetic energy seen is left" "${${scene}}")
  if(printed MATCHES "come to rest")
    message(FATAL_ERROR "${scene}: what moves on has come to rest: ${printed}")
  endif()
endforeach()
