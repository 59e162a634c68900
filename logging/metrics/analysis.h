// Questions to a run's record, answered over the ticks from RunRecord::first_tick on. An empty
// optional: the record holds nothing to answer with.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <ranges>
#include <utility>

#include "components/balance/convex_polygon.h"
#include "logging/derived/definitions.h"
#include "logging/run_record.h"

namespace poise::logging {

using Answer = std::optional<double>;

inline constexpr double kMilli = 1e3;  ///< m to mm, rad to mrad

/// Largest and root-mean-square of what `value` gives, over the ticks where it gives something.
Answer Maximum(const RunRecord& run, const std::function<Answer(int64_t tick)>& value);
Answer Minimum(const RunRecord& run, const std::function<Answer(int64_t tick)>& value);
Answer RootMeanSquare(const RunRecord& run, const std::function<Answer(int64_t tick)>& value);
/// Number of ticks for which `holds` is true; empty when it is empty for all.
Answer CountTicks(const RunRecord& run,
                  const std::function<std::optional<bool>(int64_t tick)>& holds);

/// Mean of what is added; empty without any.
class Mean {
 public:
  void Add(double value) {
    sum_ += value;
    ++count_;
  }
  Answer Value() const {
    return count_ > 0 ? Answer(sum_ / static_cast<double>(count_)) : Answer();
  }
  /// The root of the mean; where squares were added, their root mean square.
  Answer Root() const { return count_ > 0 ? Answer(std::sqrt(*Value())) : Answer(); }

 private:
  double sum_ = 0;
  int64_t count_ = 0;
};

/// By tick, what `of` tells of the message; nothing where the series has none.
template <class T, class F>
auto OfTick(const Series<T>& series, F of) {
  return [&series, of](int64_t tick) {
    const T* const message = series.at(tick);
    return message != nullptr ? std::optional(of(*message)) : std::nullopt;
  };
}
/// OfTick of two series' messages.
template <class T, class U, class F>
auto OfTick(const Series<T>& series, const Series<U>& other, F of) {
  return [&series, &other, of](int64_t tick) {
    const T* const message = series.at(tick);
    const U* const beside = other.at(tick);
    const bool both = message != nullptr && beside != nullptr;
    return both ? std::optional(of(*message, *beside)) : std::nullopt;
  };
}

/// The messages of a series in ticks [first, end), each with its tick, in order.
template <class T>
auto Messages(const Series<T>& series, int64_t first, int64_t end) {
  return std::views::iota(first, std::max(first, end)) |
         std::views::transform([&](int64_t tick) { return std::pair(tick, series.at(tick)); }) |
         std::views::filter([](const auto& message) { return message.second != nullptr; });
}

/// Balancing, section 5: on at a tick when the CoP is controlled along x or y.
struct BalancingIntervals {
  int activations = 0;
  double first = 0;   ///< s, first tick on
  double last = 0;    ///< s, last tick on
  double active = 0;  ///< s, in sum
};
/// Empty without BALANCE_TORQUE messages; activations 0 when it was never on.
std::optional<BalancingIntervals> Balancing(const RunRecord& run);

/// Those of logging/derived/definitions.h at `tick`: m, (r_x, r_y) in frame O; a foot's wrench;
/// N·m.
std::optional<Eigen::Vector2d> ComputedCop(const RunRecord& run, int64_t tick);
std::optional<Eigen::Vector2d> MeasuredCop(const RunRecord& run, int64_t tick);
std::optional<Wrench> ComputedWrench(const RunRecord& run, size_t foot, int64_t tick);
std::optional<Wrench> KnownWrench(const RunRecord& run, size_t foot, int64_t tick);
Answer MotorTorque(const RunRecord& run, size_t joint, int64_t tick);

/// Whether any foot has a sensor that the run reads, good or not: the robot's text gives it one,
/// and the run's first message does not say that it is absent. Feet without are observed.
bool FeetHaveSensors(const RunRecord& run);

/// Empty where the command does not tell of a ratio.
std::optional<bool> RatioIsInfeasible(const joint_command_t& command);

/// Reading at `tick` less the wrench computed for it (the tick before), robot on environment, sole
/// frame; empty for a foot out of contact.
std::optional<Wrench> WrenchError(const RunRecord& run, size_t foot, int64_t tick);

/// Margin 0..4 (normal, friction, yaw, roll, pitch) of a foot's computed wrench; empty out of
/// contact.
Answer FootMargin(const RunRecord& run, size_t foot, size_t margin, int64_t tick);

/// Where the computed centre of pressure is kept, m, frame O; empty in a message without corners.
balance::ConvexPolygon AcceptableRegion(const balance_torque_t& balance);

/// True when a computed wrench of a foot in contact, or the computed resultant's CoP, breaks its
/// conditions at `tick`: (29)-(33) by more than 1e-6 N or N·m; (37), (38) by more than 1 nm, where
/// there is BALANCE_TORQUE. Empty where the command tells of no foot.
std::optional<bool> Violated(const RunRecord& run, int64_t tick);

/// N, below which a reading of the sensor between pusher and robot is noise: six of the sensor's
/// deviations, which the record itself tells by the median difference between neighbouring samples,
/// which a push does not touch. Infinite of a run with too few samples to tell.
double PushThreshold(const RunRecord& run);

/// Returns the symmetric matrix of `size` rows whose upper triangle stands in `triangle` by rows.
Eigen::MatrixXd FromTriangle(const double* triangle, int size);
/// Returns eᵀ P⁻¹ e; nothing where P is not positive definite.
Answer NormalisedSquare(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance);

/// Which errors a normalised estimation error squared (NEES) counts.
enum class NeesPart {
  kAll,         ///< 9 degrees of freedom
  kObservable,  ///< tilt (rotation about x and y) and velocity: 5
};
/// eᵀ P⁻¹ e with the covariance that the estimator published: chi-squared distributed when it is
/// right. Empty without a covariance, or with one that is not positive definite.
Answer Nees(const robot_state_t& estimate, const estimator_status_t& status,
            const ground_truth_t& truth, NeesPart part);
/// The value that chi-squared exceeds with 5 %.
double NeesBound(NeesPart part);

}  // namespace poise::logging
