# cmake --install: a tree that can be moved, for `poise` itself and for users' own code (poise-config.cmake).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(_here ${CMAKE_CURRENT_LIST_DIR})
# Parts of a package (cmake/Package.cmake): poise, dev, python. What names none is of the first.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME poise)

set_target_properties(poise PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
install(TARGETS poise DESTINATION bin)
get_property(_programs GLOBAL PROPERTY POISE_PROGRAMS)
list(REMOVE_ITEM _programs poise first_run)  # poise goes into bin/, and first_run serves a new checkout alone
set_target_properties(${_programs} PROPERTIES INSTALL_RPATH "$ORIGIN/../../../${CMAKE_INSTALL_LIBDIR}")
install(TARGETS ${_programs} DESTINATION lib/poise/bin)
install(TARGETS poise_traits_generator DESTINATION lib/poise/bin COMPONENT dev)
install(TARGETS poise_shared DESTINATION ${CMAKE_INSTALL_LIBDIR})

# A module is told by its headers which Poise it is built against: they must be those of the library.
install(CODE "
  file(STRINGS ${PROJECT_BINARY_DIR}/poise_commit.h header REGEX POISE_COMMIT)
  string(REGEX REPLACE \"^[^\\\"]*\\\"(.*)\\\"$\" \"\\\\1\" commit \"\${header}\")
  execute_process(COMMAND $<TARGET_FILE:poise> --version OUTPUT_VARIABLE version)
  string(FIND \"\${version}\" \"\${commit}\" at)
  if(at EQUAL -1)
    message(FATAL_ERROR \"The build is older than its sources' commit \${commit}: run cmake --build ${PROJECT_BINARY_DIR} first\")
  endif()
" ALL_COMPONENTS)

# Headers as they are included, and the schemas that others' schemas may import.
set(_headers include/poise)
foreach(folder lcmtypes components sim sim_ode sim_mujoco hw_bridge logging)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder} DESTINATION ${_headers} COMPONENT dev
          FILES_MATCHING PATTERN "*.h" PATTERN "*.proto")
  if(NOT folder STREQUAL lcmtypes)
    install(DIRECTORY ${PROJECT_BINARY_DIR}/${folder} DESTINATION ${_headers} COMPONENT dev
            FILES_MATCHING PATTERN "*.pb.h" PATTERN "unitree_hg.h" PATTERN "unitree_api.h" PATTERN "CMakeFiles" EXCLUDE)
  endif()
endforeach()
install(DIRECTORY ${PROJECT_BINARY_DIR}/poise ${PROJECT_BINARY_DIR}/operate ${PROJECT_BINARY_DIR}/steps
        ${PROJECT_BINARY_DIR}/derived DESTINATION ${_headers} COMPONENT dev
        FILES_MATCHING PATTERN "*.hpp")
install(FILES ${PROJECT_BINARY_DIR}/poise_commit.h DESTINATION ${_headers} COMPONENT dev)

foreach(folder scenarios graphs robots sweeps drives bits benchmarks layouts)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/deploy/${folder} DESTINATION share/poise)
endforeach()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/lcmtypes DESTINATION share/poise FILES_MATCHING PATTERN "*.lcm")
# The manual page and completion, of the program's own option tables.
set(_shell ${PROJECT_BINARY_DIR}/shell)
add_custom_command(
  OUTPUT ${_shell}/poise.1.gz ${_shell}/poise.bash ${_shell}/_poise ${_shell}/poise.fish
  COMMAND ${CMAKE_COMMAND} -E make_directory ${_shell}
  COMMAND poise shell man > ${_shell}/poise.1 && gzip -9nf ${_shell}/poise.1
  COMMAND poise shell bash > ${_shell}/poise.bash
  COMMAND poise shell zsh > ${_shell}/_poise
  COMMAND poise shell fish > ${_shell}/poise.fish
  DEPENDS poise COMMENT "Writing manual page and completion" VERBATIM)
add_custom_target(poise_shell_files ALL DEPENDS ${_shell}/poise.1.gz)
install(FILES ${_shell}/poise.1.gz DESTINATION share/man/man1 OPTIONAL)
install(FILES ${_shell}/poise.bash DESTINATION share/bash-completion/completions RENAME poise OPTIONAL)
install(FILES ${_shell}/_poise DESTINATION share/zsh/vendor-completions OPTIONAL)
install(FILES ${_shell}/poise.fish DESTINATION share/fish/vendor_completions.d OPTIONAL)
install(FILES ${PROJECT_BINARY_DIR}/../web/report.html ${PROJECT_BINARY_DIR}/../web/charts.html DESTINATION share/poise OPTIONAL)
install(FILES ${PROJECT_BINARY_DIR}/lcmtypes/poise_types.jar DESTINATION share/poise/java OPTIONAL)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples DESTINATION share/poise COMPONENT dev)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION share/doc/poise RENAME copyright)

configure_package_config_file(${_here}/poise-config.cmake.in ${PROJECT_BINARY_DIR}/poise-config.cmake
                              INSTALL_DESTINATION lib/cmake/poise NO_SET_AND_CHECK_MACRO NO_CHECK_REQUIRED_COMPONENTS_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/poise-config-version.cmake COMPATIBILITY ExactVersion)
install(FILES ${PROJECT_BINARY_DIR}/poise-config.cmake ${PROJECT_BINARY_DIR}/poise-config-version.cmake
              ${_here}/PoiseModule.cmake ${_here}/FindLCM.cmake ${_here}/EmbedFile.cmake
        DESTINATION lib/cmake/poise COMPONENT dev)
