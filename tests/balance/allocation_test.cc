// The tick path must not touch the heap: malloc itself is counted.
#include <gtest/gtest.h>

#include "components/balance/contact_transition.h"
#include "components/balance/distribution_ratio.h"
#include "components/balance/redistribution.h"
#include "components/balance/step/step_balance.h"
#include "components/balance/task_hierarchy.h"
#include "components/balance/tasks/task.h"
#include "tests/allocation_counter.h"
#include "tests/balance/balance_test_support.h"

namespace poise::balance {
namespace {

void CountOn(const std::shared_ptr<const robot::RobotModel>& model,
             const std::array<bool, 2>& in_contact) {
  StateSampler sampler(model, 41);
  const int k = model->num_joints();
  WholeBody body(model);
  const robot::RobotState first = sampler.Draw(), state = sampler.Draw();
  ASSERT_TRUE(body.Update(first, in_contact == kDouble ? kRight : kDouble));
  WholeBody other(model);
  ASSERT_TRUE(other.Update(state, in_contact));
  const StackedTask stacked = PaperTask(other, in_contact);
  const Eigen::Index t = stacked.jacobian.rows();
  const robot::RobotData& data = body.data();
  TaskDynamics task(k, static_cast<int>(t)), height(k, 1);
  BalanceControl balance(k, 1);
  BalanceResult result;
  ContactLimits limits;
  limits.half_length = limits.half_width = 1e-4;
  const Eigen::VectorXd command = Eigen::VectorXd::Zero(t);
  Eigen::VectorXd torque(k), shift(k), acceleration(k + 6);
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 12, 1> wrench(in_contact == kDouble ? 12 : 6);

  const long before = allocations;
  const bool updated = body.Update(state, in_contact);
  const bool again = body.Update(state, in_contact);
  const ContactDynamics& contact = body.contact();
  const bool independent = task.Compute(contact, stacked.jacobian, stacked.bias_acceleration);
  const bool height_exists = height.Compute(contact, data.com_jacobian.middleRows(2, 1),
                                            data.com_bias_acceleration.tail(1));
  task.TaskTorque(command, torque);
  contact.ExpectedWrench(torque, wrench);
  contact.Acceleration(torque, acceleration);
  const BalanceStatus status =
      balance.Compute(contact, height, body.geometry(), limits, true, torque, &result);
  task.ProjectIntoNullSpace(torque);
  GravityCompensation(contact, torque);
  std::array<Eigen::Isometry3d, 2> foot = body.geometry().sole;
  for (auto& f : foot) f = result.frame_o.inverse(Eigen::Isometry) * f;
  const RatioInterval interval = FeasibleRatio(result.resultant, foot, limits, 0.02, 0.98);
  const double eta = SelectRatio(interval, result.resultant, foot, limits, 0.02, 0.98);
  const auto share =
      DistributeResultant(result.resultant, foot, TransitionRatio(eta, Foot::kRight, true, 0.5));
  if (in_contact == kDouble) {
    Eigen::Matrix<double, 12, 1> change;
    change << share[0], share[1];
    RedistributionTorque(contact.contact_jacobian(), change, shift);
  }
  EXPECT_EQ(allocations - before, 0);

  EXPECT_TRUE(updated && again && independent && height_exists);
  // The state's load decides between balancing and refusing; both are the tick path.
  EXPECT_NE(status, BalanceStatus::kSingular);
}

TEST(Allocation, TheTickPathAllocatesNothing) {
  for (const auto& model : {Biped(), Humanoid()}) {
    for (const auto& in_contact : {kDouble, kRight, kLeft}) CountOn(model, in_contact);
  }
}

TEST(Allocation, BalancingInAStepAllocatesNothing) {
  for (const auto& model : {Biped(), Humanoid()}) {
    for (const auto& in_contact : {kDouble, kRight, kLeft}) {
      StateSampler sampler(model, 43);
      WholeBody body(model);
      ASSERT_TRUE(body.Update(sampler.Draw(), in_contact));
      StepBounds bounds;
      bounds.in_contact = in_contact;
      bounds.sole = body.geometry().sole;
      ASSERT_TRUE(FrameO(bounds.sole, in_contact, &bounds.frame_o));
      bounds.region = Rectangle({0.05, 0.05});
      for (SoleBounds& foot : bounds.foot) foot = {Rectangle({0.08, 0.04}), 0.8, 30};
      const Eigen::MatrixXd rows = body.data().com_jacobian;
      const Eigen::VectorXd weight = Eigen::VectorXd::Constant(3, 10);
      const Eigen::VectorXd effort = Eigen::VectorXd::Constant(model->num_joints(), 200);
      Eigen::VectorXd torque = sampler.Vector(model->num_joints(), 100);
      StepBalance balance(model->num_joints(), 3);
      StepBalance::Result result;
      const long before = allocations;
      const bool found = balance.Compute(body.contact(), bounds, {rows, weight}, effort,
                                         Movers::kAllJoints, torque, &result);
      EXPECT_EQ(allocations - before, 0);
      EXPECT_TRUE(found && result.changed);
    }
  }
}

TEST(Allocation, TasksAndTheirHierarchyAllocateNothing) {
  for (const auto& model : {Biped(), Humanoid()}) {
    const int k = model->num_joints();
    StateSampler sampler(model, 42);
    WholeBody body(model);
    const robot::RobotState state = sampler.Draw();
    ASSERT_TRUE(body.Update(state, kDouble));
    const TaskState at{*model, state, body.data()};
    std::vector<std::unique_ptr<Task>> tasks;
    std::vector<int> level_rows;
    TaskTarget target;
    int rows = 0;
    for (const char* type : {"com", "orientation", "frame", "angular_momentum", "joint_posture"}) {
      TaskSpec spec;
      spec.type = type;
      tasks.push_back(CreateTask(spec, *model));
      tasks.back()->Hold(at, &target);
      level_rows.push_back(tasks.back()->num_rows());
      rows += level_rows.back();
    }
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(rows, k + 6);
    Eigen::VectorXd bias = Eigen::VectorXd::Zero(rows), wanted = bias;
    Eigen::VectorXd torque = Eigen::VectorXd::Ones(k);
    TaskHierarchy hierarchy(k, k, 5);

    const long before = allocations;
    int row = 0;
    for (const auto& task : tasks) {
      TaskRows view{jacobian.middleRows(row, task->num_rows()), bias.segment(row, task->num_rows()),
                    wanted.segment(row, task->num_rows())};
      task->Hold(at, &target);
      task->Write(at, target, &view);
      row += task->num_rows();
    }
    const bool computed = hierarchy.Compute(body.contact(), jacobian, bias, wanted, level_rows);
    hierarchy.ProjectIntoNullSpace(torque);
    EXPECT_EQ(allocations - before, 0);
    EXPECT_TRUE(computed);
    EXPECT_EQ(hierarchy.num_free(), 0);
    EXPECT_LT(torque.norm(), 1e-9);  // nothing is left
  }
}

TEST(Allocation, TheCounterCounts) {
  const long before = allocations;
  const ContactDynamics contact(12);
  EXPECT_GT(allocations - before, 5);
}

}  // namespace
}  // namespace poise::balance
