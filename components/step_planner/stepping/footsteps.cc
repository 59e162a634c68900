#include "components/step_planner/stepping/footsteps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "components/robot/robot_model.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;

Vector2d Turned(double yaw, const Vector2d& point) { return Eigen::Rotation2Dd(yaw) * point; }

}  // namespace

Foothold NextFootstep(const Foothold& stance, Foot foot, const WalkCommand& command, double period,
                      const FootstepLimits& limits) {
  const double side = Side(foot);
  if (command.has_footholds()) {
    const Foothold& asked = command.stride[foot];
    const double ahead = std::clamp(asked.position.x(), -limits.longest, limits.longest);
    const double apart =
        std::clamp(side * asked.position.y(), limits.least_spacing, limits.spacing + limits.widest);
    return {stance.position + Turned(stance.yaw, {ahead, side * apart}),
            stance.yaw + std::clamp(asked.yaw, -limits.most_turn, limits.most_turn)};
  }
  // Out by two steps, then none.
  const auto outwards = [&](double rate) { return rate * side > 0 ? 2 * rate * period : 0.0; };
  const Vector2d half(0, 0.5 * side * limits.spacing);
  const double turn = std::clamp(outwards(command.turn_rate), -limits.most_turn, limits.most_turn);
  const Vector2d way(std::clamp(period * command.velocity.x(), -limits.longest, limits.longest),
                     std::clamp(outwards(command.velocity.y()), -limits.widest, limits.widest));
  Foothold step;
  step.yaw = stance.yaw + turn;
  // The middle between the feet goes along the mean heading.
  const Vector2d from_stance = half + Turned(0.5 * turn, way) + Turned(turn, half);
  const double apart = std::max(side * from_stance.y(), limits.least_spacing);
  step.position = stance.position + Turned(stance.yaw, {from_stance.x(), side * apart});
  return step;
}

Stride NominalStride(const Foothold& stance, Foot foot, const WalkCommand& command, double period,
                     double frequency, const FootstepLimits& limits) {
  const double growth = std::exp(frequency * period);
  Stride stride;
  stride.next = NextFootstep(stance, foot, command, period, limits);
  const Foothold after = NextFootstep(stride.next, Other(foot), command, period, limits);
  const Vector2d first = stride.next.position - stance.position;
  const Vector2d second = after.position - stride.next.position;
  const double whole = growth * growth - 1;
  stride.begin = (growth * first + second) / whole;
  stride.end = (growth * second + first) / whole;
  return stride;
}

Foothold Towards(const Foothold& step, const Foothold& wanted, double most, const Foothold& stance,
                 Foot foot, const FootstepLimits& limits) {
  const double side = Side(foot);
  Vector2d way = wanted.position - step.position;
  const double size = way.norm();
  if (size > most) way *= most / size;
  const double turn = std::remainder(wanted.yaw - step.yaw, 2 * M_PI);
  Foothold moved{step.position + way, step.yaw + std::clamp(turn, -most, most)};
  Vector2d beside = Turned(-stance.yaw, moved.position - stance.position);
  beside.y() = side * std::max(side * beside.y(), limits.least_spacing);
  moved.position = stance.position + Turned(stance.yaw, beside);
  return moved;
}

Foot FirstFoot(const WalkCommand& command) {
  const double left = command.velocity.y() != 0 ? command.velocity.y() : command.turn_rate;
  return left > 0 ? Foot::kLeft : Foot::kRight;
}

WalkCommand Approach(const WalkCommand& from, const WalkCommand& command, double speed,
                     double turn) {
  WalkCommand next = command;
  if (command.has_footholds()) return next;
  const Vector2d change = command.velocity - from.velocity;
  const double size = change.norm();
  if (size > speed) next.velocity = from.velocity + speed / size * change;
  next.turn_rate = from.turn_rate + std::clamp(command.turn_rate - from.turn_rate, -turn, turn);
  // It stops only once it is slow enough to.
  next.stepping = command.stepping || !next.in_place();
  return next;
}

}  // namespace poise::stepping
