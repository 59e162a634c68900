// What the page of a run in progress is told of its log.
#include "tools/live/run_status.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "tests/logging/record_fixture.h"

namespace poise {
namespace {

using Json = nlohmann::ordered_json;

class RunStatusTest : public logging::RecordTest {
 protected:
  RunStatusTest() {
    spec_.set_num_ticks(2 * kTicks);
    spec_.set_poise_commit("0123456789abcdef");
    spec_.set_instruction_set("x86-64-v3");
    Check* const check = scenario_.add_check();
    check->set_metric("com_error_end");
    check->set_at_most(-1);  // no run holds it
    scenario_.add_check()->set_metric("push_peak");
    Read();  // writes the log
  }
  static Json Named(const Json& json, const std::string& name) {
    const auto found =
        std::ranges::find_if(json, [&](const Json& item) { return item["name"] == name; });
    return found == json.end() ? Json() : *found;
  }
  /// The newest, as soon as there is one.
  static Json Next(RunStatus* status) {
    for (int i = 0; i < 3000; ++i) {
      if (const std::optional<Json> newest = status->Take()) return *newest;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ADD_FAILURE() << "no status";
    return {};
  }

  Scenario scenario_;
};

TEST_F(RunStatusTest, NoCheckHasAVerdictBeforeTheEnd) {
  const Json status = StatusJson(path_, scenario_, false);
  EXPECT_EQ(status["ended"], false);
  EXPECT_EQ(status["checked_ticks"], kTicks);
  ASSERT_GE(status["checks"].size(), 2u);
  for (const Json& check : status["checks"]) EXPECT_TRUE(check["passed"].is_null()) << check;
  EXPECT_TRUE(Named(status["checks"], "duration_reached").is_null());
  EXPECT_TRUE(Named(status["checks"], "log_defects").is_null());
  EXPECT_TRUE(Named(status["events"], "run_ended").is_null());
  EXPECT_FALSE(status.contains("run"));
}

TEST_F(RunStatusTest, TheEndDecidesAllOfThem) {
  const Json status = StatusJson(path_, scenario_, true);
  EXPECT_EQ(status["ended"], true);
  EXPECT_EQ(Named(status["checks"], "com_error_end")["passed"], false);
  EXPECT_EQ(Named(status["checks"], "duration_reached")["passed"], false);
  // The record has not all channels of its graph.
  EXPECT_EQ(Named(status["checks"], "log_defects")["passed"], false);
  EXPECT_THAT(Named(status["events"], "run_ended")["detail"].get<std::string>(),
              testing::HasSubstr("before its planned end"));
  EXPECT_EQ(status["run"]["ticks"], kTicks);
  EXPECT_EQ(status["run"]["poise_commit"], "0123456789abcdef");
  EXPECT_EQ(status["run"]["instruction_set"], "x86-64-v3");
}

TEST_F(RunStatusTest, APartOfARunIsNotJudgedByTheRunsEnd) {
  spec_.mutable_cut()->set_first_tick(40);
  spec_.mutable_cut()->set_last_tick(kTicks - 1);
  Read();
  const Json status = StatusJson(path_, scenario_, true);
  EXPECT_TRUE(Named(status["checks"], "duration_reached")["limit"].is_null());
  EXPECT_TRUE(Named(status["events"], "run_ended").is_null());
  EXPECT_EQ(status["run"]["cut"]["first_tick"], 40);
}

TEST_F(RunStatusTest, TheLastStatusIsThatOfTheEnd) {
  RunStatus status(path_, scenario_);
  EXPECT_EQ(Next(&status)["ended"], false);
  status.Finish();
  Json last = Next(&status);
  if (last["ended"] == false) last = Next(&status);  // read just before
  EXPECT_EQ(last["ended"], true);
}

TEST_F(RunStatusTest, AnEndWithoutAReadableLogSaysWhy) {
  RunStatus status(folder_.path("none.lcm"), scenario_);
  status.Finish();
  const Json last = Next(&status);
  EXPECT_EQ(last["ended"], true);
  EXPECT_THAT(last["problem"].get<std::string>(), testing::HasSubstr("none.lcm"));
}

}  // namespace
}  // namespace poise
