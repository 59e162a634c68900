# Finds MuJoCo. Not find_package(mujoco CONFIG): Debian 12's file names an include folder (libqhull_r) that libmujoco-dev does not bring.
# Provides: target MuJoCo::MuJoCo, MuJoCo_VERSION.
find_path(MUJOCO_INCLUDE_DIR mujoco/mujoco.h)
find_library(MUJOCO_LIBRARY mujoco)
if(MUJOCO_INCLUDE_DIR)
  file(STRINGS ${MUJOCO_INCLUDE_DIR}/mujoco/mujoco.h _mujoco_version REGEX "^#define mjVERSION_HEADER ")
  string(REGEX REPLACE "^#define mjVERSION_HEADER +([0-9]+)([0-9])([0-9]).*" "\\1.\\2.\\3" MuJoCo_VERSION "${_mujoco_version}")
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(MuJoCo REQUIRED_VARS MUJOCO_LIBRARY MUJOCO_INCLUDE_DIR VERSION_VAR MuJoCo_VERSION)
if(MuJoCo_FOUND AND NOT TARGET MuJoCo::MuJoCo)
  add_library(MuJoCo::MuJoCo UNKNOWN IMPORTED)
  set_target_properties(MuJoCo::MuJoCo PROPERTIES IMPORTED_LOCATION ${MUJOCO_LIBRARY}
                        INTERFACE_INCLUDE_DIRECTORIES ${MUJOCO_INCLUDE_DIR})
endif()
mark_as_advanced(MUJOCO_INCLUDE_DIR MUJOCO_LIBRARY)
