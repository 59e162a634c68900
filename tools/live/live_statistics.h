// What a run in progress does, measured from its messages: rates, sizes, ages.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "components/framework/bus/control_client.h"
#include "components/framework/graph.pb.h"
#include "poise/bridge_status_t.hpp"
#include "poise/bus_status_t.hpp"

namespace poise {

/// One moment of a run. Rates are those of the interval since the moment before; a rate or age that
/// is not known is negative.
struct LiveSnapshot {
  struct Process {
    std::string name;
    bool seen = false;
    health_t health{};      ///< valid when seen
    double tick_rate = -1;  ///< ticks/s, between its reports of health
    double age = -1;        ///< s, of its last report of health
  };
  struct ChannelRow {
    std::string name;
    std::string type;
    int64_t tick = -1;  ///< of the newest message; -1: none
    double rate = 0;    ///< messages/s
    double bytes_per_second = 0;
    int64_t bytes_per_message = 0;  ///< of the newest; 0: none
    double age = -1;                ///< s
    int64_t missed = 0;             ///< ticks that this listener did not get, since the start
  };
  std::vector<Process> processes;         ///< in the graph's order, then the recorder
  std::vector<ChannelRow> channels;       ///< in the graph's order
  std::optional<bridge_status_t> bridge;  ///< newest
  std::optional<bus_status_t> bus;        ///< newest; of a run with drives on a bus
  int64_t tick = -1;                      ///< newest of any channel
  double tick_rate = -1;                  ///< ticks/s
};

/// Times are ns of one steady clock. Not thread-safe.
class LiveStatistics {
 public:
  /// Measures from `now` on.
  LiveStatistics(const RunSpec& spec, int64_t now);

  /// `channel`: index in the graph.
  void AddMessage(int channel, int64_t tick, size_t bytes, int64_t now);
  void SetBridge(const bridge_status_t& status) { bridge_ = status; }
  void SetBus(const bus_status_t& status) { bus_ = status; }
  void SetProcess(const std::string& name, const ControlClient::Status& status);
  /// The moment `now`; the next interval begins.
  LiveSnapshot Take(int64_t now);

 private:
  struct ChannelCount {
    LiveSnapshot::ChannelRow row;  // but for rates and age
    int64_t messages = 0;          // of this interval
    int64_t bytes = 0;             // of this interval
    int64_t last_arrival = 0;
    bool external = false;
  };
  struct Progress {
    int64_t tick = -1;
    int64_t time = 0;
    /// Ticks/s from `from` to this; -1 when not known.
    double RateSince(const Progress& from) const;
  };
  struct ProcessCount {
    ControlClient::Status status;
    Progress first;  // of this interval
    double rate = -1;
  };

  const RunSpec& spec_;
  std::vector<ChannelCount> channels_;
  std::map<std::string, ProcessCount> processes_;
  std::optional<bridge_status_t> bridge_;
  std::optional<bus_status_t> bus_;
  Progress first_;
  Progress newest_;
  int64_t interval_begin_;
};

}  // namespace poise
