// The whole bridge between commands that a test gives and a bus that a rig makes: what the rigs of
// all buses share.
#pragma once

#include <csignal>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "hw_bridge/hw_bridge.h"

namespace poise {

/// A text of deploy/.
inline std::string ReadDeployed(const std::string& name) {
  std::ifstream file(std::string(POISE_SOURCE_DIR "/deploy/") + name);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

class BridgeBench {
 public:
  const bridge_status_t& status() const { return *Output<bridge_status_t>("bridge_status"); }
  const bus_status_t& bus_status() const { return *Output<bus_status_t>("bus_status"); }
  const robot_sensors_t& readings() const { return *Output<robot_sensors_t>("robot_sensors"); }
  bool HasInput(const std::string& name) const { return FindInput(name) != nullptr; }
  /// Whether an output was withheld since the last call.
  bool TakeWithheld() { return std::exchange(withheld_, false); }

  static constexpr int64_t kRunId = 5;
  volatile std::sig_atomic_t signal = 0;
  std::unique_ptr<HwBridge> bridge;
  joint_command_t command;
  emergency_stop_t stop{};

 protected:
  /// The paper's robot, at 500 Hz, with `config` of the bridge.
  ComponentContext Context(const std::string& config) {
    resources_ = {{"robot", ReadDeployed("robots/dyros/dyros_legs.pbtxt")},
                  {"urdf", ReadDeployed("robots/dyros/dyros_legs.urdf")}};
    ComponentContext context;
    context.name = "hw_bridge";
    context.config_text = config;
    context.tick_period = 0.002;
    context.resources = &resources_;
    context.shared = &shared_;
    return context;
  }
  void Configure(const ComponentContext& context, int joints) {
    MessageTraits<joint_command_t>::Resize(command, MessageCounts{joints, 2});
    command.run_id = stop.run_id = kRunId;
    bridge->Configure(context, &wiring_);
  }
  /// The bridge's stages of one cycle. The operator's message is there from its first change on.
  void RunCycle(bool with_command, double lateness = 0) {
    command.tick = tick_;
    command.utime = 2000 * tick_;
    FindInput("joint_command")->Bind(with_command ? &command : nullptr);
    operator_heard_ = operator_heard_ || stop.stop != 0 || stop.reset != 0;
    FindInput("emergency_stop")->Bind(operator_heard_ ? &stop : nullptr);
    const Tick tick{.index = tick_, .utime = 2000 * tick_, .time = 0, .lateness = lateness};
    for (const Stage& stage : wiring_.stages()) {
      for (OutputPort* output : stage.outputs) output->Stamp(kRunId, tick.index, tick.utime);
      stage.run(tick);
      for (OutputPort* output : stage.outputs) withheld_ = output->TakeWithheld() || withheld_;
    }
    ++tick_;
  }
  /// Cycles of `step` that are needed until `condition` holds after the first: 0, the very next
  /// frame shows it; -1: it never did.
  template <class Step, class Condition>
  static int Count(Step step, Condition condition) {
    for (int cycles = 0; cycles < 2000; ++cycles) {
      step();
      if (condition()) return cycles;
    }
    return -1;
  }
  InputPort* FindInput(const std::string& name) const {
    for (InputPort* input : wiring_.inputs()) {
      if (input->name() == name) return input;
    }
    return nullptr;
  }

 private:
  template <class T>
  const T* Output(const std::string& name) const {
    for (OutputPort* output : wiring_.outputs()) {
      if (output->name() == name) return static_cast<const T*>(output->message());
    }
    throw std::logic_error("no output " + name);
  }

  std::map<std::string, std::string> resources_;
  SharedObjects shared_;
  Wiring wiring_;
  int64_t tick_ = 0;
  bool operator_heard_ = false, withheld_ = false;
};

}  // namespace poise
