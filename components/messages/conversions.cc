#include "components/messages/conversions.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "components/balance/support_polygon.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "components/robot/posture.h"
#include "components/robot/sole.h"

namespace poise {
bool ReadState(const robot_state_t& message, robot::RobotState* state) {
  state->base_position = GetVector3(message.base_position);
  const double* q = message.base_orientation;
  state->base_orientation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  state->base_linear_velocity = GetVector3(message.base_linear_velocity);
  state->base_angular_velocity = GetVector3(message.base_angular_velocity);
  std::copy_n(message.joint_position.begin(), state->joint_position.size(),
              state->joint_position.data());
  std::copy_n(message.joint_velocity.begin(), state->joint_velocity.size(),
              state->joint_velocity.data());
  state->load_mass = message.load_mass;
  state->load_moment = GetVector3(message.load_moment);
  const bool unit = std::abs(state->base_orientation.norm() - 1.0) < 1e-6;
  // Dynamics ask for more than a message's rounding leaves.
  if (unit) state->base_orientation.normalize();
  return unit && state->base_position.allFinite() && state->base_linear_velocity.allFinite() &&
         state->base_angular_velocity.allFinite() && state->joint_position.allFinite() &&
         state->joint_velocity.allFinite() && std::isfinite(state->load_mass) &&
         state->load_moment.allFinite();
}

void SetPose(const Eigen::Isometry3d& pose, pose_t* message) {
  SetVector3(pose.translation(), message->position);
  SetQuaternion(Eigen::Quaterniond(pose.linear()), message->orientation);
}

Eigen::Isometry3d GetPose(const pose_t& message) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const double* q = message.orientation;
  pose.linear() = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  pose.translation() = GetVector3(message.position);
  return pose;
}

void SetWrench(const Eigen::Ref<const balance::Vector6d>& wrench, wrench_t* message) {
  SetVector3(wrench.head<3>(), message->force);
  SetVector3(wrench.tail<3>(), message->moment);
}

balance::Vector6d GetWrench(const wrench_t& message) {
  balance::Vector6d wrench;
  wrench << GetVector3(message.force), GetVector3(message.moment);
  return wrench;
}

void SetMargins(const balance::ContactMargins& margins, contact_margins_t* message) {
  message->normal = margins.normal;
  message->friction = margins.friction;
  message->yaw = margins.yaw;
  message->roll = margins.roll;
  message->pitch = margins.pitch;
}

void SetVector3(const Eigen::Vector3d& vector, double (&array)[3]) {
  std::copy_n(vector.data(), 3, array);
}

Eigen::Vector3d GetVector3(const double (&array)[3]) {
  return Eigen::Map<const Eigen::Vector3d>(array);
}

void SetQuaternion(const Eigen::Quaterniond& quaternion, double (&array)[4]) {
  array[0] = quaternion.w();
  array[1] = quaternion.x();
  array[2] = quaternion.y();
  array[3] = quaternion.z();
}

double SoleMargin(const robot::RobotModel& model) {
  constexpr double kShare = 1.0 / 15;  // of the half width: 5 mm of the paper's robot
  return kShare * SoleRadius(model);
}

double SoleRadius(const robot::RobotModel& model) {
  return std::min(robot::InnerRadius(model.feet()[0]), robot::InnerRadius(model.feet()[1]));
}

double HullMargin(const robot::RobotModel& model) {
  // With the share η the sole d/2 away draws the centre of pressure inwards by η d.
  constexpr double kLeastShare = 0.025;  // eta_min, and a quarter more
  return SoleMargin(model) + kLeastShare * robot::StandingSpacing(model);
}

ContactLimitsConfig WithinSoles(ContactLimitsConfig config, const robot::RobotModel& model,
                                double margin) {
  const robot::FootModel &right = model.feet()[robot::Foot::kRight],
                         &left = model.feet()[robot::Foot::kLeft];
  if (!right.rectangular() || !left.rectangular()) {
    balance::ConvexPolygon common = balance::SolePolygon(right, margin);
    const balance::HalfPlanes edges = balance::EdgesOf(balance::SolePolygon(left, margin));
    for (const balance::HalfPlane& edge : edges.planes()) {
      common = balance::Clip(common, edge);
    }
    const Eigen::Vector2d half = balance::LargestRectangle(
        balance::EdgesOf(common), {config.half_length(), config.half_width()});
    if (!config.has_half_length()) config.set_half_length(half.x());
    if (!config.has_half_width()) config.set_half_width(half.y());
    return config;
  }
  if (!config.has_half_length()) {
    config.set_half_length(std::min(right.length, left.length) / 2 - margin);
  }
  if (!config.has_half_width()) {
    config.set_half_width(std::min(right.width, left.width) / 2 - margin);
  }
  return config;
}

balance::ContactLimits ReadLimits(const ContactLimitsConfig& config, const std::string& field) {
  RequireFields(config, {"half_length", "half_width"}, field + ".");
  CheckFields(config, field + ".");  // they may follow from soles and a margin
  balance::ContactLimits limits;
  limits.half_length = config.half_length();
  limits.half_width = config.half_width();
  limits.friction = config.friction();
  limits.yaw_friction = config.yaw_friction();
  return limits;
}

balance::SoleLimits ReadSoleLimits(const ContactLimitsConfig& config,
                                   const robot::RobotModel& model, double margin,
                                   const std::string& field) {
  const bool rectangles = std::ranges::all_of(model.feet(), &robot::FootModel::rectangular);
  const balance::ContactLimits both = ReadLimits(WithinSoles(config, model, margin), field);
  balance::SoleLimits limits(both);
  if (rectangles) return limits;
  for (const robot::Foot f : robot::kFeet) {
    balance::ConvexPolygon sole = balance::SolePolygon(model.feet()[f], margin);
    for (const double sign : {1.0, -1.0}) {
      if (config.has_half_length()) sole = balance::Clip(sole, {{sign, 0}, both.half_length});
      if (config.has_half_width()) sole = balance::Clip(sole, {{0, sign}, both.half_width});
    }
    limits[f].edges = balance::EdgesOf(sole);
    if (limits[f].edges.count == 0) {
      throw ConfigError(field, "leaves nothing of the " + model.feet()[f].name +
                                   " foot's sole; raise half_length and half_width");
    }
  }
  return limits;
}

}  // namespace poise
