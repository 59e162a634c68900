#include "logging/run_record.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/run.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "poise/message_traits.hpp"

namespace poise::logging {
namespace {

struct Lane {
  ChannelTicks ticks;
  std::function<bool(int64_t tick, std::span<const uint8_t> data)> add;
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

/// Keeps what no series holds: as it is, if it can be read.
std::function<bool(int64_t, std::span<const uint8_t>)> Keep(const std::string& type_name,
                                                            Series<std::vector<uint8_t>>* series) {
  class Nothing final : public ScalarVisitor {
   public:
    void Integer(std::string_view, int64_t) override {}
    void Real(std::string_view, double value) override { finite = finite && std::isfinite(value); }
    void Text(std::string_view, std::string_view) override {}
    bool finite = true;
  };
  return [type = FindMessageType(type_name), series](int64_t tick, std::span<const uint8_t> data) {
    Nothing values;
    if (type == nullptr || !type->visit(data.data(), static_cast<int64_t>(data.size()), &values) ||
        !values.finite) {
      return false;
    }
    series->Set(tick, {data.begin(), data.end()});
    return true;
  };
}

using Adders =
    std::map<std::string, std::function<bool(int64_t, std::span<const uint8_t>)>, std::less<>>;

Adders MakeAdders(RunRecord* run) {
  Adders adders;
  run->VisitSeries(
      [&]<class T>(Series<T>* series) { adders.emplace(T::getTypeName(), AddTo(series)); });
  return adders;
}

/// Metrics index messages by the robot's joints and feet.
void CheckRobot(const RunRecord& run, const std::string& path) {
  for (const Channel& channel : run.spec.graph().channel()) {
    const std::span<const char* const> names = ChannelType(channel).count_names;
    for (size_t i = 0; i < names.size(); ++i) {
      const std::string_view name = names[i];
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

}  // namespace

RunRecord ReadRun(const std::string& path) {
  LogReader reader(path);
  RunRecord run;
  RunInfo found = FindRunInfo(&reader, path);
  run.info = std::move(found.info);
  run.spec = std::move(found.spec);
  run.robot = robot::LoadRobotTexts(run.info.robot, run.info.urdf);
  CheckRobot(run, path);

  Adders adders = MakeAdders(&run);
  std::vector<Lane> lanes;
  std::map<std::string, size_t, std::less<>> lane_of;
  for (const Channel& channel : run.spec.graph().channel()) {
    if (channel.external() || !IsKept(run.spec, channel.name())) continue;
    auto adder = adders.extract(channel.type());
    lane_of[channel.name()] = lanes.size();
    lanes.push_back({ChannelTicks(run.spec, channel, reader.file_size()),
                     adder ? adder.mapped() : Keep(channel.type(), &run.other[channel.name()])});
  }
  LogEvent event;
  while (reader.Next(&event)) {
    const auto lane = lane_of.find(event.channel);
    if (lane != lane_of.end()) {
      Lane& to = lanes[lane->second];
      const std::optional<int64_t> tick = to.ticks.Check(event.data);
      if (!tick) continue;
      if (!to.add || to.add(*tick, event.data)) {
        to.ticks.Take(*tick);
      } else {
        to.ticks.Refuse();
      }
    } else if (event.channel.starts_with("HEALTH_")) {
      std::optional<health_t> health = ReadHealth(event, run.spec.run_id());
      if (health) {
        run.health[health->component] = std::move(*health);
      } else {
        ++run.refused_health;
      }
    }
  }
  run.damages = reader.damages();
  for (const Lane& lane : lanes) run.num_ticks = std::max(run.num_ticks, lane.ticks.newest() + 1);
  const int64_t first = run.spec.cut().first_tick();
  for (const Lane& lane : lanes) {
    run.channels.push_back(lane.ticks.Completeness(first, run.num_ticks));
  }
  return run;
}

std::optional<health_t> ReadHealth(const LogEvent& event, int64_t run_id) {
  health_t health;
  if (!DecodeChecked(event.data.data(), static_cast<int64_t>(event.data.size()), &health) ||
      health.run_id != run_id || HealthChannel(health.component) != event.channel ||
      !MessageTraits<health_t>::AllFinite(health)) {
    return {};
  }
  return health;
}

}  // namespace poise::logging
