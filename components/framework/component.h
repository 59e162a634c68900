// Component: a configuration, typed inputs, typed outputs and stages that are pure functions of
// both.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <typeindex>
#include <utility>
#include <vector>

#include "components/framework/component_traits.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "components/framework/ports.h"
#include "components/framework/state_archive.h"

namespace poise {

/// The control cycle a stage is run for. Simulated or real: a component never reads a clock.
struct Tick {
  int64_t index = 0;
  int64_t utime = 0;  ///< us since the start of the run, time of validity
  /// s of the scenario's time, negative in the run's lead: phases, pushes and moves are timed by
  /// it.
  double time = 0;
  /// s that this cycle began after its time, for the component that owns the clock in real time;
  /// else 0.
  double lateness = 0;
};

/// Hardware at the other end of a file descriptor, which a component answers for while its process
/// waits for messages. Only processes serve devices. No call may allocate, throw or block.
class Device {
 public:
  virtual ~Device() = default;
  /// Readable when there is something to serve.
  virtual int fd() const = 0;
  /// Called whenever fd() is readable, and at least once a tick period.
  virtual void Serve() = 0;
};

/// Objects that components inside one process share (e.g. the robot's dynamics of this tick), by
/// type and key. In a graph of processes each process has its own; a shared object must therefore
/// never carry information that is not a pure function of the messages its user has seen.
class SharedObjects {
 public:
  /// The object of type T under `key`, made by `make` (returning std::shared_ptr<T>) on first use.
  template <class T, class Make>
  std::shared_ptr<T> Get(std::string_view key, Make&& make) {
    auto& slot = objects_[{std::type_index(typeid(T)), std::string(key)}];
    if (!slot) slot = make();
    return std::static_pointer_cast<T>(slot);
  }

 private:
  std::map<std::pair<std::type_index, std::string>, std::shared_ptr<void>> objects_;
};

/// What a component is given when it is configured. Alive only during Configure, except `shared`
/// contents.
struct ComponentContext {
  std::string name;         ///< instance name in the graph
  std::string config_text;  ///< protobuf text of the component's own configuration message
  double tick_period = 0;   ///< s
  int64_t lead_ticks = 0;   ///< before the scenario's time 0
  int64_t num_ticks = 0;    ///< of the run, the lead's with them; 0: it has no planned end
  uint64_t seed = 0;  ///< of this instance: the run's seed mixed with `name`, or its seed_name
  const std::map<std::string, std::string>* resources = nullptr;  ///< "robot", "urdf": text by name
  SharedObjects* shared = nullptr;

  /// Text of a resource. Throws ConfigError when the run has no such resource.
  const std::string& resource(const std::string& name) const;
  /// The configuration as a `Config` message whose fields keep their rules. Throws ConfigError with
  /// line and field.
  template <class Config>
  Config config() const {
    Config message;
    ParseTextProto(config_text, name, &message);
    CheckFields(message);
    return message;
  }
};

/// A stage: runs once a tick, after the stages declared before it, as soon as its inputs have
/// joined.
struct Stage {
  std::string name;
  std::vector<InputPort*> inputs;
  std::vector<OutputPort*> outputs;
  std::function<void(const Tick&)> run;
  /// Share of the period after the cycle's start at which the owner of the clock runs this stage in
  /// real time, whether its inputs are there or not. Others wait.
  double deadline = 1;
};

/// Collects what a component declares in Configure: ports, stages, warnings. Port names are unique
/// per direction. The functions that add a port or a stage throw ConfigError on a declaration that
/// cannot work (wrong number of counts, a stage without ports of this wiring, an output in two
/// stages).
class Wiring {
 public:
  /// `port` must outlive the wiring (it is a member of the component).
  void AddInput(InputPort* port, std::string name, MessageCounts counts,
                InputKind kind = InputKind::kSameTick);
  void AddOutput(OutputPort* port, std::string name, MessageCounts counts);
  /// An output belongs to exactly one stage and is sent when that stage returns. An input may serve
  /// several. `deadline`: see Stage, 0 to 1.
  void AddStage(std::string name, std::vector<InputPort*> inputs, std::vector<OutputPort*> outputs,
                std::function<void(const Tick&)> run, double deadline = 1);
  /// Says what is odd about a configuration that works all the same. `text` begins with the field:
  /// "walk.command has no effect without walk.enabled=true". Who starts the run tells of it.
  void AddWarning(std::string text) { warnings_.push_back(std::move(text)); }

  const std::vector<InputPort*>& inputs() const { return inputs_; }
  const std::vector<OutputPort*>& outputs() const { return outputs_; }
  const std::vector<Stage>& stages() const { return stages_; }
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  std::vector<InputPort*> inputs_;
  std::vector<OutputPort*> outputs_;
  std::vector<Stage> stages_;
  std::vector<std::string> warnings_;
};

/// A component sees no bus, no clock and no file. The same object runs in its own process, inside
/// one process, under a test and from a log. Stages must not allocate, throw, lock or log.
class Component {
 public:
  virtual ~Component() = default;

  /// Called once, before any tick: reads the configuration, declares ports and stages, allocates
  /// everything. Throws ConfigError on a configuration it cannot work with.
  virtual void Configure(const ComponentContext& context, Wiring* wiring) = 0;

  /// Called by processes only, once, after Configure and before the component says that it is
  /// ready: starts hardware. May block; devices() of the other processes are served meanwhile.
  /// Throws std::runtime_error with what to do.
  virtual void Open() {}
  /// Called by processes only, once a tick period from Open until the first tick and from the last
  /// tick until Close: keeps hardware alive that Open has started.
  virtual void Idle() {}
  /// Called by processes only, once, when the run has ended in whatever way, after Open has
  /// returned: brings hardware to rest. May block for a second or two. Empty: done; else what went
  /// wrong.
  virtual std::string Close() { return {}; }
  /// Devices to serve, from Open until after Close. Owned by the component.
  virtual std::vector<Device*> devices() { return {}; }
  /// ns by which the next cycle is to begin later (negative: earlier) than a period after this one:
  /// asked after each tick of the component that owns the clock in real time.
  virtual int64_t cycle_correction() const { return 0; }

  /// Shows all state that lasts from tick to tick to `archive`, which measures, saves or restores
  /// it; called between ticks, after Configure. A fresh object with the same configuration and a
  /// restored state goes on with the same bits. Must not allocate or throw. False: this component
  /// cannot be taken over.
  virtual bool Archive(StateArchive* archive) {
    static_cast<void>(archive);
    return false;
  }

  /// Non-empty once the component wants the run to end after the current tick, e.g. "robot fell
  /// at 1.234 s". Polled by the runner after each stage. Must stay constant once set.
  virtual std::string_view finished() const { return {}; }
  /// True when the end that finished() asks for is a failure of the run (a fall) rather than its
  /// planned end.
  virtual bool failed() const { return false; }
};

/// Makes components of one type.
using ComponentFactory = std::function<std::unique_ptr<Component>()>;

}  // namespace poise
