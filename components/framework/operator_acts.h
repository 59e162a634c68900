// An operator's acts: how they reach a component in the tick that they name, and live settings.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "components/framework/component.h"
#include "components/framework/ports.h"
#include "operate/message_traits.hpp"

namespace poise {

/// Type of an input that a graph may leave unconnected.
inline constexpr std::string_view kActType = "operate.act_t";
inline constexpr std::string_view kAnswerType = "operate.answer_t";

/// A number of the configuration that may be set while the component runs.
struct LiveSetting {
  std::string field;   ///< path in the component's configuration, "com.kp"
  double* value;       ///< in the unit of the field's comment
  double least, most;  ///< range
  double ramp;         ///< s in which a change is gone through, linearly; 0: at once
  double from = 0, to = 0;
  int64_t begin = 0;  ///< tick of the change
  int64_t ticks = 0;  ///< that the change takes; 0: none is under way
};

/// All live settings of a component, declared in Configure. A change never makes a step that its
/// ramp does not allow. Only Add allocates.
class LiveSettings {
 public:
  explicit LiveSettings(double tick_period = 0) : period_(tick_period) {}
  /// `value` outlives this and holds the present value. Throws ConfigError: the field's name is too
  /// long for act_t.
  void Add(std::string field, double* value, double least, double most, double ramp);
  std::span<const LiveSetting> all() const { return settings_; }
  const LiveSetting* Find(const operate::act_t& act) const;
  /// VERDICT_*; from `tick` on the value goes to the act's.
  int8_t Set(const operate::act_t& act, int64_t tick);
  /// The values of `tick`. True when one has changed.
  bool Advance(int64_t tick);
  void Archive(StateArchive* archive);

 private:
  double period_;
  std::vector<LiveSetting> settings_;
};

/// The input of a component that an operator acts on: keeps each act until its tick and answers it.
/// Nothing allocates after construction.
class ActInput final : public InputPort {
 public:
  ActInput();

  /// The component's side, once a tick in its stage: the next act of this tick, other than those of
  /// settings(); nullptr: none.
  const operate::act_t* Next(const Tick& tick);
  /// Says what became of the act that Next gave; without this call it is DONE.
  void Answer(int8_t verdict) { verdict_ = verdict; }
  /// Next of a component that knows settings alone: refuses all else, and goes on with the values.
  void TakeSettings(const Tick& tick);
  LiveSettings& settings() { return settings_; }
  const LiveSettings& settings() const { return settings_; }
  void Archive(StateArchive* archive) { settings_.Archive(archive); }

  /// The runner's side. `component`: the reader's index in the graph.
  void SetAddress(int component) { component_ = component; }
  /// A decoded act of this run, from anyone.
  void Offer(const operate::act_t& act);
  /// A replay's: takes effect in `tick`.
  void Place(const operate::act_t& act, int64_t tick);
  /// An answer that nobody has taken; false: none.
  bool TakeAnswer(operate::answer_t* answer);

  const char* type_name() const override;
  int64_t fingerprint() const override;
  std::span<const char* const> count_names() const override { return {}; }
  void* NewMessage() const override { return new operate::act_t(); }
  void DeleteMessage(void* message) const override { delete static_cast<operate::act_t*>(message); }
  void CopyMessage(const void* from, void* to) const override {
    *static_cast<operate::act_t*>(to) = *static_cast<const operate::act_t*>(from);
  }
  int encoded_size() const override;
  bool Decode(const uint8_t* data, int size, void* message) const override;
  void Bind(const void*) override {}

 private:
  struct Waiting {
    operate::act_t act;
    int64_t tick;
  };
  struct Said {
    operate::answer_t answer{};  // kind 0: none
    bool untaken = false;
  };
  void Say(const operate::act_t& act, int8_t verdict, double value = 0);

  LiveSettings settings_;
  int component_ = -1;
  std::vector<Waiting> waiting_;  // by tick, then id
  operate::act_t current_{};
  bool open_ = false;  // current_ has no answer yet
  int8_t verdict_ = 0;
  Tick now_;
  int64_t done_ = -1;       // last tick that the component has asked for
  std::vector<Said> said_;  // the oldest is overwritten
  size_t next_said_ = 0;
};

/// Those of the component with these ports; none where no operator acts on it.
std::span<const LiveSetting> LiveSettingsOf(const Wiring& wiring);

}  // namespace poise
