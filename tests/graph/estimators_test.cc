// Both methods of the state estimator beside the truth, in a run's table and by `poise estimators`.
#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "fmt/format.h"
#include "logging/run_record.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

std::map<std::string, nlohmann::json> Checks(const std::string& run) {
  std::map<std::string, nlohmann::json> checks;
  const nlohmann::json summary = ReadSummary(run);
  for (const nlohmann::json& check : summary["checks"]) checks[check["name"]] = check["measured"];
  return checks;
}

std::string RunBy(const std::string& out, const std::string& method) {
  const ProgramResult result =
      RunPoise({"run", "push_double_support", "--inline", "--quiet", "--set", "duration=0.6",
                "--set", "state_estimator.method=" + method, "--out", out});
  EXPECT_NE(result.exit_code, 2) << result.output;  // what needs the whole run may fail
  return out;
}

/// The line of `poise estimators` that begins with `method`, or has it second.
std::string LineOf(const std::string& method, const std::string& table) {
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);) {
    if (line.find(method) != std::string::npos) return line;
  }
  return "";
}

TEST(Estimators, BothAreInTheTableWhicheverRan) {
  const RunFolder folder;
  for (const std::string method : {"ANCHORED_FEET", "INVARIANT_EKF"}) {
    SCOPED_TRACE(method);
    const std::string run = RunBy(folder / method, method);
    const auto checks = Checks(run);
    // The robot as simulated has encoders of 0.02 mrad, gears that wind up by up to 0.6 mrad on
    // legs of 0.8 m, an IMU with a bias.
    EXPECT_LT(checks.at("anchored_feet_position_rms").get<double>(), 2);
    EXPECT_LT(checks.at("invariant_ekf_position_rms").get<double>(), 0.2);
    EXPECT_LT(checks.at("invariant_ekf_position_rms").get<double>(),
              0.5 * checks.at("anchored_feet_position_rms").get<double>());
    EXPECT_GT(checks.at("invariant_ekf_nees_share").get<double>(), 0.9);

    // The same again from the log.
    const ProgramResult again = RunPoise({"estimators", run});
    ASSERT_EQ(again.exit_code, 0) << again.output;
    for (const auto& [name, prefix] :
         {std::pair("ANCHORED_FEET", "anchored_feet"), {"INVARIANT_EKF", "invariant_ekf"}}) {
      const double rms = checks.at(fmt::format("{}_velocity_rms", prefix)).get<double>();
      EXPECT_NE(LineOf(name, again.output).find(fmt::format("{:.4g} mm/s", rms)), std::string::npos)
          << rms << "\n"
          << again.output;
    }
    const logging::RunRecord record = logging::ReadRun(run + "/run.lcm");
    ASSERT_NE(record.estimator.at(0), nullptr);
    EXPECT_EQ(record.estimator.at(0)->has_covariance, method == "INVARIANT_EKF" ? 1 : 0);
  }
}

TEST(Estimators, SettingsCanBeTriedOnALog) {
  const RunFolder folder;
  const std::string run = RunBy(folder / "run", "ANCHORED_FEET");
  const auto line = [&](const std::string& set) {
    const ProgramResult result = RunPoise({"estimators", run, "--set", set});
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return LineOf("INVARIANT_EKF", result.output);
  };
  EXPECT_NE(line("state_estimator.invariant_ekf.gear_stiffness=0"),
            line("state_estimator.invariant_ekf.sensor_delay=0.002"));
}

TEST(Estimators, WhatCannotBeEstimatedIsSaid) {
  const RunFolder folder;
  const std::string run = RunBy(folder / "run", "ANCHORED_FEET");
  ExpectUsageError({"estimators", run, "--set", "state_estimator.no_such=1"}, {"no_such"});
  ExpectUsageError({"estimators", run, "--from", "5"}, {"--from 5", "0.6 s"});
}

}  // namespace
}  // namespace poise
