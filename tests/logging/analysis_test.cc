#include "logging/metrics/analysis.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "logging/metrics/metrics.h"
#include "tests/logging/record_fixture.h"
#include "tests/test_seed.h"

namespace poise::logging {
namespace {

using AnalysisTest = RecordTest;

TEST_F(AnalysisTest, MetricsHaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (const Metric& metric : Metrics()) {
    EXPECT_TRUE(names.insert(metric.name).second) << metric.name;
    EXPECT_FALSE(metric.description.empty()) << metric.name;
  }
}

TEST_F(AnalysisTest, ComErrorIsTheLargestAfterTheWindowBegins) {
  for (size_t t = 0; t < kTicks; ++t) {
    plan_[t].com_reference.position[1] = 0.01;
    planner_[t].com_position[1] = 0.01 - 1e-4 * static_cast<double>(t);
    truth_[t].com_position[1] = 0.01 + 2e-4 * static_cast<double>(t);
  }
  planner_[3].com_position[1] = 1;  // before the window
  EXPECT_NEAR(Measure("com_error_max_y", 0.01), 9.9, 1e-9);
  EXPECT_NEAR(Measure("com_error_max_y"), 990, 1e-9);
  EXPECT_NEAR(Measure("com_error_true_max_y"), 19.8, 1e-9);
  EXPECT_NEAR(Measure("com_error_end"), 19.8, 1e-9);
  EXPECT_EQ(Measure("com_error_max_x"), 0);
}

TEST(Analysis, MessagesAreThoseOfTheTicksThatHaveOne) {
  Series<external_push_t> series;
  for (const int64_t tick : {2, 3, 5, 9}) {
    external_push_t push{};
    push.tick = tick;
    series.Set(tick, push);
  }
  std::vector<int64_t> ticks;
  for (const auto& [tick, push] : Messages(series, 3, 9)) {
    EXPECT_EQ(push->tick, tick);
    ticks.push_back(tick);
  }
  EXPECT_EQ(ticks, (std::vector<int64_t>{3, 5}));
  EXPECT_TRUE(Messages(series, 9, 3).empty());
}

TEST(Analysis, ATriangleMakesASymmetricMatrix) {
  const double triangle[] = {4, 1, 0, 9, 0, 16};
  const Eigen::MatrixXd matrix = FromTriangle(triangle, 3);
  EXPECT_EQ(matrix, (Eigen::Matrix3d() << 4, 1, 0, 1, 9, 0, 0, 0, 16).finished());
  EXPECT_NEAR(*NormalisedSquare(Eigen::Vector3d(0, 0, 2), matrix), 0.25, 1e-12);
  EXPECT_FALSE(NormalisedSquare(Eigen::Vector3d(1, 0, 0), -matrix).has_value());
}

TEST_F(AnalysisTest, BalancingIntervals) {
  for (size_t t = 20; t < 30; ++t) balance_[t].active_y = 1;
  for (size_t t = 28; t < 35; ++t) balance_[t].active_x = 1;
  balance_[50].active_x = 1;
  EXPECT_NEAR(Measure("balancing_first"), 0.040, 1e-12);
  EXPECT_NEAR(Measure("balancing_last"), 0.100, 1e-12);
  EXPECT_NEAR(Measure("balancing_active"), 16 * 0.002, 1e-12);
  EXPECT_EQ(Measure("balancing_activations"), 2);
}

TEST_F(AnalysisTest, BalancingThatNeverWasOnHasNoTimes) {
  const RunRecord run = Read();
  EXPECT_FALSE(FindMetric("balancing_first")->compute(run).has_value());
  EXPECT_EQ(FindMetric("balancing_activations")->compute(run), Answer(0));
}

TEST_F(AnalysisTest, MeasuredCopIsTheLoadsLever) {
  // 100 N on the right foot at y = -0.105, 300 N on the left at 0.105: the lever rule gives 0.0525,
  // and a moment of M_x shifts it by M_x / F_z.
  for (size_t t = 0; t < kTicks; ++t) {
    sensors_[t].foot_wrench[0].force[2] = -100;
    sensors_[t].foot_wrench[1].force[2] = -300;
    sensors_[t].foot_wrench[1].moment[0] = 4;
  }
  EXPECT_NEAR(Measure("cop_measured_max_y"), 1e3 * (0.0525 - 4 / 400.0), 1e-9);
}

TEST_F(AnalysisTest, MeasuredCopUsesTheFrameAndFeetOfTheTickBefore) {
  for (size_t t = 0; t < kTicks; ++t) {
    sensors_[t].foot_wrench[0].force[2] = sensors_[t].foot_wrench[1].force[2] = -200;
  }
  // Frame O of tick 10 stands 0.02 m to the left: the reading of tick 11 is off by that.
  balance_[10].frame_o.position[1] = 0.02;
  const RunRecord run = Read();
  EXPECT_FALSE(MeasuredCop(run, 0).has_value());
  EXPECT_NEAR((*MeasuredCop(run, 10))(1), 0, 1e-12);
  EXPECT_NEAR((*MeasuredCop(run, 11))(1), -0.02, 1e-12);
  EXPECT_NEAR((*MeasuredCop(run, 12))(1), 0, 1e-12);
}

TEST_F(AnalysisTest, MeasuredCopTurnsWithTheFrame) {
  // Turned by 90 degrees about z, O's x is the world's y: what was left is now ahead.
  for (size_t t = 0; t < kTicks; ++t) {
    sensors_[t].foot_wrench[1].force[2] = -300;
    sensors_[t].foot_wrench[0].force[2] = -100;
    balance_[t].frame_o.orientation[0] = balance_[t].frame_o.orientation[3] = std::sqrt(0.5);
  }
  const RunRecord run = Read();
  EXPECT_NEAR((*MeasuredCop(run, 5))(0), 0.0525, 1e-12);
  EXPECT_NEAR((*MeasuredCop(run, 5))(1), 0, 1e-12);
}

TEST_F(AnalysisTest, WrenchErrorPairsAReadingWithTheTickBefore) {
  for (size_t t = 0; t < kTicks; ++t) {
    command_[t].foot_wrench[0].force[2] = static_cast<double>(t);
    command_[t].foot_wrench[1].force[2] = static_cast<double>(t);
    sensors_[t].foot_wrench[0].force[2] = static_cast<double>(t) - 1 + 3;
    sensors_[t].foot_wrench[1].force[2] = static_cast<double>(t) - 1 - 4;
  }
  // RMS of 3 and 4.
  EXPECT_NEAR(Measure("foot_force_error_rms"), std::sqrt(12.5), 1e-12);
  EXPECT_NEAR(Measure("foot_moment_error_rms"), 0, 1e-12);
}

TEST_F(AnalysisTest, ViolatedTicksCountEveryCondition) {
  EXPECT_EQ(Measure("violated_ticks"), 0);
  command_[10].margins[1].roll = -0.001;
  command_[20].conditions_met[0] = 0;
  balance_[30].cop[1] = -0.0701;
  balance_[40].cop[1] = 0.07;  // on the bound
  command_[50].margins[0].yaw = -1;
  command_[50].in_contact[0] = 0;  // no foot of the contact model
  EXPECT_EQ(Measure("violated_ticks"), 3);
  EXPECT_NEAR(Measure("left_foot_roll_margin"), -0.001, 1e-15);
  EXPECT_NEAR(Measure("right_foot_yaw_margin"), 1, 1e-15);
  EXPECT_NEAR(Measure("cop_excess_y"), 0.1, 1e-9);
}

TEST_F(AnalysisTest, TorquesAndTheirSteps) {
  // The truth, whatever was ordered and commanded; of a real robot what the bridge ordered.
  truth_[40].joint_torque[3] = -60;
  truth_[41].joint_torque[3] = 15;
  bridge_[50].applied_torque[4] = -20;
  command_[60].torque[5] = 10;
  bridge_[kTicks - 1].saturations = 7;
  EXPECT_EQ(Measure("joint_torque_max"), 60);
  EXPECT_EQ(Measure("torque_step_max"), 75);
  // Joint 3 is a knee: 150 N·m by its effort, and 50 * 0.10 * 30 by its motor.
  EXPECT_NEAR(Measure("joint_torque_share"), 40, 1e-12);
  EXPECT_EQ(Measure("saturations"), 7);
  bridge_[60].saturated[2] = bridge_status_t::LIMIT_TORQUE | bridge_status_t::LIMIT_SLEW;
  bridge_[61].saturated[2] = bridge_status_t::LIMIT_THERMAL;
  bridge_[62].saturated[2] = bridge_status_t::LIMIT_SLEW;
  EXPECT_EQ(Measure("torque_limited"), 2);
  without_ = {"GROUND_TRUTH"};
  EXPECT_EQ(Measure("joint_torque_max"), 20);
  without_.insert("BRIDGE_STATUS");
  EXPECT_EQ(Measure("joint_torque_max"), 10);
  EXPECT_EQ(Measure("torque_step_max"), 10);
}

TEST_F(AnalysisTest, JointsBeyondTheirLimitsAreNamed) {
  const robot::RobotModel robot = Read().robot;
  const robot::Joint &knee = robot.joints()[3], &hip = robot.joints()[8];
  double nearest = -HUGE_VAL;  // at zero
  for (const robot::Joint& joint : robot.joints()) {
    nearest = std::max({nearest, joint.lower, -joint.upper});
  }
  EXPECT_EQ(Measure("joint_position_beyond"), nearest);
  const auto named = [&](const char* metric) { return FindMetric(metric)->joint(Read()); };
  truth_[30].joint_position[3] = knee.upper + 0.2;
  truth_[31].joint_position[8] = hip.lower - 0.3;
  EXPECT_NEAR(Measure("joint_position_beyond"), 0.3, 1e-12);
  EXPECT_EQ(named("joint_position_beyond"), hip.name);
  truth_[50].joint_velocity[3] = -1.5 * knee.velocity_limit;
  EXPECT_NEAR(Measure("joint_velocity_share"), 150, 1e-9);
  EXPECT_EQ(named("joint_velocity_share"), knee.name);
  // What moves while the robot is being stopped is not the controller's.
  for (size_t t = 31; t < kTicks; ++t) bridge_[t].state = bridge_status_t::STATE_DAMPING;
  EXPECT_NEAR(Measure("joint_position_beyond"), 0.2, 1e-12);
  EXPECT_EQ(Measure("joint_velocity_share"), 0);
}

TEST_F(AnalysisTest, PushPeakAndImpulse) {
  // A half sine of 25 samples' length: its integral is 2 peak T / pi.
  const double length = 0.05;
  for (size_t t = 0; t < kTicks; ++t) {
    const double time = 0.002 * static_cast<double>(t);
    if (time < length) push_[t].force[1] = 188.91 * std::sin(std::numbers::pi * time / length);
  }
  EXPECT_NEAR(Measure("push_peak"), 188.91, 0.4);  // the peak lies between two samples
  EXPECT_NEAR(Measure("push_impulse"), 2 * 188.91 * length / std::numbers::pi, 0.01);
}

TEST_F(AnalysisTest, EstimatorErrors) {
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.01, Eigen::Vector3d(0.6, 0.8, 0)));
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()));
  const Eigen::Quaterniond estimate = turn * tilt;
  for (size_t t = 0; t < kTicks; ++t) {
    truth_[t].base_position[0] = 0.003;
    truth_[t].base_position[2] = 0.004;
    truth_[t].base_linear_velocity[1] = t < kTicks / 2 ? 0 : 0.02;
    state_[t].base_orientation[0] = estimate.w();
    state_[t].base_orientation[1] = estimate.x();
    state_[t].base_orientation[2] = estimate.y();
    state_[t].base_orientation[3] = estimate.z();
  }
  EXPECT_NEAR(Measure("estimator_position_max"), 5, 1e-9);
  EXPECT_NEAR(Measure("estimator_position_rms"), 5, 1e-9);
  EXPECT_NEAR(Measure("estimator_velocity_max"), 20, 1e-9);
  EXPECT_NEAR(Measure("estimator_velocity_rms"), 20 * std::sqrt(0.5), 1e-9);
  EXPECT_NEAR(Measure("estimator_tilt_max"), 10, 1e-9);  // heading is no tilt
  EXPECT_GT(Measure("estimator_rotation_max"), 300);
}

TEST(Analysis, NeesIsTheSquaredErrorInStandardDeviations) {
  robot_state_t estimate{};
  ground_truth_t truth{};
  estimator_status_t status{};
  estimate.base_orientation[0] = truth.base_orientation[0] = 1;
  EXPECT_FALSE(Nees(estimate, status, truth, NeesPart::kAll).has_value());  // no covariance
  status.has_covariance = 1;
  EXPECT_FALSE(Nees(estimate, status, truth, NeesPart::kAll).has_value());  // of nothing

  // Standard deviations 2 mrad, 0.1 m/s, 0.01 m; errors of 1, 2 and 3 of them along one axis each.
  constexpr double kTurn = 2e-3, kSpeed = 0.1, kWay = 0.01;
  const auto diagonal = [](int i) { return i * 9 - i * (i - 1) / 2; };  // rows of 9, 8, 7, …
  for (int i = 0; i < 9; ++i) {
    const double deviation = i < 3 ? kTurn : i < 6 ? kSpeed : kWay;
    status.covariance[diagonal(i)] = deviation * deviation;
  }
  estimate.base_orientation[0] = std::cos(kTurn / 2);
  estimate.base_orientation[1] = std::sin(kTurn / 2);
  truth.base_linear_velocity[2] = 2 * kSpeed;
  estimate.base_position[0] = 3 * kWay;
  EXPECT_NEAR(*Nees(estimate, status, truth, NeesPart::kAll), 1 + 4 + 9, 1e-9);
  EXPECT_NEAR(*Nees(estimate, status, truth, NeesPart::kObservable), 1 + 4, 1e-9);

  // With a correlation ρ of two errors a and b: (a² − 2 ρ a b + b²) / (1 − ρ²).
  const double rho = 0.5;
  truth.base_linear_velocity[1] = kSpeed;
  status.covariance[diagonal(4) + 1] = rho * kSpeed * kSpeed;
  EXPECT_NEAR(*Nees(estimate, status, truth, NeesPart::kObservable),
              1 + (1 - 2 * rho * 2 + 4) / (1 - rho * rho), 1e-9);

  // Heading counts in the whole only.
  estimate.base_orientation[1] = 0;
  estimate.base_orientation[3] = std::sin(kTurn / 2);
  EXPECT_NEAR(*Nees(estimate, status, truth, NeesPart::kObservable),
              (1 - 2 * rho * 2 + 4) / (1 - rho * rho), 1e-9);

  status.covariance[diagonal(8)] = -1;
  EXPECT_FALSE(Nees(estimate, status, truth, NeesPart::kAll).has_value());
}

// Chi-squared with 9 and 5 degrees of freedom, by simulation.
TEST(Analysis, TheNeesBoundsHoldNinetyFivePercent) {
  std::mt19937_64 random(TestSeed(1));
  std::normal_distribution<double> normal;
  constexpr int kDraws = 100000;
  for (const auto& [part, freedom] : {std::pair(NeesPart::kAll, 9), {NeesPart::kObservable, 5}}) {
    int inside = 0;
    for (int i = 0; i < kDraws; ++i) {
      double sum = 0;
      for (int k = 0; k < freedom; ++k) {
        const double x = normal(random);
        sum += x * x;
      }
      inside += sum < NeesBound(part) ? 1 : 0;
    }
    EXPECT_NEAR(inside / double{kDraws}, 0.95, 4 * std::sqrt(0.95 * 0.05 / kDraws));
  }
}

TEST_F(AnalysisTest, FallIsSeen) {
  EXPECT_EQ(Measure("fallen"), 0);
  truth_[kTicks - 1].fallen = 1;
  EXPECT_EQ(Measure("fallen"), 1);
}

TEST_F(AnalysisTest, CompletenessOfTheLog) {
  std::vector<RawEvent> events = {RunInfoEvent(spec_)};
  // DRIVE_FEEDBACK and the others are absent: restrict the graph to two channels.
  const int first = ChannelIndex(spec_, "ROBOT_STATE");
  const int second = ChannelIndex(spec_, "EXTERNAL_PUSH");
  RunSpec spec = spec_;
  spec.mutable_graph()->clear_channel();
  *spec.mutable_graph()->add_channel() = spec_.graph().channel(first);
  *spec.mutable_graph()->add_channel() = spec_.graph().channel(second);
  events = {RunInfoEvent(spec)};
  for (const size_t t : {0, 1, 2, 4, 3, 5, 5}) Add("ROBOT_STATE", state_[t], &events);
  for (const size_t t : {0, 1, 3, 4}) Add("EXTERNAL_PUSH", push_[t], &events);
  state_[5].run_id = 43;
  Add("ROBOT_STATE", state_[5], &events);
  WriteRawLog(path_, events);
  const RunRecord run = ReadRun(path_);
  EXPECT_EQ(run.num_ticks, 6);
  ASSERT_EQ(run.channels.size(), 2u);
  EXPECT_EQ(run.channels[0].messages, 6);
  EXPECT_EQ(run.channels[0].missing, 0);
  EXPECT_EQ(run.channels[0].duplicate, 1);
  EXPECT_EQ(run.channels[0].out_of_order, 1);
  EXPECT_EQ(run.channels[0].refused, 1);
  EXPECT_EQ(run.channels[1].missing, 2);  // ticks 2 and 5
  EXPECT_EQ(FindMetric("log_defects")->compute(run), Answer(5));
}

TEST_F(AnalysisTest, LogWithoutRunInfoIsRefused) {
  WriteRawLog(path_, {{"ROBOT_STATE", 0, Encode(state_[0])}});
  EXPECT_THROW(ReadRun(path_), LogError);
}

}  // namespace
}  // namespace poise::logging
