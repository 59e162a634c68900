#include "logging/replay/bits.h"

#include <algorithm>
#include <boost/crc.hpp>
#include <nlohmann/json.hpp>
#include <sstream>

#include "components/framework/bus/packet_filter.h"
#include "fmt/format.h"
#include "logging/channel_ticks.h"
#include "logging/log_reader.h"
#include "logging/run_info.h"
#include "poise/message_traits.hpp"

namespace poise::logging {
namespace {

// CRC-64/XZ: ECMA-182's polynomial, reflected.
using Crc = boost::crc_optimal<64, 0x42F0E1EBA9EA3693, ~uint64_t{0}, ~uint64_t{0}, true, true>;

struct Accumulator {
  std::string name;
  const MessageType* type = nullptr;
  Crc crc;
  std::vector<uint8_t> by_tick;

  void Add(std::span<const uint8_t> message, const std::string& path) {
    constexpr uint8_t kNoRunId[8] = {};
    const auto run_id = static_cast<size_t>(type->run_id_offset);
    if (message.size() < run_id + 24) {
      throw LogError(fmt::format("{}: a message of {} is too short", path, name));
    }
    const int64_t tick = ReadInt64(message.data() + run_id + 8);
    if (tick != static_cast<int64_t>(by_tick.size())) {
      throw LogError(
          fmt::format("{}: {} has tick {} where tick {} should be; only whole logs of runs in "
                      "lockstep have bits to compare",
                      path, name, tick, by_tick.size()));
    }
    crc.process_bytes(message.data(), run_id);
    crc.process_bytes(kNoRunId, sizeof(kNoRunId));
    crc.process_bytes(message.data() + run_id + 8, message.size() - run_id - 8);
    by_tick.push_back(static_cast<uint8_t>(crc.checksum()));
  }
};

}  // namespace

std::vector<ChannelBits> BitsOfLog(const std::string& path) {
  LogReader reader(path);
  const RunSpec spec = FindRunInfo(&reader, path).spec;
  std::vector<Accumulator> channels;
  for (const Channel& channel : spec.graph().channel()) {
    if (channel.external()) continue;
    channels.push_back({channel.name(), &ChannelType(channel), Crc(), {}});
  }
  LogEvent event;
  while (reader.Next(&event)) {
    const auto channel = std::ranges::find(channels, event.channel, &Accumulator::name);
    if (channel != channels.end()) channel->Add(event.data, path);
  }
  std::vector<ChannelBits> bits;
  for (Accumulator& channel : channels) {
    bits.push_back({channel.name, channel.crc.checksum(), std::move(channel.by_tick)});
  }
  return bits;
}

std::optional<BitsDifference> FirstDifference(const std::vector<ChannelBits>& recorded,
                                              const std::vector<ChannelBits>& seen) {
  std::optional<BitsDifference> first;
  const auto note = [&](size_t tick, const std::string& channel, const char* what) {
    if (first && first->tick <= static_cast<int64_t>(tick)) return;
    first = {static_cast<int64_t>(tick), channel, what};
  };
  const auto find = [](const std::vector<ChannelBits>& all, const std::string& name) {
    const auto found = std::ranges::find(all, name, &ChannelBits::name);
    return found == all.end() ? nullptr : &*found;
  };
  for (const ChannelBits& channel : seen) {
    const ChannelBits* const record = find(recorded, channel.name);
    if (record == nullptr) {
      note(0, channel.name, "the record lacks it");
      continue;
    }
    const size_t both = std::min(record->by_tick.size(), channel.by_tick.size());
    const auto differs = static_cast<size_t>(
        std::ranges::mismatch(channel.by_tick, record->by_tick).in1 - channel.by_tick.begin());
    if (differs < both) {
      note(differs, channel.name, "its message differs");
    } else if (record->by_tick.size() != channel.by_tick.size()) {
      note(both, channel.name,
           both < channel.by_tick.size() ? "the record lacks it" : "the run lacks it");
    } else if (record->crc64 != channel.crc64) {  // the last tick's byte hid it
      note(both == 0 ? 0 : both - 1, channel.name, "its message differs");
    }
  }
  for (const ChannelBits& channel : recorded) {
    if (find(seen, channel.name) == nullptr) note(0, channel.name, "the run lacks it");
  }
  return first;
}

nlohmann::ordered_json BitsJson(const std::vector<ChannelBits>& bits) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const ChannelBits& channel : bits) {
    json.push_back(
        fmt::format("{:016x} {} {}", channel.crc64, channel.by_tick.size(), channel.name));
  }
  return json;
}

std::string BitsBytes(const std::vector<ChannelBits>& bits) {
  std::string bytes;
  for (const ChannelBits& channel : bits) {
    bytes.append(channel.by_tick.begin(), channel.by_tick.end());
  }
  return bytes;
}

std::vector<ChannelBits> ParseBits(const nlohmann::json& json, const std::string& bytes) {
  std::vector<ChannelBits> bits;
  size_t position = 0;
  try {
    for (const nlohmann::json& each : json) {
      ChannelBits channel;
      size_t ticks = 0;
      std::istringstream line(each.get<std::string>());
      line >> std::hex >> channel.crc64 >> std::dec >> ticks >> channel.name;
      if (!line || !line.eof()) {
        throw LogError(fmt::format("'{}': is no check sum, ticks and channel", line.str()));
      }
      if (ticks > bytes.size() - position) {
        throw LogError(
            fmt::format("{}: the bytes by tick end before its {} ticks", channel.name, ticks));
      }
      const auto begin = bytes.begin() + static_cast<long>(position);
      channel.by_tick.assign(begin, begin + static_cast<long>(ticks));
      position += ticks;
      bits.push_back(std::move(channel));
    }
  } catch (const nlohmann::json::exception& error) {
    throw LogError(error.what());
  }
  if (position != bytes.size()) {
    throw LogError(
        fmt::format("there are {} bytes by tick, {} are needed", bytes.size(), position));
  }
  return bits;
}

}  // namespace poise::logging
