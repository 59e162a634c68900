#include "tools/scenario/ablations.h"

#include <utility>

namespace poise {
namespace {

const std::vector<std::pair<std::string, std::string>>& PartFields() {
  static const std::vector<std::pair<std::string, std::string>> fields = {
      {"balancing", "contact_wrench_monitor.balancing"},
      {"redistribution", "redistributor.redistribution"},
      {"transition", "redistributor.transition"},
  };
  return fields;
}

constexpr const char* kIdeal[] = {
    "sim_ode.joint_friction=false",
    "sim_ode.sensor_noise=false",
    "sim_ode.rotor_inertia=true",
    "sim_ode.push_sensor_noise=0",
    "sim_ode.drive_train=",
    "sim_ode.model_error=",
    "sim_ode.motor_change=",
    // What the estimator knows of the drive train.
    "state_estimator.invariant_ekf.sensor_delay=0",
    "state_estimator.invariant_ekf.gear_stiffness=0",
};

}  // namespace

std::vector<std::string> RemovableParts() {
  std::vector<std::string> parts;
  for (const auto& [part, field] : PartFields()) parts.push_back(part);
  return parts;
}

std::vector<FieldChange> AblationChanges(const std::vector<std::string>& parts, bool ideal) {
  std::vector<FieldChange> changes;
  for (const auto& [part, field] : PartFields()) {
    for (const std::string& wanted : parts) {
      if (wanted == part) changes.push_back({field + "=false", "--without " + part});
    }
  }
  if (ideal) {
    for (const char* set : kIdeal) changes.push_back({set, "--ideal"});
  }
  return changes;
}

std::vector<std::string> Ablation::flags() const {
  std::vector<std::string> flags;
  for (const std::string& part : without) flags.insert(flags.end(), {"--without", part});
  if (ideal) flags.push_back("--ideal");
  return flags;
}

std::vector<Ablation> Ablations() {
  std::vector<Ablation> ablations = {{"full", {}}};
  for (const std::string& part : RemovableParts()) ablations.push_back({"without_" + part, {part}});
  ablations.push_back({"ideal", {}, true});
  return ablations;
}

}  // namespace poise
