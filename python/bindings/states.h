// Functions on the rows of arrays, and on states of a robot, one a row.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>

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

/// The numbers of one row of each argument.
using Row = const double* const*;

/// What a function on rows is given: rows of `shape`, which an error calls `name`.
struct RowArgument {
  const Array& array;
  const char* name;
  Shape shape;
};

/// Writes a matrix's numbers in C order; returns where the next ones go.
inline double* Put(const Eigen::Ref<const Eigen::MatrixXd>& matrix, double* to) {
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      to, matrix.rows(), matrix.cols()) = matrix;
  return to + matrix.size();
}
inline double* Put(const Eigen::Isometry3d& pose, double* to) { return Put(pose.matrix(), to); }
template <class Of>
double* Put(const robot::FootArray<Of>& feet, double* to) {
  for (const Of& foot : feet) to = Put(foot, to);
  return to;
}

/// Numbers of a row.
inline py::ssize_t SizeOf(const Shape& shape) {
  return std::accumulate(shape.begin(), shape.end(), py::ssize_t{1}, std::multiplies<>());
}

/// `count` rows of `shape`, each from `of(i, from, to)`, without the interpreter's lock. NaN stands
/// where its answer is false. Throws ValueError when an argument has other rows.
template <class Of>
py::array_t<double> Rows(py::ssize_t count, const std::vector<RowArgument>& given, Shape shape,
                         const Of& of) {
  std::vector<const double*> from;
  for (const RowArgument& argument : given) {
    CheckShape(argument.array, argument.name, count, argument.shape);
    from.push_back(argument.array.data());
  }
  const py::ssize_t size = SizeOf(shape);
  shape.insert(shape.begin(), count);
  py::array_t<double> result(shape);
  double* to = result.mutable_data();
  const py::gil_scoped_release released;
  for (py::ssize_t i = 0; i < count; ++i, to += size) {
    if (!of(i, from.data(), to)) std::fill_n(to, size, std::numeric_limits<double>::quiet_NaN());
    for (size_t k = 0; k < from.size(); ++k) from[k] += SizeOf(given[k].shape);
  }
  return result;
}

/// Rows of `of(from, to)`, as many as the first argument has.
template <class Of>
py::array_t<double> EachRow(const std::vector<RowArgument>& given, const Shape& shape,
                            const Of& of) {
  const Array& first = given.front().array;
  return Rows(first.ndim() > 0 ? first.shape(0) : 0, given, shape,
              [&](py::ssize_t, Row from, double* to) { return of(from, to); });
}

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
  /// Row `i`, the quaternion normalised. False when a number is not finite or the quaternion is
  /// zero: there is no such state. Precondition: Check.
  bool Read(py::ssize_t i, robot::RobotState* state) const {
    const py::ssize_t joints = q_.shape(1);
    state->joint_position = Eigen::Map<const Eigen::VectorXd>(q_.data() + i * joints, joints);
    const double* const velocity = v_.data() + i * (joints + 6);
    state->base_linear_velocity = Eigen::Map<const Eigen::Vector3d>(velocity);
    state->base_angular_velocity = Eigen::Map<const Eigen::Vector3d>(velocity + 3);
    state->joint_velocity = Eigen::Map<const Eigen::VectorXd>(velocity + 6, joints);
    state->base_position = Eigen::Map<const Eigen::Vector3d>(position_.data() + 3 * i);
    const double* const w = orientation_.data() + 4 * i;
    Eigen::Quaterniond turn(w[0], w[1], w[2], w[3]);
    const double norm = turn.norm();
    if (!(norm > 1e-9) || !std::isfinite(norm)) return false;
    turn.coeffs() /= norm;
    state->base_orientation = turn;
    return state->joint_position.allFinite() && state->joint_velocity.allFinite() &&
           state->base_linear_velocity.allFinite() && state->base_angular_velocity.allFinite() &&
           state->base_position.allFinite();
  }

 private:
  Array q_, v_, position_, orientation_;
};

/// Rows of `of(state, from, to)`; what is no state has no result.
template <class Of>
py::array_t<double> EachState(const robot::RobotModel& model, const StateArrays& states,
                              const std::vector<RowArgument>& given, const Shape& shape,
                              const Of& of) {
  const py::ssize_t count = states.Check(model);
  robot::RobotState state(model.num_joints());
  return Rows(count, given, shape, [&](py::ssize_t i, Row from, double* to) {
    return states.Read(i, &state) && of(state, from, to);
  });
}

}  // namespace poise::python
