# cmake -DWORK=<folder to write in> -P check_layers_selftest.cmake
#
# Writes small header trees, each with one fault, and requires that check_layers.cmake names it; and one without.
cmake_minimum_required(VERSION 3.25)

function(check name expected path)
  set(root "${WORK}/${name}")
  file(REMOVE_RECURSE "${root}")
  list(JOIN ARGN "\n" text)
  file(WRITE "${root}/include/gravel/${path}" "#pragma once\n${text}\n")
  execute_process(
    COMMAND "${CMAKE_COMMAND}" "-DROOT=${root}" -P "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/check_layers.cmake"
    RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  string(REGEX REPLACE "[ \n]+" " " output "${output}")
  if(expected STREQUAL "" AND NOT result EQUAL 0)
    message(SEND_ERROR "${name}: refused without a reason: ${output}")
  elseif(NOT expected STREQUAL "" AND (result EQUAL 0 OR NOT output MATCHES "${expected}"))
    message(SEND_ERROR "${name}: not found: ${output}")
  endif()
endfunction()

check(clean "" contact/a.hpp "#include <gravel/fwd.hpp>" "#include <gravel/core/types.hpp>"
  "#include <gravel/contact/b.hpp>" "#include <gravel/spatial/pair.hpp>" "#include <vector>")
check(umbrella "" gravel.hpp "#include <gravel/space/space.hpp>" "#include <gravel/core/types.hpp>")
check(parallel "" core/parallel.hpp "#include <omp.h>" "  #pragma omp parallel for")
check(kdtree "" spatial/kdtree.hpp "#include <nanoflann.hpp>")
check(upwards "core .layer 0. may not include bodies" core/a.hpp "#include <gravel/bodies/body.hpp>")
check(spaced "core .layer 0. may not include bodies" core/a.hpp " # include  <gravel/bodies/body.hpp>")
check(siblings "gravity .layer 3. may not include contact" gravity/a.hpp "#include <gravel/contact/contact.hpp>")
check(late_siblings "output .layer 4. may not include dynamics" output/a.hpp
  "#include <gravel/dynamics/damping.hpp>")
check(top "may not include the umbrella" space/a.hpp "#include <gravel/gravel.hpp>")
check(forward "it only declares" fwd.hpp "#include <gravel/core/types.hpp>")
check(folder "has no layer" extra/a.hpp "")
check(target "folder without a layer" space/a.hpp "#include <gravel/extra/a.hpp>")
check(openmp "OpenMP belongs" gravity/a.hpp "#pragma omp simd")
check(openmp_operator "OpenMP belongs" gravity/a.hpp "  _Pragma(\"omp simd\")")
check(openmp_header "OpenMP belongs" gravity/a.hpp "#include <omp.h>")
check(nanoflann "nanoflann belongs" spatial/grid.hpp "#include <nanoflann.hpp>")
check(slow "slow to parse" output/a.hpp "#include <iostream>")
check(quoted "write #include <gravel/" output/a.hpp "#include \"vtk.hpp\"")
string(REPEAT "\n" 319 blank)
check(long "321 lines" core/a.hpp "${blank}")
string(REPEAT "\n" 318 blank)
check(longest "" core/a.hpp "${blank}")
file(WRITE "${WORK}/once/include/gravel/core/a.hpp" "int x()\;\n")
execute_process(
  COMMAND "${CMAKE_COMMAND}" "-DROOT=${WORK}/once" -P "${CMAKE_CURRENT_LIST_DIR}/check_layers.cmake"
  RESULT_VARIABLE result ERROR_VARIABLE output)
if(result EQUAL 0 OR NOT output MATCHES "no #pragma once")
  message(SEND_ERROR "once: not found: ${output}")
endif()
