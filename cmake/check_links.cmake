# cmake -DROOT=<source folder> -P check_links.cmake
#
# Every relative link in every Markdown file of the repository must name a file or folder that exists.
# Links into the web and inside a page are not looked at; text in code blocks and code spans is not a link.
cmake_minimum_required(VERSION 3.25)

set(faults "")
string(ASCII 7 mark)
set(links 0)
file(GLOB pages RELATIVE "${ROOT}" "${ROOT}/*.md")
foreach(folder IN ITEMS docs examples tests benchmarks include cmake)
  file(GLOB_RECURSE more RELATIVE "${ROOT}" "${ROOT}/${folder}/*.md")
  list(APPEND pages ${more})
endforeach()

foreach(page IN LISTS pages)
  file(READ "${ROOT}/${page}" text)
  # Brackets and semicolons have a meaning in CMake's lists; only `](target` matters here.
  string(REGEX REPLACE ";" "," text "${text}")
  string(REPLACE "](" "${mark}" text "${text}")
  string(REGEX REPLACE "[][]" " " text "${text}")
  string(REGEX REPLACE "(^|\n)```[^`]*```" "\n" text "${text}")
  string(REGEX REPLACE "`[^`\n]*`" "" text "${text}")
  string(REGEX MATCHALL "${mark}[^) \n]+" targets "${text}")
  cmake_path(GET page PARENT_PATH folder)
  foreach(target IN LISTS targets)
    string(SUBSTRING "${target}" 1 -1 target)
    string(REGEX REPLACE "[?#].*$" "" target "${target}")
    if(target STREQUAL "" OR target MATCHES "^[a-z]+:")
      continue()
    endif()
    math(EXPR links "${links} + 1")
    if(NOT EXISTS "${ROOT}/${folder}/${target}")
      list(APPEND faults "${page}: ${target}")
    endif()
  endforeach()
endforeach()

list(LENGTH pages count)
if(faults)
  list(JOIN faults "\n  " faults)
  message(FATAL_ERROR "links to what does not exist:\n  ${faults}")
endif()
message(STATUS "${links} relative links in ${count} pages are good")
