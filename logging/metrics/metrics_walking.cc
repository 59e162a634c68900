#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "components/messages/conversions.h"
#include "components/robot/robot_model.h"
#include "logging/metrics/metric_groups.h"
#include "logging/metrics/true_contacts.h"
#include "logging/metrics/walk_course.h"

namespace poise::logging {
namespace {

using Eigen::Vector2d;

// s on both feet after which a robot has stopped walking, unless its planner walks on.
constexpr double kStands = 1;

/// From a foot's landing to its next: two steps.
struct Stride {
  int64_t begin = 0, end = 0;             ///< ticks
  Vector2d way = Vector2d::Zero();        ///< m, of the true COM, world
  Vector2d commanded = Vector2d::Zero();  ///< m, the same as commanded along the true heading
  bool planned = false;                   ///< the planner walks, too: `commanded` is known
  double duration = 0;                    ///< s
};

/// The planner walks in every tick of [begin, end) that it tells of, and in one at least.
bool PlannerWalks(const RunRecord& run, int64_t begin, int64_t end) {
  bool walks = false;
  for (const auto& [t, planner] : Messages(run.planner, begin, end)) {
    walks = planner->stepping != planner_status_t::STEPPING_NONE &&
            planner->step_reason == planner_status_t::REASON_WALK;
    if (!walks) return false;
  }
  return walks;
}

std::vector<Stride> Strides(const RunRecord& run) {
  const std::vector<TrueStep> steps = TrueSteps(run);
  // A slow walk carries with both feet for longer than a robot that has stopped.
  const auto follows = [&](const TrueStep& before, const TrueStep& step) {
    return step.foot != before.foot && (run.duration(step.lifted - before.landed) <= kStands ||
                                        PlannerWalks(run, before.landed, step.lifted));
  };
  std::vector<Stride> strides;
  for (size_t i = 0; i + 2 < steps.size();) {
    const int64_t begin = steps[i].landed, end = steps[i + 2].landed;
    const ground_truth_t *from = run.truth.at(begin), *to = run.truth.at(end);
    const bool walks = follows(steps[i], steps[i + 1]) && follows(steps[i + 1], steps[i + 2]);
    if (begin < run.first_tick || !walks || from == nullptr || to == nullptr) {
      ++i;
      continue;
    }
    Stride stride{begin, end};
    stride.way = (GetVector3(to->com_position) - GetVector3(from->com_position)).head<2>();
    stride.duration = run.duration(end - begin);
    for (int64_t t = begin; t < end; ++t) {
      const planner_status_t* planner = run.planner.at(t);
      const ground_truth_t* truth = run.truth.at(t);
      if (planner == nullptr || truth == nullptr) continue;
      stride.planned = stride.planned || planner->step_reason == planner_status_t::REASON_WALK;
      const Vector2d velocity(planner->walk_velocity[0], planner->walk_velocity[1]);
      stride.commanded += run.duration(1) * (Eigen::Rotation2Dd(Heading(*truth)) * velocity);
    }
    strides.push_back(stride);
    i += 2;
  }
  return strides;
}

/// Sum over the strides' ways, m; empty when there is none.
Answer Way(const RunRecord& run) {
  Answer way;
  for (const Stride& stride : Strides(run)) way = way.value_or(0) + stride.way.norm();
  return way;
}

/// Work and way are of the same ticks: what starting and stopping take is in neither.
Answer CostOfTransport(const RunRecord& run) {
  double work = 0, way = 0;
  for (const Stride& stride : Strides(run)) {
    way += stride.way.norm();
    for (const auto& [t, truth] : Messages(run.truth, stride.begin, stride.end)) {
      for (size_t j = 0; j < truth->joint_torque.size(); ++j) {
        work += run.duration(1) * std::max(0.0, truth->joint_torque[j] * truth->joint_velocity[j]);
      }
    }
  }
  if (!(way > 0)) return {};
  return work / (run.robot.total_mass() * robot::kGravity * way);
}

/// m/s.
Answer FastestStride(const RunRecord& run) {
  Answer fastest;
  for (const Stride& stride : Strides(run)) {
    fastest = std::max(fastest, Answer(stride.way.norm() / stride.duration));
  }
  return fastest;
}

/// mm/s.
Answer VelocityError(const RunRecord& run) {
  Mean squares;
  for (const Stride& stride : Strides(run)) {
    if (!stride.planned) continue;
    squares.Add(((stride.way - stride.commanded) / stride.duration).squaredNorm());
  }
  return Scaled(squares.Root(), kMilli);
}

/// %, of what is commanded, that is followed; none where nothing is.
Compute ShareOfCourse(double WalkCourse::*followed, double WalkCourse::*commanded) {
  return [=](const RunRecord& run) -> Answer {
    const WalkCourse course = FollowedCourse(run);
    if (run.truth.empty() || !(course.*commanded > 0)) return {};
    return 100 * course.*followed / course.*commanded;
  };
}

}  // namespace

void AddWalking(MetricList* list) {
  list->Add("walk_speed_max", "m/s", "walking, fastest mean of two steps", FastestStride);
  list->Add("walk_velocity_error_rms", "mm/s",
            "walking, mean velocity of two steps less the planner's commanded one, RMS",
            VelocityError);
  list->Add("walk_way", "m", "walking, way of the COM between touch-downs", Way);
  list->Add("walk_course_share", "%",
            "walking, way of the COM along the scenario's commands, of what they ask for",
            ShareOfCourse(&WalkCourse::way, &WalkCourse::commanded_way));
  list->Add("walk_turn_share", "%",
            "walking, turn in the sense of the scenario's commands, of what they ask for",
            ShareOfCourse(&WalkCourse::turn, &WalkCourse::commanded_turn));
  list->Add("walk_cost_of_transport", "",
            "walking, positive work of the joints over weight and way", CostOfTransport);
}

}  // namespace poise::logging
