// The drive bus of the simulated robot: two ports of the graph.
#pragma once

#include "components/framework/ports.h"
#include "hw_bridge/drive_bus.h"

namespace poise {

class SimulatedDriveBus final : public DriveBus {
 public:
  /// Both ports must outlive the bus.
  SimulatedDriveBus(const Input<drive_feedback_t>* feedback, Output<drive_command_t>* command)
      : feedback_(feedback), command_(command) {}

  const drive_feedback_t* Receive() override {
    return feedback_->present() ? &**feedback_ : nullptr;
  }
  void Send(const drive_command_t& command) override {
    (*command_)->current = command.current;
    (*command_)->enabled = command.enabled;
  }

 private:
  const Input<drive_feedback_t>* feedback_;
  Output<drive_command_t>* command_;
};

}  // namespace poise
