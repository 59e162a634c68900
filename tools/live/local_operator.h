// The acts of a page on a run inside this process, repeatable.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "components/framework/runners/inline_runner.h"
#include "tools/live/operator_sink.h"
#include "tools/operator/act_targets.h"
#include "tools/operator/operator_line.h"

namespace poise {

/// Injects acts between ticks, each for the very next one, and keeps them, so that a fresh runner
/// of the same spec that gets them again at the same ticks gives the same bits.
class LocalOperator : public OperatorSink {
 public:
  /// What the page asks of the run itself: pause, go, tick, speed, back. Empty: it is done; else
  /// why not.
  using Pace = std::function<std::string(const OperatorAct& act)>;

  /// `spec` with the channels' counts. Throws ConfigError or RobotError.
  LocalOperator(const RunSpec& spec, Pace pace);

  /// The runner that acts are for from now on: answers come by Hear.
  void SetRunner(InlineRunner* runner) { runner_ = runner; }
  /// It wants the messages of this channel: answers, and what the bridge does.
  bool Hears(int channel) const { return channel == answer_channel_ || channel == status_channel_; }
  void Hear(int channel, std::span<const uint8_t> data);
  /// Before a tick of a fresh runner: injects what was injected before that tick.
  void Repeat(int64_t tick);
  /// Forgets what was injected before `tick` or a later one.
  void Forget(int64_t tick);
  int64_t repeatable() const { return static_cast<int64_t>(done_.size()); }

  void Do(const OperatorAct& act) override;
  std::vector<Answer> TakeAnswers() override;
  nlohmann::ordered_json Standing() const override;

 private:
  struct Injected {
    int64_t tick;  // ticks done before it
    std::string channel;
    std::vector<uint8_t> bytes;
  };
  template <class Message>
  bool Inject(const std::string& channel, const Message& message);
  /// Throws ConfigError with what is wrong.
  void Fill(const OperatorAct& act, operate::act_t* message) const;
  void Answered(const OperatorAct& act, int64_t tick, std::string reason);
  void AnswerStops(int64_t tick, const std::string& reason);
  void HearStatus(std::span<const uint8_t> data);

  RunSpec spec_;
  Pace pace_;
  std::vector<LiveField> fields_;
  ActTargets targets_;
  int answer_channel_ = -1, status_channel_ = -1;
  std::string act_channel_, stop_channel_;
  double push_limit_;  // N
  InlineRunner* runner_ = nullptr;
  int64_t next_id_ = 1;
  size_t next_repeat_ = 0;
  std::vector<Injected> done_;  // ticks ascending
  std::map<int64_t, OperatorAct> waiting_;
  std::vector<OperatorAct> stops_;  // sent, which the bridge has not told of
  bool stopped_ = false;            // as the bridge told last
  OperatorAct push_;
  int64_t push_until_ = -1;  // tick
  std::vector<Answer> answers_;
};

}  // namespace poise
