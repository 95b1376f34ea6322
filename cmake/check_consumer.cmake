# cmake -DFROM=<way> -DGRAVEL_SOURCE=<folder> -DGRAVEL_BUILD=<folder> -DWORK=<folder> -DGENERATOR=<name>
#       -DCOMPILER=<c++> -DMAKE_PROGRAM=<path> -DPKG_CONFIG=<path> -DEIGEN_DIR=<folder> -DNANOFLANN_DIR=<folder>
#       -DSPACE=<object files> -DFLAGS=<options it was compiled with> -P check_consumer.cmake
#
# Builds and runs tests/consumer against gravel taken in one way: find_package, pkg-config (both from an installation
# that was moved after it was made), add_subdirectory or FetchContent. With find_package the program compiles all that
# it uses; in the other ways it takes the code of Space<double> from SPACE, which would take a minute each.
cmake_minimum_required(VERSION 3.25)

file(REMOVE_RECURSE "${WORK}")
file(MAKE_DIRECTORY "${WORK}")
set(consumer "${GRAVEL_SOURCE}/tests/consumer")

if(FROM STREQUAL "find_package" OR FROM STREQUAL "pkg-config")
  execute_process(COMMAND "${CMAKE_COMMAND}" --install "${GRAVEL_BUILD}" --prefix "${WORK}/first place"
    OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  file(RENAME "${WORK}/first place" "${WORK}/moved")
  # The runner comes along where it was built.
  if(EXISTS "${GRAVEL_BUILD}/examples/gravel-run")
    execute_process(COMMAND "${WORK}/moved/bin/gravel-run" --version OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  endif()
  # Nothing installed may remember where it was built or first put.
  file(GLOB_RECURSE files "${WORK}/moved/share/*")
  foreach(file IN LISTS files)
    file(READ "${file}" text)
    foreach(place IN ITEMS "${GRAVEL_SOURCE}" "${GRAVEL_BUILD}" "${WORK}/first place")
      string(FIND "${text}" "${place}" position)
      if(NOT position EQUAL -1)
        message(FATAL_ERROR "${file} names ${place}")
      endif()
    endforeach()
  endforeach()
endif()

if(FROM STREQUAL "pkg-config")
  set(ENV{PKG_CONFIG_PATH} "${WORK}/moved/share/pkgconfig:$ENV{PKG_CONFIG_PATH}")
  execute_process(COMMAND "${PKG_CONFIG}" --cflags --libs gravel
    OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  separate_arguments(flags UNIX_COMMAND "${flags}")
  separate_arguments(options UNIX_COMMAND "${FLAGS}")
  # Include paths and OpenMP, nothing else.
  foreach(flag IN LISTS flags)
    if(NOT flag MATCHES "^(-I.*|-fopenmp)$")
      message(FATAL_ERROR "gravel.pc carries the flag ${flag}")
    endif()
  endforeach()
  execute_process(
    COMMAND "${COMPILER}" -std=c++20 ${options} -include "${GRAVEL_SOURCE}/tests/support/space.hpp"
      "${consumer}/main.cpp" "${consumer}/other.cpp" ${SPACE} ${flags} -o "${WORK}/consumer"
    COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND "${WORK}/consumer" COMMAND_ERROR_IS_FATAL ANY)
  return()
endif()

if(FROM STREQUAL "find_package")
  set(SPACE "")
endif()
execute_process(
  COMMAND "${CMAKE_COMMAND}" -S "${consumer}" -B "${WORK}/build" -G "${GENERATOR}"
    "-DCMAKE_MAKE_PROGRAM=${MAKE_PROGRAM}" "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_PREFIX_PATH=${WORK}/moved"
    "-DGRAVEL_FROM=${FROM}" "-DGRAVEL_SOURCE=${GRAVEL_SOURCE}" "-DSPACE=${SPACE}"
    "-DCMAKE_CXX_FLAGS=${FLAGS}"
    "-DEigen3_DIR=${EIGEN_DIR}" "-Dnanoflann_DIR=${NANOFLANN_DIR}"
  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${CMAKE_COMMAND}" --build "${WORK}/build" COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${WORK}/build/consumer" COMMAND_ERROR_IS_FATAL ANY)

if(NOT FROM STREQUAL "find_package")
  execute_process(COMMAND "${CMAKE_COMMAND}" --install "${WORK}/build" --prefix "${WORK}/installed"
    OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  file(GLOB_RECURSE installed "${WORK}/installed/*")
  if(installed)
    message(FATAL_ERROR "gravel installs its files with another project: ${installed}")
  endif()
endif()
