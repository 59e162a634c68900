// What the files of events add to: by concern, in the order of events.cc.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "logging/events/events.h"
#include "logging/metrics/contact_history.h"

namespace poise::logging {

/// Keeps the events that are found, in any order.
class EventList {
 public:
  explicit EventList(const RunRecord& run) : run_(run) {}

  void Add(int64_t tick, std::string name, std::string detail) {
    events_.push_back({{run_.time(tick), std::move(name), std::move(detail)}, false});
  }
  /// The end of something; of one tick's events it comes first.
  void AddEndOf(const Interval& interval, std::string name, const std::string& what) {
    if (!interval.end) return;
    std::string detail =
        fmt::format("{}, after {:.3f} s", what, run_.duration(*interval.end - interval.begin));
    events_.push_back({{run_.time(*interval.end), std::move(name), std::move(detail)}, true});
  }
  /// `begin` and `end` name the events; `what` tells of the first tick, and the end adds how long
  /// it was.
  void AddIntervals(const std::vector<Interval>& intervals, const char* begin, const char* end,
                    const std::function<std::string(int64_t tick)>& what) {
    for (const Interval& interval : intervals) {
      const std::string text = what(interval.begin);
      Add(interval.begin, begin, text);
      AddEndOf(interval, end, text);
    }
  }
  std::vector<Event> Sorted() && {
    std::ranges::stable_sort(
        events_, {}, [](const Entry& entry) { return std::pair(entry.event.time, !entry.ends); });
    std::vector<Event> sorted;
    for (Entry& entry : events_) sorted.push_back(std::move(entry.event));
    return sorted;
  }

 private:
  struct Entry {
    Event event;
    bool ends;
  };
  const RunRecord& run_;
  std::vector<Entry> events_;
};

/// Rounded to what one decimal shows, and never "-0.0".
inline double Tenths(double value) {
  const double tenths = std::round(10 * value) / 10;
  return tenths == 0 ? 0 : tenths;
}

/// Tells of phases, support, unloading and loading, waiting.
void AddPlanEvents(const RunRecord& run, EventList* events);
/// Tells of searches, touch-downs, contacts lost.
void AddFootEvents(const RunRecord& run, bool ended, EventList* events);
/// Tells of faults of the feet's sensors, and what calibration found.
void AddSensorEvents(const RunRecord& run, EventList* events);
/// Tells of balancing, the centre of pressure, the capture point, steps that catch or walk.
void AddBalanceEvents(const RunRecord& run, EventList* events);
/// Tells of the limits of the bridge that joints met.
void AddMotorEvents(const RunRecord& run, EventList* events);
/// Tells of loaded soles whose true centre of pressure is at their edge: they tip, whatever was
/// computed.
void AddSoleEvents(const RunRecord& run, EventList* events);
/// Tells of the bridge's states.
void AddBridgeEvents(const RunRecord& run, EventList* events);

}  // namespace poise::logging
