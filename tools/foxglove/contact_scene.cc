#include "tools/foxglove/contact_scene.h"

#include <cmath>
#include <vector>

#include "components/balance/support_polygon.h"
#include "components/messages/conversions.h"
#include "tools/foxglove/scene_parts.h"

namespace poise {
namespace {

using Eigen::Vector3d;
using logging::TickMessages;

// As on the page of a run (web/src/picture/scene.js).
constexpr SceneColor kComputed{0.26, 0.50, 0.95}, kMeasured{0.95, 0.95, 0.95};
constexpr SceneColor kPush{0.95, 0.40, 0.10}, kOutline{0.50, 0.58, 0.70};
constexpr SceneColor kRegion{0.92, 0.20, 0.20}, kCapture{0.90, 0.78, 0.20};
constexpr SceneColor kCom{0.15, 0.75, 0.45}, kFoothold{0.90, 0.55, 0.95};

constexpr double kLeastPush = 3;                 // N: below it the sensor's noise
constexpr double kMetresPerNewton = 1.0 / 900;   // of arrow
constexpr double kPushScale = 1.5;               // of a push's arrow beside the ground's
constexpr double kThick = 0.018, kThin = 0.011;  // m, of arrows
constexpr double kLine = 0.004;                  // m
constexpr double kAbove = 1e-3;                  // m that marks lie above what they lie on

constexpr double kComSize = 0.044, kMark = 0.022, kSmallMark = 0.015;  // m

std::vector<Vector3d> Placed(const Eigen::Isometry3d& frame,
                             std::span<const Eigen::Vector2d> corners) {
  std::vector<Vector3d> points;
  for (const Eigen::Vector2d& corner : corners) {
    points.push_back(frame * Vector3d(corner.x(), corner.y(), kAbove));
  }
  return points;
}

/// True ones where the tick has them; empty when it has none.
std::vector<pose_t> SolePoses(const TickMessages& tick) {
  if (tick.truth) return tick.truth->foot_pose;
  if (tick.planner) return tick.planner->foot_pose;
  return {};
}

/// Adds the forces of the wrenches, none where `cop` is not known.
void AddFootForces(const TickMessages& tick, const std::vector<wrench_t>& wrenches,
                   double (derived::foot_t::*cop)[2], const char* id, double diameter,
                   const SceneColor& color, foxglove::SceneUpdate* scene) {
  foxglove::SceneEntity* const entity = AddEntity(tick.utime, kWorldFrame, id, scene);
  if (!tick.derived) return;
  const std::vector<pose_t> soles = SolePoses(tick);
  for (size_t f = 0; f < std::min({wrenches.size(), soles.size(), tick.derived->foot.size()});
       ++f) {
    const double(&at)[2] = tick.derived->foot[f].*cop;
    if (!std::isfinite(at[0]) || !std::isfinite(at[1])) continue;
    const Eigen::Isometry3d sole = GetPose(soles[f]);
    // What the ground does to the robot.
    const Vector3d force = -(sole.linear() * GetVector3(wrenches[f].force));
    AddArrow(sole * Vector3d(at[0], at[1], 0), kMetresPerNewton * force, diameter, color, entity);
  }
}

}  // namespace

ContactScene::ContactScene(const robot::RobotModel& model) {
  for (const robot::FootModel& foot : model.feet()) {
    soles_.push_back(balance::SolePolygon(foot, 0));
  }
}

foxglove::SceneUpdate ContactScene::Forces(const TickMessages& tick) const {
  foxglove::SceneUpdate scene;
  const std::vector<wrench_t> none;
  AddFootForces(tick, tick.command ? tick.command->foot_wrench : none,
                &derived::foot_t::cop_computed, "computed forces", kThick, kComputed, &scene);
  // As the controller knows them: read, or observed where there is no good sensor.
  AddFootForces(tick, tick.state ? tick.state->foot_wrench : none, &derived::foot_t::cop_measured,
                "measured forces", kThin, kMeasured, &scene);
  foxglove::SceneEntity* const push = AddEntity(tick.utime, kWorldFrame, "push", &scene);
  if (tick.push && GetVector3(tick.push->force).norm() > kLeastPush) {
    const Vector3d arrow = kPushScale * kMetresPerNewton * GetVector3(tick.push->force);
    AddArrow(GetVector3(tick.push->point) - arrow, arrow, kThick, kPush, push);
  }
  return scene;
}

foxglove::SceneUpdate ContactScene::Support(const TickMessages& tick) const {
  foxglove::SceneUpdate scene;
  const auto entity = [&](const char* id) {
    return AddEntity(tick.utime, kWorldFrame, id, &scene);
  };
  const std::vector<pose_t> soles = SolePoses(tick);
  foxglove::SceneEntity* const outlines = entity("soles");
  for (size_t f = 0; f < std::min(soles.size(), soles_.size()); ++f) {
    AddLoop(Placed(GetPose(soles[f]), soles_[f].corners()), kLine, kOutline, outlines);
  }

  foxglove::SceneEntity* const polygon = entity("support polygon");
  foxglove::SceneEntity* const region = entity("region of the centre of pressure");
  foxglove::SceneEntity* const computed = entity("computed centre of pressure");
  if (tick.balance) {
    const balance_torque_t& balance = *tick.balance;
    const Eigen::Isometry3d frame = GetPose(balance.frame_o);
    std::vector<Eigen::Vector2d> corners;
    for (size_t f = 0; f < std::min(soles.size(), soles_.size()); ++f) {
      if (balance.in_contact[f] == 0) continue;
      for (const Eigen::Vector2d& corner : soles_[f].corners()) {
        const Vector3d point = GetPose(soles[f]) * Vector3d(corner.x(), corner.y(), 0);
        corners.push_back((frame.inverse() * point).head<2>());
      }
    }
    AddLoop(Placed(frame, balance::ConvexHull(corners).corners()), kLine / 2, kOutline, polygon);
    corners.clear();
    for (int i = 0; i < std::min<int>(balance.num_corners, 16); ++i) {
      corners.emplace_back(balance.corner_x[i], balance.corner_y[i]);
    }
    AddLoop(Placed(frame, corners), kLine, kRegion, region);
    AddSphere(frame * Vector3d(balance.cop[0], balance.cop[1], kAbove), kMark, kComputed, computed);
  }

  foxglove::SceneEntity* const measured = entity("measured centre of pressure");
  if (tick.derived) {
    const Vector3d place = GetVector3(tick.derived->cop_measured_place);
    if (place.allFinite()) AddSphere(place, kSmallMark, kMeasured, measured);
  }

  foxglove::SceneEntity* const capture = entity("capture point");
  foxglove::SceneEntity* const foothold = entity("foothold");
  foxglove::SceneEntity* const com = entity("centre of mass");
  if (tick.planner) {
    const planner_status_t& planner = *tick.planner;
    AddSphere(GetVector3(planner.capture_point), kMark, kCapture, capture);
    if (tick.plan && planner.stepping != planner_status_t::STEPPING_NONE &&
        planner.step_foot >= 0 && static_cast<size_t>(planner.step_foot) < soles_.size()) {
      // The footprint that is aimed at, turned as the foot's reference is.
      const auto foot = static_cast<size_t>(planner.step_foot);
      Eigen::Isometry3d print = Eigen::Isometry3d::Identity();
      print.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
          tick.plan->foot_rotation_reference[foot].rotation);
      print.translation() = GetVector3(planner.foothold);
      AddLoop(Placed(print, soles_[foot].corners()), kLine, kFoothold, foothold);
    }
  }
  if (tick.truth) {
    AddSphere(GetVector3(tick.truth->com_position), kComSize, kCom, com);
  } else if (tick.planner) {
    AddSphere(GetVector3(tick.planner->com_position), kComSize, kCom, com);
  }
  return scene;
}

}  // namespace poise
