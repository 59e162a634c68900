#include "logging/metrics/true_contacts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <optional>

namespace poise::logging {
namespace {

constexpr double kUnloadedShare = 0.02;             // of the weight
constexpr double kLeastSwing = 0.1, kTouch = 0.02;  // s
constexpr double kWay = 0.05;                       // m, to another place
constexpr size_t kLeastInTurn = 3;                  // steps on the spot
constexpr double kInTurn = 1;                       // s from a landing to the other foot's leaving
constexpr double kDownTilt = 1, kDownShare = 0.5;   // rad; of the COM's height at time 0
constexpr double kLeastHeight = 0.05;               // m, of a COM whose height is known

int64_t Ticks(const RunRecord& run, double time) {
  return std::llround(time / run.spec.tick_period());
}

Eigen::Vector3d Up(const ground_truth_t& truth) {
  const double* q = truth.base_orientation;
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).conjugate() * Eigen::Vector3d::UnitZ();
}

/// m, world, of a sole.
std::optional<Eigen::Vector2d> Place(const RunRecord& run, size_t foot, int64_t tick) {
  const ground_truth_t* const truth = run.truth.at(tick);
  if (truth == nullptr || foot >= truth->foot_pose.size()) return {};
  const double* const position = truth->foot_pose[foot].position;
  return Eigen::Vector2d(position[0], position[1]);
}

/// A sole that comes down elsewhere than it stood, or that has stood nowhere yet.
bool Moves(const RunRecord& run, const TrueStep& step) {
  if (step.lifted <= run.spec.lead_ticks()) return true;
  const auto from = Place(run, step.foot, step.lifted), to = Place(run, step.foot, step.landed);
  return !from || !to || (*to - *from).norm() >= kWay;
}

/// Whether a foot that is off the ground in these intervals carries at a tick.
bool Carries(const RunRecord& run, const std::vector<Interval>& off, int64_t tick) {
  return std::ranges::none_of(off, [&](const Interval& i) {
    return i.begin <= tick && tick < i.end.value_or(run.num_ticks);
  });
}

/// N: a foot that bears less is in the air.
double LeastLoad(const RunRecord& run) {
  return kUnloadedShare * run.robot.total_mass() * robot::kGravity;
}

/// What IsDown compares with, found once: the truth at time 0, or where a part of a run begins.
class Stance {
 public:
  explicit Stance(const RunRecord& run)
      : lead_ticks_(run.spec.lead_ticks()), least_(LeastLoad(run)) {
    for (const auto& [tick, start] : Messages(run.truth, lead_ticks_, run.num_ticks)) {
      up_ = Up(*start);
      height_ = ComHeight(*start);
      ground_ = start->com_position[2] - height_;
      return;
    }
  }
  bool Left(int64_t tick, const ground_truth_t& truth) const {
    if (truth.fallen != 0) return true;
    if (tick < lead_ticks_ || !(height_ > kLeastHeight)) return false;
    double height = ComHeight(truth);
    // Feet in the air, which a robot may pull up in a leap, do not tell where the ground is.
    if (std::ranges::all_of(truth.foot_wrench,
                            [&](const wrench_t& w) { return -w.force[2] < least_; })) {
      height = std::max(height, truth.com_position[2] - ground_);
    }
    return Up(truth).dot(up_) < std::cos(kDownTilt) || height < kDownShare * height_;
  }

 private:
  int64_t lead_ticks_;
  double least_;  // N
  Eigen::Vector3d up_ = Eigen::Vector3d::UnitZ();
  double height_ = 0, ground_ = 0;
};

}  // namespace

double ComHeight(const ground_truth_t& truth) {
  double lower = HUGE_VAL;
  for (const pose_t& foot : truth.foot_pose) lower = std::min(lower, foot.position[2]);
  return truth.com_position[2] - (truth.foot_pose.empty() ? 0 : lower);
}

std::optional<bool> IsDown(const RunRecord& run, int64_t tick) {
  const ground_truth_t* const now = run.truth.at(tick);
  if (now == nullptr) return {};
  const ground_truth_t truth = *now;  // of a paged series, whose others are read meanwhile
  return Stance(run).Left(tick, truth);
}

std::optional<int64_t> DownTick(const RunRecord& run) {
  const Stance stance(run);
  for (const auto& [tick, truth] : Messages(run.truth, 0, run.num_ticks)) {
    if (stance.Left(tick, *truth)) return tick;
  }
  return {};
}

std::array<std::vector<Interval>, 2> OffTheGround(const RunRecord& run) {
  std::array<std::vector<Interval>, 2> off;
  if (run.truth.empty()) return off;
  const int64_t down = DownTick(run).value_or(run.num_ticks);
  const double least = LeastLoad(run);
  for (size_t foot = 0; foot < 2; ++foot) {
    const auto unloaded = [&](int64_t tick) -> std::optional<bool> {
      if (tick >= down) return false;
      const ground_truth_t* const truth = run.truth.at(tick);
      if (truth == nullptr) return {};
      return -truth->foot_wrench[foot].force[2] < least;
    };
    off[foot] = Intervals(run, unloaded, Ticks(run, kTouch));
    // What the fall ends is no landing.
    for (Interval& interval : off[foot]) {
      if (interval.end && *interval.end >= down) interval.end.reset();
    }
    // Moments that follow each other as closely as a rattle's are no time off the ground.
    std::vector<Interval> whole = Intervals(run, unloaded);
    std::erase_if(whole, [&](const Interval& i) {
      return i.end.value_or(down) - i.begin < Ticks(run, kLeastSwing);
    });
    std::erase_if(off[foot], [&](const Interval& i) {
      return std::ranges::none_of(whole, [&](const Interval& one) {
        return i.begin <= one.begin && one.begin < i.end.value_or(down);
      });
    });
  }
  return off;
}

std::vector<TrueStep> TrueSteps(const RunRecord& run) {
  std::vector<TrueStep> steps;
  const auto off = OffTheGround(run);
  for (size_t foot = 0; foot < 2; ++foot) {
    for (const Interval& interval : off[foot]) {
      // A robot that hung from a crane with both feet was put down. On one foot it steps.
      const bool hung =
          interval.begin <= run.spec.lead_ticks() &&
          !Carries(run, off[1 - foot], std::max(interval.begin, run.spec.lead_ticks()));
      if (!interval.end || hung) continue;
      steps.push_back({foot, interval.begin, *interval.end});
    }
  }
  std::ranges::stable_sort(steps, {}, &TrueStep::landed);
  const auto in_turn = [&](const TrueStep& before, const TrueStep& step) {
    return before.foot != step.foot && step.lifted - before.landed <= Ticks(run, kInTurn);
  };
  // A hop of the foot that has just stepped breaks no turn.
  std::vector<TrueStep> feet;
  for (const TrueStep& step : steps) {
    const bool again = !feet.empty() && feet.back().foot == step.foot;
    if (!again || Moves(run, step)) feet.push_back(step);
  }
  std::vector<TrueStep> made;
  for (auto begin = feet.begin(), end = begin; begin != feet.end(); begin = end) {
    end = std::ranges::adjacent_find(begin, feet.end(), std::not_fn(in_turn));
    if (end != feet.end()) ++end;
    const bool walks = static_cast<size_t>(end - begin) >= kLeastInTurn;
    std::copy_if(begin, end, std::back_inserter(made),
                 [&](const TrueStep& step) { return walks || Moves(run, step); });
  }
  return made;
}

std::vector<TrueSupport> TrueSupports(const RunRecord& run) {
  const auto off = OffTheGround(run);
  const int64_t start = run.spec.lead_ticks();
  std::vector<int64_t> ticks = {start};
  for (const auto& intervals : off) {
    for (const Interval& interval : intervals) {
      if (interval.begin > start) ticks.push_back(interval.begin);
      if (interval.end && *interval.end > start) ticks.push_back(*interval.end);
    }
  }
  std::ranges::sort(ticks);
  std::vector<TrueSupport> supports;
  bool known = false;
  for (const int64_t tick : ticks) {
    const std::array<bool, 2> feet = {Carries(run, off[0], tick), Carries(run, off[1], tick)};
    if (!supports.empty() && supports.back().carries == feet) continue;
    supports.push_back({tick, feet});
    known = known || feet[0] || feet[1];
  }
  if (run.truth.empty() || !known) supports.clear();
  return supports;
}

}  // namespace poise::logging
