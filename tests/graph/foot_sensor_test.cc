// Whole runs whose feet have no sensors, or sensors that fail: what is noticed, when, and that the
// robot stands.
#include <gtest/gtest.h>

#include <map>

#include "fmt/format.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

std::map<std::string, nlohmann::json> Measured(const std::string& run) {
  std::map<std::string, nlohmann::json> checks;
  const nlohmann::json summary = ReadSummary(run);
  for (const nlohmann::json& check : summary["checks"]) checks[check["name"]] = check["measured"];
  return checks;
}

class NoFootSensors : public testing::TestWithParam<const char*> {};

// The scenario's own checks of the variant hold the observer to the simulator's true wrenches.
TEST_P(NoFootSensors, TheRobotStandsByWhatIsObserved) {
  const RunFolder folder;
  const ProgramResult result =
      RunPoise({"run", GetParam(), "--variant", "no_foot_sensors", "--inline", "--quiet",
                "--no-reference", "--out", folder / "run"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  const auto measured = Measured(folder / "run");
  EXPECT_GT(measured.at("observer_force_rms").get<double>(), 0) << "an error that nobody saw";
  EXPECT_EQ(measured.at("false_touch_downs").get<double>(), 0);
  const bool lands = std::string(GetParam()) == "unknown_surface";
  EXPECT_EQ(measured.at("touch_down_delay_max").is_number(), lands) << measured;
}

INSTANTIATE_TEST_SUITE_P(Scenarios, NoFootSensors,
                         testing::Values("push_double_support", "contact_transition",
                                         "unknown_surface"),
                         [](const auto& test) { return std::string(test.param); });

struct SensorFault {
  const char* scenario;
  const char* kind;
  double start;    ///< s
  double force_z;  ///< N, of BIASED
  /// s from the fault: INVALID is told by the sensor, a difference must last 0.05 s, a reading must
  /// repeat for 0.1 s; zero is what a free foot's good sensor reads, until it has come down (15 s
  /// later) and the search has pressed with more than the 80 N by which the two must differ.
  double noticed;
  const char* text;  ///< of the event
};

class FailingFootSensor : public testing::TestWithParam<SensorFault> {};

TEST_P(FailingFootSensor, IsNoticedAndSurvived) {
  const SensorFault& fault = GetParam();
  const RunFolder folder;
  const std::string field = "sim.foot_sensor_fault[0].";
  const auto set = [&](const char* name, const auto& value) {
    return fmt::format("{}{}={}", field, name, value);
  };
  const ProgramResult result =
      RunPoise({"run", fault.scenario, "--inline", "--quiet", "--no-reference", "--out",
                folder / "run", "--set", set("foot", "left"), "--set", set("kind", fault.kind),
                "--set", set("start", fault.start), "--set", set("force_z", fault.force_z)});
  EXPECT_NE(result.exit_code, 2) << result.output;  // a late landing fails its own check
  EXPECT_EQ(Measured(folder / "run").at("fallen").get<double>(), 0);
  const nlohmann::json summary = ReadSummary(folder / "run");
  EXPECT_EQ(summary["simulated_time"], fault.scenario == std::string("unknown_surface") ? 30 : 3);
  const ProgramResult report = RunPoise({"report", folder / "run", "--full"});
  ASSERT_NE(report.exit_code, 2) << report.output;
  // The event's line begins with its time.
  const size_t event = report.output.find(" s  foot sensor fault");
  ASSERT_NE(event, std::string::npos) << report.output;
  const size_t line = report.output.rfind('\n', event) + 1;
  const double time = std::stod(report.output.substr(line, event - line));
  EXPECT_GE(time, fault.start);
  EXPECT_LE(time, fault.start + fault.noticed);
  EXPECT_NE(report.output.find(fault.text, event), std::string::npos) << report.output;
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, FailingFootSensor,
    testing::Values(SensorFault{"push_double_support", "DEAD", 0.2, 0, 0.06, "reads zero"},
                    SensorFault{"push_double_support", "INVALID", 0.2, 0, 0.004, "no valid"},
                    SensorFault{"push_double_support", "FROZEN", 0.2, 0, 0.15, "the same all the"},
                    SensorFault{"push_double_support", "BIASED", 0.2, 150, 0.08, "differs from"},
                    SensorFault{"unknown_surface", "DEAD", 10, 0, 18, "reads zero"},
                    SensorFault{"unknown_surface", "INVALID", 10, 0, 0.004, "no valid"},
                    SensorFault{"unknown_surface", "FROZEN", 10, 0, 0.15, "the same all the"},
                    SensorFault{"unknown_surface", "BIASED", 10, -150, 0.08, "differs from"}),
    [](const auto& test) { return std::string(test.param.scenario) + "_" + test.param.kind; });

}  // namespace
}  // namespace poise
