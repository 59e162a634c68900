#include "tools/live/message_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "tests/test_seed.h"
#include "tools/reference/value_names.h"

namespace poise {
namespace {

const std::vector<Scalar> kFields = {{"tick", int64_t{12}},
                                     {"torque[0]", 1.0 / 3},
                                     {"torque[1]", -2.5},
                                     {"foot_wrench[0].force[0]", 1e-9},
                                     {"foot_wrench[0].force[1]", 0.0},
                                     {"foot_wrench[0].moment[0]", 7.0},
                                     {"detail", std::string("a \"b\"\n\x1b[2J\xff\\")}};

TEST(MessageTextTest, ALineHasEachFieldByItsPath) {
  EXPECT_EQ(MessageLine(12, {kFields[1], kFields[2]}),
            "tick=12 torque[0]=0.333333 torque[1]=-2.5\n");
  EXPECT_EQ(MessageLine(12, {kFields[2], kFields[0]}), "torque[1]=-2.5 tick=12\n");
  EXPECT_EQ(MessageLine(std::nullopt, {kFields[3]}), "foot_wrench[0].force[0]=1e-09\n");
}

// The numbers are those of lcmtypes/planner_status_t.lcm.
TEST(MessageTextTest, AnEnumerationsValueHasItsName) {
  EXPECT_EQ(ValueName("planner_status_t", "stepping", 3), "LOADING");
  EXPECT_EQ(ValueName("planner_status_t", "step_reason", 5), "WALK");
  EXPECT_EQ(ValueName("planner_status_t", "step_reason", 7), "LINGERING");
  EXPECT_EQ(ValueName("planner_status_t", "foot_state[1]", 2), "SEARCHING");
  EXPECT_EQ(ValueName("planner_status_t", "stepping", 99), "");
  EXPECT_EQ(ValueName("planner_status_t", "phase", 0), "");
  EXPECT_EQ(ValueName("no_such_t", "stepping", 3), "");
  const Scalar stepping{"stepping", int64_t{3}, "LOADING"};
  EXPECT_EQ(MessageLine(12, {stepping}), "tick=12 stepping=3(LOADING)\n");
  EXPECT_EQ(CsvRow(12, {stepping}), "12,3\n");
}

TEST(MessageTextTest, ABlockPutsAnArrayOnOneLine) {
  EXPECT_EQ(MessageBlock("CHANNEL", kFields),
            "CHANNEL\n"
            "  tick                   12\n"
            "  torque                 [0.333333 -2.5]\n"
            "  foot_wrench[0].force   [1e-09 0]\n"
            "  foot_wrench[0].moment  [7]\n"
            "  detail                 \"a \\\"b\\\"\\n\\x1b[2J\\xff\\\\\"\n"
            "\n");
  EXPECT_EQ(MessageBlock("C", {kFields[1]}), "C\n  torque  [0.333333]\n\n");
}

TEST(MessageTextTest, ABlockPutsArraysOfTheSameNamesInATable) {
  EXPECT_EQ(MessageBlock("C", {{"torque[hip]", 1.5},
                               {"torque[knee_pitch]", -20.25},
                               {"in_contact[right]", int64_t{1}},
                               {"eta", 0.5},
                               {"feedback[hip]", 0.0},
                               {"feedback[knee_pitch]", 3.0},
                               {"foot_wrench[right].force[0]", 4.0}}),
            "C\n"
            "  eta                       0.5\n"
            "  foot_wrench[right].force  [4]\n"
            "              torque  feedback\n"
            "  hip            1.5         0\n"
            "  knee_pitch  -20.25         3\n"
            "         in_contact\n"
            "  right           1\n"
            "\n");
}

TEST(MessageTextTest, CsvHasAColumnForEachField) {
  EXPECT_EQ(CsvHeader(true, {kFields[1], kFields[6]}), "tick,torque[0],detail\n");
  EXPECT_EQ(CsvHeader(true, {kFields[1], kFields[0]}), "torque[0],tick\n");
  EXPECT_EQ(CsvHeader(false, {kFields[1]}), "torque[0]\n");
  EXPECT_EQ(CsvRow(5, {kFields[2], kFields[6]}), "5,-2.5,\"a \"\"b\"\"\\n\\x1b[2J\\xff\\\\\"\n");
}

TEST(MessageTextTest, CsvGivesTheSameNumbersBack) {
  std::mt19937_64 random(TestSeed(1));
  std::normal_distribution<double> exponent(0, 60);
  for (int i = 0; i < 1000; ++i) {
    const double value =
        std::ldexp(static_cast<double>(random()), static_cast<int>(exponent(random)));
    EXPECT_EQ(std::strtod(CsvRow(std::nullopt, {{"x", value}}).c_str(), nullptr), value);
  }
  EXPECT_EQ(CsvRow(std::nullopt, {{"x", std::numeric_limits<double>::quiet_NaN()}}), "nan\n");
  EXPECT_EQ(CsvRow(std::nullopt, {{"x", INT64_MIN}}), "-9223372036854775808\n");
}

int Passed(double rate, double step, int messages) {
  Thinner thinner(rate);
  int passed = 0;
  for (int i = 0; i < messages; ++i) passed += thinner.Pass(1e18 + step * i) ? 1 : 0;
  return passed;
}

TEST(ThinnerTest, KeepsTheRate) {
  EXPECT_EQ(Passed(100, 2e6, 500), 100);         // of 500 Hz over 1 s
  EXPECT_EQ(Passed(0, 2e6, 500), 500);           // no rate
  EXPECT_EQ(Passed(2000, 2e6, 500), 500);        // more than there are
  EXPECT_NEAR(Passed(300, 2e6, 5000), 3000, 1);  // no divisor of 500
  EXPECT_EQ(Passed(1e-3, 2e6, 500), 1);
}

TEST(ThinnerTest, AfterAPauseItGoesOnAtTheRateWithoutCatchingUp) {
  Thinner thinner(100);
  EXPECT_TRUE(thinner.Pass(0));
  EXPECT_TRUE(thinner.Pass(1e9));
  EXPECT_FALSE(thinner.Pass(1e9 + 2e6));
  EXPECT_TRUE(thinner.Pass(1e9 + 10e6));
}

TEST(ThinnerTest, ATimeThatBeginsAgainPasses) {
  Thinner thinner(100);
  EXPECT_TRUE(thinner.Pass(1e12));
  EXPECT_TRUE(thinner.Pass(0));
  EXPECT_FALSE(thinner.Pass(2e6));
  EXPECT_TRUE(thinner.Pass(10e6));
}

}  // namespace
}  // namespace poise
