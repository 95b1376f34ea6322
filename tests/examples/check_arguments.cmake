# cmake -DPROGRAM=... -DARGUMENTS=... -DEXPECTED=... -DFOLDER=... -P check_arguments.cmake
#
# A program must end with 2, say what EXPECTED matches, and do nothing else.
cmake_minimum_required(VERSION 3.25)
separate_arguments(ARGUMENTS)
file(REMOVE_RECURSE "${FOLDER}")
file(MAKE_DIRECTORY "${FOLDER}")
execute_process(COMMAND "${PROGRAM}" ${ARGUMENTS} WORKING_DIRECTORY "${FOLDER}"
  RESULT_VARIABLE status OUTPUT_VARIABLE printed ERROR_VARIABLE said)
file(GLOB written "${FOLDER}/*")
if(NOT status EQUAL 2 OR NOT said MATCHES "${EXPECTED}" OR NOT "${printed}${written}" STREQUAL "")
  message(FATAL_ERROR "${PROGRAM} ${ARGUMENTS} ended with ${status}, wrote \"${written}\" and said ${printed}${said}")
endif()
