// A log's events with what is known of their types.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "components/framework/graph.pb.h"
#include "logging/element_names.h"
#include "logging/log_reader.h"
#include "logging/run_info.h"
#include "poise/message_traits.hpp"

namespace poise::logging {

/// Types by channel: those of the run's graph, others by their fingerprints.
class LogMessages {
 public:
  enum class Run { kNeeded, kIfKnown };
  /// Throws LogError: no file, or with kNeeded a run that FindRunInfo cannot tell.
  explicit LogMessages(const std::string& path, Run run = Run::kNeeded);

  /// False: spec() and info() are empty.
  bool run_known() const { return run_known_; }
  const RunSpec& spec() const { return run_.spec; }
  const run_info_t& info() const { return run_.info; }
  /// The names of the run's robot.
  const ElementNames& names() const { return names_; }
  /// A path in a message of this channel, elements by their names.
  std::string Label(std::string_view channel, std::string_view path) const;
  LogReader& reader() { return reader_; }
  const LogReader& reader() const { return reader_; }

  /// The type of the event's message; nullptr when it is not a message of its channel.
  const MessageType* TypeOf(const LogEvent& event) const;
  static int64_t Tick(const MessageType& type, const LogEvent& event);

 private:
  LogReader reader_;
  RunInfo run_;
  bool run_known_ = false;
  ElementNames names_;
  std::map<std::string, const MessageType*, std::less<>> graph_;
};

}  // namespace poise::logging
