// Rotor: what a drive of a chain without a robot turns.
#pragma once

#include <cmath>

#include "hw_bridge/ethercat/emulator/emulated_drive.h"

namespace poise::ethercat {

/// A shaft that turns by itself: inertia and friction proportional to its speed.
class Rotor final : public MotorLoad {
 public:
  /// `inertia`: kg·m²; `damping`: N·m·s/rad; both at the motor shaft, above 0.
  Rotor(double inertia, double damping) : inertia_(inertia), damping_(damping) {}
  void SetTorque(double torque) override { torque_ = torque; }
  double position() const override { return position_; }
  double velocity() const override { return velocity_; }
  double torque() const { return torque_; }
  /// The exact motion under a constant torque.
  void AdvanceTo(int64_t now) override {
    const double last = torque_ / damping_;  // the speed that it tends to
    const double seconds = static_cast<double>(now - now_) * 1e-9;
    const double decay = std::exp(-damping_ / inertia_ * seconds);
    position_ += last * seconds + (velocity_ - last) * inertia_ / damping_ * (1 - decay);
    velocity_ = last + (velocity_ - last) * decay;
    now_ = now;
  }

 private:
  double inertia_, damping_;
  double torque_ = 0, position_ = 0, velocity_ = 0;
  int64_t now_ = 0;  // ns
};

}  // namespace poise::ethercat
