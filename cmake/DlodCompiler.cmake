# Compiler settings that every target of the project shares.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

find_program(DLOD_CCACHE ccache)
if(DLOD_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # The sloppiness lets ccache work with precompiled headers.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${DLOD_CCACHE})
endif()

add_library(dlod_options INTERFACE)
target_include_directories(dlod_options INTERFACE ${PROJECT_SOURCE_DIR})
# No contraction: the vectorised clones of a kernel give the same bits as its plain form (core/types/multiversion.hpp).
target_compile_options(dlod_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -ffp-contract=off
                                              -fno-math-errno -fno-trapping-math)
# Plain -O3 in Release; asserts are for debug builds.
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")
if(DLOD_WERROR)
  target_compile_options(dlod_options INTERFACE -Werror)
endif()
if(DLOD_SANITIZE)
  target_compile_options(dlod_options INTERFACE -fsanitize=${DLOD_SANITIZE} -fno-omit-frame-pointer -g
                                                -fno-sanitize-recover=all)
  target_link_options(dlod_options INTERFACE -fsanitize=${DLOD_SANITIZE})
  target_compile_definitions(dlod_options INTERFACE DLOD_SANITIZED=1)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND DLOD_SANITIZE)
  # GCC 12 gives false maybe-uninitialized reports in instrumented code.
  target_compile_options(dlod_options INTERFACE -Wno-maybe-uninitialized)
  if(DLOD_SANITIZE MATCHES "undefined")
    # Its check of the object's type spoils calls by pointers to members, of which LCM's subscriptions are made.
    target_compile_options(dlod_options INTERFACE -fno-sanitize=vptr)
  endif()
endif()
