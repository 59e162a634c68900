// The recorder's process: collects every message of a run, logs it and mirrors it.
#include <sys/prctl.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>

#include "components/framework/bus/channel_collector.h"
#include "components/framework/clock.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/modules.h"
#include "components/framework/run.h"
#include "components/framework/runners/program_options.h"
#include "components/framework/say_error.h"
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

volatile std::sig_atomic_t stop_asked = 0;

void OnSignal(int) { stop_asked = 1; }

void WriteReport(const std::string& path, const RunSpec& spec, const RunLogWriter& writer,
                 const ChannelCollector& collector, int64_t mirror_errors) {
  int64_t requested = 0, duplicates = 0, refused = 0;
  auto channels = nlohmann::ordered_json::array();
  for (int i = 0; i < spec.graph().channel_size(); ++i) {
    const ChannelCollector::ChannelStatistics& s = collector.statistics(i);
    requested += s.requested;
    duplicates += s.duplicates;
    refused += s.refused;
    channels.push_back({{"name", spec.graph().channel(i).name()},
                        {"delivered", s.delivered},
                        {"requested", s.requested},
                        {"skipped", s.skipped},
                        {"duplicates", s.duplicates},
                        {"refused", s.refused}});
  }
  auto strangers = nlohmann::ordered_json::array();
  for (const Stranger& stranger : collector.strangers()) {
    strangers.push_back({{"channel", stranger.channel},
                         {"source", ToString(stranger.source)},
                         {"packets", stranger.packets}});
  }
  const nlohmann::ordered_json json = {
      {"run_id", spec.run_id()},          {"complete", collector.complete()},
      {"ticks", writer.complete_ticks()}, {"events", writer.events()},
      {"missing", writer.missing()},      {"requested", requested},
      {"duplicates", duplicates},         {"refused", refused},
      {"mirror_errors", mirror_errors},   {"channels", std::move(channels)},
      {"strangers", std::move(strangers)}};
  std::ofstream out(path);
  out << json.dump(2) << "\n";
  if (!out.flush()) {
    throw LogError(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
  }
}

/// Records until COMMAND_STOP or a signal. The log reaches the system at least every 100 ms.
/// `report`: where counters by channel go; empty: nowhere. Throws LogError, BusError or
/// ConfigError.
void Record(const RunSpec& spec, const RunSocket& socket, const std::string& scenario,
            const std::string& log, const std::string& report) {
  RunLogWriter writer(log, spec, MakeRunInfo(spec, scenario));
  RunSender mirror(socket, MirrorUrl(spec));
  std::vector<std::string> names;
  for (const Channel& channel : spec.graph().channel()) names.push_back(channel.name());
  bool heard = AnyoneListens(MirrorUrl(spec));
  int64_t mirror_errors = 0;  // messages that the public URL did not get
  const auto send = [&](std::string_view channel, std::span<const uint8_t> data) {
    if (heard && !mirror.Send(channel, data.data(), data.size())) ++mirror_errors;
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
    while (!collector.stopped() && stop_asked == 0) {
      // A nap, so that one look finds the messages of some ticks, not each as it comes: half of the
      // recorder's time was waking up.
      clock_nanosleep(CLOCK_MONOTONIC, 0, &kNap, nullptr);
      collector.Spin(kSpin);
      const int64_t now = NowNanoseconds();
      if (now >= next_flush) {
        writer.Flush();
        next_flush = now + kFlushInterval;
      }
      if (now >= next_look) {
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
  if (!report.empty()) WriteReport(report, spec, writer, collector, mirror_errors);
}

int Main(int argc, char** argv) {
  struct sigaction action {};
  action.sa_handler = OnSignal;
  action.sa_flags = SA_RESTART;
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  std::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is an error that is told

  std::string run_file, scenario_file, log, report;
  int socket_fd = -1;
  const std::optional<int> code = ParseProgram(
      argc, argv, "recorder",
      "Records a Poise run as an LCM event log. Usually started by `poise run`.",
      {{"--run", &run_file, "the run: protobuf text of poise.RunSpec", true},
       {"--log", &log, "event log to write", true},
       {"--report", &report, "counters at the end, as JSON"},
       {"--scenario", &scenario_file, "scenario text to keep in the log"},
       {"--socket", &socket_fd, "descriptor of the run's socket; default: it is asked for"}});
  if (code) return *code;
  try {
    LoadModules();  // their messages
    RunSpec spec;
    ReadTextProto(run_file, &spec);
    const RunSocket socket = socket_fd < 0 ? RunSocket::Ask(spec) : RunSocket(spec, socket_fd);
    Record(spec, socket, scenario_file.empty() ? "" : ReadFile(scenario_file), log, report);
    return 0;
  } catch (const ConfigError& error) {
    SayError(fmt::format("recorder: {}", error.what()));
    return 2;
  } catch (const std::exception& error) {
    SayError(fmt::format("recorder: {}", error.what()));
    return 1;
  }
}

}  // namespace
}  // namespace poise::logging

int main(int argc, char** argv) { return poise::logging::Main(argc, argv); }
