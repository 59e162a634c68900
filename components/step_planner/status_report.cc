#include "components/step_planner/status_report.h"

#include <algorithm>

#include "components/messages/conversions.h"

namespace poise {
namespace {

using robot::Foot;
using robot::kFeet;

// m from the soles' edge that a foot can be put down at the most, of the step that is announced.
constexpr double kStepReach = 0.4;
// A step is needed once the capture point has been 0.01 m beyond the soles for 0.1 s: of 145 pushes
// that stood none raised this alarm, as the turning body brings a capture point back that is out
// for a moment (docs/reference/balance.md).
constexpr double kNeededExcess = 0.01, kNeededDuration = 0.1;

// Both count alike.
static_assert(DONE == planner_status_t::OUTCOME_DONE &&
              TIMEOUT == planner_status_t::OUTCOME_TIMEOUT);

int8_t WaitingCode(const SupportView& view) {
  const WaitingFor waiting = view.schedule.state().waiting_for;
  const auto retracted = [&view](Foot f) {
    return !view.in_contact[f] && view.landing[f].state() == Landing::State::kRetracted;
  };
  return waiting == WaitingFor::kContact && std::ranges::any_of(kFeet, retracted)
             ? planner_status_t::WAITING_NO_SURFACE
             : static_cast<int8_t>(waiting);
}

int8_t StageCode(stepping::Stage stage) {
  switch (stage) {
    case stepping::Stage::kStanding:
      return planner_status_t::STEPPING_NONE;
    case stepping::Stage::kUnloading:
      return planner_status_t::STEPPING_UNLOADING;
    case stepping::Stage::kSwinging:
    case stepping::Stage::kTouching:
      return planner_status_t::STEPPING_SWINGING;
    case stepping::Stage::kLoading:
      return planner_status_t::STEPPING_LOADING;
    case stepping::Stage::kShifting:
    case stepping::Stage::kCatching:
      break;
  }
  return planner_status_t::STEPPING_CATCHING;
}

}  // namespace

void ReportPhase(const SupportView& view, double time, planner_status_t* status) {
  planner_status_t& out = *status;
  const ScheduleState& schedule = view.schedule.state();
  out.phase = schedule.phase;
  out.phase_time = time - schedule.phase_start;
  out.next_phase = view.schedule.next();
  out.phase_left = view.held ? -1 : view.schedule.TimeLeft(time);
  out.began_by =
      schedule.first ? planner_status_t::OUTCOME_NONE : static_cast<int8_t>(schedule.began_by);
  out.waiting_for = view.held ? planner_status_t::WAITING_NONE : WaitingCode(view);
}

void ReportRobot(const SupportView& view, const robot::RobotData& data, planner_status_t* status) {
  planner_status_t& out = *status;
  SetVector3(data.com, out.com_position);
  SetVector3(data.com_velocity, out.com_velocity);
  const int next = view.schedule.next();
  const robot::FootArray<bool> then = view.steps != nullptr ? robot::FootArray<bool>(true)
                                      : next == PhaseGraph::kNone || view.held
                                          ? view.in_contact
                                          : ContactsOf(view.schedule.phase(next).support());
  for (const Foot f : kFeet) {
    out.next_in_contact[Index(f)] = then[f] ? 1 : 0;
    out.foot_state[Index(f)] =
        view.in_contact[f] ? planner_status_t::FOOT_SUPPORT
                           : static_cast<int8_t>(view.steps != nullptr ? view.steps->foot_state
                                                                       : view.landing[f].state());
    SetPose(data.foot_pose[f], &out.foot_pose[Index(f)]);
  }
}

void ReportStepping(const stepping::StepStatus& own, const stepping::WalkCommand& command,
                    double time, const robot::FootArray<Eigen::Isometry3d>& sole,
                    planner_status_t* status) {
  planner_status_t& out = *status;
  const stepping::Footstep& step = own.step;
  out.stepping = StageCode(own.stage);
  out.touch_down_time = own.under_way ? std::max(0.0, step.touch_down - time) : 0;
  SetVector3({command.velocity.x(), command.velocity.y(), command.turn_rate}, out.walk_velocity);
  if (own.stage == stepping::Stage::kStanding) return;
  const double ground = sole[Other(step.foot)].translation().z();
  out.step_reason = static_cast<int8_t>(own.reason);
  out.step_foot = static_cast<int8_t>(step.foot);
  SetVector3({step.at.position.x(), step.at.position.y(), ground}, out.foothold);
  out.foothold_margin = own.margin;
}

void MonitorCapture(double time, const Eigen::Isometry3d& frame_o,
                    const balance::ConvexPolygon& soles, const balance::CapturePoint& pendulum,
                    HeldCondition* step_needed, planner_status_t* status) {
  planner_status_t& out = *status;
  const auto world = [&](const Eigen::Vector2d& point) -> Eigen::Vector3d {
    return frame_o * Eigen::Vector3d(point.x(), point.y(), 0);
  };
  SetVector3(world(pendulum.position), out.capture_point);
  out.capture_margin = balance::SignedDistance(soles, pendulum.position);
  const bool outside = out.capture_margin < -kNeededExcess;
  out.step_needed = step_needed->Update(time, outside, kNeededDuration) ? 1 : 0;
  balance::Step step;
  if (out.step_needed != 0 && out.capture_margin < 0) {
    step = balance::LatestStep(soles, pendulum, kStepReach);
    SetVector3(world(step.position), out.step_position);
  } else if (out.step_needed == 0) {
    SetVector3(Eigen::Vector3d::Zero(), out.step_position);
  }
  out.step_time = step.time;
}

}  // namespace poise
