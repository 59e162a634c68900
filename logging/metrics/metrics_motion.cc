#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "components/messages/conversions.h"
#include "components/robot/dynamics.h"
#include "fmt/format.h"
#include "logging/metrics/contact_history.h"
#include "logging/metrics/metric_groups.h"

namespace poise::logging {
namespace {

Answer SizeOf(Answer value) { return value ? Answer(std::abs(*value)) : value; }

/// m, size of the distance along an axis of the COM that a message tells of from its reference.
auto ComErrorOf(auto series, int axis) {
  return Of(&RunRecord::plan, series, [axis](const auto& plan, const auto& message) {
    return SizeOf(ComError(plan, message.com_position, axis));
  });
}

/// m, from where the COM was in the first tick that is looked at.
auto ComMotion(const RunRecord& run) {
  return [&run, start = std::optional<Eigen::Vector3d>()](int64_t t) mutable -> Answer {
    const ground_truth_t* const truth = run.truth.at(t);
    if (truth == nullptr) return {};
    const Eigen::Vector3d com = GetVector3(truth->com_position);
    if (!start) start = com;
    return (com - *start).norm();
  };
}

/// m.
Answer ComDifference(const RunRecord& run, int64_t t) {
  if (!run.reference) return {};
  const ground_truth_t* here = run.truth.at(t);
  const ground_truth_t* there = run.reference->truth.at(run.reference->TickOf(run, t));
  if (here == nullptr || there == nullptr) return {};
  return (GetVector3(here->com_position) - GetVector3(there->com_position)).norm();
}

/// mm, of what `com` gives from its reference at the end of the run.
template <class F>
Compute ComErrorAtEnd(const F& com) {
  return [com](const RunRecord& run) -> Answer {
    const support_plan_t* plan = run.plan.at(run.num_ticks - 1);
    const ground_truth_t* truth = run.truth.at(run.num_ticks - 1);
    if (plan == nullptr || truth == nullptr || !HasComReference(*plan, 0)) return {};
    return kMilli * (com(run, *truth) - GetVector3(plan->com_reference.position)).norm();
  };
}

/// m, of the controller's model in the true posture.
Eigen::Vector3d ModelCom(const RunRecord& run, const ground_truth_t& truth) {
  robot::RobotState state(run.robot.num_joints());
  state.base_position = GetVector3(truth.base_position);
  const double* q = truth.base_orientation;
  state.base_orientation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  for (int j = 0; j < run.robot.num_joints(); ++j) {
    state.joint_position[j] = truth.joint_position[static_cast<size_t>(j)];
  }
  robot::RobotData data(run.robot);
  robot::ComputeKinematics(run.robot, state, &data);
  robot::ComputeDynamics(run.robot, state, &data);
  return data.com;
}

/// Largest error of the body's orientation about x in the first or last time on both feet.
Compute BodyRotationOnBothFeet(bool first) {
  return [first](const RunRecord& run) -> Answer {
    const auto both = [&](int64_t t) -> std::optional<bool> {
      if (t < run.first_tick) return false;
      const support_plan_t* plan = run.plan.at(t);
      if (plan == nullptr) return {};
      return plan->in_contact[0] != 0 && plan->in_contact[1] != 0;
    };
    const std::vector<Interval> intervals = Intervals(run, both);
    if (intervals.empty() || (!first && intervals.size() < 2)) return {};
    const Interval& interval = first ? intervals.front() : intervals.back();
    const int64_t end = interval.end.value_or(run.num_ticks);
    Answer largest;
    for (const auto& [t, task] : Messages(run.task, interval.begin, end)) {
      largest = std::max(largest, Answer(std::abs(task->body_orientation_error[0])));
    }
    return Scaled(largest, kMilli);
  };
}

}  // namespace

void AddMotion(MetricList* list) {
  for (int axis = 0; axis < 3; ++axis) {
    list->Add(
        fmt::format("com_error_max_{}", kAxis[axis]), "mm",
        fmt::format("largest distance of the estimated COM from its reference, {}", kAxis[axis]),
        Largest(ComErrorOf(&RunRecord::planner, axis), kMilli));
  }
  for (int axis = 0; axis < 3; ++axis) {
    list->Add(fmt::format("com_error_true_max_{}", kAxis[axis]), "mm",
              fmt::format("largest distance of the true COM from its reference, {}", kAxis[axis]),
              Largest(ComErrorOf(&RunRecord::truth, axis), kMilli));
  }
  list->Add("com_error_end", "mm", "distance of the true COM from its reference at the end",
            ComErrorAtEnd([](const RunRecord&, const ground_truth_t& truth) {
              return GetVector3(truth.com_position);
            }));
  list->Add("com_error_end_model", "mm",
            "the same of the COM that the controller's model has in the true posture: without the "
            "model's own error",
            ComErrorAtEnd(ModelCom));
  list->Add(
      "orientation_error_max", "mrad", "largest error of the body's orientation",
      Largest(Of(&RunRecord::task,
                 [](const auto& task) { return GetVector3(task.body_orientation_error).norm(); }),
              kMilli));
  const std::string motion =
      "largest distance of the true COM from where it was when the window began";
  list->Add("com_motion_max", "mm", motion, Largest(ComMotion, kMilli));
  list->Add("com_motion_reference_max", "mm", motion + ", reference run",
            OfReference(Largest(ComMotion, kMilli)));
  list->Add("com_difference_max", "mm",
            "largest distance of the true COM from the reference run's at the same tick",
            Largest(ComDifference, kMilli));
  list->Add("body_rotation_x_max_first_double", "mrad",
            "largest body orientation error about x, first time on both feet",
            BodyRotationOnBothFeet(true));
  list->Add("body_rotation_x_max_last_double", "mrad",
            "largest body orientation error about x, last time on both feet (of several)",
            BodyRotationOnBothFeet(false));
  for (size_t foot = 0; foot < 2; ++foot) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto error = [foot, axis](const auto& plan, const auto& planner) {
        return SizeOf(FootError(plan, planner, foot, axis));
      };
      list->Add(fmt::format("{}_foot_error_max_{}", kFoot[foot], kAxis[axis]), "mm",
                fmt::format("largest distance of the {} foot from its reference while off the "
                            "ground, {}",
                            kFoot[foot], kAxis[axis]),
                Largest(Of(&RunRecord::plan, &RunRecord::planner, error), kMilli));
    }
  }
}

}  // namespace poise::logging
