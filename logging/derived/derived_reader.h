// A log's events with the signals that follow from them.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "components/framework/bus/packet_filter.h"
#include "logging/derived/derived_signals.h"
#include "logging/log_messages.h"
#include "logging/log_reader.h"

namespace poise::logging {

/// The events of a reader, and among them a message of kDerivedChannel for each tick that has any
/// of those it follows from, once the log has them all; its data live until the next call. None of
/// a run whose graph has a channel of that name or whose robot is not known.
class DerivedReader {
 public:
  /// Ticks that DERIVED may come behind the others: a log may hold a message that late.
  static constexpr size_t kMostTicks = 256;

  /// All must outlive it.
  DerivedReader(LogReader* reader, const RunSpec& spec, const robot::RobotModel& robot);
  /// Those of `messages`, read by `reader`.
  DerivedReader(LogReader* reader, const LogMessages& messages);

  bool Next(LogEvent* event);
  /// False: there are none.
  bool any() const { return derived_.has_value(); }
  bool IsDerived(std::string_view channel) const { return any() && channel == kDerivedChannel; }

 private:
  struct Lane {
    const MessageType* type;
    PacketFilter filter;
  };
  void Start(const RunSpec& spec, const robot::RobotModel& robot);

  LogReader* reader_;
  std::optional<robot::RobotModel> own_robot_;
  std::map<std::string, Lane, std::less<>> lanes_;
  std::optional<DerivedMessages> derived_;
  bool ended_ = false;
};

}  // namespace poise::logging
