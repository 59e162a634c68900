// A run of hand-made messages, one a tick and channel, which a test changes before it is read.
#pragma once

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "logging/run_record.h"
#include "operate/message_traits.hpp"
#include "poise/message_traits.hpp"
#include "tests/logging/log_test_support.h"

namespace poise::logging {

/// kTicks ticks at rest on both feet, 210 mm apart, unloaded.
class RecordTest : public testing::Test {
 protected:
  static constexpr int64_t kTicks = 100;
  static constexpr double kPeriod = 0.002;  // s

  RecordTest();

  /// Through a log, so that the reading is part of the test.
  RunRecord Read();
  /// Returns a metric's value from `from` seconds on; it is a failure when it has none.
  double Measure(const std::string& name, double from = 0);
  /// True when the metric has no value.
  bool Unanswered(const std::string& name);

  template <class T>
  static void Add(const char* channel, const T& message, std::vector<RawEvent>* events) {
    events->push_back({channel, message.utime, Encode(message)});
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.path("run.lcm");
  RunSpec spec_ = MakeTestSpec();
  std::set<std::string> without_;                  ///< channels that have no messages
  std::set<std::pair<std::string, size_t>> lost_;  ///< single messages, by channel and tick
  bool with_drives_ = false;                       ///< the log has DRIVE_COMMAND
  std::vector<robot_sensors_t> sensors_;
  std::vector<robot_state_t> state_;
  std::vector<support_plan_t> plan_;
  std::vector<planner_status_t> planner_;
  std::vector<task_torque_t> task_;
  std::vector<balance_torque_t> balance_;
  std::vector<joint_command_t> command_;
  std::vector<drive_command_t> drive_;
  std::vector<bridge_status_t> bridge_;
  std::vector<external_push_t> push_;
  std::vector<ground_truth_t> truth_;
  std::vector<operate::answer_t> answers_;  // none
};

}  // namespace poise::logging
