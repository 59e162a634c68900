#include <signal.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <set>

#include "components/framework/clock.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/suggest.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/log_messages.h"
#include "poise/health_t.hpp"
#include "tools/cli/command_line.h"
#include "tools/cli/lists.h"
#include "tools/cli/signals.h"
#include "tools/commands/commands.h"
#include "tools/live/message_text.h"
#include "tools/run/live_run.h"
#include "tools/run/run_dir.h"

namespace poise {
namespace {

constexpr int kSpin = 100;                      // ms
constexpr int64_t kEchoSilence = 500'000'000;   // ns; then it is asked whether the run goes on
constexpr size_t kLogBuffer = size_t{1} << 20;  // bytes of text

struct EchoOptions {
  std::string channel;
  std::vector<std::string> fields;
  std::string run;
  std::string log;
  int64_t count = 0;  // 0: no end
  double rate = 0;    // Hz; 0: all
  bool csv = false;
};

/// Turns messages into text and writes it to stdout.
class EchoOutput {
 public:
  EchoOutput(const EchoOptions& options, logging::ElementNames names)
      : options_(options),
        names_(std::move(names)),
        selection_(options.fields),
        thinner_(options.rate) {}

  /// Throws ConfigError when such a message lacks a field.
  void Check(const MessageType& type, std::span<const uint8_t> data) {
    selection_.UseNames(type, names_);
    selection_.Check(type, ReadScalars(type, data, names_).value());
  }

  /// `time`: what --rate goes by, ns. Throws ConfigError when the first message lacks a field.
  void Add(const MessageType& type, std::span<const uint8_t> data, double time) {
    if (done() || !thinner_.Pass(time)) return;
    const std::optional<std::vector<Scalar>> scalars = ReadScalars(type, data, names_);
    if (!scalars) {
      ++refused_;
      return;
    }
    if (shown_ == 0) Check(type, data);
    const std::vector<Scalar> fields = selection_.Pick(*scalars);
    const uint8_t* header = data.data() + type.run_id_offset;
    const auto tick = type.has_header ? std::optional(ReadInt64(header + 8)) : std::nullopt;
    if (options_.csv) {
      const std::string columns = CsvHeader(tick.has_value(), fields);
      if (columns_.empty()) text_ += columns_ = columns;
      if (columns != columns_) {
        ++unlike_;
        return;
      }
      text_ += CsvRow(tick, fields);
    } else if (!selection_.all()) {
      if (fields.empty()) {
        ++unlike_;
        return;
      }
      text_ += MessageLine(tick, fields);
    } else {
      std::string title = fmt::format("{}  {}", options_.channel, type.name);
      if (tick) {
        title += fmt::format("  tick {}  {:.6f} s", *tick,
                             static_cast<double>(ReadInt64(header + 16)) * 1e-6);
      }
      text_ += MessageBlock(title, fields);
    }
    ++shown_;
  }
  void AddUnreadable() { ++refused_; }

  /// Nobody wants more: all that --count asked for, or the reader of stdout has gone.
  bool done() const { return closed_ || (options_.count > 0 && shown_ >= options_.count); }
  int64_t shown() const { return shown_; }
  size_t pending() const { return text_.size(); }

  /// Throws when stdout takes no more for another reason than that its reader has gone, or that a
  /// signal has ended the wait for it.
  void Write() {
    if (!closed_ && (std::fwrite(text_.data(), 1, text_.size(), stdout) != text_.size() ||
                     std::fflush(stdout) != 0)) {
      if (errno != EPIPE && !(errno == EINTR && StopSignal() != 0)) {
        throw std::runtime_error(fmt::format("stdout: {}", std::strerror(errno)));
      }
      closed_ = true;
    }
    text_.clear();
  }

  /// Tells on stderr of what was left out.
  void Summarize() const {
    if (refused_ > 0) {
      fmt::print(stderr, "poise: {}: {} messages could not be decoded and were left out\n",
                 options_.channel, refused_);
    }
    if (unlike_ > 0) {
      fmt::print(stderr, "poise: {}: {} messages with other fields than the first were left out\n",
                 options_.channel, unlike_);
    }
  }

 private:
  const EchoOptions& options_;
  logging::ElementNames names_;
  FieldSelection selection_;
  Thinner thinner_;
  std::string text_;
  std::string columns_;
  int64_t shown_ = 0;
  int64_t refused_ = 0;
  int64_t unlike_ = 0;
  bool closed_ = false;
};

/// Throws ConfigError for a channel or field that the run does not have, before any message comes.
void CheckLive(const LiveRun& live, const EchoOptions& options, EchoOutput* output) {
  for (const Channel& channel : live.spec().graph().channel()) {
    if (channel.name() != options.channel) continue;
    const MessageType& type = *FindMessageType(channel.type());
    output->Check(type, ZeroMessage(type, CountsOf(channel)));
    return;
  }
  const std::vector<std::string> names = live.ChannelNames();
  if (!IsAmong(options.channel, names)) {
    throw ConfigError(fmt::format("run {}: has no channel '{}'; {}", live.spec().run_id(),
                                  options.channel, Suggest(options.channel, names)));
  }
  output->Check(*FindMessageType(health_t::getHash()), MessageBytes(health_t{}));
}

int EchoLive(const EchoOptions& options) {
  LiveRun live(options.run, fmt::format("poise echo {} --log", options.channel),
               fmt::format("poise echo {} --run", options.channel));
  EchoOutput output(options, logging::ElementNames::OfSpec(live.spec()));
  CheckLive(live, options, &output);
  CatchStopSignals(/*interrupt=*/true);
  int64_t last_arrival = NowNanoseconds();
  int64_t newest = -1;
  int64_t missed = 0;
  bool ended = false;
  while (!output.done() && !ended && StopSignal() == 0) {
    // Read before the last look at what has arrived.
    ended = NowNanoseconds() > last_arrival + kEchoSilence && !live.InProgress();
    live.Spin(kSpin, [&](const LiveMessage& message) {
      last_arrival = NowNanoseconds();
      if (message.channel != options.channel) return;
      if (message.index >= 0 && newest >= 0 && message.tick > newest) {
        missed += message.tick - newest - 1;
      }
      newest = std::max(newest, message.tick);
      output.Add(*message.type, message.data, static_cast<double>(last_arrival));
    });
    output.Write();
  }
  output.Summarize();
  if (missed > 0) {
    fmt::print(stderr, "poise: {}: {} messages came too fast for this terminal; the log has them\n",
               options.channel, missed);
  }
  if (!ended) return kExitOk;
  fmt::print(stderr, "poise: run {} has ended\n", live.spec().run_id());
  return output.shown() > 0 ? kExitOk : kExitFailed;
}

int EchoLog(const EchoOptions& options) {
  const std::string path = FindLog(options.log).string();
  logging::LogMessages messages(path, logging::LogMessages::Run::kIfKnown);
  messages.reader().Rewind();  // RUN_INFO is a message too
  logging::LogReader& reader = messages.reader();
  EchoOutput output(options, messages.names());
  std::set<std::string, std::less<>> names;
  logging::LogEvent event;
  while (!output.done() && reader.Next(&event)) {
    if (names.find(event.channel) == names.end()) names.emplace(event.channel);
    if (event.channel != options.channel) continue;
    // The fingerprint tells the type, in logs of other recorders too.
    const MessageType* const type = logging::TypeByFingerprint(event);
    if (type == nullptr) {
      output.AddUnreadable();
    } else {
      output.Add(*type, event.data, static_cast<double>(event.utime) * 1e3);
    }
    if (output.pending() > kLogBuffer) output.Write();
  }
  output.Write();
  if (names.empty()) throw ConfigError(fmt::format("{}: holds no message at all", path));
  if (names.find(options.channel) == names.end()) {
    throw ConfigError(fmt::format("{}: holds no message of channel '{}'; {}", path, options.channel,
                                  Suggest(options.channel, {names.begin(), names.end()})));
  }
  output.Summarize();
  if (reader.damages() > 0) {
    fmt::print(stderr, "poise: {}: damaged in {} places, {} bytes skipped\n", path,
               reader.damages(), reader.skipped_bytes());
  }
  return output.shown() > 0 ? kExitOk : kExitFailed;
}

int Echo(const EchoOptions& options) {
  // A reader that goes away (head) shows as an error of the write.
  signal(SIGPIPE, SIG_IGN);
  return options.log.empty() ? EchoLive(options) : EchoLog(options);
}

}  // namespace

void AddEchoCommand(CLI::App* app, Command* command) {
  const auto [echo, options] = AddCommand<EchoOptions>(
      app, command, "echo", "decoded messages of a channel, of a run in progress or from a log",
      Echo);
  echo->add_option("channel", options->channel, "e.g. ROBOT_STATE, HEALTH_SIM")->required();
  echo->add_option(
      "field", options->fields,
      "by path, of JOINT_COMMAND torque[right_knee_pitch] or torque[3], of "
      "ROBOT_SENSORS foot_wrench[left].force; one line a message. Default: the whole message");
  CLI::Option* run = echo->add_option(
      "--run", options->run, "folder or name of the run; default: the only one that goes on");
  echo->add_option("--log", options->log, "from a log (any LCM log) or a run's folder instead")
      ->excludes(run);
  echo->add_option("--count", options->count, "end after so many messages")
      ->check(CLI::Range(int64_t{1}, INT64_MAX));
  echo->add_option("--rate", options->rate,
                   "at most so many messages a second (of a log: of its time), Hz")
      ->check(Within("in (0, 1e6]", [](double rate) { return rate > 0 && rate <= 1e6; }));
  echo->add_flag("--csv", options->csv, "comma-separated values, with a line of names first");
  SetExample(echo, "poise echo ROBOT_STATE joint_position --log runs/latest --count 3");
}

}  // namespace poise
