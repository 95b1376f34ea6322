# Used twice: by the build of gravel and by the installed gravelConfig.cmake.

# Finds Eigen, nanoflann and OpenMP, and sets ${result} to what is missing in words, or to nothing.
# A target that exists already (a parent project brought its own Eigen) is taken as it is.
# Eigen's version is compared here, as a version range in find_package is refused by Eigen 3.4.0's own
# version file, and Eigen 5 by a plain request for 3.4.
macro(gravel_find_dependencies result)
  set(${result} "")
  if(NOT TARGET Eigen3::Eigen)
    find_package(Eigen3 CONFIG QUIET)
    if(NOT TARGET Eigen3::Eigen)
      string(APPEND ${result} "Eigen 3.4 or newer was not found (Debian, Ubuntu: libeigen3-dev). ")
    elseif(Eigen3_VERSION VERSION_LESS 3.4)
      string(APPEND ${result} "Eigen ${Eigen3_VERSION} in ${Eigen3_DIR} is too old, 3.4 or newer is needed. ")
    endif()
  endif()
  if(NOT TARGET nanoflann::nanoflann)
    find_package(nanoflann CONFIG QUIET)
    if(NOT TARGET nanoflann::nanoflann)
      string(APPEND ${result} "nanoflann 1.4 or newer was not found (Debian, Ubuntu: libnanoflann-dev). ")
    elseif(nanoflann_VERSION VERSION_LESS 1.4)
      string(APPEND ${result}
             "nanoflann ${nanoflann_VERSION} in ${nanoflann_DIR} is too old, 1.4 or newer is needed. ")
    endif()
  endif()
  if(NOT TARGET OpenMP::OpenMP_CXX)
    find_package(OpenMP QUIET COMPONENTS CXX)
    if(NOT TARGET OpenMP::OpenMP_CXX)
      string(APPEND ${result}
             "OpenMP does not work with ${CMAKE_CXX_COMPILER} (Debian, Ubuntu: libomp-dev for clang). ")
    endif()
  endif()
endmacro()
