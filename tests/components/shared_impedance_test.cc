// What the drives are told to hold beside the torque.
#include <gtest/gtest.h>

#include "components/contact_wrench_monitor/contact_wrench_monitor.h"
#include "components/redistributor/redistributor.h"
#include "components/step_planner/step_planner.h"
#include "components/task_controller/task_controller.h"
#include "tests/components/control_fixture.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using robot::TestRobot;

// Planner, task controller, monitor and redistributor on two feet, for one tick.
class ImpedanceChain {
 public:
  explicit ImpedanceChain(const std::string& redistributor)
      : model_(robot::LoadTestRobot(TestRobot::kDyros)),
        context_(TestRobot::kDyros),
        planner_(&context_, "phase { support: DOUBLE }"),
        task_(&context_, TaskControllerText()),
        monitor_(&context_, MonitorConfig(false)),
        redistributor_(&context_, redistributor) {
    const auto& plan = planner_.output<support_plan_t>();
    const auto& balance = monitor_.output<balance_torque_t>();
    planner_.Bind("robot_state", &state_);
    task_.Bind("robot_state", &state_);
    task_.Bind("support_plan", &plan);
    monitor_.Bind("robot_state", &state_);
    monitor_.Bind("support_plan", &plan);
    monitor_.Bind("task_torque", &task_.output<task_torque_t>());
    redistributor_.Bind("robot_state", &state_);
    redistributor_.Bind("support_plan", &plan);
    redistributor_.Bind("balance_torque", &balance);
  }
  const joint_command_t& Run(const robot::RobotState& state) {
    state_ = StateMessage(model_, state);
    planner_.Run(TickAt(0));
    task_.Run(TickAt(0));
    monitor_.Run(TickAt(0));
    redistributor_.Run(TickAt(0));
    return redistributor_.output<joint_command_t>();
  }
  const robot::RobotModel& model() const { return model_; }

 private:
  robot::RobotModel model_;
  ControlContext context_;
  robot_state_t state_;
  Harness<StepPlanner> planner_;
  Harness<TaskController> task_;
  Harness<ContactWrenchMonitor> monitor_;
  Harness<Redistributor> redistributor_;
};

// The drives are told the motion that the torque causes, by the square route's accelerations, and
// the torque stays what it is without them.
TEST(SharedImpedanceTest, PlansTheMotionThatTheTorqueCauses) {
  std::mt19937 random{TestSeed(29)};
  ImpedanceChain alone(RedistributorText());
  ImpedanceChain shared(RedistributorText("impedance { enabled: true horizon: 0.007 }"));
  const robot::RobotModel& model = alone.model();
  const robot::RobotState state = Disturbed(StandingState(model), 0.03, 0.2, &random);
  const joint_command_t& plain = alone.Run(state);
  const joint_command_t& out = shared.Run(state);
  ASSERT_NE(out.status, joint_command_t::STATUS_INVALID_INPUT);

  Eigen::VectorXd q, wrench;
  Dynamics(model, state, {true, true}).Forward(ToEigen(out.torque), &q, &wrench);
  for (Eigen::Index j = 0; j < model.num_joints(); ++j) {
    const auto i = static_cast<size_t>(j);
    const double a = q[6 + j], t = 0.007;
    EXPECT_EQ(out.torque[i], plain.torque[i]);
    EXPECT_NEAR(out.velocity[i], state.joint_velocity[j] + a * t, 1e-6);
    EXPECT_NEAR(out.position[i],
                state.joint_position[j] + t * (state.joint_velocity[j] + a * t / 2), 1e-8);
    EXPECT_GT(out.damping[i], 0);
    EXPECT_GT(out.stiffness[i], 0);
    EXPECT_EQ(plain.position[i] + plain.velocity[i] + plain.stiffness[i] + plain.damping[i], 0);
  }
}

TEST(SharedImpedanceTest, RefusesTimesThatAreNone) {
  for (const char* field : {"horizon", "rotor_time", "stiffness_time"}) {
    EXPECT_THROW(ImpedanceChain(RedistributorText(std::string("impedance { enabled: true ") +
                                                  field + ": 0 }")),
                 ConfigError)
        << field;
  }
}

}  // namespace
}  // namespace poise
