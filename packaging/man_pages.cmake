# Manual pages from the programs' own help texts and the documented configuration, so that they cannot differ.
find_program(HELP2MAN help2man)
if(NOT HELP2MAN OR CMAKE_CROSSCOMPILING)
  message(STATUS "No help2man, or cross-compiling: no manual pages")
  return()
endif()

set(man_dir ${CMAKE_CURRENT_BINARY_DIR}/man)
set(man_pages)
# dlod_add_man_page(PAGE PROGRAM SUMMARY INCLUDE [SUBCOMMAND]): PAGE.1; PROGRAM is a target or a script.
function(dlod_add_man_page page program summary include)
  set(source ${program})
  if(TARGET ${program})
    set(source $<TARGET_FILE:${program}>)
  endif()
  set(help "${ARGN} --help")
  string(STRIP "${help}" help)
  add_custom_command(
    OUTPUT ${man_dir}/${page}.1
    COMMAND ${HELP2MAN} --no-info --help-option=${help} --version-string=${PROJECT_VERSION} --name=${summary}
            --include=${CMAKE_CURRENT_SOURCE_DIR}/man/${include}.h2m --output=${man_dir}/${page}.1 ${source}
    # The build folder is none of the reader's business, and a subcommand's page has a name of its own.
    COMMAND sed -i -e "s/^\\.TH [^ ]*/.TH ${page}/" -e "s/^dlod \\\\-/${page} \\\\-/" -e "s|[^ ]*/\\(dlod-[a-z]*\\)|\\1|" ${man_dir}/${page}.1
    DEPENDS ${program} ${CMAKE_CURRENT_SOURCE_DIR}/man/${include}.h2m COMMENT "Manual page ${page}(1)" VERBATIM)
  set(man_pages ${man_pages} ${man_dir}/${page}.1 PARENT_SCOPE)
endfunction()

file(MAKE_DIRECTORY ${man_dir})
dlod_add_man_page(dlod dlod "dynamic LiDAR odometry daemon" dlod)
foreach(command run replay command doctor info check-config print-config)
  dlod_add_man_page(dlod-${command} dlod "dynamic LiDAR odometry: ${command}" see_also ${command})
endforeach()
if(DLOD_BUILD_TOOLS)
  dlod_add_man_page(dlod-sim dlod-sim "simulate drives with an Ouster lidar" see_also)
  dlod_add_man_page(dlod-eval dlod-eval "score a replay of dlod against truth" see_also)
  dlod_add_man_page(dlod-draw dlod-draw "draw a replay of dlod" see_also)
  dlod_add_man_page(dlod-listen dlod-listen "count LCM messages by channel" see_also)
endif()
dlod_add_man_page(dlod-spy ${PROJECT_SOURCE_DIR}/tools/lcm-spy.sh "watch dlod's messages with lcm-spy" see_also)

configure_file(man/dlod.yaml.5.in ${man_dir}/dlod.yaml.5.head @ONLY)
set(config ${PROJECT_SOURCE_DIR}/config/dlod.yaml)
set(generator ${CMAKE_CURRENT_SOURCE_DIR}/man/config_to_man.awk)
add_custom_command(
  OUTPUT ${man_dir}/dlod.yaml.5
  COMMAND awk -f ${generator} ${config} > ${man_dir}/dlod.yaml.5.keys
  COMMAND cat ${man_dir}/dlod.yaml.5.head ${man_dir}/dlod.yaml.5.keys ${CMAKE_CURRENT_SOURCE_DIR}/man/dlod.yaml.5.end
          > ${man_dir}/dlod.yaml.5
  DEPENDS ${config} ${generator} man/dlod.yaml.5.end COMMENT "Manual page dlod.yaml(5)" VERBATIM)

add_custom_target(man_pages ALL DEPENDS ${man_pages} ${man_dir}/dlod.yaml.5)
install(FILES ${man_pages} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES ${man_dir}/dlod.yaml.5 DESTINATION ${CMAKE_INSTALL_MANDIR}/man5)
