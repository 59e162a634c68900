#include <cmath>

#include "components/messages/conversions.h"
#include "components/robot/dynamics.h"
#include "fmt/format.h"
#include "logging/metrics/contact_history.h"
#include "logging/metrics/metric_groups.h"

namespace poise::logging {
namespace {

Answer Absolute(Answer value) {
  if (value) *value = std::abs(*value);
  return value;
}

/// mm, largest distance of the COM that `series` tells of from its reference.
template <class T>
Answer LargestComError(const RunRecord& run, const Series<T>& series, int axis) {
  const auto error =
      OfTick(run.plan, series, [axis](const support_plan_t& plan, const T& message) -> Answer {
        return Absolute(ComError(plan, message.com_position, axis));
      });
  return Scaled(Maximum(run, error), kMilli);
}

Answer ComMotion(const RunRecord& run) {
  std::optional<Eigen::Vector3d> start;
  const auto motion = OfTick(run.truth, [&](const ground_truth_t& truth) {
    const Eigen::Vector3d com = GetVector3(truth.com_position);
    if (!start) start = com;
    return (com - *start).norm();
  });
  return Scaled(Maximum(run, motion), kMilli);
}

Answer ComDifference(const RunRecord& run) {
  if (!run.reference) return {};
  return Scaled(
      Maximum(run,
              [&](int64_t t) -> Answer {
                const ground_truth_t* here = run.truth.at(t);
                const ground_truth_t* there =
                    run.reference->truth.at(run.reference->TickOf(run, t));
                if (here == nullptr || there == nullptr) return {};
                return (GetVector3(here->com_position) - GetVector3(there->com_position)).norm();
              }),
      kMilli);
}

Answer ModelComErrorAtEnd(const RunRecord& run) {
  const support_plan_t* plan = run.plan.at(run.num_ticks - 1);
  const ground_truth_t* truth = run.truth.at(run.num_ticks - 1);
  if (plan == nullptr || truth == nullptr || !HasComReference(*plan, 0)) return {};
  robot::RobotState state(run.robot.num_joints());
  state.base_position = GetVector3(truth->base_position);
  const double* q = truth->base_orientation;
  state.base_orientation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  for (int j = 0; j < run.robot.num_joints(); ++j) {
    state.joint_position[j] = truth->joint_position[static_cast<size_t>(j)];
  }
  robot::RobotData data(run.robot);
  robot::ComputeKinematics(run.robot, state, &data);
  robot::ComputeDynamics(run.robot, state, &data);
  return kMilli * (data.com - GetVector3(plan->com_reference.position)).norm();
}

/// Largest error of the body's orientation about x in the first or last time on both feet.
Answer BodyRotationOnBothFeet(const RunRecord& run, bool first) {
  const auto both = [&](int64_t t) -> std::optional<bool> {
    if (t < run.first_tick) return false;
    const support_plan_t* plan = run.plan.at(t);
    if (plan == nullptr) return {};
    return plan->in_contact[0] != 0 && plan->in_contact[1] != 0;
  };
  const std::vector<Interval> intervals = Intervals(run, both);
  if (intervals.empty() || (!first && intervals.size() < 2)) return {};
  const Interval& interval = first ? intervals.front() : intervals.back();
  return Scaled(Maximum(run,
                        [&](int64_t t) -> Answer {
                          const task_torque_t* task = run.task.at(t);
                          if (task == nullptr || t < interval.begin ||
                              t >= interval.end.value_or(run.num_ticks)) {
                            return {};
                          }
                          return std::abs(task->body_orientation_error[0]);
                        }),
                kMilli);
}

}  // namespace

void AddMotion(MetricList* list) {
  for (int axis = 0; axis < 3; ++axis) {
    list->push_back(
        {fmt::format("com_error_max_{}", kAxis[axis]), "mm",
         fmt::format("largest distance of the estimated COM from its reference, {}", kAxis[axis]),
         [axis](const RunRecord& run) { return LargestComError(run, run.planner, axis); }});
  }
  for (int axis = 0; axis < 3; ++axis) {
    list->push_back(
        {fmt::format("com_error_true_max_{}", kAxis[axis]), "mm",
         fmt::format("largest distance of the true COM from its reference, {}", kAxis[axis]),
         [axis](const RunRecord& run) { return LargestComError(run, run.truth, axis); }});
  }
  list->push_back(
      {"com_error_end", "mm", "distance of the true COM from its reference at the end",
       [](const RunRecord& run) -> Answer {
         const support_plan_t* plan = run.plan.at(run.num_ticks - 1);
         const ground_truth_t* truth = run.truth.at(run.num_ticks - 1);
         if (plan == nullptr || truth == nullptr || !HasComReference(*plan, 0)) return {};
         return kMilli *
                (GetVector3(truth->com_position) - GetVector3(plan->com_reference.position)).norm();
       }});
  list->push_back({"com_error_end_model", "mm",
                   "the same of the COM that the controller's model has in the true posture: "
                   "without the model's "
                   "own error",
                   ModelComErrorAtEnd});
  list->push_back({"orientation_error_max", "mrad", "largest error of the body's orientation",
                   [](const RunRecord& run) {
                     const auto error = OfTick(run.task, [](const task_torque_t& task) {
                       return GetVector3(task.body_orientation_error).norm();
                     });
                     return Scaled(Maximum(run, error), kMilli);
                   }});
  list->push_back({"com_motion_max", "mm",
                   "largest distance of the true COM from where it was when the window began",
                   ComMotion});
  list->push_back({"com_motion_reference_max", "mm",
                   "largest distance of the true COM from where it was when the window began, "
                   "reference run",
                   [](const RunRecord& run) { return OfReference(run, ComMotion); }});
  list->push_back({"com_difference_max", "mm",
                   "largest distance of the true COM from the reference run's at the same tick",
                   ComDifference});
  list->push_back({"body_rotation_x_max_first_double", "mrad",
                   "largest body orientation error about x, first time on both feet",
                   [](const RunRecord& run) { return BodyRotationOnBothFeet(run, true); }});
  list->push_back({"body_rotation_x_max_last_double", "mrad",
                   "largest body orientation error about x, last time on both feet (of several)",
                   [](const RunRecord& run) { return BodyRotationOnBothFeet(run, false); }});
  for (int foot = 0; foot < 2; ++foot) {
    for (int axis = 0; axis < 3; ++axis) {
      list->push_back(
          {fmt::format("{}_foot_error_max_{}", kFoot[foot], kAxis[axis]), "mm",
           fmt::format("largest distance of the {} foot from its reference while off the ground, "
                       "{}",
                       kFoot[foot], kAxis[axis]),
           [foot, axis](const RunRecord& run) {
             const auto error =
                 OfTick(run.plan, run.planner,
                        [=](const support_plan_t& plan, const planner_status_t& planner) -> Answer {
                          const auto f = static_cast<size_t>(foot);
                          if (plan.in_contact[f] != 0) return {};
                          return std::abs(planner.foot_pose[f].position[axis] -
                                          plan.foot_reference[f].position[axis]);
                        });
             return Scaled(Maximum(run, error), kMilli);
           }});
    }
  }
}

}  // namespace poise::logging
