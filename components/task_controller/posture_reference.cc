#include "components/task_controller/posture_reference.h"

#include <algorithm>
#include <cmath>

#include "operate/answer_t.hpp"

namespace poise {
namespace {

using operate::answer_t;

constexpr int kSamples = 16;         // of a move, for its greatest speed and acceleration
constexpr double kStretch = 1.1;     // ratio by which a move that is too fast is tried longer
constexpr double kLongestMove = 60;  // s

/// Whether a move keeps to the velocity and acceleration of `range`, but for what it begins with.
bool Keeps(const Quintic& move, const Quintic::Point& from, double start, double duration,
           const balance::JointRange& range) {
  const double speed = std::max(range.velocity, std::abs(from.velocity));
  const double most = std::max(range.acceleration, std::abs(from.acceleration));
  for (int i = 1; i < kSamples; ++i) {
    const Quintic::Point at = move.At(start + duration * i / kSamples);
    if (std::abs(at.velocity) > speed || std::abs(at.acceleration) > most) return false;
  }
  return true;
}

}  // namespace

PostureReference::PostureReference(const balance::JointLimits& limits, std::span<const int> legs,
                                   double tick_period)
    : leg_(static_cast<size_t>(limits.num_joints()), 0),
      tick_period_(tick_period),
      move_(leg_.size()),
      moves_(leg_.size(), 0),
      position_(Eigen::VectorXd::Zero(limits.num_joints())),
      velocity_(position_),
      acceleration_(position_) {
  for (int j = 0; j < limits.num_joints(); ++j) range_.push_back(limits.range(j));
  for (const int joint : legs) leg_[static_cast<size_t>(joint)] = 1;
}

void PostureReference::Hold(const Eigen::VectorXd& position) {
  position_ = position;
  velocity_.setZero();
  acceleration_.setZero();
  std::ranges::fill(moves_, 0);
}

int8_t PostureReference::Move(const operate::act_t& act, double time) {
  const int joint = act.body;
  const auto j = static_cast<size_t>(joint);
  if (joint < 0 || j >= leg_.size()) return answer_t::VERDICT_UNKNOWN;
  if (leg_[j] != 0) return answer_t::VERDICT_NOT_ABLE;
  const balance::JointRange& range = range_[j];
  if (!(act.value >= range.lower && act.value <= range.upper)) return answer_t::VERDICT_RANGE;
  const Quintic::Point from{position_[joint], velocity_[joint], acceleration_[joint]};
  const int64_t ticks = std::max<int64_t>(1, act.duration);
  double duration = std::min(static_cast<double>(ticks) * tick_period_, kLongestMove);
  while (true) {
    move_[j].Begin(from, {act.value}, time, duration);
    if (duration >= kLongestMove || Keeps(move_[j], from, time, duration, range)) break;
    duration *= kStretch;
  }
  moves_[j] = 1;
  return answer_t::VERDICT_DONE;
}

void PostureReference::Update(double time) {
  for (size_t j = 0; j < moves_.size(); ++j) {
    if (moves_[j] == 0) continue;
    const Quintic::Point at = move_[j].At(time);
    const auto k = static_cast<Eigen::Index>(j);
    position_[k] = at.position;
    velocity_[k] = at.velocity;
    acceleration_[k] = at.acceleration;
  }
}

void PostureReference::Archive(StateArchive* archive) {
  archive->Show(move_, moves_, position_, velocity_, acceleration_);
}

}  // namespace poise
