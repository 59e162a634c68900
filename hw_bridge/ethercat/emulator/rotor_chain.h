// RotorChain: an emulated chain with a rotor on each drive, for a chain without a robot.
#pragma once

#include <vector>

#include "hw_bridge/ethercat/emulator/emulated_chain.h"

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
  /// Lets `seconds` pass: the exact motion under a constant torque.
  void Advance(double seconds);

 private:
  double inertia_, damping_;
  double torque_ = 0, position_ = 0, velocity_ = 0;
};

class RotorChain final : public FrameHandler {
 public:
  /// Throws EthercatError as EmulatedChain does.
  RotorChain(const EmulatedChainConfig& config, double inertia, double damping);
  void AdvanceTo(int64_t now) override;
  bool HandleFrame(std::span<uint8_t> frame, int64_t now) override;

  EmulatedChain& chain() { return chain_; }
  const Rotor& rotor(size_t drive) const { return rotors_[drive]; }

 private:
  static std::vector<MotorLoad*> Loads(std::vector<Rotor>* rotors);

  std::vector<Rotor> rotors_;
  EmulatedChain chain_;
  int64_t now_ = 0;
};

}  // namespace poise::ethercat
