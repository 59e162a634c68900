// Which of a message's 35 motors moves which joint.
#pragma once

#include <google/protobuf/repeated_ptr_field.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "components/robot/robot_model.h"
#include "hw_bridge/unitree/unitree.pb.h"

namespace poise::unitree {

/// Slot of each joint, by its name ("left_hip_pitch_joint", with or without the ending; H1-2's
/// "torso_joint" is the waist's yaw, "knee_pitch" a knee), as unitree_sdk2's examples number them,
/// but for `changes`. Throws UnitreeError: a joint that the layout does not have, two joints in one
/// slot, a change of no joint.
std::vector<size_t> MotorSlots(std::span<const std::string> joints, UnitreeBusConfig::Layout layout,
                               const google::protobuf::RepeatedPtrField<MotorSlot>& changes);
/// Returns the slots of a robot's joints.
std::vector<size_t> MotorSlots(const robot::RobotModel& model, UnitreeBusConfig::Layout layout,
                               const google::protobuf::RepeatedPtrField<MotorSlot>& changes);

}  // namespace poise::unitree
