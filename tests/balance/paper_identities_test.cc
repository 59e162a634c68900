// Every identity of sections 3 to 6 and of the appendix on random states of two robots, in both
// supports; the test prints the worst residuals, and docs/reference/equations/ quotes them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>

#include "components/balance/distribution_ratio.h"
#include "components/balance/redistribution.h"
#include "tests/balance/balance_test_support.h"

namespace poise::balance {
namespace {

constexpr int kStates = 1000;
constexpr double kTolerance = 1e-9;

class Table {
 public:
  void Add(const std::string& equation, int support, double residual) {
    auto& row = rows_.try_emplace(equation, std::array<double, 2>{kNotApplicable, kNotApplicable})
                    .first->second;
    row[support] = std::max(row[support], residual);
  }
  void PrintAndCheck(const std::string& robot, int states) const {
    fmt::print("\n{}: worst residual of {} states\n{:<58} {:>9} {:>9}\n", robot, states, "",
               "double", "single");
    for (const auto& [equation, row] : rows_) {
      const auto cell = [](double residual) {
        return residual == kNotApplicable ? std::string("-") : fmt::format("{:.1e}", residual);
      };
      fmt::print("{:<58} {:>9} {:>9}\n", equation, cell(row[0]), cell(row[1]));
      EXPECT_LT(row[0], kTolerance) << robot << ", double support, " << equation;
      EXPECT_LT(row[1], kTolerance) << robot << ", single support, " << equation;
    }
  }

 private:
  static constexpr double kNotApplicable = -1;
  std::map<std::string, std::array<double, 2>> rows_;
};

// K of (35) for the frame given.
MatrixL ResultantMap(const ContactGeometry& geometry, const Eigen::Isometry3d& frame) {
  const int feet = geometry.in_contact[0] + geometry.in_contact[1];
  MatrixL k(6, 6 * feet);
  int column = 0;
  for (int i = 0; i < 2; ++i) {
    if (!geometry.in_contact[i]) continue;
    k.middleCols(column, 6) = WrenchTransform(frame, geometry.sole[i]).cast<Real>();
    column += 6;
  }
  return k;
}

double ScalarResidual(Real x, Real y) {
  return MaxResidual(MatrixL::Constant(1, 1, x), MatrixL::Constant(1, 1, y));
}

using Vector3L = Eigen::Matrix<Real, 3, 1>;
using Matrix3L = Eigen::Matrix<Real, 3, 3>;

Matrix3L Hat(const Vector3L& p) {
  Matrix3L hat;
  hat << 0, -p.z(), p.y(), p.z(), 0, -p.x(), -p.y(), p.x(), 0;  // (36)
  return hat;
}

Vector6d Margins(const Vector6d& wrench, const ContactLimits& limits) {
  const VectorL w = wrench.cast<Real>();
  const Real load = std::abs(w(2));
  Vector6d margins;
  margins << static_cast<double>(-w(2)),                                                   // (29)
      static_cast<double>(limits.friction * load - std::sqrt(w(0) * w(0) + w(1) * w(1))),  // (30)
      static_cast<double>(limits.yaw_friction * load - std::abs(w(5))),                    // (31)
      static_cast<double>(limits.half_width * load - std::abs(w(3))),                      // (32)
      static_cast<double>(limits.half_length * load - std::abs(w(4))), 0;                  // (33)
  return margins;
}

// The appendix, axis by axis as the paper writes it, at a random η. `soles` in frame O.
template <class Add>
void CheckRatio(const Vector6d& resultant, const std::array<Eigen::Isometry3d, 2>& soles,
                StateSampler* sampler, const Add& add) {
  const double eta = sampler->Uniform(0.05, 0.95);
  const auto share = DistributeResultant(resultant, soles, eta);
  const Vector3L f = resultant.head<3>().cast<Real>(), m = resultant.tail<3>().cast<Real>();
  std::array<Vector3L, 2> p, force, moment;  // along O's axes, moments about the soles' centres
  for (size_t i = 0; i < 2; ++i) {
    const Matrix3L rotation = soles[i].linear().cast<Real>();
    p[i] = soles[i].translation().cast<Real>();
    force[i] = rotation * share[i].head<3>().cast<Real>();
    moment[i] = rotation * share[i].tail<3>().cast<Real>();
  }
  const Vector3L sum = moment[0] + moment[1];
  add("(55)-(57) forces add up to the resultant's", Residual(force[0] + force[1], f));
  add("(58)-(60) moments add up to the resultant's",
      Residual(sum + Hat(p[0]) * force[0] + Hat(p[1]) * force[1], m));
  add("(61)-(64) right foot's force is eta F", Residual(force[0], eta * f));
  add("(61)-(64) left foot's force is (1 - eta) F", Residual(force[1], (1 - Real(eta)) * f));
  add("(65)-(67) right foot's moment", Residual(moment[0], eta * sum));
  add("(65)-(67) left foot's moment", Residual(moment[1], (1 - Real(eta)) * sum));

  const Vector3L d = p[0] - p[1], l = p[1];
  const Vector3L a(d.z() * f.y() - d.y() * f.z(),           // (71)
                   -d.z() * f.x() + d.x() * f.z(),          // (74)
                   -d.x() * f.y() + d.y() * f.x());         // (77)
  const Vector3L b(m.x() + l.z() * f.y() - l.y() * f.z(),   // (72)
                   m.y() - l.z() * f.x() + l.x() * f.z(),   // (75)
                   m.z() - l.x() * f.y() + l.y() * f.x());  // (78)
  const Vector3L own = (a * eta + b) * eta;
  add("(68), (71), (72) right foot's M_x", ScalarResidual(moment[0].x(), own.x()));
  add("(74), (75) right foot's M_y", ScalarResidual(moment[0].y(), own.y()));
  add("(77), (78) right foot's M_z", ScalarResidual(moment[0].z(), own.z()));

  // Limits that leave this η, on feet parallel to O: the interval's ends against the roots of (70)
  // as it is read.
  const double load = -resultant(2);
  const Eigen::Vector3d half = (a * eta + b).cwiseAbs().cast<double>() / load;
  ContactLimits limits;
  limits.friction = 1 + resultant.head<2>().norm() / load;
  limits.half_width = half.x() * sampler->Uniform(1.01, 3);
  limits.half_length = half.y() * sampler->Uniform(1.01, 3);
  limits.yaw_friction = half.z() * sampler->Uniform(1.01, 3);
  const RatioInterval interval = FeasibleRatio(
      resultant, std::array<Eigen::Vector3d, 2>{soles[0].translation(), soles[1].translation()},
      limits, 0, 1);
  ASSERT_TRUE(interval.feasible) << interval.limiting_condition;
  const Vector3L c = Vector3L(limits.half_width, limits.half_length, limits.yaw_friction) *
                     f.z();  // (73), (76), (79)
  Real low = 0, high = 1;
  for (int i = 0; i < 3; ++i) {
    const Real square = a(i) * a(i), product = a(i) * b(i);
    const Real root = std::sqrt(product * product - square * (b(i) * b(i) - c(i) * c(i)));
    low = std::max(low, (-product - root) / square);
    high = std::min(high, (-product + root) / square);
  }
  add("(69), (70), (73), (76), (79) least feasible ratio", ScalarResidual(Real(interval.min), low));
  add("(69), (70), (73), (76), (79) greatest feasible ratio",
      ScalarResidual(Real(interval.max), high));
}

void CheckState(const WholeBody& body, const std::array<bool, 2>& in_contact, StateSampler* sampler,
                Table* table, int* balanced_states) {
  const int support = in_contact[0] && in_contact[1] ? 0 : 1;
  const auto add = [&](const char* equation, double residual) {
    table->Add(equation, support, residual);
  };
  const ContactDynamics& contact = body.contact();
  const PaperContact paper(body, in_contact);
  const Eigen::Index k = paper.k, n = paper.n, m = paper.m;

  // Section 3.1
  add("(4)  Lambda_c", Residual(contact.lambda_c(), paper.lambda_c));
  add("(5)  mu_c", Residual(contact.mu_c(), paper.mu_c));
  add("(6)  p_c", Residual(contact.p_c(), paper.p_c));
  add("(7)  Jbar_c^T", Residual(contact.jc_bar_transpose(), paper.jc_bar_t));
  add("(22) W", Residual(contact.w(), paper.w));
  add("(22) W^+ against the eigen-decomposition", Residual(contact.w_pinv(), paper.w_pinv));
  const MatrixL w = contact.w().cast<Real>(), w_pinv = contact.w_pinv().cast<Real>();
  add("(22) W W^+ W = W", Residual(w * w_pinv * w, w));
  add("(22) W^+ W W^+ = W^+", Residual(w_pinv * w * w_pinv, w_pinv));
  add("(22) W^+ W symmetric", Residual(w_pinv * w, (w_pinv * w).transpose()));

  const Eigen::VectorXd torque = sampler->Vector(k, 100);
  Eigen::VectorXd acceleration(n), wrench(m);
  VectorL kkt_acceleration, kkt_wrench;
  paper.Solve(torque.cast<Real>(), &kkt_acceleration, &kkt_wrench);
  contact.Acceleration(torque, acceleration);
  contact.ExpectedWrench(torque, wrench);
  add("(3)  contact accelerations are zero",
      Residual(paper.jc * acceleration.cast<Real>(), -paper.gamma));
  // Any motion and any wrench have a generalised force, by (1).
  const VectorL motion = sampler->Vector(n, 10).cast<Real>();
  const VectorL push = sampler->Vector(m, 100).cast<Real>();
  const VectorL force = paper.a * motion + paper.b + paper.g + paper.jc.transpose() * push;
  add("(2), (3) contact-space equation for any motion",
      Residual(contact.lambda_c().cast<Real>() * (paper.jc * motion + paper.gamma) +
                   contact.mu_c().cast<Real>() + contact.p_c().cast<Real>() + push,
               contact.jc_bar_transpose().cast<Real>() * force));
  add("(8), (34) wrenches against the full KKT system", Residual(wrench, kkt_wrench));
  add("(9)-(11) acceleration against the paper's formula",
      Residual(acceleration,
               paper.a_inverse * (paper.nc_t * paper.s.transpose() * torque.cast<Real>() - paper.b -
                                  paper.g + paper.jc.transpose() * (paper.mu_c + paper.p_c))));
  add("(9)  acceleration against the full KKT system", Residual(acceleration, kkt_acceleration));
  add("(1)  equations of motion",
      Residual(paper.a * acceleration.cast<Real>() + paper.jc.transpose() * wrench.cast<Real>(),
               paper.s.transpose() * torque.cast<Real>() - paper.b - paper.g));

  // Sections 3.2 to 3.4
  const StackedTask stacked = PaperTask(body, in_contact);
  const Eigen::Index t = stacked.jacobian.rows();
  TaskDynamics task(static_cast<int>(k), static_cast<int>(t));
  ASSERT_TRUE(task.Compute(contact, stacked.jacobian, stacked.bias_acceleration));
  const PaperTaskSpace space(paper, stacked);
  // Postures that put tasks in conflict lose digits to the condition of the task space alone.
  add("(14) Lambda", Residual(task.Lambda(), space.lambda));
  add("(15) Jbar^T", Residual(task.JBarTranspose(), space.j_bar_t));
  add("(16) mu with velocity terms", Residual(task.Mu(), space.mu));
  add("(17) p", Residual(task.P(), space.p));
  add("(23) Jtilde^T", Residual(task.JTildeTranspose(), space.j_tilde_t));
  add("(27) Jbar^T S^T", Residual(task.JBarTranspose().rightCols(k), space.q));
  add("(23) Jbar^T S^T Jtilde^T = I",
      Residual(task.JBarTranspose().rightCols(k) * task.JTildeTranspose(),
               Eigen::MatrixXd::Identity(t, t)));
  const VectorL task_acceleration = space.j * kkt_acceleration + space.bias_acceleration;
  add("(12), (13), (18)-(20) task-space equation for any torque",
      Residual(task.Lambda().cast<Real>() * task_acceleration + task.Mu().cast<Real>() +
                   task.P().cast<Real>(),
               task.JBarTranspose().cast<Real>() * paper.s.transpose() * torque.cast<Real>()));

  const Eigen::VectorXd wanted = sampler->Vector(t, 10);
  Eigen::VectorXd command(k);
  task.TaskTorque(wanted, command);
  paper.Solve(command.cast<Real>(), &kkt_acceleration, &kkt_wrench);
  add("(24) gives f* in the KKT system",
      Residual(VectorL(space.j * kkt_acceleration + space.bias_acceleration),
               MatrixL(wanted.cast<Real>())));
  add("(24) torque against the paper's formula",
      Residual(command,
               space.j_tilde_t * (space.lambda * wanted.cast<Real>() + space.mu + space.p)));

  Eigen::VectorXd extra = torque;
  task.ProjectIntoNullSpace(extra);
  add("(26) projection against the paper's formula",
      Residual(extra, space.n_tilde_t * torque.cast<Real>()));
  VectorL with_extra, ignored;
  paper.Solve((command + extra).cast<Real>(), &with_extra, &ignored);
  add("(26) no task acceleration", Residual(space.j * with_extra, space.j * kkt_acceleration));
  add("(28) gives f* with any torque in the null space",
      Residual(VectorL(space.j * with_extra + space.bias_acceleration),
               MatrixL(wanted.cast<Real>())));
  // The task torque has the least E_a: what the null space adds is W-orthogonal to it.
  const VectorL moved_by = with_extra - kkt_acceleration, own = extra.cast<Real>();
  add("(21) E_a is the energy of the acceleration",
      ScalarResidual(own.dot(w * own) / 2, moved_by.dot(paper.a * moved_by) / 2));
  const VectorL force_part = task.JTildeTranspose().cast<Real>() * wanted.cast<Real>();
  add("(21), (23) least E_a: a null-space torque adds its own",
      ScalarResidual((force_part + own).dot(w * (force_part + own)),
                     force_part.dot(w * force_part) + own.dot(w * own)));

  // Section 4
  const ContactGeometry geometry = body.geometry();
  Eigen::Isometry3d frame;
  ASSERT_TRUE(FrameO(geometry.sole, geometry.in_contact, &frame));
  const MatrixL map = ResultantMap(geometry, frame);
  std::array<Eigen::Isometry3d, 2> soles;  // in O
  MatrixL written(6, 0);
  for (size_t i = 0; i < 2; ++i) {
    soles[i] = frame.inverse(Eigen::Isometry) * geometry.sole[i];
    if (!geometry.in_contact[i]) continue;
    const Matrix3L rotation = soles[i].linear().cast<Real>();
    written.conservativeResize(6, written.cols() + 6);
    written.rightCols(6) << rotation, Matrix3L::Zero(),
        Hat(soles[i].translation().cast<Real>()) * rotation, rotation;
  }
  add("(35), (36) K against [R 0; P^R R]", Residual(map, written));
  contact.ExpectedWrench(command, wrench);
  BalanceControl balance(static_cast<int>(k), 1);
  TaskDynamics height(static_cast<int>(k), 1);
  const StackedTask com_height = ComHeight(body);
  ASSERT_TRUE(height.Compute(contact, com_height.jacobian, com_height.bias_acceleration));
  BalanceResult result;
  ContactLimits limits;
  Eigen::VectorXd untouched = command;
  balance.Compute(contact, height, geometry, limits, false, untouched, &result);
  EXPECT_EQ(untouched, command);
  const ContactLimits patch{.half_length = 0.12, .half_width = 0.05};
  const ContactMargins margins = CheckContact(wrench.head(6), patch);
  Vector6d computed;
  computed << margins.normal, margins.friction, margins.yaw, margins.roll, margins.pitch, 0;
  add("(29)-(33) margins of a foot", Residual(computed, Margins(wrench.head(6), patch)));
  add("(35) resultant of the expected wrenches",
      Residual(result.resultant_task, map * wrench.cast<Real>()));
  if (support == 0) {
    // Wrench pairs without resultant, and torques that only move load between the feet.
    MatrixL internal(12, 6);
    internal << MatrixL::Identity(6, 6), -(map.rightCols(6).lu().solve(map.leftCols(6)));
    const Eigen::VectorXd change = (internal * sampler->Vector(6, 50).cast<Real>()).cast<double>();
    Eigen::VectorXd shift(k), moved(12);
    const double base = RedistributionTorque(contact.contact_jacobian(), change, shift);
    add("(35) zero resultant leaves the base rows zero", base / (1 + change.norm()));
    contact.ExpectedWrench(command + shift, moved);
    add("(35) resultant does not depend on the split",
        Residual(map * moved.cast<Real>(), map * wrench.cast<Real>()));
    add("(50) closed form changes the wrenches by dF", Residual(moved - wrench, change));
    paper.Solve((command + shift).cast<Real>(), &with_extra, &ignored);
    add("(52) no acceleration in the KKT system", Residual(with_extra, kkt_acceleration));
    // (51) with V2: the minimising solution is unique, for the six columns are independent.
    add("(47)-(49) W V2 = 0", Residual(w * paper.null_basis, MatrixL::Zero(k, m - 6)));
    const MatrixL columns = paper.jc_bar_t * paper.s.transpose() * paper.null_basis;
    const VectorL alpha = columns.colPivHouseholderQr().solve(change.cast<Real>());
    add("(51), (52) closed form against the SVD route", Residual(shift, paper.null_basis * alpha));
    add("(49) V2 spans the closed form's torques",
        Residual(VectorL(paper.null_basis * (paper.null_basis.transpose() * shift.cast<Real>())),
                 MatrixL(shift.cast<Real>())));
  }

  // Section 5, with bounds that the random state is sure to break. A resultant without load has no
  // centre of pressure.
  const double weight = body.model().total_mass() * robot::kGravity;
  if (result.resultant_task(2) < -0.1 * weight) {
    const Vector3L pressure(result.cop_task.x(), result.cop_task.y(), 0);
    const VectorL about = result.resultant_task.tail<3>().cast<Real>() -
                          Hat(pressure) * result.resultant_task.head<3>().cast<Real>();
    add("(37), (38) no M_x, M_y about the CoP", Residual(about.head(2), VectorL::Zero(2)));
    limits.half_length = std::abs(result.cop_task.x()) * sampler->Uniform(0.3, 1.5);
    limits.half_width = std::abs(result.cop_task.y()) * sampler->Uniform(0.3, 0.9);
    Eigen::VectorXd balanced = command;
    ASSERT_EQ(balance.Compute(contact, height, geometry, limits, true, balanced, &result),
              BalanceStatus::kOk);
    contact.ExpectedWrench(balanced, wrench);
    const VectorL resultant = map * wrench.cast<Real>();
    add("(42) predicted resultant", Residual(result.resultant, resultant));
    const Eigen::Vector2d cop = CenterOfPressure(resultant.cast<double>());
    add("(42) CoP on its bound", (cop - result.cop_desired).norm() / (1 + result.cop_task.norm()));
    ++*balanced_states;
    EXPECT_DOUBLE_EQ(std::abs(result.cop_desired.y()), limits.half_width);
    VectorL after;
    paper.Solve(balanced.cast<Real>(), &after, &ignored);
    const MatrixL height_row = com_height.jacobian.cast<Real>();
    add("(40) COM height acceleration unchanged",
        Residual(height_row * after, height_row * kkt_acceleration));
    // F_z along the world's vertical, as the COM's height is.
    const MatrixL vertical = (frame.linear().row(2)).cast<Real>();
    add("(42) vertical force unchanged",
        Residual(MatrixL(vertical * result.resultant.head<3>().cast<Real>()),
                 MatrixL(vertical * result.resultant_task.head<3>().cast<Real>())));
    if (support == 0) {
      CheckRatio(result.resultant, soles, sampler, add);
      const auto share = DistributeResultant(result.resultant, soles, sampler->Uniform(0, 1));
      Eigen::VectorXd split(12), shift(k);
      split << share[0], share[1];
      RedistributionTorque(contact.contact_jacobian(), split - wrench, shift);
      VectorL last, split_wrench;
      paper.Solve((balanced + shift).cast<Real>(), &last, &split_wrench);
      add("(53) wrenches in the KKT system are the shares", Residual(split_wrench, split));
      add("(53) acceleration is that of (39)", Residual(last, after));
    }
    // (39)-(46) as written.
    const PaperTaskSpace high(paper, com_height);
    Eigen::Isometry3d frame_d = frame;
    frame_d.translation() +=
        frame.linear() * Eigen::Vector3d(result.cop_desired.x(), result.cop_desired.y(), 0);
    const MatrixL map_d = ResultantMap(geometry, frame_d);
    MatrixL select = MatrixL::Zero(2, 6);
    select(0, 3) = select(1, 4) = 1;
    const MatrixL control = select * map_d * paper.jc_bar_t * paper.s.transpose() * high.n_tilde_t;
    const MatrixL inverse = paper.w_pinv * control.transpose() *
                            MatrixL(control * paper.w_pinv * control.transpose()).inverse();
    const VectorL moments = select * map_d * kkt_wrench;
    add("(39)-(46) null-space torque against the paper's formula",
        Residual(balanced - command, high.n_tilde_t * inverse * -moments));
  }
}

void CheckRobot(const char* name, std::shared_ptr<const robot::RobotModel> model, unsigned seed) {
  StateSampler sampler(model, seed);
  WholeBody body(model);
  Table table;
  int balanced_states = 0;
  for (int i = 0; i < kStates; ++i) {
    const robot::RobotState state = sampler.Draw();
    const std::array<bool, 2> single = i % 2 == 0 ? kRight : kLeft;
    for (const auto& in_contact : {kDouble, single}) {
      ASSERT_TRUE(body.Update(state, in_contact)) << name << " state " << i;
      CheckState(body, in_contact, &sampler, &table, &balanced_states);
      if (testing::Test::HasFatalFailure()) FAIL() << name << " state " << i;
    }
  }
  table.PrintAndCheck(name, kStates);
  fmt::print("Section 5 checked in {} of {} cases\n", balanced_states, 2 * kStates);
  EXPECT_GT(balanced_states, kStates);
}

TEST(PaperIdentities, Biped) { CheckRobot("biped, 12 joints", Biped(), 1); }
TEST(PaperIdentities, Humanoid) { CheckRobot("humanoid with waist and arms", Humanoid(), 2); }

}  // namespace
}  // namespace poise::balance
