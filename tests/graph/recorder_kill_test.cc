// A recorder killed at any moment leaves a log that is whole up to shortly before.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <random>

#include "components/framework/clock.h"
#include "components/framework/configuration.h"
#include "components/framework/run.h"
#include "components/framework/udp_bus.h"
#include "fmt/format.h"
#include "logging/log_survey.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

constexpr uintmax_t kUnderWay = 200'000;       // bytes of log: some tens of ticks
constexpr double kPromised = 100;              // ms of wall time that may be lost
constexpr const char* kLast = "GROUND_TRUTH";  // a channel of the graph

/// What the recorder has mirrored: wall time (ns) by tick of one channel.
class Mirror {
 public:
  explicit Mirror(const std::string& run) : receiver_(Url(run)) {}
  void Take() {
    BusReceiver::Packet packet;
    const MessageType& type = *FindMessageType("ground_truth_t");
    while (receiver_.Receive(&packet)) {
      if (packet.channel != kLast) continue;
      seen_.try_emplace(ReadInt64(packet.data + type.run_id_offset + 8), NowNanoseconds());
    }
  }
  size_t size() const { return seen_.size(); }
  /// ms before `end` at which the first tick from `tick` on came; 0 when none has.
  double Since(int64_t tick, int64_t end) const {
    const auto found = seen_.lower_bound(tick);
    if (found == seen_.end()) return 0;
    return std::max(0.0, static_cast<double>(end - found->second) * 1e-6);
  }

 private:
  static std::string Url(const std::string& run) {
    RunSpec spec;
    ReadTextProto(run + "/run_spec.pbtxt", &spec);
    return MirrorUrl(spec);
  }
  BusReceiver receiver_;
  std::map<int64_t, int64_t> seen_;
};

/// Kills the recorder of a run after `delay` ms; the ms of wall time that its log lacks.
double LossAfter(const std::string& run, int delay) {
  PoiseProgram program({"run", StandScenario(), "--out", run, "--duration", "600"});
  EXPECT_TRUE(WaitForLog(run, kUnderWay));
  const pid_t recorder = ComponentProcess(run, "recorder");
  EXPECT_GT(recorder, 0);
  if (recorder <= 0) return 0;
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
  EXPECT_GT(mirror.size(), 10u);  // else the loss would be none whatever happened
  const ProgramResult check = RunPoise({"log", "check", run});
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_NE(check.output.find("no component's end is in the log"), std::string::npos)
      << check.output;
  return mirror.Since(whole, killed);
}

TEST(RecorderKill, LogIsWholeUpToTheLastFlush) {
  // POISE_RECORDER_KILLS=20 asks for that many and holds the recorder to what it promises, which a
  // machine that is busy with other tests may not let it keep.
  const char* const asked = std::getenv("POISE_RECORDER_KILLS");
  const int kills = asked != nullptr ? std::atoi(asked) : 2;
  ASSERT_GT(kills, 0);
  const RunFolder folder;
  std::mt19937 random(static_cast<unsigned>(NowNanoseconds()));
  double worst = 0;
  for (int i = 0; i < kills; ++i) {
    SCOPED_TRACE(i);
    const int delay = std::uniform_int_distribution<int>(50, 500)(random);
    worst = std::max(worst, LossAfter(folder / fmt::format("run{}", i), delay));
  }
  fmt::print("{} recorders killed; at most the last {:.1f} ms of wall time lost\n", kills, worst);
  if (asked != nullptr) {
    EXPECT_LE(worst, kPromised);
  }
}

}  // namespace
}  // namespace poise
