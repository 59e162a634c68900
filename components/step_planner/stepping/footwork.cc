#include "components/step_planner/stepping/footwork.h"

#include <algorithm>
#include <cmath>

namespace poise::stepping {
namespace {

// Share of gravity by which the COM's height may be accelerated: the soles stay loaded.
constexpr double kHeightShare = 0.25;
constexpr double kLeastHeight = 0.1;  // m, of the COM above the ground: below, it has fallen

}  // namespace

void StepOutput::Archive(StateArchive* archive) {
  archive->Show(in_contact, transition, progress, foot, com, swing, swing_rotation, foot_state, cop,
                cop_reference);
}

double Yaw(const Eigen::Isometry3d& pose) {
  return std::atan2(pose.linear()(1, 0), pose.linear()(0, 0));
}

StepState Observe(const StepInput& input, const FootArray<bool>& in_contact, double momentum) {
  StepState state;
  state.in_contact = in_contact;
  double ground = 0, feet = 0;
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  for (const Foot i : kFeet) {
    state.sole[i] = input.sole[i].translation().head<2>();
    state.sole_yaw[i] = Yaw(input.sole[i]);
    if (!in_contact[i]) continue;
    ground += input.sole[i].translation().z();
    heading += input.sole[i].linear().col(0).head<2>();
    feet += 1;
  }
  state.yaw = std::atan2(heading.y(), heading.x());
  const double height = std::max(input.com.z() - ground / std::max(feet, 1.0), kLeastHeight);
  const Eigen::Vector2d turning(input.angular_momentum.y(), -input.angular_momentum.x());
  state.pendulum = {input.com.head<2>(), input.com_velocity.head<2>() + momentum / height * turning,
                    std::sqrt(robot::kGravity / height)};
  return state;
}

void DampedLead::Follow(double wanted, double period) {
  const double most = kHeightShare * robot::kGravity;
  point_.acceleration = std::clamp(
      rate_ * rate_ * (wanted - point_.position) - 2 * rate_ * point_.velocity, -most, most);
  point_.velocity += period * point_.acceleration;
  point_.position += period * point_.velocity;
}

void BodyHeading::Follow(double stance, double other, double period) {
  const double heading = stance + 0.5 * std::remainder(other - stance, 2 * M_PI);
  const double yaw = turned_.point().position;
  turned_.Follow(yaw + std::remainder(heading - start_ - yaw, 2 * M_PI), period);
}

PointMotion LeadByCop(const StepInput& input, const Quintic::Point& height,
                      const Eigen::Vector3d& cop) {
  const double rate =
      (robot::kGravity + height.acceleration) / std::max(input.com.z() - cop.z(), kLeastHeight);
  PointMotion com;
  com.position << input.com.head<2>(), height.position;
  com.velocity << input.com_velocity.head<2>(), height.velocity;
  com.acceleration << rate * (input.com.head<2>() - cop.head<2>()), height.acceleration;
  return com;
}

}  // namespace poise::stepping
