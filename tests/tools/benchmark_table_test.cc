// A benchmark's figures of runs that exist in memory only.
#include "tools/benchmark/benchmark_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "components/framework/configuration/configuration.h"
#include "tests/logging/log_test_support.h"
#include "tools/benchmark/benchmark_set.h"

namespace poise {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Pushes from two directions; impulses are 10 N·s for each unit of the limit, on 5 kg.
class BenchmarkTableTest : public ::testing::Test {
 protected:
  BenchmarkTableTest() {
    ParseTextProto(
        "vary { name: \"direction\" value: 0 value: 90 }\n"
        "limit { name: \"impulse\" field: \"sim.push[0].scaled_impulse\" unit: \"u\" min: 1\n"
        "  max: 3 samples: 3 tolerance: 1 }\n",
        "test", &result_.header.sweep);
    result_.part.set_name("push");
    *result_.part.mutable_sweep() = result_.header.sweep;
  }
  /// Bounded: the pendulum's bound is 20 N·s.
  SweepRow& Add(int64_t run, double limit, const char* outcome, bool bounded = true) {
    SweepRow row;
    row.run = run;
    row.limit = limit;
    row.outcome = outcome;
    row.push = PushBound{.impulse = 10 * limit, .mass = 5};
    if (bounded) row.push->lip_impulse = row.push->lip_impulse_of_duration = 20;
    return result_.rows[{run, limit}] = row;
  }
  BenchmarkFigure Figure(const std::string& point) const {
    for (const BenchmarkFigure& figure : BenchmarkFigures(result_)) {
      if (figure.point == point) return figure;
    }
    ADD_FAILURE() << "no figure of " << point;
    return {};
  }

  BenchmarkResult result_;
};

TEST_F(BenchmarkTableTest, AnImpulseNeedsNoBound) {
  for (const int64_t run : {0, 1}) {
    Add(run, 1, kStands, false);
    Add(run, 2, kStands, run == 0);
    Add(run, 3, kFell, false);
  }
  EXPECT_EQ(Figure("direction 0").of_pendulum, 1);
  EXPECT_EQ(Figure("direction 90").impulse, 20);
  EXPECT_EQ(Figure("direction 90").per_mass, 4);
  EXPECT_FALSE(Figure("direction 90").of_pendulum);
  EXPECT_EQ(Figure("mean").impulse, 20);
  EXPECT_EQ(Figure("least").impulse, 20);
  EXPECT_FALSE(Figure("mean").of_pendulum) << "a mean without one of the points is none";
  EXPECT_THAT(BenchmarkCsv({result_}), HasSubstr("push,direction 90,2,u,,20,4,,,,,,\n"));
  EXPECT_THAT(FormatBenchmark({result_}), HasSubstr("–"));
}

TEST_F(BenchmarkTableTest, ARunThatDoesNotTellIsNamedAndEntersNothing) {
  for (const int64_t run : {0, 1}) {
    Add(run, 1, kStands);
    Add(run, 2, kStands);
    Add(run, 3, kFell);
  }
  const std::string whole = BenchmarkCsv({result_});
  SweepRow& crashed = result_.rows.at({1, 3});
  crashed.outcome = kCrashed;
  crashed.component = "policy";
  crashed.stage = "walk";
  crashed.reason = "ended by signal 11 (Segmentation fault)";
  EXPECT_EQ(Figure("direction 0").value, 2);
  EXPECT_FALSE(Figure("direction 90").value);
  EXPECT_FALSE(Figure("direction 90").impulse);
  EXPECT_FALSE(Figure("mean").value);
  EXPECT_FALSE(Figure("least").impulse);
  const std::string csv = BenchmarkCsv({result_});
  EXPECT_NE(Sha1(csv), Sha1(whole));
  EXPECT_THAT(csv, HasSubstr("\"run 1: direction 90, impulse 3\",,,,,,,,crashed,policy,walk,"
                             "ended by signal 11 (Segmentation fault)\n"));
  const std::string table = FormatBenchmark({result_});
  EXPECT_THAT(table, HasSubstr("not known"));
  EXPECT_THAT(table, HasSubstr("crashed in policy, stage walk"));
}

TEST_F(BenchmarkTableTest, BoundsAreSaidWhereTheyAre) {
  for (const double limit : {1, 2, 3}) Add(0, limit, kStands);
  Add(1, 1, kStands);
  Add(1, 2, kStands);
  Add(1, 3, kFell);
  EXPECT_EQ(Figure("direction 0").bound, "at least");
  EXPECT_EQ(Figure("mean").bound, "at least");
  EXPECT_EQ(Figure("least").bound, "") << "the other one is the least, and known";
  EXPECT_EQ(Figure("least").value, 2);
  // Not even the smallest: it is below that, and so is a mean with it.
  for (const double limit : {1, 2, 3}) result_.rows.at({1, limit}).outcome = kFell;
  EXPECT_EQ(Figure("direction 90").bound, "below");
  EXPECT_EQ(Figure("direction 90").value, 1);
  EXPECT_EQ(Figure("least").bound, "below");
  EXPECT_FALSE(Figure("mean").value) << "more than one and less than the other";
}

TEST_F(BenchmarkTableTest, ARunThatMissesWhatIsAskedOfItDoesNotCountAsOneThatStands) {
  result_.header.sweep.clear_limit();
  Add(0, 0, kStands);
  SweepRow& missed = Add(1, 0, kMissed);
  missed.reason = "sole above the other: 0 mm, must be ≥ 10 mm";
  EXPECT_EQ(Figure("stand, of 2").value, 1);
  EXPECT_THAT(FormatBenchmark({result_}),
              HasSubstr("1 run stood and did not do what is asked:\n  run 1"));
  EXPECT_THAT(FormatBenchmark({result_}), HasSubstr("0 mm, must be ≥ 10 mm"));
}

TEST_F(BenchmarkTableTest, AShareIsOfTheRunsThatTell) {
  result_.header.sweep.clear_limit();
  for (const char* outcome : {kStands, kFell}) Add(outcome == kFell, 0, outcome);
  EXPECT_EQ(Figure("stand, of 2").value, 1);
  result_.rows.at({1, 0}).outcome = kStopped;
  EXPECT_EQ(Figure("stand, of 1").value, 1);
  EXPECT_THAT(BenchmarkCsv({result_}), HasSubstr(",stopped,"));
}

// What is measured with a set is compared over years: a change makes another set. The sums are
// those of the sets when each was a file of its own.
TEST(BenchmarkSetTest, EachSetIsFixed) {
  const std::pair<const char*, const char*> kSets[] = {
      {"balance_1", "f9aff9fec2be91bcde81fccbdf85364470984b53"},
      {"balance_2", "0a8da7b90aafe86f4579d540a39543ec1092b077"},
      {"balance_3", "9370344bbf0cb6ec319f948addbcb6d76fe6534e"},
      {"balance_4", "a107f59bbc2926a5db9632b7a0109d2497542ca5"}};
  for (const auto& [name, sum] : kSets) {
    EXPECT_EQ(Sha1(BenchmarkSet(name, BenchmarkSubject()).text()), sum) << name;
  }
}

TEST(BenchmarkSetTest, AChangeThatCannotBeIsNamedByFileAndLine) {
  const logging::TemporaryFolder folder;
  const std::string file = folder.path("changed_set.pbtxt");
  const auto problem = [&](const char* change) -> std::string {
    std::ofstream(file) << "base: \"balance_4\"\nname: \"mine\"\nset: \"" << change << "\"\n";
    try {
      BenchmarkSet(file, BenchmarkSubject());
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(problem("part[blocks].quick=1"), "");
  EXPECT_THAT(problem("part[block].quick=1"), HasSubstr(file + ":3: set[0]: "));
  EXPECT_THAT(problem("part[block].quick=1"), HasSubstr("no part is called 'block'"));
  EXPECT_THAT(problem("part[blocks].quick"), HasSubstr("write FIELD=VALUE"));
  EXPECT_THAT(problem("part[blocks].quick=0"), HasSubstr("quick"));
}

}  // namespace
}  // namespace poise
