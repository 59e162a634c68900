// What a linear inverted pendulum in the robot's place could stand of a push.
#pragma once

#include <optional>

#include "logging/run_record.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {

/// A pendulum of the robot's mass m with its COM at constant height h, w = sqrt(g/h), no angular
/// momentum about the COM, CoP anywhere in the support polygon and at its edge at once; the push
/// acts on the COM. It can be brought to rest as long as its capture point, COM + velocity/w, is in
/// the polygon. `distance`: from the capture point at the push's start to the polygon's edge along
/// the push.
struct PushBound {
  double impulse = 0;      ///< N·s, horizontal, of the push: 2/pi F T of a half sine, F T
  double mass = 0;         ///< kg, of the simulated robot
  double height = 0;       ///< m, COM above the soles that bear
  double distance = 0;     ///< m
  double lip_impulse = 0;  ///< N·s, m w d: the bound of an instantaneous push
  /// N·s, the bound of a push of this shape and duration T, whose force f(t) must satisfy
  /// integral of f e^(-wt) dt <= m w d.
  double lip_impulse_of_duration = 0;
  /// A run with a recovery step has m from that edge to the farthest one that a step can make
  /// (FarthestSupport), s from the push's begin to the first touch-down, and N·s,
  /// m w (d + reach e^(-w time)): what one step catches of a push at once. Others have 0.
  double reach = 0, step_time = 0, step_impulse = 0;

  /// Whether there is such a bound. Else impulse and mass alone are known.
  bool bounded() const { return lip_impulse > 0; }
};

/// Finds of several pushes the nearest to its bound, or the farthest beyond it: each has the
/// robot as it stands when it begins, those to come after the run's end do not count; without any
/// bound, the largest. Without feet that bear at a push's start, or with a capture point beyond
/// them, it has no bound. Empty when the scenario has hands, no push or but vertical ones.
std::optional<PushBound> FindPushBound(const Scenario& scenario, const logging::RunRecord& run);

/// Share of a push's impulse that counts for an inverted pendulum: integral of f e^(-wt) dt over
/// that of f, for its shape and duration (s), `frequency` w in 1/s.
double PendulumShare(Push::Profile profile, double duration, double frequency);

}  // namespace poise
