// The maps of sweeps that exist in memory only.
#include "tools/maps/sweep_maps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "tools/maps/svg_frame.h"
#include "tools/maps/sweep_edge.h"
#include "tools/sweep/sweep_points.h"

namespace poise {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

size_t Count(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

/// Contents of all elements <text>.
std::vector<std::string> Texts(const std::string& svg) {
  const std::regex text("<text[^>]*>([^<]*)</text>");
  std::vector<std::string> found;
  for (std::sregex_iterator it(svg.begin(), svg.end(), text), end; it != end; ++it) {
    found.push_back((*it)[1]);
  }
  return found;
}

/// The largest number that stands at an axis.
double LargestNumber(const std::string& svg) {
  double largest = 0;
  for (const std::string& text : Texts(svg)) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (end != text.c_str() && *end == '\0') largest = std::max(largest, value);
  }
  return largest;
}

class SweepMapsTest : public ::testing::Test {
 protected:
  Variable* Vary(const std::string& name, const std::string& unit, std::vector<double> values) {
    Variable* const variable = header.sweep.add_vary();
    if (!name.empty()) variable->set_name(name);
    if (!unit.empty()) variable->set_unit(unit);
    for (const double value : values) variable->add_value(value);
    return variable;
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

TEST_F(SweepMapsTest, AFallRuinsNoScale) {
  header.sweep.set_name("pushes");
  Vary("", "", {50, 100, 150, 200, 250})->set_field("sim.push[0].peak");
  for (const double error : {1.0, 2.0, 3.0}) Add(true, error);
  for (const double error : {4e5, 1.5e6}) Add(false, error);
  const SweepMaps maps = MapCharts(header, rows);
  ASSERT_EQ(maps.survival.size(), 1u);
  ASSERT_EQ(maps.metrics.size(), 1u);
  EXPECT_LE(LargestNumber(maps.metrics[0]), 300) << maps.metrics[0];  // the axis of the forces
  EXPECT_EQ(Count(maps.metrics[0], "<circle"), 3u);
  EXPECT_EQ(Count(maps.metrics[0], "class='f' "), 3u);  // two runs and the legend
  EXPECT_THAT(Texts(maps.metrics[0]), Contains("did not stand"));
  EXPECT_THAT(Texts(maps.metrics[0]), Contains("peak of push[0] [N]"));
  EXPECT_THAT(maps.metrics[0], HasSubstr("fell at 1.235 s"));
  EXPECT_THAT(maps.metrics[0], Not(HasSubstr("com_error_max_y")));
  // What is the same in each run that stands is no chart.
  ASSERT_EQ(maps.constants.size(), 1u);
  EXPECT_THAT(maps.constants[0], HasSubstr(": 7 N"));
}

TEST_F(SweepMapsTest, AHeatMapLeavesFallsOffItsColours) {
  Vary("force", "N", {50, 100});
  Vary("height", "m", {1, 0.21666666666666667});
  SweepMap* const map = header.sweep.add_map();
  map->set_x("force");
  map->set_y("height");
  map->set_value("com_error_max_y");
  Add(true, 1);
  Add(true, 3);
  Add(true, 2);
  Add(false, 1e6);
  const SweepMaps maps = MapCharts(header, rows);
  ASSERT_EQ(maps.metrics.size(), 1u);
  EXPECT_EQ(Count(maps.metrics[0], "class='ff'"), 2u);  // the cell and the legend
  EXPECT_LE(LargestNumber(maps.metrics[0]), 100);
  EXPECT_THAT(Texts(maps.metrics[0]), Contains("0.2167"));
  EXPECT_THAT(maps.metrics[0], Not(HasSubstr("0.216666")));
}

TEST_F(SweepMapsTest, AMeanIsOfTheRunsThatStand) {
  Vary("force", "N", {50, 100});
  Vary("seed", "", {1, 2});
  SweepMap* const map = header.sweep.add_map();
  map->set_x("force");
  map->set_value("com_error_max_y");
  Add(true, 1);
  Add(true, 2);
  Add(true, 5);
  Add(false, 1e6);
  const SweepMaps maps = MapCharts(header, rows);
  EXPECT_THAT(maps.metrics[0], HasSubstr("mean: 1.5"));
  EXPECT_THAT(maps.metrics[0], HasSubstr("2 runs, of which 1 did not stand\nmean: 5"));
}

TEST_F(SweepMapsTest, TheEdgeOfSurvivalInWords) {
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

TEST_F(SweepMapsTest, TheEdgeByDirection) {
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
TEST_F(SweepMapsTest, SurvivalIsToldAlongTheVariableThatEndsIt) {
  Vary("force", "N", {100, 200, 300});
  Vary("start", "s", {1, 2});
  for (const bool stands : {true, true, false, true, false, false}) Add(stands, 1);
  EXPECT_EQ(SurvivalSentences(header, rows).at(1),
            "It stands up to a force of 100 N (start 1 s), 200 N (start 2 s).");
  rows.at({3, 0}).outcome = kFell;
  EXPECT_EQ(SurvivalSentences(header, rows).at(1),
            "It stands up to a force of 100 N in each of 2 places.");
}

TEST_F(SweepMapsTest, WhatDoesNotTellCountsForNothing) {
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
  const SweepMaps maps = MapCharts(header, rows);
  for (const std::string& chart : maps.all()) {
    EXPECT_EQ(Count(chart, "class='u'"), 2u) << chart;  // the run and the legend
    EXPECT_EQ(Count(chart, "class='f'"), 0u);
    EXPECT_THAT(chart, HasSubstr("hung in policy, stage walk, at 1.500 s"));
  }
  EXPECT_THAT(maps.constants, Contains(HasSubstr(": 7 N")));
}

TEST_F(SweepMapsTest, AShareIsBetweenZeroAndOne) {
  Vary("force", "N", {50, 100, 150});
  for (int i = 0; i < 3; ++i) Add(true, 1);
  const std::vector<std::string> texts = Texts(MapCharts(header, rows).survival.at(0));
  EXPECT_THAT(texts, Contains("0"));
  EXPECT_THAT(texts, Contains("1"));
  for (const char* beyond : {"1.2", "1.5", "2"}) EXPECT_THAT(texts, Not(Contains(beyond)));
}

TEST_F(SweepMapsTest, AMarkTellsTheCommandThatMakesItsRunAgain) {
  Vary("", "", {50, 100})->set_field("sim.push[0].peak");
  header.sweep.set_scenario("my/push.pbtxt");
  header.sweep.set_ideal(true);
  header.sweep.add_set("sim.push[0].direction_y=-1");
  Add(true, 1);
  Add(false, 1);
  const std::string chart = MapCharts(header, rows).survival.at(0);
  EXPECT_THAT(chart, HasSubstr("poise run my/push.pbtxt --ideal --set "
                               "&#39;sim.push[0].direction_y=-1&#39; --set "
                               "&#39;sim.push[0].peak=100&#39;"));
  EXPECT_THAT(MapCharts(header, rows, "set/a.pbtxt --robot g1").survival.at(0),
              HasSubstr("poise run set/a.pbtxt --robot g1 --ideal"));
  header.sweep.set_drives("ethercat");
  EXPECT_THAT(MapCharts(header, rows).survival.at(0),
              HasSubstr("poise run my/push.pbtxt --ideal --drives ethercat --set"));
}

TEST_F(SweepMapsTest, WhereRandomRunsFall) {
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

TEST_F(SweepMapsTest, ThePageBeginsWithTheEdgeAndFoldsTheRest) {
  header.sweep.set_name("many");
  Vary("force", "N", {50, 100});
  header.columns.clear();
  Add(true, 1);
  Add(false, 1);
  Add(true, 2).run = 2;
  header.sweep.mutable_vary(0)->add_value(150);
  for (int i = 0; i < 30; ++i) {
    const std::string name = "metric_" + std::to_string(i);
    header.columns.push_back(name);
    for (auto& [key, row] : rows) row.metrics[name] = i + static_cast<double>(row.run);
  }
  const SweepMaps maps = MapCharts(header, rows);
  EXPECT_EQ(maps.all().size(), 31u);
  const std::string page = MapsPage(header, rows, maps);
  const size_t edge = page.find("2 of 3 runs stand"), chart = page.find("<svg"),
               folded = page.find("<details><summary>What the runs measured: 30 maps");
  EXPECT_LT(edge, chart);
  EXPECT_LT(chart, folded);
  EXPECT_NE(folded, std::string::npos);
  EXPECT_EQ(Count(page.substr(0, folded), "<svg"), 1u);
  EXPECT_TRUE(page.ends_with("</html>\n"));
}

TEST(SvgFrame, TextsDoNotOverlap) {
  std::vector<std::pair<double, std::string>> texts;
  for (int i = 0; i < 40; ++i)
    texts.emplace_back(10.0 * i, std::string(static_cast<size_t>(1 + i % 9), '0'));
  const std::string svg = TextsBelow(texts, 0);
  const std::regex text("<text x='([-0-9.]+)'[^>]*>(0+)<");
  double free = -1e9;
  int count = 0;
  for (std::sregex_iterator it(svg.begin(), svg.end(), text), end; it != end; ++it, ++count) {
    const double half = TextWidth((*it)[2].str()) / 2, x = std::stod((*it)[1]);
    EXPECT_GT(x - half, free);
    free = x + half;
  }
  EXPECT_GT(count, 5);
  EXPECT_LT(count, 40);
}

TEST(SvgFrame, WhatIsTooLongIsCut) {
  EXPECT_EQ(Shortened("µµµµµµµµµµ", 30), "µµµ…");
  EXPECT_EQ(Shortened("short", 100), "short");
  const std::string chart =
      CurveChart({std::string(60, 'a') + " " + std::string(200, 'b'), "", "", ""}, {});
  for (const std::string& line : Texts(chart)) EXPECT_LT(TextWidth(line), 600);
}

}  // namespace
}  // namespace poise
