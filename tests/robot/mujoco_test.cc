// MuJoCo as oracle: it reads the same URDF with its own parser, merges no links and shares no code
// with ours.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <regex>

#include "tests/robot/robot_test_support.h"
#include "tests/test_seed.h"

namespace poise::robot {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr int kStates = 200;
constexpr double kTolerance = 1e-12;  // of the largest entry
// MuJoCo keeps principal axes: its own diagonalisation returns mantis' torso 7e-9 kg m^2 off the
// file's numbers.
constexpr double kFullInertiaTolerance = 1e-8;

class MujocoTest : public testing::TestWithParam<TestRobot> {
 protected:
  MujocoTest() : model_(LoadTestRobot(GetParam())) {
    std::string urdf = ReadWhole(UrdfPath(GetParam()));
    urdf = std::regex_replace(urdf, std::regex("<(visual|collision)>[^]*?</\\1>"), "");
    const std::string root = GetParam() == TestRobot::kDyros ? "upper_body" : "root";
    const size_t end = urdf.rfind("</robot>");
    urdf.insert(end,
                "<mujoco><compiler fusestatic=\"false\"/></mujoco><link name=\"world\"/>"
                "<joint name=\"floating\" type=\"floating\"><parent link=\"world\"/>"
                "<child link=\"" +
                    root + "\"/></joint>");
    const std::string path =
        testing::TempDir() + "poise_mujoco_" + std::to_string(getpid()) + ".urdf";
    std::ofstream(path) << urdf;
    char error[1000] = "";
    mujoco_ = mj_loadXML(path.c_str(), nullptr, error, sizeof error);
    std::remove(path.c_str());
    if (!mujoco_) throw std::runtime_error(error);
    data_ = mj_makeData(mujoco_);
    root_ = mj_name2id(mujoco_, mjOBJ_BODY, root.c_str());
    for (int j = 0; j < model_.num_joints(); ++j) {
      const size_t index = static_cast<size_t>(j);
      const int id = mj_name2id(mujoco_, mjOBJ_JOINT, model_.joints()[index].name.c_str());
      qpos_.push_back(mujoco_->jnt_qposadr[id]);
      dof_.push_back(mujoco_->jnt_dofadr[id]);
      mujoco_->dof_armature[dof_.back()] = model_.motors()[index].reflected_inertia;
    }
    mujoco_->opt.gravity[0] = mujoco_->opt.gravity[1] = 0;
    mujoco_->opt.gravity[2] = -kGravity;
    mujoco_->opt.disableflags |= mjDSBL_CONTACT;
  }
  ~MujocoTest() override {
    mj_deleteData(data_);
    mj_deleteModel(mujoco_);
  }

  // MuJoCo's velocity = transform * ours: base angular velocity in base axes, joints in its own
  // order.
  MatrixXd Transform(const RobotState& state) const {
    MatrixXd t = MatrixXd::Zero(mujoco_->nv, model_.num_velocities());
    t.topLeftCorner<3, 3>().setIdentity();
    t.block<3, 3>(3, 3) = state.base_orientation.toRotationMatrix().transpose();
    for (int j = 0; j < model_.num_joints(); ++j) t(dof_[static_cast<size_t>(j)], 6 + j) = 1;
    return t;
  }

  void Forward(const RobotState& state) {
    const MatrixXd t = Transform(state);
    for (int i = 0; i < 3; ++i) data_->qpos[i] = state.base_position[i];
    data_->qpos[3] = state.base_orientation.w();
    data_->qpos[4] = state.base_orientation.x();
    data_->qpos[5] = state.base_orientation.y();
    data_->qpos[6] = state.base_orientation.z();
    for (int j = 0; j < model_.num_joints(); ++j) {
      data_->qpos[qpos_[static_cast<size_t>(j)]] = state.joint_position[j];
    }
    VectorXd::Map(data_->qvel, mujoco_->nv) = t * Velocity(state);
    mj_forward(mujoco_, data_);
    mj_subtreeVel(mujoco_, data_);
  }

  template <typename Actual, typename Expected>
  static void ExpectNear(const Actual& actual, const Expected& expected, const char* what,
                         double tolerance = kTolerance, double slack = 0) {
    ASSERT_EQ(actual.rows(), expected.rows());
    ASSERT_EQ(actual.cols(), expected.cols());
    double largest = 1, difference = 0;
    for (Eigen::Index i = 0; i < actual.rows(); ++i) {
      for (Eigen::Index j = 0; j < actual.cols(); ++j) {
        ASSERT_TRUE(std::isfinite(actual(i, j))) << what;
        largest = std::max(largest, std::abs(expected(i, j)));
        difference = std::max(difference, std::abs(actual(i, j) - expected(i, j)));
      }
    }
    EXPECT_LE(difference, tolerance * largest + slack) << what;
  }

  RobotModel model_;
  mjModel* mujoco_ = nullptr;
  mjData* data_ = nullptr;
  int root_ = -1;
  std::vector<int> qpos_, dof_;
  std::mt19937 random_{TestSeed(17)};
};

TEST_P(MujocoTest, SameDegreesOfFreedomAndMass) {
  ASSERT_EQ(mujoco_->nv, model_.num_velocities());
  EXPECT_NEAR(model_.total_mass(), mujoco_->body_subtreemass[root_], 1e-12);
}

TEST_P(MujocoTest, MassMatrixBiasAndGravity) {
  const double inertia_tolerance =
      GetParam() == TestRobot::kDyros ? kTolerance : kFullInertiaTolerance;
  for (int i = 0; i < kStates; ++i) {
    const RobotState state = RandomState(model_, &random_);
    const RobotData data = Evaluate(model_, state);
    const MatrixXd t = Transform(state);
    RowMajor mass(mujoco_->nv, mujoco_->nv);

    Forward(state);
    mj_fullM(mujoco_, mass.data(), data_->qM);
    ExpectNear(data.mass_matrix, MatrixXd(t.transpose() * mass * t), "mass matrix",
               inertia_tolerance);
    // d(transform)/dt v = -w x w = 0: the bias transforms like a force.
    const VectorXd with_gravity = t.transpose() * VectorXd::Map(data_->qfrc_bias, mujoco_->nv);
    mujoco_->opt.gravity[2] = 0;
    Forward(state);
    const VectorXd bias = t.transpose() * VectorXd::Map(data_->qfrc_bias, mujoco_->nv);
    mujoco_->opt.gravity[2] = -kGravity;
    // An error of the inertia turns with the link: ω × δI ω, and δI times what ω accelerates.
    const double rate = state.base_angular_velocity.norm() + state.joint_velocity.lpNorm<1>();
    const double slack =
        GetParam() == TestRobot::kDyros ? 0 : 2 * kFullInertiaTolerance * rate * rate;
    ExpectNear(data.bias, bias, "bias", kTolerance, slack);
    ExpectNear(data.gravity, with_gravity - bias, "gravity");
  }
}

TEST_P(MujocoTest, CenterOfMass) {
  for (int i = 0; i < kStates; ++i) {
    const RobotState state = RandomState(model_, &random_);
    const RobotData data = Evaluate(model_, state);
    Forward(state);
    ExpectNear(data.com, Vector3d::Map(data_->subtree_com + 3 * root_), "position");
    ExpectNear(data.com_velocity, Vector3d::Map(data_->subtree_linvel + 3 * root_), "velocity");
    RowMajor jacobian(3, mujoco_->nv);
    mj_jacSubtreeCom(mujoco_, data_, jacobian.data(), root_);
    ExpectNear(data.com_jacobian, MatrixXd(jacobian * Transform(state)), "Jacobian");
  }
}

TEST_P(MujocoTest, Soles) {
  // The soles as the Robot files place them in links that MuJoCo keeps as bodies of their own.
  struct Sole {
    const char* link;
    Vector3d at;
    double roll, pitch, yaw;
  };
  const std::vector<Sole> soles =
      GetParam() == TestRobot::kDyros
          ? std::vector<Sole>{{"right_foot", {0.03, 0, -0.105}, 0, 0, 0},
                              {"left_foot", {0.03, 0, -0.105}, 0, 0, 0}}
          : std::vector<Sole>{{"right_foot_plate", {0.012, -0.001, -0.02}, 0.02, -0.05, -0.1},
                              {"left_foot_plate", {0.012, 0.001, -0.02}, -0.02, -0.05, 0.1}};
  for (int i = 0; i < kStates; ++i) {
    const RobotState state = RandomState(model_, &random_);
    const RobotData data = Evaluate(model_, state);
    Forward(state);
    for (size_t f = 0; f < 2; ++f) {
      const Sole& sole = soles[f];
      const int body = mj_name2id(mujoco_, mjOBJ_BODY, sole.link);
      const Matrix3d link =
          Eigen::Matrix<double, 3, 3, Eigen::RowMajor>::Map(data_->xmat + 9 * body);
      const Vector3d point = Vector3d::Map(data_->xpos + 3 * body) + link * sole.at;
      ExpectNear(data.foot_pose[f].translation(), point, "position");
      const double cr = std::cos(sole.roll), sr = std::sin(sole.roll), cp = std::cos(sole.pitch),
                   sp = std::sin(sole.pitch), cy = std::cos(sole.yaw), sy = std::sin(sole.yaw);
      Matrix3d rotation;  // URDF's fixed-axis roll, pitch, yaw, written out
      rotation << cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,  //
          sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,          //
          -sp, cp * sr, cp * cr;
      ExpectNear(data.foot_pose[f].linear(), Matrix3d(link * rotation), "orientation");
      RowMajor linear(3, mujoco_->nv), angular(3, mujoco_->nv);
      mj_jac(mujoco_, data_, linear.data(), angular.data(), point.data(), body);
      MatrixXd jacobian(6, mujoco_->nv);
      jacobian << linear, angular;
      ExpectNear(data.foot_jacobian[f], MatrixXd(jacobian * Transform(state)), "Jacobian");
      ExpectNear(data.foot_velocity[f], VectorXd(jacobian * Transform(state) * Velocity(state)),
                 "velocity");
    }
  }
}

TEST_P(MujocoTest, EveryBodysFrameAndJacobian) {
  const RobotState state = RandomState(model_, &random_);
  const RobotData data = Evaluate(model_, state);
  Forward(state);
  const Vector3d point(0.1, -0.2, 0.3);
  for (size_t b = 0; b < model_.bodies().size(); ++b) {
    const int body = mj_name2id(mujoco_, mjOBJ_BODY, model_.bodies()[b].name.c_str());
    ASSERT_GE(body, 0);
    ExpectNear(data.base_position + data.body_position[b], Vector3d::Map(data_->xpos + 3 * body),
               "position");
    const Matrix3d rotation =
        Eigen::Matrix<double, 3, 3, Eigen::RowMajor>::Map(data_->xmat + 9 * body);
    ExpectNear(data.body_rotation[b], rotation, "orientation");
    const Vector3d world = Vector3d::Map(data_->xpos + 3 * body) + rotation * point;
    RowMajor linear(3, mujoco_->nv), angular(3, mujoco_->nv);
    mj_jac(mujoco_, data_, linear.data(), angular.data(), world.data(), body);
    MatrixXd expected(6, mujoco_->nv);
    expected << linear, angular;
    Matrix6X actual = Matrix6X::Constant(6, model_.num_velocities(), 7);
    ComputePointJacobian(model_, data, static_cast<int>(b), point, actual);
    ExpectNear(actual, MatrixXd(expected * Transform(state)), "Jacobian");
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, MujocoTest, testing::Values(TestRobot::kDyros, TestRobot::kMantis),
                         [](const auto& test) {
                           return test.param == TestRobot::kDyros ? "dyros" : "mantis";
                         });

}  // namespace
}  // namespace poise::robot
