#include "components/balance/tasks/task.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>

namespace poise::balance {
namespace {

constexpr std::array<std::string_view, 6> kAxisNames{"X", "Y", "Z", "TURN_X", "TURN_Y", "TURN_Z"};

}  // namespace

std::unique_ptr<Task> CreateTask(const TaskSpec& spec, const robot::RobotModel& model,
                                 const std::vector<TaskType>& types) {
  const auto type = std::ranges::find(types, spec.type, &TaskType::name);
  if (type == types.end()) {
    std::string names;
    for (const TaskType& other : types) {
      names += fmt::format("{}{}", names.empty() ? "" : ", ", other.name);
    }
    throw std::invalid_argument(
        fmt::format("type: there is no task '{}': use one of {}", spec.type, names));
  }
  return type->make(spec, model);
}

Eigen::Vector3d OrientationError(const Eigen::Matrix3d& desired, const Eigen::Matrix3d& actual) {
  const Eigen::AngleAxisd rotation(desired * actual.transpose());
  return rotation.angle() * rotation.axis();
}

std::vector<int> SelectedRows(const AxisSelection& axes, int first, int count) {
  const bool all = std::ranges::none_of(axes, [](bool selected) { return selected; });
  std::vector<int> rows;
  for (int axis = 0; axis < 6; ++axis) {
    const bool own = axis >= first && axis < first + count;
    if (!own && axes[static_cast<size_t>(axis)]) {
      throw std::invalid_argument(
          fmt::format("axis: this task has no {}", kAxisNames[static_cast<size_t>(axis)]));
    }
    if (own && (all || axes[static_cast<size_t>(axis)])) rows.push_back(axis - first);
  }
  return rows;
}

robot::Frame TaskFrame(const TaskSpec& spec, const robot::RobotModel& model) {
  robot::Frame frame;
  if (spec.foot) {
    if (!spec.link.empty()) throw std::invalid_argument("link: stands beside foot; give one");
    const robot::FootModel& foot = model.feet()[*spec.foot];
    frame = {foot.name, foot.body, foot.sole};
  } else if (spec.link.empty()) {
    frame.body = model.body_task_body();
    frame.name = model.bodies()[static_cast<size_t>(frame.body)].name;
  } else {
    const robot::Frame* link = model.FindFrame(spec.link);
    if (link == nullptr) {
      throw std::invalid_argument(
          fmt::format("link: robot '{}' has no link '{}'", model.name(), spec.link));
    }
    frame = *link;
  }
  if (!spec.point.allFinite()) throw std::invalid_argument("point: must be finite");
  frame.pose = frame.pose * Eigen::Translation3d(spec.point);
  return frame;
}

void RefuseFrame(const TaskSpec& spec) {
  if (!spec.link.empty()) throw std::invalid_argument("link: this task has none");
  if (spec.foot) throw std::invalid_argument("foot: this task has none");
  RefusePoint(spec);
}

void RefusePoint(const TaskSpec& spec) {
  if (!spec.point.isZero(0)) throw std::invalid_argument("point: this task has none");
}

void RefuseJoints(const TaskSpec& spec) {
  if (!spec.joints.empty()) throw std::invalid_argument("joint: this task has none");
}

}  // namespace poise::balance
