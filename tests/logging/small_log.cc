#include "tests/logging/small_log.h"

#include "poise/drive_command_t.hpp"
#include "poise/external_push_t.hpp"
#include "poise/health_t.hpp"

namespace poise::logging {

RunSpec SmallSpec() {
  RunSpec spec;
  spec.set_run_id(42);
  spec.set_tick_period(0.002);
  const auto add = [&](const char* name, const char* type, bool external) {
    Channel* channel = spec.mutable_graph()->add_channel();
    channel->set_name(name);
    channel->set_type(type);
    channel->set_external(external);
    return channel;
  };
  add("PUSH", "external_push_t", false);
  add("COMMAND", "drive_command_t", false)->add_count(12);
  add("STOP", "emergency_stop_t", true);
  return spec;
}

std::vector<uint8_t> Push(int64_t tick) {
  external_push_t push{};
  SetHeader(tick, &push);
  push.force[0] = static_cast<double>(tick) + 0.25;
  return Encode(push);
}

std::vector<uint8_t> Command(int64_t tick) {
  drive_command_t command{};
  SetHeader(tick, &command);
  command.num_motors = 12;
  command.current.assign(12, static_cast<double>(tick));
  command.enabled.assign(12, 1);
  command.position.assign(12, 0);
  command.velocity.assign(12, 0);
  command.stiffness.assign(12, 0);
  command.damping.assign(12, 0);
  return Encode(command);
}

std::vector<uint8_t> FinalHealth(int64_t tick) {
  health_t health{};
  SetHeader(tick, &health);
  health.component = "robot";
  health.detail = "ended, as \"planned\"";
  health.state = health_t::STATE_FINISHED;
  return Encode(health);
}

std::vector<RawEvent> SmallLog(int64_t ticks) {
  std::vector<RawEvent> events = {RunInfoEvent(SmallSpec())};
  for (int64_t tick = 0; tick < ticks; ++tick) {
    events.push_back({"PUSH", tick * 2000, Push(tick)});
    events.push_back({"COMMAND", tick * 2000, Command(tick)});
  }
  events.push_back({"HEALTH_ROBOT", (ticks - 1) * 2000, FinalHealth(ticks - 1)});
  return events;
}

size_t RecordOffset(const std::vector<RawEvent>& events, size_t index) {
  size_t offset = 0;
  for (size_t i = 0; i < index; ++i) offset += RecordSize(events[i]);
  return offset;
}

}  // namespace poise::logging
