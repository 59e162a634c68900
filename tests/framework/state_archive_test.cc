#include "components/framework/state_archive.h"

#include <gtest/gtest.h>

namespace poise {
namespace {

struct State {
  int count = 0;
  bool flag = false;
  Eigen::Matrix3d fixed = Eigen::Matrix3d::Zero();
  Eigen::VectorXd dynamic = Eigen::VectorXd::Zero(5);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  std::vector<double> numbers = {0, 0, 0};
  std::vector<Eigen::Vector3d> points = std::vector<Eigen::Vector3d>(2, Eigen::Vector3d::Zero());
  std::array<Eigen::Vector2d, 2> pair = {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};

  void Archive(StateArchive* archive) {
    archive->Show(count, flag, fixed, dynamic, pose, rotation, numbers, points, pair);
  }
};

State Filled() {
  State state;
  state.count = 7;
  state.flag = true;
  state.fixed << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  state.dynamic << 10, 11, 12, 13, 14;
  state.pose.translation() << 15, 16, 17;
  state.rotation = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5);
  state.numbers = {18, 19, 20};
  state.points[1] << 21, 22, 23;
  state.pair[0] << 24, 25;
  return state;
}

std::vector<uint8_t> Save(State state) {
  StateArchive measure;
  state.Archive(&measure);
  std::vector<uint8_t> bytes(measure.size());
  StateArchive save = StateArchive::Saving(bytes);
  state.Archive(&save);
  EXPECT_TRUE(save.ok());
  EXPECT_EQ(save.size(), bytes.size());
  return bytes;
}

TEST(StateArchive, RestoresWhatWasSaved) {
  const std::vector<uint8_t> bytes = Save(Filled());
  State state;
  StateArchive restore = StateArchive::Restoring(bytes);
  state.Archive(&restore);
  ASSERT_TRUE(restore.ok());
  const State filled = Filled();
  EXPECT_EQ(state.count, filled.count);
  EXPECT_EQ(state.flag, filled.flag);
  EXPECT_EQ(state.fixed, filled.fixed);
  EXPECT_EQ(state.dynamic, filled.dynamic);
  EXPECT_EQ(state.pose.matrix(), filled.pose.matrix());
  EXPECT_EQ(state.rotation.coeffs(), filled.rotation.coeffs());
  EXPECT_EQ(state.numbers, filled.numbers);
  EXPECT_EQ(state.points, filled.points);
  EXPECT_EQ(state.pair, filled.pair);
}

TEST(StateArchive, RefusesOtherSizes) {
  const std::vector<uint8_t> bytes = Save(Filled());
  State other;
  other.dynamic.resize(6);
  StateArchive restore = StateArchive::Restoring(bytes);
  other.Archive(&restore);
  EXPECT_FALSE(restore.ok());

  State state;
  StateArchive cut = StateArchive::Restoring(std::span(bytes).first(bytes.size() - 1));
  state.Archive(&cut);
  EXPECT_FALSE(cut.ok());
}

}  // namespace
}  // namespace poise
