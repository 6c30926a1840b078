# LCM from Debian brings no CMake files, and its lcm.pc asks for glib's headers, which its own do not need: find header
# and library here and generate the types with rules of our own.
find_path(LCM_INCLUDE_DIR lcm/lcm.h REQUIRED)
find_library(LCM_LIBRARY lcm REQUIRED)
find_program(LCM_GEN lcm-gen REQUIRED)
if(NOT TARGET dlod_lcm)
  add_library(dlod_lcm INTERFACE)
  target_include_directories(dlod_lcm SYSTEM INTERFACE ${LCM_INCLUDE_DIR})
  target_link_libraries(dlod_lcm INTERFACE ${LCM_LIBRARY})
endif()

# dlod_add_lcm_types(TARGET PACKAGE name TYPES files...): an interface library of generated C++ headers
# <PACKAGE/TYPE.hpp>; a file is named PACKAGE_TYPE.lcm after the one type in it.
function(dlod_add_lcm_types target)
  cmake_parse_arguments(ARG "" "PACKAGE" "TYPES" ${ARGN})
  set(include_dir ${CMAKE_CURRENT_BINARY_DIR}/include)
  set(headers)
  foreach(file ${ARG_TYPES})
    get_filename_component(type ${file} NAME_WE)
    string(REGEX REPLACE "^${ARG_PACKAGE}_" "" type ${type})
    list(APPEND headers ${include_dir}/${ARG_PACKAGE}/${type}.hpp)
  endforeach()
  add_custom_command(OUTPUT ${headers}
                     COMMAND ${LCM_GEN} -x --cpp-std c++11 --cpp-hpath ${include_dir} ${ARG_TYPES}
                     DEPENDS ${ARG_TYPES} COMMENT "Generating C++ of the LCM types" VERBATIM)
  add_custom_target(${target}_generate DEPENDS ${headers})
  add_library(${target} INTERFACE)
  add_dependencies(${target} ${target}_generate)
  target_include_directories(${target} SYSTEM INTERFACE ${include_dir})
  target_link_libraries(${target} INTERFACE dlod_lcm)
endfunction()

# dlod_add_lcm_jar(TARGET OUTPUT jar TYPES files...): classes for lcm-spy; does nothing without a JDK and LCM's jar.
function(dlod_add_lcm_jar target)
  cmake_parse_arguments(ARG "" "OUTPUT" "TYPES" ${ARGN})
  find_program(JAVAC javac)
  find_program(JAR jar)
  find_file(LCM_JAR lcm.jar PATHS /usr/share/java /usr/local/share/java)
  if(NOT JAVAC OR NOT JAR OR NOT LCM_JAR)
    message(STATUS "No JDK or no lcm.jar: the types' jar for lcm-spy is not built")
    return()
  endif()
  set(java_dir ${CMAKE_CURRENT_BINARY_DIR}/java)
  add_custom_command(OUTPUT ${ARG_OUTPUT}
                     COMMAND ${CMAKE_COMMAND} -E rm -rf ${java_dir}
                     COMMAND ${LCM_GEN} -j --jpath ${java_dir}/source ${ARG_TYPES}
                     COMMAND ${CMAKE_COMMAND} -E make_directory ${java_dir}/classes
                     COMMAND sh -c "'${JAVAC}' -nowarn -cp '${LCM_JAR}' -d '${java_dir}/classes' $(find '${java_dir}/source' -name '*.java')"
                     COMMAND ${JAR} cf ${ARG_OUTPUT} -C ${java_dir}/classes .
                     DEPENDS ${ARG_TYPES} COMMENT "Building the jar of the LCM types" VERBATIM)
  add_custom_target(${target} ALL DEPENDS ${ARG_OUTPUT})
endfunction()
