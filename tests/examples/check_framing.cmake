# cmake -DRUNNER=... -DFOLDER=... -P check_framing.cmake
#
# What is to be seen is seen: a picture changes with the colour of a point, of bodies at the sides of a picture that is
# higher than wide, and of one near the eye of a wide field of view. With trails and no span it frames the paths.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE "${FOLDER}")

function(picture name scene)
  file(WRITE "${FOLDER}/${name}.toml" "duration = 9
simulation = {G = 0, timeStep = 0.125, adaptiveTimeStep = false}
output.frames = 0
${scene}")
  execute_process(COMMAND "${RUNNER}" "${FOLDER}/${name}.toml" -q -o "${FOLDER}/${name}"
    RESULT_VARIABLE status ERROR_VARIABLE said)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "gravel-run ended with ${status}: ${said}")
  endif()
  file(SHA256 "${FOLDER}/${name}/picture.png" hash)
  set(hash "${hash}" PARENT_SCOPE)
endfunction()
function(shows_colour name scene)
  picture(${name}_red "${scene}\ncolour = '#ff0000'\n")
  set(red "${hash}")
  picture(${name}_blue "${scene}\ncolour = '#0000ff'\n")
  if(hash STREQUAL red)
    message(FATAL_ERROR "${name}: the body whose colour changes is not in the picture")
  endif()
endfunction()

set(look "picture = {width = 120, height = 80}\n")
set(middle "[[body]]\nmass = 1\nradius = 0.01\nfixed = true\n[[body]]\nmass = 1\n")
shows_colour(point "${look}[[body]]\nmass = 1\nsurface = 'glowing'")
shows_colour(portrait "picture = {width = 30, height = 300, direction = [0, 0, 1], up = [0, 1, 0], target = [0, 0, 0]}
${middle}radius = 0.1\nposition = [1, 0, 0]")
shows_colour(wide "picture = {width = 120, height = 80, direction = [0, 0, 1], up = [0, 1, 0], target = [0, 0, 0], fieldOfView = 120}
${middle}radius = 0.1\nposition = [0, 0.1, 1]")

set(walk "[[body]]\nmass = 1\nradius = 0.5\nposition = [9, 0, 0]\nvelocity = [-1, 0, 0]\n")
picture(framed "picture = {width = 120, height = 80, trails = true}\n${walk}")
set(framed "${hash}")
picture(given "picture = {width = 120, height = 80, trails = true, target = [4.5, 0, 0], span = 11.5}\n${walk}")
if(NOT hash STREQUAL framed)
  message(FATAL_ERROR "a picture with trails does not frame the paths")
endif()
