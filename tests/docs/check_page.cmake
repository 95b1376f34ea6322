# cmake -DCOMPILER=<c++> -DINCLUDES=<folder|folder> -DOPTIONS=<options> -DPAGE=<file.md> -DWORK=<folder>
#       "-DSPACE=<object files>" -P check_page.cmake
#
# Compiles the C++ of a Markdown page, so that what a reader copies works. A ```cpp block with `int main` is a
# program: it is built and run, and must print what the next ```text block of the page shows, if one follows before
# the next ```cpp block. Any other ```cpp block is part of a function's body, in which `config` and `space` exist;
# those of a page are compiled together. A page without a ```cpp block fails: then nothing was checked. The code of
# Space<double> comes from SPACE, as each page would take a minute to compile it once more; that declaration
# stands behind the page's own code, which so has to include all that it needs.
cmake_minimum_required(VERSION 3.25)

file(REMOVE_RECURSE "${WORK}")
file(MAKE_DIRECTORY "${WORK}")
separate_arguments(options UNIX_COMMAND "${OPTIONS}")
set(compile "${COMPILER}" -std=c++20 ${options} -Wall -Wextra -Wno-unused -Werror)
string(REGEX MATCHALL "[^|]+" includes "${INCLUDES}")
list(REMOVE_ITEM includes /usr/include)  # -isystem would put it before the standard library's own headers
foreach(include IN LISTS includes)
  list(APPEND compile -isystem "${include}")
endforeach()

set(spaces "\nnamespace gravel {\nextern template class Space<double, SoA>;\n}\n")

# Sets ${block} to the first block of `language` in ${text}, ${before} and ${after} to what stands around it.
macro(next_block language text)
  set(found FALSE)
  string(FIND "${${text}}" "```${language}\n" begin)
  if(NOT begin EQUAL -1)
    string(SUBSTRING "${${text}}" 0 ${begin} before)
    string(LENGTH "```${language}\n" fence)
    math(EXPR begin "${begin} + ${fence}")
    string(SUBSTRING "${${text}}" ${begin} -1 rest_of_page)
    string(FIND "${rest_of_page}" "```" end)
    string(SUBSTRING "${rest_of_page}" 0 ${end} block)
    math(EXPR end "${end} + 3")
    string(SUBSTRING "${rest_of_page}" ${end} -1 after)
    set(found TRUE)
  endif()
endmacro()

file(READ "${PAGE}" page)
set(fragments "#include <gravel/gravel.hpp>\n#include <cstdio>\n#include <string>\n#include <vector>\n")
set(fragment_count 0)
set(program_count 0)
while(TRUE)
  next_block(cpp page)
  if(NOT found)
    break()
  endif()
  set(code "${block}")
  set(page "${after}")
  if(NOT code MATCHES "int main\\(")
    math(EXPR fragment_count "${fragment_count} + 1")
    string(APPEND fragments
      "void fragment${fragment_count}(gravel::SimulationConfig<double>& config, gravel::Space<double>& space) {\n"
      "(void)config, (void)space;\n${code}}\n")
    continue()
  endif()

  math(EXPR program_count "${program_count} + 1")
  set(program "${WORK}/program${program_count}")
  set(objects "")
  if(code MATCHES "#include <gravel/gravel.hpp>")
    string(APPEND code "${spaces}")
    set(objects ${SPACE})
  endif()
  file(WRITE "${program}.cpp" "${code}")
  execute_process(COMMAND ${compile} "${program}.cpp" ${objects} -o "${program}" RESULT_VARIABLE result ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${PAGE}: program ${program_count} does not compile:\n${output}")
  endif()
  execute_process(COMMAND "${program}" WORKING_DIRECTORY "${WORK}"
    RESULT_VARIABLE result OUTPUT_VARIABLE printed ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${PAGE}: program ${program_count} ends with ${result}:\n${printed}${output}")
  endif()
  set(expected "${printed}")
  set(tail "${page}")
  next_block(text tail)
  if(found AND NOT before MATCHES "```cpp\n")
    set(expected "${block}")
  endif()
  if(NOT printed STREQUAL expected)
    message(FATAL_ERROR "${PAGE}: program ${program_count} prints\n${printed}but the page shows\n${expected}")
  endif()
endwhile()

if(fragment_count GREATER 0)
  file(WRITE "${WORK}/fragments.cpp" "${fragments}${spaces}")
  execute_process(COMMAND ${compile} -fsyntax-only "${WORK}/fragments.cpp" RESULT_VARIABLE result ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${PAGE}: a fragment does not compile (in ${WORK}/fragments.cpp):\n${output}")
  endif()
endif()
math(EXPR count "${program_count} + ${fragment_count}")
if(count EQUAL 0)
  message(FATAL_ERROR "${PAGE} has no ```cpp block")
endif()
message(STATUS "${PAGE}: ${program_count} programs ran, ${fragment_count} fragments compile")
