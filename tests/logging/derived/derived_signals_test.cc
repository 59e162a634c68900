// What follows from a run's messages, in closed form, and that all readers of a log have it.
#include "logging/derived/derived_signals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <set>
#include <string>

#include "derived/message_traits.hpp"
#include "lcmtypes/message_scalars.h"
#include "logging/export/log_export.h"
#include "logging/export/signal_table.h"
#include "steps/message_traits.hpp"
#include "tests/logging/record_fixture.h"

namespace poise::logging {
namespace {

class DerivedSignalsTest : public RecordTest {
 protected:
  /// By tick; empty: the run does not tell it.
  std::vector<double> Values(const std::string& field) {
    const RunRecord run = Read();
    for (const ChannelColumns& channel : ReadColumns(path_, run)) {
      if (channel.name != kDerivedChannel) continue;
      EXPECT_EQ(channel.ticks.size(), static_cast<size_t>(kTicks));
      for (const SignalColumn& column : channel.columns) {
        if (column.field == field) return column.values;
      }
    }
    return {};
  }
  double Value(const std::string& field, size_t tick = 50) {
    const std::vector<double> values = Values(field);
    return values.empty() ? std::nan("") : values[tick];
  }
  void SetLoads(double right, double left) {
    for (size_t t = 0; t < kTicks; ++t) {
      sensors_[t].foot_wrench[0].force[2] = command_[t].foot_wrench[0].force[2] = -right;
      sensors_[t].foot_wrench[1].force[2] = command_[t].foot_wrench[1].force[2] = -left;
    }
  }
  double Weight() { return Read().robot.total_mass() * robot::kGravity; }
};

TEST_F(DerivedSignalsTest, MeasuredCopStandsInTheFrameOfTheTickBefore) {
  SetLoads(300, 100);
  for (size_t t = 0; t < kTicks; ++t) sensors_[t].foot_wrench[0].moment[1] = 8;
  balance_[49].frame_o.position[1] = 0.02;
  const std::vector<double> y = Values("cop_measured[1]");
  ASSERT_FALSE(y.empty());
  EXPECT_TRUE(std::isnan(y[0]));  // no tick before
  EXPECT_NEAR(y[49], (300 * -0.105 + 100 * 0.105) / 400, 1e-12);
  EXPECT_NEAR(y[50], y[49] - 0.02, 1e-12);
  EXPECT_NEAR(Value("cop_measured_abs[1]"), -y[50], 1e-12);
  EXPECT_NEAR(Value("cop_measured[0]"), 8.0 / 400, 1e-12);
  // In the world it is where it was.
  EXPECT_NEAR(Value("cop_measured_place[1]"), y[49], 1e-12);
}

TEST_F(DerivedSignalsTest, ATickWithoutTheOneBeforeHasNoMeasuredCop) {
  SetLoads(300, 100);
  const RunRecord run = Read();
  DerivedSignals of_run(spec_, run.robot);
  const auto next = [&](int64_t tick) {
    const auto t = static_cast<size_t>(tick);
    TickMessages messages;
    messages.tick = tick;
    messages.sensors = sensors_[t];
    messages.planner = planner_[t];
    messages.plan = plan_[t];
    messages.balance = balance_[t];
    return of_run.Next(messages).cop_measured[1];
  };
  EXPECT_TRUE(std::isnan(next(0)));
  EXPECT_FALSE(std::isnan(next(1)));
  EXPECT_TRUE(std::isnan(next(3)));
  EXPECT_FALSE(std::isnan(next(4)));
}

TEST_F(DerivedSignalsTest, RatiosAndTheirLimitsAreThoseOfTheCommand) {
  SetLoads(200, 400);
  for (size_t t = 0; t < kTicks; ++t) {
    wrench_t& wrench = command_[t].foot_wrench[0];
    wrench.force[0] = 30;
    wrench.force[1] = -40;
    wrench.moment[0] = -6;
    // mu 0.9, mu_z 0.8 m, l_y/2 0.05 m, l_x/2 0.12 m.
    command_[t].margins[0] = {200, 0.9 * 200 - 50, 0.8 * 200, 0.05 * 200 - 6, 0.12 * 200};
  }
  EXPECT_NEAR(Value("foot[0].ratio_computed.friction"), 50.0 / 200, 1e-12);
  EXPECT_NEAR(Value("foot[0].ratio_computed.roll"), 6.0 / 200, 1e-12);
  EXPECT_NEAR(Value("foot[0].limit.friction"), 0.9, 1e-9);
  EXPECT_NEAR(Value("foot[0].limit.yaw"), 0.8, 1e-9);
  EXPECT_NEAR(Value("foot[0].limit.roll"), 0.05, 1e-9);
  EXPECT_NEAR(Value("foot[0].limit.pitch"), 0.12, 1e-9);
  EXPECT_NEAR(Value("foot[0].cop_computed[1]"), 6.0 / 200, 1e-12);
  for (size_t t = 0; t < kTicks; ++t) {
    command_[t].margins[0].roll = command_[t].margins[0].pitch = 3;  // of edges: the nearest one's
    command_[t].in_contact[1] = 0;
    command_[t].foot_wrench[1] = {};
  }
  EXPECT_TRUE(std::isnan(Value("foot[0].limit.roll")));
  EXPECT_NEAR(Value("foot[0].limit.friction"), 0.9, 1e-9);
  EXPECT_TRUE(std::isnan(Value("foot[1].ratio_computed.roll")));
  EXPECT_TRUE(std::isnan(Value("foot[1].limit.friction")));
  EXPECT_EQ(Value("foot[1].load_computed"), 0);  // it bears nothing, which is told
}

TEST_F(DerivedSignalsTest, ASoleWithoutLoadHasNoRatioAndNoCentreOfPressure) {
  const double weight = Weight();
  const auto set = [&](double load) {
    SetLoads(load, 0);
    for (size_t t = 0; t < kTicks; ++t) {
      sensors_[t].foot_wrench[0].moment[0] = command_[t].foot_wrench[0].moment[0] = 0.01;
    }
  };
  for (const double load : {0.0, 6.4e-5, -6.4e-5, 0.0099 * weight}) {
    set(load);
    for (const char* field :
         {"foot[0].ratio_computed.roll", "foot[0].ratio_measured.roll", "foot[0].cop_computed[1]",
          "foot[0].cop_measured[1]", "cop_measured[1]"}) {
      EXPECT_TRUE(Values(field).empty()) << field << " at " << load << " N";
    }
  }
  set(0.02 * weight);
  EXPECT_NEAR(Value("foot[0].ratio_computed.roll"), 0.01 / (0.02 * weight), 1e-12);
  EXPECT_TRUE(std::isnan(Value("foot[0].ratio_measured.roll")));  // noise decides
  EXPECT_NEAR(Value("foot[0].cop_measured[1]"), -0.01 / (0.02 * weight), 1e-12);
  set(0.0501 * weight);
  EXPECT_NEAR(Value("foot[0].ratio_measured.roll"), 0.01 / (0.0501 * weight), 1e-12);
}

TEST_F(DerivedSignalsTest, TheTiltErrorSeesTiltsAndNoHeading) {
  const auto tilt = [&](int axis) {
    for (size_t t = 0; t < kTicks; ++t) {
      double(&q)[4] = state_[t].base_orientation;
      q[1] = q[2] = q[3] = 0;
      q[0] = std::cos(0.01);
      q[axis] = std::sin(0.01);
    }
    return Value("base_tilt_error");
  };
  EXPECT_NEAR(tilt(1), 0.02, 1e-9);
  EXPECT_NEAR(tilt(2), 0.02, 1e-9);
  EXPECT_NEAR(tilt(3), 0, 1e-9);
}

TEST_F(DerivedSignalsTest, TheComHasNoReferenceWhereItFollowsACentreOfPressure) {
  for (size_t t = 0; t < kTicks; ++t) {
    planner_[t].com_position[0] = planner_[t].com_position[2] =
        0.02 + 1e-3 * static_cast<double>(t);
    plan_[t].com_follows = t < 60 ? support_plan_t::FOLLOWS_REFERENCE : support_plan_t::FOLLOWS_COP;
  }
  EXPECT_NEAR(Value("com_error[0]", 50), 0.07, 1e-12);
  EXPECT_TRUE(std::isnan(Value("com_error[0]", 70)));
  EXPECT_NEAR(Value("com_error[2]", 70), 0.09, 1e-12);
  EXPECT_NEAR(Value("com_motion[0]", 70), 0.07, 1e-12);
  EXPECT_NEAR(Value("com_motion_desired[0]", 50), -0.02, 1e-12);
}

TEST_F(DerivedSignalsTest, TorquesAreTheNearestToTheTruthThatTheRunHas) {
  for (size_t t = 0; t < kTicks; ++t) {
    truth_[t].joint_torque[3] = 10;
    bridge_[t].applied_torque[3] = 8;
    command_[t].torque[3] = 4;
  }
  const double limit = robot::PeakTorque(Read().robot, 3);
  EXPECT_NEAR(Value("torque_share[3]"), 1000 / limit, 1e-12);
  const auto without = [&](const char* type) {
    Graph* graph = spec_.mutable_graph();
    for (int i = 0; i < graph->channel_size(); ++i) {
      if (graph->channel(i).type() == type) graph->mutable_channel()->DeleteSubrange(i--, 1);
    }
  };
  without("ground_truth_t");
  without_.insert("GROUND_TRUTH");
  EXPECT_NEAR(Value("torque_share[3]"), 800 / limit, 1e-12);
  without("bridge_status_t");
  without_.insert("BRIDGE_STATUS");
  EXPECT_NEAR(Value("torque_share[3]"), 400 / limit, 1e-12);
}

TEST_F(DerivedSignalsTest, ALostMessageTakesAwayWhatFollowsFromItAlone) {
  SetLoads(300, 100);
  for (size_t t = 0; t < kTicks; ++t) {
    planner_[t].com_position[0] = 1e-3 * static_cast<double>(t);
    truth_[t].joint_torque[3] = 10;
    bridge_[t].applied_torque[3] = 8;  // which does not take the truth's place
  }
  // A measured CoP stands in the frame of the tick before.
  const std::pair<const char*, std::set<size_t>> untold[] = {
      {"com_error[0]", {40}}, {"cop_measured[1]", {0, 41, 60}}, {"torque_share[3]", {70}}};
  std::vector<std::vector<double>> whole;
  for (const auto& [field, ticks] : untold) whole.push_back(Values(field));
  lost_ = {{"PLANNER_STATUS", 40}, {"ROBOT_SENSORS", 60}, {"GROUND_TRUTH", 70}};
  for (size_t i = 0; i < whole.size(); ++i) {
    const auto& [field, ticks] = untold[i];
    const std::vector<double> values = Values(field);
    ASSERT_EQ(values.size(), whole[i].size()) << field;
    for (size_t t = 0; t < values.size(); ++t) {
      EXPECT_EQ(std::isnan(values[t]), ticks.contains(t)) << field << " at " << t;
      if (ticks.contains(t)) continue;
      EXPECT_EQ(values[t], whole[i][t]) << field << " at " << t;
    }
  }
}

TEST_F(DerivedSignalsTest, AChannelThatIsCalledDerivedTakesTheirPlace) {
  EXPECT_FALSE(Values("com_error[0]").empty());
  spec_.mutable_graph()->mutable_channel(0)->set_name(kDerivedChannel);
  const RunRecord run = Read();
  EXPECT_FALSE(DerivedSignals(spec_, run.robot).any());
  EXPECT_TRUE(Values("com_error[0]").empty());
}

TEST_F(DerivedSignalsTest, WhatACommandLeavesZeroIsNotKnown) {
  EXPECT_EQ(Value("share_commanded"), 0);
  EXPECT_EQ(Value("foot[0].load_computed"), 0);
  for (size_t t = 0; t < kTicks; ++t) {
    command_[t].eta_feasible = 0;
    for (size_t foot = 0; foot < 2; ++foot) {
      command_[t].in_contact[foot] = command_[t].conditions_met[foot] = 0;
      command_[t].margins[foot] = {};
    }
  }
  EXPECT_TRUE(Values("share_commanded").empty());
  EXPECT_TRUE(Values("foot[0].load_computed").empty());
  EXPECT_FALSE(Values("foot[0].load_measured").empty());
}

TEST_F(DerivedSignalsTest, BoundsAreThreeDeviationsOfTheNorm) {
  EXPECT_TRUE(Values("base_velocity_bound").empty());
  const RunRecord run = Read();
  DerivedSignals signals(spec_, run.robot);
  EXPECT_TRUE(signals.Tells("base_velocity_bound"));
  TickMessages messages;
  messages.tick = 0;
  estimator_status_t& status = messages.estimator.emplace();
  MessageTraits<estimator_status_t>::Resize(status, std::array<int32_t, 1>{2});
  status.has_covariance = 1;
  // The upper triangle of 9 x 9 by rows: variances of the velocity behind 9 + 8 + 7, + 6, + 5.
  status.covariance[24] = 1;
  status.covariance[30] = status.covariance[35] = 4;
  EXPECT_NEAR(signals.Next(messages).base_velocity_bound, 9, 1e-12);  // 3 |(1, 2, 2)|
}

/// What a foot does in a tick.
struct Tread {
  bool in_contact;
  double load;  ///< N
  double x;     ///< m
};
/// Each footprint's first tick and its place, of ticks of 2 ms and a robot of 98 N.
std::vector<std::pair<int, double>> PrintsOf(int ticks, Tread (*tread)(int tick)) {
  Footprint foot;
  std::vector<std::pair<int, double>> prints;
  for (int t = 0; t < ticks; ++t) {
    const Tread now = tread(t);
    pose_t sole{};
    sole.orientation[0] = 1;
    sole.position[0] = now.x;
    foot.Update(0.002 * t, now.in_contact, now.load, sole, 98);
    if (!foot.last()) continue;
    const int since = static_cast<int>(std::lround(foot.last()->since / 0.002));
    if (prints.empty() || prints.back().first != since) prints.emplace_back(since, 0);
    prints.back().second = foot.last()->sole.position[0];
  }
  return prints;
}

TEST(FootprintTest, IsWhereAFootStoodFirmlyFromWhenItCarried) {
  // It stands, swings from 20 on, touches with a bounce from 100 on, and lies from 110 on.
  const auto prints = PrintsOf(130, [](int t) -> Tread {
    if (t < 20) return {true, 50, 0.1};
    if (t < 100) return {false, 3, 0.1 + 0.0025 * (t - 20)};
    if (t < 102) return {true, 0, 0.3};  // in the plan's contact, and not on the ground yet
    if (t < 104) return {true, 10, 0.31};
    if (t < 110) return {false, 0, 0.32};
    return {true, 50, 0.32};
  });
  EXPECT_THAT(prints, testing::ElementsAre(testing::Pair(0, 0.1), testing::Pair(102, 0.32)));
}

TEST(FootprintTest, AFootThatSlidesLeavesSeveralWhateverThePlanSays) {
  const auto prints = PrintsOf(100, [](int t) -> Tread {
    return {t >= 10, 50, t < 50 ? 0 : 0.0011 * (t - 50)};
  });
  ASSERT_EQ(prints.size(), 3u);
  EXPECT_EQ(prints[0].first, 0);
  EXPECT_EQ(prints[1].first, 69);
  EXPECT_EQ(prints[2].first, 88);
  EXPECT_GT(prints[1].second, 0.02);
}

TEST_F(DerivedSignalsTest, FootprintsAreTheTrueSolesWhereTheRunHasThem) {
  const double weight = Weight();
  for (size_t t = 0; t < kTicks; ++t) {
    for (size_t foot = 0; foot < 2; ++foot) {
      state_[t].foot_wrench[foot].force[2] = t < 30 ? 0 : -weight / 2;
      truth_[t].foot_pose[foot].position[0] = 0.25;
    }
  }
  EXPECT_TRUE(std::isnan(Value("foot[1].print_time", 29)));
  EXPECT_NEAR(Value("foot[1].print_time", 90), 0.060, 1e-12);
  EXPECT_EQ(Value("foot[1].print_position[0]", 90), 0.25);
}

TEST(DerivedDefinitions, TheFewestStepsThatCatch) {
  planner_status_t planner{};
  steps::footsteps_t footsteps{};
  const double size[3] = {0.1, 0.3, 0.6};
  for (int steps = 0; steps < 3; ++steps) {
    footsteps.corners[steps] = 4;
    for (int i = 0; i < 4; ++i) {
      footsteps.region_x[16 * steps + i] = (i == 1 || i == 2 ? 1 : -1) * size[steps];
      footsteps.region_y[16 * steps + i] = (i > 1 ? 1 : -1) * size[steps];
    }
  }
  const auto at = [&](double x) {
    planner.capture_point[0] = x;
    return StepsThatCatch(planner, footsteps);
  };
  EXPECT_EQ(at(0), 0);
  EXPECT_EQ(at(0.2), 1);
  EXPECT_EQ(at(0.5), 2);
  EXPECT_EQ(at(0.7), 3);
  footsteps.corners[0] = 127;  // more than it has room for
  EXPECT_TRUE(at(0.7).has_value());
  for (int8_t& corners : footsteps.corners) corners = 0;
  EXPECT_FALSE(at(0).has_value());
  footsteps.stance = -1;
  EXPECT_FALSE(at(0).has_value());
}

TEST_F(DerivedSignalsTest, NoneIsInfiniteWhateverTheMessagesHold) {
  for (size_t t = 0; t < kTicks; ++t) {
    const double huge = 1e300;
    for (size_t foot = 0; foot < 2; ++foot) {
      for (wrench_t* wrench : {&sensors_[t].foot_wrench[foot], &command_[t].foot_wrench[foot],
                               &truth_[t].foot_wrench[foot]}) {
        *wrench = {{huge, huge, -huge}, {huge, huge, huge}};
      }
      planner_[t].foot_pose[foot].position[2] = huge;
    }
    for (double& x : push_[t].force) x = huge;
    for (double& x : state_[t].base_position) x = huge;
    for (double& x : truth_[t].base_linear_velocity) x = -huge;
    for (double& x : command_[t].torque) x = huge;
  }
  const RunRecord run = Read();
  bool any = false;
  for (const ChannelColumns& channel : ReadColumns(path_, run)) {
    if (channel.name != kDerivedChannel) continue;
    any = true;
    for (const SignalColumn& column : channel.columns) {
      for (const double x : column.values) EXPECT_FALSE(std::isinf(x)) << column.field;
    }
  }
  EXPECT_TRUE(any);
}

// Each field of the message is told by some definition: a run with all messages tells all.
TEST_F(DerivedSignalsTest, EveryFieldHasADefinition) {
  Channel* channel = spec_.mutable_graph()->add_channel();
  channel->set_name("FOOTSTEPS");
  channel->set_type(MessageTraits<steps::footsteps_t>::kName);
  const RunRecord run = Read();
  DerivedSignals signals(spec_, run.robot);
  TickMessages messages;
  messages.tick = 0;
  const derived::signals_t& none = signals.Next(messages);
  const auto scalars =
      ScalarsOf(*FindMessageType(MessageTraits<derived::signals_t>::kName), Encode(none));
  for (const MessageScalar& scalar : scalars.value()) {
    const std::string& path = scalar.path;
    if (path.starts_with("num_") || path == "run_id" || path == "tick" || path == "utime") continue;
    EXPECT_TRUE(signals.Tells(path)) << path;
  }
  EXPECT_FALSE(signals.Tells("foot"));
  EXPECT_FALSE(signals.Tells("foot[0].load"));
}

TEST_F(DerivedSignalsTest, TheExportHasTheSameNumbers) {
  SetLoads(300, 100);
  const std::vector<double> y = Values("cop_measured[1]");
  ExportCsv(path_, folder_.path("csv"));
  ExportMergedCsv(path_, folder_.path("merged.csv"));
  for (const auto& [file, prefix] :
       {std::pair{folder_.path("csv/DERIVED.csv"), ""}, {folder_.path("merged.csv"), "DERIVED."}}) {
    std::ifstream in(file);
    const auto cells = [&] {
      std::vector<std::string> row;
      std::string line, cell;
      std::getline(in, line);
      for (const char c : line + ",") {
        if (c == ',') {
          row.push_back(std::move(cell));
          cell.clear();
        } else {
          cell.push_back(c);
        }
      }
      return row;
    };
    const std::vector<std::string> header = cells();
    const auto column = static_cast<size_t>(
        std::ranges::find(header, prefix + std::string("cop_measured[1]")) - header.begin());
    ASSERT_LT(column, header.size()) << file;
    EXPECT_NE(std::ranges::find(header, prefix + std::string("foot[left].limit.roll")),
              header.end());
    for (size_t t = 0; t < y.size(); ++t) {
      const std::vector<std::string> row = cells();
      ASSERT_EQ(row.size(), header.size()) << file;
      if (std::isnan(y[t])) {
        EXPECT_EQ(row[column], "");
      } else {
        EXPECT_EQ(std::stod(row[column]), y[t]) << t;
      }
    }
  }
}

}  // namespace
}  // namespace poise::logging
