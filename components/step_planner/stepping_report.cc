#include "components/step_planner/stepping_report.h"

#include <algorithm>

#include "components/messages/conversions.h"

namespace poise {

int8_t SteppingCode(stepping::Stage stage) {
  switch (stage) {
    case stepping::Stage::kUnloading:
      return support_plan_t::STEPPING_UNLOADING;
    case stepping::Stage::kSwinging:
      return support_plan_t::STEPPING_SWINGING;
    case stepping::Stage::kLoading:
      return support_plan_t::STEPPING_LOADING;
    case stepping::Stage::kShifting:
    case stepping::Stage::kCatching:
      return support_plan_t::STEPPING_CATCHING;
    case stepping::Stage::kIdle:
      break;
  }
  return support_plan_t::STEPPING_NONE;
}

int8_t ReasonCode(stepping::StepReason reason) {
  switch (reason) {
    case stepping::StepReason::kPersistent:
      return support_plan_t::REASON_PERSISTENT;
    case stepping::StepReason::kSure:
      return support_plan_t::REASON_SURE;
    case stepping::StepReason::kDeadline:
      return support_plan_t::REASON_DEADLINE;
    case stepping::StepReason::kLingering:
      return support_plan_t::REASON_LINGERING;
    case stepping::StepReason::kAgain:
      return support_plan_t::REASON_AGAIN;
    case stepping::StepReason::kWalk:
      return support_plan_t::REASON_WALK;
    case stepping::StepReason::kTogether:
      return support_plan_t::REASON_TOGETHER;
    case stepping::StepReason::kNone:
      break;
  }
  return support_plan_t::REASON_NONE;
}

void ReportStepping(const stepping::Recovery& recovery, double time,
                    const robot::FootArray<Eigen::Isometry3d>& sole, support_plan_t* plan) {
  plan->stepping = SteppingCode(recovery.stage());
  if (recovery.stage() == stepping::Stage::kIdle) {
    plan->touch_down_time = 0;
    return;
  }
  const bool under_way = recovery.stage() == stepping::Stage::kUnloading ||
                         recovery.stage() == stepping::Stage::kSwinging;
  const stepping::StepPlan& step = recovery.plan();
  const double ground = sole[robot::Index(Other(step.foot))].translation().z();
  plan->step_reason = ReasonCode(recovery.reason());
  plan->step_foot = static_cast<int8_t>(step.foot);
  SetVector3({step.foothold.x(), step.foothold.y(), ground}, plan->foothold);
  plan->touch_down_time = under_way ? std::max(0.0, recovery.touch_down() - time) : 0;
  plan->foothold_margin = step.margin;
}

namespace {

int8_t WalkCode(stepping::WalkStage stage) {
  switch (stage) {
    case stepping::WalkStage::kStarting:
    case stepping::WalkStage::kUnloading:
      return support_plan_t::STEPPING_UNLOADING;
    case stepping::WalkStage::kSwinging:
    case stepping::WalkStage::kTouching:
      return support_plan_t::STEPPING_SWINGING;
    case stepping::WalkStage::kLoading:
      return support_plan_t::STEPPING_LOADING;
    case stepping::WalkStage::kStopping:
      return support_plan_t::STEPPING_CATCHING;
    case stepping::WalkStage::kStanding:
      break;
  }
  return support_plan_t::STEPPING_NONE;
}

}  // namespace

void ReportWalking(const stepping::QuasiStaticWalk& walk, double time,
                   const robot::FootArray<Eigen::Isometry3d>& sole, support_plan_t* plan) {
  plan->stepping = WalkCode(walk.stage());
  if (!walk.active()) {
    plan->touch_down_time = 0;
    SetVector3(Eigen::Vector3d::Zero(), plan->walk_velocity);
    return;
  }
  const bool swings = walk.stage() == stepping::WalkStage::kSwinging;
  const bool landed = walk.stage() == stepping::WalkStage::kLoading ||
                      walk.stage() == stepping::WalkStage::kStopping;
  const robot::Foot foot = landed ? Other(walk.stepping_foot()) : walk.stepping_foot();
  const double ground = sole[robot::Index(Other(foot))].translation().z();
  const Eigen::Vector2d foothold =
      landed ? Eigen::Vector2d(sole[robot::Index(foot)].translation().head<2>())
             : walk.foothold().position;
  plan->step_reason = support_plan_t::REASON_WALK;
  plan->step_foot = static_cast<int8_t>(foot);
  SetVector3({foothold.x(), foothold.y(), ground}, plan->foothold);
  plan->touch_down_time = swings ? std::max(0.0, walk.touch_down() - time) : 0;
  ReportCommand(walk.command(), plan);
}

void ReportCommand(const stepping::WalkCommand& command, support_plan_t* plan) {
  SetVector3({command.velocity.x(), command.velocity.y(), command.turn_rate}, plan->walk_velocity);
}

}  // namespace poise
