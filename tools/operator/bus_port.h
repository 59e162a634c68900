// Acts on a run that goes on as processes.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "components/framework/bus/run_socket.h"
#include "tools/operator/act_port.h"

namespace poise {

/// Sends acts, repeats what gets no answer within 20 ms, moves to a later tick what came late, and
/// answers after 3 s what nobody has.
class BusPort final : public ActPort {
 public:
  /// Only listens until Join or Do. Throws ConfigError: the run goes on inside one process;
  /// BusError.
  explicit BusPort(RunSpec spec);

  /// Sends as one of the run's own from here on. Do calls it, but for a stop, which is taken from
  /// everybody. Throws BusError.
  void Join();
  /// Asks for the settings' values now, and again whenever somebody has changed one. Throws
  /// ConfigError or BusError.
  void FollowSettings();
  /// Does them all and waits until each is answered.
  std::vector<OperatorAct> Wait(std::vector<OperatorAct> acts);

  void Do(OperatorAct act) override;
  void Update(int timeout_ms) override;
  std::map<std::string, double> InForce() const override { return in_force_; }
  int64_t tick() const override { return tick_; }

 private:
  void Start(Waiting* waiting) override;
  bool Again(Waiting* waiting) override;
  bool Note(const OperatorAct& act) override;
  bool Send(int channel, const std::vector<uint8_t>& bytes) override;
  using ActPort::Send;
  void Carry(Waiting* waiting, int64_t now);
  void Hear();
  /// Why nobody has answered.
  std::string Silence(const Waiting& waiting) const;

  std::optional<RunSocket> socket_;            // none until it has joined the run
  std::map<int, RunSender> senders_;           // by channel
  std::unique_ptr<BusSender> stranger_;        // of stops, until then
  std::unique_ptr<BusReceiver> answers_line_;  // nullptr: the graph has no such channel
  std::unique_ptr<BusReceiver> ticks_;
  int tick_channel_ = -1;
  int64_t tick_offset_ = 0;  // bytes
  int64_t tick_ = -1, first_tick_ = -1, first_time_ = 0, tick_time_ = 0;
  bool follows_ = false;
  std::optional<int64_t> ask_at_;           // ns: when settings are asked for next
  std::map<std::string, double> in_force_;  // by field, as its component has told
  std::map<std::string, double> heard_;     // likewise, once: while it ramps no two are alike
};

}  // namespace poise
