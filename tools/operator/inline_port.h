// Acts on a run inside this process, repeatable.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "components/framework/runners/inline_runner.h"
#include "tools/operator/act_port.h"

namespace poise {

/// Injects acts between ticks, each for the very next one. Those of a run that may go back are
/// kept, so that a fresh runner of the same spec that gets them again at the same ticks gives the
/// same bits.
class InlinePort final : public ActPort {
 public:
  /// What is asked of the run itself: pause, go, tick, speed, back, restart. Empty: it is done;
  /// else why not.
  using Pace = std::function<std::string(const OperatorAct& act)>;

  /// `spec` with the channels' counts. Without `pace` the run only goes on. Throws ConfigError.
  explicit InlinePort(const RunSpec& spec, Pace pace = nullptr);

  /// The runner that acts are for from now on: answers come by Hear.
  void SetRunner(InlineRunner* runner) { runner_ = runner; }
  /// It wants the messages of this channel: answers, and what the bridge does.
  bool Hears(int channel) const { return channel == answer_channel_ || channel == status_channel_; }
  void Hear(int channel, std::span<const uint8_t> data);
  /// Injects, before a tick of a fresh runner, what was injected before that tick.
  void Repeat(int64_t tick);
  /// Forgets what was injected before `tick` or a later one.
  void Forget(int64_t tick);

  void Update(int timeout_ms) override;
  std::string WhyNot(OperatorAct::Kind kind) const override;
  std::map<std::string, double> InForce() const override;
  int64_t tick() const override { return runner_->ticks_completed(); }

 private:
  struct Injected {
    int64_t tick;  // ticks done before it
    int channel;
    std::vector<uint8_t> bytes;
  };
  bool Paces(OperatorAct::Kind kind) const;
  void Start(Waiting* waiting) override;
  bool Send(int channel, const std::vector<uint8_t>& bytes) override;
  using ActPort::Send;

  const Pace pace_;
  InlineRunner* runner_ = nullptr;
  size_t next_repeat_ = 0;
  std::vector<Injected> done_;  // ticks ascending
};

}  // namespace poise
