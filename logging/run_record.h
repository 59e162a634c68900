// A run's log as typed time series.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "components/framework/graph.pb.h"
#include "components/robot/robot_model.h"
#include "lcmtypes/message_fields.h"
#include "logging/channel_ticks.h"
#include "logging/log_reader.h"
#include "logging/run_info.h"
#include "logging/tick_series.h"
#include "operate/answer_t.hpp"
#include "poise/balance_torque_t.hpp"
#include "poise/bridge_status_t.hpp"
#include "poise/drive_command_t.hpp"
#include "poise/estimator_status_t.hpp"
#include "poise/external_push_t.hpp"
#include "poise/ground_truth_t.hpp"
#include "poise/health_t.hpp"
#include "poise/joint_command_t.hpp"
#include "poise/planner_status_t.hpp"
#include "poise/robot_sensors_t.hpp"
#include "poise/robot_state_t.hpp"
#include "poise/support_plan_t.hpp"
#include "poise/task_torque_t.hpp"

namespace poise::logging {

/// A log beyond this size stays on the disk: what is asked for is read again each time. Some 40 s
/// of 12 joints, which take about 250 MB in memory.
inline constexpr uint64_t kMostInMemory = 128 << 20;  // bytes

/// All of one run. Of several channels with one type the graph's first is taken. A long run's
/// series are in files (Series::at): then one thread at a time.
struct RunRecord {
  run_info_t info;
  RunSpec spec;
  robot::RobotModel robot;
  bool paged = false;      ///< the series are in files
  int64_t num_ticks = 0;   ///< last tick of any channel + 1
  int64_t first_tick = 0;  ///< metrics look at ticks from here on

  Series<robot_sensors_t> sensors;
  Series<robot_state_t> state;
  Series<estimator_status_t> estimator;
  Series<support_plan_t> plan;
  Series<planner_status_t> planner;
  Series<task_torque_t> task;
  Series<balance_torque_t> balance;
  Series<joint_command_t> command;
  Series<drive_command_t> drive;
  Series<bridge_status_t> bridge;
  Series<external_push_t> push;
  Series<ground_truth_t> truth;
  std::map<std::string, health_t> health;  ///< by component: its last
  /// Answers to an operator's acts, as they stand in the log: whole, of this run, perhaps said
  /// twice.
  std::vector<operate::answer_t> answers;

  std::vector<ChannelCompleteness> channels;  ///< not the external ones
  int64_t damages = 0;                        ///< places where the file held no record
  int64_t refused_health = 0;  ///< unreadable, of another run, or under another component's name
  /// Simulated time over wall time; not in the log, set by who ran it.
  std::optional<double> real_time_factor;
  /// The run of the scenario's reference variant, for metrics that compare with it; nullptr when
  /// there is none. Not in the log, set by who reads both.
  std::shared_ptr<RunRecord> reference;
  /// Messages of the graph's channels that have no series above (a module's own), by channel and
  /// encoded, as they were recorded.
  std::map<std::string, Series<std::vector<uint8_t>>, std::less<>> other;

  /// The message of type T on `channel` at `tick`, of `other`; empty: there is none, or it is of
  /// another type.
  template <class T>
  std::optional<T> Other(std::string_view channel, int64_t tick) const {
    const auto found = other.find(channel);
    const std::vector<uint8_t>* const data =
        found == other.end() ? nullptr : found->second.at(tick);
    T message;
    if (data == nullptr || !DecodeChecked(*data, &message)) {
      return {};
    }
    return message;
  }

  /// s of the scenario's time, negative in the run's lead.
  double time(int64_t tick) const { return duration(tick - spec.lead_ticks()); }
  double duration(int64_t ticks) const { return static_cast<double>(ticks) * spec.tick_period(); }
  /// This run's tick at the scenario's time of another run's.
  int64_t TickOf(const RunRecord& other, int64_t tick) const {
    return tick - other.spec.lead_ticks() + spec.lead_ticks();
  }

  /// Calls visit(Series<T>*) for the series of each message type.
  template <class Visit>
  void VisitSeries(const Visit& visit) {
    visit(&sensors);
    visit(&state);
    visit(&estimator);
    visit(&plan);
    visit(&planner);
    visit(&task);
    visit(&balance);
    visit(&command);
    visit(&drive);
    visit(&bridge);
    visit(&push);
    visit(&truth);
  }
};

/// Throws LogError: no file, a run that FindRunInfo cannot tell, or whose channels do not fit its
/// robot; RobotError for its robot. `most_in_memory`: a larger log stays on the disk, which must
/// then hold the file, unchanged, as long as the record.
RunRecord ReadRun(const std::string& path, uint64_t most_in_memory = kMostInMemory);

/// A HEALTH_* message; empty: unreadable, of another run, or under another component's name.
std::optional<health_t> ReadHealth(const LogEvent& event, int64_t run_id);

}  // namespace poise::logging
