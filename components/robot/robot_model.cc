#include "components/robot/robot_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace poise::robot {

RobotModel::RobotModel(RobotParts parts) : parts_(std::move(parts)) { BuildTree(); }

void RobotModel::BuildTree() {
  tree_ = KinematicTree();
  for (const Body& body : parts_.bodies) {
    tree_.bodies.push_back({body.parent, body.mass, body.mass, body.com, body.inertia});
    std::vector<int> support;
    for (int b = static_cast<int>(tree_.bodies.size()) - 1; b > 0;
         b = parts_.bodies[static_cast<size_t>(b)].parent) {
      support.push_back(parts_.bodies[static_cast<size_t>(b)].joint);
    }
    tree_.supporting_joints.push_back(std::move(support));
  }
  for (size_t b = parts_.bodies.size() - 1; b > 0; --b) {
    tree_.bodies[static_cast<size_t>(parts_.bodies[b].parent)].subtree_mass +=
        tree_.bodies[b].subtree_mass;
  }
  total_mass_ = tree_.bodies[0].subtree_mass;
  for (size_t j = 0; j < parts_.joints.size(); ++j) {
    const Joint& joint = parts_.joints[j];
    const Eigen::Matrix3d origin = joint.origin.linear();
    const Eigen::Vector3d& a = joint.axis;
    Eigen::Matrix3d cross;
    cross << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
    const Eigen::Matrix3d projection = a * a.transpose();
    // Rodrigues: R = a aᵀ + (1 - a aᵀ) cos q + [a]ₓ sin q.
    tree_.joints.push_back(
        {origin * projection, origin * (Eigen::Matrix3d::Identity() - projection), origin * cross,
         joint.origin.translation(), origin * a, parts_.motors[j].reflected_inertia});
  }
}

FootArray<bool> RobotModel::CarriedFeet(int joint) const {
  FootArray<bool> carried;
  for (const Foot f : kFeet) {
    carried[f] = std::ranges::find(supporting_joints(feet()[f].body), joint) !=
                 supporting_joints(feet()[f].body).end();
  }
  return carried;
}

const Frame* RobotModel::FindFrame(std::string_view name) const {
  const auto frame = std::find_if(parts_.frames.begin(), parts_.frames.end(),
                                  [&](const Frame& other) { return other.name == name; });
  return frame == parts_.frames.end() ? nullptr : &*frame;
}

int RobotModel::FindJoint(std::string_view name) const {
  const auto joint = std::find_if(parts_.joints.begin(), parts_.joints.end(),
                                  [&](const Joint& other) { return other.name == name; });
  return joint == parts_.joints.end() ? -1 : static_cast<int>(joint - parts_.joints.begin());
}

RobotModel RobotModel::WithModelError(std::string_view body, double mass_scale,
                                      const Eigen::Vector3d& com_shift) const {
  if (!(mass_scale > 0) || !std::isfinite(mass_scale)) {
    throw RobotError(
        fmt::format("model error of '{}': mass scale {} must be above 0", body, mass_scale));
  }
  if (!com_shift.allFinite()) {
    throw RobotError(fmt::format("model error of '{}': COM shift must be finite", body));
  }
  RobotModel copy = *this;
  const auto changed = std::find_if(copy.parts_.bodies.begin(), copy.parts_.bodies.end(),
                                    [&](const Body& other) { return other.name == body; });
  if (changed == copy.parts_.bodies.end()) {
    std::string names;
    for (const Body& other : parts_.bodies) names += (names.empty() ? "" : ", ") + other.name;
    throw RobotError(fmt::format("model error: no moving body '{}': use one of {}", body, names));
  }
  changed->mass *= mass_scale;
  changed->inertia *= mass_scale;
  changed->com += com_shift;
  copy.BuildTree();
  return copy;
}

RobotModel RobotModel::WithImuTurned(const Eigen::Matrix3d& turn) const {
  RobotParts parts = parts_;
  parts.imu.pose.linear() = parts.imu.pose.linear() * turn;
  return RobotModel(std::move(parts));
}

double PeakTorque(const RobotModel& model, size_t joint) {
  const MotorModel& motor = model.motors()[joint];
  return std::min(model.joints()[joint].effort, motor.torque_per_ampere() * motor.peak_current);
}

Eigen::VectorXd PeakTorques(const RobotModel& model) {
  Eigen::VectorXd torque(model.num_joints());
  for (int j = 0; j < model.num_joints(); ++j) {
    torque[j] = PeakTorque(model, static_cast<size_t>(j));
  }
  return torque;
}

}  // namespace poise::robot
