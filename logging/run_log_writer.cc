#include "logging/run_log_writer.h"

#include <google/protobuf/text_format.h>

#include <algorithm>
#include <chrono>
#include <cstring>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/run.h"
#include "fmt/chrono.h"
#include "fmt/format.h"
#include "poise/message_traits.hpp"

namespace poise::logging {

RunLogWriter::RunLogWriter(const std::string& path, const RunSpec& spec, const run_info_t& info)
    : log_(path), tick_period_(spec.tick_period()), num_ticks_(spec.num_ticks()) {
  health_utime_offset_ = FindMessageType("health_t")->run_id_offset + 16;
  for (const Channel& channel : spec.graph().channel()) {
    const MessageType* type = FindMessageType(channel.type());
    if (type == nullptr || !type->has_header ||
        static_cast<size_t>(channel.count_size()) != type->count_names.size()) {
      throw ConfigError(
          fmt::format("channel {}: no type and counts of a channel's message; fill "
                      "them in from the checked graph",
                      channel.name()));
    }
    Lane lane;
    lane.name = channel.name();
    lane.external = channel.external();
    lane.size = static_cast<size_t>(type->encoded_size(CountsOf(channel)));
    lane.utime_offset = type->run_id_offset + 16;
    if (!lane.external) {
      lane.bytes.resize(lane.size * static_cast<size_t>(capacity_));
      lane.present.resize(static_cast<size_t>(capacity_));
    }
    lanes_.push_back(std::move(lane));
  }
  log_.Write(kRunInfoChannel, 0, MessageBytes(info));
  Flush();
}

void RunLogWriter::AddMessage(int channel, int64_t tick, std::span<const uint8_t> data) {
  Lane& lane = lanes_[static_cast<size_t>(channel)];
  if (data.size() != lane.size) {
    throw std::logic_error(
        fmt::format("{}: {} bytes instead of {}", lane.name, data.size(), lane.size));
  }
  if (lane.external) {
    log_.Write(lane.name, TimeUnderWay(), data);
    return;
  }
  if (tick != lane.next_tick) {
    throw std::logic_error(
        fmt::format("{}: tick {} where {} was due", lane.name, tick, lane.next_tick));
  }
  while (tick - next_tick_ >= capacity_) Grow();
  std::memcpy(lane.bytes.data() + static_cast<size_t>(tick % capacity_) * lane.size, data.data(),
              lane.size);
  lane.present[static_cast<size_t>(tick % capacity_)] = 1;
  ++lane.next_tick;
  WriteCompleteTicks();
}

void RunLogWriter::Skip(int channel, int64_t tick) {
  Lane& lane = lanes_[static_cast<size_t>(channel)];
  if (lane.external) return;
  while (lane.next_tick < tick) {
    while (lane.next_tick - next_tick_ >= capacity_) Grow();
    lane.present[static_cast<size_t>(lane.next_tick % capacity_)] = 0;
    ++lane.next_tick;
    WriteCompleteTicks();
  }
}

void RunLogWriter::WriteCompleteTicks() {
  const auto has_next = [&](const Lane& l) { return l.external || l.next_tick > next_tick_; };
  while (std::all_of(lanes_.begin(), lanes_.end(), has_next)) WriteTick(next_tick_++);
}

void RunLogWriter::AddHealth(std::string_view channel, std::span<const uint8_t> data) {
  log_.Write(channel, ReadInt64(data.data() + health_utime_offset_), data);
}

int64_t RunLogWriter::TimeUnderWay() const {
  const int64_t last = num_ticks_ > 0 ? num_ticks_ - 1 : next_tick_;
  return MakeTick(std::min(next_tick_, last), tick_period_).utime;
}

void RunLogWriter::Grow() {
  for (Lane& lane : lanes_) {
    if (lane.external) continue;
    std::vector<uint8_t> bytes(lane.bytes.size() * 2);
    for (int64_t tick = next_tick_; tick < lane.next_tick; ++tick) {
      std::memcpy(bytes.data() + static_cast<size_t>(tick % (2 * capacity_)) * lane.size,
                  lane.bytes.data() + static_cast<size_t>(tick % capacity_) * lane.size, lane.size);
    }
    lane.bytes = std::move(bytes);
    std::vector<char> present(lane.present.size() * 2);
    for (int64_t tick = next_tick_; tick < lane.next_tick; ++tick) {
      present[static_cast<size_t>(tick % (2 * capacity_))] =
          lane.present[static_cast<size_t>(tick % capacity_)];
    }
    lane.present = std::move(present);
  }
  capacity_ *= 2;
}

void RunLogWriter::WriteTick(int64_t tick) {
  for (const Lane& lane : lanes_) {
    if (lane.external || lane.next_tick <= tick) continue;
    if (lane.present[static_cast<size_t>(tick % capacity_)] == 0) continue;
    const uint8_t* data = lane.bytes.data() + static_cast<size_t>(tick % capacity_) * lane.size;
    log_.Write(lane.name, ReadInt64(data + lane.utime_offset), {data, lane.size});
  }
}

void RunLogWriter::Close() {
  if (!log_.open()) return;
  int64_t last = next_tick_;
  for (const Lane& lane : lanes_) last = std::max(last, lane.next_tick);
  for (int64_t tick = next_tick_; tick < last; ++tick) {
    WriteTick(tick);
    for (const Lane& lane : lanes_) missing_ += !lane.external && lane.next_tick <= tick ? 1 : 0;
  }
  log_.Close(/*sums=*/true);
}

std::string TimeNow() {
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now));
}

run_info_t MakeRunInfo(const RunSpec& spec, const std::string& scenario) {
  run_info_t info{};
  info.run_id = spec.run_id();
  google::protobuf::TextFormat::PrintToString(spec, &info.run_spec);
  info.scenario = scenario;
  info.robot = ResourceOf(spec, "robot").text();
  info.urdf = ResourceOf(spec, "urdf").text();
  info.started_at = TimeNow();
  return info;
}

}  // namespace poise::logging
