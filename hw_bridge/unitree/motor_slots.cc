#include "hw_bridge/unitree/motor_slots.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "hw_bridge/unitree/messages.h"

namespace poise::unitree {
namespace {

using Names = std::span<const std::string_view>;

// Each layout: a leg (left, then right), the waist, an arm (left, then right).
struct LayoutNames {
  Names leg, waist, arm;
};

constexpr std::string_view kLegG1[] = {"hip_pitch", "hip_roll",    "hip_yaw",
                                       "knee",      "ankle_pitch", "ankle_roll"};
constexpr std::string_view kWaistG1[] = {"waist_yaw", "waist_roll", "waist_pitch"};
constexpr std::string_view kArm[] = {"shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow",
                                     "wrist_roll",     "wrist_pitch",   "wrist_yaw"};
constexpr std::string_view kLegH12[] = {"hip_yaw", "hip_pitch",   "hip_roll",
                                        "knee",    "ankle_pitch", "ankle_roll"};

LayoutNames NamesOf(UnitreeBusConfig::Layout layout) {
  switch (layout) {
    case UnitreeBusConfig::G1_23_OLD:
      return {kLegG1, Names(kWaistG1).first(1), Names(kArm).first(5)};
    case UnitreeBusConfig::H1_2:
      return {kLegH12, Names(kWaistG1).first(1), kArm};
    default:
      return {kLegG1, kWaistG1, kArm};
  }
}

std::map<std::string, size_t> SlotsOf(UnitreeBusConfig::Layout layout) {
  const LayoutNames names = NamesOf(layout);
  std::map<std::string, size_t> slots;
  size_t next = 0;
  const auto add = [&](Names part, std::string_view side) {
    for (const std::string_view name : part) slots[fmt::format("{}{}", side, name)] = next++;
  };
  add(names.leg, "left_");
  add(names.leg, "right_");
  add(names.waist, "");
  add(names.arm, "left_");
  add(names.arm, "right_");
  return slots;
}

/// The layouts' name of a joint of the makers' files.
std::string CommonName(std::string name) {
  constexpr std::string_view kEnding = "_joint";
  if (name.ends_with(kEnding)) name.resize(name.size() - kEnding.size());
  if (name == "torso") return "waist_yaw";
  for (const std::string_view hinge : {"knee", "elbow"}) {
    const size_t at = name.find(std::string(hinge) + "_pitch");
    if (at != std::string::npos) name.resize(at + hinge.size());
  }
  return name;
}

}  // namespace

std::vector<size_t> MotorSlots(std::span<const std::string> joints, UnitreeBusConfig::Layout layout,
                               const google::protobuf::RepeatedPtrField<MotorSlot>& changes) {
  const auto has = [joints](std::string_view name) {
    return std::find(joints.begin(), joints.end(), name) != joints.end();
  };
  if (layout == UnitreeBusConfig::BY_ROBOT) {
    layout = has("torso_joint") ? UnitreeBusConfig::H1_2 : UnitreeBusConfig::G1;
  }
  for (const MotorSlot& change : changes) {
    if (!has(change.joint())) {
      throw UnitreeError("slot: the robot has no joint \"{}\"", change.joint());
    }
  }
  const std::map<std::string, size_t> slots = SlotsOf(layout);
  std::vector<size_t> result;
  for (const std::string& joint : joints) {
    std::optional<size_t> slot;
    if (const auto named = slots.find(CommonName(joint)); named != slots.end()) {
      slot = named->second;
    }
    for (const MotorSlot& change : changes) {
      if (change.joint() == joint) slot = change.slot();
    }
    if (!slot || *slot >= kNumSlots) {
      throw UnitreeError(
          "joint \"{}\" has no motor in layout {}; name its slot, 0 to {}, in `slot`", joint,
          UnitreeBusConfig::Layout_Name(layout), kNumSlots - 1);
    }
    const auto other = std::find(result.begin(), result.end(), *slot);
    if (other != result.end()) {
      throw UnitreeError("joints \"{}\" and \"{}\" are both in slot {}",
                         joints[static_cast<size_t>(other - result.begin())], joint, *slot);
    }
    result.push_back(*slot);
  }
  return result;
}

std::vector<size_t> MotorSlots(const robot::RobotModel& model, UnitreeBusConfig::Layout layout,
                               const google::protobuf::RepeatedPtrField<MotorSlot>& changes) {
  std::vector<std::string> joints;
  for (const robot::Joint& joint : model.joints()) joints.push_back(joint.name);
  return MotorSlots(joints, layout, changes);
}

}  // namespace poise::unitree
