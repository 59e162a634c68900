#include "logging/metrics/analysis.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "components/balance/contact_conditions.h"
#include "components/messages/conversions.h"
#include "logging/metrics/contact_history.h"

namespace poise::logging {
namespace {

constexpr double kWrenchTolerance = 1e-6;  // N, N·m
constexpr double kCopTolerance = 1e-9;     // m

template <class Join>
Answer Fold(const RunRecord& run, const std::function<Answer(int64_t)>& value, Join join) {
  Answer result;
  for (int64_t tick = run.first_tick; tick < run.num_ticks; ++tick) {
    if (const Answer v = value(tick)) result = result ? join(*result, *v) : *v;
  }
  return result;
}

// Views hold what is asked for alone: a long run's messages are read from the disk.

TickView FeetOf(const RunRecord& run, int64_t tick) {
  return {.sensors = run.sensors.at(tick), .state = run.state.at(tick)};
}

TickView GroundOf(const RunRecord& run, int64_t tick) {
  return {.plan = run.plan.at(tick),
          .planner = run.planner.at(tick),
          .balance = run.balance.at(tick),
          .truth = run.planner.empty() ? run.truth.at(tick) : nullptr};
}

RunMessages MessagesOf(const RunRecord& run) {
  return {!run.plan.empty(), !run.planner.empty(), !run.balance.empty(), !run.bridge.empty(),
          !run.truth.empty()};
}

}  // namespace

Answer Maximum(const RunRecord& run, const std::function<Answer(int64_t)>& value) {
  return Fold(run, value, std::ranges::max);
}

Answer Minimum(const RunRecord& run, const std::function<Answer(int64_t)>& value) {
  return Fold(run, value, std::ranges::min);
}

Answer RootMeanSquare(const RunRecord& run, const std::function<Answer(int64_t)>& value) {
  Mean squares;
  for (int64_t tick = run.first_tick; tick < run.num_ticks; ++tick) {
    if (const Answer v = value(tick)) squares.Add(*v * *v);
  }
  return squares.Root();
}

Answer CountTicks(const RunRecord& run, const std::function<std::optional<bool>(int64_t)>& holds) {
  Answer count;
  for (int64_t tick = run.first_tick; tick < run.num_ticks; ++tick) {
    if (const std::optional<bool> h = holds(tick)) count = count.value_or(0) + (*h ? 1 : 0);
  }
  return count;
}

std::optional<BalancingIntervals> Balancing(const RunRecord& run) {
  if (run.balance.empty()) return {};
  BalancingIntervals result;
  bool before = false;
  for (int64_t tick = run.first_tick; tick < run.num_ticks; ++tick) {
    const balance_torque_t* balance = run.balance.at(tick);
    const bool on = balance != nullptr && (balance->active_x != 0 || balance->active_y != 0);
    if (on && !before && result.activations++ == 0) result.first = run.time(tick);
    if (on) {
      result.last = run.time(tick);
      result.active += run.spec.tick_period();
    }
    before = on;
  }
  return result;
}

std::optional<Wrench> KnownWrench(const RunRecord& run, size_t foot, int64_t tick) {
  return KnownWrench(run.robot, FeetOf(run, tick), foot);
}

bool FeetHaveSensors(const RunRecord& run) {
  if (std::ranges::none_of(run.robot.feet(), &robot::FootModel::force_sensor)) return false;
  const auto present = [](int8_t state) { return state != drive_feedback_t::SENSOR_ABSENT; };
  auto readings = Messages(run.sensors, 0, run.num_ticks);
  const auto first = readings.begin();
  return first == readings.end() || std::ranges::any_of((*first).second->foot_sensor, present);
}

std::optional<Wrench> ComputedWrench(const RunRecord& run, size_t foot, int64_t tick) {
  return ComputedWrench({.command = run.command.at(tick)}, foot);
}

std::optional<Eigen::Vector2d> ComputedCop(const RunRecord& run, int64_t tick) {
  TickView view = GroundOf(run, tick);
  view.command = run.command.at(tick);
  return ComputedCop(run.robot, MessagesOf(run), view);
}

std::optional<Eigen::Vector2d> MeasuredCop(const RunRecord& run, int64_t tick) {
  const auto placed =
      MeasuredCop(run.robot, MessagesOf(run), GroundOf(run, tick - 1), FeetOf(run, tick));
  if (!placed) return {};
  return placed->cop;
}

Answer MotorTorque(const RunRecord& run, size_t joint, int64_t tick) {
  return MotorTorque(
      MessagesOf(run),
      {.command = run.command.at(tick), .bridge = run.bridge.at(tick), .truth = run.truth.at(tick)},
      joint);
}

std::optional<bool> RatioIsInfeasible(const joint_command_t& command) {
  return TellsRatio(command) ? std::optional(command.eta_feasible == 0) : std::nullopt;
}

std::optional<Wrench> WrenchError(const RunRecord& run, size_t foot, int64_t tick) {
  const support_plan_t* plan = run.plan.at(tick - 1);
  const joint_command_t* command = run.command.at(tick - 1);
  if (plan == nullptr || command == nullptr) return {};
  if (plan->in_contact[foot] == 0 || !TellsFoot(*command, foot)) return {};
  const auto wrench = KnownWrench(run, foot, tick);
  if (!wrench) return {};
  return *wrench - GetWrench(command->foot_wrench[foot]);
}

Answer FootMargin(const RunRecord& run, size_t foot, size_t margin, int64_t tick) {
  const joint_command_t* command = run.command.at(tick);
  if (command == nullptr || command->in_contact[foot] == 0 || !TellsFoot(*command, foot)) return {};
  const contact_margins_t& m = command->margins[foot];
  return std::array{m.normal, m.friction, m.yaw, m.roll, m.pitch}[margin];
}

balance::ConvexPolygon AcceptableRegion(const balance_torque_t& balance) {
  std::array<Eigen::Vector2d, std::extent_v<decltype(balance.corner_x)>> corner;
  const auto count =
      static_cast<size_t>(std::clamp<int>(balance.num_corners, 0, static_cast<int>(corner.size())));
  for (size_t i = 0; i < count; ++i) corner[i] = {balance.corner_x[i], balance.corner_y[i]};
  return balance::ConvexHull({corner.data(), count});
}

std::optional<bool> Violated(const RunRecord& run, int64_t tick) {
  const joint_command_t* command = run.command.at(tick);
  if (command == nullptr) return {};
  bool tells = false;
  for (size_t foot = 0; foot < command->margins.size(); ++foot) {
    if (!TellsFoot(*command, foot)) continue;
    tells = true;
    if (command->conditions_met[foot] == 0) return true;
    for (size_t margin = 0; margin < 5; ++margin) {
      const Answer m = FootMargin(run, foot, margin, tick);
      if (m && !(*m >= -kWrenchTolerance)) return true;
    }
  }
  if (!tells) return {};
  const balance_torque_t* balance = run.balance.at(tick);
  if (balance == nullptr) {
    if (run.balance.empty()) return false;
    return {};
  }
  if (balance->region == balance_torque_t::REGION_POLYGON) {
    const Eigen::Vector2d cop(balance->cop[0], balance->cop[1]);
    return !(balance::SignedDistance(AcceptableRegion(*balance), cop) >= -kCopTolerance);
  }
  for (int axis = 0; axis < 2; ++axis) {
    if (!(std::abs(balance->cop[axis]) <= balance->cop_limit[axis] + kCopTolerance)) return true;
  }
  return false;
}

double PushThreshold(const RunRecord& run) {
  constexpr double kDeviations = 6;  // of a norm of three: beyond it once in 10^7 samples
  constexpr size_t kFewest = 10;     // differences
  // The norm of three normal variables of deviation 1 has this median; a difference of two, √2 of
  // it.
  const double median_of_difference = 1.5382 * std::sqrt(2.0);
  std::vector<double> differences;
  for (int64_t tick = 1; tick < run.num_ticks; ++tick) {
    const external_push_t* before = run.push.at(tick - 1);
    if (before == nullptr) continue;
    const Eigen::Vector3d force = GetVector3(before->force);  // of a paged series
    const external_push_t* now = run.push.at(tick);
    if (now != nullptr) differences.push_back((GetVector3(now->force) - force).norm());
  }
  if (differences.size() < kFewest) return HUGE_VAL;
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::ranges::nth_element(differences, middle);
  return kDeviations * *middle / median_of_difference;
}

Eigen::MatrixXd FromTriangle(const double* triangle, int size) {
  Eigen::MatrixXd matrix(size, size);
  for (int row = 0; row < size; ++row) {
    for (int column = row; column < size; ++column) {
      matrix(row, column) = matrix(column, row) = *triangle++;
    }
  }
  return matrix;
}

Answer NormalisedSquare(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
  const Eigen::LLT<Eigen::MatrixXd> factors(covariance);
  if (factors.info() != Eigen::Success) return {};
  return error.dot(factors.solve(error));
}

Answer Nees(const robot_state_t& estimate, const estimator_status_t& status,
            const ground_truth_t& truth, NeesPart part) {
  if (status.has_covariance == 0) return {};
  const std::vector<int> rows = part == NeesPart::kAll ? std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8}
                                                       : std::vector<int>{0, 1, 3, 4, 5};
  return NormalisedSquare(BaseErrorVector(estimate, truth)(rows),
                          FromTriangle(status.covariance, 9)(rows, rows));
}

double NeesBound(NeesPart part) { return part == NeesPart::kAll ? 16.918978 : 11.070498; }

}  // namespace poise::logging
