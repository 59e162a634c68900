// One tick's messages that pictures and derived signals are made of.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tuple>

#include "components/framework/graph.pb.h"
#include "derived/signals_t.hpp"
#include "lcmtypes/message_fields.h"
#include "poise/balance_torque_t.hpp"
#include "poise/bridge_status_t.hpp"
#include "poise/estimator_status_t.hpp"
#include "poise/external_push_t.hpp"
#include "poise/ground_truth_t.hpp"
#include "poise/joint_command_t.hpp"
#include "poise/planner_status_t.hpp"
#include "poise/robot_sensors_t.hpp"
#include "poise/robot_state_t.hpp"
#include "poise/support_plan_t.hpp"
#include "steps/footsteps_t.hpp"

namespace poise::logging {

/// The channel under which the messages of DerivedSignals are read, whatever the graph's are
/// called.
inline constexpr char kDerivedChannel[] = "DERIVED";

/// A slot for each type of message.
template <template <class> class Slot>
struct TickSlots {
  Slot<robot_sensors_t> sensors{};
  Slot<robot_state_t> state{};
  Slot<estimator_status_t> estimator{};
  Slot<support_plan_t> plan{};
  Slot<planner_status_t> planner{};
  Slot<balance_torque_t> balance{};
  Slot<joint_command_t> command{};
  Slot<bridge_status_t> bridge{};
  Slot<external_push_t> push{};
  Slot<ground_truth_t> truth{};
  Slot<steps::footsteps_t> footsteps{};
  Slot<derived::signals_t> derived{};

  /// Calls visit(Slot<T>&) for each.
  template <class Visit>
  void VisitMessages(const Visit& visit) {
    std::apply([&](auto&... message) { (visit(message), ...); },
               std::tie(sensors, state, estimator, plan, planner, balance, command, bridge, push,
                        truth, footsteps, derived));
  }
};

template <class T>
using MessagePointer = const T*;
/// nullptr: the tick has none.
using TickView = TickSlots<MessagePointer>;

struct TickMessages : TickSlots<std::optional> {
  int64_t tick = -1;
  int64_t utime = 0;  ///< us, the same of all

  TickView view() const;
  size_t num_parts() const;
  /// Takes an encoded message, if it is whole and the first of one of these types; all but
  /// `derived` with finite numbers alone. True: it has taken it.
  bool Take(std::string_view type, std::span<const uint8_t> data);
};

/// Gathers the messages of every `every`-th tick, from several channels that need not be in step.
class TickGatherer {
 public:
  static constexpr size_t kFewTicks = 8;  ///< that a picture waits for those who are late

  /// The graph's first of several channels with one type is taken. `most`: ticks that are gathered
  /// at a time.
  TickGatherer(const RunSpec& spec, int64_t every, size_t most = kFewTicks);

  /// Passes over what is not wanted. The message must be well formed and of this run.
  void Add(std::string_view channel, const MessageType& type, std::span<const uint8_t> data);
  /// The oldest tick that no message is expected for any more, or with `end` that has any. Expected
  /// is what has come in any tick; who is late by some ticks is waited for.
  std::optional<TickMessages> Take(bool end);
  /// What has come of a tick; earlier ones are let go.
  std::optional<TickMessages> TakeTick(int64_t tick);

 private:
  int64_t every_;
  size_t most_;
  int64_t newest_ = -1;
  int64_t taken_ = -1;  // the last tick that was
  std::map<std::string, std::string, std::less<>> channel_of_type_;
  std::set<std::string, std::less<>> parts_;  // types of which any came
  std::map<int64_t, TickMessages> ticks_;
};

}  // namespace poise::logging
