# What find_package(poise) gives a project of one's own: poise_messages and poise_module. What they build lies in the build folder
# as it will lie where it is installed, so either can stand in POISE_PATH.
set(_poise_cmake_dir ${CMAKE_CURRENT_LIST_DIR})
find_program(POISE_JAVAC javac)
find_program(POISE_JAR jar)

# poise_messages(NAME FILE.lcm ...): message types of any package but poise, as a target for MESSAGES of poise_module. C++ includes
# "PACKAGE/TYPE.hpp" and, for ports, "NAME/message_traits.hpp". A field may be a struct of Poise's (poise.wrench_t). With a Java
# compiler, lcm-spy's classes go to share/poise/java/NAME.jar.
function(poise_messages name)
  set(dir ${CMAKE_CURRENT_BINARY_DIR}/${name}_generated)
  set(files)
  foreach(file ${ARGN})
    cmake_path(ABSOLUTE_PATH file)
    list(APPEND files ${file})
  endforeach()
  file(GLOB imports ${POISE_SHARE}/lcmtypes/*.lcm)
  add_custom_command(
    OUTPUT ${dir}/${name}/message_traits.hpp ${dir}/${name}/message_table.cc
    COMMAND ${LCM_GEN} -x --cpp-std=c++11 --cpp-hpath ${dir} ${files}
    COMMAND ${POISE_TRAITS_GENERATOR} ${name} ${dir} ${files} --import ${imports}
    DEPENDS ${files} COMMENT "Generating C++ of the messages of ${name}" VERBATIM)
  add_custom_target(${name}_headers DEPENDS ${dir}/${name}/message_traits.hpp)
  add_library(${name} OBJECT ${dir}/${name}/message_table.cc)
  add_dependencies(${name} ${name}_headers)
  set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_include_directories(${name} SYSTEM PUBLIC ${dir})
  target_link_libraries(${name} PUBLIC poise::poise)
  set(types_jar ${POISE_SHARE}/java/poise_types.jar)
  if(POISE_JAVAC AND POISE_JAR AND LCM_JAR AND EXISTS ${types_jar})
    set(jar ${CMAKE_BINARY_DIR}/share/poise/java/${name}.jar)
    add_custom_command(
      OUTPUT ${jar}
      COMMAND ${CMAKE_COMMAND} -E rm -rf ${dir}/java
      COMMAND ${CMAKE_COMMAND} -E make_directory ${dir}/java/classes ${CMAKE_BINARY_DIR}/share/poise/java
      COMMAND ${LCM_GEN} -j --jpath ${dir}/java ${files}
      COMMAND sh -c "find '${dir}/java' -name '*.java' > '${dir}/java/sources'"
      COMMAND ${POISE_JAVAC} -nowarn -encoding UTF-8 -cp ${LCM_JAR}:${types_jar} -d ${dir}/java/classes @${dir}/java/sources
      COMMAND ${POISE_JAR} cf ${jar} -C ${dir}/java/classes .
      DEPENDS ${files} COMMENT "Generating ${name}.jar for lcm-spy" VERBATIM)
    add_custom_target(${name}_jar ALL DEPENDS ${jar})
    install(FILES ${jar} DESTINATION share/poise/java)
  endif()
endfunction()

# poise_module(NAME SOURCES ... [PROTOS ...] [MESSAGES target ...] [DEPS target ...] [COMPONENTS type ...] [FILES folder]): one shared
# library that `poise` loads (POISE_PATH), and a program for each component type, which links it. One source has POISE_MODULE
# (components/framework/module_entry.h). PROTOS, of configurations, are included as "FILE.pb.h"; with them comes std::string_view
# poise::NAME_schema(). DEPS are libraries of any origin that SOURCES use. FILES holds scenarios/, graphs/, robots/, sweeps/, drives/.
# The library shows POISE_MODULE alone: what it and its DEPS compute is their own code, whatever the process has beside them.
function(poise_module name)
  cmake_parse_arguments(A "" "FILES" "SOURCES;PROTOS;MESSAGES;DEPS;COMPONENTS" ${ARGN})
  if(A_UNPARSED_ARGUMENTS OR NOT A_SOURCES)
    message(FATAL_ERROR "poise_module(${name}): write SOURCES ..., then what it has of PROTOS, MESSAGES, DEPS, COMPONENTS, FILES; "
                        "not understood: ${A_UNPARSED_ARGUMENTS}")
  endif()
  set(dir ${CMAKE_CURRENT_BINARY_DIR}/${name}_generated)
  set(generated)
  if(A_PROTOS)
    set(outputs)
    foreach(proto ${A_PROTOS})
      string(REGEX REPLACE "\\.proto$" "" stem ${proto})
      list(APPEND outputs ${dir}/${stem}.pb.cc ${dir}/${stem}.pb.h)
    endforeach()
    set(protos ${A_PROTOS})
    list(TRANSFORM protos PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
    file(MAKE_DIRECTORY ${dir})
    set(paths -I ${CMAKE_CURRENT_SOURCE_DIR} -I ${POISE_PREFIX}/include/poise)
    add_custom_command(OUTPUT ${outputs} COMMAND protobuf::protoc --cpp_out=${dir} ${paths} ${protos} DEPENDS ${protos} VERBATIM)
    add_custom_command(
      OUTPUT ${dir}/${name}.binpb
      COMMAND protobuf::protoc --descriptor_set_out=${dir}/${name}.binpb --include_imports --include_source_info ${paths} ${protos}
      DEPENDS ${protos} VERBATIM)
    add_custom_command(
      OUTPUT ${dir}/${name}_schema.cc
      COMMAND ${CMAKE_COMMAND} -DINPUTS=${dir}/${name}.binpb -DOUTPUT=${dir}/${name}_schema.cc -DFUNCTION=${name}_schema
              -P ${_poise_cmake_dir}/EmbedFile.cmake
      DEPENDS ${dir}/${name}.binpb VERBATIM)
    set(generated ${outputs} ${dir}/${name}_schema.cc)
  endif()
  file(CONFIGURE OUTPUT ${dir}/exports CONTENT "{ global: poise_module; local: *; };\n")
  add_library(${name} SHARED ${A_SOURCES} ${generated})
  target_include_directories(${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
  target_include_directories(${name} SYSTEM PRIVATE ${dir})
  target_link_libraries(${name} PRIVATE ${A_MESSAGES} ${A_DEPS} poise::poise)
  target_link_options(${name} PRIVATE -Wl,--version-script=${dir}/exports -Wl,--no-undefined)
  set_target_properties(${name} PROPERTIES PREFIX "" LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib/poise/modules
                        INSTALL_RPATH_USE_LINK_PATH ON)
  install(TARGETS ${name} DESTINATION lib/poise/modules)
  foreach(component ${A_COMPONENTS})
    if(component STREQUAL name)
      message(FATAL_ERROR "poise_module: '${name}' names the module and a component; give one another name")
    endif()
    file(CONFIGURE OUTPUT ${dir}/${component}_main.cc CONTENT [[
#include "components/framework/module_entry.h"
#include "components/framework/runners/component_main.h"

int main(int argc, char** argv) {
  return poise::ModuleComponentMain(argc, argv, "@component@", &poise_module);
}
]] @ONLY)
    add_executable(${component} ${dir}/${component}_main.cc)
    target_link_libraries(${component} PRIVATE ${name} poise::poise)
    set_target_properties(${component} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib/poise/bin
                          INSTALL_RPATH "$ORIGIN/../modules" INSTALL_RPATH_USE_LINK_PATH ON)
    install(TARGETS ${component} DESTINATION lib/poise/bin)
  endforeach()
  if(A_FILES)
    cmake_path(ABSOLUTE_PATH A_FILES)
    file(GLOB folders LIST_DIRECTORIES true ${A_FILES}/*)
    file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/share/poise)
    foreach(folder ${folders})
      cmake_path(GET folder FILENAME folder_name)
      file(CREATE_LINK ${folder} ${CMAKE_BINARY_DIR}/share/poise/${folder_name} SYMBOLIC)
      install(DIRECTORY ${folder} DESTINATION share/poise)
    endforeach()
  endif()
endfunction()
