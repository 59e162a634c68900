// The second robot: one machine as URDF and as MJCF, told apart by nothing that MuJoCo's own parser
// reads of either.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <cstdio>
#include <fstream>
#include <memory>
#include <regex>
#include <set>

#include "components/robot/posture.h"
#include "tests/robot/robot_test_support.h"

namespace poise::robot {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kTolerance = 1e-9;

std::string Folder() { return POISE_SOURCE_DIR "/deploy/robots/heron/heron"; }

struct ModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
using Model = std::unique_ptr<mjModel, ModelDeleter>;

Model Compile(const std::string& text, const char* ending) {
  const std::string path = testing::TempDir() + "poise_heron_" + std::to_string(getpid()) + ending;
  std::ofstream(path) << text;
  char error[1000] = "";
  Model model(mj_loadXML(path.c_str(), nullptr, error, sizeof error));
  std::remove(path.c_str());
  EXPECT_TRUE(model) << error;
  return model;
}

Model FromUrdf() {
  std::string urdf = ReadWhole(Folder() + ".urdf");
  urdf = std::regex_replace(urdf, std::regex("<(visual|collision)>[^]*?</\\1>"), "");
  urdf.insert(urdf.rfind("</robot>"),
              "<mujoco><compiler fusestatic=\"false\"/></mujoco><link name=\"world\"/>"
              "<joint name=\"floating\" type=\"floating\"><parent link=\"world\"/>"
              "<child link=\"pelvis\"/></joint>");
  return Compile(urdf, ".urdf");
}

Model FromMjcf(const std::string& compiler = "") {
  std::string mjcf = ReadWhole(Folder() + ".xml");
  const std::string plain = "<compiler angle=\"radian\"";
  const size_t at = mjcf.find(plain);
  EXPECT_NE(at, std::string::npos);
  mjcf.insert(at + plain.size(), compiler);
  return Compile(mjcf, ".xml");
}

Vector3d Vector(const mjtNum* v) { return {v[0], v[1], v[2]}; }
Matrix3d Rotation(const mjtNum* q) {
  return Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

Matrix3d Inertia(const mjModel& model, int body) {
  const Matrix3d axes = Rotation(model.body_iquat + 4 * body);
  return axes * Vector(model.body_inertia + 3 * body).asDiagonal() * axes.transpose();
}

std::vector<std::string> Links() {
  std::vector<std::string> names;
  const RobotModel model = LoadRobotFiles(Folder() + ".pbtxt");
  for (const Body& body : model.bodies()) names.push_back(body.name);
  return names;
}

void ExpectSameBodies(const mjModel& one, const mjModel& other) {
  for (const std::string& name : Links()) {
    SCOPED_TRACE(name);
    const int a = mj_name2id(&one, mjOBJ_BODY, name.c_str()),
              b = mj_name2id(&other, mjOBJ_BODY, name.c_str());
    ASSERT_GE(a, 0);
    ASSERT_GE(b, 0);
    EXPECT_NEAR(one.body_mass[a], other.body_mass[b], kTolerance);
    EXPECT_LT((Vector(one.body_ipos + 3 * a) - Vector(other.body_ipos + 3 * b)).norm(), kTolerance);
    EXPECT_LT((Inertia(one, a) - Inertia(other, b)).norm(), kTolerance);
    EXPECT_STREQ(mj_id2name(&one, mjOBJ_BODY, one.body_parentid[a]),
                 mj_id2name(&other, mjOBJ_BODY, other.body_parentid[b]));
    if (name == "pelvis") continue;  // stands on its feet in the MJCF file
    EXPECT_LT((Vector(one.body_pos + 3 * a) - Vector(other.body_pos + 3 * b)).norm(), kTolerance);
    EXPECT_LT((Rotation(one.body_quat + 4 * a) - Rotation(other.body_quat + 4 * b)).norm(),
              kTolerance);
  }
}

TEST(Heron, IsTheSameRobotInBothFiles) {
  const Model urdf = FromUrdf(), mjcf = FromMjcf();
  ASSERT_TRUE(urdf && mjcf);
  ASSERT_EQ(urdf->nv, 29 + 6);
  ASSERT_EQ(mjcf->nv, 29 + 6);
  ExpectSameBodies(*urdf, *mjcf);
  const RobotModel model = LoadRobotFiles(Folder() + ".pbtxt");
  for (size_t j = 0; j < model.joints().size(); ++j) {
    const Joint& joint = model.joints()[j];
    const MotorModel& motor = model.motors()[j];
    SCOPED_TRACE(joint.name);
    const int a = mj_name2id(urdf.get(), mjOBJ_JOINT, joint.name.c_str()),
              b = mj_name2id(mjcf.get(), mjOBJ_JOINT, joint.name.c_str());
    ASSERT_GE(a, 0);
    ASSERT_GE(b, 0);
    EXPECT_LT((Vector(urdf->jnt_axis + 3 * a) - Vector(mjcf->jnt_axis + 3 * b)).norm(), kTolerance);
    for (int end = 0; end < 2; ++end) {
      EXPECT_NEAR(urdf->jnt_range[2 * a + end], mjcf->jnt_range[2 * b + end], kTolerance);
    }
    // What a URDF has no word for stands in the robot's text.
    const int dof = mjcf->jnt_dofadr[b];
    EXPECT_NEAR(mjcf->dof_armature[dof], motor.reflected_inertia, kTolerance);
    EXPECT_NEAR(mjcf->dof_frictionloss[dof], motor.coulomb_friction, kTolerance);
    EXPECT_NEAR(mjcf->dof_damping[dof], motor.viscous_friction, kTolerance);
    const int actuator = mj_name2id(mjcf.get(), mjOBJ_ACTUATOR, joint.name.c_str());
    ASSERT_GE(actuator, 0);
    EXPECT_NEAR(mjcf->actuator_forcerange[2 * actuator + 1], joint.effort, kTolerance);
    EXPECT_GE(motor.torque_per_ampere() * motor.peak_current, joint.effort);
  }
}

// MuJoCo computes each link's mass, COM and inertia of its shapes' own.
TEST(Heron, InertiasAreThoseOfItsShapes) {
  const Model stated = FromMjcf(), computed = FromMjcf(" inertiafromgeom=\"true\"");
  ASSERT_TRUE(stated && computed);
  ExpectSameBodies(*stated, *computed);
}

TEST(Heron, ImuIsAtTheSite) {
  const RobotModel model = LoadRobotFiles(Folder() + ".pbtxt");
  const Model mjcf = FromMjcf();
  const int site = mj_name2id(mjcf.get(), mjOBJ_SITE, "imu");
  ASSERT_GE(site, 0);
  EXPECT_STREQ(mj_id2name(mjcf.get(), mjOBJ_BODY, mjcf->site_bodyid[site]),
               model.bodies()[static_cast<size_t>(model.imu().body)].name.c_str());
  EXPECT_LT((Vector(mjcf->site_pos + 3 * site) - model.imu().pose.translation()).norm(),
            kTolerance);
}

// Every corner of a sole is one of the foot's boxes at their lowest, and none of these is outside.
TEST(Heron, SolesAreWhatTheFeetStandOn) {
  const RobotModel model = LoadRobotFiles(Folder() + ".pbtxt");
  const Model mjcf = FromMjcf();
  for (const FootModel& foot : model.feet()) {
    const int body = mj_name2id(mjcf.get(), mjOBJ_BODY,
                                model.bodies()[static_cast<size_t>(foot.body)].name.c_str());
    std::vector<Eigen::Vector2d> low;
    for (int g = 0; g < mjcf->ngeom; ++g) {
      if (mjcf->geom_bodyid[g] != body) continue;
      ASSERT_EQ(mjcf->geom_type[g], mjGEOM_BOX);
      const Vector3d half = Vector(mjcf->geom_size + 3 * g);
      for (const double x : {-half.x(), half.x()}) {
        for (const double y : {-half.y(), half.y()}) {
          const Vector3d corner =
              foot.sole.inverse() * (Vector(mjcf->geom_pos + 3 * g) + Vector3d(x, y, -half.z()));
          EXPECT_GT(corner.z(), -kTolerance) << "below the sole";
          if (corner.z() < kTolerance) low.push_back(corner.head<2>());
        }
      }
    }
    ASSERT_GE(low.size(), 8u);
    ASSERT_GE(foot.vertices.size(), 5u) << "no rectangle";
    for (const Eigen::Vector2d& vertex : foot.vertices) {
      EXPECT_TRUE(std::ranges::any_of(low, [&](const auto& corner) {
        return (corner - vertex).norm() < kTolerance;
      })) << vertex.transpose();
    }
    for (const Eigen::Vector2d& corner : low) {
      for (size_t i = 0; i < foot.vertices.size(); ++i) {
        const Eigen::Vector2d a = foot.vertices[i],
                              b = foot.vertices[(i + 1) % foot.vertices.size()];
        EXPECT_GT((b - a).x() * (corner - a).y() - (b - a).y() * (corner - a).x(), -kTolerance);
      }
    }
  }
}

TEST(Heron, HasTheSizeThatItsTextSays) {
  const RobotModel model = LoadRobotFiles(Folder() + ".pbtxt");
  EXPECT_NEAR(model.total_mass(), 48.4, 0.05);
  const Model mjcf = FromMjcf();
  const std::unique_ptr<mjData, void (*)(mjData*)> data(mj_makeData(mjcf.get()), mj_deleteData);
  mj_kinematics(mjcf.get(), data.get());
  double lowest = 1, highest = 0;
  for (int g = 0; g < mjcf->ngeom; ++g) {
    const Vector3d at = Vector(data->geom_xpos + 3 * g), half = Vector(mjcf->geom_size + 3 * g);
    const double reach = mjcf->geom_type[g] == mjGEOM_BOX      ? half.z()
                         : mjcf->geom_type[g] == mjGEOM_SPHERE ? half.x()
                                                               : 0;
    lowest = std::min(lowest, at.z() - reach);
    highest = std::max(highest, at.z() + reach);
  }
  EXPECT_NEAR(lowest, 0, kTolerance) << "the file has it standing";
  EXPECT_NEAR(highest, 1.45, 0.005);
  EXPECT_GT(StandingHeight(model), 0.6);
}

}  // namespace
}  // namespace poise::robot
