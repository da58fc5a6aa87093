# What the program is made of, from the system's packages (setup.sh names them). What only a module needs is
# searched for where that module is: where it is missing, the module is left out.
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenMP COMPONENTS CXX)
find_package(Threads REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_library(AMONTONS_XXHASH xxhash REQUIRED)
find_library(AMONTONS_METIS metis REQUIRED)
find_library(AMONTONS_ZLIB z REQUIRED)
find_library(AMONTONS_AMD amd REQUIRED)

# amontons_file_of(library variable): what a shared library is called when a program opens it.
function(amontons_file_of library variable)
  execute_process(COMMAND ${CMAKE_READELF} -d ${library} OUTPUT_VARIABLE dynamic COMMAND_ERROR_IS_FATAL ANY)
  if(NOT dynamic MATCHES "SONAME[^\n]*\\[([^]]+)\\]")
    message(FATAL_ERROR "${library} is no shared library")
  endif()
  set(${variable} ${CMAKE_MATCH_1} PARENT_SCOPE)
endfunction()

# CHOLMOD is opened with its BLAS when the first factor is made (solver/linear/cholmod_api.hpp): what it is called then.
find_path(AMONTONS_CHOLMOD_INCLUDE cholmod.h PATH_SUFFIXES suitesparse REQUIRED)
find_library(AMONTONS_CHOLMOD cholmod REQUIRED)
amontons_file_of(${AMONTONS_CHOLMOD} AMONTONS_CHOLMOD_FILE)
