#include "components/redistributor/yielding_legs.h"

#include <algorithm>
#include <cmath>

namespace poise {
namespace {

using robot::Foot;
using robot::FootArray;
using robot::kFeet;

constexpr double kLoadShare = 0.6;     // of the command, below which a leg yields; chosen
constexpr double kLightLoad = 0.1;     // of the weight: what a foot bears of so little is no sign
constexpr double kFullLoad = 0.3;      // of the weight, asked of a foot: one that bears it is down
constexpr double kBounceTime = 10e-3;  // s, of the low-pass on a load: bounces are shorter
constexpr double kDeviations = 2;      // of the reading, which may show less than the foot bears
constexpr double kYieldTime = 5e-3;    // s, rotor's inertia over damping
// What does not stand yields once a standing leg's share is below this: with 1 a bounce would hold
// up a step.
constexpr double kGroundShare = 0.25;

}  // namespace

YieldingLegs::YieldingLegs(const robot::RobotModel& model, double period)
    : load_gain_(1 - std::exp(-period / kBounceTime)),
      light_load_(kLightLoad * model.total_mass() * robot::kGravity),
      full_load_(kFullLoad * model.total_mass() * robot::kGravity) {
  for (int j = 0; j < model.num_joints(); ++j) {
    const auto index = static_cast<size_t>(j);
    joints_.push_back({.index = index,
                       .carries = model.CarriedFeet(j),
                       .damping = model.motors()[index].reflected_inertia / kYieldTime});
  }
}

double YieldingLegs::BorneShare(Foot foot, const robot_state_t& measured,
                                const joint_command_t& command) {
  const size_t i = Index(foot);
  const double hidden = kDeviations * measured.foot_wrench_deviation[i].force[2];
  const double now = -measured.foot_wrench[i].force[2] + hidden, most = load_[foot] + hidden;
  const double asked = -command.foot_wrench[i].force[2];
  const double needed = kLoadShare * (std::abs(asked) - light_load_);
  if (asked > full_load_ && std::min(now, most) >= needed) has_borne_[foot] = true;
  return has_borne_[foot] && needed > 0 && most < needed ? std::max(most, 0.0) / needed : 1;
}

void YieldingLegs::Yield(const FootArray<bool>& in_contact, const robot_state_t& measured,
                         joint_command_t* command) {
  FootArray<double> borne(1.0);
  double standing = Count(in_contact) > 0 ? 0.0 : 1.0;
  for (const Foot f : kFeet) {
    const double load = -measured.foot_wrench[Index(f)].force[2];
    if (std::isfinite(load)) load_[f] += load_gain_ * (load - load_[f]);
    has_borne_[f] = has_borne_[f] && in_contact[f];
    if (!in_contact[f]) continue;
    borne[f] = BorneShare(f, measured, *command);
    standing = std::max(standing, borne[f]);
  }
  // What the ground does not bear turns the body when a leg is thrown.
  const double free = std::min(1.0, standing / kGroundShare);
  for (const Foot f : kFeet) {
    if (!in_contact[f]) borne[f] = free;
  }
  any_ = false;
  for (const Joint& joint : joints_) {
    double share = Count(joint.carries) > 0 ? 0.0 : free;
    for (const Foot f : kFeet) {
      if (joint.carries[f]) share = std::max(share, borne[f]);
    }
    if (share == 1) continue;
    any_ = true;
    const size_t j = joint.index;
    command->torque[j] =
        share * command->torque[j] - (1 - share) * joint.damping * measured.joint_velocity[j];
    command->stiffness[j] *= share;
    command->damping[j] *= share;
  }
}

}  // namespace poise
