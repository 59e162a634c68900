// The paper's mathematics on arrays: contacts, distribution, balancing.
#include <algorithm>
#include <limits>

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
  return EachRow({{soles, "soles", {2, 4, 4}}}, {4, 4}, [&](Row from, double* to) {
    Isometry3d frame = Isometry3d::Identity();
    const bool good = balance::FrameO(PosesAt(from[0]), in_contact, &frame);
    Put(frame.matrix(), to);
    return good;
  });
}

py::array_t<double> WrenchTransformOf(const Array& frame, const Array& sole) {
  return EachRow({{frame, "frame", {4, 4}}, {sole, "sole", {4, 4}}}, {6, 6},
                 [](Row from, double* to) {
                   return Put(balance::WrenchTransform(PoseAt(from[0]), PoseAt(from[1])), to);
                 });
}

py::array_t<double> CopOf(const Array& wrench) {
  return EachRow({{wrench, "wrench", {6}}}, {2}, [](Row from, double* to) {
    return Put(balance::CenterOfPressure(WrenchAt(from[0])), to);
  });
}

py::array_t<double> Margins(const Array& wrench, const std::array<double, 4>& limits) {
  return EachRow({{wrench, "wrench", {6}}}, {5}, [of = LimitsOf(limits)](Row from, double* to) {
    const balance::ContactMargins m = balance::CheckContact(WrenchAt(from[0]), of);
    return std::ranges::copy(std::array{m.normal, m.friction, m.yaw, m.roll, m.pitch}, to).out;
  });
}

/// feasible, min, max, optimal and the ratio to use, a column each.
py::array_t<double> Ratio(const Array& resultant, const Array& feet,
                          const std::array<double, 4>& limits, double least, double most) {
  if (!(least >= 0 && least <= most && most <= 1)) {
    throw py::value_error("eta_min and eta_max: must be 0 ≤ eta_min ≤ eta_max ≤ 1");
  }
  return EachRow({{resultant, "resultant", {6}}, {feet, "feet", {2, 4, 4}}}, {5},
                 [=, with = LimitsOf(limits)](Row from, double* to) {
                   const Vector6d wrench = WrenchAt(from[0]);
                   const std::array<Isometry3d, 2> soles = PosesAt(from[1]);
                   const balance::RatioInterval interval =
                       balance::FeasibleRatio(wrench, soles, with, least, most);
                   to[0] = interval.feasible ? 1 : 0;
                   to[1] = interval.feasible ? interval.min : kNan;
                   to[2] = interval.feasible ? interval.max : kNan;
                   to[3] = interval.optimal;
                   to[4] = balance::SelectRatio(interval, wrench, soles, with, least, most);
                   return true;
                 });
}

py::array_t<double> Distribute(const Array& resultant, const Array& feet, const Array& eta) {
  return EachRow({{resultant, "resultant", {6}}, {feet, "feet", {2, 4, 4}}, {eta, "eta", {}}},
                 {2, 6}, [](Row from, double* to) {
                   const std::array<Vector6d, 2> shares =
                       balance::DistributeResultant(WrenchAt(from[0]), PosesAt(from[1]), *from[2]);
                   return Put(shares[1], Put(shares[0], to));
                 });
}

py::array_t<double> Redistribution(const Array& jacobian, const Array& change) {
  const py::ssize_t n = jacobian.ndim() == 3 ? jacobian.shape(2) : 0;
  CheckShape(jacobian, "contact_jacobian", CountOf(jacobian), {12, n});
  if (n <= 6) throw py::value_error("contact_jacobian: must be 12 × (joints + 6)");
  Eigen::MatrixXd now(12, n);
  Eigen::VectorXd torque(n - 6), wrench(12);
  return EachRow({{jacobian, "contact_jacobian", {12, n}}, {change, "wrench_change", {12}}},
                 {n - 6}, [&](Row from, double* to) {
                   now = Eigen::Map<const RowMajor>(from[0], 12, n);
                   wrench = Eigen::Map<const Eigen::VectorXd>(from[1], 12);
                   balance::RedistributionTorque(now, wrench, torque);
                   return Put(torque, to);
                 });
}

/// x, y (m, frame O) and ω (rad/s), a column each; NaN where there is none.
py::array_t<double> Capture(const Array& frame, const Array& com, const Array& velocity,
                            const Array& momentum, double gravity) {
  return EachRow({{frame, "frame", {4, 4}},
                  {com, "com", {3}},
                  {velocity, "com_velocity", {3}},
                  {momentum, "angular_momentum", {3}}},
                 {3}, [&](Row from, double* to) {
                   const auto at = [&](size_t k) { return Eigen::Vector3d(from[k]); };
                   balance::CapturePoint point;
                   const bool good = balance::ComputeCapturePoint(PoseAt(from[0]), at(1), at(2),
                                                                  at(3), gravity, &point);
                   *Put(point.position, to) = point.frequency;
                   return good;
                 });
}

/// nearest x, y, and the signed distance, a column each.
py::array_t<double> Nearest(const Array& corners, const Array& points) {
  return EachRow(
      {{points, "points", {2}}}, {3}, [polygon = PolygonOf(corners)](Row from, double* to) {
        const Eigen::Vector2d point(from[0]);
        if (!point.allFinite()) return false;
        *Put(balance::NearestPoint(polygon, point), to) = balance::SignedDistance(polygon, point);
        return true;
      });
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

void CheckAnyContact(const Feet& in_contact) {
  if (in_contact[0] || in_contact[1]) return;
  throw py::value_error("in_contact: a foot must be in contact");
}

/// (24) of task rows J, J̇ q̇ and the wanted acceleration; NaN where the tasks cannot be.
py::array_t<double> TaskTorqueOf(const RobotHandle& robot, const StateArrays& states,
                                 const Feet& in_contact, const Array& jacobian, const Array& bias,
                                 const Array& wanted) {
  const py::ssize_t k = robot.model().num_joints();
  const py::ssize_t rows = jacobian.ndim() == 3 ? jacobian.shape(1) : 0;
  CheckShape(jacobian, "jacobian", states.Check(robot.model()), {rows, k + 6});
  if (rows < 1 || rows > k) throw py::value_error("jacobian: must have 1 to num_joints rows");
  CheckAnyContact(in_contact);
  balance::WholeBody body(robot.shared());
  balance::TaskDynamics task(static_cast<int>(k), static_cast<int>(rows));
  Eigen::MatrixXd rows_now(rows, k + 6);
  Eigen::VectorXd bias_now(rows), wanted_now(rows), torque(k);
  return EachState(
      robot.model(), states,
      {{jacobian, "jacobian", {rows, k + 6}},
       {bias, "bias_acceleration", {rows}},
       {wanted, "acceleration", {rows}}},
      {k}, [&](const robot::RobotState& state, Row from, double* to) {
        rows_now = Eigen::Map<const RowMajor>(from[0], rows, k + 6);
        bias_now = Eigen::Map<const Eigen::VectorXd>(from[1], rows);
        wanted_now = Eigen::Map<const Eigen::VectorXd>(from[2], rows);
        if (!body.Update(state, in_contact) || !task.Compute(body.contact(), rows_now, bias_now)) {
          return false;
        }
        task.TaskTorque(wanted_now, torque);
        Put(torque, to);
        return true;
      });
}

/// (39)–(46): the torque, the centres of pressure before and after, and 1 where it balanced, else
/// 0.
py::array_t<double> Balance(const RobotHandle& robot, const StateArrays& states,
                            const Feet& in_contact, const Array& torque, const Array& region,
                            bool legs_only) {
  const py::ssize_t k = robot.model().num_joints();
  const ConvexPolygon polygon = PolygonOf(region);
  CheckAnyContact(in_contact);
  balance::WholeBody body(robot.shared());
  balance::TaskDynamics height(static_cast<int>(k), 1);
  balance::BalanceControl control(static_cast<int>(k), 1);
  Eigen::VectorXd now(k);
  Eigen::MatrixXd row(1, k + 6);
  Eigen::VectorXd bias(1);
  const auto movers = legs_only ? balance::Movers::kLegs : balance::Movers::kAllJoints;
  return EachState(robot.model(), states, {{torque, "torque", {k}}}, {k + 5},
                   [&](const robot::RobotState& state, Row from, double* to) {
                     now = Eigen::Map<const Eigen::VectorXd>(from[0], k);
                     if (!body.Update(state, in_contact)) return false;
                     row = body.data().com_jacobian.bottomRows(1);
                     bias[0] = body.data().com_bias_acceleration.z();
                     balance::BalanceResult balanced;
                     if (!height.Compute(body.contact(), row, bias) ||
                         control.Compute(body.contact(), height, body.geometry(), polygon, true,
                                         now, &balanced, movers) != balance::BalanceStatus::kOk) {
                       return false;
                     }
                     to = Put(balanced.cop, Put(balanced.cop_task, Put(now, to)));
                     *to = balanced.active_x || balanced.active_y ? 1 : 0;
                     return true;
                   });
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
