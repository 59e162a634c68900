// Every message of the recorded runs has the recorded bits, on any machine of the same instruction
// set.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/graph/poise_program.h"

namespace poise {
namespace {

constexpr int kExitOtherBuild = 3;  // of `poise bits`

nlohmann::json Record() {
  std::ifstream file(std::string(POISE_SOURCE_DIR) + "/deploy/bits/record.json");
  return nlohmann::json::parse(file);
}

std::vector<std::string> Names() {
  std::vector<std::string> names;
  const nlohmann::json record = Record();
  for (const auto& run : record["runs"]) names.push_back(run["name"]);
  return names;
}

class RecordedRun : public testing::TestWithParam<std::string> {};

TEST_P(RecordedRun, HasTheRecordedBits) {
  const ProgramResult result = RunPoise({"bits", GetParam()});
  if (result.exit_code == kExitOtherBuild) {
    GTEST_SKIP() << "the record is of another build\n" << result.output;
  }
  EXPECT_EQ(result.exit_code, 0) << result.output;
}

INSTANTIATE_TEST_SUITE_P(Runs, RecordedRun, testing::ValuesIn(Names()),
                         [](const auto& run) { return run.param; });

TEST(RecordedBits, HoldEveryExperimentOfThePaper) {
  const nlohmann::json record = Record();
  std::vector<std::string> recorded;
  for (const auto& run : record["runs"]) recorded.push_back(run["scenario"]);
  EXPECT_THAT(recorded, testing::IsSupersetOf(Experiments()));
}

TEST(RecordedBits, OfAnotherRunDiffer) {
  // A record with one bit changed: the tick and the channel are named.
  const TestDeploy deploy;
  const std::string bits = deploy / "deploy/bits";
  std::filesystem::create_directories(bits);
  deploy.Scenario("stand_again", "base: \"base/stand\"\n");
  std::ofstream(bits + "/record.json")
      << R"({"runs": [{"name": "stand", "scenario": "stand_again"}]})";
  const ProgramResult recording = RunPoise({"bits", "--record"});
  ASSERT_EQ(recording.exit_code, 0) << recording.output;
  EXPECT_EQ(RunPoise({"bits"}).exit_code, 0);
  const nlohmann::json record = nlohmann::json::parse(ReadAll(bits + "/record.json"));
  std::istringstream words(record["runs"][0]["channels"][2].get<std::string>());
  std::string sum, channel;
  size_t ticks = 0;
  words >> sum >> ticks >> channel;
  std::string bytes = ReadAll(bits + "/stand.bytes");
  bytes[2 * ticks + 17] = static_cast<char>(bytes[2 * ticks + 17] ^ 1);  // the third channel's
  std::ofstream(bits + "/stand.bytes", std::ios::binary) << bytes;
  const ProgramResult result = RunPoise({"bits"});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_NE(result.output.find("first at tick 17, " + channel), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("recorded with instruction set "), std::string::npos);
}

}  // namespace
}  // namespace poise
