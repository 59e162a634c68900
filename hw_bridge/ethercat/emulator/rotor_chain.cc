#include "hw_bridge/ethercat/emulator/rotor_chain.h"

#include <algorithm>
#include <cmath>

namespace poise::ethercat {
namespace {

// Between two looks of the drives at their motors: below a current loop's period.
constexpr int64_t kStep = kMillisecond / 4;
// A process that was left out by the scheduler does not make up for more.
constexpr int64_t kMostAtOnce = kSecond;

}  // namespace

void Rotor::Advance(double seconds) {
  const double last = torque_ / damping_;  // the speed that it tends to
  const double decay = std::exp(-damping_ / inertia_ * seconds);
  position_ += last * seconds + (velocity_ - last) * inertia_ / damping_ * (1 - decay);
  velocity_ = last + (velocity_ - last) * decay;
}

std::vector<MotorLoad*> RotorChain::Loads(std::vector<Rotor>* rotors) {
  std::vector<MotorLoad*> loads;
  for (Rotor& rotor : *rotors) loads.push_back(&rotor);
  return loads;
}

RotorChain::RotorChain(const EmulatedChainConfig& config, double inertia, double damping)
    : rotors_(static_cast<size_t>(config.drive_size()), Rotor(inertia, damping)),
      chain_(config, Loads(&rotors_)) {}

void RotorChain::AdvanceTo(int64_t now) {
  now_ = std::max(now_, now - kMostAtOnce);
  while (now_ < now) {
    const int64_t step = std::min(kStep, now - now_);
    for (Rotor& rotor : rotors_) rotor.Advance(static_cast<double>(step) * 1e-9);
    now_ += step;
    chain_.AdvanceTo(now_);
  }
}

bool RotorChain::HandleFrame(std::span<uint8_t> frame, int64_t now) {
  AdvanceTo(now);
  return chain_.HandleFrame(frame, std::max(now, now_));
}

}  // namespace poise::ethercat
