# dlod_add_library(NAME SOURCES files... LINK libs... PCH headers...): a static library, with these headers precompiled.
function(dlod_add_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK;PCH" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC dlod_options ${ARG_LINK})
  if(ARG_PCH)
    target_precompile_headers(${name} PRIVATE ${ARG_PCH})
  endif()
endfunction()

# dlod_add_test_folder(FOLDER LINK libs...): one test program of all FOLDER/*.cpp, registered with CTest test by test as
# FOLDER/TEST with underscores in FOLDER. The target tests_TOP builds those of all folders under TOP.
function(dlod_add_test_folder folder)
  cmake_parse_arguments(ARG "" "" "LINK" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.cpp)
  if(NOT sources)
    return()
  endif()
  string(REPLACE "/" "_" name ${folder})
  add_executable(test_${name} ${sources})
  target_link_libraries(test_${name} PRIVATE ${ARG_LINK} dlod_test_main)
  # The tests' own code compiles a quarter faster so; what they test is optimised in full.
  target_compile_options(test_${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  # The first program's precompiled headers serve all: that one has no definitions that others lack.
  get_property(precompiled GLOBAL PROPERTY dlod_test_precompiled)
  if(precompiled)
    target_precompile_headers(test_${name} REUSE_FROM ${precompiled})
  else()
    target_precompile_headers(test_${name} PRIVATE <gtest/gtest.h> <Eigen/Dense> <Eigen/Geometry> <algorithm> <array>
                              <chrono> <cmath> <filesystem> <fstream> <functional> <map> <memory> <random> <string> <vector>)
    set_property(GLOBAL PROPERTY dlod_test_precompiled test_${name})
  endif()
  string(REGEX MATCH "^[^/]+" top ${folder})
  if(NOT TARGET tests_${top})
    add_custom_target(tests_${top})
  endif()
  add_dependencies(tests_${top} test_${name})
  gtest_discover_tests(test_${name} TEST_PREFIX "${name}/" WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
                       DISCOVERY_TIMEOUT 120 PROPERTIES TIMEOUT 300)
endfunction()
