// The redistributor: the ratio η, the contact transition and the torque that moves wrench between
// the feet, (47)–(53).
#pragma once

#include <limits>
#include <memory>
#include <optional>

#include "components/balance/contact_conditions.h"
#include "components/balance/distribution_ratio.h"
#include "components/balance/whole_body.h"
#include "components/framework/component_type.h"
#include "components/framework/operator_acts.h"
#include "components/redistributor/internal_feedback.h"
#include "components/redistributor/ratio_moves.h"
#include "components/redistributor/shared_impedance.h"
#include "components/redistributor/swing_friction.h"
#include "components/redistributor/yielding_legs.h"
#include "components/robot/robot_model.h"
#include "poise/balance_torque_t.hpp"
#include "poise/joint_command_t.hpp"
#include "poise/robot_state_t.hpp"
#include "poise/support_plan_t.hpp"

namespace poise {

/// ROBOT_STATE, SUPPORT_PLAN, BALANCE_TORQUE -> JOINT_COMMAND. In single support the torque passes
/// through. With STATUS_INVALID_INPUT (the balance torque is held or not finite) the last good
/// command is sent again; when there is a fresh torque but no resultant, that torque
/// passes through undistributed, with the same status. The hardware bridge refuses either as stale:
/// it holds its last accepted command for a few cycles, then damps the joints, then stops.
class Redistributor : public Component {
 public:
  void Configure(const ComponentContext& context, Wiring* wiring) override;
  bool Archive(StateArchive* archive) override;

 private:
  using Wrenches = robot::FootArray<balance::Vector6d>;

  void AddSettings(double tick_period);
  void Prepare();
  void Redistribute(const Tick& tick);
  int8_t ComputeDouble(const Tick& tick);
  int8_t ComputeSingle(const robot::FootArray<bool>& in_contact);
  /// `interval` less the ratios that leave a landed foot less than its share; never empty.
  balance::RatioInterval KeepLanded(balance::RatioInterval interval);
  /// η on the ramp of section 6.2, within `both`, what the conditions of both feet allow; where no
  /// ratio keeps them all, within what those of the loaded foot allow.
  double RampedRatio(double free_ratio, const balance::RatioInterval& both,
                     const balance::Vector6d& resultant,
                     robot::FootArray<Eigen::Isometry3d> sole_in_o) const;
  /// Adds what answers the measured wrenches to the command; `sole_in_o` as distributed, `desired`
  /// in the sole frames.
  void AddFeedback(const Tick& tick, const robot::FootArray<Eigen::Isometry3d>& sole_in_o,
                   const Wrenches& desired);
  /// A foot's centre of pressure is nearer than feedback_edge_ to the edge of its sole.
  bool AboutToTip(const Wrenches& desired) const;
  /// Share of the feedback that acts at this ratio and in a transition: none without load, so that
  /// a change of support makes no step.
  double FeedbackShare(double eta) const;
  /// Adds to the command what follows from the motion that its torque is computed to cause.
  void FollowMotion(const robot::FootArray<bool>& in_contact);
  void ForgetDistribution();
  void PassTorqueThrough();
  void Report(const Wrenches& wrench, const balance::SoleLimits& limits,
              const robot::FootArray<bool>& in_contact);

  Input<robot_state_t> robot_state_;
  Input<support_plan_t> support_plan_;
  Input<balance_torque_t> balance_torque_;
  ActInput operator_;
  Output<joint_command_t> joint_command_;

  std::shared_ptr<const robot::RobotModel> model_;
  std::shared_ptr<balance::WholeBody> whole_body_;
  bool redistribution_ = true, transition_ = true;
  double eta_min_ = 0, eta_max_ = 1;
  double landed_share_ = 0;
  std::optional<robot::Foot> landed_foot_;
  RatioMoves ratio_moves_;
  InternalFeedback feedback_;
  PlannedImpedance impedance_;
  YieldingLegs yielding_legs_;
  SwingFriction swing_friction_;
  double feedback_edge_ = 0;  // m
  // A reading answers to the last distribution, which these are of; index −1: none.
  int64_t last_index_ = -1;
  double last_time_ = 0;  // s
  double last_eta_ = 0;
  // s, when readings tell of the distribution again.
  double learn_from_ = -std::numeric_limits<double>::infinity();
  balance::SoleLimits double_support_, single_support_;
  // double_support_'s edges make these, sole frames; empty for rectangles, which both feet have
  // alike.
  robot::FootArray<balance::ConvexPolygon> sole_;
  robot::RobotState state_;
  bool state_valid_ = false;
  Eigen::MatrixXd contact_jacobian_;  // 12×n
  Eigen::VectorXd torque_;            // k×1
  Eigen::VectorXd peak_torque_;       // k×1, N·m
  Eigen::VectorXd acceleration_;      // n×1
};

ComponentType RedistributorType();

}  // namespace poise
