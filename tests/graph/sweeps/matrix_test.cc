// `poise matrix`: what it prints, its CSV, its exit code.
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "tests/graph/poise_program.h"

namespace poise {
namespace {

using Row = CsvRow;

class MatrixTest : public testing::Test {
 protected:
  MatrixTest() {
    setenv("COLUMNS", "200", 1);  // the tables' columns side by side
    // The variant's push of 382 N s is ten times what a robot of this size can stand
    // (fall_test.cc).
    deploy_.Scenario("pushed",
                     "base: \"base/stand\" name: \"pushed\" paper_section: \"7.2\" duration: 0.5\n"
                     "description: \"Two, \\\"quoted\\\"\"\n"
                     "check { metric: \"push_peak\" at_most: 70 label: \"push, largest\""
                     "        paper: \"60 N\" paper_value: 60 }\n"
                     "variant { name: \"felled\" set: \"sim.push[0].peak=2000\"\n"
                     "  set: \"sim.push[0].duration=0.3\" set: \"duration=1.5\" }\n");
    deploy_.Scenario("quiet",
                     "base: \"base/stand\" name: \"quiet\" paper_section: \"7.1\" duration: 0.2\n");
  }

  ~MatrixTest() override { unsetenv("COLUMNS"); }

  TestDeploy deploy_;
};

TEST_F(MatrixTest, HasEveryCheckOfEveryRun) {
  const std::string out = deploy_ / "matrix";
  const ProgramResult result = RunPoise({"matrix", "--jobs", "2", "--out", out});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  const std::vector<Row> rows = ReadCsv(out + "/matrix.csv");
  std::map<std::string, std::vector<Row>> cells;
  for (const Row& row : rows) {
    cells[row.at("scenario") + " " + row.at("ablation") + " " + row.at("variant")].push_back(row);
  }
  ASSERT_EQ(cells.size(), 11u) << result.output;  // 5 of each scenario and a variant
  EXPECT_EQ(rows.front().at("scenario"), "quiet");
  EXPECT_EQ(rows.back().at("variant"), "felled");
  for (const auto& [name, cell] : cells) {
    const bool pushed = name.starts_with("pushed");
    const bool felled = name == "pushed full felled";
    EXPECT_EQ(cell.size(), pushed ? 9u : 8u) << name;  // five of every run, three of base/stand
    EXPECT_EQ(cell[0].at("paper_section"), pushed ? "7.2" : "7.1");
    EXPECT_EQ(cell[0].at("outcome").substr(0, 4), felled ? "fell" : "stan") << name;
    EXPECT_EQ(cell[0].at("fell_at").empty(), !felled) << name;
    if (felled) {
      EXPECT_EQ(cell[0].at("passed"), "false");
    }
  }
  // A run's figures are those of its summary.
  const std::string run = out + "/pushed/without_balancing";
  const nlohmann::json checks = ReadSummary(run)["checks"];
  const std::vector<Row>& cell = cells.at("pushed without_balancing ");
  ASSERT_EQ(checks.size(), cell.size());
  for (size_t i = 0; i < cell.size(); ++i) {
    EXPECT_EQ(cell[i].at("metric"), checks[i]["name"].get<std::string>());
    EXPECT_EQ(cell[i].at("label"), checks[i]["label"].get<std::string>());
    EXPECT_EQ(std::stod(cell[i].at("measured")), checks[i]["measured"].get<double>());
    EXPECT_EQ(cell[i].at("check_passed"), checks[i]["passed"].get<bool>() ? "true" : "false");
  }
  EXPECT_EQ(cell.back().at("label"), "push, largest");
  EXPECT_EQ(cell.back().at("paper"), "60 N");
  EXPECT_EQ(cell.back().at("paper_value"), "60");
  EXPECT_EQ(ReadSummary(run)["ablations"], nlohmann::json::array({"--without balancing"}));

  const nlohmann::json charts = nlohmann::json::parse(std::ifstream(out + "/charts.json"));
  ASSERT_EQ(charts["parts"].size(), 3u);
  const nlohmann::json& overview = charts["parts"][0];
  EXPECT_EQ(overview["variables"][1]["choices"], nlohmann::json({"quiet", "pushed"}));
  EXPECT_EQ(overview["rows"].size(), 10u);
  const nlohmann::json& figures = charts["parts"][2];
  EXPECT_EQ(figures["values"][0]["label"], "push, largest");
  EXPECT_EQ(figures["values"][0]["paper"], 60);
  ASSERT_EQ(figures["rows"].size(), 6u);
  EXPECT_EQ(figures["rows"][5]["outcome"], "fell");
  EXPECT_EQ(figures["rows"][1]["values"][0], std::stod(cell.back().at("measured")));
  EXPECT_EQ(figures["rows"][1]["log"], "pushed/without_balancing");
  EXPECT_NE(figures["rows"][1]["set"].get<std::string>().find(" --inline --without balancing"),
            std::string::npos);

  EXPECT_NE(result.output.find("7.2  pushed: Two, \"quoted\"\n"), std::string::npos)
      << result.output;
  EXPECT_NE(result.output.find("without balancing  without redistribution  without transition  "
                               "ideal"),
            std::string::npos)
      << result.output;
  EXPECT_NE(result.output.find("variant felled"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("fell at"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("push, largest  60 N"), std::string::npos) << result.output;
}

TEST_F(MatrixTest, MarksWhatFailedWhereItIsShown) {
  deploy_.Scenario("marks",
                   "base: \"base/stand\" name: \"marks\" duration: 0.3\n"
                   "check { metric: \"push_peak\" label: \"upper\" paper: \"1 N\" }\n"
                   "check { metric: \"push_peak\" label: \"lower\" paper: \"2 N\" }\n"
                   "variant { name: \"unseen\" check { metric: \"push_peak\" at_most: 1 } }\n"
                   "variant { name: \"seen\" check { metric: \"push_peak\" label: \"upper\""
                   " at_most: 1 } }\n");
  const ProgramResult result =
      RunPoise({"matrix", "marks", "--ablation", "full", "--out", deploy_ / "matrix"});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  std::map<std::string, std::vector<std::string>> rows;  // by their first word
  std::istringstream lines(result.output);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string first;
    words >> first;
    for (std::string word; words >> word;) rows[first].push_back(word);
  }
  using Words = std::vector<std::string>;
  EXPECT_EQ(rows["outcome"], (Words{"stands", "stands", "!", "stands"})) << result.output;
  // Columns: the paper's figure, full, unseen, seen, and only `seen` has a check of this label.
  const Words upper = rows["upper"], lower = rows["lower"];
  ASSERT_EQ(upper.size(), 8u) << result.output;
  EXPECT_EQ((Words{upper[0], upper[1], upper[3], upper[4], upper[6], upper[7]}),
            (Words{"1", "N", "N", "–", "N", "!"}));
  ASSERT_EQ(lower.size(), 6u) << result.output;
  EXPECT_EQ((Words{lower[4], lower[5]}), (Words{"–", "–"}));
  EXPECT_NE(result.output.find("\n–: not judged"), std::string::npos) << result.output;
}

TEST_F(MatrixTest, FailsWhenAnExperimentItselfFails) {
  deploy_.Scenario("bad",
                   "base: \"base/stand\" name: \"bad\" duration: 0.2\n"
                   "check { metric: \"balancing_activations\" at_least: 1000 }\n");
  const std::string out = deploy_ / "matrix";
  const ProgramResult full = RunPoise({"matrix", "bad", "--ablation", "full", "--out", out});
  EXPECT_EQ(full.exit_code, 1) << full.output;
  EXPECT_NE(full.output.find("bad/full failed"), std::string::npos) << full.output;
  // In an ablation the same is a result.
  const ProgramResult ideal =
      RunPoise({"matrix", "bad", "--ablation", "ideal", "--force", "--out", out});
  EXPECT_EQ(ideal.exit_code, 0) << ideal.output;
  for (const Row& row : ReadCsv(out + "/matrix.csv")) EXPECT_EQ(row.at("ablation"), "ideal");
}

TEST_F(MatrixTest, ARunThatCannotBeMadeIsNamedAndTheOthersGoOn) {
  const std::string out = deploy_ / "matrix";
  std::filesystem::create_directories(out + "/quiet");
  std::ofstream(out + "/quiet/ideal") << "a file where the run's folder should be";
  const ProgramResult result = RunPoise(
      {"matrix", "quiet", "--ablation", "full", "--ablation", "ideal", "--force", "--out", out});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_NE(result.output.find("quiet/ideal could not be run: "), std::string::npos)
      << result.output;
  const std::vector<Row> rows = ReadCsv(out + "/matrix.csv");
  ASSERT_EQ(rows.size(), 9u);
  EXPECT_EQ(rows[0].at("outcome"), "stands");
  EXPECT_EQ(rows[8].at("ablation"), "ideal");
  EXPECT_NE(rows[8].at("outcome").find("could not be run: exited with code 2"), std::string::npos);
  EXPECT_EQ(rows[8].at("metric"), "");
}

TEST_F(MatrixTest, WrongUsageRunsNothing) {
  const std::string out = deploy_ / "matrix";
  ExpectUsageError({"matrix", "nothing", "--out", out}, {"nothing", "pushed"});
  ExpectUsageError({"matrix", "--ablation", "half", "--out", out}, {"half", "without_balancing"});
  ExpectUsageError({"matrix", "--jobs", "0", "--out", out}, {"--jobs"});
  deploy_.Scenario("wrong",
                   "base: \"base/stand\"\nvariant { name: \"v\"\n set: \"duration=0\" }\n");
  ExpectUsageError({"matrix", "wrong", "--out", out}, {"wrong.pbtxt:3: variant[0].set[0]"});
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(MatrixTest, AnInterruptEndsAndRemovesWhatRuns) {
  deploy_.Scenario("long", "base: \"base/stand\" name: \"long\" duration: 1000\n");
  const std::string out = deploy_ / "matrix";
  PoiseProgram program(
      {"matrix", "quiet", "long", "--ablation", "full", "--jobs", "1", "--out", out});
  // One at a time: the first is done when the second has begun.
  ASSERT_TRUE(WaitForLog(out + "/long/full", 100'000));
  kill(program.pid(), SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_NE(result.output.find("interrupted; 1 of 2 runs were done"), std::string::npos)
      << result.output;
  EXPECT_TRUE(ProcessesWith(out).empty());
  EXPECT_FALSE(std::filesystem::exists(out + "/long/full"));
  EXPECT_TRUE(std::filesystem::exists(out + "/quiet/full/summary.json"));
}

TEST_F(MatrixTest, AnInterruptLeavesLatestOnTheRunBefore) {
  deploy_.Scenario("long", "base: \"base/stand\" name: \"long\" duration: 1000\n");
  ASSERT_EQ(RunPoise({"run", "quiet", "--inline", "--quiet"}).exit_code, 0);
  PoiseProgram program({"matrix", "long", "--ablation", "full"});
  const std::string runs = deploy_.runs();
  ASSERT_TRUE(WaitUntil([&] {
    for (const auto& entry : std::filesystem::directory_iterator(runs)) {
      if (std::filesystem::exists(entry.path() / "long/full/run.lcm")) return true;
    }
    return false;
  }));
  kill(program.pid(), SIGINT);
  EXPECT_EQ(program.Wait().exit_code, 1);
  EXPECT_EQ(ReadSummary(runs + "/latest")["scenario"], "quiet");
}

}  // namespace
}  // namespace poise
