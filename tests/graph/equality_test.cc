// The same scenario gives the same messages, bit for bit, however it runs.
#include <gtest/gtest.h>

#include <bit>

#include "logging/metrics/metrics.h"
#include "logging/replay/compare.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

constexpr int64_t kTicks = 200;    // of the scenario: 0.4 s at 500 Hz
constexpr int64_t kChannels = 13;  // of the graph, external ones aside

std::string LogOf(const std::string& out, const std::vector<std::string>& flags) {
  std::vector<std::string> arguments = {"run", StandScenario(), "--out", out};
  arguments.insert(arguments.end(), flags.begin(), flags.end());
  const ProgramResult result = RunPoise(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.output;
  return out + "/run.lcm";
}

void ExpectEqual(const std::string& first, const std::string& second) {
  const logging::LogComparison result = logging::CompareLogs(first, second);
  EXPECT_TRUE(result.equal()) << result.earliest->tick << " " << result.earliest->channel << "."
                              << result.earliest->field << ": " << result.earliest->first << " and "
                              << result.earliest->second;
  EXPECT_EQ(result.ticks, kTicks);
  EXPECT_EQ(result.messages, kTicks * kChannels);
}

TEST(Equality, ProcessesGiveWhatOneProcessGives) {
  const RunFolder folder;
  const std::string inside = LogOf(folder / "inline", {"--inline"});
  const std::string processes = LogOf(folder / "processes", {});
  ExpectEqual(inside, processes);

  // Every tick's message of every channel is in the log, once, in order.
  const logging::RunRecord record = logging::ReadRun(processes);
  ASSERT_EQ(static_cast<int64_t>(record.channels.size()), kChannels);
  for (const logging::ChannelCompleteness& channel : record.channels) {
    EXPECT_EQ(channel.messages, kTicks) << channel.name;
    EXPECT_EQ(channel.missing + channel.duplicate + channel.out_of_order + channel.refused, 0)
        << channel.name;
  }
}

TEST(Equality, AHostedControllerGivesTheSame) {
  const RunFolder folder;
  const std::string inside = LogOf(folder / "inline", {"--inline"});
  const std::string hosted = LogOf(folder / "hosted", {"--hosted"});
  ExpectEqual(inside, hosted);
  ExpectEqual(inside, LogOf(folder / "losses", {"--hosted", "--drop", "0.05"}));
  // The monitor in between stays outside: the process waits for it within the tick.
  ExpectEqual(inside, LogOf(folder / "around", {"--host", "torque=task_controller,redistributor",
                                                "--host", "front=state_estimator,step_planner"}));
  // The log knows, and holds the health of each component.
  const logging::RunRecord record = logging::ReadRun(hosted);
  int shared = 0;
  for (const ComponentInstance& instance : record.spec.graph().component()) {
    shared += instance.process() == "controller" ? 1 : 0;
    EXPECT_TRUE(record.health.contains(instance.name())) << instance.name();
  }
  EXPECT_EQ(shared, 5);
  const ProgramResult replay = RunPoise({"replay", folder / "hosted"});
  EXPECT_EQ(replay.exit_code, 0) << replay.output;
}

/// A log that stays on the disk answers every metric as one in memory does, bit for bit.
void ExpectSameMetricsPaged(const std::string& log) {
  const logging::RunRecord held = logging::ReadRun(log);
  const logging::RunRecord paged = logging::ReadRun(log, 0);
  ASSERT_TRUE(paged.paged && !held.paged);
  int answered = 0;
  for (const logging::Metric& metric : logging::Metrics()) {
    const logging::Answer a = metric.compute(held), b = metric.compute(paged);
    ASSERT_EQ(a.has_value(), b.has_value()) << metric.name;
    if (!a) continue;
    ++answered;
    EXPECT_EQ(std::bit_cast<uint64_t>(*a), std::bit_cast<uint64_t>(*b)) << metric.name;
  }
  EXPECT_GT(answered, 60);
}

TEST(Equality, EveryExperimentOfThePaperIsTheSameAsProcessesHostedAndInOneProcess) {
  const std::vector<std::string> experiments = Experiments();
  ASSERT_GE(experiments.size(), 5u);
  for (const std::string& experiment : experiments) {
    SCOPED_TRACE(experiment);
    const RunFolder folder;
    // Side by side; whether the checks hold is the scenario's concern.
    PoiseProgram inside(
        {"run", experiment, "--inline", "--quiet", "--no-reference", "--out", folder / "inline"});
    PoiseProgram processes(
        {"run", experiment, "--quiet", "--no-reference", "--out", folder / "processes"});
    EXPECT_GE(inside.Wait().exit_code, 0);
    EXPECT_GE(processes.Wait().exit_code, 0);
    RunPoise(
        {"run", experiment, "--hosted", "--quiet", "--no-reference", "--out", folder / "hosted"});
    EXPECT_TRUE(logging::CompareLogs(folder / "inline/run.lcm", folder / "hosted/run.lcm").equal());
    const logging::LogComparison result =
        logging::CompareLogs(folder / "inline/run.lcm", folder / "processes/run.lcm");
    EXPECT_TRUE(result.equal()) << (result.earliest ? result.earliest->channel : "");
    ExpectSameMetricsPaged(folder / "inline/run.lcm");
    const nlohmann::json summary = ReadSummary(folder / "processes");
    EXPECT_EQ(result.ticks, summary["ticks"].get<int64_t>());
    EXPECT_EQ(result.messages, result.ticks * kChannels);
  }
}

TEST(Equality, TwoRunsAreEqual) {
  const RunFolder folder;
  ExpectEqual(LogOf(folder / "a", {"--inline"}), LogOf(folder / "b", {"--inline"}));
  ExpectEqual(LogOf(folder / "c", {}), LogOf(folder / "d", {}));
}

TEST(Equality, DroppedMessagesAreRecovered) {
  const RunFolder folder;
  const std::string inside = LogOf(folder / "inline", {"--inline"});
  const std::string dropping = LogOf(folder / "drop", {"--drop", "0.05"});
  ExpectEqual(inside, dropping);
  int64_t dropped = 0;
  int64_t gaps = 0;
  const nlohmann::json summary = ReadSummary(folder / "drop");
  for (const nlohmann::json& component : summary["components"]) {
    dropped += component["dropped"].get<int64_t>();
    gaps += component["gaps"].get<int64_t>();
  }
  EXPECT_GT(dropped, 20);  // of some 2400 that are received
  EXPECT_GE(gaps, 20);
}

TEST(Equality, AnotherSeedIsAnotherRun) {
  const RunFolder folder;
  const logging::LogComparison result = logging::CompareLogs(
      LogOf(folder / "a", {"--inline"}), LogOf(folder / "b", {"--inline", "--seed", "2"}));
  EXPECT_GT(result.differing, 0);
}

TEST(Equality, SummaryHoldsEveryRowOfTheTable) {
  const RunFolder folder;
  LogOf(folder / "run", {"--inline"});
  const nlohmann::json summary = ReadSummary(folder / "run");
  EXPECT_EQ(summary["scenario"], "stand");
  EXPECT_EQ(summary["mode"], "inline");
  EXPECT_TRUE(summary["passed"].get<bool>());
  EXPECT_TRUE(summary["run_id"].is_number_integer());
  EXPECT_TRUE(summary["versions"].contains("lcm"));
  ASSERT_EQ(summary["checks"].size(), 8u);  // five of every run, three of the scenario
  for (const nlohmann::json& check : summary["checks"]) {
    for (const char* field : {"name", "measured", "unit", "limit", "paper", "passed"}) {
      EXPECT_TRUE(check.contains(field)) << check << field;
    }
    EXPECT_TRUE(check["passed"].get<bool>()) << check;
  }
}

}  // namespace
}  // namespace poise
