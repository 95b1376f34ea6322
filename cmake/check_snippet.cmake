# cmake -DCOMPILER=<c++> -DINCLUDES=<folder|folder> -DOPTIONS=<options> -DSOURCE=<file> -P check_snippet.cmake
#
# A snippet without an "// error: text" line must compile. One with such a line must compile as it is, and must
# fail with that text, as one message of the compiler, when GRAVEL_WRONG is defined: so it fails for the reason
# it claims, not for a slip elsewhere. Several "// error:" lines are numbered cases, GRAVEL_WRONG=1, 2, ...
cmake_minimum_required(VERSION 3.25)

set(command "${COMPILER}" -std=c++20 ${OPTIONS} -Wall -Wextra -Werror -fsyntax-only)
string(REGEX MATCHALL "[^|]+" includes "${INCLUDES}")
list(REMOVE_ITEM includes /usr/include)  # -isystem would put it before the standard library's own headers
foreach(include IN LISTS includes)
  list(APPEND command -isystem "${include}")
endforeach()

execute_process(COMMAND ${command} "${SOURCE}" RESULT_VARIABLE result ERROR_VARIABLE output)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${SOURCE} must compile:\n${output}")
endif()

file(STRINGS "${SOURCE}" expectations REGEX "^// error: ")
set(case 0)
foreach(expectation IN LISTS expectations)
  math(EXPR case "${case} + 1")
  string(REGEX REPLACE "^// error: " "" expectation "${expectation}")
  execute_process(COMMAND ${command} -DGRAVEL_WRONG=${case} "${SOURCE}"
    RESULT_VARIABLE result ERROR_VARIABLE output)
  if(result EQUAL 0)
    message(SEND_ERROR "${SOURCE} compiles with GRAVEL_WRONG=${case}, expected: ${expectation}")
    continue()
  endif()
  # Only lines that say "error:" count, not the source line that the compiler shows below.
  string(REPLACE ";" "," output "${output}")
  string(REGEX MATCHALL "[^\n]*error:[^\n]*" errors "${output}")
  set(found FALSE)
  foreach(error IN LISTS errors)
    string(FIND "${error}" "${expectation}" position)
    if(NOT position EQUAL -1)
      set(found TRUE)
    endif()
  endforeach()
  if(NOT found)
    message(SEND_ERROR "${SOURCE}, GRAVEL_WRONG=${case}: no error says \"${expectation}\":\n${output}")
  endif()
endforeach()
