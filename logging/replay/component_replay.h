// Feeds a log's messages to a component again and compares what it gives with what was logged.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "components/framework/component_registry.h"
#include "components/framework/graph.pb.h"
#include "components/framework/runners/run_position.h"
#include "logging/channel_ticks.h"
#include "logging/log_messages.h"
#include "logging/replay/external_messages.h"
#include "logging/tick_series.h"

namespace poise::logging {

/// Differences of one field over all ticks, its array elements together.
struct FieldDifference {
  std::string field;  ///< without indexes: "foot_wrench.force"
  int64_t first_tick = 0;
  int64_t last_tick = 0;
  int64_t ticks = 0;         ///< that differ
  std::string largest_path;  ///< element with the largest difference: "foot_wrench[1].force[2]"
  int64_t largest_tick = 0;
  double largest = 0;  ///< in the field's unit; infinite: one of them is not finite
  std::string logged;  ///< the values there
  std::string replayed;
};

struct ReplayedChannel {
  std::string channel;
  int64_t ticks = 0;      ///< compared; 0: the log has no such channel
  int64_t differing = 0;  ///< ticks
  int64_t first_differing_tick = -1;
  std::string first_field;              ///< that differs there, "torque[3]"
  std::vector<FieldDifference> fields;  ///< those that differ, in the message's order
};

struct ReplayedComponent {
  std::string name;
  int64_t ticks = 0;
  double wall_time = 0;  ///< s, of the component's stages with their messages
  std::vector<ReplayedChannel> outputs;
  /// External messages it read, and those among them of which the log does not tell in which tick:
  /// they were shown from the tick after those logged before them.
  int64_t external_messages = 0;
  int64_t unplaced_messages = 0;
  /// These count what was late in real time: ticks that a follower did not run, as the log lacks
  /// what it sent or read in them, and inputs that the clock's owner did without, by the log's
  /// order.
  int64_t skipped_ticks = 0, late_inputs = 0;
  bool equal() const;
};

/// Is given the names of a component's stages before they run, and gives what is then kept at the
/// stage that runs, by its index.
using OnStages = std::function<RunPosition*(const std::vector<std::string>& stages)>;

/// Replayed messages with other bits than the logged, by channel and tick.
using ChangedMessages = std::map<std::pair<std::string, int64_t>, std::vector<uint8_t>>;

/// A log's messages by channel and tick. Wall time plays no part in it.
class LogReplay {
 public:
  /// Throws LogError.
  explicit LogReplay(const std::string& path);

  /// The run as the log tells it, configurations included.
  const RunSpec& spec() const { return messages_.spec(); }
  const run_info_t& info() const { return messages_.info(); }

  /// Runs component `index` of `spec` (the log's, or one with other configurations) from tick 0 to
  /// its last logged output. Of a run in real time followers run in the ticks that the log has
  /// their messages of, and the clock's owner in all, with the messages that stand in the log
  /// before its own; else it throws LogError naming channels and ticks that the log lacks. Throws
  /// ConfigError or GraphError from the component. What differs is added to `changed`, unless that
  /// is nullptr. `on_stages` may be empty.
  ReplayedComponent Replay(const RunSpec& spec, int index, const ComponentRegistry& registry,
                           ChangedMessages* changed = nullptr,
                           const OnStages& on_stages = {}) const;

  /// Writes the log as `to`, with those of `changed` in the place of its own, and `info`. Throws
  /// LogError.
  void Write(const std::string& to, const run_info_t& info, const ChangedMessages& changed) const;

 private:
  struct Lane {
    ChannelTicks ticks;
    const MessageType* type;
    Series<std::span<const uint8_t>> by_tick;  // into the reader's file
    Series<int64_t> place;                     // among all the log's messages
  };
  friend class ReplayedStages;

  std::string path_;
  LogMessages messages_;
  std::vector<Lane> lanes_;                             // by channel of the graph
  std::vector<std::vector<ExternalMessage>> external_;  // by channel of the graph
};

}  // namespace poise::logging
