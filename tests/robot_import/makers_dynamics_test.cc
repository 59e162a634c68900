// MuJoCo reads the files with its own parser: the same mass matrix, bias, gravity, centre of mass
// and Jacobians, and from its matrices, by the paper's formulas in extended precision, the same
// contact matrices; and by the equations of motion the same accelerations and contact wrenches.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "components/balance/whole_body.h"
#include "tests/robot/robot_test_support.h"
#include "tests/robot_import/import_support.h"
#include "tests/robot_import/mujoco_twin.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using Real = long double;
using MatrixL = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

constexpr int kStates = 40;
// Entries differ by at most this share of the largest. Seen are 7e-15 and 6e-10: MuJoCo
// diagonalises what an MJCF file gives as fullinertia to some 1e-9 by itself.
constexpr double kDynamics = 1e-12, kDynamicsOfMjcf = 1e-7;
// Inverses lose what the posture's condition costs. Seen are 3e-13 and 3e-9.
constexpr double kContact = 1e-9, kContactOfMjcf = 1e-5;

class MakersDynamics : public testing::TestWithParam<const char*> {
 protected:
  std::filesystem::path File() const {
    const std::string name = GetParam();
    if (name.starts_with("heron")) {
      return std::filesystem::path(POISE_SOURCE_DIR) / "deploy/robots/heron" / name;
    }
    return MakersFolder().empty() ? std::filesystem::path() : MakersFolder() / name;
  }
  void SetUp() override {
    if (!exists(File())) {
      GTEST_SKIP() << "the maker's file " << GetParam() << " is not in $POISE_ROBOTS";
    }
  }
  bool IsMjcf() const { return File().extension() == ".xml"; }
};

/// Largest |x − y| over the largest |y|, by name.
class Errors {
 public:
  template <typename X, typename Y>
  void Add(const char* name, const X& x, const Y& y) {
    const Real scale = y.size() ? y.cwiseAbs().maxCoeff() : Real(0);
    const Real error = (x.template cast<Real>() - y).cwiseAbs().maxCoeff();
    const double relative = static_cast<double>(error / (scale > 0 ? scale : Real(1)));
    double& worst = worst_[name];
    worst = std::isfinite(relative) ? std::max(worst, relative) : HUGE_VAL;
  }
  void Check(const std::string& what, double bound) const {
    for (const auto& [name, worst] : worst_) {
      fmt::print("{:<26} {:<34} {:.1e}\n", what, name, worst);
      EXPECT_LT(worst, bound) << name;
    }
  }

 private:
  std::map<std::string, double> worst_;
};

TEST_P(MakersDynamics, AreThoseOfMujoco) {
  const MujocoTwin twin(File());
  std::mt19937 random(TestSeed(11));
  Errors errors;
  for (int i = 0; i < kStates; ++i) {
    const robot::RobotState state = robot::RandomState(twin.model(), &random);
    const robot::RobotData data = robot::Evaluate(twin.model(), state);
    const MujocoTwin::Dynamics truth = twin.At(state);
    const auto add = [&](const char* name, const auto& x, const auto& y) {
      errors.Add(name, x, y.template cast<Real>());
    };
    add("A", data.mass_matrix, truth.mass);
    add("b", data.bias, truth.bias);
    add("g", data.gravity, truth.gravity);
    add("COM", data.com, truth.com);
    add("J_com", data.com_jacobian, truth.com_jacobian);
    for (size_t f = 0; f < 2; ++f) {
      add("sole", data.foot_pose[f].matrix(), truth.foot[f].sole.matrix());
      add("J of the sole", data.foot_jacobian[f], truth.foot[f].jacobian);
      add("Jdot v of the sole", data.foot_bias_acceleration[f], truth.foot[f].acceleration);
    }
  }
  errors.Check(GetParam(), IsMjcf() ? kDynamicsOfMjcf : kDynamics);
}

/// Joints within their ranges, so that legs are bent as they can be.
robot::RobotState WithinRanges(const robot::RobotModel& model, std::mt19937* random) {
  robot::RobotState state = robot::RandomState(model, random);
  std::uniform_real_distribution<double> share(0.1, 0.9);
  for (int j = 0; j < model.num_joints(); ++j) {
    const robot::Joint& joint = model.joints()[static_cast<size_t>(j)];
    const double lower = std::max(joint.lower, -M_PI), upper = std::min(joint.upper, M_PI);
    state.joint_position[j] = lower + share(*random) * (upper - lower);
  }
  return state;
}

TEST_P(MakersDynamics, ContactMatricesAreThoseOfMujoco) {
  const MujocoTwin twin(File());
  const auto model = std::make_shared<const robot::RobotModel>(twin.model());
  balance::WholeBody body(model);
  std::mt19937 random(TestSeed(12));
  std::normal_distribution<double> normal;
  const Eigen::Index k = model->num_joints(), n = k + 6;
  Errors errors;
  int states = 0;
  for (int i = 0; i < kStates; ++i) {
    const robot::RobotState state = WithinRanges(*model, &random);
    const MujocoTwin::Dynamics truth = twin.At(state);
    for (const std::array<bool, 2>& in_contact :
         {std::array{true, true}, std::array{true, false}, std::array{false, true}}) {
      if (!body.Update(state, in_contact)) continue;  // straight legs
      ++states;
      const balance::ContactDynamics& contact = body.contact();
      const Eigen::Index m = 6 * (in_contact[0] + in_contact[1]);
      MatrixL jc(m, n), gamma(m, 1);
      Eigen::Index row = 0;
      for (size_t f = 0; f < 2; ++f) {
        if (!in_contact[f]) continue;
        MatrixL to_sole = MatrixL::Zero(6, 6);
        to_sole.topLeftCorner(3, 3) = to_sole.bottomRightCorner(3, 3) =
            truth.foot[f].sole.linear().transpose().cast<Real>();
        jc.middleRows(row, 6) = to_sole * truth.foot[f].jacobian.cast<Real>();
        gamma.middleRows(row, 6) = to_sole * truth.foot[f].acceleration.cast<Real>();
        row += 6;
      }
      const MatrixL a = truth.mass.cast<Real>(), identity = MatrixL::Identity(n, n);
      const MatrixL b = truth.bias.cast<Real>(), g = truth.gravity.cast<Real>();
      const MatrixL inverse = a.llt().solve(identity);
      const MatrixL lambda = MatrixL(jc * inverse * jc.transpose()).inverse();
      const MatrixL j_bar_t = lambda * jc * inverse;
      errors.Add("(4) Lambda_c", contact.lambda_c(), lambda);
      errors.Add("(5) mu_c", contact.mu_c(), MatrixL(lambda * (jc * inverse * b - gamma)));
      errors.Add("(6) p_c", contact.p_c(), MatrixL(lambda * jc * inverse * g));
      errors.Add("(7) Jbar_c^T", contact.jc_bar_transpose(), j_bar_t);
      const MatrixL w = (inverse * (identity - jc.transpose() * j_bar_t)).bottomRightCorner(k, k);
      errors.Add("(22) W", contact.w(), w);
      const Eigen::MatrixXd w_pinv = contact.w_pinv();
      errors.Add("(22) W W+ W", MatrixL(w * w_pinv.cast<Real>() * w), w);
      errors.Add("(22) W+ W symmetric", MatrixL(w_pinv.cast<Real>() * w),
                 MatrixL((w_pinv.cast<Real>() * w).transpose()));
      // A q̈ + J_cᵀ F = Sᵀ Γ − b − g, J_c q̈ = −J̇_c q̇.
      Eigen::VectorXd torque(k);
      for (double& x : torque) x = 50 * normal(random);
      MatrixL kkt = MatrixL::Zero(n + m, n + m), right(n + m, 1);
      kkt << a, jc.transpose(), jc, MatrixL::Zero(m, m);
      MatrixL force = -b - g;
      force.bottomRows(k) += torque.cast<Real>();
      right << force, -gamma;
      const MatrixL solution = kkt.partialPivLu().solve(right);
      Eigen::VectorXd acceleration(n), wrench(m);
      contact.Acceleration(torque, acceleration);
      contact.ExpectedWrench(torque, wrench);
      errors.Add("(9) acceleration", acceleration, MatrixL(solution.topRows(n)));
      errors.Add("(34) contact wrenches", wrench, MatrixL(solution.bottomRows(m)));
    }
  }
  EXPECT_GT(states, kStates);
  errors.Check(GetParam(), IsMjcf() ? kContactOfMjcf : kContact);
}

INSTANTIATE_TEST_SUITE_P(Files, MakersDynamics,
                         testing::Values("heron.urdf", "heron.xml", "dyros_tocabi.urdf",
                                         "g1_29dof_rev_1_0.urdf", "g1_29dof_rev_1_0.xml",
                                         "talos_reduced_box.urdf", "icub_reduced.urdf"),
                         [](const auto& test) {
                           std::string name = test.param;
                           for (char& c : name) {
                             if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
                           }
                           return name;
                         });

}  // namespace
}  // namespace poise
