#include "logging/run_record.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "components/framework/configuration.h"
#include "components/framework/packet_filter.h"
#include "components/framework/run.h"
#include "components/robot/robot_files.h"
#include "fmt/format.h"
#include "poise/message_traits.hpp"

namespace poise::logging {
namespace {

// A tick beyond this is damage, not a run: 5 hours at 500 Hz.
constexpr int64_t kMaxTicks = 10'000'000;

struct Lane {
  PacketFilter filter;
  std::function<bool(int64_t tick, std::span<const uint8_t> data)> add;
  std::vector<bool> seen;
  int64_t newest = -1;
};

template <class T>
std::function<bool(int64_t, std::span<const uint8_t>)> AddTo(Series<T>* series) {
  return [series](int64_t tick, std::span<const uint8_t> data) {
    T message;
    if (!DecodeChecked(data.data(), static_cast<int64_t>(data.size()), &message) ||
        !MessageTraits<T>::AllFinite(message)) {
      return false;
    }
    series->Set(tick, std::move(message));
    return true;
  };
}

using Adders =
    std::map<std::string, std::function<bool(int64_t, std::span<const uint8_t>)>, std::less<>>;

Adders MakeAdders(RunRecord* run) {
  return {{"robot_sensors_t", AddTo(&run->sensors)}, {"robot_state_t", AddTo(&run->state)},
          {"task_torque_t", AddTo(&run->task)},      {"balance_torque_t", AddTo(&run->balance)},
          {"joint_command_t", AddTo(&run->command)}, {"drive_command_t", AddTo(&run->drive)},
          {"bridge_status_t", AddTo(&run->bridge)},  {"external_push_t", AddTo(&run->push)},
          {"ground_truth_t", AddTo(&run->truth)}};
}

void AddHealth(const LogEvent& event, RunRecord* run) {
  health_t health;
  if (!DecodeChecked(event.data.data(), static_cast<int64_t>(event.data.size()), &health) ||
      health.run_id != run->spec.run_id() || HealthChannel(health.component) != event.channel ||
      !MessageTraits<health_t>::AllFinite(health)) {
    ++run->refused_health;
    return;
  }
  run->health[health.component] = std::move(health);
}

/// Metrics index messages by the robot's joints and feet.
void CheckSpec(const RunRecord& run, const std::string& path) {
  const double period = run.spec.tick_period();
  if (!std::isfinite(period) || period <= 0) {
    throw LogError(
        fmt::format("{}: RUN_INFO: tick_period is {} s; must be positive", path, period));
  }
  if (run.spec.num_ticks() < 0) {
    throw LogError(fmt::format("{}: RUN_INFO: num_ticks is {}; must not be negative", path,
                               run.spec.num_ticks()));
  }
  for (const Channel& channel : run.spec.graph().channel()) {
    const MessageType* type = FindMessageType(channel.type());
    if (type == nullptr || type->has_strings ||
        static_cast<size_t>(channel.count_size()) != type->count_names.size()) {
      throw LogError(fmt::format("{}: RUN_INFO: channel {} has no known type '{}' and counts", path,
                                 channel.name(), channel.type()));
    }
    for (size_t i = 0; i < type->count_names.size(); ++i) {
      const std::string_view name = type->count_names[i];
      const int32_t count = channel.count(static_cast<int>(i));
      const bool joints = name == "num_joints" || name == "num_motors";
      const auto robots = joints ? run.robot.joints().size() : size_t{2};
      if ((joints || name == "num_feet") && (count < 0 || static_cast<size_t>(count) != robots)) {
        throw LogError(fmt::format("{}: RUN_INFO: channel {}: {} is {}; the log's robot has {}",
                                   path, channel.name(), name, count, robots));
      }
    }
  }
}

void AddMessage(const LogEvent& event, int64_t max_ticks, Lane* lane,
                ChannelCompleteness* channel) {
  if (lane->filter.Check(event.data.data(), event.data.size(), 0, max_ticks - 1) !=
      PacketVerdict::kAccepted) {
    ++channel->refused;
    return;
  }
  const int64_t tick = lane->filter.tick(event.data.data());
  const auto i = static_cast<size_t>(tick);
  if (i >= lane->seen.size()) lane->seen.resize(i + 1, false);
  if (lane->seen[i]) {
    ++channel->duplicate;
    return;
  }
  if (lane->add && !lane->add(tick, event.data)) {
    ++channel->refused;
    return;
  }
  lane->seen[i] = true;
  ++channel->messages;
  channel->out_of_order += tick < lane->newest ? 1 : 0;
  lane->newest = std::max(lane->newest, tick);
}

}  // namespace

run_info_t ReadRunInfo(LogReader* reader, const std::string& path, RunSpec* spec) {
  LogEvent event;
  run_info_t info;
  if (!reader->Next(&event) || event.channel != kRunInfoChannel ||
      !DecodeChecked(event.data.data(), static_cast<int64_t>(event.data.size()), &info)) {
    throw LogError(fmt::format(
        "{}: does not begin with RUN_INFO; is it the log of a Poise run, and whole?", path));
  }
  try {
    ParseTextProto(info.run_spec, path + ": RUN_INFO.run_spec", spec);
  } catch (const ConfigError& error) {
    throw LogError(error.what());
  }
  return info;
}

RunRecord ReadRun(const std::string& path) {
  LogReader reader(path);
  RunRecord run;
  run.info = ReadRunInfo(&reader, path, &run.spec);
  run.robot = robot::LoadRobotTexts(run.info.robot, run.info.urdf);
  CheckSpec(run, path);

  Adders adders = MakeAdders(&run);
  std::vector<Lane> lanes;
  std::map<std::string, size_t, std::less<>> lane_of;
  for (const Channel& channel : run.spec.graph().channel()) {
    const MessageType* type = FindMessageType(channel.type());
    const std::vector<int32_t> counts(channel.count().begin(), channel.count().end());
    if (channel.external()) continue;
    auto adder = adders.extract(channel.type());
    lane_of[channel.name()] = lanes.size();
    lanes.push_back({PacketFilter(type->fingerprint, static_cast<int>(type->encoded_size(counts)),
                                  counts, run.spec.run_id()),
                     adder ? adder.mapped() : nullptr,
                     {}});
    run.channels.push_back({channel.name()});
  }
  const int64_t max_ticks = run.spec.num_ticks() > 0 && run.spec.num_ticks() < kMaxTicks
                                ? run.spec.num_ticks()
                                : kMaxTicks;
  LogEvent event;
  while (reader.Next(&event)) {
    const auto lane = lane_of.find(event.channel);
    if (lane != lane_of.end()) {
      AddMessage(event, max_ticks, &lanes[lane->second], &run.channels[lane->second]);
    } else if (event.channel.starts_with("HEALTH_")) {
      AddHealth(event, &run);
    }
  }
  run.damages = reader.damages();
  for (const Lane& lane : lanes) run.num_ticks = std::max(run.num_ticks, lane.newest + 1);
  for (ChannelCompleteness& channel : run.channels) {
    channel.missing = run.num_ticks - channel.messages;
  }
  return run;
}

}  // namespace poise::logging
