# What only gravel's own tests, examples and benchmarks use. Nothing here is installed or reaches a user.

add_library(gravel_warnings INTERFACE)
target_compile_options(gravel_warnings INTERFACE
  $<$<CXX_COMPILER_ID:GNU,Clang,AppleClang>:-Wall;-Wextra;-Wpedantic;-Wshadow;-Wconversion>
  # The presets make warnings errors; another compiler's new ones shall not stop who builds without. g++ 12 takes the
  # undefined sources in its own AVX-512 header, temporaries inside an expression of AutoDiffScalar, and sums of texts
  # at -O3 for faults of the including code.
  $<$<CXX_COMPILER_ID:GNU>:-Wno-error=uninitialized;-Wno-error=maybe-uninitialized;-Wno-error=dangling-pointer>
  $<$<CXX_COMPILER_ID:GNU>:-Wno-error=restrict>)

# gravel_own = the library + warnings + the sanitizers asked for.
add_library(gravel_own INTERFACE)
target_link_libraries(gravel_own INTERFACE gravel::gravel gravel_warnings)

# ctest runs as many programs as there are processors: threads that wait must not spin.
set(gravel_test_environment "OMP_WAIT_POLICY=passive")
if(GRAVEL_SANITIZE)
  foreach(sanitizer IN LISTS GRAVEL_SANITIZE)
    if(NOT sanitizer MATCHES "^(address|undefined|leak|thread)$")
      message(FATAL_ERROR "gravel: GRAVEL_SANITIZE holds \"${sanitizer}\"; "
                          "allowed are address;undefined (and leak), or thread alone")
    endif()
  endforeach()
  list(JOIN GRAVEL_SANITIZE "," gravel_sanitizers)
  set(gravel_sanitizer_flags "-fsanitize=${gravel_sanitizers}" -fno-omit-frame-pointer)
  if("undefined" IN_LIST GRAVEL_SANITIZE)
    list(APPEND gravel_sanitizer_flags -fno-sanitize-recover=all)
    # Sums of pointers that overflow take 15 % of the compile time, accesses beyond what the optimiser knows of an object
    # a further fifth (a Space with clang 14 -O1: 204 and 166 s): the address sanitizer sees what is read there.
    if("address" IN_LIST GRAVEL_SANITIZE)
      list(APPEND gravel_sanitizer_flags -fno-sanitize=pointer-overflow,object-size)
    endif()
  endif()
  target_compile_options(gravel_own INTERFACE ${gravel_sanitizer_flags})
  target_link_options(gravel_own INTERFACE ${gravel_sanitizer_flags})
  if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    # Builds under sanitizers are not for speed: clang's optimiser of OpenMP takes two fifths of their compile
    # time (a Space with clang 14 -O2: 148 s with it, 86 s without).
    target_compile_options(gravel_own INTERFACE "SHELL:-mllvm -openmp-opt-disable")
  endif()
  if("address" IN_LIST GRAVEL_SANITIZE)
    list(APPEND gravel_test_environment "ASAN_OPTIONS=detect_stack_use_after_return=1:strict_init_order=1:handle_sigill=1")
    list(APPEND gravel_test_environment "UBSAN_OPTIONS=print_stacktrace=1")
    # LLVM's OpenMP loses a block when the number of threads changes; a program without gravel shows the same.
    list(APPEND gravel_test_environment
      "LSAN_OPTIONS=suppressions=${CMAKE_CURRENT_LIST_DIR}/leaks_elsewhere.txt:print_suppressions=0")
  endif()
endif()

if("thread" IN_LIST GRAVEL_SANITIZE)
  # The thread sanitizer sees OpenMP's own synchronisation only through the tool archer, a part of LLVM's
  # OpenMP. Without it every barrier would look like a data race.
  if(NOT GRAVEL_SANITIZE STREQUAL "thread")
    message(FATAL_ERROR "gravel: GRAVEL_SANITIZE=${GRAVEL_SANITIZE}: thread goes with no other sanitizer")
  endif()
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    message(FATAL_ERROR "gravel: GRAVEL_SANITIZE=thread needs clang with LLVM's OpenMP, "
                        "not ${CMAKE_CXX_COMPILER_ID} (GCC's OpenMP is not known to its thread sanitizer)")
  endif()
  execute_process(COMMAND "${CMAKE_CXX_COMPILER}" -print-file-name=libarcher.so
    OUTPUT_VARIABLE gravel_archer_found OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT IS_ABSOLUTE "${gravel_archer_found}")
    cmake_path(GET OpenMP_omp_LIBRARY PARENT_PATH gravel_omp_dir)
    set(gravel_archer_found "${gravel_omp_dir}/libarcher.so")
  endif()
  if(NOT EXISTS "${gravel_archer_found}")
    message(FATAL_ERROR "gravel: GRAVEL_SANITIZE=thread needs the OpenMP tool libarcher.so of "
                        "${CMAKE_CXX_COMPILER} (Debian, Ubuntu: libomp-dev)")
  endif()
  cmake_path(NORMAL_PATH gravel_archer_found OUTPUT_VARIABLE gravel_archer)
  list(APPEND gravel_test_environment
    "OMP_TOOL_LIBRARIES=${gravel_archer}"
    "TSAN_OPTIONS=ignore_noninstrumented_modules=1:halt_on_error=1:history_size=4"
    "OMP_NUM_THREADS=4")
endif()
