# cmake --install: a tree that can be moved, for `poise` itself and for users' own code (poise-config.cmake).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(_here ${CMAKE_CURRENT_LIST_DIR})

set_target_properties(poise PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
install(TARGETS poise DESTINATION bin)
get_property(_programs GLOBAL PROPERTY POISE_PROGRAMS)
list(REMOVE_ITEM _programs poise)
set_target_properties(${_programs} PROPERTIES INSTALL_RPATH "$ORIGIN/../../../${CMAKE_INSTALL_LIBDIR}")
install(TARGETS ${_programs} poise_traits_generator DESTINATION lib/poise/bin)
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
")

# Headers as they are included, and the schemas that others' schemas may import.
set(_headers include/poise)
foreach(folder lcmtypes components sim sim_ode sim_mujoco hw_bridge logging)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder} DESTINATION ${_headers}
          FILES_MATCHING PATTERN "*.h" PATTERN "*.proto")
  if(NOT folder STREQUAL lcmtypes)
    install(DIRECTORY ${PROJECT_BINARY_DIR}/${folder} DESTINATION ${_headers}
            FILES_MATCHING PATTERN "*.pb.h" PATTERN "CMakeFiles" EXCLUDE)
  endif()
endforeach()
install(DIRECTORY ${PROJECT_BINARY_DIR}/poise DESTINATION ${_headers} FILES_MATCHING PATTERN "*.hpp")
install(FILES ${PROJECT_BINARY_DIR}/poise_commit.h DESTINATION ${_headers})

foreach(folder scenarios graphs robots sweeps drives bits)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/deploy/${folder} DESTINATION share/poise)
endforeach()
install(FILES ${POISE_LCM_FILES} DESTINATION share/poise/lcmtypes)
install(FILES ${PROJECT_BINARY_DIR}/../web/report.html DESTINATION share/poise OPTIONAL)
install(FILES ${PROJECT_BINARY_DIR}/lcmtypes/poise_types.jar DESTINATION share/poise/java OPTIONAL)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples DESTINATION share/poise)

configure_package_config_file(${_here}/poise-config.cmake.in ${PROJECT_BINARY_DIR}/poise-config.cmake
                              INSTALL_DESTINATION lib/cmake/poise NO_SET_AND_CHECK_MACRO NO_CHECK_REQUIRED_COMPONENTS_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/poise-config-version.cmake COMPATIBILITY ExactVersion)
install(FILES ${PROJECT_BINARY_DIR}/poise-config.cmake ${PROJECT_BINARY_DIR}/poise-config-version.cmake
              ${_here}/PoiseModule.cmake ${_here}/FindLCM.cmake ${_here}/EmbedFile.cmake
        DESTINATION lib/cmake/poise)
