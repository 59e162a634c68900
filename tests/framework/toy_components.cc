#include "tests/framework/toy_components.h"

#include <unistd.h>

#include <cmath>
#include <limits>

#include "tests/framework/toy.pb.h"

namespace poise {
namespace {

/// What all toys share: the end, and the allocations until then.
class Toy : public Component {
 public:
  std::string_view finished() const override { return detail_; }
  bool failed() const override { return config_.fail() && !detail_.empty(); }

 protected:
  void Read(const ComponentContext& context) { config_ = context.config<ToyConfig>(); }
  int32_t joints() const { return config_.joints(); }
  /// The last thing a stage does.
  void MaybeFinish(const Tick& tick) {
    if (tick.index == 20) allocations_at_20_ = AllocationCount();
    if (tick.index != config_.finish_at()) return;
    const int64_t allocated = AllocationCount() - allocations_at_20_;
    detail_ =
        config_.report_allocations() ? "allocations: " + std::to_string(allocated) : "toy finished";
  }
  double Number(const Tick& tick, double value) const {
    return tick.index == config_.nan_at() ? std::numeric_limits<double>::quiet_NaN() : value;
  }
  ToyConfig config_;

 private:
  int64_t allocations_at_20_ = 0;
  std::string detail_;
};

/// An object that the components of one process share.
std::shared_ptr<double> SharedGain(const ComponentContext& context) {
  return context.shared->Get<double>("gain", [] { return std::make_shared<double>(0.5); });
}

/// A chaotic map driven by the last command, so that one wrong or missing message changes
/// everything after it.
class ToyPlant final : public Toy {
 public:
  void Configure(const ComponentContext& context, Wiring* wiring) override {
    Read(context);
    state_.assign(static_cast<size_t>(joints()), 0.3);
    noise_ = context.seed;
    wiring->AddInput(&command_, "command", {joints(), 2}, InputKind::kPreviousTick);
    wiring->AddOutput(&sensors_, "sensors", {joints(), 2});
    wiring->AddOutput(&push_, "push", {});
    wiring->AddStage("step", {&command_}, {&sensors_, &push_},
                     [this](const Tick& tick) { Step(tick); });
  }

 private:
  void Step(const Tick& tick) {
    for (size_t i = 0; i < state_.size(); ++i) {
      const double torque = command_.present() ? command_->torque[i] : 0.1;
      noise_ = noise_ * 6364136223846793005u + 1442695040888963407u;
      state_[i] = 3.9 * state_[i] * (1 - state_[i]) * (0.99 + 0.01 * std::cos(torque)) +
                  1e-6 * static_cast<double>(noise_ >> 60);
      state_[i] = std::min(0.999, std::max(0.001, state_[i]));
      sensors_->joint_position[i] = Number(tick, state_[i]);
    }
    push_->force[0] = state_[0];
    if (command_.present()) push_->force[1] = static_cast<double>(command_->tick);
    MaybeFinish(tick);
  }
  Input<joint_command_t> command_;
  Output<robot_sensors_t> sensors_;
  Output<external_push_t> push_;
  std::vector<double> state_;
  uint64_t noise_ = 0;
};

class ToyFilter final : public Toy {
 public:
  void Configure(const ComponentContext& context, Wiring* wiring) override {
    Read(context);
    const int32_t n = config_.wrong_counts() ? joints() + 1 : joints();
    filtered_.assign(static_cast<size_t>(n), 0.0);
    gain_ = SharedGain(context);
    wiring->AddInput(&sensors_, "sensors", {n, 2});
    wiring->AddOutput(&state_, "state", {joints(), 2});
    wiring->AddStage("filter", {&sensors_}, {&state_}, [this](const Tick& tick) {
      for (size_t i = 0; i < filtered_.size(); ++i) {
        filtered_[i] = 0.5 * filtered_[i] + *gain_ * sensors_->joint_position[i];
        state_->joint_position[i] = filtered_[i];
      }
      MaybeFinish(tick);
    });
  }
  bool Archive(StateArchive* archive) override {
    archive->Show(filtered_);
    return true;
  }

 private:
  Input<robot_sensors_t> sensors_;
  Output<robot_state_t> state_;
  std::shared_ptr<double> gain_;
  std::vector<double> filtered_;
};

/// Two stages: the first needs only the sensors, the second waits for the filter too.
class ToyController final : public Toy {
 public:
  void Configure(const ComponentContext& context, Wiring* wiring) override {
    Read(context);
    gain_ = SharedGain(context);
    wiring->AddInput(&sensors_, "sensors", {joints(), 2});
    wiring->AddInput(&state_, "state", {joints(), 2});
    wiring->AddInput(&before_, "before", {joints(), 2}, InputKind::kPreviousTick);
    wiring->AddInput(&stop_, "stop", {}, InputKind::kLatest);
    wiring->AddOutput(&torque_, "torque", {joints()});
    wiring->AddOutput(&command_, "command", {joints(), 2});
    wiring->AddStage("prepare", {&sensors_, &before_}, {&torque_}, [this](const Tick&) {
      if (!sensors_.present()) return torque_.Withhold();  // in real time
      for (size_t i = 0; i < torque_->torque.size(); ++i) {
        torque_->torque[i] = 2 * sensors_->joint_position[i] +
                             (before_.present() ? 0.1 * before_->joint_position[i] : 0);
      }
    });
    wiring->AddStage("control", {&state_, &stop_}, {&command_}, [this](const Tick& tick) {
      for (size_t i = 0; state_.present() && i < command_->torque.size(); ++i) {
        command_->torque[i] = torque_->torque[i] - config_.gains().kd() * state_->joint_position[i];
      }
      command_->status = stop_.present() && stop_->stop != 0 ? 1 : 0;
      MaybeFinish(tick);
    });
  }

 private:
  Input<robot_sensors_t> sensors_;
  Input<robot_state_t> state_;
  Input<robot_sensors_t> before_;
  Input<emergency_stop_t> stop_;
  std::shared_ptr<double> gain_;
  Output<task_torque_t> torque_;
  Output<joint_command_t> command_;
};

class ToyClock final : public Toy {
 public:
  void Configure(const ComponentContext& context, Wiring* wiring) override {
    Read(context);
    wiring->AddOutput(&push_, "push", {});
    wiring->AddStage("beat", {}, {&push_}, [this](const Tick& tick) {
      push_->force[0] = std::sin(tick.time);
      MaybeFinish(tick);
    });
  }

 private:
  Output<external_push_t> push_;
};

class ToySink final : public Toy {
 public:
  void Configure(const ComponentContext& context, Wiring* wiring) override {
    Read(context);
    wiring->AddInput(&push_, "push", {});
    wiring->AddOutput(&sum_, "sum", {});
    wiring->AddStage("add", {&push_}, {&sum_}, [this](const Tick& tick) {
      double x = push_->force[0];
      for (int64_t i = 0; i < config_.work(); ++i) x = std::sin(x);
      sum_->force[0] += x;
      MaybeFinish(tick);
    });
  }
  bool Archive(StateArchive* archive) override {
    archive->Show(sum_->force[0]);
    return true;
  }

 private:
  Input<external_push_t> push_;
  Output<external_push_t> sum_;
};

/// Adds what came a tick before.
class ToyEcho final : public Toy {
 public:
  void Configure(const ComponentContext& context, Wiring* wiring) override {
    Read(context);
    wiring->AddInput(&push_, "push", {});
    wiring->AddInput(&before_, "before", {}, InputKind::kPreviousTick);
    wiring->AddOutput(&sum_, "sum", {});
    wiring->AddStage("add", {&push_, &before_}, {&sum_}, [this](const Tick& tick) {
      sum_->force[0] = push_->force[0] + (before_.present() ? before_->force[0] : 0);
      MaybeFinish(tick);
    });
  }

 private:
  Input<external_push_t> push_;
  Input<external_push_t> before_;
  Output<external_push_t> sum_;
};

template <class T>
std::unique_ptr<Component> Make() {
  return std::make_unique<T>();
}

}  // namespace

void AddToyComponents(ComponentRegistry* registry) {
  registry->Add("toy_plant", "chaotic map", Make<ToyPlant>);
  registry->Add("toy_echo", "sum with the tick before", Make<ToyEcho>);
  registry->Add("toy_filter", "low-pass", Make<ToyFilter>);
  registry->Add("toy_controller", "two stages", Make<ToyController>);
  registry->Add("toy_clock", "free-running source", Make<ToyClock>);
  registry->Add("toy_sink", "running sum", Make<ToySink>);
}

Graph ToyLoop() {
  Graph graph;
  ParseTextProto(R"(
    name: "toy_loop"
    channel { name: "SENSORS" type: "robot_sensors_t" }
    channel { name: "STATE" type: "robot_state_t" }
    channel { name: "TORQUE" type: "task_torque_t" }
    channel { name: "COMMAND" type: "joint_command_t" }
    channel { name: "PUSH" type: "external_push_t" }
    channel { name: "STOP" type: "emergency_stop_t" external: true }
    component {
      name: "controller" type: "toy_controller"
      input { port: "sensors" channel: "SENSORS" }
      input { port: "state" channel: "STATE" }
      input { port: "before" channel: "SENSORS" }
      input { port: "stop" channel: "STOP" }
      output { port: "torque" channel: "TORQUE" }
      output { port: "command" channel: "COMMAND" }
    }
    component {
      name: "filter" type: "toy_filter"
      input { port: "sensors" channel: "SENSORS" }
      output { port: "state" channel: "STATE" }
    }
    component {
      name: "plant" type: "toy_plant"
      input { port: "command" channel: "COMMAND" }
      output { port: "sensors" channel: "SENSORS" }
      output { port: "push" channel: "PUSH" }
    })",
                 "toy_loop", &graph);
  return graph;
}

Graph ToyChain() {
  Graph graph;
  ParseTextProto(R"(
    name: "toy_chain"
    channel { name: "PUSH" type: "external_push_t" }
    channel { name: "SUM" type: "external_push_t" }
    component { name: "clock" type: "toy_clock" output { port: "push" channel: "PUSH" } }
    component {
      name: "sink" type: "toy_sink"
      input { port: "push" channel: "PUSH" }
      output { port: "sum" channel: "SUM" }
    })",
                 "toy_chain", &graph);
  return graph;
}

RunSpec ToyRun(const Graph& graph, int64_t num_ticks) {
  RunSpec spec;
  spec.set_run_id(1000 + getpid());
  *spec.mutable_graph() = graph;
  spec.set_tick_period(0.002);
  spec.set_seed(42);
  spec.set_num_ticks(num_ticks);
  spec.set_first_port(10000 + (getpid() % 1200) * 16);  // 9 ports, below the ephemeral ones
  return spec;
}

}  // namespace poise
