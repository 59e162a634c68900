#include "logging/run_record.h"

#include <algorithm>
#include <functional>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/operator_acts.h"
#include "components/framework/run.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "lcmtypes/message_scalars.h"
#include "operate/message_traits.hpp"
#include "poise/message_traits.hpp"

namespace poise::logging {
namespace {

using Add = std::function<bool(int64_t tick, std::span<const uint8_t> data)>;

struct Lane {
  ChannelTicks ticks;
  Add add;
};

/// Where a record's messages go: into memory, or noted where they stand in the log.
class Store {
 public:
  /// `log`: nullptr for memory. `begin`: what the reader's first byte is.
  Store(std::shared_ptr<PagedFile> log, const uint8_t* begin)
      : log_(std::move(log)), begin_(begin) {}

  template <class T>
  Add Messages(Series<T>* series) const {
    if (log_ == nullptr) {
      return [series](int64_t tick, std::span<const uint8_t> data) {
        T message;
        if (!IsMessage(data, &message)) return false;
        series->Set(tick, std::move(message));
        return true;
      };
    }
    auto paged =
        std::make_shared<PagedSeries<T>>(log_, [](std::span<const uint8_t> data, T* message) {
          message->decode(data.data(), 0, static_cast<int>(data.size()));
        });
    series->Page(paged);
    return [paged, begin = begin_, message = T()](int64_t tick,
                                                  std::span<const uint8_t> data) mutable {
      if (!IsMessage(data, &message)) return false;
      paged->Place(tick, static_cast<uint64_t>(data.data() - begin), data.size());
      return true;
    };
  }

  /// Keeps what no series holds: as it is, if it can be read.
  Add Bytes(const std::string& type_name, Series<std::vector<uint8_t>>* series) const {
    const MessageType* const type = FindMessageType(type_name);
    if (log_ == nullptr) {
      return [type, series](int64_t tick, std::span<const uint8_t> data) {
        if (!IsReadable(type, data)) return false;
        series->Set(tick, {data.begin(), data.end()});
        return true;
      };
    }
    auto paged = std::make_shared<PagedSeries<std::vector<uint8_t>>>(
        log_, [](std::span<const uint8_t> data, std::vector<uint8_t>* bytes) {
          bytes->assign(data.begin(), data.end());
        });
    series->Page(paged);
    return [type, paged, begin = begin_](int64_t tick, std::span<const uint8_t> data) {
      if (!IsReadable(type, data)) return false;
      paged->Place(tick, static_cast<uint64_t>(data.data() - begin), data.size());
      return true;
    };
  }

 private:
  template <class T>
  static bool IsMessage(std::span<const uint8_t> data, T* message) {
    return DecodeChecked(data, message) && MessageTraits<T>::AllFinite(*message);
  }
  static bool IsReadable(const MessageType* type, std::span<const uint8_t> data) {
    return type != nullptr && AllFinite(*type, data);
  }

  std::shared_ptr<PagedFile> log_;
  const uint8_t* begin_;
};

std::map<std::string, Add, std::less<>> MakeAdders(const Store& store, RunRecord* run) {
  std::map<std::string, Add, std::less<>> adders;
  // A series is paged when it has its channel: one of each type.
  run->VisitSeries([&]<class T>(Series<T>* series) {
    adders.emplace(T::getTypeName(), store.Messages(series));
  });
  return adders;
}

bool IsAnswer(std::span<const uint8_t> data, int64_t run_id, operate::answer_t* answer) {
  return DecodeChecked(data, answer) && answer->run_id == run_id &&
         MessageTraits<operate::answer_t>::AllFinite(*answer);
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

RunRecord ReadRun(const std::string& path, uint64_t most_in_memory) {
  LogReader reader(path);
  RunRecord run;
  run.paged = reader.file_size() > most_in_memory;
  const Store store(run.paged ? std::make_shared<PagedFile>(path) : nullptr, reader.bytes());
  RunInfo found = FindRunInfo(&reader, path);
  run.info = std::move(found.info);
  run.spec = std::move(found.spec);
  run.robot = robot::LoadRobotTexts(run.info.robot, run.info.urdf);
  CheckRobot(run, path);

  auto adders = MakeAdders(store, &run);
  std::vector<Lane> lanes;
  std::map<std::string, size_t, std::less<>> lane_of;
  std::string_view answers;  // the channel; empty: the graph has none
  for (const Channel& channel : run.spec.graph().channel()) {
    if (channel.type() == kAnswerType) answers = channel.name();
    if (channel.external() || !IsKept(run.spec, channel.name())) continue;
    auto adder = adders.extract(channel.type());
    lane_of[channel.name()] = lanes.size();
    lanes.push_back(
        {ChannelTicks(run.spec, channel, reader.file_size()),
         adder ? adder.mapped() : store.Bytes(channel.type(), &run.other[channel.name()])});
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
    } else if (!answers.empty() && event.channel == answers) {
      operate::answer_t answer;
      if (IsAnswer(event.data, run.spec.run_id(), &answer)) run.answers.push_back(answer);
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
  if (!DecodeChecked(event.data, &health) || health.run_id != run_id ||
      HealthChannel(health.component) != event.channel ||
      !MessageTraits<health_t>::AllFinite(health)) {
    return {};
  }
  return health;
}

}  // namespace poise::logging
