// Which courses of soft blocks the paper's robot can walk at all: how high it can have a level sole
// above the one that it stands on, by inverse kinematics of the whole robot and by two links, and
// how far a block gives way under its weight. Prints what docs/results/soft_ground.md says.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "components/robot/posture.h"
#include "sim/terrain.h"
#include "tests/robot/robot_test_support.h"

namespace poise {
namespace {

using robot::TestRobot;

constexpr double kFinest = 0.004;    // m, to which a height is found
constexpr double kSpacing = 0.25;    // m between the soles, sideways: walk_blocks' `gap`
constexpr double kStride = 0.2;      // m that a foot is ahead of the other, or behind
constexpr double kReserve = 0.02;    // rad off the joints' limits
constexpr double kClearance = 0.02;  // m above what is stepped on
constexpr int kRows = 10;            // of walk_blocks
constexpr double kStart = 0.4;       // m, of walk_blocks
constexpr int kCourses = 400;

/// m: the highest left sole, level, `ahead` of the right one, with the COM above that, at any
/// height of the COM.
double HighestSole(const robot::RobotModel& model, double ahead) {
  const auto stands = [&](robot::PostureGoal* goal) {
    try {
      const robot::RobotState state = robot::SolvePosture(model, *goal);
      goal->nominal = state.joint_position;  // the next one is looked for near it
      for (int j = 0; j < model.num_joints(); ++j) {
        const robot::Joint& joint = model.joints()[static_cast<size_t>(j)];
        const double q = state.joint_position[j];
        if (q < joint.lower + kReserve || q > joint.upper - kReserve) return false;
      }
      return true;
    } catch (const robot::RobotError&) {
      return false;
    }
  };
  double highest = 0;
  for (double com = 0.6; com < 0.85; com += 0.01) {
    robot::PostureGoal goal;
    goal.foot[0] = Eigen::Isometry3d::Identity();
    goal.com_height = com;
    goal.nominal = model.stance().joint_position;
    for (double height = 0; height < 0.6; height += kFinest) {
      goal.foot[1] = Eigen::Translation3d(ahead, kSpacing, height) * Eigen::Isometry3d::Identity();
      if (!stands(&goal)) break;
      highest = std::max(highest, height);
    }
  }
  return highest;
}

/// The same of two links of 0.36 m in the sagittal plane, the hip above the standing sole's ankle
/// or where else that leg reaches (dyros_legs.urdf: limits of hip, knee and ankle).
double HighestOfTwoLinks(double ahead) {
  constexpr double kLink = 0.36;
  double highest = 0;
  for (double hip = 0.3; hip < 2 * kLink; hip += 0.002) {
    for (double height = 0; height < hip; height += 0.002) {
      // From hip to ankle, whose sole's centre is 0.03 m ahead of it, as the standing one's is.
      for (double shift = 0; shift <= 0.06; shift += 0.01) {
        const double x = ahead - shift, z = hip - height, leg = std::hypot(x, z);
        if (leg > 2 * kLink || std::hypot(shift, hip) > 2 * kLink) continue;
        const double knee = M_PI - 2 * std::asin(0.5 * leg / kLink);
        const double hip_pitch = -(std::atan2(x, z) + 0.5 * knee), ankle = -(hip_pitch + knee);
        if (knee > 2.2 || hip_pitch < -1.9 || hip_pitch > 0.7 || ankle < -1.2 || ankle > 0.8) {
          continue;
        }
        highest = std::max(highest, height);
      }
    }
  }
  return highest;
}

struct Block {
  double height, stiffness;  // m of its middle, N/m of a whole sole
};

/// In the order in which the feet come to them.
std::vector<Block> Course(double least_stiffness, uint64_t seed) {
  SimConfig config;
  BlockField& field = *config.mutable_block_field();
  field.set_start(kStart);
  field.set_rows(kRows);
  field.set_least_stiffness(least_stiffness);
  const Terrain terrain(config, seed);
  std::vector<Block> course;
  for (int i = 0; i < 2 * kRows; ++i) {
    const double x = kStart + 0.5 * field.length() * (i + 1), y = i % 2 == 0 ? -0.1 : 0.1;
    const Terrain::Surface surface = terrain.At(x, y, 0);
    course.push_back({surface.height, terrain.material(surface, 1).stiffness});
  }
  return course;
}

TEST(CourseReach, ASoleMayBeAsHighAsTwoLinksAllow) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  for (const double ahead : {-kStride, 0.0, kStride}) {
    const double highest = HighestSole(model, ahead), links = HighestOfTwoLinks(ahead);
    std::printf("a sole %+.1f m ahead: at most %.3f m above the one that stands, two links %.3f\n",
                ahead, highest, links);
    EXPECT_LE(highest, links);
    EXPECT_GT(highest, links - 0.15);  // hips beside the feet, a COM that moves with the legs
  }
}

// On its block a sole stands lower by weight over stiffness; the one behind, on a harder block, is
// to lie flat until it carries nothing, then to come down on the next.
TEST(CourseReach, SharesOfCoursesThatTheLegsReachOver) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  const double weight = robot::kGravity * model.total_mass();
  const double behind = HighestSole(model, -kStride), ahead = HighestSole(model, kStride);
  std::printf("sinks %.3f m at 2 kN/m, %.3f m at 5 kN/m\n", weight / 2000, weight / 5000);
  std::printf("level blocks: %.0f N/m at least with a flat sole behind, %.0f to step on\n",
              weight / behind, weight / (ahead - kClearance));
  double last_flat = 0, last_stepped = 0;
  for (const double least : {2000.0, 3000.0, 5000.0, 7000.0, 10000.0, 20000.0}) {
    int flat = 0, stepped = 0;
    for (uint64_t seed = 1; seed <= kCourses; ++seed) {
      const std::vector<Block> course = Course(least, seed);
      bool lies = true, steps = true;
      double last = 0;  // m: the ground before the first block
      for (size_t i = 0; i < course.size(); ++i) {
        const double sole = course[i].height - weight / course[i].stiffness;
        const double next = i + 1 < course.size() ? course[i + 1].height : 0;
        lies = lies && last - sole <= behind;
        steps = steps && next - sole + kClearance <= ahead;
        last = course[i].height;
      }
      flat += lies && steps ? 1 : 0;
      stepped += steps ? 1 : 0;
    }
    const double flat_share = flat / double{kCourses}, stepped_share = stepped / double{kCourses};
    std::printf("%5.0f N/m and more: %.2f of the courses, %.2f if the sole behind may tilt\n",
                least, flat_share, stepped_share);
    EXPECT_GE(stepped_share, flat_share);
    EXPECT_GE(flat_share, last_flat);
    EXPECT_GE(stepped_share, last_stepped);
    last_flat = flat_share;
    last_stepped = stepped_share;
  }
  // What is walked there is no less than what can be.
  EXPECT_EQ(last_flat, 1);
}

}  // namespace
}  // namespace poise
