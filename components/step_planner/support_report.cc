#include "components/step_planner/support_report.h"

#include "components/balance/support_polygon.h"
#include "components/messages/conversions.h"
#include "components/messages/motion.h"

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

int8_t TransitionCode(TransitionKind kind) {
  switch (kind) {
    case TransitionKind::kUnloading:
      return support_plan_t::TRANSITION_UNLOADING;
    case TransitionKind::kLoading:
      return support_plan_t::TRANSITION_LOADING;
    case TransitionKind::kNone:
      break;
  }
  return support_plan_t::TRANSITION_NONE;
}

int8_t OutcomeCode(Outcome outcome) {
  switch (outcome) {
    case DONE:
      return support_plan_t::OUTCOME_DONE;
    case NO_SURFACE:
      return support_plan_t::OUTCOME_NO_SURFACE;
    case CONTACT_LOST:
      return support_plan_t::OUTCOME_CONTACT_LOST;
    case TIMEOUT:
      return support_plan_t::OUTCOME_TIMEOUT;
  }
  return support_plan_t::OUTCOME_NONE;
}

int8_t FootCode(Landing::State state) {
  switch (state) {
    case Landing::State::kSearching:
      return support_plan_t::FOOT_SEARCHING;
    case Landing::State::kTouching:
      return support_plan_t::FOOT_TOUCHING;
    case Landing::State::kRetracted:
      return support_plan_t::FOOT_RETRACTED;
    case Landing::State::kSwing:
      break;
  }
  return support_plan_t::FOOT_SWING;
}

int8_t WaitingCode(const SupportView& view) {
  switch (view.schedule.state().waiting_for) {
    case WaitingFor::kCom:
      return support_plan_t::WAITING_COM;
    case WaitingFor::kContact:
      for (const Foot f : kFeet) {
        if (!view.in_contact[f] && view.landing[f].state() == Landing::State::kRetracted) {
          return support_plan_t::WAITING_NO_SURFACE;
        }
      }
      return support_plan_t::WAITING_CONTACT;
    case WaitingFor::kNothing:
      break;
  }
  return support_plan_t::WAITING_NONE;
}

}  // namespace

void ReportPhase(const SupportView& view, double time, support_plan_t* plan) {
  support_plan_t& out = *plan;
  const ScheduleState& schedule = view.schedule.state();
  out.phase = schedule.phase;
  out.phase_time = time - schedule.phase_start;
  out.began_by = schedule.first ? support_plan_t::OUTCOME_NONE : OutcomeCode(schedule.began_by);
  out.waiting_for = WaitingCode(view);
  out.gravity_compensation = view.schedule.phase().gravity_compensation() ? 1 : 0;
  out.transition = TransitionCode(schedule.transition);
  out.transition_foot =
      schedule.transition_foot ? static_cast<int8_t>(*schedule.transition_foot) : int8_t{-1};
  out.transition_progress = schedule.progress;
  if (!view.held) return;
  out.waiting_for = support_plan_t::WAITING_NONE;
  const stepping::StepOutput* steps = view.steps;
  const int kind = steps != nullptr ? steps->transition : 0;
  out.transition = kind < 0   ? support_plan_t::TRANSITION_UNLOADING
                   : kind > 0 ? support_plan_t::TRANSITION_LOADING
                              : support_plan_t::TRANSITION_NONE;
  out.transition_foot = kind == 0 ? int8_t{-1} : static_cast<int8_t>(steps->foot);
  out.transition_progress = kind == 0 ? 0 : steps->progress;
}

void ReportFeet(const SupportView& view, const robot::RobotData& data, support_plan_t* plan) {
  support_plan_t& out = *plan;
  const int next = view.schedule.next();
  const robot::FootArray<bool> then = view.steps != nullptr ? robot::FootArray<bool>(true)
                                      : next == PhaseGraph::kNone || view.held
                                          ? view.in_contact
                                          : ContactsOf(view.schedule.phase(next).support());
  for (const Foot f : kFeet) {
    out.in_contact[Index(f)] = view.in_contact[f] ? 1 : 0;
    out.next_in_contact[Index(f)] = then[f] ? 1 : 0;
    out.foot_state[Index(f)] =
        view.in_contact[f]
            ? support_plan_t::FOOT_SUPPORT
            : FootCode(view.steps != nullptr ? view.steps->foot_state : view.landing[f].state());
    SetPose(data.foot_pose[f], &out.foot_pose[Index(f)]);
  }
}

void ReportReferences(const SupportView& view, const robot::RobotData& data,
                      const EstimatedPose& estimate, const References& references, bool controlled,
                      support_plan_t* plan) {
  support_plan_t& out = *plan;
  SetVector3(data.com, out.com_position);
  SetVector3(data.com_velocity, out.com_velocity);
  SetMotion(controlled ? references.com : PointMotion{.position = data.com}, &out.com_reference);
  const stepping::StepOutput* const steps = controlled ? view.steps : nullptr;
  out.com_follows =
      steps != nullptr ? support_plan_t::FOLLOWS_COP : support_plan_t::FOLLOWS_REFERENCE;
  if (steps != nullptr) SetVector3(steps->cop_reference, out.cop_reference);
  SetMotion(controlled ? references.body : RotationMotion{.rotation = estimate.body_rotation},
            &out.body_reference);
  for (const Foot f : kFeet) {
    const bool moves = controlled && !view.in_contact[f];
    const Eigen::Isometry3d& sole = estimate.sole[f];
    SetMotion(moves ? references.foot[f] : PointMotion{.position = sole.translation()},
              &out.foot_reference[Index(f)]);
    SetMotion(moves ? references.foot_rotation[f] : RotationMotion{.rotation = sole.linear()},
              &out.foot_rotation_reference[Index(f)]);
  }
}

void ReportCapture(double time, const Eigen::Isometry3d& frame_o,
                   const balance::ConvexPolygon& soles, const balance::CapturePoint& pendulum,
                   HeldCondition* step_needed, support_plan_t* plan) {
  support_plan_t& out = *plan;
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
