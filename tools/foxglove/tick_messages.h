// One tick's messages that a picture is made of.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>

#include "components/framework/graph.pb.h"
#include "lcmtypes/message_fields.h"
#include "poise/balance_torque_t.hpp"
#include "poise/external_push_t.hpp"
#include "poise/ground_truth_t.hpp"
#include "poise/joint_command_t.hpp"
#include "poise/planner_status_t.hpp"
#include "poise/robot_sensors_t.hpp"
#include "poise/robot_state_t.hpp"
#include "poise/support_plan_t.hpp"

namespace poise {

struct TickMessages {
  int64_t utime = 0;  ///< us, the same of all
  std::optional<robot_sensors_t> sensors;
  std::optional<robot_state_t> state;
  std::optional<support_plan_t> plan;
  std::optional<planner_status_t> planner;
  std::optional<balance_torque_t> balance;
  std::optional<joint_command_t> command;
  std::optional<external_push_t> push;
  std::optional<ground_truth_t> truth;

  size_t num_parts() const {
    return size_t{0} + sensors.has_value() + state.has_value() + plan.has_value() +
           planner.has_value() + balance.has_value() + command.has_value() + push.has_value() +
           truth.has_value();
  }
};

/// Gathers the messages of every `every`-th tick, from several channels that need not be in step.
class TickGatherer {
 public:
  /// The graph's first of several channels with one type is taken.
  TickGatherer(const RunSpec& spec, int64_t every);

  /// Passes over what is not wanted. The message must be well formed and of this run.
  void Add(std::string_view channel, const MessageType& type, std::span<const uint8_t> data);
  /// The oldest tick that no message is expected for any more, or with `end` that has any. Expected
  /// is what has come in any tick; who is late by some ticks is waited for.
  std::optional<TickMessages> Take(bool end);

 private:
  int64_t every_;
  int64_t newest_ = -1;
  int64_t taken_ = -1;  // the last tick that was
  std::map<std::string, std::string, std::less<>> channel_of_type_;
  std::set<std::string, std::less<>> parts_;  // types of which any came
  std::map<int64_t, TickMessages> ticks_;
};

}  // namespace poise
