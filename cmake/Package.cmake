# cpack -G DEB: Debian packages of what cmake --install installs: poise (programs, library, scenarios, robots, page), poise-dev (headers,
# CMake package, example), python3-poise. What they need is told by dpkg-shlibdeps; MuJoCo is Debian's own package libmujoco2.2.2.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME poise)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "The authors of Poise <poise@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "balance of torque-controlled humanoids by contact forces and moments")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL poise dev)
if(TARGET poise_python_module)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/lib)
set(CPACK_DEBIAN_POISE_PACKAGE_NAME poise)
set(CPACK_DEBIAN_POISE_DESCRIPTION "Poise: programs, scenarios and robots
 Keeps a torque-controlled humanoid on its feet by controlling its contact
 forces and moments: a graph of processes on LCM, with simulated robots.")
set(CPACK_DEBIAN_POISE_PACKAGE_SUGGESTS "python3-poise, liblcm-bin")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME poise-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_DESCRIPTION "Poise: for components, messages and metrics of one's own
 Headers, CMake package and an example project.")
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "poise (= ${PROJECT_VERSION}), cmake, g++, libeigen3-dev, liblcm-dev, liblcm-bin, \
libprotobuf-dev, protobuf-compiler, libfmt-dev, nlohmann-json3-dev, cyclonedds-dev, libode-dev, libmujoco-dev")
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-poise)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "Poise: the Python module
 Runs as numpy arrays, scenarios in process, dynamics and mathematics on arrays.")
if(TARGET poise_python_module)
  execute_process(COMMAND ${Python3_EXECUTABLE} -c "import sys; print(sys.version_info.minor)" OUTPUT_VARIABLE _minor
                  OUTPUT_STRIP_TRAILING_WHITESPACE)
  math(EXPR _next "${_minor} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "poise (= ${PROJECT_VERSION}), python3 (>= 3.${_minor}), \
python3 (<< 3.${_next}), python3-numpy")
endif()
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "python3-matplotlib")  # the tutorial draws
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-pandas")
include(CPack)
