// The acts of a page as messages to a run of processes.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "components/framework/bus/run_socket.h"
#include "poise/bridge_status_t.hpp"
#include "tools/live/operator_sink.h"
#include "tools/operator/operator_line.h"
#include "tools/run/live_run.h"

namespace poise {

/// N: what a page may push with at most, half of the robot's weight: more than any robot here
/// stands, and no slip of a hand tears one apart.
double PagePushLimit(const RunSpec& spec);
/// Keys of Standing that all sinks have: settings with the values in force by field, push and walk.
nlohmann::ordered_json StandingOf(const std::vector<LiveField>& fields,
                                  const std::map<std::string, double>& in_force, double push_limit);
/// Empty, or why an act is beyond what a page may ask for.
std::string BeyondPage(const OperatorAct& act, double push_limit);

/// Sends acts on the run's external channels, and knows their answers from what it hears.
class BusOperator : public OperatorSink {
 public:
  /// Throws ConfigError when the run's graph has no channel that an operator writes; BusError.
  explicit BusOperator(const RunSpec& spec);

  /// Takes everything that LiveRun hands out.
  void Hear(const LiveMessage& message);
  /// Takes answers, and sends again what nobody has answered. To be called every few ms.
  void Update();

  void Do(const OperatorAct& act) override;
  std::vector<Answer> TakeAnswers() override;
  nlohmann::ordered_json Standing() const override;

 private:
  using Clock = std::chrono::steady_clock;
  /// A stop, or a reset, that the bridge has not confirmed.
  struct Pending {
    OperatorAct act;
    Clock::time_point start;
    int64_t resets = 0;  ///< of the bridge before
  };
  int64_t Pass(const OperatorAct& act);
  void Ask(const std::string& field);
  void Heard(const std::string& field, double value);
  void UpdateStop();
  void SendStop(bool stop, bool reset);
  void Answered(const OperatorAct& act, int64_t tick, std::string reason);

  OperatorLine line_;
  int stop_channel_ = -1, status_channel_ = -1, answer_channel_ = -1;
  std::unique_ptr<RunSender> stop_sender_;
  std::optional<bridge_status_t> status_;
  std::optional<Pending> pending_;
  Clock::time_point sent_{};
  double push_limit_;                       // N
  std::map<int64_t, OperatorAct> waiting_;  // by the line's number
  std::map<int64_t, std::string> asked_;    // field, likewise
  std::map<std::string, double> in_force_;  // by field, as its component has told
  OperatorAct push_;                        // the last that was accepted
  int64_t push_until_ = -1;                 // tick
  std::map<std::string, double> heard_;     // by field, once; twice is no ramp
  std::optional<Clock::time_point> ask_at_;
  std::vector<Answer> answers_;
};

}  // namespace poise
