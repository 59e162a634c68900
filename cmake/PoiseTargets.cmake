# Options, compile flags and the few target functions every folder uses.
include(InstructionSet)
set(POISE_CMAKE_DIR ${CMAKE_CURRENT_LIST_DIR})
set(POISE_COMPILER "${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}")
option(POISE_SANITIZE "Address and undefined-behaviour sanitizers" OFF)
option(POISE_BUILD_TESTS "Build tests and benchmarks" ON)
option(POISE_WERROR "Treat warnings as errors: where Poise is developed and in its CI, never for a user" OFF)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)  # all libraries become one shared one, see poise_shared_library
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O3")  # assertions stay on

# The commit, for logs and --version: written anew with each commit, and by deploy/setup.
execute_process(COMMAND ${CMAKE_COMMAND} -DSOURCE=${PROJECT_SOURCE_DIR} -DOUTPUT=${PROJECT_BINARY_DIR}/poise_commit.h
                        -P ${PROJECT_SOURCE_DIR}/cmake/WriteCommit.cmake)
# Git tells where its log is: a worktree's is elsewhere.
execute_process(COMMAND git rev-parse --git-path logs/HEAD WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
                OUTPUT_VARIABLE _git_log OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(_git_log)
  get_filename_component(_git_log ${_git_log} ABSOLUTE BASE_DIR ${PROJECT_SOURCE_DIR})
endif()
if(_git_log AND EXISTS ${_git_log})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${_git_log})
endif()

# One set of code-generation flags for all targets: Eigen's alignment depends on them.
# -ffp-contract=off: the same source gives the same bits wherever it is inlined.
add_compile_options(-ffp-contract=off ${POISE_MARCH})
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC collects its garbage from 128 MB on; from 512 MB on it takes a tenth less time.
  # No function of a shared library is replaced by another's: it may be inlined.
  add_compile_options(--param=ggc-min-heapsize=524288 -fno-semantic-interposition)
endif()
if(POISE_SANITIZE)
  add_compile_options(-fsanitize=address,undefined -fno-sanitize-recover=undefined
                      -fno-omit-frame-pointer)
  add_link_options(-fsanitize=address,undefined)
endif()

add_library(poise_options INTERFACE)
target_include_directories(poise_options INTERFACE ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR})
target_link_libraries(poise_options INTERFACE Eigen3::Eigen fmt::fmt)
target_compile_options(poise_options INTERFACE -Wall -Wextra -Wconversion)
# A precompiled header fits only where macros are equal, and tinyxml2's package of Debian 13 brings this one to its users alone.
target_compile_definitions(poise_options INTERFACE _FILE_OFFSET_BITS=64)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(poise_options INTERFACE -Wno-array-bounds)  # GCC 12 to 14 raise it falsely in Eigen
  if(CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    # GCC 12 raises them falsely: in its own AVX-512 headers wherever Eigen meets them (bug 105593), the last ones in fmt and std::string (bug 105651).
    target_compile_options(poise_options INTERFACE -Wno-uninitialized -Wno-maybe-uninitialized -Wno-stringop-overflow -Wno-restrict)
  endif()
endif()
if(POISE_WERROR)
  target_compile_options(poise_options INTERFACE -Werror)
endif()

# What most files include is parsed once, which takes a third off the time of a build. Every file still includes what it uses: a
# build without (-DPOISE_PRECOMPILE=OFF, the presets sanitize and debug) shows it. What a header's own functions use of templates
# is instantiated anew in every file: <nlohmann/json.hpp> would take each 0.8 s.
option(POISE_PRECOMPILE "Precompile the headers that most files include" ON)
set(POISE_PRECOMPILED_HEADERS
  <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <fstream> <functional> <map> <memory> <optional>
  <random> <set> <span> <sstream> <string> <vector>
  <Eigen/Dense> <fmt/format.h> <google/protobuf/message.h>)

# poise_precompiled_headers(name HEADERS ... DEPS ...): an empty target whose headers others take over.
function(poise_precompiled_headers name)
  cmake_parse_arguments(A "" "" "HEADERS;DEPS" ${ARGN})
  if(POISE_PRECOMPILE)
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/${name}.cc CONTENT "")
    add_library(${name} OBJECT ${PROJECT_BINARY_DIR}/${name}.cc)
    target_link_libraries(${name} PRIVATE poise_options ${A_DEPS})
    target_precompile_headers(${name} PRIVATE ${A_HEADERS})
  endif()
endfunction()
function(poise_reuse_headers name from)
  if(POISE_PRECOMPILE)
    target_precompile_headers(${name} REUSE_FROM ${from})
  endif()
endfunction()

# Many small files are compiled together, which saves time.
# A build with -DPOISE_UNITE=OFF (the presets sanitize and debug, and who changes one file again and again) compiles each
# by itself.
option(POISE_UNITE "Compile small files of a target together" ON)
function(poise_unite name)
  if(POISE_UNITE)
    set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 12)
    target_compile_options(${name} PRIVATE -Wno-subobject-linkage)  # meant for headers, and each file looks like one
  endif()
endfunction()

# An executable's code as a library's (-fPIC, not -fPIE): they share precompiled headers.
function(poise_compile_as_library name)
  set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
  target_compile_options(${name} PRIVATE -fPIC)
endfunction()

# poise_library(name [SOURCES ...] [FOLDERS ...] [EXCEPT ...] DEPS ... [UNITE]): a static library of our own code; UNITE: see
# poise_unite. Without SOURCES it is made of all in the calling folder and in FOLDERS below it, but for EXCEPT.
function(poise_library name)
  cmake_parse_arguments(A "UNITE" "" "SOURCES;FOLDERS;EXCEPT;DEPS" ${ARGN})
  if(NOT A_SOURCES)
    list(TRANSFORM A_FOLDERS APPEND /*.cc)
    file(GLOB A_SOURCES CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} *.cc ${A_FOLDERS})
    list(REMOVE_ITEM A_SOURCES "" ${A_EXCEPT})
    list(SORT A_SOURCES COMPARE FILE_BASENAME)  # which files are compiled together depends on nothing but their names
  endif()
  add_library(${name} STATIC ${A_SOURCES})
  target_link_libraries(${name} PUBLIC poise_options ${A_DEPS})
  if(A_UNITE)
    poise_unite(${name})
  endif()
  poise_reuse_headers(${name} poise_headers)
  set_property(GLOBAL APPEND PROPERTY POISE_LIBRARIES ${name})
endfunction()

# poise_shared_library(name LIBRARIES ...): the libraries of our own made so far as one shared library, which programs and
# users' modules link instead of them, and the others' that they link. One copy of everything in a process: Protobuf allows no
# second one of a schema.
function(poise_shared_library name)
  cmake_parse_arguments(A "" "" "LIBRARIES" ${ARGN})
  get_property(own GLOBAL PROPERTY POISE_LIBRARIES)
  set(files)
  foreach(library ${own})
    list(APPEND files $<TARGET_FILE:${library}>)
  endforeach()
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/${name}.cc CONTENT "")
  add_library(${name} SHARED ${PROJECT_BINARY_DIR}/${name}.cc)
  # As files: named as targets they would be linked again for each other's sake.
  target_link_libraries(${name} PRIVATE -Wl,--whole-archive ${files} -Wl,--no-whole-archive ${A_LIBRARIES})
  # Eigen's functions of a library that a user's module links are not replaced by ours, which may have other bits.
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/${name}.exports CONTENT "{ global: *; local: _ZN5Eigen*; _ZNK5Eigen*; };\n")
  target_link_options(${name} PRIVATE -Wl,-Bsymbolic-functions -Wl,--no-undefined
                      -Wl,--version-script=${PROJECT_BINARY_DIR}/${name}.exports)
  add_dependencies(${name} ${own})
  set_target_properties(${name} PROPERTIES OUTPUT_NAME poise LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib
                        LINK_DEPENDS "${files}" INSTALL_RPATH "$ORIGIN")
endfunction()

# poise_program(name SOURCES ... DEPS ...): an executable in build/<preset>/bin. The shared library comes first: what it has
# is not taken from the others.
function(poise_program name)
  cmake_parse_arguments(A "" "" "SOURCES;DEPS" ${ARGN})
  add_executable(${name} ${A_SOURCES})
  poise_compile_as_library(${name})
  target_link_libraries(${name} PRIVATE poise_options poise_shared ${A_DEPS})
  poise_reuse_headers(${name} poise_headers)
  set_property(GLOBAL APPEND PROPERTY POISE_PROGRAMS ${name})
endfunction()

# poise_component_program(name TYPE): the program of one component, whose library is name_component and whose type
# poise::TYPE() gives.
function(poise_component_program name type)
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${name}_main.cc CONTENT [[
#include "components/framework/runners/component_main.h"

namespace poise {
ComponentType @type@();
}

int main(int argc, char** argv) { return poise::ComponentMain(argc, argv, poise::@type@()); }
]] @ONLY)
  poise_program(${name} SOURCES ${CMAKE_CURRENT_BINARY_DIR}/${name}_main.cc DEPS ${name}_component)
endfunction()

# poise_embed(FUNCTION file...): FUNCTION.cc, whose function gives the files' bytes.
function(poise_embed name)
  list(JOIN ARGN "," inputs)
  add_custom_command(
    OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cc
    COMMAND ${CMAKE_COMMAND} -DINPUTS=${inputs} -DOUTPUT=${CMAKE_CURRENT_BINARY_DIR}/${name}.cc -DFUNCTION=${name}
            -P ${POISE_CMAKE_DIR}/EmbedFile.cmake
    DEPENDS ${ARGN} ${POISE_CMAKE_DIR}/EmbedFile.cmake VERBATIM)
endfunction()

# Any of them may be imported by any: protoc tells dependencies of single files alone.
file(GLOB_RECURSE POISE_ALL_PROTOS CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/components/*.proto ${PROJECT_SOURCE_DIR}/sim*/*.proto
     ${PROJECT_SOURCE_DIR}/hw_bridge/*.proto ${PROJECT_SOURCE_DIR}/tools/*.proto ${PROJECT_SOURCE_DIR}/tests/*.proto)

# poise_proto_library(name PROTOS ... DEPS ...): C++ of .proto files of this folder, included by their path from the
# top ("components/robot_files/robot.pb.h"), and std::string_view poise::NAME_schema(), the schema with its comments. Generated code
# is not held to our warnings.
function(poise_proto_library name)
  cmake_parse_arguments(A "" "" "PROTOS;DEPS" ${ARGN})
  set(sources)
  foreach(proto ${A_PROTOS})
    file(RELATIVE_PATH relative ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/${proto})
    string(REGEX REPLACE "\\.proto$" "" stem ${relative})
    add_custom_command(
      OUTPUT ${PROJECT_BINARY_DIR}/${stem}.pb.cc ${PROJECT_BINARY_DIR}/${stem}.pb.h
      COMMAND protobuf::protoc --cpp_out=${PROJECT_BINARY_DIR} -I ${PROJECT_SOURCE_DIR} ${relative}
      WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
      DEPENDS ${PROJECT_SOURCE_DIR}/${relative} VERBATIM)
    list(APPEND sources ${PROJECT_BINARY_DIR}/${stem}.pb.cc)
  endforeach()
  set(schema ${CMAKE_CURRENT_BINARY_DIR}/${name}.binpb)
  set(protos ${A_PROTOS})
  list(TRANSFORM protos PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  add_custom_command(
    OUTPUT ${schema}
    COMMAND protobuf::protoc --descriptor_set_out=${schema} --include_imports --include_source_info
            -I ${PROJECT_SOURCE_DIR} ${protos}
    DEPENDS ${POISE_ALL_PROTOS} VERBATIM)
  poise_embed(${name}_schema ${schema})
  add_library(${name} STATIC ${sources} ${CMAKE_CURRENT_BINARY_DIR}/${name}_schema.cc)
  target_include_directories(${name} SYSTEM PUBLIC ${PROJECT_BINARY_DIR})
  target_link_libraries(${name} PUBLIC protobuf::libprotobuf ${A_DEPS})
  if(NOT name STREQUAL poise_rule_proto)
    target_link_libraries(${name} PUBLIC poise_rule_proto)  # any schema may give its fields rules
  endif()
  set_property(GLOBAL APPEND PROPERTY POISE_LIBRARIES ${name})
endfunction()

# Tests' own code is run once: compiling it faster gains more. What they test is built as ever, with the same bits.
set(POISE_TEST_OPTIONS $<$<CONFIG:Release>:-O1>)

# poise_test(name SOURCES ... DEPS ... [ARGS ...] [LABELS ...]): a GoogleTest executable, one ctest entry per test case.
function(poise_test name)
  cmake_parse_arguments(A "" "" "SOURCES;DEPS;LABELS" ${ARGN})
  add_executable(${name} ${A_SOURCES})
  poise_compile_as_library(${name})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  target_link_libraries(${name} PRIVATE poise_options ${A_DEPS} GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_options(${name} PRIVATE ${POISE_TEST_OPTIONS})
  poise_unite(${name})
  poise_reuse_headers(${name} poise_test_headers)
  target_compile_definitions(${name} PRIVATE POISE_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
                             POISE_BIN_DIR="${CMAKE_BINARY_DIR}/bin")
  # The names of cases: values that gtest prints as bytes differ from build to build.
  gtest_discover_tests(${name} NO_PRETTY_VALUES DISCOVERY_TIMEOUT 60 PROPERTIES LABELS "${A_LABELS}")
endfunction()
