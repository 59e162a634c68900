// Runs through EtherCAT frames: the same bits each time, captures that Wireshark reads, troubles.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "logging/metrics/metrics.h"
#include "logging/replay/compare.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

std::vector<std::string> Arguments(const std::string& out, const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {"run",      StandScenario(), "--drives",
                                        "ethercat", "--out",         out};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

std::string OutputOf(const std::string& command) {
  std::string output;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return output;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) {
    output += static_cast<char>(c);
  }
  pclose(pipe);
  return output;
}

TEST(Ethercat, StandsWithTheSameBitsEachTime) {
  const RunFolder folder;
  for (const char* name : {"first", "second"}) {
    const ProgramResult result =
        RunPoise(Arguments(folder / name, {"--capture", (folder / name) + ".pcap"}));
    ASSERT_EQ(result.exit_code, 0) << result.output;
  }
  const logging::LogComparison result =
      logging::CompareLogs((folder / "first") + "/run.lcm", (folder / "second") + "/run.lcm");
  EXPECT_TRUE(result.equal()) << result.earliest->tick << " " << result.earliest->channel << "."
                              << result.earliest->field << ": " << result.earliest->first << " and "
                              << result.earliest->second;
  EXPECT_GT(result.messages, 0);

  if (std::system("tshark --version >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "the capture is not looked at: tshark is not installed; deploy/setup does";
  }
  const std::string read = "tshark -r '" + (folder / "first") + ".pcap' 2>/dev/null";
  EXPECT_EQ(OutputOf(read + " -Y _ws.malformed"), "");
  // Start-up, and two frames there and back in each of the 200 cycles.
  EXPECT_GT(std::atoi(OutputOf(read + " -Y ecat | wc -l").c_str()), 4 * 200);
}

TEST(Ethercat, ATroubleStopsTheRobotAndIsNamedInTheLog) {
  const RunFolder folder;
  const std::string run = folder / "run";
  const ProgramResult result =
      RunPoise(Arguments(run, {"--set", "drive_emulator.trouble[0].kind=STO", "--set",
                               "drive_emulator.trouble[0].joint=left_knee_pitch", "--set",
                               "drive_emulator.trouble[0].from=0.2"}));
  EXPECT_NE(ReadSummary(run)["events"].dump().find("safe torque off (left_knee_pitch)"),
            std::string::npos)
      << result.output;
  const logging::RunRecord record = logging::ReadRun(run + "/run.lcm");
  int64_t stopped = 0;
  while (stopped < record.num_ticks &&
         record.bridge.at(stopped)->state <= bridge_status_t::STATE_RUNNING) {
    ++stopped;
  }
  EXPECT_EQ(stopped, 100);  // 0.2 s
  ASSERT_LT(stopped, record.num_ticks);
  EXPECT_EQ(record.bridge.at(stopped)->reason, bridge_status_t::REASON_DRIVE_STO);
  EXPECT_EQ(
      record.robot.joints()[static_cast<size_t>(record.bridge.at(stopped)->reason_joint)].name,
      "left_knee_pitch");
}

TEST(Ethercat, StandsOverRawEthernet) {
  const std::string veth = POISE_SOURCE_DIR "/deploy/veth";
  if (std::system((veth + " true >/dev/null 2>&1").c_str()) != 0) {
    GTEST_SKIP() << "this system gives no network namespace, or no veth pair";
  }
  const RunFolder folder;
  const std::string output = OutputOf(
      fmt::format("{} {}/poise run {} --drives ethercat --link raw:drives0,drives1 --out {} 2>&1; "
                  "echo exit $?",
                  veth, POISE_BIN_DIR, StandScenario(), folder / "run"));
  EXPECT_NE(output.find("exit 0"), std::string::npos) << output;
}

TEST(Ethercat, ASweepIsOfTheRunsThatPoiseRunMakes) {
  const RunFolder folder;
  const std::string run = folder / "run", sweep = folder / "sweep";
  ASSERT_EQ(RunPoise(Arguments(run, {})).exit_code, 0);
  const ProgramResult result = RunPoise({"sweep", StandScenario(), "--drives", "ethercat", "--vary",
                                         "sim.push[0].peak=20,60", "--column", "bus_frames_sent",
                                         "--column", "push_peak", "--logs", "--out", sweep});
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const std::vector<CsvRow> rows = ReadCsv(sweep + "/table.csv");
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[1].at("outcome"), "stands");
  EXPECT_GT(std::stod(rows[1].at("bus_frames_sent")), 0);
  EXPECT_TRUE(logging::CompareLogs(run + "/run.lcm", sweep + "/logs/1/run.lcm").equal());
  EXPECT_NE(ReadAll(sweep + "/charts.json").find("--drives ethercat"), std::string::npos);
  const ProgramResult pack = RunPoise({"log", "pack", run});
  EXPECT_EQ(pack.exit_code, 1);
  EXPECT_NE(pack.output.find("what passes between bridge and drives"), std::string::npos)
      << pack.output;
}

TEST(Ethercat, RefusesWhatCannotBe) {
  const RunFolder folder;
  ExpectUsageError({"run", StandScenario(), "--drives", "ethercat", "--inline"},
                   {"--inline", "--drives"});
  ExpectUsageError({"run", StandScenario(), "--link", "udp"}, {"--link", "--drives"});
  ExpectUsageError(Arguments(folder / "a", {"--link", "raw:eth0"}), {"--link raw:eth0", "two"});
  ExpectUsageError(Arguments(folder / "a", {"--link", "raw:none0,none1"}),
                   {"--link raw:none0,none1", "no network interface 'none"});
  ExpectUsageError(Arguments(folder / "b", {"--set", "drive_emulator.wiring[0].joint=tail"}),
                   {"drive_emulator.wiring[0].joint", "tail"});
}

}  // namespace
}  // namespace poise
