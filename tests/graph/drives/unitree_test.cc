// Runs through DDS, with an emulated robot: the same bits each time, troubles, G1.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "logging/metrics/metrics.h"
#include "logging/replay/compare.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

std::vector<std::string> UnitreeArguments(const std::string& out,
                                          const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {"run",     StandScenario(), "--drives",
                                        "unitree", "--out",         out};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

TEST(Unitree, StandsWithTheSameBitsEachTime) {
  const RunFolder folder;
  for (const char* name : {"first", "second"}) {
    const ProgramResult result = RunPoise(UnitreeArguments(folder / name, {}));
    ASSERT_EQ(result.exit_code, 0) << result.output;
  }
  const logging::LogComparison result =
      logging::CompareLogs((folder / "first") + "/run.lcm", (folder / "second") + "/run.lcm");
  EXPECT_TRUE(result.equal()) << result.earliest->tick << " " << result.earliest->channel << "."
                              << result.earliest->field << ": " << result.earliest->first << " and "
                              << result.earliest->second;
  EXPECT_GT(result.messages, 0);
}

TEST(Unitree, TheRemotesButtonStopsTheRobotAndIsNamedInTheLog) {
  const RunFolder folder;
  const std::string run = folder / "run";
  const ProgramResult result =
      RunPoise(UnitreeArguments(run, {"--set", "unitree_emulator.trouble[0].kind=BUTTON", "--set",
                                      "unitree_emulator.trouble[0].button[0]=B", "--set",
                                      "unitree_emulator.trouble[0].from=0.2"}));
  EXPECT_NE(ReadSummary(run)["events"].dump().find("remote's stop button"), std::string::npos)
      << result.output;
  const logging::RunRecord record = logging::ReadRun(run + "/run.lcm");
  int64_t stopped = 0;
  while (stopped < record.num_ticks &&
         record.bridge.at(stopped)->state <= bridge_status_t::STATE_RUNNING) {
    ++stopped;
  }
  EXPECT_EQ(stopped, 100);  // 0.2 s
}

/// A folder with the maker's file of the G1 and the texts that go with it; empty: it is not there.
std::string G1Folder(const RunFolder& folder) {
  const char* const given = std::getenv("POISE_ROBOTS");
  const std::filesystem::path robots =
      given != nullptr ? given : POISE_SOURCE_DIR "/../shared/robots";
  const std::filesystem::path urdf = robots / "g1_29dof_rev_1_0.urdf";
  if (!std::filesystem::exists(urdf)) return {};
  const std::filesystem::path g1 = folder / "g1";
  std::filesystem::create_directories(g1);
  std::filesystem::copy_file(urdf, g1 / urdf.filename());
  for (const char* text : {"g1.pbtxt", "g1_23.pbtxt"}) {
    std::filesystem::copy_file(std::string(POISE_SOURCE_DIR "/deploy/robots/g1/") + text,
                               g1 / text);
  }
  return g1.string();
}

class UnitreeG1 : public testing::TestWithParam<const char*> {};

TEST_P(UnitreeG1, Stands) {
  const RunFolder folder;
  const std::string g1 = G1Folder(folder);
  if (g1.empty()) {
    GTEST_SKIP() << "g1_29dof_rev_1_0.urdf is not there: the maker's file is not part of Poise";
  }
  const ProgramResult result =
      RunPoise({"run", "stand", "--robot", g1 + "/" + GetParam(), "--world", "mujoco", "--drives",
                "unitree", "--duration", "1", "--out", folder / "run"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
}

INSTANTIATE_TEST_SUITE_P(Joints, UnitreeG1, testing::Values("g1.pbtxt", "g1_23.pbtxt"),
                         [](const auto& each) {
                           return std::string(each.param).find("23") == std::string::npos
                                      ? "TwentyNine"
                                      : "TwentyThree";
                         });

TEST(Unitree, RefusesWhatCannotBe) {
  const RunFolder folder;
  ExpectUsageError({"run", StandScenario(), "--drives", "unitree", "--inline"},
                   {"--inline", "--drives"});
  ExpectUsageError(UnitreeArguments(folder / "a", {"--link", "udp"}), {"--link", "no frames"});
  ExpectUsageError(UnitreeArguments(folder / "b", {"--capture", folder / "c.pcap"}),
                   {"--capture", "no frames"});
  ExpectUsageError(
      UnitreeArguments(folder / "d", {"--set", "hw_bridge.unitree.slot[0].joint=tail"}),
      {"hw_bridge.unitree", "tail"});
}

}  // namespace
}  // namespace poise
