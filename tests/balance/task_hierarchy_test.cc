// Three and more levels of priority against the quadratic programs that define them, solved in
// accelerations, in extended precision, by a route that knows no projection of torques.
#include "components/balance/task_hierarchy.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>

#include "components/balance/tasks/task.h"
#include "tests/balance/balance_test_support.h"

namespace poise::balance {
namespace {

constexpr int kStates = 300;
constexpr double kTolerance = 1e-8;

struct Rows {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd bias, wanted;
};

/// Rows of a task at the body's state, with an f* drawn at random.
Rows RowsOf(const WholeBody& body, const robot::RobotState& state, const TaskSpec& spec,
            StateSampler* sampler) {
  const auto task = CreateTask(spec, body.model());
  Rows rows{Eigen::MatrixXd::Zero(task->num_rows(), body.model().num_velocities()),
            Eigen::VectorXd::Zero(task->num_rows()), Eigen::VectorXd::Zero(task->num_rows())};
  const TaskState at{body.model(), state, body.data()};
  TaskTarget target;
  task->Hold(at, &target);
  TaskRows view{rows.jacobian, rows.bias, rows.wanted};
  task->Write(at, target, &view);
  rows.wanted = sampler->Vector(task->num_rows(), 5);
  return rows;
}

/// Levels one after the other.
struct Stack {
  Rows all;
  std::vector<int> level_rows;

  void Add(const Rows& rows) {
    const Eigen::Index before = all.jacobian.rows(), t = rows.jacobian.rows();
    all.jacobian.conservativeResize(before + t, rows.jacobian.cols());
    all.bias.conservativeResize(before + t);
    all.wanted.conservativeResize(before + t);
    all.jacobian.bottomRows(t) = rows.jacobian;
    all.bias.tail(t) = rows.bias;
    all.wanted.tail(t) = rows.wanted;
    level_rows.push_back(static_cast<int>(t));
  }
};

/// The accelerations that the programs leave: x + basis z.
struct Accelerations {
  VectorL x;
  MatrixL basis;
};

// A sum of squares |E z − e|² → min, all of its solutions. Singular values below 1e-9 of the
// largest are rounding: those of the states drawn lie far apart, or the state is left out.
void Minimise(const MatrixL& rows, const VectorL& error, Accelerations* left) {
  if (left->basis.cols() == 0) return;
  const MatrixL e = rows * left->basis;
  Eigen::JacobiSVD<MatrixL> svd(e, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Index rank = 0;
  while (rank < svd.singularValues().size() && svd.singularValues()(rank) > 1e-9L) ++rank;
  const VectorL right = svd.matrixU().leftCols(rank).transpose() * (error - rows * left->x);
  const VectorL z =
      svd.matrixV().leftCols(rank) * VectorL(right.cwiseQuotient(svd.singularValues().head(rank)));
  left->x += left->basis * z;
  left->basis = (left->basis * svd.matrixV().rightCols(e.cols() - rank)).eval();
}

/// The programs of all levels, the contacts' constraints first.
Accelerations Solve(const PaperContact& paper, const Stack& stack) {
  Accelerations left{VectorL::Zero(paper.n), MatrixL::Identity(paper.n, paper.n)};
  Minimise(paper.jc, -paper.gamma, &left);
  Eigen::Index row = 0;
  for (const int t : stack.level_rows) {
    MatrixL j = stack.all.jacobian.middleRows(row, t).cast<Real>();
    VectorL error = (stack.all.wanted - stack.all.bias).segment(row, t).cast<Real>();
    // Each row in the norm of its effective mass, (14) of that row alone.
    for (Eigen::Index i = 0; i < t; ++i) {
      const Real mobility = (j.row(i) * paper.a_inverse * paper.nc_t * j.row(i).transpose())(0, 0);
      const Real scale = 1 / std::sqrt(mobility);
      j.row(i) *= scale;
      error(i) *= scale;
    }
    Minimise(j, error, &left);
    row += t;
  }
  return left;
}

/// The least torque that gives an acceleration which the contacts allow.
VectorL LeastTorque(const PaperContact& paper, const VectorL& acceleration) {
  const VectorL force = paper.a * acceleration + paper.b + paper.g;
  // Γ = S (force + J_cᵀ F) with the base's rows zero; F = F_0 + K φ.
  const MatrixL base = paper.jc.leftCols(6).transpose();
  const Eigen::CompleteOrthogonalDecomposition<MatrixL> decomposition(base);
  const VectorL some = decomposition.solve(VectorL(-force.head(6)));
  const MatrixL joints = paper.jc.rightCols(paper.k).transpose();
  VectorL torque = force.tail(paper.k) + joints * some;
  if (paper.m > 6) {
    const Eigen::FullPivLU<MatrixL> lu(base);
    const MatrixL internal = joints * lu.kernel();
    torque -=
        internal * Eigen::CompleteOrthogonalDecomposition<MatrixL>(internal).solve(torque).eval();
  }
  return torque;
}

class Worst {
 public:
  void Add(const std::string& what, double residual) {
    auto& worst = residuals_.try_emplace(what, 0.0).first->second;
    worst = std::max(worst, residual);
  }
  void PrintAndCheck(const std::string& title) const {
    fmt::print("\n{}\n", title);
    for (const auto& [what, residual] : residuals_) {
      fmt::print("  {:<66} {:.1e}\n", what, residual);
      EXPECT_LT(residual, kTolerance) << title << ": " << what;
    }
  }

 private:
  std::map<std::string, double> residuals_;
};

TaskSpec Spec(const std::string& type, AxisSelection axes = {}, const std::string& link = "") {
  TaskSpec spec;
  spec.type = type;
  spec.axes = axes;
  spec.link = link;
  return spec;
}

/// Levels of a support: the COM and the free foot; the body's orientation, and with a hand its
/// pose; angular momentum; all joints.
std::vector<std::vector<TaskSpec>> Levels(const FootArray<bool>& in_contact,
                                          const std::string& hand) {
  std::vector<std::vector<TaskSpec>> levels{{Spec("com")}, {}, {}, {}};
  for (const Foot foot : kFeet) {
    if (in_contact[foot]) continue;
    TaskSpec free = Spec("frame");
    free.foot = foot;
    levels[0].push_back(free);
  }
  levels[1].push_back(Spec("orientation", {false, false, false, true, true, false}));
  if (!hand.empty()) levels[1].push_back(Spec("frame", {}, hand));
  levels[2].push_back(Spec("angular_momentum"));
  levels[3].push_back(Spec("joint_posture"));
  return levels;
}

void CheckRobot(const char* name, const std::shared_ptr<const robot::RobotModel>& model,
                const std::string& hand, unsigned seed) {
  const int k = model->num_joints();
  StateSampler sampler(model, seed);
  WholeBody body(model);
  for (const auto& in_contact : {kDouble, kRight}) {
    Worst worst;
    int compared = 0, in_conflict = 0;
    for (int i = 0; i < kStates; ++i) {
      const robot::RobotState state = sampler.Draw();
      ASSERT_TRUE(body.Update(state, in_contact));
      Stack stack;
      for (const auto& level : Levels(in_contact, hand)) {
        Stack rows;
        for (const TaskSpec& spec : level) rows.Add(RowsOf(body, state, spec, &sampler));
        stack.Add(rows.all);
      }
      TaskHierarchy hierarchy(k, k + 12, 4);
      ASSERT_TRUE(hierarchy.Compute(body.contact(), stack.all.jacobian, stack.all.bias,
                                    stack.all.wanted, stack.level_rows));
      const PaperContact paper(body, in_contact);
      VectorL acceleration, wrench;
      paper.Solve(hierarchy.torque().cast<Real>(), &acceleration, &wrench);
      const auto level_error = [&](const VectorL& q, Eigen::Index row, Eigen::Index t) {
        return VectorL(stack.all.jacobian.middleRows(row, t).cast<Real>() * q +
                       (stack.all.bias - stack.all.wanted).segment(row, t).cast<Real>());
      };
      worst.Add("first level: ẍ = f*",
                MaxResidual(level_error(acceleration, 0, stack.level_rows[0]),
                            VectorL::Zero(stack.level_rows[0])));
      EXPECT_EQ(hierarchy.num_free(), 0);
      // Strict: levels below change nothing above, whatever they ask for.
      for (size_t levels = 1; levels < stack.level_rows.size(); ++levels) {
        Eigen::Index row = 0;
        for (size_t l = 0; l < levels; ++l) row += stack.level_rows[l];
        TaskHierarchy above(k, k + 12, 4);
        ASSERT_TRUE(above.Compute(body.contact(), stack.all.jacobian.topRows(row),
                                  stack.all.bias.head(row), stack.all.wanted.head(row),
                                  std::span(stack.level_rows).first(levels)));
        VectorL alone;
        paper.Solve(above.torque().cast<Real>(), &alone, &wrench);
        worst.Add(fmt::format("levels below change nothing of the first {}", levels),
                  MaxResidual(level_error(acceleration, 0, row), level_error(alone, 0, row)));
      }
      // Where a direction fades the programs' answer would be torques without bound.
      bool conflict = false;
      for (const TaskHierarchy::Level& level : hierarchy.levels()) {
        conflict |= level.directions < level.rows;
      }
      in_conflict += conflict ? 1 : 0;
      if (hierarchy.num_fading() > 0) continue;
      ++compared;
      const Accelerations exact = Solve(paper, stack);
      ASSERT_EQ(exact.basis.cols(), 0);
      worst.Add("q̈ of all levels against the programs", MaxResidual(acceleration, exact.x));
      worst.Add("Γ against the least torque of the programs' q̈",
                MaxResidual(hierarchy.torque().cast<Real>(), LeastTorque(paper, exact.x)));
    }
    worst.PrintAndCheck(fmt::format(
        "{}, {} support: worst of {} states; levels in conflict in {}, "
        "compared with the programs {}",
        name, in_contact == kDouble ? "double" : "single", kStates, in_conflict, compared));
    EXPECT_GT(compared, kStates / 2);
    EXPECT_GT(in_conflict, kStates / 2);
  }
}

TEST(TaskHierarchy, FourLevelsAreTheirProgramsBiped) { CheckRobot("biped", Biped(), "", 21); }
TEST(TaskHierarchy, FourLevelsAreTheirProgramsHumanoid) {
  CheckRobot("humanoid", Humanoid(), "right_forearm", 22);
}

TEST(TaskHierarchy, OneLevelIsTheTaskTorque) {
  for (const auto& model : {Biped(), Humanoid()}) {
    StateSampler sampler(model, 23);
    WholeBody body(model);
    const robot::RobotState state = sampler.Draw();
    ASSERT_TRUE(body.Update(state, kDouble));
    const StackedTask paper = PaperTask(body, kDouble);
    const Eigen::VectorXd wanted = sampler.Vector(6, 5);
    TaskDynamics task(model->num_joints(), 6);
    ASSERT_TRUE(task.Compute(body.contact(), paper.jacobian, paper.bias_acceleration));
    Eigen::VectorXd torque(model->num_joints());
    task.TaskTorque(wanted, torque);
    TaskHierarchy hierarchy(model->num_joints(), 6, 1);
    const std::array<int, 1> rows{6};
    ASSERT_TRUE(
        hierarchy.Compute(body.contact(), paper.jacobian, paper.bias_acceleration, wanted, rows));
    EXPECT_EQ(hierarchy.torque(), torque);  // the same bits
    EXPECT_EQ(hierarchy.num_free(), body.contact().reduced().rank() - 6);
  }
}

// A second level that nears the first one's direction: its torque stays bounded, the first level
// stays met, and where little is left it goes to nothing.
TEST(TaskHierarchy, WhatFadesStaysBounded) {
  const auto model = Humanoid();
  StateSampler sampler(model, 24);
  WholeBody body(model);
  const robot::RobotState state = sampler.Draw();
  ASSERT_TRUE(body.Update(state, kDouble));
  const Rows com = RowsOf(body, state, Spec("com"), &sampler);
  const Rows other = RowsOf(body, state, Spec("angular_momentum"), &sampler);
  const PaperContact paper(body, kDouble);
  const int k = model->num_joints();
  double last = 0, most = 0;
  for (double angle = 1; angle > 1e-12; angle *= 0.7) {
    Stack stack;
    stack.Add(com);
    Rows near{com.jacobian.topRows(1) + angle * other.jacobian.topRows(1), com.bias.head(1),
              com.wanted.head(1) + Eigen::VectorXd::Constant(1, 1.0)};
    stack.Add(near);
    TaskHierarchy hierarchy(k, 6, 2);
    ASSERT_TRUE(hierarchy.Compute(body.contact(), stack.all.jacobian, stack.all.bias,
                                  stack.all.wanted, stack.level_rows));
    TaskHierarchy alone(k, 6, 2);
    ASSERT_TRUE(alone.Compute(body.contact(), com.jacobian, com.bias, com.wanted,
                              std::span(stack.level_rows).first(1)));
    VectorL acceleration, wrench;
    paper.Solve(hierarchy.torque().cast<Real>(), &acceleration, &wrench);
    EXPECT_LT(MaxResidual(VectorL(com.jacobian.cast<Real>() * acceleration + com.bias.cast<Real>()),
                          com.wanted.cast<Real>()),
              kTolerance);
    last = (hierarchy.torque() - alone.torque()).norm();
    most = std::max(most, last);
    if (angle < 1e-9) {
      EXPECT_EQ(hierarchy.levels()[1].directions, 0);
    }
  }
  EXPECT_EQ(last, 0);
  // Followed to the end it would be 1e9 times as much.
  EXPECT_LT(most, 1e6);
  fmt::print("most torque of a fading level: {:.3g} N m\n", most);
}

TEST(TaskHierarchy, RefusesWhatCannotBe) {
  const auto model = Biped();
  StateSampler sampler(model, 25);
  WholeBody body(model);
  const robot::RobotState state = sampler.Draw();
  ASSERT_TRUE(body.Update(state, kDouble));
  const Rows com = RowsOf(body, state, Spec("com"), &sampler);
  Stack twice;
  twice.Add(com);
  twice.Add(com);
  TaskHierarchy hierarchy(12, 12, 2);
  const auto compute = [&](std::vector<int> rows, const Rows& all) {
    return hierarchy.Compute(body.contact(), all.jacobian, all.bias, all.wanted, rows);
  };
  EXPECT_TRUE(compute({3, 3}, twice.all));
  EXPECT_EQ(hierarchy.levels()[1].directions, 0);
  EXPECT_FALSE(compute({6}, twice.all));  // the first level contradicts itself
  EXPECT_FALSE(compute({}, twice.all));
  EXPECT_FALSE(compute({3}, twice.all));
  EXPECT_FALSE(compute({3, 2, 1}, twice.all));
  EXPECT_FALSE(compute({6, 0}, twice.all));
  Rows bad = twice.all;
  bad.wanted(4) = NAN;
  EXPECT_FALSE(compute({3, 3}, bad));
  EXPECT_THROW(TaskHierarchy(12, 0, 1), std::invalid_argument);
  EXPECT_THROW(TaskHierarchy(12, 1, 0), std::invalid_argument);
}

}  // namespace
}  // namespace poise::balance
