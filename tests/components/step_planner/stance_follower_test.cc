// When and how far the COM's reference goes along with soles that have moved.
#include "components/step_planner/stance_follower.h"

#include <gtest/gtest.h>

#include <cmath>

namespace poise {
namespace {

constexpr double kFollowTick = 0.002, kDistance = 0.005;

class StanceFollowerTest : public testing::Test {
 protected:
  /// What is asked for in `seconds` with the soles' middle there, all together.
  Eigen::Vector3d Stand(const Eigen::Vector3d& middle, double seconds, bool carried = true,
                        bool resting = true, bool planned = true) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const double end = time_ + seconds; time_ < end; time_ += kFollowTick) {
      const bool rests = resting && time_ >= moved_until_;
      const Eigen::Vector3d half(0, 0.1, 0);
      const Eigen::Vector3d way =
          follower_.Update(time_, {{middle - half, middle + half}, com_, planned, carried, rests});
      if (!way.isZero(0)) moved_until_ = time_ + 0.5;  // that the reference's move takes
      com_ += way;
      sum += way;
    }
    return sum;
  }
  StanceFollower follower_{kDistance};
  double time_ = 0, moved_until_ = 0;
  Eigen::Vector3d com_{0, 0, 0.7};
};

TEST_F(StanceFollowerTest, GoesAllTheWayThatTheSolesWent) {
  const Eigen::Vector3d start(0, 0, 0), there(0.012, -0.01, 0);
  EXPECT_EQ(Stand(start, 1).norm(), 0);
  // In the air, bouncing, and while the reference moves, nothing is followed.
  EXPECT_EQ(Stand(there, 1, false).norm(), 0);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(Stand(there, 0.05).norm(), 0);
    EXPECT_EQ(Stand(there, 0.01, false).norm(), 0);
  }
  EXPECT_EQ(Stand(there, 1, true, false).norm(), 0);
  EXPECT_LT((Stand(there, 1) - (there - start)).norm(), 1e-15);
  EXPECT_EQ(Stand(there, 1).norm(), 0);
}

TEST_F(StanceFollowerTest, LeavesAloneWhatSolesWanderBy) {
  // A circle of less than the distance about where they were, and back again.
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d at(0.9 * kDistance * std::cos(0.1 * i),
                             0.9 * kDistance * std::sin(0.1 * i), 0);
    EXPECT_EQ(Stand(i == 0 ? Eigen::Vector3d::Zero() : at, 0.1).norm(), 0);
  }
}

TEST_F(StanceFollowerTest, OnceItFollowsNextToNothingIsLeft) {
  Stand(Eigen::Vector3d::Zero(), 1);
  Eigen::Vector3d sum = Stand({1.2 * kDistance, 0, 0}, 0.2);
  EXPECT_NEAR(sum.x(), 1.2 * kDistance, 1e-15);
  // They slip on; the end is reached to a fifth of the distance.
  for (int i = 0; i < 100; ++i) sum += Stand({(1.2 + 0.03 * i) * kDistance, 0, 0}, 0.02);
  sum += Stand({4.17 * kDistance, 0, 0}, 1);
  EXPECT_NEAR(sum.x(), 4.17 * kDistance, 0.2 * kDistance);
  // At rest it waits for the whole distance again.
  EXPECT_EQ(Stand({4.92 * kDistance, 0, 0}, 1).norm(), 0);
}

TEST_F(StanceFollowerTest, BeginsAnewWhereThePlanPutsTheFeet) {
  Stand(Eigen::Vector3d::Zero(), 1);
  Stand({0.1, 0, 0}, 0.5, true, true, false);  // a foot is in the air by plan
  EXPECT_EQ(Stand({0.2, 0, 0}, 1).norm(), 0);
  EXPECT_NEAR(Stand({0.21, 0, 0}, 1).x(), 0.01, 1e-15);
}

TEST_F(StanceFollowerTest, FollowsNothingWithoutADistance) {
  follower_ = StanceFollower(0);
  Stand(Eigen::Vector3d::Zero(), 1);
  EXPECT_EQ(Stand({1, 0, 0}, 1).norm(), 0);
}

}  // namespace
}  // namespace poise
