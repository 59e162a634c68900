#include "tests/logging/record_fixture.h"

#include <cmath>
#include <string_view>

#include "logging/metrics/metrics.h"

namespace poise::logging {
namespace {

template <class T>
T Sized(int64_t tick) {
  T message{};
  std::vector<int32_t> counts;
  for (const char* name : MessageTraits<T>::kCountNames) {
    counts.push_back(std::string_view(name) == "num_feet" ? 2 : 12);
  }
  MessageTraits<T>::Resize(message, counts);
  SetHeader(tick, &message);
  return message;
}

void SetIdentity(pose_t* pose) { pose->orientation[0] = 1; }

}  // namespace

RecordTest::RecordTest() {
  for (int64_t t = 0; t < kTicks; ++t) {
    sensors_.push_back(Sized<robot_sensors_t>(t));
    state_.push_back(Sized<robot_state_t>(t));
    plan_.push_back(Sized<support_plan_t>(t));
    planner_.push_back(Sized<planner_status_t>(t));
    task_.push_back(Sized<task_torque_t>(t));
    balance_.push_back(Sized<balance_torque_t>(t));
    command_.push_back(Sized<joint_command_t>(t));
    drive_.push_back(Sized<drive_command_t>(t));
    bridge_.push_back(Sized<bridge_status_t>(t));
    push_.push_back(Sized<external_push_t>(t));
    truth_.push_back(Sized<ground_truth_t>(t));
    state_.back().base_orientation[0] = truth_.back().base_orientation[0] = 1;
    SetIdentity(&balance_.back().frame_o);
    balance_.back().cop_limit[0] = 0.13;
    balance_.back().cop_limit[1] = 0.07;
    plan_.back().transition_foot = -1;
    command_.back().eta_feasible = 1;
    for (size_t foot = 0; foot < 2; ++foot) {
      SetIdentity(&planner_.back().foot_pose[foot]);
      planner_.back().foot_pose[foot].position[1] = foot == 0 ? -0.105 : 0.105;
      plan_.back().in_contact[foot] = command_.back().in_contact[foot] = 1;
      command_.back().conditions_met[foot] = 1;
      command_.back().margins[foot] = {1, 1, 1, 1, 1};
    }
  }
}

RunRecord RecordTest::Read() {
  std::vector<RawEvent> events = {RunInfoEvent(spec_)};
  for (size_t t = 0; t < kTicks; ++t) {
    const auto add = [&](const char* channel, const auto& message) {
      if (without_.contains(channel) || lost_.contains({channel, t})) return;
      Add(channel, message, &events);
    };
    add("ROBOT_SENSORS", sensors_[t]);
    add("ROBOT_STATE", state_[t]);
    add("SUPPORT_PLAN", plan_[t]);
    add("PLANNER_STATUS", planner_[t]);
    add("TASK_TORQUE", task_[t]);
    add("BALANCE_TORQUE", balance_[t]);
    add("JOINT_COMMAND", command_[t]);
    if (with_drives_) add("DRIVE_COMMAND", drive_[t]);
    add("BRIDGE_STATUS", bridge_[t]);
    add("EXTERNAL_PUSH", push_[t]);
    add("GROUND_TRUTH", truth_[t]);
  }
  for (const operate::answer_t& answer : answers_) Add("OPERATOR_ANSWER", answer, &events);
  WriteRawLog(path_, events);
  return ReadRun(path_);
}

double RecordTest::Measure(const std::string& name, double from) {
  RunRecord run = Read();
  run.first_tick = std::llround(from / kPeriod);
  const Metric* metric = FindMetric(name);
  EXPECT_NE(metric, nullptr) << name;
  if (metric == nullptr) return -1e9;
  const Answer value = metric->compute(run);
  EXPECT_TRUE(value.has_value()) << name;
  return value.value_or(-1e9);
}

bool RecordTest::Unanswered(const std::string& name) {
  const Metric* metric = FindMetric(name);
  EXPECT_NE(metric, nullptr) << name;
  return metric != nullptr && !metric->compute(Read()).has_value();
}

}  // namespace poise::logging
