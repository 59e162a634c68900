// A recorder killed at any moment leaves a log that is whole up to shortly before.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <random>

#include "components/framework/bus/udp_bus.h"
#include "components/framework/clock.h"
#include "components/framework/configuration.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/log_survey.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

constexpr double kPromised = 100;  // ms that may be lost

/// What the recorder has mirrored, a message after it was handed to the log.
class Mirror {
 public:
  explicit Mirror(const std::string& run) : receiver_(Open(run, &spec_)) {
    for (const Channel& channel : spec_.graph().channel()) {
      if (!channel.external()) newest_[channel.name()] = -1;
    }
  }
  void Take() {
    BusReceiver::Packet packet;
    while (receiver_.Receive(&packet)) {
      const auto channel = newest_.find(packet.channel);
      if (channel == newest_.end()) continue;
      const MessageType& type = *FindMessageType(ReadInt64(packet.data));
      channel->second = ReadInt64(packet.data + type.run_id_offset + 8);
      seen_.try_emplace(CompleteTicks(), NowNanoseconds());
    }
  }
  /// Ticks of which it has mirrored every channel's message (they come in order).
  int64_t CompleteTicks() const {
    int64_t least = INT64_MAX;
    for (const auto& [name, tick] : newest_) least = std::min(least, tick + 1);
    return least;
  }
  /// ms before `end` at which tick `tick` was complete; 0 when it never was.
  double Since(int64_t tick, int64_t end) const {
    const auto found = seen_.lower_bound(tick + 1);
    if (found == seen_.end()) return 0;
    return std::max(0.0, static_cast<double>(end - found->second) * 1e-6);
  }
  double tick_period() const { return spec_.tick_period(); }

 private:
  static std::string Open(const std::string& run, RunSpec* spec) {
    ReadTextProto(run + "/run_spec.pbtxt", spec);
    return MirrorUrl(*spec);
  }
  RunSpec spec_;
  BusReceiver receiver_;
  std::map<std::string, int64_t, std::less<>> newest_;  // tick by channel
  std::map<int64_t, int64_t> seen_;                     // ns by complete ticks
};

struct Loss {
  int64_t ticks = 0;     ///< that the log lacks of those that the recorder had whole
  double recorded = 0;   ///< ms of the run, the same
  double wall_time = 0;  ///< ms
};

/// Kills the recorder of a run after `delay` ms; what its log lacks.
Loss LossAfter(const std::string& run, int delay) {
  PoiseProgram program({"run", StandScenario(), "--out", run, "--duration", "600"});
  EXPECT_TRUE(WaitForLog(run, kUnderWay));
  const pid_t recorder = ComponentProcess(run, "recorder");
  EXPECT_GT(recorder, 0);
  if (recorder <= 0) return {};
  Mirror mirror(run);
  const int64_t end = NowNanoseconds() + delay * int64_t{1'000'000};
  while (NowNanoseconds() < end) {
    mirror.Take();
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  mirror.Take();
  const int64_t killed = NowNanoseconds();
  kill(recorder, SIGKILL);
  const ProgramResult result = program.Wait();
  mirror.Take();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.output.find("recorder was ended by signal 9 (Killed)"), std::string::npos)
      << result.output;

  // Readable, nothing lacks before its end, at most one event is cut there.
  const logging::LogSurvey survey = logging::SurveyLog(run + "/run.lcm");
  EXPECT_EQ(survey.info_problem, "");
  EXPECT_LE(survey.damage.size(), 1u);
  for (const logging::DamageSurvey& damage : survey.damage) EXPECT_FALSE(damage.after);
  int64_t whole = survey.end_tick;  // ticks with the messages of all channels
  for (const logging::ChannelSurvey& channel : survey.channels) {
    if (channel.external) continue;
    EXPECT_EQ(channel.ticks.refused + channel.ticks.duplicate + channel.ticks.out_of_order, 0);
    for (const logging::TickRange& range : channel.missing) {
      EXPECT_EQ(range.first, survey.end_tick - 1) << channel.ticks.name;
      whole = std::min(whole, range.first);
    }
  }
  EXPECT_GT(whole, 10);
  EXPECT_GT(mirror.CompleteTicks(), 10);  // else the loss would be none whatever happened
  const ProgramResult check = RunPoise({"log", "check", run});
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_NE(check.output.find("no component's end is in the log"), std::string::npos)
      << check.output;
  Loss loss;
  loss.ticks = std::max<int64_t>(0, mirror.CompleteTicks() - whole);
  loss.recorded = 1e3 * mirror.tick_period() * static_cast<double>(loss.ticks);
  loss.wall_time = mirror.Since(whole, killed);
  return loss;
}

TEST(RecorderKill, LogIsWholeUpToTheLastFlush) {
  // POISE_RECORDER_KILLS=20 asks for that many and holds the recorder to wall time too, which a
  // machine that is busy with other tests may not let it keep.
  const char* const asked = std::getenv("POISE_RECORDER_KILLS");
  const int kills = asked != nullptr ? std::atoi(asked) : 2;
  ASSERT_GT(kills, 0);
  const RunFolder folder;
  std::mt19937 random(static_cast<unsigned>(NowNanoseconds()));
  Loss worst;
  for (int i = 0; i < kills; ++i) {
    SCOPED_TRACE(i);
    const int delay = std::uniform_int_distribution<int>(50, 500)(random);
    const Loss loss = LossAfter(folder / fmt::format("run{}", i), delay);
    EXPECT_LE(loss.recorded, kPromised) << loss.ticks << " ticks";
    worst.ticks = std::max(worst.ticks, loss.ticks);
    worst.wall_time = std::max(worst.wall_time, loss.wall_time);
  }
  fmt::print("{} recorders killed; at most the last {} ticks and {:.1f} ms of wall time lost\n",
             kills, worst.ticks, worst.wall_time);
  if (asked != nullptr) {
    EXPECT_LE(worst.wall_time, kPromised);
  }
}

}  // namespace
}  // namespace poise
