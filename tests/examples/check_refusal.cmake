# cmake -DRUNNER=... -DSCENE=... -P check_refusal.cmake
#
# gravel-run must end with 2 and say what the first line of the scene expects: "# expect: <regular expression>".
cmake_minimum_required(VERSION 3.25)
file(STRINGS "${SCENE}" expected LIMIT_COUNT 1)
string(REGEX REPLACE "^# expect: " "" expected "${expected}")
execute_process(COMMAND "${RUNNER}" "${SCENE}" --check
  RESULT_VARIABLE status OUTPUT_VARIABLE printed ERROR_VARIABLE printed)
if(NOT status EQUAL 2)
  message(FATAL_ERROR "gravel-run ended with ${status}, not 2: ${printed}")
endif()
if(NOT printed MATCHES "${expected}")
  message(FATAL_ERROR "gravel-run said\n${printed}\nwhich does not match\n${expected}")
endif()
