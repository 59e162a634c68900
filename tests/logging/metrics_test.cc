#include "logging/metrics/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "components/step_planner/step_planner.pb.h"
#include "google/protobuf/text_format.h"
#include "tests/logging/record_fixture.h"

namespace poise::logging {
namespace {

class MetricsTest : public RecordTest {
 protected:
  /// Compared with the run as it was at KeepAsReference.
  void KeepAsReference() { reference_ = std::make_shared<RunRecord>(Read()); }
  Answer Compare(const std::string& name) {
    RunRecord run = Read();
    run.reference = reference_;
    return FindMetric(name)->compute(run);
  }
  /// The left foot off the ground in ticks [from, to).
  void LiftLeft(size_t from, size_t to) {
    for (size_t t = from; t < to; ++t) {
      plan_[t].in_contact[1] = command_[t].in_contact[1] = 0;
      planner_[t].foot_state[1] = planner_status_t::FOOT_SWING;
    }
  }

  std::shared_ptr<RunRecord> reference_;
};

TEST_F(MetricsTest, ComMotionIsFromWhereTheWindowBegan) {
  // On a circle of 4 mm radius, a quarter of it a tenth of a second: the chord is 8 mm sin(a/2).
  for (size_t t = 0; t < kTicks; ++t) {
    const double angle = 0.5 * std::numbers::pi * static_cast<double>(t) / (kTicks - 1);
    truth_[t].com_position[0] = 0.004 * std::cos(angle);
    truth_[t].com_position[2] = 0.7 + 0.004 * std::sin(angle);
  }
  EXPECT_NEAR(Measure("com_motion_max"), 8 * std::sin(std::numbers::pi / 4), 1e-9);
  const double from = 33 * kPeriod;  // two thirds are left
  EXPECT_NEAR(Measure("com_motion_max", from), 8 * std::sin(std::numbers::pi / 6), 1e-9);
  EXPECT_TRUE(Unanswered("com_motion_reference_max"));
  EXPECT_TRUE(Unanswered("com_difference_max"));
}

TEST_F(MetricsTest, ComIsComparedWithTheReferenceTickByTick) {
  for (size_t t = 0; t < kTicks; ++t) truth_[t].com_position[1] = 1e-4 * static_cast<double>(t);
  KeepAsReference();
  for (size_t t = 0; t < kTicks; ++t) truth_[t].com_position[1] *= 1.5;
  truth_[40].com_position[0] = 0.012;  // 12 mm ahead, 2 mm aside
  EXPECT_NEAR(*Compare("com_motion_reference_max"), 9.9, 1e-9);
  EXPECT_NEAR(*Compare("com_difference_max"), std::hypot(12, 2), 1e-9);
}

TEST_F(MetricsTest, BodyRotationInFirstAndLastDoubleSupport) {
  for (size_t t = 0; t < kTicks; ++t) {
    task_[t].body_orientation_error[0] = t < 30 ? -0.002 : t < 60 ? 0.05 : 0.011;
    task_[t].body_orientation_error[1] = 1;
  }
  EXPECT_TRUE(Unanswered("body_rotation_x_max_last_double"));
  LiftLeft(30, 60);
  EXPECT_NEAR(Measure("body_rotation_x_max_first_double"), 2, 1e-12);
  EXPECT_NEAR(Measure("body_rotation_x_max_last_double"), 11, 1e-12);
}

TEST_F(MetricsTest, RatioSpanIsOfDoubleSupport) {
  for (size_t t = 0; t < kTicks; ++t)
    command_[t].eta = t < 50 ? 0.3 + 0.01 * static_cast<double>(t) : 1;
  LiftLeft(50, kTicks);
  EXPECT_NEAR(Measure("eta_span"), 0.49, 1e-12);
}

TEST_F(MetricsTest, FootErrorsByFootAndComponent) {
  for (size_t t = 1; t < kTicks; ++t) {
    const double sign = t % 2 == 0 ? 1 : -1;
    sensors_[t].foot_wrench[0].force[2] = 3 * sign;
    sensors_[t].foot_wrench[0].force[0] = 4;
    sensors_[t].foot_wrench[0].force[1] = -3 * sign;
    sensors_[t].foot_wrench[1].moment[0] = 5;
    sensors_[t].foot_wrench[1].moment[1] = 12;
    sensors_[t].foot_wrench[1].moment[2] = t < 50 ? 0 : 2;
  }
  EXPECT_NEAR(Measure("right_foot_force_z_error_rms"), 3, 1e-12);
  EXPECT_NEAR(Measure("right_foot_force_xy_error_rms"), 5, 1e-12);
  EXPECT_NEAR(Measure("right_foot_moment_xy_error_rms"), 0, 1e-12);
  EXPECT_NEAR(Measure("left_foot_force_z_error_rms"), 0, 1e-12);
  EXPECT_NEAR(Measure("left_foot_moment_xy_error_rms"), 13, 1e-12);
  EXPECT_NEAR(Measure("left_foot_moment_z_error_rms"), 2 * std::sqrt(50.0 / 99.0), 1e-12);
}

// Any error of two forces is a share of the resultant's and what moves nothing.
TEST_F(MetricsTest, ForceErrorsInternalAndResultantParts) {
  const double eta = 0.3;
  for (size_t t = 0; t < kTicks; ++t) {
    command_[t].eta = eta;
    // Resultant (10, 0, 20), internal (0, 3, 4).
    const double right[] = {eta * 10, 3, eta * 20 + 4}, left[] = {0.7 * 10, -3, 0.7 * 20 - 4};
    for (int i = 0; i < 3; ++i) {
      sensors_[t].foot_wrench[0].force[i] = command_[t].foot_wrench[0].force[i] + right[i];
      sensors_[t].foot_wrench[1].force[i] = command_[t].foot_wrench[1].force[i] + left[i];
    }
  }
  EXPECT_NEAR(Measure("foot_force_error_internal_rms"), 5, 1e-9);
  EXPECT_NEAR(Measure("foot_force_error_resultant_rms"), std::sqrt(0.5 * 0.58 * 500), 1e-9);
  LiftLeft(0, kTicks);
  EXPECT_TRUE(Unanswered("foot_force_error_internal_rms"));
}

TEST_F(MetricsTest, FootLoadsAndTangentialParts) {
  for (size_t t = 0; t < kTicks; ++t) {
    command_[t].foot_wrench[0].force[2] = -100 - static_cast<double>(t);
    sensors_[t].foot_wrench[0].force[2] = -90;
    command_[t].foot_wrench[1].force[2] = -10;
  }
  sensors_[0].foot_wrench[0].force[2] = -1000;  // of no command of this run
  sensors_[60].foot_wrench[0].force[2] = -95;
  command_[10].foot_wrench[1].force[0] = 3;
  command_[10].foot_wrench[1].force[1] = -4;
  command_[20].foot_wrench[0].moment[2] = -0.7;
  LiftLeft(50, kTicks);
  command_[70].foot_wrench[1].force[0] = 50;  // of a foot off the ground
  EXPECT_EQ(Measure("right_foot_load_computed_min"), 100);
  EXPECT_EQ(Measure("right_foot_load_computed_max"), 199);
  EXPECT_EQ(Measure("right_foot_load_measured_min"), 90);
  EXPECT_EQ(Measure("right_foot_load_measured_max"), 95);
  EXPECT_EQ(Measure("left_foot_load_computed_max"), 10);
  EXPECT_NEAR(Measure("foot_tangential_force_computed_max"), 5, 1e-12);
  EXPECT_NEAR(Measure("foot_yaw_moment_computed_max"), 0.7, 1e-12);
}

TEST_F(MetricsTest, TorqueStepAtTheSwitchAlone) {
  EXPECT_TRUE(Unanswered("torque_step_at_switch"));
  LiftLeft(50, kTicks);
  for (size_t t = 50; t < kTicks; ++t) command_[t].torque[4] = 8;
  command_[20].torque[0] = 30;  // at no switch
  EXPECT_EQ(Measure("torque_step_at_switch"), 8);
  EXPECT_TRUE(Unanswered("torque_step_ratio"));
  KeepAsReference();
  for (size_t t = 50; t < kTicks; ++t) command_[t].torque[4] = 2;
  command_[50].torque[5] = -0.5;
  EXPECT_EQ(Compare("torque_step_at_switch"), Answer(2));
  EXPECT_EQ(Compare("torque_step_at_switch_reference"), Answer(8));
  EXPECT_EQ(Compare("torque_step_ratio"), Answer(25));
}

TEST_F(MetricsTest, NoRatioToAReferenceWithoutAStep) {
  LiftLeft(50, kTicks);
  KeepAsReference();
  EXPECT_FALSE(Compare("torque_step_ratio").has_value());
}

TEST_F(MetricsTest, LiftMotionIsOfTheLiftedFootAboutTheSwitch) {
  EXPECT_TRUE(Unanswered("foot_lift_motion_z"));
  LiftLeft(50, kTicks);
  for (size_t t = 0; t < kTicks; ++t) {
    truth_[t].foot_pose[0].position[2] = 0.01 * static_cast<double>(t);
    truth_[t].foot_pose[1].position[2] = 0.3;
  }
  truth_[24].foot_pose[1].position[2] = 0.2;  // 0.052 s before
  truth_[25].foot_pose[1].position[2] = 0.299;
  truth_[80].foot_pose[1].position[2] = 0.303;
  EXPECT_NEAR(Measure("foot_lift_motion_z"), 4, 1e-9);
  KeepAsReference();
  truth_[80].foot_pose[1].position[2] = 0.3;
  EXPECT_NEAR(*Compare("foot_lift_motion_z"), 1, 1e-9);
  EXPECT_NEAR(*Compare("foot_lift_motion_z_reference"), 4, 1e-9);
}

TEST_F(MetricsTest, SinkIsFromTheConfirmedContactToTheNextLift) {
  EXPECT_TRUE(Unanswered("left_foot_sink"));
  LiftLeft(10, 40);
  LiftLeft(80, kTicks);
  for (size_t t = 30; t < 40; ++t) planner_[t].foot_state[1] = planner_status_t::FOOT_TOUCHING;
  for (size_t t = 0; t < kTicks; ++t) {
    // Sinks 1 mm a tick from 30 on, to 12 mm; later in the air it is far lower.
    const double sunk = std::clamp(static_cast<double>(t) - 30, 0.0, 12.0);
    truth_[t].foot_pose[1].position[2] = t < 80 ? 0.09 - 0.001 * sunk : 0;
  }
  EXPECT_NEAR(Measure("left_foot_sink"), 12, 1e-9);
  EXPECT_TRUE(Unanswered("right_foot_sink"));
  EXPECT_NEAR(Measure("touch_down"), 0.06, 1e-12);
  // Nothing confirms: from the first tick of support on.
  for (size_t t = 30; t < 40; ++t) planner_[t].foot_state[1] = planner_status_t::FOOT_SWING;
  EXPECT_NEAR(Measure("left_foot_sink"), 2, 1e-9);
  EXPECT_TRUE(Unanswered("touch_down"));
}

TEST_F(MetricsTest, EarlyAndLateContacts) {
  // Without phases nothing tells where a reference was to end.
  EXPECT_TRUE(Unanswered("early_contacts"));
  StepPlannerConfig config;
  config.add_phase()->set_duration(0.02);
  FootReference* foot = config.add_phase()->mutable_foot();
  foot->set_foot(LEFT_FOOT);
  foot->set_height_above_support(-0.1);
  ComponentConfig* part = spec_.add_config();
  part->set_component("step_planner");
  google::protobuf::TextFormat::PrintToString(config, part->mutable_text());
  EXPECT_EQ(Measure("early_contacts"), 0);
  EXPECT_EQ(Measure("late_contacts"), 0);

  LiftLeft(10, 90);
  for (size_t t = 0; t < kTicks; ++t) planner_[t].phase = t < 10 ? 0 : 1;
  for (size_t t = 50; t < 60; ++t) planner_[t].foot_state[1] = planner_status_t::FOOT_TOUCHING;
  for (size_t t = 70; t < 90; ++t) planner_[t].foot_state[1] = planner_status_t::FOOT_RETRACTED;
  EXPECT_EQ(Measure("no_surface_stops"), 1);
  EXPECT_EQ(Measure("no_surface_stops", 0.15), 0);
  EXPECT_EQ(Measure("early_contacts"), 1);
  EXPECT_EQ(Measure("late_contacts"), 0);
  spec_.clear_config();
  EXPECT_TRUE(Unanswered("early_contacts"));
}

TEST_F(MetricsTest, WaitingTime) {
  for (size_t t = 20; t < 45; ++t) plan_[t].status = support_plan_t::STATUS_WAITING;
  EXPECT_NEAR(Measure("waiting_time"), 0.05, 1e-12);
}

TEST_F(MetricsTest, ContactLostTicks) {
  EXPECT_TRUE(Unanswered("contact_lost_ticks"));  // no foot was to be loaded
  for (size_t t = 0; t < kTicks; ++t) {
    command_[t].foot_wrench[0].force[2] = command_[t].foot_wrench[1].force[2] = -270;
    sensors_[t].foot_wrench[0].force[2] = t < 30 ? -540 : -270;
    sensors_[t].foot_wrench[1].force[2] = t < 30 ? -1 : -270;
  }
  EXPECT_EQ(Measure("contact_lost_ticks"), 29);  // tick 0 reads what was before the run
}

TEST_F(MetricsTest, MeasuredViolationsUseTheCommandsOwnSole) {
  // Half length 0.12 m on both feet: margin 0.12 |F_z| - |M_y|.
  for (size_t t = 0; t < kTicks; ++t) {
    for (size_t foot = 0; foot < 2; ++foot) {
      command_[t].foot_wrench[foot].force[2] = -200;
      command_[t].foot_wrench[foot].moment[1] = -4;
      command_[t].margins[foot].pitch = 0.12 * 200 - 4;
      command_[t].margins[foot].roll = 0.05 * 200;
      sensors_[t].foot_wrench[foot].force[2] = -150;
    }
  }
  EXPECT_EQ(Measure("left_foot_pitch_violation_measured"), 0);
  EXPECT_TRUE(Unanswered("left_foot_pitch_violation_first"));
  for (size_t t = 40; t < 50; ++t) sensors_[t].foot_wrench[1].moment[1] = -18.1;  // limit 18
  sensors_[60].foot_wrench[1].moment[1] = 17.9;
  sensors_[70].foot_wrench[1].moment[1] = 5;  // unloaded: anything
  sensors_[70].foot_wrench[1].force[2] = -5;
  sensors_[80].foot_wrench[0].moment[0] = 7.6;  // limit 7.5
  EXPECT_NEAR(Measure("left_foot_pitch_violation_measured"), 0.02, 1e-12);
  EXPECT_NEAR(Measure("left_foot_pitch_violation_first"), 0.08, 1e-12);
  EXPECT_EQ(Measure("right_foot_pitch_violation_measured"), 0);
  EXPECT_NEAR(Measure("right_foot_roll_violation_measured"), 0.002, 1e-12);
  EXPECT_EQ(Measure("left_foot_roll_violation_measured"), 0);
}

TEST_F(MetricsTest, ViolationsAfterAFootWasSetDown) {
  for (size_t t = 0; t < kTicks; ++t) {
    command_[t].foot_wrench[1].force[2] = sensors_[t].foot_wrench[1].force[2] = -200;
    command_[t].margins[1].pitch = 0.12 * 200;
    sensors_[t].foot_wrench[1].moment[1] = t < 20 || (t >= 60 && t < 65) ? 25 : 23;  // limit 24
  }
  EXPECT_TRUE(Unanswered("left_foot_pitch_violation_after_contact"));
  LiftLeft(30, 50);
  EXPECT_NEAR(Measure("left_foot_pitch_violation_measured"), 24 * kPeriod, 1e-12);
  EXPECT_NEAR(Measure("left_foot_pitch_violation_after_contact"), 5 * kPeriod, 1e-12);
}

TEST_F(MetricsTest, SingleSupportHasASoleOfItsOwn) {
  LiftLeft(50, kTicks);
  for (size_t t = 0; t < kTicks; ++t) {
    command_[t].foot_wrench[0].force[2] = sensors_[t].foot_wrench[0].force[2] = -200;
    command_[t].margins[0].roll = (t < 50 ? 0.05 : 0.06) * 200;
    sensors_[t].foot_wrench[0].moment[0] = 11;  // between 10 and 12
  }
  // Readings 1 to 50 are of commands on both feet.
  EXPECT_NEAR(Measure("right_foot_roll_violation_measured"), 0.1, 1e-12);
}

TEST_F(MetricsTest, WarningTimeIsFromTheAnnouncementThatHoldsToTheFall) {
  EXPECT_TRUE(Unanswered("step_warning_time"));  // no fall
  EXPECT_TRUE(Unanswered("step_needed_first"));
  EXPECT_EQ(Measure("step_needed_time"), 0);
  for (size_t t = 90; t < 100; ++t) truth_[t].fallen = 1;
  EXPECT_EQ(Measure("step_warning_time"), 0);  // not announced
  for (size_t t = 20; t < 25; ++t) planner_[t].step_needed = 1;
  EXPECT_EQ(Measure("step_warning_time"), 0);  // taken back before
  for (size_t t = 40; t < 100; ++t) planner_[t].step_needed = 1;
  planner_[55].capture_margin = -0.03;
  EXPECT_NEAR(Measure("step_warning_time"), 50 * kPeriod, 1e-12);
  EXPECT_NEAR(Measure("step_needed_first"), 20 * kPeriod, 1e-12);
  EXPECT_NEAR(Measure("step_needed_time"), 65 * kPeriod, 1e-12);
  EXPECT_NEAR(Measure("capture_margin_min"), -30, 1e-12);
}

TEST_F(MetricsTest, ACentreOfPressureOutsideItsPolygonBreaksACondition) {
  const double before = Measure("violated_ticks");
  for (size_t t = 10; t < 20; ++t) {
    balance_torque_t& balance = balance_[t];
    balance.region = balance_torque_t::REGION_POLYGON;
    balance.num_corners = 3;
    const double x[] = {0, 0.1, 0}, y[] = {0, 0, 0.1};
    std::copy_n(x, 3, balance.corner_x);
    std::copy_n(y, 3, balance.corner_y);
    // In the triangle's bounding box; beyond its long side from tick 15 on.
    balance.cop[0] = balance.cop[1] = t < 15 ? 0.049 : 0.051;
    balance.cop_limit[0] = balance.cop_limit[1] = 0.1;
  }
  EXPECT_EQ(Measure("violated_ticks"), before + 5);
  balance_[12].num_corners = -7;  // hostile: no region at all
  EXPECT_EQ(Measure("violated_ticks"), before + 6);
}

}  // namespace
}  // namespace poise::logging
