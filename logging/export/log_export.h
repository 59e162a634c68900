// A run's log in formats that other tools read: CSV and MCAP. Without RUN_INFO and the run's folder
// (FindRunInfo) types are told by the messages' fingerprints.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "logging/export/mcap_writer.h"
#include "logging/log_messages.h"

namespace poise::logging {

struct ExportedChannel {
  std::string channel;
  std::string type;
  int64_t messages = 0;  ///< written
  int64_t refused = 0;   ///< not of the channel's type, or of other counts than the first: left out
};

/// FOLDER/CHANNEL.csv for every channel that has messages, RUN_INFO aside: a row a message, in the
/// log's order; columns time (s), tick and the message's fields, "torque[right_knee_pitch]",
/// "foot_wrench[left].force[2]" (by index where the robot is not known), numbers with all their
/// digits. FOLDER/columns.json: {channel: {column: unit}}. Makes the folder; no other CSV file may
/// stand there. Throws LogError.
std::vector<ExportedChannel> ExportCsv(const std::string& log, const std::string& folder);

/// One wide file: a row a tick, columns time (s), tick and "CHANNEL.field" of the graph's channels,
/// external ones aside, or where the graph is not known of the first 64 channels without texts;
/// empty where a channel lacks the tick. FILE with its ending replaced by .columns.json: {column:
/// unit}. Throws LogError.
std::vector<ExportedChannel> ExportMergedCsv(const std::string& log, const std::string& file);

/// Further topics of an MCAP file, made of the log's messages.
class McapTopics {
 public:
  virtual ~McapTopics() = default;
  /// Called before the first message.
  virtual void Begin(McapWriter* writer) = 0;
  /// Called after each message. `type` is the event's, well formed.
  virtual void Add(const MessageType& type, const LogEvent& event, McapWriter* writer) = 0;
  /// Called after the last message.
  virtual void End(McapWriter* writer) = 0;
};

/// An MCAP file with every message as Protobuf (ProtobufMessages), joints and feet by their names,
/// a topic a channel, in the log's order; metadata "units": {type.field: unit}; times in ns of the
/// run; and the topics of `more`, if not null. Channels whose names are not printable UTF-8 are
/// refused. Throws LogError, also for more channels than MCAP can hold.
std::vector<ExportedChannel> ExportMcap(const std::string& log, const std::string& file,
                                        McapTopics* more = nullptr);

}  // namespace poise::logging
