// A log's events with what is known of their types.
#pragma once

#include <map>
#include <string>

#include "components/framework/graph.pb.h"
#include "logging/log_reader.h"
#include "poise/message_traits.hpp"
#include "poise/run_info_t.hpp"

namespace poise::logging {

/// Types by channel: those of the graph as RUN_INFO names them, others by their fingerprints.
class LogMessages {
 public:
  /// Throws LogError: no file, no RUN_INFO or one that cannot be.
  explicit LogMessages(const std::string& path);

  const RunSpec& spec() const { return spec_; }
  const run_info_t& info() const { return info_; }
  LogReader& reader() { return reader_; }

  /// The type of the event's message; nullptr when it is not a message of its channel.
  const MessageType* TypeOf(const LogEvent& event) const;
  static int64_t Tick(const MessageType& type, const LogEvent& event);

 private:
  LogReader reader_;
  RunSpec spec_;
  run_info_t info_;
  std::map<std::string, const MessageType*, std::less<>> graph_;
};

}  // namespace poise::logging
