#include "logging/replay/log_pack.h"

#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/runners/inline_runner.h"
#include "fmt/format.h"
#include "logging/event_log_writer.h"
#include "logging/log_reader.h"
#include "logging/partial_file.h"
#include "logging/run_info.h"
#include "logging/run_log_writer.h"
#include "poise/message_traits.hpp"

namespace poise::logging {
namespace {

constexpr char kPackChannel[] = "LOG_PACK";
constexpr int kPackFormat = 1;
constexpr int64_t kBlockEvents = 4096;
constexpr int64_t kTicksPerCall = 500;  // of OnTick

/// An event that no component makes again.
struct KeptEvent {
  int64_t number = 0;
  int64_t utime = 0;
  std::string channel;
  std::vector<uint8_t> data;
};

/// Check sums of records as they stand in a file.
struct BlockSums {
  int64_t events = 0;
  uint64_t bytes = 0;
  std::vector<uint32_t> blocks;  // CRC-32 of each kBlockEvents records, of the last ones too

  void Add(std::span<const uint8_t> record) {
    if (events++ % kBlockEvents == 0) blocks.push_back(0);
    uint32_t& sum = blocks.back();
    sum = static_cast<uint32_t>(crc32_z(sum, record.data(), static_cast<z_size_t>(record.size())));
    bytes += record.size();
  }
};

struct PackedRun {
  RunSpec spec;
  std::vector<KeptEvent> kept;  // by number
  int64_t ticks = 0;
  BlockSums sums;
};

/// Makes a run's records again, in the order of its log, and compares their check sums.
class RemadeLog {
 public:
  using Sink = std::function<void(std::span<const uint8_t> record)>;

  RemadeLog(const PackedRun& run, std::string path, Sink sink)
      : run_(run), path_(std::move(path)), sink_(std::move(sink)) {}

  void Make(const ComponentRegistry& registry, const OnTick& on_tick) {
    std::optional<InlineRunner> made;
    try {
      made.emplace(run_.spec, registry);
    } catch (const ConfigError& error) {  // of what the log says of the run
      throw LogError(fmt::format("{}: cannot be made again: {}", path_, error.what()));
    }
    InlineRunner& runner = *made;
    struct Lane {
      std::string name;
      int utime_offset = 0;
      std::vector<uint8_t> data;
      bool here = false;
    };
    std::vector<Lane> lanes;
    for (const Channel& channel : run_.spec.graph().channel()) {
      lanes.push_back(
          {channel.name(), FindMessageType(channel.type())->run_id_offset + 16, {}, false});
    }
    runner.set_tap([&](int channel, const OutputPort& output, const Tick&) {
      Lane& lane = lanes[static_cast<size_t>(channel)];
      lane.data.resize(static_cast<size_t>(output.encoded_size()));
      output.Encode(lane.data.data(), static_cast<int>(lane.data.size()));
      lane.here = true;
    });
    bool more = true;
    for (tick_ = 0; more && tick_ < run_.ticks; ++tick_) {
      if (tick_ % kTicksPerCall == 0 && !on_tick(tick_, run_.ticks)) {
        throw LogError(fmt::format("{}: stopped at tick {} of {}", path_, tick_, run_.ticks));
      }
      more = runner.Step();
      for (Lane& lane : lanes) {
        if (!lane.here) continue;
        PutKept();
        Put(lane.name, ReadInt64(lane.data.data() + lane.utime_offset), lane.data);
        lane.here = false;
      }
    }
    if (tick_ < run_.ticks && runner.failed()) {
      throw LogError(fmt::format("{}: cannot be made again: {}", path_, runner.end_detail()));
    }
    PutKept();
    CheckBlocks(sums_.blocks.size());
    if (sums_.events != run_.sums.events || sums_.bytes != run_.sums.bytes) Differ();
    on_tick(run_.ticks, run_.ticks);
  }

 private:
  /// Events that came from elsewhere, at their places.
  void PutKept() {
    while (next_kept_ < run_.kept.size() && run_.kept[next_kept_].number == sums_.events) {
      const KeptEvent& event = run_.kept[next_kept_++];
      Put(event.channel, event.utime, event.data);
    }
  }
  void Put(std::string_view channel, int64_t utime, std::span<const uint8_t> data) {
    PutRecord(sums_.events, channel, utime, data, &record_);
    sums_.Add(record_);
    sink_(record_);
    CheckBlocks(static_cast<size_t>(sums_.events / kBlockEvents));
  }
  /// Compares the first `whole` blocks.
  void CheckBlocks(size_t whole) {
    for (; checked_ < whole; ++checked_) {
      const std::vector<uint32_t>& packed = run_.sums.blocks;
      if (checked_ >= packed.size() || sums_.blocks[checked_] != packed[checked_]) Differ();
    }
  }
  [[noreturn]] void Differ() const {
    throw LogError(fmt::format(
        "{}: this build's components make other messages than the log has, at tick {} or up to {} "
        "events before; the run was recorded by poise {}{}, built for {}",
        path_, tick_, kBlockEvents, run_.spec.poise_version(),
        run_.spec.poise_commit().empty() ? "" : fmt::format(" ({})", run_.spec.poise_commit()),
        run_.spec.instruction_set()));
  }

  const PackedRun& run_;
  std::string path_;
  Sink sink_;
  BlockSums sums_;
  std::vector<uint8_t> record_;
  size_t next_kept_ = 0;
  size_t checked_ = 0;
  int64_t tick_ = 0;
};

/// What is to be packed of a log, and whether it can be.
PackedRun Describe(const std::string& path) {
  PackedRun run;
  LogReader reader(path);
  RunInfo found = FindRunInfo(&reader, path);
  const auto refuse = [&](const std::string& why) {
    throw LogError(fmt::format("{}: cannot be made again, and is not packed: {}", path, why));
  };
  if (!found.warning.empty()) refuse(found.warning);
  run.spec = std::move(found.spec);
  if (run.spec.realtime()) refuse("the run was in real time, which decides what came too late");
  if (run.spec.has_cut()) refuse("it is a part of a run");
  std::map<std::string, const MessageType*, std::less<>> made;
  for (const Channel& channel : run.spec.graph().channel()) {
    if (!channel.external()) made[channel.name()] = FindMessageType(channel.type());
  }
  reader.Rewind();
  BlockSums& sums = run.sums;
  LogEvent event;
  while (reader.Next(&event)) {
    const auto channel = made.find(event.channel);
    if (event.number != sums.events) refuse("its events are not numbered one after the other");
    const size_t size = kEventLogHeader + event.channel.size() + event.data.size();
    sums.Add({reader.bytes() + event.offset, size});
    if (channel != made.end()) {
      const auto at = static_cast<size_t>(channel->second->run_id_offset) + 8;
      if (event.data.size() < at + 16) refuse("a message is too short");
      run.ticks = std::max(run.ticks, ReadInt64(event.data.data() + at) + 1);
      continue;
    }
    if (event.channel != kRunInfoChannel && !event.channel.starts_with("HEALTH_")) {
      refuse(fmt::format("event {} came from outside the graph", event.number));
    }
    run.kept.push_back({event.number,
                        event.utime,
                        std::string(event.channel),
                        {event.data.begin(), event.data.end()}});
  }
  if (reader.damages() > 0) refuse("it is damaged: see poise log check");
  return run;
}

void WritePacked(const PackedRun& run, const std::string& path) {
  nlohmann::ordered_json json;
  json["format"] = kPackFormat;
  json["bytes"] = run.sums.bytes;
  json["events"] = run.sums.events;
  json["ticks"] = run.ticks;
  for (const KeptEvent& event : run.kept) json["kept"].push_back(event.number);
  json["blocks"] = run.sums.blocks;
  const std::string text = json.dump();
  std::filesystem::remove(path);  // of an earlier time; the log is still there
  PartialFile file(path);
  EventLogWriter log(file.part());
  for (const KeptEvent& event : run.kept) log.Write(event.channel, event.utime, event.data);
  log.Write(kPackChannel, 0, {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  log.Close();
  file.Keep();
}

PackedRun ReadPacked(const std::string& path) {
  PackedRun run;
  LogReader reader(path);
  run.spec = FindRunInfo(&reader, path).spec;
  reader.Rewind();
  LogEvent event;
  bool complete = false;
  while (!complete && reader.Next(&event)) {
    if (event.channel != kPackChannel) {
      run.kept.push_back(
          {0, event.utime, std::string(event.channel), {event.data.begin(), event.data.end()}});
      continue;
    }
    try {
      const nlohmann::json json = nlohmann::json::parse(event.data.begin(), event.data.end());
      if (json.at("format").get<int>() != kPackFormat) {
        throw LogError(fmt::format("{}: has format {} of packed logs; this build knows {}", path,
                                   json.at("format").get<int>(), kPackFormat));
      }
      run.sums.bytes = json.at("bytes").get<uint64_t>();
      run.sums.events = json.at("events").get<int64_t>();
      run.ticks = json.at("ticks").get<int64_t>();
      run.sums.blocks = json.at("blocks").get<std::vector<uint32_t>>();
      const auto numbers = json.at("kept").get<std::vector<int64_t>>();
      if (numbers.size() != run.kept.size()) {
        throw LogError(fmt::format("{}: lacks events that were kept: it is damaged", path));
      }
      for (size_t i = 0; i < numbers.size(); ++i) run.kept[i].number = numbers[i];
      complete = true;
    } catch (const nlohmann::json::exception& error) {
      throw LogError(fmt::format("{}: LOG_PACK: {}", path, error.what()));
    }
  }
  if (!complete || reader.damages() > 0) {
    throw LogError(fmt::format("{}: is no packed log, or it is damaged", path));
  }
  return run;
}

uint64_t FileSize(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

}  // namespace

bool IsPackedLog(const std::string& path) {
  if (!IsEventLog(path)) return false;
  LogReader reader(path);
  LogEvent event;
  // HEALTH_* of one run at most before it.
  constexpr int kMostKept = 100'000;
  for (int i = 0; i < kMostKept && reader.Next(&event); ++i) {
    if (event.channel == kPackChannel) return true;
    if (event.channel != kRunInfoChannel && !event.channel.starts_with("HEALTH_")) return false;
  }
  return false;
}

PackResult PackLog(const std::string& log, const std::string& packed,
                   const ComponentRegistry& registry, const OnTick& on_tick) {
  if (std::filesystem::exists(packed) && !IsPackedLog(packed)) {
    throw LogError(fmt::format("{}: exists, and is no packed log; remove it", packed));
  }
  const PackedRun run = Describe(log);
  RemadeLog(run, log, [](std::span<const uint8_t>) {}).Make(registry, on_tick);
  WritePacked(run, packed);
  return {run.sums.bytes, FileSize(packed), run.ticks};
}

PackResult UnpackLog(const std::string& packed, const std::string& log,
                     const ComponentRegistry& registry, const OnTick& on_tick) {
  if (std::filesystem::exists(log)) {
    throw LogError(fmt::format("{}: exists; remove it or name another file", log));
  }
  const PackedRun run = ReadPacked(packed);
  CheckedFile file(log);
  RemadeLog(run, packed, [&](std::span<const uint8_t> record) {
    file.Write({reinterpret_cast<const char*>(record.data()), record.size()});
  }).Make(registry, on_tick);
  file.Close();
  return {run.sums.bytes, FileSize(packed), run.ticks};
}

}  // namespace poise::logging
