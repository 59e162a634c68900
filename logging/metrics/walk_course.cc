#include "logging/metrics/walk_course.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "components/messages/conversions.h"
#include "logging/metrics/schedule_plan.h"
#include "logging/metrics/true_contacts.h"
#include "operate/act_t.hpp"

namespace poise::logging {
namespace {

/// The first tick whose command is an operator's; the run's end without one.
int64_t CommandedUntil(const RunRecord& run) {
  using operate::act_t;
  int64_t end = run.num_ticks;
  for (const operate::answer_t& answer : run.answers) {
    const bool walk = answer.kind == act_t::KIND_WALK || answer.kind == act_t::KIND_STAND ||
                      answer.kind == act_t::KIND_STEP;
    if (!walk || answer.verdict != operate::answer_t::VERDICT_DONE) continue;
    end = std::min(end, std::max<int64_t>(answer.tick, 0));
  }
  return end;
}

/// Calls visit(tick, velocity) for each tick that the orders command, in order.
template <class Visit>
void VisitCommands(const RunRecord& run, const Visit& visit) {
  const std::vector<WalkOrder> orders = ReadWalkOrders(run);
  if (orders.empty()) return;
  std::vector<int64_t> begun;  // ticks, of the steps
  for (const TrueStep& step : TrueSteps(run)) begun.push_back(step.lifted);
  std::ranges::sort(begun);
  const int64_t end = CommandedUntil(run);
  for (int64_t tick = std::max(run.first_tick, run.spec.lead_ticks()); tick < end; ++tick) {
    const auto steps = std::ranges::upper_bound(begun, tick) - begun.begin();
    const WalkOrder* order = nullptr;
    for (const WalkOrder& next : orders) {
      if (next.time > run.time(tick) || next.after_steps > steps) break;
      order = &next;
    }
    if (order != nullptr) visit(tick, order->velocity);
  }
}

}  // namespace

double Heading(const ground_truth_t& truth) {
  const double* q = truth.base_orientation;
  const Eigen::Vector3d ahead =
      Eigen::Quaterniond(q[0], q[1], q[2], q[3]) * Eigen::Vector3d::UnitX();
  return std::atan2(ahead.y(), ahead.x());
}

WalkCourse FollowedCourse(const RunRecord& run) {
  WalkCourse course;
  const int64_t down = DownTick(run).value_or(run.num_ticks);
  struct Place {
    int64_t tick;
    Eigen::Vector2d com;
    double heading;
  };
  std::optional<Place> last;
  VisitCommands(run, [&](int64_t tick, const Eigen::Vector3d& velocity) {
    course.commanded_way += run.duration(1) * velocity.head<2>().norm();
    course.commanded_turn += run.duration(1) * std::abs(velocity.z());
    const ground_truth_t* const truth = tick < down ? run.truth.at(tick) : nullptr;
    if (truth == nullptr) return;
    const Place place{tick, GetVector3(truth->com_position).head<2>(), Heading(*truth)};
    if (last && last->tick == tick - 1) {
      const Eigen::Vector2d along = Eigen::Rotation2Dd(last->heading) * velocity.head<2>();
      course.way += (place.com - last->com).dot(along.normalized());
      const double turn = std::remainder(place.heading - last->heading, 2 * M_PI);
      if (velocity.z() != 0) course.turn += std::copysign(1.0, velocity.z()) * turn;
    }
    last = place;
  });
  return course;
}

}  // namespace poise::logging
