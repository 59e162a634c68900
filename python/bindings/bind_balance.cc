// The paper's mathematics on arrays: contacts, distribution, balancing.
#include <algorithm>
#include <limits>
#include <optional>

#include "components/balance/balance_control.h"
#include "components/balance/capture_point.h"
#include "components/balance/contact_conditions.h"
#include "components/balance/distribution_ratio.h"
#include "components/balance/redistribution.h"
#include "components/balance/support_polygon.h"
#include "components/balance/task_dynamics.h"
#include "components/balance/whole_body.h"
#include "python/bindings/states.h"

namespace poise::python {
namespace {

using balance::ContactLimits;
using balance::ConvexPolygon;
using balance::Vector6d;
using Eigen::Isometry3d;
using Feet = std::array<bool, 2>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

py::ssize_t CountOf(const Array& array) { return array.ndim() > 0 ? array.shape(0) : 0; }

Isometry3d PoseAt(const double* from) {
  Isometry3d pose = Isometry3d::Identity();
  pose.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(from);
  return pose;
}
std::array<Isometry3d, 2> PosesAt(const double* from) { return {PoseAt(from), PoseAt(from + 16)}; }
Vector6d WrenchAt(const double* from) { return Eigen::Map<const Vector6d>(from); }

/// Friction, yaw friction, half length, half width.
ContactLimits LimitsOf(const std::array<double, 4>& limits) {
  ContactLimits result;
  result.friction = limits[0];
  result.yaw_friction = limits[1];
  result.half_length = limits[2];
  result.half_width = limits[3];
  return result;
}

/// Corners of any convex polygon, their hull. Throws ValueError: not c×2, or too many.
ConvexPolygon PolygonOf(const Array& corners) {
  if (corners.ndim() != 2 || corners.shape(1) != 2) {
    throw py::value_error("polygon: must be corners × 2");
  }
  if (corners.shape(0) > ConvexPolygon::kMaxCorners) {
    throw py::value_error("polygon: has more than 32 corners");
  }
  std::vector<Eigen::Vector2d> points;
  for (py::ssize_t i = 0; i < corners.shape(0); ++i) {
    points.emplace_back(corners.at(i, 0), corners.at(i, 1));
  }
  ConvexPolygon polygon = balance::ConvexHull(points);
  if (polygon.num_corners == 0) throw py::value_error("polygon: has no finite corner");
  return polygon;
}

py::array_t<double> ArrayOf(const ConvexPolygon& polygon) {
  py::array_t<double> array({static_cast<py::ssize_t>(polygon.num_corners), py::ssize_t{2}});
  for (py::ssize_t i = 0; i < polygon.num_corners; ++i) {
    const Eigen::Vector2d& corner = polygon.corners()[static_cast<size_t>(i)];
    array.mutable_at(i, 0) = corner.x();
    array.mutable_at(i, 1) = corner.y();
  }
  return array;
}

py::array_t<double> FrameOOf(const Array& soles, const Feet& in_contact) {
  const py::ssize_t count = CountOf(soles);
  CheckShape(soles, "soles", count, {2, 4, 4});
  py::array_t<double> result({count, py::ssize_t{4}, py::ssize_t{4}});
  const double* const from = soles.data();
  double* const to = result.mutable_data();
  const py::gil_scoped_release released;
  for (py::ssize_t i = 0; i < count; ++i) {
    Isometry3d frame;
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> out(to + 16 * i);
    if (balance::FrameO(PosesAt(from + 32 * i), in_contact, &frame)) {
      out = frame.matrix();
    } else {
      out.setConstant(kNan);
    }
  }
  return result;
}

py::array_t<double> WrenchTransformOf(const Array& frame, const Array& sole) {
  const py::ssize_t count = CountOf(frame);
  CheckShape(frame, "frame", count, {4, 4});
  CheckShape(sole, "sole", count, {4, 4});
  py::array_t<double> result({count, py::ssize_t{6}, py::ssize_t{6}});
  const double* const of = frame.data();
  const double* const from = sole.data();
  double* const to = result.mutable_data();
  const py::gil_scoped_release released;
  for (py::ssize_t i = 0; i < count; ++i) {
    Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(to + 36 * i) =
        balance::WrenchTransform(PoseAt(of + 16 * i), PoseAt(from + 16 * i));
  }
  return result;
}

py::array_t<double> CopOf(const Array& wrench) {
  const py::ssize_t count = CountOf(wrench);
  CheckShape(wrench, "wrench", count, {6});
  py::array_t<double> result({count, py::ssize_t{2}});
  const double* const from = wrench.data();
  double* const to = result.mutable_data();
  const py::gil_scoped_release released;
  for (py::ssize_t i = 0; i < count; ++i) {
    Eigen::Map<Eigen::Vector2d>(to + 2 * i) = balance::CenterOfPressure(WrenchAt(from + 6 * i));
  }
  return result;
}

py::array_t<double> Margins(const Array& wrench, const std::array<double, 4>& limits) {
  const py::ssize_t count = CountOf(wrench);
  CheckShape(wrench, "wrench", count, {6});
  py::array_t<double> result({count, py::ssize_t{5}});
  const double* const from = wrench.data();
  double* to = result.mutable_data();
  const ContactLimits of = LimitsOf(limits);
  const py::gil_scoped_release released;
  for (py::ssize_t i = 0; i < count; ++i) {
    const balance::ContactMargins margins = balance::CheckContact(WrenchAt(from + 6 * i), of);
    for (const double margin :
         {margins.normal, margins.friction, margins.yaw, margins.roll, margins.pitch}) {
      *to++ = margin;
    }
  }
  return result;
}

/// feasible, min, max, optimal and the ratio to use, a column each.
py::array_t<double> Ratio(const Array& resultant, const Array& feet,
                          const std::array<double, 4>& limits, double least, double most) {
  const py::ssize_t count = CountOf(resultant);
  CheckShape(resultant, "resultant", count, {6});
  CheckShape(feet, "feet", count, {2, 4, 4});
  if (!(least >= 0 && least <= most && most <= 1)) {
    throw py::value_error("eta_min and eta_max: must be 0 ≤ eta_min ≤ eta_max ≤ 1");
  }
  py::array_t<double> result({count, py::ssize_t{5}});
  const double* const of = resultant.data();
  const double* const from = feet.data();
  double* to = result.mutable_data();
  const ContactLimits with = LimitsOf(limits);
  const py::gil_scoped_release released;
  for (py::ssize_t i = 0; i < count; ++i) {
    const Vector6d wrench = WrenchAt(of + 6 * i);
    const std::array<Isometry3d, 2> soles = PosesAt(from + 32 * i);
    const balance::RatioInterval interval =
        balance::FeasibleRatio(wrench, soles, with, least, most);
    *to++ = interval.feasible ? 1 : 0;
    *to++ = interval.feasible ? interval.min : kNan;
    *to++ = interval.feasible ? interval.max : kNan;
    *to++ = interval.optimal;
    *to++ = balance::SelectRatio(interval, wrench, soles, with, least, most);
  }
  return result;
}

py::array_t<double> Distribute(const Array& resultant, const Array& feet, const Array& eta) {
  const py::ssize_t count = CountOf(resultant);
  CheckShape(resultant, "resultant", count, {6});
  CheckShape(feet, "feet", count, {2, 4, 4});
  CheckShape(eta, "eta", count, {});
  py::array_t<double> result({count, py::ssize_t{2}, py::ssize_t{6}});
  const double* const of = resultant.data();
  const double* const from = feet.data();
  const double* const ratio = eta.data();
  double* const to = result.mutable_data();
  const py::gil_scoped_release released;
  for (py::ssize_t i = 0; i < count; ++i) {
    const std::array<Vector6d, 2> shares =
        balance::DistributeResultant(WrenchAt(of + 6 * i), PosesAt(from + 32 * i), ratio[i]);
    Eigen::Map<Vector6d>(to + 12 * i) = shares[0];
    Eigen::Map<Vector6d>(to + 12 * i + 6) = shares[1];
  }
  return result;
}

py::array_t<double> Redistribution(const Array& jacobian, const Array& change) {
  const py::ssize_t count = CountOf(jacobian);
  const py::ssize_t n = jacobian.ndim() == 3 ? jacobian.shape(2) : 0;
  CheckShape(jacobian, "contact_jacobian", count, {12, n});
  CheckShape(change, "wrench_change", count, {12});
  if (n <= 6) throw py::value_error("contact_jacobian: must be 12 × (joints + 6)");
  py::array_t<double> result({count, n - 6});
  const double* const of = jacobian.data();
  const double* const from = change.data();
  double* const to = result.mutable_data();
  const py::gil_scoped_release released;
  Eigen::MatrixXd now(12, n);
  Eigen::VectorXd torque(n - 6), wrench(12);
  for (py::ssize_t i = 0; i < count; ++i) {
    now = Eigen::Map<const RowMajor>(of + 12 * n * i, 12, n);
    wrench = Eigen::Map<const Eigen::VectorXd>(from + 12 * i, 12);
    balance::RedistributionTorque(now, wrench, torque);
    Eigen::Map<Eigen::VectorXd>(to + (n - 6) * i, n - 6) = torque;
  }
  return result;
}

/// x, y (m, frame O) and ω (rad/s), a column each; NaN where there is none.
py::array_t<double> Capture(const Array& frame, const Array& com, const Array& velocity,
                            const Array& momentum, double gravity) {
  const py::ssize_t count = CountOf(frame);
  CheckShape(frame, "frame", count, {4, 4});
  CheckShape(com, "com", count, {3});
  CheckShape(velocity, "com_velocity", count, {3});
  CheckShape(momentum, "angular_momentum", count, {3});
  py::array_t<double> result({count, py::ssize_t{3}});
  const double* const frames = frame.data();
  const double* const coms = com.data();
  const double* const velocities = velocity.data();
  const double* const momenta = momentum.data();
  double* const to = result.mutable_data();
  const py::gil_scoped_release released;
  for (py::ssize_t i = 0; i < count; ++i) {
    const auto at = [&](const double* from) {
      return Eigen::Vector3d(from[3 * i], from[3 * i + 1], from[3 * i + 2]);
    };
    balance::CapturePoint point;
    const bool good = balance::ComputeCapturePoint(PoseAt(frames + 16 * i), at(coms),
                                                   at(velocities), at(momenta), gravity, &point);
    to[3 * i] = good ? point.position.x() : kNan;
    to[3 * i + 1] = good ? point.position.y() : kNan;
    to[3 * i + 2] = good ? point.frequency : kNan;
  }
  return result;
}

/// nearest x, y, and the signed distance, a column each.
py::array_t<double> Nearest(const Array& corners, const Array& points) {
  const ConvexPolygon polygon = PolygonOf(corners);
  const py::ssize_t count = CountOf(points);
  CheckShape(points, "points", count, {2});
  py::array_t<double> result({count, py::ssize_t{3}});
  const double* const from = points.data();
  double* const to = result.mutable_data();
  const py::gil_scoped_release released;
  for (py::ssize_t i = 0; i < count; ++i) {
    const Eigen::Vector2d point(from[2 * i], from[2 * i + 1]);
    const bool good = point.allFinite();
    const Eigen::Vector2d nearest =
        good ? balance::NearestPoint(polygon, point) : Eigen::Vector2d::Constant(kNan).eval();
    to[3 * i] = nearest.x();
    to[3 * i + 1] = nearest.y();
    to[3 * i + 2] = good ? balance::SignedDistance(polygon, point) : kNan;
  }
  return result;
}

py::array_t<double> Support(const RobotHandle& robot, const Array& frame, const Array& soles,
                            const Feet& in_contact, double margin) {
  CheckShape(frame, "frame", 4, {4});
  CheckShape(soles, "soles", 2, {4, 4});
  balance::ContactGeometry geometry;
  geometry.sole = PosesAt(soles.data());
  geometry.in_contact = in_contact;
  const robot::FootArray<robot::FootModel>& feet = robot.model().feet();
  const std::array<ConvexPolygon, 2> polygons = {balance::SolePolygon(feet[0], margin),
                                                 balance::SolePolygon(feet[1], margin)};
  return ArrayOf(balance::SupportPolygon(PoseAt(frame.data()), geometry, polygons));
}

/// (24) of task rows J, J̇ q̇ and the wanted acceleration; NaN where the tasks cannot be.
py::array_t<double> TaskTorqueOf(const RobotHandle& robot, const StateArrays& states,
                                 const Feet& in_contact, const Array& jacobian, const Array& bias,
                                 const Array& wanted) {
  const py::ssize_t count = states.Check(robot.model());
  const py::ssize_t k = robot.model().num_joints();
  const py::ssize_t rows = jacobian.ndim() == 3 ? jacobian.shape(1) : 0;
  CheckShape(jacobian, "jacobian", count, {rows, k + 6});
  CheckShape(bias, "bias_acceleration", count, {rows});
  CheckShape(wanted, "acceleration", count, {rows});
  if (rows < 1 || rows > k) throw py::value_error("jacobian: must have 1 to num_joints rows");
  if (!in_contact[0] && !in_contact[1]) {
    throw py::value_error("in_contact: a foot must be in contact");
  }
  py::array_t<double> result({count, k});
  const double* const jacobians = jacobian.data();
  const double* const biases = bias.data();
  const double* const accelerations = wanted.data();
  double* const to = result.mutable_data();
  const StatePointers pointers = states.Pointers();
  const py::gil_scoped_release released;
  balance::WholeBody body(robot.shared());
  balance::TaskDynamics task(static_cast<int>(k), static_cast<int>(rows));
  robot::RobotState state(robot.model().num_joints());
  Eigen::MatrixXd rows_now(rows, k + 6);
  Eigen::VectorXd bias_now(rows), wanted_now(rows), torque(k);
  for (py::ssize_t i = 0; i < count; ++i) {
    rows_now = Eigen::Map<const RowMajor>(jacobians + i * rows * (k + 6), rows, k + 6);
    bias_now = Eigen::Map<const Eigen::VectorXd>(biases + i * rows, rows);
    wanted_now = Eigen::Map<const Eigen::VectorXd>(accelerations + i * rows, rows);
    if (pointers.Read(i, &state) && body.Update(state, in_contact) &&
        task.Compute(body.contact(), rows_now, bias_now)) {
      task.TaskTorque(wanted_now, torque);
    } else {
      torque.setConstant(kNan);
    }
    Eigen::Map<Eigen::VectorXd>(to + i * k, k) = torque;
  }
  return result;
}

/// (39)–(46): the torque, then the centres of pressure before and after and whether it balanced.
py::tuple Balance(const RobotHandle& robot, const StateArrays& states, const Feet& in_contact,
                  const Array& torque, const Array& region, bool legs_only) {
  const py::ssize_t count = states.Check(robot.model());
  const py::ssize_t k = robot.model().num_joints();
  CheckShape(torque, "torque", count, {k});
  const ConvexPolygon polygon = PolygonOf(region);
  if (!in_contact[0] && !in_contact[1]) {
    throw py::value_error("in_contact: a foot must be in contact");
  }
  py::array_t<double> result({count, k});
  py::array_t<double> cop({count, py::ssize_t{2}, py::ssize_t{2}});
  py::array_t<bool> active(count);
  const double* const from = torque.data();
  double* const to = result.mutable_data();
  double* const cops = cop.mutable_data();
  bool* const actives = active.mutable_data();
  const StatePointers pointers = states.Pointers();
  {
    const py::gil_scoped_release released;
    balance::WholeBody body(robot.shared());
    balance::TaskDynamics height(static_cast<int>(k), 1);
    balance::BalanceControl control(static_cast<int>(k), 1);
    robot::RobotState state(robot.model().num_joints());
    Eigen::VectorXd now(k);
    Eigen::MatrixXd row(1, k + 6);
    Eigen::VectorXd bias(1);
    for (py::ssize_t i = 0; i < count; ++i) {
      now = Eigen::Map<const Eigen::VectorXd>(from + i * k, k);
      balance::BalanceResult balanced;
      bool good = pointers.Read(i, &state) && body.Update(state, in_contact);
      if (good) {
        row = body.data().com_jacobian.bottomRows(1);
        bias[0] = body.data().com_bias_acceleration.z();
        good =
            height.Compute(body.contact(), row, bias) &&
            control.Compute(body.contact(), height, body.geometry(), polygon, true, now, &balanced,
                            legs_only ? balance::Movers::kLegs : balance::Movers::kAllJoints) ==
                balance::BalanceStatus::kOk;
      }
      if (!good) {
        now.setConstant(kNan);
        balanced.cop_task.setConstant(kNan);
        balanced.cop.setConstant(kNan);
      }
      Eigen::Map<Eigen::VectorXd>(to + i * k, k) = now;
      Eigen::Map<Eigen::Vector2d>(cops + 4 * i) = balanced.cop_task;
      Eigen::Map<Eigen::Vector2d>(cops + 4 * i + 2) = balanced.cop;
      actives[i] = good && (balanced.active_x || balanced.active_y);
    }
  }
  return py::make_tuple(result, cop, active);
}

}  // namespace

void BindBalance(py::module_* module) {
  module->def("frame_o", &FrameOOf);
  module->def("wrench_transform", &WrenchTransformOf);
  module->def("center_of_pressure", &CopOf);
  module->def("contact_margins", &Margins);
  module->def("ratio", &Ratio);
  module->def("distribute", &Distribute);
  module->def("redistribution_torque", &Redistribution);
  module->def("capture_point", &Capture);
  module->def("nearest", &Nearest);
  module->def("support_polygon", &Support);
  module->def("task_torque", &TaskTorqueOf);
  module->def("balance", &Balance);
}

}  // namespace poise::python
