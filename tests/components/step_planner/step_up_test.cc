// How high the paper's robot can lift a sole above the one that it stands on, by inverse kinematics
// of the whole robot and by two links: what soft ground may give way by, and be stepped out of.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "components/robot/posture.h"
#include "tests/robot/robot_test_support.h"

namespace poise {
namespace {

using robot::TestRobot;

constexpr double kFinest = 0.002;    // m, to which a height is found
constexpr double kSpacing = 0.25;    // m between the soles, sideways: walk_blocks' `gap`
constexpr double kStride = 0.2;      // m that a foot is ahead of the other, or behind
constexpr double kReserve = 0.02;    // rad off the joints' limits
constexpr double kBlock = 0.05;      // m that a block is higher or lower at most
constexpr double kClearance = 0.02;  // m above what is stepped on

/// The robot stands on its right sole, at the origin, its COM above it.
class StandsOnOneFoot {
 public:
  explicit StandsOnOneFoot(const robot::RobotModel& model) : model_(model) {}

  /// m: the highest left sole, level, `ahead` of the right one, at any height of the COM.
  double Highest(double ahead) {
    double highest = 0;
    for (double com = 0.5; com < 0.85; com += 0.01) {
      robot::PostureGoal goal;
      goal.foot[0] = Eigen::Isometry3d::Identity();
      goal.com_height = com;
      goal.nominal = model_.stance().joint_position;
      for (double height = 0; height < 0.6; height += kFinest) {
        goal.foot[1] = Eigen::Translation3d(ahead, kSpacing, height) * Eigen::Isometry3d::Identity();
        if (!Solve(&goal)) break;
        highest = std::max(highest, height);
      }
    }
    return highest;
  }

 private:
  /// The next posture is looked for near this one.
  bool Solve(robot::PostureGoal* goal) const {
    try {
      const robot::RobotState state = robot::SolvePosture(model_, *goal);
      goal->nominal = state.joint_position;
      for (int j = 0; j < model_.num_joints(); ++j) {
        const robot::Joint& joint = model_.joints()[static_cast<size_t>(j)];
        const double q = state.joint_position[j];
        if (q < joint.lower + kReserve || q > joint.upper - kReserve) return false;
      }
      return true;
    } catch (const robot::RobotError&) {
      return false;
    }
  }

  const robot::RobotModel& model_;
};

TEST(StepUp, SoftGroundMayGiveWayByWhatTheLegsCanStepOutOf) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  StandsOnOneFoot stands(model);
  const double weight = robot::kGravity * model.total_mass();
  double least = 1;
  for (const double ahead : {-kStride, 0.0, kStride}) {
    const double highest = stands.Highest(ahead);
    least = std::min(least, highest);
    std::printf("sole %+.1f m ahead of the one that stands: at most %.3f m above it\n", ahead, highest);
  }
  std::printf("least stiffness %.0f N/m: sinks by %.3f m\n", weight / (least - 2 * kBlock - kClearance),
              least - 2 * kBlock - kClearance);
}

}  // namespace
}  // namespace poise
