// MuJoCo reads the makers' files with its own parser: the same mass matrix, bias, centre of mass
// and Jacobians. Where a file's inertia is none, both take the repair.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <Eigen/Eigenvalues>
#include <fstream>
#include <memory>
#include <regex>
#include <stdexcept>

#include "components/robot/inertia.h"
#include "components/robot_files/robot_files.h"
#include "tests/robot/robot_test_support.h"
#include "tests/robot_import/import_support.h"

namespace poise {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class MakersDynamics : public testing::TestWithParam<std::pair<const char*, const char*>> {};

std::string ForMujoco(std::string text, const std::string& root) {
  if (text.find("<robot") == std::string::npos) {
    // What this version does not know, and meshes; a range limits without being said to since
    // MuJoCo 3, for which the file is written.
    text = std::regex_replace(text, std::regex("<compiler "), "<compiler autolimits=\"true\" ");
    text = std::regex_replace(text, std::regex(" actuatorfrc\\w+=\"[^\"]*\""), "");
    text = std::regex_replace(text, std::regex("<geom[^>]*mesh[^>]*/>"), "");
    text = std::regex_replace(text, std::regex("<mesh[^>]*/>"), "");
    return text;
  }
  text = std::regex_replace(text, std::regex("<(visual|collision)>[^]*?</\\1>"), "");
  text = std::regex_replace(text, std::regex("<mujoco>[^]*?</mujoco>"), "");
  text.insert(text.rfind("</robot>"),
              "<mujoco><compiler fusestatic=\"false\" balanceinertia=\"true\"/></mujoco><link "
              "name=\"world\"/><joint name=\"floating\" type=\"floating\"><parent link=\"world\"/>"
              "<child link=\"" +
                  root + "\"/></joint>");
  return text;
}

TEST_P(MakersDynamics, AreThoseOfMujoco) {
  const auto file = MakersFolder() / GetParam().first;
  if (MakersFolder().empty() || !exists(file)) {
    GTEST_SKIP() << "the maker's file " << GetParam().first << " is not in $POISE_ROBOTS";
  }
  const std::string text = robot::ReadWhole(file);
  ImportOptions options;
  options.file = file;
  const RobotImport imported = ImportRobot(options);
  const robot::RobotModel model = robot::MakeRobot(imported.robot, text);
  const auto path = WriteMaker("mujoco", ForMujoco(text, GetParam().second));
  char error[1000] = "";
  const std::unique_ptr<mjModel, void (*)(mjModel*)> m(
      mj_loadXML(path.c_str(), nullptr, error, sizeof error), mj_deleteModel);
  ASSERT_NE(m, nullptr) << error;
  for (const Repair& repair : imported.robot.repair()) {
    const int body = mj_name2id(m.get(), mjOBJ_BODY, repair.link().c_str());
    ASSERT_GE(body, 0);
    // The file's own numbers less the rotor, or the text's.
    const std::regex inertia(
        "name=\"" + repair.link() +
        "\">[^]*?ixx=\"([^\"]*)\"[^]*?ixy=\"([^\"]*)\"[^]*?ixz=\"([^\"]*)\"[^]*?"
        "iyy=\"([^\"]*)\"[^]*?iyz=\"([^\"]*)\"[^]*?izz=\"([^\"]*)\"");
    std::smatch found;
    ASSERT_TRUE(std::regex_search(text, found, inertia)) << repair.link();
    const auto number = [&](size_t i) { return std::stod(found[i]); };
    Matrix3d matrix;
    matrix << number(1), number(2), number(3), number(2), number(4), number(5), number(3),
        number(5), number(6);
    if (repair.has_inertia()) {
      const Inertia& i = repair.inertia();
      matrix << i.ixx(), i.ixy(), i.ixz(), i.ixy(), i.iyy(), i.iyz(), i.ixz(), i.iyz(), i.izz();
    }
    const int joint = m->body_jntadr[body];
    const Vector3d axis = Vector3d::Map(m->jnt_axis + 3 * joint);
    matrix -= repair.rotor() * axis * axis.transpose();
    const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(matrix);
    Matrix3d axes = principal.eigenvectors();
    if (axes.determinant() < 0) axes.col(0) *= -1;
    const Eigen::Quaterniond q(axes);
    Vector3d::Map(m->body_inertia + 3 * body) = principal.eigenvalues();
    const mjtNum quaternion[4] = {q.w(), q.x(), q.y(), q.z()};
    std::copy_n(quaternion, 4, m->body_iquat + 4 * body);
  }
  const std::unique_ptr<mjData, void (*)(mjData*)> d(mj_makeData(m.get()), mj_deleteData);
  ASSERT_EQ(m->nv, model.num_velocities());
  std::vector<int> position, velocity;
  for (int j = 0; j < model.num_joints(); ++j) {
    const int id =
        mj_name2id(m.get(), mjOBJ_JOINT, model.joints()[static_cast<size_t>(j)].name.c_str());
    position.push_back(m->jnt_qposadr[id]);
    velocity.push_back(m->jnt_dofadr[id]);
    m->dof_armature[velocity.back()] = model.motors()[static_cast<size_t>(j)].reflected_inertia;
  }
  m->opt.gravity[0] = m->opt.gravity[1] = 0;
  m->opt.gravity[2] = -robot::kGravity;
  m->opt.disableflags |= mjDSBL_CONTACT;
  const int root = mj_name2id(m.get(), mjOBJ_BODY, GetParam().second);
  std::mt19937 random(11);
  for (int i = 0; i < 50; ++i) {
    const robot::RobotState state = robot::RandomState(model, &random);
    const robot::RobotData data = robot::Evaluate(model, state);
    MatrixXd t = MatrixXd::Zero(m->nv, m->nv);  // to MuJoCo's order, angular velocity in the body
    t.topLeftCorner<3, 3>().setIdentity();
    t.block<3, 3>(3, 3) = state.base_orientation.toRotationMatrix().transpose();
    const Eigen::Quaterniond& q = state.base_orientation;
    const double base[7] = {state.base_position.x(),
                            state.base_position.y(),
                            state.base_position.z(),
                            q.w(),
                            q.x(),
                            q.y(),
                            q.z()};
    std::copy_n(base, 7, d->qpos);
    for (int j = 0; j < model.num_joints(); ++j) {
      t(velocity[static_cast<size_t>(j)], 6 + j) = 1;
      d->qpos[position[static_cast<size_t>(j)]] = state.joint_position[j];
    }
    VectorXd::Map(d->qvel, m->nv) = t * robot::Velocity(state);
    mj_forward(m.get(), d.get());
    RowMajor mass(m->nv, m->nv), com(3, m->nv);
    mj_fullM(m.get(), mass.data(), d->qM);
    const MatrixXd expected = t.transpose() * mass * t;
    EXPECT_LE((data.mass_matrix - expected).cwiseAbs().maxCoeff(),
              1e-7 * expected.cwiseAbs().maxCoeff());
    const VectorXd force = t.transpose() * VectorXd::Map(d->qfrc_bias, m->nv);
    EXPECT_LE((data.bias + data.gravity - force).cwiseAbs().maxCoeff(),
              1e-6 * force.cwiseAbs().maxCoeff());
    EXPECT_LE((data.com - Vector3d::Map(d->subtree_com + 3 * root)).norm(), 1e-9);
    mj_jacSubtreeCom(m.get(), d.get(), com.data(), root);
    EXPECT_LE((data.com_jacobian - com * t).cwiseAbs().maxCoeff(), 1e-9);
    for (size_t f = 0; f < 2; ++f) {
      const int body =
          mj_name2id(m.get(), mjOBJ_BODY,
                     model.bodies()[static_cast<size_t>(model.feet()[f].body)].name.c_str());
      RowMajor linear(3, m->nv), angular(3, m->nv);
      const Vector3d point = data.foot_pose[f].translation();
      mj_jac(m.get(), d.get(), linear.data(), angular.data(), point.data(), body);
      MatrixXd jacobian(6, m->nv);
      jacobian << linear, angular;
      EXPECT_LE((data.foot_jacobian[f] - jacobian * t).cwiseAbs().maxCoeff(), 1e-9);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Files, MakersDynamics,
                         testing::Values(std::pair("dyros_tocabi.urdf", "Pelvis_Link"),
                                         std::pair("g1_29dof_rev_1_0.urdf", "pelvis"),
                                         std::pair("g1_29dof_rev_1_0.xml", "pelvis")),
                         [](const auto& test) {
                           return std::string(test.param.first).find("xml") != std::string::npos
                                      ? "g1_mjcf"
                                  : test.param.first[0] == 'g' ? "g1_urdf"
                                                               : "tocabi";
                         });

}  // namespace
}  // namespace poise
