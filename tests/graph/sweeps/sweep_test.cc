// `poise sweep` and `poise limit`: the same table however it is made, and what is refused.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <set>

#include "tests/graph/poise_program.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

class SweepTest : public testing::Test {
 protected:
  SweepTest() {
    deploy_.Scenario("pushed",
                     "base: \"base/stand\" name: \"pushed\" duration: 0.3\n"
                     "check { metric: \"com_error_max_x\" }\n"
                     "check { metric: \"push_peak\" }\n");
    fs::create_directories(deploy_ / "deploy/sweeps");
    Sweep("tiny",
          "scenario: \"pushed\"\n"
          "vary { name: \"direction\" from: 0 to: 360 steps: 4 angle: true }\n"
          "vary { name: \"force\" field: \"sim.push[0].peak\" unit: \"N\" value: 20 value: 60 }\n"
          "assign { field: \"sim.push[0].direction_x\" value: \"cos(direction*deg)\" }\n"
          "assign { field: \"sim.push[0].direction_y\" value: \"sin(direction*deg)\" }\n");
  }
  std::string Sweep(const std::string& name, const std::string& text) const {
    const std::string file = deploy_ / ("deploy/sweeps/" + name + ".pbtxt");
    std::ofstream(file) << text;
    return file;
  }
  std::string Out(const std::string& name) const { return deploy_ / name; }
  static std::string Table(const std::string& folder) {
    return ReadAll(fs::path(folder) / "table.csv");
  }
  static void Expect(int exit_code, const std::vector<std::string>& arguments) {
    const ProgramResult result = RunPoise(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.output;
  }

  TestDeploy deploy_;
};

TEST_F(SweepTest, ARowIsWhatTheRunByItselfGives) {
  const std::string out = Out("sweep");
  Expect(0, {"sweep", "tiny", "--jobs", "2", "--column", "all", "--out", out});
  const std::vector<CsvRow> rows = ReadCsv(out + "/table.csv");
  ASSERT_EQ(rows.size(), 8u);
  const CsvRow& row = rows[7];
  EXPECT_EQ(row.at("run"), "7");
  EXPECT_EQ(row.at("direction"), "270");
  EXPECT_EQ(row.at("force"), "60");
  EXPECT_EQ(row.at("outcome"), "stands");
  EXPECT_EQ(row.at("fell_at"), "");
  EXPECT_EQ(std::stod(row.at("ended_at")), 0.3);
  EXPECT_EQ(row.at("phase"), "stand");
  // The table's figures come from memory, those of poise run from its log.
  const double angle = 270 * std::numbers::pi / 180;
  int at = 5;  // after the base's and its own
  std::vector<std::string> arguments = {
      "run",      "pushed",
      "--inline", "--quiet",
      "--out",    Out("run"),
      "--set",    "sim.push[0].peak=60",
      "--set",    "sim.push[0].direction_x=" + nlohmann::json(std::cos(angle)).dump(),
      "--set",    "sim.push[0].direction_y=" + nlohmann::json(std::sin(angle)).dump()};
  for (const auto& [name, value] : row) {
    const bool metric =
        !std::set<std::string>{"run",   "direction", "force",     "outcome", "fell_at", "ended_at",
                               "phase", "trouble",   "component", "stage",   "reason"}
             .contains(name);
    if (!metric) continue;
    arguments.insert(arguments.end(),
                     {"--set", "check[" + std::to_string(at++) + "].metric=" + name});
  }
  const ProgramResult run = RunPoise(arguments);
  int compared = 0;
  const nlohmann::json summary = ReadSummary(Out("run"));
  for (const nlohmann::json& check : summary["checks"]) {
    const auto cell = row.find(check["name"].get<std::string>());
    if (cell == row.end()) continue;
    ++compared;
    if (check["measured"].is_null()) {
      EXPECT_EQ(cell->second, "") << check;
    } else {
      ASSERT_NE(cell->second, "") << check;
      EXPECT_EQ(std::stod(cell->second), check["measured"].get<double>()) << check;
    }
  }
  EXPECT_GT(compared, 40) << run.output;
  EXPECT_TRUE(ReadAll(fs::path(out) / "charts.html").ends_with("</html>\n"));
}

TEST_F(SweepTest, TheTableIsTheSameHoweverItIsMade) {
  Expect(0, {"sweep", "tiny", "--jobs", "1", "--out", Out("one")});
  const std::string table = Table(Out("one"));
  ASSERT_FALSE(table.empty());
  Expect(0, {"sweep", "tiny", "--jobs", "4", "--out", Out("four")});
  EXPECT_EQ(Table(Out("four")), table);
  EXPECT_EQ(ReadAll(fs::path(Out("four")) / "charts.json"),
            ReadAll(fs::path(Out("one")) / "charts.json"));
  // In parts, the last one first.
  std::vector<std::string> merge = {"sweep", "merge", "--out", Out("merged")};
  for (const char* part : {"3/3", "2/3", "1/3"}) {
    const std::string out = Out(std::string("part") + part[0]);
    Expect(0, {"sweep", "tiny", "--part", part, "--out", out});
    EXPECT_NE(Table(out), table);
    merge.push_back(out);
  }
  ExpectUsageError({"sweep", "merge", "--out", Out("some"), Out("part1"), Out("part3")},
                   {"5 of 8 points", "point 2"});
  Expect(0, merge);
  EXPECT_EQ(Table(Out("merged")), table);
  // With logs: figures of the log instead of memory.
  Expect(0, {"sweep", "tiny", "--logs", "--range", "6:8", "--out", Out("logs")});
  EXPECT_EQ(Table(Out("logs")).substr(table.find('\n')), table.substr(table.find("\n6,")));
  Expect(0, {"log", "check", Out("logs") + "/logs/7"});
}

TEST_F(SweepTest, AKilledSweepGoesOnWhereItWas) {
  Expect(0, {"sweep", "tiny", "--out", Out("whole")});
  const std::string out = Out("killed");
  const fs::path results = fs::path(out) / "results.jsonl";
  const auto lines = [&] {
    const std::string text = ReadAll(results);
    return std::count(text.begin(), text.end(), '\n');
  };
  for (const int signal : {SIGKILL, SIGINT}) {
    const auto before = lines();
    PoiseProgram program({"sweep", "tiny", "--resume", "--jobs", "1", "--out", out});
    ASSERT_TRUE(WaitUntil([&] { return lines() >= before + 2; }));
    kill(program.pid(), signal);
    const ProgramResult result = program.Wait();
    EXPECT_EQ(result.exit_code, signal == SIGKILL ? -1 : 1) << result.output;
    EXPECT_FALSE(fs::exists(fs::path(out) / "table.csv"));
    if (signal == SIGINT) {
      EXPECT_NE(result.output.find("--resume --out " + out), std::string::npos) << result.output;
    }
    EXPECT_TRUE(WaitUntil([&] { return ProcessesWith(out).empty(); }));
  }
  ASSERT_LT(lines(), 9);
  std::ofstream(results, std::ios::app) << "{\"run\": 7, \"outc";  // being written at the end
  const std::string kept = ReadAll(results).substr(0, ReadAll(results).rfind('\n') + 1);
  Expect(0, {"sweep", "tiny", "--resume", "--out", out});
  EXPECT_EQ(Table(out), Table(Out("whole")));
  EXPECT_TRUE(ReadAll(results).starts_with(kept));  // no run was repeated
  EXPECT_EQ(lines(), 9);
}

TEST_F(SweepTest, AnotherSweepsFolderIsRefused) {
  const std::string out = Out("sweep");
  Expect(0, {"sweep", "tiny", "--range", "0:1", "--out", out});
  ExpectUsageError({"sweep", "tiny", "--out", out}, {"results.jsonl", "--resume"});
  ExpectUsageError({"sweep", "tiny", "--resume", "--seed", "2", "--out", out}, {"another sweep"});
  ExpectUsageError({"sweep", "tiny", "--resume", "--set", "seed=2", "--out", out},
                   {"another sweep"});
  // What the scenario says, too.
  deploy_.Scenario("pushed",
                   "base: \"base/stand\" name: \"pushed\" duration: 0.32\n"
                   "check { metric: \"com_error_max_x\" }\n"
                   "check { metric: \"push_peak\" }\n");
  ExpectUsageError({"sweep", "tiny", "--resume", "--out", out}, {"another sweep"});
  Expect(0, {"sweep", "pushed", "--vary", "seed=1,2", "--out", Out("other")});
  ExpectUsageError({"sweep", "merge", out, Out("other"), "--out", Out("both")}, {"another sweep"});
}

TEST_F(SweepTest, ASecondSweepIsLaidOverTheFirst) {
  for (const char* out : {"a", "b"}) {
    Expect(0, {"sweep", "pushed", "--vary", "sim.push[0].peak=20,40", "--logs", "--out", Out(out)});
  }
  const nlohmann::json charts = nlohmann::json::parse(ReadAll(Out("a") + "/charts.json"));
  EXPECT_EQ(charts["parts"][0]["rows"][1]["log"], "logs/1");
  EXPECT_TRUE(fs::is_directory(fs::path(Out("a")) / "logs/1"));
  Expect(0, {"report", Out("a"), Out("b"), "--html", Out("a") + "/both.html"});
  const std::string page = ReadAll(Out("a") + "/both.html");
  EXPECT_NE(page.find("\"folder\":\".\""), std::string::npos);
  EXPECT_NE(page.find("\"folder\":\"../b\""), std::string::npos);
}

TEST_F(SweepTest, AFallNamesTheStepThatItWouldHaveTaken) {
  Expect(0, {"sweep", "pushed", "--set", "duration=1.5", "--vary", "sim.push[0].peak=20,2000",
             "--out", Out("sweep")});
  int falls = 0;
  for (const CsvRow& row : ReadCsv(Out("sweep") + "/table.csv")) {
    const bool fell = row.at("outcome") == "fell";
    falls += fell;
    EXPECT_EQ(row.at("trouble").find("step_needed") != std::string::npos, fell)
        << row.at("run") << ": " << row.at("trouble");
  }
  EXPECT_GT(falls, 0);
}

TEST_F(SweepTest, AreListedWithWhatTheySay) {
  Sweep("far",
        "description: \"As far as it goes\" scenario: \"pushed\"\n"
        "limit { field: \"sim.push[0].peak\" min: 1 max: 2 }\n");
  Sweep("wrong", "scenari: 1\n");
  const ProgramResult list = RunPoise({"list", "sweeps"});
  EXPECT_EQ(list.exit_code, 0) << list.output;
  for (const char* const part : {"far", "As far as it goes (poise limit, scenario pushed)", "tiny",
                                 "(poise sweep, scenario pushed)", "wrong.pbtxt:1:", "scenari"}) {
    EXPECT_NE(list.output.find(part), std::string::npos) << part << "\n" << list.output;
  }
}

TEST_F(SweepTest, RunsThatCannotBeMadeAreNamedAndTheOthersGoOn) {
  const ProgramResult result =
      RunPoise({"sweep", "pushed", "--vary", "sim.ground.friction=0.9,-1", "--out", Out("sweep")});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_NE(result.output.find("run 1: invalid: "), std::string::npos) << result.output;
  const std::vector<CsvRow> rows = ReadCsv(Out("sweep") + "/table.csv");
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].at("outcome"), "stands");
  EXPECT_EQ(rows[1].at("outcome"), "invalid");
  EXPECT_NE(rows[1].at("reason").find("friction"), std::string::npos);
}

// Who stands and makes no step has not done what is asked.
TEST_F(SweepTest, WhatARunIsToDoIsAskedOfIt) {
  deploy_.Scenario("stepping",
                   "base: \"pushed\" name: \"stepping\"\n"
                   "check { metric: \"steps\" label: \"steps landed\" at_least: 1 }\n"
                   "check { metric: \"fallen\" at_most: 0 }\n");
  const auto outcome = [&](const std::string& required, CsvRow* row) {
    const std::string out = Out("sweep_" + required);
    const ProgramResult result =
        RunPoise({"sweep",
                  Sweep("asked_" + required, "scenario: \"stepping\" require: \"" + required +
                                                 "\" vary { field: \"seed\" value: 1 }\n"),
                  "--out", out});
    EXPECT_EQ(result.exit_code, 0) << result.output;
    *row = ReadCsv(out + "/table.csv").at(0);
    return result.output;
  };
  CsvRow row;
  const std::string missed = outcome("steps", &row);
  EXPECT_EQ(row.at("outcome"), "missed");
  EXPECT_NE(row.at("reason").find("steps landed: 0, must be ≥ 1"), std::string::npos);
  EXPECT_NE(missed.find("missed 1 (100.0 %)"), std::string::npos) << missed;
  EXPECT_NE(missed.find("stood and did not do what is asked"), std::string::npos) << missed;
  outcome("fallen", &row);
  EXPECT_EQ(row.at("outcome"), "stands");
}

// Within a second no step lands, and nobody falls either.
TEST(ShippedSweep, ACourseCountsByWhoHasWalkedIt) {
  const RunFolder folder;
  const ProgramResult result = RunPoise(
      {"sweep", "walk_courses", "--random", "1", "--duration", "1", "--out", folder / "courses"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  const CsvRow row = ReadCsv(folder / "courses/table.csv").at(0);
  EXPECT_EQ(row.at("outcome"), "missed");
  EXPECT_NE(row.at("reason").find("steps: 0, must be ≥ 20; way: "), std::string::npos);
}

TEST_F(SweepTest, ErrorsNameFileAndLineOrFlag) {
  const std::string out = Out("sweep");
  const auto expect = [&](const std::string& text, const std::vector<std::string>& parts) {
    ExpectUsageError({"sweep", Sweep("wrong", text), "--out", out}, parts);
  };
  expect("scenario: \"pushed\"\nvary { name: \"a\" form: 1 }\n", {"wrong.pbtxt:2:", "form"});
  expect("vary { name: \"a\" value: 1 }\n", {"wrong.pbtxt: scenario"});
  expect("scenario: \"pusht\"\nvary { field: \"seed\" value: 1 }\n", {"pusht", "pushed"});
  expect("scenario: \"pushed\"\nvary {\n field: \"sim.pusch[0].peak\" value: 1 }\n",
         {"wrong.pbtxt:3: vary[0].field", "push"});
  expect(
      "scenario: \"pushed\"\nvary { name: \"a\" value: 1 }\nassign {\n field: \"seed\"\n value: "
      "\"b\" }\n",
      {"wrong.pbtxt:5: assign[0].value", "'b'"});
  expect(
      "scenario: \"pushed\"\nvary { name: \"a\" choice { name: \"x\" }\n choice { name: \"y\" set: "
      "\"sedd=1\" } }\n",
      {"wrong.pbtxt:3: vary[0].choice[1].set[0]", "seed"});
  expect("scenario: \"pushed\"\nvary { field: \"seed\" value: 1 }\ncolumn: \"fallenn\"\n",
         {"wrong.pbtxt:3: column[0]", "fallen"});
  expect("scenario: \"pushed\"\nvary { field: \"seed\" value: 1 }\nmap { x: \"sed\" }\n",
         {"wrong.pbtxt:3: map[0].x", "seed"});
  expect("scenario: \"pushed\"\nvary { field: \"seed\" value: 1.5 }\n", {"wrong.pbtxt:2", "whole"});
  expect("scenario: \"pushed\"\nvary { field: \"seed\" value: 1 }\nrequire: \"com_error_max_x\"\n",
         {"wrong.pbtxt:3: require[0]", "checks no limit of 'com_error_max_x'"});
  expect("scenario: \"pushed\"\nvary { field: \"seed\" value: 1 }\ndrives: \"ethercut\"\n",
         {"wrong.pbtxt:3: drives", "ethercat"});
  const auto flags = [&](std::vector<std::string> arguments,
                         const std::vector<std::string>& parts) {
    arguments.insert(arguments.begin(), {"sweep"});
    arguments.insert(arguments.end(), {"--out", out});
    ExpectUsageError(arguments, parts);
  };
  flags({"nothing"}, {"nothing", "tiny"});
  flags({"pushed"}, {"--vary"});
  flags({"pushed", "--vary", "seed"}, {"--vary seed"});
  flags({"pushed", "--vary", "seed=1:x:2"}, {"--vary seed=1:x:2"});
  flags({"pushed", "--vary", "sedd=1,2,x"}, {"--vary sedd=1,2,x"});
  flags({"pushed", "--vary", "seed=1,2", "--expression", "duration=2*t"},
        {"--expression duration=2*t"});
  flags({"tiny", "--range", "5:9"}, {"--range 5:9"});
  flags({"tiny", "--part", "0/4"}, {"--part 0/4"});
  flags({"tiny", "--jobs", "0"}, {"--jobs"});
  flags({"tiny", "--drives", "ethercut"}, {"--drives", "ethercat"});
  flags({"tiny", "--random", "4"}, {"tiny.pbtxt:2: vary[0].steps"});
  ExpectUsageError({"sweep", "tiny", "--resume"}, {"--out"});
  ExpectUsageError({"sweep", "merge", Out("none"), "--out", out}, {"no results"});
  EXPECT_FALSE(fs::exists(out));
}

TEST_F(SweepTest, ALimitIsTheLargestForceThatIsSurvived) {
  Sweep("limit",
        "scenario: \"pushed\" set: \"duration=1.6\"\n"
        "vary { name: \"side\" choice { name: \"left\" set: \"sim.push[0].direction_y=1\" }\n"
        "  choice { name: \"right\" set: \"sim.push[0].direction_y=-1\" } }\n"
        "limit { name: \"force\" field: \"sim.push[0].peak\" unit: \"N\" min: 50 max: 950\n"
        "  samples: 3 tolerance: 120 }\n");
  const std::string out = Out("limit");
  Expect(0, {"limit", "limit", "--out", out});
  const std::vector<CsvRow> limits = ReadCsv(out + "/limits.csv");
  ASSERT_EQ(limits.size(), 2u);
  const std::vector<CsvRow> runs = ReadCsv(out + "/table.csv");
  for (const CsvRow& limit : limits) {
    const double force = std::stod(limit.at("force"));
    const double fails = std::stod(limit.at("fails_at"));
    EXPECT_LE(fails - force, 120);
    for (const CsvRow& run : runs) {
      if (run.at("run") != limit.at("run")) continue;
      const double at = std::stod(run.at("force"));
      if (at <= force) {
        EXPECT_EQ(run.at("outcome"), "stands") << at;
      }
      if (at == fails) {
        EXPECT_EQ(run.at("outcome"), "fell") << at;
      }
    }
    // A half sine of 0.1 s.
    EXPECT_NEAR(std::stod(limit.at("impulse")), force * 0.1 * 2 / std::numbers::pi, 1e-9);
    const double mass = std::stod(limit.at("mass")), height = std::stod(limit.at("com_height"));
    const double bound =
        mass * std::sqrt(9.80665 / height) * std::stod(limit.at("distance_to_edge"));
    EXPECT_NEAR(std::stod(limit.at("lip_impulse")), bound, 1e-9);
    EXPECT_NEAR(std::stod(limit.at("share_of_lip")), std::stod(limit.at("impulse")) / bound, 1e-9);
  }
  // In parts, interrupted or not, the same.
  for (const char* part : {"1/2", "2/2"}) {
    Expect(0, {"limit", "limit", "--part", part, "--out", Out(std::string("part") + part[0])});
  }
  Expect(0, {"sweep", "merge", Out("part1"), Out("part2"), "--out", Out("merged")});
  EXPECT_EQ(ReadAll(fs::path(Out("merged")) / "limits.csv"), ReadAll(fs::path(out) / "limits.csv"));
  EXPECT_EQ(Table(Out("merged")), Table(out));
  ExpectUsageError({"limit", "pushed", "--min", "1", "--max", "2"}, {"--field"});
  ExpectUsageError({"limit", "limit", "--max", "2"}, {"--max", "more than min"});
}

}  // namespace
}  // namespace poise
