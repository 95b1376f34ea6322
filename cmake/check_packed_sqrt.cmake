# cmake -DCOMPILER=<c++> -DOBJDUMP=<objdump> -DINCLUDES=<folder|folder> -DSOURCE=<file> -DOBJECT=<file> -P check_packed_sqrt.cmake
#
# Compiles with -O2 and nothing else that could change code, and requires packed square roots of both
# precisions in the machine code of x86-64: sqrtpd for double, sqrtps or rsqrtps for float.
cmake_minimum_required(VERSION 3.25)

set(command "${COMPILER}" -std=c++20 -O2 -c "${SOURCE}" -o "${OBJECT}")
string(REGEX MATCHALL "[^|]+" includes "${INCLUDES}")
list(REMOVE_ITEM includes /usr/include)  # -isystem would put it before the standard library's own headers
foreach(include IN LISTS includes)
  list(APPEND command -isystem "${include}")
endforeach()
execute_process(COMMAND ${command} RESULT_VARIABLE result ERROR_VARIABLE output)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${SOURCE} does not compile:\n${output}")
endif()
execute_process(COMMAND "${OBJDUMP}" -d "${OBJECT}"
  OUTPUT_VARIABLE code COMMAND_ERROR_IS_FATAL ANY)

foreach(root IN ITEMS sqrtpd "r?sqrtps")
  string(REGEX MATCHALL "[ \t]v?${root}[ \t]" found "${code}")
  list(LENGTH found count)
  if(count EQUAL 0)
    message(SEND_ERROR "no packed square root (${root}) in the code of ${SOURCE} with ${COMPILER} -O2")
  else()
    message(STATUS "${COMPILER} -O2: ${count} packed square roots ${root}")
  endif()
endforeach()
