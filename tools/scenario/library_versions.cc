#include "tools/scenario/library_versions.h"

namespace poise {

const std::vector<std::string>& LibraryVersions() {
  static const std::vector<std::string> versions{
      "lcm " POISE_LCM_VERSION,           "ode " POISE_ODE_VERSION,
      "mujoco " POISE_MUJOCO_VERSION,     "eigen " POISE_EIGEN_VERSION,
      "protobuf " POISE_PROTOBUF_VERSION, "compiler " POISE_COMPILER};
  return versions;
}

}  // namespace poise
