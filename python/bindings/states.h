// States of a robot in arrays, one a row.
#pragma once

#include <cmath>
#include <memory>

#include "components/robot/robot_model.h"
#include "python/bindings/bindings.h"

namespace poise::python {

/// A robot that Python holds. Immutable.
class RobotHandle {
 public:
  explicit RobotHandle(robot::RobotModel model)
      : model_(std::make_shared<const robot::RobotModel>(std::move(model))) {}
  const robot::RobotModel& model() const { return *model_; }
  std::shared_ptr<const robot::RobotModel> shared() const { return model_; }

 private:
  std::shared_ptr<const robot::RobotModel> model_;
};

/// The numbers of a StateArrays: alive as long as that.
struct StatePointers {
  const double *q, *v, *position, *orientation;
  py::ssize_t joints;

  /// Row `i`, the quaternion normalised. False when a number is not finite or the quaternion is
  /// zero: there is no such state.
  bool Read(py::ssize_t i, robot::RobotState* state) const {
    state->joint_position = Eigen::Map<const Eigen::VectorXd>(q + i * joints, joints);
    const double* const velocity = v + i * (joints + 6);
    state->base_linear_velocity = Eigen::Map<const Eigen::Vector3d>(velocity);
    state->base_angular_velocity = Eigen::Map<const Eigen::Vector3d>(velocity + 3);
    state->joint_velocity = Eigen::Map<const Eigen::VectorXd>(velocity + 6, joints);
    state->base_position = Eigen::Map<const Eigen::Vector3d>(position + 3 * i);
    const double* const w = orientation + 4 * i;
    Eigen::Quaterniond turn(w[0], w[1], w[2], w[3]);
    const double norm = turn.norm();
    if (!(norm > 1e-9) || !std::isfinite(norm)) return false;
    turn.coeffs() /= norm;
    state->base_orientation = turn;
    return state->joint_position.allFinite() && state->joint_velocity.allFinite() &&
           state->base_linear_velocity.allFinite() && state->base_angular_velocity.allFinite() &&
           state->base_position.allFinite();
  }
};

/// q (N×k), v (N×(k+6)), base position (N×3, m) and orientation (N×4: w, x, y, z).
class StateArrays {
 public:
  StateArrays(Array q, Array v, Array position, Array orientation)
      : q_(std::move(q)),
        v_(std::move(v)),
        position_(std::move(position)),
        orientation_(std::move(orientation)) {}

  /// Their number. Throws ValueError when a shape does not fit the robot.
  py::ssize_t Check(const robot::RobotModel& model) const {
    const py::ssize_t count = q_.ndim() > 0 ? q_.shape(0) : 0;
    CheckShape(q_, "q", count, {model.num_joints()});
    CheckShape(v_, "v", count, {model.num_velocities()});
    CheckShape(position_, "base_position", count, {3});
    CheckShape(orientation_, "base_orientation", count, {4});
    return count;
  }
  /// Precondition: Check.
  StatePointers Pointers() const {
    return {q_.data(), v_.data(), position_.data(), orientation_.data(), q_.shape(1)};
  }

 private:
  Array q_, v_, position_, orientation_;
};

}  // namespace poise::python
