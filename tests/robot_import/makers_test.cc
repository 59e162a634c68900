// The makers' own files, where they are: imported in one attempt, and what they say is known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "components/robot/posture.h"
#include "components/robot_files/robot_files.h"
#include "tests/robot/robot_test_support.h"
#include "tests/robot_import/import_support.h"

namespace poise {
namespace {

RobotImport Import(const std::filesystem::path& file) {
  ImportOptions options;
  options.file = file;
  return ImportRobot(options);
}

struct Maker {
  const char* file;
  int joints;
  double mass;         // kg, the sum of the file's own
  double sole, width;  // m, of the collision shapes; 0: the file shows none
};

class Makers : public testing::TestWithParam<Maker> {
 protected:
  void SetUp() override {
    file_ = MakersFolder() / GetParam().file;
    if (MakersFolder().empty() || !exists(file_)) {
      GTEST_SKIP() << "the maker's file " << GetParam().file << " is not in $POISE_ROBOTS";
    }
  }
  std::filesystem::path file_;
};

TEST_P(Makers, AreImportedInOneAttempt) {
  const RobotImport imported = Import(file_);
  const std::string text = RobotText(imported);
  const robot::RobotModel model = robot::LoadRobotTexts(text, robot::ReadWhole(file_));
  EXPECT_EQ(model.num_joints(), GetParam().joints);
  EXPECT_NEAR(model.total_mass(), GetParam().mass, 2e-3);
  EXPECT_EQ(model.feet()[0].name, "right");
  if (GetParam().sole > 0) {
    EXPECT_NEAR(model.feet()[0].length, GetParam().sole, 1e-6);
    EXPECT_NEAR(model.feet()[0].width, GetParam().width, 1e-6);
  }
  // It stands: soles level, right at y < 0, x forward, no joint at a limit.
  robot::PostureGoal goal;
  goal.nominal = model.stance().joint_position;
  goal.com_height = *model.stance().com_height;
  const double y = *model.stance().foot_spacing / 2;
  goal.foot = {Eigen::Isometry3d(Eigen::Translation3d(0, -y, 0)),
               Eigen::Isometry3d(Eigen::Translation3d(0, y, 0))};
  const robot::RobotState state = robot::SolvePosture(model, goal);
  const robot::RobotData data = robot::Evaluate(model, state);
  for (size_t f = 0; f < 2; ++f) {
    EXPECT_TRUE(data.foot_pose[f].isApprox(goal.foot[f], 1e-8));
    // The knees are in front of the line from hip to foot: it faces forward.
    const auto& knee = data.body_position[static_cast<size_t>(
        model
            .bodies()[static_cast<size_t>(
                model.bodies()[static_cast<size_t>(model.feet()[f].body)].parent)]
            .parent)];
    EXPECT_GT(knee.x() + data.base_position.x(), data.foot_pose[f].translation().x() - 0.02);
  }
  for (int j = 0; j < model.num_joints(); ++j) {
    const robot::Joint& joint = model.joints()[static_cast<size_t>(j)];
    EXPECT_GT(state.joint_position[j], joint.lower + 1e-3) << joint.name;
    EXPECT_LT(state.joint_position[j], joint.upper - 1e-3) << joint.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Files, Makers,
                         testing::Values(Maker{"g1_29dof_rev_1_0.urdf", 29, 33.341, 0.17, 0.06},
                                         Maker{"g1_29dof_rev_1_0.xml", 29, 33.341, 0.17, 0.06},
                                         Maker{"talos_reduced_box.urdf", 30, 90.272, 0.21, 0.13},
                                         Maker{"icub_reduced.urdf", 29, 28.34687, 0, 0},
                                         Maker{"dyros_tocabi.urdf", 33, 95.62195, 0.3, 0.17}),
                         [](const auto& test) {
                           std::string name = test.param.file;
                           for (char& c : name) {
                             if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
                           }
                           return name;
                         });

// deploy/robots holds the texts that today's importer writes, and where the file is to be had.
TEST(MakersFiles, TextsOfTheRepositoryAreTodays) {
  const auto folder = MakersFolder();
  if (folder.empty()) GTEST_SKIP() << "the makers' files are not in $POISE_ROBOTS";
  for (const auto& [file, text] : {std::pair{"g1_29dof_rev_1_0.urdf", "g1/g1"},
                                   std::pair{"g1_29dof_rev_1_0.xml", "g1/g1_mjcf"},
                                   std::pair{"talos_reduced_box.urdf", "talos/talos"},
                                   std::pair{"icub_reduced.urdf", "icub/icub"},
                                   std::pair{"dyros_tocabi.urdf", "tocabi/tocabi"}}) {
    if (!exists(folder / file)) continue;
    const auto kept =
        std::filesystem::path(POISE_SOURCE_DIR) / "deploy/robots" / (std::string(text) + ".pbtxt");
    std::string expected;
    std::ifstream in(kept);
    for (std::string line; std::getline(in, line);) {
      if (!line.starts_with("source:")) expected += line + "\n";
    }
    ImportOptions options;
    options.file = folder / file;
    options.name = kept.stem();
    EXPECT_EQ(RobotText(ImportRobot(options)), expected) << kept;
  }
}

constexpr double kSixDigits = 5e-6;  // half of the last digit that MJCF prints of 1 to 10

TEST(MakersFiles, G1IsTheSameRobotFromUrdfAndMjcf) {
  const auto folder = MakersFolder();
  if (folder.empty()) GTEST_SKIP() << "the makers' files are not in $POISE_ROBOTS";
  const auto load = [&](const char* file) {
    RobotImport imported = Import(folder / file);
    for (Motor& motor : *imported.robot.mutable_motor()) motor.set_rotor_inertia(0);
    return robot::MakeRobot(imported.robot, robot::ReadWhole(folder / file));
  };
  const robot::RobotModel urdf = load("g1_29dof_rev_1_0.urdf"), mjcf = load("g1_29dof_rev_1_0.xml");
  ASSERT_EQ(urdf.num_joints(), mjcf.num_joints());
  std::mt19937 random(2);
  for (int i = 0; i < 20; ++i) {
    const robot::RobotState a = robot::RandomState(urdf, &random);
    robot::RobotState b = a;
    for (int j = 0; j < urdf.num_joints(); ++j) {
      const int other = mjcf.FindJoint(urdf.joints()[static_cast<size_t>(j)].name);
      ASSERT_GE(other, 0);
      b.joint_position[other] = a.joint_position[j];
      b.joint_velocity[other] = a.joint_velocity[j];
      EXPECT_NEAR(urdf.joints()[static_cast<size_t>(j)].upper,
                  mjcf.joints()[static_cast<size_t>(other)].upper, kSixDigits);
    }
    const robot::RobotData u = robot::Evaluate(urdf, a), m = robot::Evaluate(mjcf, b);
    // The two files print their numbers with six digits, and merge fixed links by themselves.
    EXPECT_NEAR((u.com - m.com).norm(), 0, 1e-5);
    const Eigen::Matrix<double, 6, 6> of_urdf = u.mass_matrix.topLeftCorner<6, 6>();
    const Eigen::Matrix<double, 6, 6> of_mjcf = m.mass_matrix.topLeftCorner<6, 6>();
    EXPECT_NEAR((of_urdf - of_mjcf).norm(), 0, 2e-4 * of_urdf.norm());
    for (size_t f = 0; f < 2; ++f) {
      EXPECT_NEAR((u.foot_pose[f].translation() - m.foot_pose[f].translation()).norm(), 0, 1e-5);
    }
  }
}

}  // namespace
}  // namespace poise
