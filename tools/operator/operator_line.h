// A person's line to a run that goes on: pushes, settings, steps, and what became of them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "components/framework/bus/run_socket.h"
#include "components/framework/graph.pb.h"
#include "operate/message_traits.hpp"
#include "tools/operator/act_targets.h"

namespace poise {

/// A setting that may be changed while a run goes on.
struct LiveField {
  int component = -1;  ///< index in the graph
  std::string path;    ///< "task_controller.com.kp"
  std::string unit, meaning;
  double least = 0, most = 0;
  double ramp = 0;   ///< s that a change takes
  double value = 0;  ///< of the configuration; Ask() gives the present one
};

/// All live fields of a run's components, with their values at its start. Throws ConfigError.
std::vector<LiveField> LiveFields(const RunSpec& spec);

/// What became of an act.
struct ActOutcome {
  bool done = false;
  int64_t tick = 0;    ///< in which it took effect
  double time = 0;     ///< s of the scenario, of that tick
  double value = 0;    ///< of a setting
  int8_t verdict = 0;  ///< operate::answer_t::VERDICT_*; 0: nobody has answered in time
  std::string text;    ///< why it was refused, for a person
};

/// Sends acts, repeats what gets no answer, and moves to a later tick what came late. Not
/// thread-safe. Acts: each returns a number for Outcome; throws ConfigError on what no receiver
/// could take (unknown body, field, foot; not finite; a graph without operator's channels).
class OperatorLine {
 public:
  /// To a run that goes on as processes. Throws ConfigError or BusError.
  explicit OperatorLine(RunSpec spec);

  /// N, world axes, at `point` (m, body frame) for `duration` s; below 0: until the next push of
  /// this body. Takes the place of its last push; zero ends it. `body` empty: the root. Throws
  /// beyond ten times the robot's weight.
  int64_t Push(const std::string& body, const Eigen::Vector3d& force, const Eigen::Vector3d& point,
               double duration);
  /// `path` as LiveField's.
  int64_t Set(const std::string& path, double value);
  /// Asks for the present value (ActOutcome::value).
  int64_t Ask(const std::string& path);
  /// "left", "right" or empty: any.
  int64_t Step(const std::string& foot);
  /// m/s ahead, m/s to the left, rad/s to the left, until Stand.
  int64_t Walk(double ahead, double left, double turn);
  int64_t Stand();
  int64_t NextPhase();

  /// Takes what has come and sends again what waits; waits up to `timeout_ms` for answers. Call it
  /// at least every 20 ms while an act waits.
  void Update(int timeout_ms);
  /// None while it waits; after 3 s without an answer that it failed. An outcome is kept until it
  /// is taken.
  std::optional<ActOutcome> TakeOutcome(int64_t id);
  /// Update until the outcome is there.
  ActOutcome Wait(int64_t id);
  /// To poll beside others: answers, ticks.
  std::array<int, 2> fds() const;

  const RunSpec& spec() const { return spec_; }
  const RunSocket& socket() const { return socket_; }
  const std::vector<LiveField>& fields() const { return fields_; }
  int64_t tick() const { return tick_; }  ///< newest heard; -1: none yet

 private:
  struct Pending {
    operate::act_t act{};
    int64_t since = 0, sent = 0;  // ns; 0: not yet
    int tries = 0;
    std::optional<ActOutcome> outcome;
  };
  int64_t Add(operate::act_t act);
  int64_t Plan(operate::act_t act);
  const LiveField& Field(const std::string& path) const;
  void Send(Pending* pending, int64_t now);
  void Hear();

  RunSpec spec_;
  RunSocket socket_;
  std::vector<LiveField> fields_;
  ActTargets targets_;
  std::string channel_;
  std::unique_ptr<RunSender> sender_;
  std::unique_ptr<BusReceiver> answers_, ticks_;
  std::string tick_channel_;
  int64_t tick_offset_ = 0;  // bytes
  int64_t tick_ = -1, first_tick_ = -1, first_time_ = 0, tick_time_ = 0;
  int64_t next_id_ = 0;
  std::map<int64_t, Pending> pending_;
};

}  // namespace poise
