#include "components/balance/tasks/task.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
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
  const auto valid = [](double gain) { return gain >= 0 && std::isfinite(gain); };
  if (!valid(spec.gains.kp) || !valid(spec.gains.kd)) {
    throw std::invalid_argument("gains: kp and kd must be numbers, 0 or more");
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
  if (spec.foot >= 0) {
    if (!spec.link.empty()) throw std::invalid_argument("link: stands beside foot; give one");
    const robot::FootModel& foot = model.feet().at(static_cast<size_t>(spec.foot));
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

}  // namespace poise::balance
