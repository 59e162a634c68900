// The data of charts of sweeps that exist in memory only: docs/reference/charts.md.
#include "tools/charts/sweep_charts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tools/charts/sweep_edge.h"
#include "tools/cli/temporary_dir.h"
#include "tools/sweep/sweep_points.h"

namespace poise {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::ordered_json;

class SweepChartsTest : public ::testing::Test {
 protected:
  Variable* Vary(const std::string& name, const std::string& unit, std::vector<double> values) {
    Variable* const variable = header.sweep.add_vary();
    if (!name.empty()) variable->set_name(name);
    if (!unit.empty()) variable->set_unit(unit);
    for (const double value : values) variable->add_value(value);
    return variable;
  }
  /// Looks for the largest force that is survived, 100 to 300 N, first at three values.
  void LimitForce(double tolerance) {
    Limit* const limit = header.sweep.mutable_limit();
    limit->set_name("force");
    limit->set_unit("N");
    limit->set_min(100);
    limit->set_max(300);
    limit->set_samples(3);
    limit->set_tolerance(tolerance);
  }
  /// The next run of the grid.
  SweepRow& Add(bool stands, double error) {
    SweepRow row;
    row.run = static_cast<int64_t>(rows.size());
    row.outcome = stands ? kStands : kFell;
    if (!stands) row.fell_at = 1.2345678;
    row.phase = "stand";
    row.metrics["com_error_max_y"] = error;
    row.metrics["push_peak"] = 7;
    return rows[{row.run, 0}] = row;
  }

  SweepHeader header{"sweep", {}, {"com_error_max_y", "push_peak"}, "", ""};
  SweepRows rows;
};

TEST_F(SweepChartsTest, OneVariableHasAChartOfEachMetricThatDiffers) {
  header.sweep.set_name("pushes");
  Vary("", "", {50, 100, 150, 200})->set_field("sim.push[0].peak");
  for (const double error : {1.0, 2.0}) Add(true, error);
  for (const double error : {4e5, 1.5e6}) Add(false, error);
  const Json charts = SweepCharts(header, rows);
  EXPECT_EQ(charts["format"], 1);
  EXPECT_EQ(charts["title"], "pushes");
  EXPECT_THAT(charts["text"].get<std::string>(), HasSubstr("stands 2"));
  ASSERT_EQ(charts["parts"].size(), 1u);
  const Json& part = charts["parts"][0];
  EXPECT_EQ(part["kind"], "sweep");
  EXPECT_EQ(part["variables"], Json::parse(R"([{"name": "peak of push[0]", "unit": "N"}])"));
  EXPECT_EQ(part["values"][0]["name"], "com_error_max_y");
  EXPECT_NE(part["values"][0]["label"], "com_error_max_y");  // in words
  // What is the same in each run that stands is no chart.
  EXPECT_EQ(part["maps"], Json::parse(R"([{"x": 0}, {"x": 0, "value": 0}])"));
  ASSERT_EQ(part["same"].size(), 1u);
  EXPECT_THAT(part["same"][0].get<std::string>(), HasSubstr(": 7 N"));
  ASSERT_EQ(part["rows"].size(), 4u);
  const Json& fallen = part["rows"][3];
  EXPECT_EQ(fallen["run"], 3);
  EXPECT_EQ(fallen["at"], Json::parse("[200.0]"));
  EXPECT_EQ(fallen["outcome"], "fell");
  EXPECT_EQ(fallen["values"], Json::parse("[1500000.0, 7.0]"));
  EXPECT_EQ(fallen["told"], "fell at 1.235 s, phase stand");
  EXPECT_FALSE(fallen.contains("log"));
}

TEST_F(SweepChartsTest, TwoVariablesHaveAMapAndChoicesAreIndices) {
  Variable* const law = Vary("law", "", {});
  law->add_choice()->set_name("paper");
  law->add_choice()->set_name("capture");
  Vary("direction", "", {0, 90})->set_angle(true);
  for (int i = 0; i < 4; ++i) Add(true, 1);
  const Json part = SweepChartsPart(header, rows);
  EXPECT_EQ(part["variables"],
            Json::parse(R"([{"name": "law", "unit": "", "choices": ["paper", "capture"]},
                            {"name": "direction", "unit": "°", "angle": true}])"));
  EXPECT_EQ(part["maps"], Json::parse(R"([{"x": 0, "y": 1}])"));
  EXPECT_EQ(part["rows"][3]["at"], Json::parse("[1, 90.0]"));
  SweepMap* const map = header.sweep.add_map();
  map->set_x("direction");
  map->set_value("push_peak");
  EXPECT_EQ(SweepChartsPart(header, rows)["maps"], Json::parse(R"([{"x": 1, "value": 1}])"));
}

TEST_F(SweepChartsTest, WhatDoesNotTellHasNoValues) {
  Vary("force", "N", {50, 100, 150});
  for (const double error : {1.0, 7.0, 3.0}) Add(true, error);
  SweepRow& hung = rows.at({1, 0});
  hung.outcome = kHung;
  hung.component = "policy";
  hung.stage = "walk";
  hung.ended_at = 1.5;
  EXPECT_THAT(SurvivalSentences(header, rows),
              ElementsAre("All 2 runs stand.",
                          "1 run does not tell whether the robot stood: stopped, crashed, hung, or "
                          "not to be run."));
  const Json row = SweepChartsPart(header, rows)["rows"][1];
  EXPECT_EQ(row["outcome"], "hung");
  EXPECT_EQ(row["values"], Json::parse("[null, null]"));
  EXPECT_THAT(row["told"].get<std::string>(), HasSubstr("hung in policy, stage walk, at 1.500 s"));
}

TEST_F(SweepChartsTest, ARowHasTheCommandThatMakesItsRunAgainAndWhereItWasKept) {
  Vary("", "", {50, 100})->set_field("sim.push[0].peak");
  header.sweep.set_scenario("my/push.pbtxt");
  header.sweep.set_ideal(true);
  header.sweep.add_set("sim.push[0].direction_y=-1");
  Add(true, 1);
  Add(false, 1);
  const TemporaryDir folder("poise-charts");
  std::filesystem::create_directories(folder.path() / "logs" / "1");
  Json part = SweepChartsPart(header, rows, "", folder.path());
  EXPECT_EQ(part["command"], "poise run my/push.pbtxt --ideal --set 'sim.push[0].direction_y=-1'");
  EXPECT_EQ(part["rows"][1]["set"], " --set 'sim.push[0].peak=100'");
  EXPECT_FALSE(part["rows"][0].contains("log"));
  EXPECT_EQ(part["rows"][1]["log"], "logs/1");
  part = SweepChartsPart(header, rows, "set/a.pbtxt --robot g1");
  EXPECT_THAT(part["command"].get<std::string>(),
              HasSubstr("poise run set/a.pbtxt --robot g1 --ideal"));
  header.sweep.set_drives("ethercat");
  EXPECT_THAT(SweepChartsPart(header, rows)["command"].get<std::string>(),
              HasSubstr("poise run my/push.pbtxt --ideal --drives ethercat --set"));
}

TEST_F(SweepChartsTest, OfLimitsEachPointIsARow) {
  Vary("direction", "", {0, 90, 180})->set_angle(true);
  LimitForce(100);
  const auto tried = [&](int64_t run, double value, const char* outcome) {
    SweepRow row;
    row.run = run;
    row.limit = value;
    row.outcome = outcome;
    if (run == 0) row.push = PushBound{.impulse = value / 10, .mass = 5, .lip_impulse = 40};
    rows[{run, value}] = row;
  };
  for (const double value : {100.0, 200.0}) tried(0, value, kStands);
  tried(0, 300, kFell);
  for (const double value : {100.0, 200.0, 300.0}) tried(1, value, kFell);
  for (const double value : {100.0, 200.0, 300.0}) tried(2, value, kHung);
  const Json part = SweepChartsPart(header, rows);
  EXPECT_EQ(part["kind"], "limit");
  std::vector<std::string> names;
  for (const Json& value : part["values"]) names.push_back(value["name"]);
  EXPECT_THAT(names, ElementsAre("limit", "impulse", "impulse_per_mass", "share_of_lip"));
  EXPECT_EQ(part["maps"], Json::parse(R"([{"x": 0, "value": 0}, {"x": 0, "value": 1},
                                          {"x": 0, "value": 2}, {"x": 0, "value": 3}])"));
  ASSERT_EQ(part["rows"].size(), 3u);
  EXPECT_EQ(part["rows"][0]["outcome"], "stands");
  EXPECT_EQ(part["rows"][0]["values"], Json::parse("[200.0, 20.0, 4.0, 0.5]"));
  EXPECT_EQ(part["rows"][0]["told"], "fails at 300 N; 3 runs");
  EXPECT_EQ(part["rows"][1]["outcome"], "fell");
  EXPECT_EQ(part["rows"][1]["values"], Json::parse("[null, null, null, null]"));
  EXPECT_EQ(part["rows"][2]["outcome"], "unknown");
}

TEST_F(SweepChartsTest, OfTheLimitOfOnePointEachValueTriedIsARow) {
  LimitForce(50);
  for (const auto& [value, outcome] : {std::pair{100.0, kStands}, std::pair{200.0, kStands},
                                       std::pair{250.0, kCrashed}, std::pair{300.0, kFell}}) {
    SweepRow row;
    row.limit = value;
    row.outcome = outcome;
    row.metrics["com_error_max_y"] = value / 10;
    rows[{0, value}] = row;
  }
  const Json part = SweepChartsPart(header, rows);
  EXPECT_EQ(part["kind"], "sweep");
  EXPECT_EQ(part["variables"], Json::parse(R"([{"name": "force", "unit": "N"}])"));
  EXPECT_EQ(part["maps"], Json::parse(R"([{"x": 0}, {"x": 0, "value": 0}])"));
  ASSERT_EQ(part["rows"].size(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    const double value = part["rows"][i]["at"][0];
    EXPECT_EQ(part["rows"][i]["outcome"], rows.at({0, value}).outcome) << value;
  }
  EXPECT_EQ(part["rows"][1]["values"], Json::parse("[20.0, null]"));
}

TEST_F(SweepChartsTest, OneRunIsToldAsOne) {
  Vary("push_force", "N", {50});
  Add(true, 1);
  EXPECT_THAT(SurvivalSentences(header, rows), ElementsAre("The one run stands."));
}

TEST_F(SweepChartsTest, TheEdgeOfSurvivalInWords) {
  Vary("push_force", "N", {50, 100, 150, 200, 250});
  for (const bool stands : {true, true, false, true, false}) Add(stands, 1);
  EXPECT_THAT(SurvivalSentences(header, rows),
              ElementsAre("3 of 5 runs stand, 2 do not.",
                          "push force: stands at 50 to 100 N, 200 N; does not at 150 N, 250 N."));
  for (auto& [key, row] : rows) row.outcome = kStands;
  EXPECT_THAT(SurvivalSentences(header, rows), ElementsAre("All 5 runs stand."));
  for (auto& [key, row] : rows) row.outcome = kFell;
  EXPECT_THAT(SurvivalSentences(header, rows), ElementsAre("None of 5 runs stands."));
}

TEST_F(SweepChartsTest, TheEdgeByDirection) {
  Vary("direction", "", {0, 90, 180})->set_angle(true);
  Vary("force", "N", {50, 100, 150});
  for (const bool stands : {true, true, false, true, false, false, true, true, true})
    Add(stands, 1);
  const std::vector<std::string> sentences = SurvivalSentences(header, rows);
  ASSERT_EQ(sentences.size(), 2u);
  EXPECT_EQ(
      sentences[1],
      "It stands up to a force of 50 N (direction 90°), 100 N (direction 0°); in 1 of 3 places "
      "it stands at every value.");
}

// A later push does not separate what stands from what falls, a larger one does.
TEST_F(SweepChartsTest, SurvivalIsToldAlongTheVariableThatEndsIt) {
  Vary("force", "N", {100, 200, 300});
  Vary("start", "s", {1, 2});
  for (const bool stands : {true, true, false, true, false, false}) Add(stands, 1);
  EXPECT_EQ(SurvivalSentences(header, rows).at(1),
            "It stands up to a force of 100 N (start 1 s), 200 N (start 2 s).");
  rows.at({3, 0}).outcome = kFell;
  EXPECT_EQ(SurvivalSentences(header, rows).at(1),
            "It stands up to a force of 100 N in each of 2 places.");
}

TEST_F(SweepChartsTest, WhereRandomRunsFall) {
  header.sweep.set_random(40);
  header.sweep.set_seed(3);
  Variable* const force = header.sweep.add_vary();
  force->set_name("force");
  force->set_from(0);
  force->set_to(100);
  Variable* const other = header.sweep.add_vary();
  other->set_name("height");
  other->set_from(0);
  other->set_to(1);
  const SweepPoints points(header.sweep);
  for (int64_t run = 0; run < 40; ++run) Add(points.At(run)[0].number < 60, 1);
  const std::vector<std::string> sentences = SurvivalSentences(header, rows);
  ASSERT_EQ(sentences.size(), 2u);
  EXPECT_THAT(sentences[1], HasSubstr("force 6"));
  EXPECT_THAT(sentences[1], Not(HasSubstr("height")));
}

}  // namespace
}  // namespace poise
