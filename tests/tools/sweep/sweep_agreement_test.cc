#include "tools/sweep/sweep_agreement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "components/framework/configuration/configuration.h"
#include "tools/sweep/sweep_points.h"

namespace poise {
namespace {

using testing::HasSubstr;

/// Two directions, forces 10, 20, 30, 40 N; `survived`: the largest that stands, by direction.
EngineRows Rows(const Sweep& sweep, const std::string& engine, std::vector<double> survived) {
  EngineRows world{engine, {}};
  const SweepPoints points(sweep);
  for (int64_t run = 0; run < points.size(); ++run) {
    const std::vector<SweepValue> place = points.At(run);
    SweepRow row;
    row.run = run;
    row.outcome = place[1].number <= survived[place[0].number > 0 ? 1 : 0] ? kStands : kFell;
    world.rows[{run, 0}] = row;
  }
  return world;
}

TEST(SweepAgreement, CountsOutcomesAndFindsHowFarTheLimitsAreApart) {
  Sweep sweep;
  ParseTextProto(
      "vary { name: 'direction' from: 0 to: 180 steps: 2 angle: true }"
      "vary { name: 'force' from: 10 to: 40 steps: 4 unit: 'N' }",
      "test", &sweep);
  const std::string text =
      FormatAgreement(sweep, Rows(sweep, "ode", {20, 40}), Rows(sweep, "mujoco", {40, 40}));
  EXPECT_THAT(text, HasSubstr("the same outcome in 6 of 8 runs (75.0 %); stand: ode 6, mujoco 8"));
  EXPECT_THAT(text, HasSubstr("fell in ode, stands in mujoco: 2 runs: 2, 3\n"));
  EXPECT_THAT(text, HasSubstr("the same at 1 of 2 points; apart by at most 20 N, 50.0 %"));
  EXPECT_EQ(text.find("direction"), std::string::npos);
}

TEST(SweepAgreement, HasNoLimitsOfRandomRunsAndNothingOfNone) {
  Sweep sweep;
  ParseTextProto("random: 8 vary { name: 'a' from: 0 to: 1 } vary { name: 'b' from: 10 to: 40 }",
                 "test", &sweep);
  const EngineRows rows = Rows(sweep, "ode", {20, 20});
  EXPECT_THAT(FormatAgreement(sweep, rows, rows), HasSubstr("in 8 of 8 runs (100.0 %)"));
  EXPECT_EQ(FormatAgreement(sweep, rows, rows).find("largest"), std::string::npos);
  EXPECT_EQ(FormatAgreement(sweep, rows, {"mujoco", {}}), "no run to compare\n");
}

}  // namespace
}  // namespace poise
