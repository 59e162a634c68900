#include "logging/recording/recorder.h"

#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "components/framework/bus/channel_collector.h"
#include "components/framework/clock.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/recording/listeners.h"
#include "logging/run_log_writer.h"

namespace poise::logging {
namespace {

constexpr int64_t kFlushInterval = 50'000'000;   // ns
constexpr int kSpin = 50;                        // ms
constexpr int64_t kListenInterval = 20'000'000;  // ns, between two looks for a listener
constexpr timespec kNap{0, 1'000'000};
constexpr int kLastSpins = 20;  // each takes a batch of every channel

void WriteReport(const std::string& path, const RunSpec& spec, const RecorderReport& report,
                 const ChannelCollector& collector) {
  nlohmann::ordered_json json;
  json["run_id"] = spec.run_id();
  json["complete"] = report.complete;
  json["ticks"] = report.ticks;
  json["events"] = report.events;
  json["missing"] = report.missing;
  json["requested"] = report.requested;
  json["duplicates"] = report.duplicates;
  json["refused"] = report.refused;
  json["mirror_errors"] = report.mirror_errors;
  for (int i = 0; i < spec.graph().channel_size(); ++i) {
    const ChannelCollector::ChannelStatistics& s = collector.statistics(i);
    json["channels"].push_back({{"name", spec.graph().channel(i).name()},
                                {"delivered", s.delivered},
                                {"requested", s.requested},
                                {"skipped", s.skipped},
                                {"duplicates", s.duplicates},
                                {"refused", s.refused}});
  }
  json["strangers"] = nlohmann::ordered_json::array();
  for (const Stranger& stranger : collector.strangers()) {
    json["strangers"].push_back({{"channel", stranger.channel},
                                 {"source", ToString(stranger.source)},
                                 {"packets", stranger.packets}});
  }
  std::ofstream out(path);
  out << json.dump(2) << "\n";
  if (!out.flush()) {
    throw LogError(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
  }
}

}  // namespace

RecorderReport Record(const RunSpec& spec, const RunSocket& socket,
                      const RecorderOptions& options) {
  RecorderReport report;
  RunLogWriter writer(options.log_path, spec, MakeRunInfo(spec, options.scenario));
  std::optional<RunSender> mirror;
  if (options.mirror) mirror.emplace(socket, MirrorUrl(spec));
  std::vector<std::string> names;
  for (const Channel& channel : spec.graph().channel()) names.push_back(channel.name());
  bool heard = options.mirror && AnyoneListens(MirrorUrl(spec));
  const auto send = [&](std::string_view channel, std::span<const uint8_t> data) {
    if (heard && !mirror->Send(channel, data.data(), data.size())) ++report.mirror_errors;
  };

  ChannelCollector::Callbacks callbacks;
  callbacks.message = [&](int channel, int64_t tick, std::span<const uint8_t> data) {
    writer.AddMessage(channel, tick, data);
    send(names[static_cast<size_t>(channel)], data);
  };
  callbacks.skipped = [&](int channel, int64_t tick) { writer.Skip(channel, tick); };
  callbacks.service = [&](std::string_view channel, std::span<const uint8_t> data) {
    if (!channel.starts_with("HEALTH_")) return;
    writer.AddHealth(channel, data);
    send(channel, data);
  };
  ChannelCollector collector(spec, socket, "recorder", std::move(callbacks));

  int64_t next_flush = 0, next_look = 0;
  try {
    while (!collector.stopped() && (options.stop == nullptr || *options.stop == 0)) {
      // A nap, so that one look finds the messages of some ticks, not each as it comes: half of the
      // recorder's time was waking up.
      clock_nanosleep(CLOCK_MONOTONIC, 0, &kNap, nullptr);
      collector.Spin(kSpin);
      const int64_t now = NowNanoseconds();
      if (now >= next_flush) {
        writer.Flush();
        next_flush = now + kFlushInterval;
      }
      if (mirror && now >= next_look) {
        heard = AnyoneListens(MirrorUrl(spec));
        next_look = now + kListenInterval;
      }
    }
    // What came before the stop still waits in the channels' sockets.
    for (int i = 0; i < kLastSpins; ++i) collector.Spin(0);
    writer.Close();
  } catch (const LogError& error) {
    // What this process prints may go to the same full disk.
    collector.Fail(error.what());
    throw;
  }

  report.complete = collector.complete();
  report.ticks = writer.complete_ticks();
  report.events = writer.events();
  report.missing = writer.missing();
  for (int i = 0; i < spec.graph().channel_size(); ++i) {
    const ChannelCollector::ChannelStatistics& s = collector.statistics(i);
    report.requested += s.requested;
    report.duplicates += s.duplicates;
    report.refused += s.refused;
  }
  if (!options.report_path.empty()) WriteReport(options.report_path, spec, report, collector);
  return report;
}

}  // namespace poise::logging
