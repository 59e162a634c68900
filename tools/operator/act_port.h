// A person's way to a run: what an act says to its components, and what their answers say.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "components/framework/graph.pb.h"
#include "operate/message_traits.hpp"
#include "tools/operator/operator_act.h"

namespace poise {

/// A setting that may be changed while a run goes on.
struct LiveField {
  int component = -1;  ///< index in the graph
  std::string path;    ///< "task_controller.com.kp"
  std::string unit, meaning;
  double least = 0, most = 0;
  double ramp = 0;   ///< s that a change takes
  double value = 0;  ///< of the configuration; kAsk gives the present one
};

/// A joint that no leg needs, which kMove can send elsewhere.
struct MovableJoint {
  std::string name;
  double lower = 0, upper = 0;  ///< rad
};

/// All live fields of a run's components, with their values at its start. Throws ConfigError.
std::vector<LiveField> LiveFields(const RunSpec& spec);

/// Carries acts to those who decide, and tells what these have answered. Used on one thread.
class ActPort {
 public:
  explicit ActPort(RunSpec spec);
  virtual ~ActPort() = default;
  ActPort(const ActPort&) = delete;
  ActPort& operator=(const ActPort&) = delete;

  /// Passes it on; its answer comes by TakeAnswers, and it is in force only when that says so.
  /// Throws ConfigError on what no receiver could take: unknown body, field, foot or joint; not
  /// finite; a graph without operator's channels; too many that wait.
  virtual void Do(OperatorAct act);
  /// Takes what has come and sends again what waits; waits up to `timeout_ms` for answers. Call it
  /// at least every 20 ms while an act waits.
  virtual void Update(int timeout_ms) = 0;
  /// Acts that were answered since the last call.
  std::vector<OperatorAct> TakeAnswers() { return std::exchange(answers_, {}); }

  /// Empty, or why acts of this kind cannot be done here.
  virtual std::string WhyNot(OperatorAct::Kind kind) const;
  /// Values of settings in force, by path, as far as their components have told.
  virtual std::map<std::string, double> InForce() const = 0;
  virtual int64_t tick() const = 0;          ///< newest; -1: none yet
  bool stopped() const { return stopped_; }  ///< as the bridge told last
  /// The push in force, if it was done here; nullptr: none.
  const OperatorAct* push() const { return tick() < push_until_ ? &push_ : nullptr; }
  const RunSpec& spec() const { return spec_; }
  /// Throws ConfigError, where the graph takes no acts too.
  const std::vector<LiveField>& fields() const;
  double weight() const { return targets().weight; }  ///< N, the robot's. Throws RobotError.
  /// None where no controller takes acts. Throws RobotError.
  const std::vector<MovableJoint>& movable() const { return targets().movable; }

 protected:
  /// An act without an answer.
  struct Waiting {
    OperatorAct act;
    operate::act_t message{};     // its id tells one from another, whatever carries it
    int64_t since = 0, sent = 0;  // ns; 0: not yet
    int tries = 0;
    bool went = false;    // of a stop, or its reset: the network took it once
    int64_t resets = -1;  // of the bridge, before a reset
  };
  /// A new one.
  virtual void Start(Waiting* waiting) = 0;
  /// One that came late; false: it is refused.
  virtual bool Again(Waiting*) { return false; }
  /// One that was answered; false: it was the port's own, and nobody is told.
  virtual bool Note(const OperatorAct&) { return true; }
  /// False: it was not taken.
  virtual bool Send(int channel, const std::vector<uint8_t>& bytes) = 0;
  bool Send(const operate::act_t& message);
  bool SendStop(bool stop, bool reset);
  /// The kind of the act that it answers, anyone's; 0: it is no answer.
  int8_t HearAnswer(std::span<const uint8_t> data);
  void HearStatus(std::span<const uint8_t> data);
  /// Answers what waits by that id, if anything does. `reason` empty: it is accepted.
  void Answer(int64_t id, int64_t tick, std::string reason);
  /// Refuses all acts of a kind that wait.
  void Refuse(OperatorAct::Kind kind, const std::string& reason);

  const int act_channel_, answer_channel_;   // -1: there is none
  const int stop_channel_, status_channel_;  // -1: there is none
  std::vector<Waiting> waiting_;
  int64_t next_id_ = 1;
  int64_t resets_ = -1;  // as the bridge told last; -1: it has not
  bool stopped_ = false;
  int64_t push_until_ = -1;  // tick

 private:
  /// To whom acts go, and the names that they may use, as act_t counts them.
  struct Targets {
    int simulator = -1, planner = -1, tasks = -1;  // indices in the graph; -1: nobody
    std::vector<std::string> bodies, feet, joints;
    std::vector<MovableJoint> movable;
    double weight = 0;  // N
  };
  void RequireActs() const;
  const Targets& targets() const;
  const LiveField& Field(const std::string& path) const;
  /// At least 1.
  int64_t TicksOf(double duration) const;
  operate::act_t MessageOf(const OperatorAct& act) const;
  std::string Reason(const OperatorAct& act, const operate::answer_t& answer) const;

  const RunSpec spec_;
  mutable std::optional<std::vector<LiveField>> fields_;  // made when they are asked for:
  mutable std::optional<Targets> targets_;                // a stop waits for neither
  std::vector<OperatorAct> answers_;
  OperatorAct push_;
};

}  // namespace poise
