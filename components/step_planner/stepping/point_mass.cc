#include "components/step_planner/stepping/point_mass.h"

#include <algorithm>
#include <utility>

#include "components/robot/posture.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;

constexpr double kSoleMargin = 0.01;  // m that standing keeps the centre of pressure off an edge

}  // namespace

PointMass::PointMass(const robot::RobotModel& model, Recovery recovery)
    : feet_{model.feet()[0], model.feet()[1]},
      mass_(model.total_mass()),
      height_(robot::StandingHeight(model)),
      recovery_(std::move(recovery)),
      com_(0, 0, height_) {
  for (const Foot foot : kFeet) {
    sole_[Index(foot)] = Eigen::Isometry3d(
        Eigen::Translation3d(0, 0.5 * Side(foot) * robot::StandingSpacing(model), 0));
  }
}

void PointMass::LiftLeft(double z) {
  com_.y() = sole(Foot::kRight).translation().y();
  sole_[Index(Foot::kLeft)].translation().z() = z;
  in_contact_[Foot::kLeft] = false;
}

balance::ConvexPolygon PointMass::Soles(double margin) const {
  balance::ConvexPolygon soles;
  for (const Foot foot : kFeet) {
    if (!in_contact_[foot]) continue;
    soles = HullOf(soles, SoleAt(feet_[foot], margin, sole(foot).translation().head<2>(), 0));
  }
  return soles;
}

bool PointMass::Loaded(Foot foot) const {
  return in_contact_[foot] || sole(foot).translation().z() <= ground_;
}

bool PointMass::fallen() const {
  return !(-balance::SignedDistance(Soles(0), com_.head<2>()) < height_);
}

bool PointMass::Tick(double period, const Vector2d& force) {
  StepInput input;
  input.time = time_;
  input.com = com_;
  input.com_velocity = velocity_;
  input.sole = sole_;
  for (const Foot foot : kFeet) input.load[foot] = Loaded(foot) ? 0.5 * mass_ * robot::kGravity : 0;
  input.in_contact = in_contact_;
  input.free_foot = {.position = sole(Foot::kLeft).translation()};
  input.com_height = height_;
  input.command = command_;
  const bool active = recovery_.Update(input);
  Vector2d acceleration;
  if (active) {
    const StepOutput& output = recovery_.output();
    in_contact_ = output.in_contact;
    for (const Foot foot : kFeet) {
      if (in_contact_[foot]) continue;
      Eigen::Isometry3d& sole = sole_[Index(foot)];
      sole.translation() = output.swing.position;
      sole.linear() = output.swing_rotation.rotation;
      // The ground stops it.
      double& z = sole.translation().z();
      if (recovery_.stage() == Stage::kSwinging && output.swing.velocity.z() < 0) {
        z = std::max(z, ground_);
      }
    }
    acceleration = output.com.acceleration.head<2>();
    // The height is followed exactly.
    com_.z() = output.com.position.z();
    velocity_.z() = output.com.velocity.z();
  } else {
    // Standing: the centre of pressure brings the capture point back as fast as the soles allow.
    const Vector2d middle =
        0.5 * (sole(Foot::kRight).translation() + sole(Foot::kLeft).translation()).head<2>();
    const Vector2d goal =
        in_contact_[Foot::kLeft] ? middle : Vector2d(sole(Foot::kRight).translation().head<2>());
    const Vector2d cop = balance::NearestPoint(Soles(kSoleMargin), 2 * capture_point() - goal);
    acceleration = frequency() * frequency() * (com_.head<2>() - cop);
  }
  acceleration += force / mass_;
  time_ += period;
  com_.head<2>() += period * velocity_.head<2>() + 0.5 * period * period * acceleration;
  velocity_.head<2>() += period * acceleration;
  return active;
}

}  // namespace poise::stepping
