// The contact wrench monitor: expected wrenches (34), resultant (35), conditions (29)–(38),
// balancing (39)–(46).
#pragma once

#include <memory>
#include <optional>

#include "components/balance/balance_control.h"
#include "components/balance/convex_polygon.h"
#include "components/balance/joint_limits.h"
#include "components/balance/step/step_balance.h"
#include "components/balance/task_dynamics.h"
#include "components/balance/whole_body.h"
#include "components/framework/component_type.h"
#include "components/framework/operator_acts.h"
#include "components/robot/robot_model.h"
#include "poise/balance_torque_t.hpp"
#include "poise/robot_state_t.hpp"
#include "poise/support_plan_t.hpp"
#include "poise/task_torque_t.hpp"

namespace poise {

/// ROBOT_STATE, SUPPORT_PLAN, TASK_TORQUE -> BALANCE_TORQUE. The protected task is the COM's
/// height. When the task torque is held from an earlier tick, or the dynamics do not exist, it is
/// passed on without a balancing part and the status says so; the contact quantities are then those
/// of the last good tick.
class ContactWrenchMonitor : public Component {
 public:
  void Configure(const ComponentContext& context, Wiring* wiring) override;
  bool Archive(StateArchive* archive) override;

 private:
  void AddSettings(double tick_period);
  void Prepare();
  void Balance();
  /// Dynamics and protected task for these contacts; STATUS_*.
  int8_t ComputeDynamics(const robot::FootArray<bool>& in_contact);
  int8_t ComputeBalance(const robot::FootArray<bool>& in_contact);
  /// BalanceControl by the configured movers, within the joints' limits. torque_ on entry the task
  /// torque.
  template <class Bounds>
  balance::BalanceStatus Move(const balance::ContactGeometry& geometry, const Bounds& bounds,
                              balance::BalanceResult* result);
  /// Mixes what all joints do with what the legs alone do, both of which bring the centre of
  /// pressure to its bound, so that no joint goes beyond a limit.
  template <class Bounds>
  void MoveOthers(const balance::ContactGeometry& geometry, const Bounds& bounds,
                  balance::BalanceResult* result);
  /// Leg joints that torque_ would drive beyond a limit, and the task torque less so, keep the task
  /// torque's acceleration; false when there is none or they cannot.
  template <class Bounds>
  bool KeepLimits(const balance::ContactGeometry& geometry, const Bounds& bounds,
                  balance::BalanceResult* result);
  /// Balances by StepBalance while the planner makes steps, which holds the COM's height and the
  /// feet in the air. False, and torque_ as it was, where it finds nothing.
  bool MoveForStep(const balance::ContactGeometry& geometry, const balance::ConvexPolygon& region,
                   balance::BalanceResult* result);
  balance::ContactLimits Limits(const robot::FootArray<bool>& in_contact) const;
  /// Both soles less `margin`, m: x at toe and heel, y at the sides. ConfigError: nothing is left.
  void CutSoles(const Eigen::Vector2d& margin,
                robot::FootArray<balance::ConvexPolygon>* soles) const;
  /// The hull of the soles in contact, less the margin.
  balance::ConvexPolygon Soles(const Eigen::Isometry3d& frame_o) const;
  void Report(const balance::BalanceResult& result, const balance::ContactLimits& limits,
              const balance::ConvexPolygon& region, const robot::FootArray<bool>& in_contact);

  Input<robot_state_t> robot_state_;
  Input<support_plan_t> support_plan_;
  Input<task_torque_t> task_torque_;
  ActInput operator_;
  Output<balance_torque_t> balance_torque_;

  std::shared_ptr<const robot::RobotModel> model_;
  std::shared_ptr<balance::WholeBody> whole_body_;
  std::optional<balance::TaskDynamics> com_height_;
  std::optional<balance::BalanceControl> balance_control_;
  bool balancing_ = true;
  bool all_joints_ = false;                         // move, not the legs alone
  std::optional<balance::JointLimits> limits_;      // none: they do not enter the control
  std::optional<balance::TaskDynamics> protected_;  // the COM's height and joints at their limits
  Eigen::MatrixXd protected_jacobian_;
  Eigen::VectorXd protected_bias_, task_acceleration_, acceleration_, other_torque_;
  std::optional<balance::StepBalance> step_balance_;
  balance::StepBounds step_bounds_;
  Eigen::MatrixXd step_jacobian_;  // of what a step holds
  Eigen::VectorXd step_weight_;
  Eigen::VectorXd peak_torque_;  // N·m, by joint
  balance::ContactLimits double_support_, single_support_;
  std::optional<double> beyond_soles_;  // m
  bool polygon_ = false;                // the region is the soles' hull
  // The soles less the margin, m, sole frames: of a foot alone on the ground, and of one beside the
  // other.
  robot::FootArray<balance::ConvexPolygon> sole_, shared_sole_;
  robot::RobotState state_;
  bool state_valid_ = false;
  robot::FootArray<bool> in_contact_{true, true};  // of the last tick
  Eigen::MatrixXd height_jacobian_;                // 1×n
  Eigen::VectorXd height_bias_;                    // 1×1
  Eigen::VectorXd torque_;
  Eigen::VectorXd foot_wrench_;  // room for both feet
};

ComponentType ContactWrenchMonitorType();

}  // namespace poise
