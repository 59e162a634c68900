# Finds LCM without pkg-config (lcm.pc needs glib's headers, LCM's do not).
# Provides: target LCM::LCM, LCM_GEN (generator), LCM_JAR (may be empty), LCM_VERSION.
find_path(LCM_INCLUDE_DIR lcm/lcm-cpp.hpp)
find_library(LCM_LIBRARY lcm)
find_program(LCM_GEN lcm-gen)
find_file(LCM_JAR lcm.jar PATHS /usr/share/java /usr/local/share/java NO_DEFAULT_PATH)
find_file(LCM_PC lcm.pc PATH_SUFFIXES pkgconfig PATHS /usr/lib /usr/local/lib
          /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE} NO_DEFAULT_PATH)
if(LCM_PC)
  file(STRINGS ${LCM_PC} _lcm_version REGEX "^Version:")
  string(REGEX REPLACE "^Version:[ ]*" "" LCM_VERSION "${_lcm_version}")
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(LCM REQUIRED_VARS LCM_LIBRARY LCM_INCLUDE_DIR LCM_GEN
                                  VERSION_VAR LCM_VERSION)
if(LCM_FOUND AND NOT TARGET LCM::LCM)
  add_library(LCM::LCM UNKNOWN IMPORTED)
  set_target_properties(LCM::LCM PROPERTIES IMPORTED_LOCATION ${LCM_LIBRARY}
                        INTERFACE_INCLUDE_DIRECTORIES ${LCM_INCLUDE_DIR})
endif()
mark_as_advanced(LCM_INCLUDE_DIR LCM_LIBRARY LCM_GEN LCM_JAR LCM_PC)
