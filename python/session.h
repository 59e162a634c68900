// A scenario that runs inside this process, step by step.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "components/framework/runners/inline_runner.h"
#include "components/messages/foreign_component.h"
#include "logging/events/bridge_words.h"
#include "logging/recording/inline_recorder.h"
#include "poise/bridge_status_t.hpp"
#include "poise/joint_command_t.hpp"
#include "python/run_store.h"
#include "tools/operator/inline_port.h"
#include "tools/run/run_dir.h"
#include "tools/scenario/scenario_loading.h"

namespace poise::python {

struct SessionOptions {
  std::string scenario;
  RunChanges changes;
  /// Components of the graph, by name, whose stage is a function given here: ports as the replaced
  /// type's.
  std::map<std::string, std::shared_ptr<ForeignFunctions>> replaced;
  /// A run whose messages take the place of the simulated robot's; nullptr: it is simulated.
  std::shared_ptr<const RunStore> plant;
  enum class Keep { kNothing, kMemory, kFolder };
  Keep keep = Keep::kNothing;
  std::string out;  ///< of kFolder
  bool force = false;
  bool endless = false;  ///< goes on after the scenario's duration
};

/// All public functions may be called from several threads, one after the other; one that is called
/// from within a step throws.
class Session {
 public:
  /// Throws ConfigError, RobotError or LogError.
  explicit Session(SessionOptions options);
  ~Session();

  /// Runs up to `ticks` ticks; returns those run, fewer when the run ends. Throws what a replaced
  /// component threw, LogError, and ConfigError for an act that was refused meanwhile.
  int64_t Step(int64_t ticks);

  /// N, world axes, at `point` (m, body frame) of a body from the next tick on, for `ticks` ticks,
  /// or until set again (-1). Throws ConfigError: no such body, numbers that are not finite, no
  /// simulated robot, the run has ended.
  void Push(const std::string& body, const Eigen::Vector3d& force, const Eigen::Vector3d& point,
            int64_t ticks);
  /// m/s ahead, m/s to the left, rad/s to the left, from the next tick on; empty: it stops. Throws
  /// ConfigError, or the Step after it does: a planner that does not walk, numbers out of range.
  void Walk(std::optional<Eigen::Vector3d> velocity);
  /// A joint that no leg needs comes to rest at `angle`, rad, in `duration` s, or in as many more
  /// as its limits ask for. Throws ConfigError, or the Step after it does.
  void Move(const std::string& joint, double angle, double duration);
  /// The joint's commanded torque (N·m) in place of the redistributor's; empty: no longer. Throws
  /// ConfigError: no such joint, not finite.
  void OverrideTorque(int joint, std::optional<double> torque);
  /// What the bridge is commanded from the next tick on, in the controller's place, by joint: N·m,
  /// rad, rad/s, N·m/rad, N·m·s/rad.
  struct Command {
    std::vector<double> torque, position, velocity, stiffness, damping;
  };
  /// Empty: the controller's again. Throws ConfigError: not the robot's number of joints, not
  /// finite, stiffness or damping negative.
  void SetCommand(std::optional<Command> command);
  /// The last message of a channel. Before the first tick those are there that come before any
  /// command: its stages up to the first replaced component, or the command's writer, are run.
  /// Throws ConfigError: no such channel, none yet.
  std::vector<uint8_t> Message(const std::string& channel);
  const MessageLayout& Layout(const std::string& channel) const;
  const MessageType& Type(const std::string& channel) const;
  std::vector<std::string> Channels() const;

  /// Ends the run and gives its messages, of what was kept. A second call gives the same.
  std::shared_ptr<const RunStore> Finish();

  int64_t tick();  ///< ticks done
  double time();   ///< s, of the scenario, of the last tick
  bool ended();
  bool failed();
  std::string detail();
  const RunSpec& spec() const { return spec_; }
  /// What is odd about the scenario, and each joint whose commanded impedance the bridge has cut.
  std::vector<std::string> warnings();

 private:
  class Lock;
  /// Throws ConfigError where it is refused at once.
  void Do(OperatorAct act);
  /// Throws ConfigError on the first act that was refused since the last call.
  void ThrowRefusals();
  void Replace(const SessionOptions& options, ComponentRegistry* registry);
  int FindChannel(const std::string& name) const;
  const OutputPort* Writer(int channel);
  /// Notes what the bridge has cut of the command, whoever gave it.
  void NoteCuts(const bridge_status_t& status, double time);
  /// Puts what is commanded from outside into the controller's message, which nobody has read yet.
  void Override(joint_command_t* command);

  RunSpec spec_;
  std::string scenario_;
  std::vector<std::string> warnings_;
  logging::ElementNames names_;
  std::unique_ptr<InlineRunner> runner_;
  std::vector<ForeignComponent*> foreign_;
  std::shared_ptr<const robot::RobotModel> model_;
  std::vector<std::unique_ptr<MessageLayout>> layouts_;  // by channel; nullptr: none
  std::unique_ptr<InlinePort> port_;                     // made with the first act
  int64_t next_act_ = 1;
  std::vector<double> override_;  // by joint; NaN: none
  bool overrides_ = false;
  std::optional<joint_command_t> command_;
  int command_channel_ = -1, status_channel_ = -1, drive_channel_ = -1;  // -1: there is none
  struct Cut {
    double since = 0;  // s
    logging::ImpedanceCut largest;
  };
  std::map<size_t, Cut> cuts_;  // by joint
  std::vector<bool> written_;   // by channel: a message is there
  std::vector<bool> replaced_;  // by component

  SessionOptions::Keep keep_;
  std::optional<RunDir> dir_;
  std::string log_;
  std::unique_ptr<logging::InlineRecorder> recorder_;
  std::unique_ptr<logging::InlineRecord> record_;
  std::shared_ptr<RunStore> store_;
  bool finished_ = false;

  std::mutex mutex_;
  std::atomic<std::thread::id> holder_{};
};

}  // namespace poise::python
