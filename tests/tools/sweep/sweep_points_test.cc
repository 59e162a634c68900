// Expressions, grids and random draws of sweeps.
#include "tools/sweep/sweep_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "components/framework/configuration/configuration.h"
#include "tools/sweep/sweep_expression.h"

namespace poise {
namespace {

Sweep Parse(const std::string& text) {
  Sweep sweep;
  ParseTextProto(text, "test", &sweep);
  return sweep;
}

std::string SweepProblemOf(const std::string& text, bool limit = false) {
  try {
    CheckVariables(Parse(text), limit);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

std::string ExpressionProblem(const std::string& text) {
  try {
    Evaluate(text, {{"force", 2}});
  } catch (const ExpressionError& error) {
    return error.what();
  }
  return "";
}

TEST(SweepExpression, ComputesWithVariables) {
  const std::map<std::string, double> values = {{"force", 3}, {"direction", 30}, {"x_1", -2}};
  EXPECT_DOUBLE_EQ(Evaluate("force*sin(direction*deg)", values), 1.5);
  EXPECT_DOUBLE_EQ(Evaluate("2 + 3*4^2 - 6/4", values), 48.5);
  EXPECT_DOUBLE_EQ(Evaluate("-x_1^2", values), -4);
  EXPECT_DOUBLE_EQ(Evaluate("atan2(1, -1)/pi", values), 0.75);
  EXPECT_DOUBLE_EQ(Evaluate("force > 2 ? sqrt(2)^2 : 0", values), 2);
  EXPECT_DOUBLE_EQ(Evaluate("max(force, 4, x_1) + min(1e-3, 2)", values), 4.001);
}

TEST(SweepExpression, RefusesWhatIsNone) {
  EXPECT_NE(ExpressionProblem("force*cos(directoin)").find("no variable 'directoin'"),
            std::string::npos);
  EXPECT_NE(ExpressionProblem("2*forse").find("force"), std::string::npos);
  EXPECT_NE(ExpressionProblem("force*("), "");
  EXPECT_NE(ExpressionProblem("2 3"), "");
  EXPECT_NE(ExpressionProblem(""), "");
  EXPECT_NE(ExpressionProblem("  "), "");
  EXPECT_NE(ExpressionProblem("force, 2").find("several"), std::string::npos);
  EXPECT_NE(ExpressionProblem("1/0").find("inf"), std::string::npos);
  EXPECT_NE(ExpressionProblem("sqrt(-1)").find("nan"), std::string::npos);
  EXPECT_NE(ExpressionProblem("force = 3"), "");  // no assignment
  EXPECT_NE(ExpressionProblem(std::string(1, '\0')), "");
  EXPECT_NE(ExpressionProblem(std::string(100'000, '(')), "");
}

TEST(SweepExpression, ConstantsAndFunctionsAreNoNames) {
  for (const char* good : {"force", "x_1", "Height", "e"})
    EXPECT_TRUE(IsExpressionName(good)) << good;
  for (const char* bad : {"", "pi", "deg", "sin", "1x", "a.b", "push[0]", "_x", "a b", "ä"}) {
    EXPECT_FALSE(IsExpressionName(bad)) << bad;
  }
}

TEST(SweepPoints, AGridCountsThroughTheValuesTheLastFastest) {
  const SweepPoints points(
      Parse("vary { name: 'a' value: 1 value: 2 }"
            "vary { name: 'b' from: 0 to: 1 steps: 3 }"
            "vary { name: 'c' choice { name: 'x' } choice { name: 'y' } }"));
  ASSERT_EQ(points.size(), 12);
  int64_t run = 0;
  for (const double a : {1.0, 2.0}) {
    for (const double b : {0.0, 0.5, 1.0}) {
      for (const char* c : {"x", "y"}) {
        const std::vector<SweepValue> point = points.At(run++);
        EXPECT_EQ(point[0].number, a);
        EXPECT_EQ(point[1].number, b);
        EXPECT_EQ(points.Text(2, point[2]), c);
      }
    }
  }
}

TEST(SweepPoints, RangesEndWhereTheySay) {
  const auto numbers = [](const std::string& variable) {
    const SweepPoints points(Parse("vary { name: 'a' " + variable + " }"));
    std::vector<double> result;
    for (const SweepValue& value : points.Values(0)) result.push_back(value.number);
    return result;
  };
  EXPECT_EQ(numbers("from: 1 to: 1000 steps: 4 scale: LOGARITHMIC").front(), 1);
  EXPECT_EQ(numbers("from: 1 to: 1000 steps: 4 scale: LOGARITHMIC").back(), 1000);
  EXPECT_NEAR(numbers("from: 1 to: 1000 steps: 4 scale: LOGARITHMIC")[1], 10, 1e-12);
  EXPECT_EQ(numbers("from: 0.1 to: 0.7 steps: 7").back(), 0.7);
  EXPECT_EQ(numbers("from: 5 to: 7 steps: 1"), (std::vector<double>{5}));
  EXPECT_EQ(numbers("from: 0 to: 10 steps: 4 whole: true"), (std::vector<double>{0, 3, 7, 10}));
  // A full turn's end is its beginning.
  EXPECT_EQ(numbers("from: 0 to: 360 steps: 4 angle: true"),
            (std::vector<double>{0, 90, 180, 270}));
  EXPECT_EQ(numbers("from: 0 to: 180 steps: 3 angle: true"), (std::vector<double>{0, 90, 180}));
  EXPECT_EQ(numbers("from: 0 to: 360 steps: 5"), (std::vector<double>{0, 90, 180, 270, 360}));
}

TEST(SweepPoints, FieldsTakeTheirValuesInOrder) {
  const SweepPoints points(
      Parse("vary { field: 'seed' value: 3 }"
            "vary { name: 'angle' value: 90 }"
            "vary { name: 'law' choice { name: 'off' set: 'f=false' set: 'g=1' } }"
            "limit { name: 'force' field: 'push.peak' min: 0 max: 9 }"
            "assign { field: 'x' value: 'force*2' } assign { field: 'y' value: 'angle*2' }"));
  EXPECT_EQ(points.Changes(0, 1.5), (std::vector<std::string>{"seed=3", "f=false", "g=1",
                                                              "push.peak=1.5", "x=3", "y=180"}));
}

TEST(SweepPoints, AnExpressionWithoutAValueNamesItsRun) {
  const SweepPoints points(
      Parse("vary { name: 'a' value: 1 value: 0 }"
            "assign { field: 'x' value: '1/a' }"));
  EXPECT_EQ(points.Changes(0, {}), (std::vector<std::string>{"x=1"}));
  try {
    points.Changes(1, {});
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("run 1, a 0"), std::string::npos) << error.what();
  }
}

TEST(SweepPoints, DrawsFillTheirRange) {
  const SweepPoints points(
      Parse("random: 4000 seed: 5 vary { name: 'a' from: -2 to: 4 }"
            "vary { name: 'b' from: 1 to: 10000 scale: LOGARITHMIC }"
            "vary { name: 'c' from: 1 to: 6 whole: true }"
            "vary { name: 'd' choice { name: 'x' } choice { name: 'y' } }"));
  ASSERT_EQ(points.size(), 4000);
  double sum_a = 0, sum_ab = 0;
  int small = 0, y = 0;
  std::map<double, int> dice;
  for (int64_t run = 0; run < points.size(); ++run) {
    const std::vector<SweepValue> p = points.At(run);
    EXPECT_TRUE(p[0].number >= -2 && p[0].number <= 4);
    EXPECT_TRUE(p[1].number >= 1 && p[1].number <= 10000);
    sum_a += p[0].number;
    sum_ab += (p[0].number - 1) * (std::log10(p[1].number) - 2);
    small += p[1].number < 100;
    ++dice[p[2].number];
    y += points.Text(3, p[3]) == "y";
  }
  // Means of n uniform draws, within five standard deviations.
  EXPECT_NEAR(sum_a / 4000, 1, 5 * 6 / std::sqrt(12.0 * 4000));
  EXPECT_NEAR(sum_ab / 4000, 0, 5 * 6 * 4 / 12.0 / std::sqrt(4000.0));
  EXPECT_NEAR(small, 2000, 5 * std::sqrt(1000.0));
  EXPECT_NEAR(y, 2000, 5 * std::sqrt(1000.0));
  ASSERT_EQ(dice.size(), 6u);
  for (const auto& [face, count] : dice) {
    EXPECT_NEAR(count, 4000 / 6.0, 5 * std::sqrt(4000 * 5 / 36.0)) << face;
  }
}

TEST(SweepPoints, ADrawDependsOnSeedAndRunAlone) {
  const char* text = "random: 100 vary { name: 'a' from: 0 to: 1 } seed: ";
  const SweepPoints one(Parse(std::string(text) + "1")), two(Parse(std::string(text) + "2"));
  Sweep longer = one.sweep();
  longer.set_random(1000);
  std::set<double> seen;
  for (int64_t run = 0; run < 100; ++run) {
    const double value = one.At(run)[0].number;
    EXPECT_TRUE(seen.insert(value).second);
    EXPECT_EQ(SweepPoints(longer).At(run)[0].number, value);
    EXPECT_NE(two.At(run)[0].number, value);
  }
}

TEST(SweepPoints, ExpressionsKnowConstants) {
  const SweepPoints points(
      Parse("constant { name: 'mass' value: 4 } vary { name: 'a' value: 3 value: 5 } "
            "assign { field: 'x' value: 'a*mass' }"));
  EXPECT_EQ(points.Changes(0, {}), std::vector<std::string>{"x=12"});
  EXPECT_EQ(points.Changes(1, {}), std::vector<std::string>{"x=20"});
}

TEST(SweepPoints, NamesTheFieldThatIsWrong) {
  EXPECT_EQ(SweepProblemOf("vary { field: 'a' from: 0 to: 1 steps: 2 }"), "");
  EXPECT_EQ(SweepProblemOf("random: 5 vary { field: 'a' from: 0 to: 1 }"), "");
  EXPECT_EQ(
      SweepProblemOf("vary { name: 'duraton' value: 1 } assign { field: 'x' value: 'sin(pi)' }"),
      "vary[0]: 'duraton' is no field of a scenario, and no expression uses it; did you mean "
      "duration?");
  EXPECT_EQ(SweepProblemOf("limit { name: 'foo' min: 0 max: 1 }", true),
            "limit.name: 'foo' is no field of a scenario, and no expression uses it");
  const auto starts = [](const std::string& text, const std::string& field, bool limit = false) {
    const std::string problem = SweepProblemOf(text, limit);
    EXPECT_TRUE(problem.starts_with(field + ": ")) << text << " gave " << problem;
  };
  starts("", "vary");
  starts("vary { from: 0 to: 1 steps: 2 }", "vary[0].field");
  starts("vary { name: 'sin' value: 1 }", "vary[0].name");
  starts("vary { name: 'outcome' value: 1 }", "vary[0].name");
  starts("vary { name: 'a' }", "vary[0]");
  starts("vary { name: 'a' from: 0 to: 1 }", "vary[0].steps");
  starts("vary { name: 'a' from: 0 to: 1 steps: 0 }", "vary[0].steps");
  starts("vary { name: 'a' from: 0 steps: 2 }", "vary[0].to");
  starts("vary { name: 'a' from: nan to: 1 steps: 2 }", "vary[0].from");
  starts("vary { name: 'a' value: inf }", "vary[0].value[0]");
  starts("vary { name: 'a' from: 0 to: 1 steps: 2 scale: LOGARITHMIC }", "vary[0].scale");
  starts("vary { name: 'a' from: 0 to: 1 steps: 2 value: 3 }", "vary[0]");
  starts("vary { name: 'a' value: 3 steps: 2 }", "vary[0].steps");
  starts("random: 5 vary { name: 'a' from: 0 to: 1 steps: 2 }", "vary[0].steps");
  starts("random: 0 vary { name: 'a' from: 0 to: 1 }", "random");
  starts("random: 1000001 vary { name: 'a' from: 0 to: 1 }", "random");
  starts("vary { name: 'a' from: 0 to: 1 steps: 2147483647 }", "vary");
  starts("vary { name: 'a' value: 1 } vary { name: 'a' value: 2 }", "vary[1]");
  starts("vary { name: 'a' choice { set: 'x=1' } }", "vary[0].choice[0]");
  starts("vary { name: 'a' field: 'b' choice { name: 'x' } }", "vary[0].field");
  starts(
      "vary { name: 'a' from: 0 to: 1 steps: 1001 } vary { name: 'b' from: 0 to: 1 steps: 1001 }",
      "vary");
  starts("vary { name: 'a' value: 1 } assign { field: 'x' value: 'b' }", "assign[0].value");
  starts("vary { name: 'a' value: 1 } assign { value: 'a' }", "assign[0]");
  starts("constant { name: 'sin' value: 1 } vary { name: 'a' value: 1 }", "constant[0].name");
  starts("constant { name: 'c' } vary { name: 'a' value: 1 }", "constant[0].value");
  starts(
      "constant { name: 'c' value: 1 } constant { name: 'c' value: 2 } vary { name: 'a' value: 1 }",
      "constant[1].name");
  starts("constant { name: 'a' value: 1 } vary { name: 'a' value: 1 }", "vary[0]");
  starts("", "limit.field", true);
  starts("limit { name: 'f' max: 1 }", "limit.min", true);
  starts("limit { name: 'f' min: 2 max: 1 }", "limit.max", true);
  starts("limit { name: 'f' min: 0 max: 1 samples: 1 }", "limit.samples", true);
  starts("limit { name: 'f' min: 0 max: 1 tolerance: 0 }", "limit.tolerance", true);
  starts("vary { name: 'f' value: 1 } limit { name: 'f' min: 0 max: 1 }", "limit", true);
  EXPECT_EQ(
      SweepProblemOf("limit { name: 'f' min: 0 max: 1 } assign { field: 'x' value: 'f' }", true),
      "");
}

}  // namespace
}  // namespace poise
