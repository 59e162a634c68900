// Checks that a run cannot answer: they pass nothing and fail nothing, and say what is missing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "poise/drive_feedback_t.hpp"
#include "tests/logging/record_fixture.h"
#include "tools/report/report.h"
#include "tools/report/run_screen.h"
#include "tools/report/run_story.h"

namespace poise {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class UnknownChecksTest : public logging::RecordTest {
 protected:
  UnknownChecksTest() {
    spec_.set_num_ticks(kTicks);
    without_ = {"SUPPORT_PLAN", "PLANNER_STATUS", "TASK_TORQUE", "BALANCE_TORQUE"};
    Limit("fallen", 0);
    Limit("com_error_end", 10);
  }
  void Limit(const std::string& metric, double at_most) {
    Check* const check = scenario_.add_check();
    check->set_metric(metric);
    check->set_label("the " + metric);
    check->set_at_most(at_most);
  }
  /// Without that of the log, which lacks channels of its graph.
  std::vector<CheckResult> Evaluate() {
    std::vector<CheckResult> checks = EvaluateChecks(scenario_, Read());
    std::erase_if(checks, [](const CheckResult& check) { return check.name == "log_defects"; });
    return checks;
  }
  std::string Lines() { return FormatVerdictLines(scenario_, Evaluate(), "", false); }
  std::string Tell() {
    const logging::RunRecord run = Read();
    return TellRun(run, EvaluateChecks(scenario_, run), logging::Events(run), "");
  }
  /// Upright on both feet, each of which carries.
  void Stand() {
    for (ground_truth_t& truth : truth_) {
      truth.com_position[2] = 0.7;
      for (wrench_t& wrench : truth.foot_wrench) wrench.force[2] = -1000;
    }
  }

  Scenario scenario_;
};

TEST_F(UnknownChecksTest, FeetWhoseSensorsAreAbsentAreObserved) {
  Limit("cop_measured_max_x", 10);
  EXPECT_EQ(Evaluate().back().label, "the cop_measured_max_x");
  for (robot_sensors_t& sensors : sensors_) {
    std::ranges::fill(sensors.foot_sensor, drive_feedback_t::SENSOR_ABSENT);
  }
  const CheckResult check = Evaluate().back();
  EXPECT_THAT(check.label, HasSubstr("observed"));
  EXPECT_EQ(check.missing.front(), "ROBOT_SENSORS.foot_wrench or ROBOT_STATE.foot_wrench");
}

TEST(FormatMeasured, ShowsByHowMuchALimitIsBroken) {
  CheckResult check;
  check.measured = 70.000003;
  check.at_most = 70.000001;
  check.unit = "mm";
  EXPECT_EQ(FormatMeasured(check), "70 mm");
  check.passed = false;
  EXPECT_EQ(FormatMeasured(check), "70.000003 mm");
}

TEST_F(UnknownChecksTest, TheyPassNothingAndFailNothing) {
  const std::vector<CheckResult> checks = Evaluate();
  EXPECT_TRUE(ChecksPass(checks));
  EXPECT_EQ(FormatVerdict(checks, ""), "passed: 3 of 3 checks hold, 1 not known");
  EXPECT_THAT(Lines(), HasSubstr("checks hold, 1 not known, 1 of them above"));
  EXPECT_THAT(Lines(), HasSubstr("not known: the com_error_end (com_error_end), which needs\n"
                                 "    SUPPORT_PLAN.com_reference"));
  const CheckResult& error = checks.back();
  EXPECT_EQ(FormatMeasured(error), "not known");
  EXPECT_EQ(VerdictCell(error).text, "not known");
  const nlohmann::ordered_json json = ChecksJson(checks);
  EXPECT_EQ(json.back()["missing"].dump(), "[\"SUPPORT_PLAN.com_reference\"]");
  EXPECT_EQ(json.back()["passed"], true);
  EXPECT_EQ(json[0]["missing"].dump(), "[]");
  nlohmann::json summary;
  summary["checks"] = nlohmann::json::parse(json.dump());
  EXPECT_THAT(ChecksOf(summary).back().missing, ElementsAre("SUPPORT_PLAN.com_reference"));
}

TEST_F(UnknownChecksTest, WhatBreaksALimitFailsBesideThem) {
  truth_[50].fallen = 1;
  EXPECT_FALSE(ChecksPass(Evaluate()));
  EXPECT_THAT(Lines(), HasSubstr("FAILED: 1 of 3 checks, 1 not known"));
}

TEST_F(UnknownChecksTest, ARunOfWhichNoneOfItsOwnIsKnownIsNotPassed) {
  without_.insert("GROUND_TRUTH");
  EXPECT_FALSE(ChecksPass(Evaluate()));
  EXPECT_THAT(Lines(), HasSubstr("FAILED: none of the scenario's own checks is known"));
  scenario_.clear_check();
  EXPECT_TRUE(ChecksPass(Evaluate())) << "it asks for nothing";
}

// What never happened breaks a limit: balancing that was to set in.
TEST_F(UnknownChecksTest, WhatNeverHappenedFailsItsLimit) {
  without_.clear();
  Limit("balancing_first", 0.1);
  EXPECT_FALSE(ChecksPass(Evaluate()));
  EXPECT_EQ(FormatMeasured(Evaluate().back()), "none");
}

TEST_F(UnknownChecksTest, TheShortTableShowsTheLimitThatDecides) {
  without_.clear();
  scenario_.set_paper_section("7.2");
  scenario_.mutable_check(1)->set_paper("35 mm");
  scenario_.mutable_check(1)->set_at_most(45);
  const logging::RunRecord run = Read();
  const std::vector<CheckResult> checks = EvaluateChecks(scenario_, run);
  const std::string screen = FormatScreen({scenario_, run, checks, {}, ""});
  EXPECT_THAT(screen, HasSubstr("35 mm  ≤ 45 mm"));
  EXPECT_THAT(Lines(), HasSubstr("1 of them above"));
}

TEST_F(UnknownChecksTest, AVariantWithChecksOfItsOwnIsNamed) {
  Variant* const variant = scenario_.add_variant();
  variant->set_name("harder");
  scenario_.mutable_applied()->set_variant("harder");
  const logging::RunRecord run = Read();
  const std::vector<CheckResult> checks = EvaluateChecks(scenario_, run);
  const auto screen = [&] { return FormatScreen({scenario_, run, checks, {}, ""}); };
  EXPECT_THAT(screen(), Not(HasSubstr("harder")));
  variant->add_check()->set_metric("fallen");
  EXPECT_THAT(screen(), HasSubstr("those of the variant harder"));
}

TEST_F(UnknownChecksTest, FeetThatCarryAreTold) {
  for (joint_command_t& command : command_) command.in_contact[0] = command.in_contact[1] = 0;
  EXPECT_THAT(Tell(), Not(HasSubstr("foot"))) << "nothing carries";
  EXPECT_THAT(Tell(), Not(HasSubstr("feet")));
  Stand();
  EXPECT_THAT(Tell(), HasSubstr("The robot stood on both feet to the end"));
  EXPECT_THAT(Tell(), Not(HasSubstr("balancing")));
  without_.insert("GROUND_TRUTH");
  EXPECT_THAT(Tell(), HasSubstr("The robot ran to the end"));
}

// A command that claims both feet all the time, of a robot that walks.
TEST_F(UnknownChecksTest, AWalkIsNoStandWhateverTheCommandSays) {
  spec_.set_tick_period(0.02);
  Stand();
  for (size_t t = 0; t < kTicks; ++t) truth_[t].com_position[0] = 0.01 * static_cast<double>(t);
  for (size_t step = 0; step < 5; ++step) {
    for (size_t t = 10 + 15 * step; t < 20 + 15 * step; ++t) {
      truth_[t].foot_wrench[step % 2].force[2] = 0;
    }
  }
  const std::string text = Tell();
  EXPECT_THAT(text, Not(HasSubstr("on both feet to the end")));
  EXPECT_THAT(text, HasSubstr("changed its support 10 times"));
  EXPECT_THAT(text, HasSubstr("and stood to the end"));
  EXPECT_THAT(
      text, HasSubstr("It walked 5 steps, a way of 0.6 m between touch-downs, at up to 0.5 m/s."));
}

TEST_F(UnknownChecksTest, AWalkThatGoesOnAtTheEndIsNoStand) {
  spec_.set_tick_period(0.02);
  Stand();
  for (size_t t = 10; t < 20; ++t) truth_[t].foot_wrench[0].force[2] = 0;
  for (size_t t = 20; t < kTicks; ++t) truth_[t].foot_pose[0].position[0] = 0.1;
  EXPECT_THAT(Tell(), HasSubstr("stood to the end"));
  for (size_t t = 90; t < kTicks; ++t) truth_[t].foot_wrench[1].force[2] = 0;
  EXPECT_THAT(Tell(), HasSubstr("and did not fall to the end"));
  EXPECT_THAT(Tell(), Not(HasSubstr("stood")));
}

// A rattle of 4 ms every 10 ms, as a chattering torque makes it.
TEST_F(UnknownChecksTest, ARattlingRobotMakesNoStep) {
  Stand();
  for (size_t t = 0; t < kTicks; ++t) {
    if (t % 5 < 2) truth_[t].foot_wrench[1].force[2] = 0;
  }
  EXPECT_THAT(Tell(), HasSubstr("The robot stood on both feet to the end"));
  EXPECT_THAT(Tell(), Not(HasSubstr("step")));
}

TEST_F(UnknownChecksTest, ReadingsOfNoPushAreNoPush) {
  Stand();
  push_[0].force[0] = -0.1;
  logging::RunRecord run = Read();
  run.num_ticks = 1;  // it ended at once
  EXPECT_THAT(TellRun(run, {}, logging::Events(run), ""), Not(HasSubstr("ushed")));
  for (size_t t = 0; t < kTicks; ++t) push_[t].force[t % 3] = t % 2 == 0 ? 0.3 : -0.3;
  EXPECT_THAT(Tell(), Not(HasSubstr("ushed")));
  for (const char* metric : {"push_peak", "push_impulse"})
    EXPECT_TRUE(Unanswered(metric)) << metric;
  push_[50].force[1] = 20;
  EXPECT_NEAR(Measure("push_peak"), 20, 0.1);
  EXPECT_THAT(Tell(), HasSubstr("Pushed from the right with up to 20.0 N"));
}

// As a run within one process leaves it: each component tells why the run ended.
TEST_F(UnknownChecksTest, TheComponentThatEndedTheRunIsNamedAlone) {
  spec_.set_num_ticks(2 * kTicks);
  logging::RunRecord run = Read();
  for (const char* name : {"alpha", "own_torque"}) {
    run.spec.mutable_graph()->add_component()->set_name(name);
    run.health[name].state = health_t::STATE_FAILED;
    run.health[name].detail = "own_torque: output joint_command is not finite at tick 100";
  }
  EXPECT_EQ(EndReason(run), "own_torque: output joint_command is not finite at tick 100");
  run.health["own_torque"].detail = "output joint_command is not finite at tick 100";
  run.health.erase("alpha");
  EXPECT_EQ(EndReason(run), "own_torque: output joint_command is not finite at tick 100");
}

TEST_F(UnknownChecksTest, ARobotThatLiesOrHangsWithoutMotorsDoesNotStand) {
  Stand();
  for (size_t t = 0; t < kTicks; ++t) {
    bridge_[t].state = t < 50 ? bridge_status_t::STATE_RUNNING : bridge_status_t::STATE_STOPPED;
    bridge_[t].reason = t < 50 ? bridge_status_t::REASON_NONE : bridge_status_t::REASON_OPERATOR;
  }
  EXPECT_THAT(Tell(), HasSubstr("did not fall to the end"));
  EXPECT_THAT(Tell(), HasSubstr("stopped: operator"));
  for (size_t t = 60; t < kTicks; ++t) truth_[t].com_position[2] = 0.2;
  const std::string text = Tell();
  EXPECT_THAT(text, Not(HasSubstr("stood")));
  EXPECT_THAT(text, HasSubstr("fell at 0.120 s"));
  EXPECT_THAT(text, HasSubstr("0.20 m above its lower sole, at first 0.70 m"));
}

}  // namespace
}  // namespace poise
