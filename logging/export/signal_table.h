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

/// One scalar field over the messages of its channel.
struct SignalColumn {
  std::string field;  ///< path in the message, e.g. "foot_wrench[1].force[2]"
  bool integer = false;
  std::vector<double>
      values;  ///< in the unit of the field's .lcm comment; NaN: none is told (WithoutUntold)
};

/// One channel: `ticks` ascending, each column of the same length.
struct ChannelColumns {
  std::string name;
  std::string type;  ///< LCM type, e.g. "robot_state_t"
  std::vector<int64_t> ticks;
  std::vector<SignalColumn> columns;
};

/// One scalar field by row.
struct RowColumn {
  std::string field;
  bool integer = false;
  std::vector<double> values;  ///< of a row's first message that tells one; NaN: none does
  /// Least and largest of all the row's messages; empty where each row is a tick.
  std::vector<double> least;
  std::vector<double> largest;
};

struct ChannelRows {
  std::string name;
  std::string type;
  int64_t messages = 0;
  std::vector<RowColumn> columns;
};

/// The channels of ReadColumns by row: memory grows with the rows and not with the log. Throws
/// LogError.
std::vector<ChannelRows> ReadRows(const std::string& path, const RunRecord& run,
                                  const PageRows& rows);

/// Columns of the log's channels, those of the graph first, then HEALTH_* and DERIVED, with those
/// of its signals that the run tells; a channel without messages is left out. Counts, run_id, tick
/// and texts are no columns. Of two messages of a tick the first is taken; an external channel's
/// messages stand at the tick in which they were recorded. `run` is the record of the same log.
/// Throws LogError.
std::vector<ChannelColumns> ReadColumns(const std::string& path, const RunRecord& run);

}  // namespace poise::logging
