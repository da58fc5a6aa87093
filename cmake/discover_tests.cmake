cmake_minimum_required(VERSION 3.25)
# After a test program is linked: writes what CTest is to run, a test for each of its cases.
#   cmake -D PROGRAM=... -D NAME=mesh -D OUTPUT=... -D PROPERTIES=... -P discover_tests.cmake
# Cases of the suite "slow" get the label slow, the others the label quick.

function(list_cases variable)
  execute_process(COMMAND ${PROGRAM} --list-test-cases ${ARGN}
    OUTPUT_VARIABLE text RESULT_VARIABLE code ERROR_VARIABLE text)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${PROGRAM} cannot list its test cases: ${code}\n${text}")
  endif()
  string(REGEX REPLACE "(^|\n)(.doctest.[^\n]*|=====*)" "" text "${text}") # its own words
  if(text MATCHES "[];[]")
    message(FATAL_ERROR "${PROGRAM}: a test case has ; or [ ] in its name, which CMake's lists cannot hold:\n${text}")
  endif()
  string(REPLACE "\n" ";" lines "${text}")
  list(REMOVE_ITEM lines "")
  set(${variable} "${lines}" PARENT_SCOPE)
endfunction()

list_cases(cases)
list_cases(slow --test-suite=slow)
if(NOT cases)
  message(FATAL_ERROR "${PROGRAM} has no test case")
endif()
set(unique ${cases})
list(REMOVE_DUPLICATES unique)
list(LENGTH cases number)
list(LENGTH unique different)
if(NOT number EQUAL different)
  message(FATAL_ERROR "${PROGRAM}: two test cases have the same name")
endif()
set(script "")
foreach(case IN LISTS cases)
  set(label quick)
  if(case IN_LIST slow)
    set(label slow)
  endif()
  string(REPLACE "," "\\," filter "${case}") # a comma would begin a second filter
  string(APPEND script "add_test([==[${NAME}: ${case}]==] [==[${PROGRAM}]==] [==[--test-case=${filter}]==])\n"
    "set_tests_properties([==[${NAME}: ${case}]==] PROPERTIES LABELS \"${label};unit\" SKIP_RETURN_CODE 77 ${PROPERTIES})\n")
endforeach()
file(WRITE ${OUTPUT} "${script}")
