# Install rules: headers, the CMake package, the pkg-config file, and the runner where one was built. All of it can be
# moved as a whole.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(gravel_cmake_dir "${CMAKE_INSTALL_DATADIR}/cmake/gravel")
set(gravel_pc_dir "${CMAKE_INSTALL_DATADIR}/pkgconfig")

install(TARGETS gravel_headers EXPORT gravelTargets FILE_SET HEADERS DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
install(EXPORT gravelTargets NAMESPACE gravel:: DESTINATION "${gravel_cmake_dir}")

configure_package_config_file(
  "${PROJECT_SOURCE_DIR}/cmake/gravelConfig.cmake.in" "${PROJECT_BINARY_DIR}/gravelConfig.cmake"
  INSTALL_DESTINATION "${gravel_cmake_dir}")
write_basic_package_version_file(
  "${PROJECT_BINARY_DIR}/gravelConfigVersion.cmake"
  VERSION "${PROJECT_VERSION}" COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(
  FILES
    "${PROJECT_BINARY_DIR}/gravelConfig.cmake"
    "${PROJECT_BINARY_DIR}/gravelConfigVersion.cmake"
    "${PROJECT_SOURCE_DIR}/cmake/gravelDependencies.cmake"
  DESTINATION "${gravel_cmake_dir}")

# nanoflann has a .pc file on Debian, but not everywhere; without one its include path is written down.
find_package(PkgConfig QUIET)
set(gravel_pc_requires "eigen3 >= 3.4")
set(gravel_pc_cflags "")
if(PkgConfig_FOUND)
  pkg_check_modules(gravel_nanoflann_pc QUIET nanoflann)
endif()
if(gravel_nanoflann_pc_FOUND)
  string(APPEND gravel_pc_requires ", nanoflann >= 1.4")
else()
  get_target_property(gravel_nanoflann_include nanoflann::nanoflann INTERFACE_INCLUDE_DIRECTORIES)
  foreach(directory IN LISTS gravel_nanoflann_include)
    if(NOT directory MATCHES "\\$<")
      string(APPEND gravel_pc_cflags " -I${directory}")
    endif()
  endforeach()
endif()
cmake_path(RELATIVE_PATH CMAKE_INSTALL_PREFIX
           BASE_DIRECTORY "${CMAKE_INSTALL_PREFIX}/${gravel_pc_dir}" OUTPUT_VARIABLE gravel_pc_prefix)
configure_file("${PROJECT_SOURCE_DIR}/cmake/gravel.pc.in" "${PROJECT_BINARY_DIR}/gravel.pc" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/gravel.pc" DESTINATION "${gravel_pc_dir}")

install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DOCDIR}")

if(TARGET gravel-run)
  install(TARGETS gravel-run RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" OPTIONAL)
endif()
