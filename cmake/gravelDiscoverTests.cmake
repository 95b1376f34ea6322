# gravel_discover_tests(target LABEL <label> ENVIRONMENT <NAME=value ...>)
#
# Makes every test case of a Catch2 program an entry of ctest, "<label>/<test case>", found by asking the program when
# it has been built. Catch2's own catch_discover_tests breaks on names with a semicolon or an unpaired bracket (in
# version 2), which are plain English and mathematics. An entry that asserts nothing, or finds no test, fails.
#
# The same file is the script that does the asking:
# cmake -DEXECUTABLE=... -DLABEL=... -DENVIRONMENT=<NAME=value|...> -DCATCH_VERSION=... -DOUTPUT=... -P <this file>
cmake_minimum_required(VERSION 3.25)

function(gravel_discover_tests target)
  cmake_parse_arguments(PARSE_ARGV 1 argument "" LABEL "ENVIRONMENT")
  list(JOIN argument_ENVIRONMENT "|" environment)
  set(listing "${CMAKE_CURRENT_BINARY_DIR}/${target}_cases.cmake")
  set(script "${CMAKE_CURRENT_FUNCTION_LIST_FILE}")
  add_custom_command(TARGET ${target} POST_BUILD
    COMMAND "${CMAKE_COMMAND}" "-DEXECUTABLE=$<TARGET_FILE:${target}>" "-DLABEL=${argument_LABEL}"
            "-DENVIRONMENT=${environment}" "-DCATCH_VERSION=${Catch2_VERSION}" "-DOUTPUT=${listing}" -P "${script}"
    BYPRODUCTS "${listing}" VERBATIM)
  # A program that was not built is one failed test, not none.
  set(entry "${CMAKE_CURRENT_BINARY_DIR}/${target}_entry.cmake")
  file(WRITE "${entry}" "if(EXISTS [==[${listing}]==])\n  include([==[${listing}]==])\nelse()\n"
    "  add_test([==[${argument_LABEL}: ${target} is not built]==] ${target}_NOT_BUILT)\nendif()\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES "${entry}")
endfunction()

if(NOT CMAKE_SCRIPT_MODE_FILE STREQUAL CMAKE_CURRENT_LIST_FILE)
  return()
endif()

string(REPLACE "|" ";" environment "${ENVIRONMENT}")
if(CATCH_VERSION VERSION_LESS 3)
  set(list_arguments --list-test-names-only)
  set(arguments --warn NoTests)  # it takes only one --warn; no assertions show by what is printed
else()
  set(list_arguments --list-tests --verbosity quiet)
  set(arguments --warn NoAssertions)
endif()
execute_process(COMMAND "${CMAKE_COMMAND}" -E env ${environment} "${EXECUTABLE}" ${list_arguments}
  OUTPUT_VARIABLE names ERROR_VARIABLE errors RESULT_VARIABLE result)
# Catch2 2 returns how many tests there are.
if(NOT result MATCHES "^[0-9]+$" OR (CATCH_VERSION VERSION_GREATER_EQUAL 3 AND NOT result EQUAL 0))
  message(FATAL_ERROR "${EXECUTABLE} ${list_arguments} ended with ${result}:\n${names}${errors}")
endif()

# Brackets and semicolons would join and split the lines of a list: other characters stand for them meanwhile.
string(ASCII 1 open)
string(ASCII 2 close)
string(ASCII 3 semicolon)
string(REPLACE "[" "${open}" names "${names}")
string(REPLACE "]" "${close}" names "${names}")
string(REPLACE ";" "${semicolon}" names "${names}")
string(REPLACE "\n" ";" names "${names}")

macro(as_it_was text)
  string(REPLACE "${open}" "[" ${text} "${${text}}")
  string(REPLACE "${close}" "]" ${text} "${${text}}")
  string(REPLACE "${semicolon}" ";" ${text} "${${text}}")
endmacro()

set(launcher "")
foreach(setting IN LISTS environment)
  string(APPEND launcher " [==[${setting}]==]")
endforeach()
if(launcher)
  set(launcher "[==[${CMAKE_COMMAND}]==] -E env${launcher} ")
endif()
list(JOIN arguments " " arguments)
set(text "")
foreach(name IN LISTS names)
  string(STRIP "${name}" name)
  if(name STREQUAL "")
    continue()
  endif()
  # What Catch2 would read as a pattern, a tag, a list or an exclusion.
  string(REGEX REPLACE "([,*\"\\${open}${close}])" "\\\\\\1" pattern "${name}")
  string(REGEX REPLACE "^~" "\\\\~" pattern "${pattern}")
  as_it_was(name)
  as_it_was(pattern)
  string(APPEND text
    "add_test([==[${LABEL}/${name}]==] ${launcher}[==[${EXECUTABLE}]==] [==[${pattern}]==] ${arguments})\n"
    "set_tests_properties([==[${LABEL}/${name}]==] PROPERTIES LABELS ${LABEL} TIMEOUT 600\n"
    "  FAIL_REGULAR_EXPRESSION [==[assertions: - none -]==])\n")
endforeach()
if(text STREQUAL "")
  message(FATAL_ERROR "${EXECUTABLE} has no tests")
endif()
file(WRITE "${OUTPUT}" "${text}")
