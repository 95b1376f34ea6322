# For checks of what runs of small scenes print: include() it, with RUNNER and FOLDER set.

# Runs the scene of that text in FOLDER, without a picture. Sets `words` to its summary.
function(run_scene name text)
  file(WRITE "${FOLDER}/${name}.toml" "${text}")
  execute_process(COMMAND "${RUNNER}" "${FOLDER}/${name}.toml" -q --no-picture -o "${FOLDER}/${name}"
    RESULT_VARIABLE status OUTPUT_VARIABLE printed ERROR_VARIABLE printed)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${name}: gravel-run ended with ${status}: ${printed}")
  endif()
  file(READ "${FOLDER}/${name}/summary.txt" text_of_summary)
  set(words "${text_of_summary}" PARENT_SCOPE)
endfunction()

# The entry of a column in the last row of that run's table.
function(last_value variable name column)
  file(STRINGS "${FOLDER}/${name}/diagnostics.csv" rows)
  list(GET rows 0 names)
  list(GET rows -1 row)
  string(REPLACE "," ";" names "${names}")
  string(REPLACE "," ";" row "${row}")
  list(FIND names "${column}" place)
  list(GET row ${place} found)
  set(${variable} "${found}" PARENT_SCOPE)
endfunction()
