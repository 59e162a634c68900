// The drive bus of the simulated robot: two ports of the graph.
#pragma once

#include "components/framework/ports.h"
#include "hw_bridge/drive/drive_bus.h"

namespace poise {

class SimulatedDriveBus final : public DriveBus {
 public:
  /// `feedback` must outlive the bus.
  explicit SimulatedDriveBus(const Input<drive_feedback_t>* feedback) : feedback_(feedback) {}

  const drive_feedback_t* Receive() override {
    return feedback_->present() ? &**feedback_ : nullptr;
  }
  /// The message that the bridge publishes is the command.
  void Send(const drive_command_t&) override {}
  bool impedance() const override { return true; }
  SensorsOfBus sensors() const override { return {.velocity = true}; }
  const BusHealth& health() const override { return health_; }

 private:
  const Input<drive_feedback_t>* feedback_;
  BusHealth health_;
};

}  // namespace poise
