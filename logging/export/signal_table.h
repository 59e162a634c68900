// Every scalar of every channel of a run's log as columns, whatever the graph and the messages.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "logging/export/page_rows.h"
#include "logging/run_record.h"
#include "poise/message_traits.hpp"

namespace poise::logging {

/// True when the scalar at `path` of such a message is a signal: no count, not run_id or tick, no
/// letter of an act's field. Texts are none either.
bool IsSignal(const MessageType& type, std::string_view path);

/// One scalar field, by message or by row.
struct SignalColumn {
  std::string field;  ///< path in the message, e.g. "foot_wrench[1].force[2]"
  bool integer = false;
  /// In the unit of the field's .lcm comment, of a row's first message that tells one; NaN: none
  /// does (WithoutUntold).
  std::vector<double> values;
  /// Least and largest of all messages of rows that have several ticks; else empty.
  std::vector<double> least = {}, largest = {};
};

/// One channel; its columns are of the same length.
struct ChannelColumns {
  std::string name;
  std::string type;  ///< LCM type, e.g. "robot_state_t"
  int64_t messages = 0;
  std::vector<int64_t> ticks;  ///< of the messages, ascending; empty where columns are by row
  std::vector<SignalColumn> columns;
};

/// Columns by message of the log's channels, those of the graph first, then HEALTH_* and DERIVED,
/// with those of its signals that the run tells; a channel without messages is left out. Counts,
/// run_id, tick and texts are no columns. Of two messages of a tick the first is taken; an external
/// channel's messages stand at the tick in which they were recorded. `run` is the record of the
/// same log. Throws LogError.
std::vector<ChannelColumns> ReadColumns(const std::string& path, const RunRecord& run);

/// ReadColumns by row: memory grows with the rows and not with the log.
std::vector<ChannelColumns> ReadRows(const std::string& path, const RunRecord& run,
                                     const PageRows& rows);

}  // namespace poise::logging
