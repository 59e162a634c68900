// The last ticks of a run in progress, as numbers for its page.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "logging/derived/derived_signals.h"
#include "tools/run/live_run.h"

namespace poise {

/// Ticks of `seconds`, 1 at least.
int64_t TicksOf(double seconds, double period);

/// Every scalar of every channel of a run's graph by tick, and what follows from them (DERIVED):
/// the signals of docs/reference/report_format.md. A tick is taken when all channels have it, or
/// when the run is kMaxLead ticks beyond it and what lacks is lost; its numbers are then NaN. The
/// first one held is whole. Memory does not grow with the run.
class TickRing {
 public:
  struct Signal {
    std::string field;
    bool integer = false;
  };
  struct Lane {
    std::string name;
    const MessageType* type = nullptr;
    bool external = false;
    std::vector<Signal> signals;
  };

  /// Keeps `capacity` >= 1 ticks. `spec` as LiveRun has checked it; without a robot among its
  /// resources nothing is derived.
  TickRing(const RunSpec& spec, int64_t capacity);

  /// In the graph's order, then DERIVED.
  const std::vector<Lane>& lanes() const { return lanes_; }
  int64_t capacity() const { return capacity_; }
  /// Channels and their signals, without values:
  /// docs/reference/report_format.md#a-run-in-progress.
  nlohmann::ordered_json ChannelsJson() const;

  /// A message of LiveRun; HEALTH_* is passed over. One of an external channel stands at the newest
  /// tick that is not taken.
  void Add(const LiveMessage& message);
  /// Takes the last ticks as they are, at the run's end.
  void Finish();

  /// Ticks held: [first_tick, end_tick).
  int64_t first_tick() const { return first_; }
  int64_t end_tick() const { return end_; }
  /// Messages that did not come, of the ticks taken.
  int64_t lost() const { return lost_; }

  /// Bytes of a tick in a batch.
  size_t tick_size() const { return integers_ * sizeof(double) + reals_ * sizeof(float); }
  /// The ticks [from, to), which must be held, as a batch of docs/reference/report_format.md that
  /// says that it was made at `time`, s.
  std::string Encode(int64_t from, int64_t to, double time) const;

 private:
  /// Where a scalar of a message goes, in the order in which it is visited.
  enum class Kind : uint8_t { kNone, kInteger, kReal };
  struct Place {
    std::vector<Kind> kinds;
    size_t first_integer = 0;
    size_t first_real = 0;
  };
  class Filler;

  size_t Slot(int64_t tick) const { return static_cast<size_t>(tick % slots_); }
  void AddLane(Lane lane, const std::vector<int32_t>& counts);
  void AddDerivedLane(const RunSpec& spec);
  void Fill(size_t lane, std::span<const uint8_t> data, int64_t tick);
  void Clear(int64_t tick);
  void Start(int64_t tick);
  void TakeUntil(int64_t tick);
  void TakeComplete();
  void Take();

  std::vector<Lane> lanes_;
  std::vector<Place> places_;
  std::shared_ptr<const robot::RobotModel> robot_;
  std::unique_ptr<logging::DerivedMessages> derived_;  // null: none, and no lane
  int64_t capacity_;
  int64_t slots_;
  int64_t planned_;
  size_t integers_ = 0;  // a tick
  size_t reals_ = 0;
  int dense_ = 0;  // channels with a message each tick
  std::vector<double> integer_values_;
  std::vector<float> real_values_;
  std::vector<uint8_t> told_;       // a message, where some of it is left out
  std::vector<int> arrived_;        // by slot
  std::vector<int64_t> last_tick_;  // by channel
  int64_t start_ = 0;
  int64_t first_ = 0;
  int64_t end_ = 0;
  int64_t newest_ = -1;  // that any message had; -1: none has come
  int64_t jump_ = -1;    // a tick far ahead that one message had
  int64_t lost_ = 0;
};

}  // namespace poise
