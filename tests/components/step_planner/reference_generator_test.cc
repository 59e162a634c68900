// References over time, without bus or robot.
#include "components/step_planner/reference_generator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "components/framework/configuration/configuration.h"

namespace poise {
namespace {

EstimatedPose Pose() {
  EstimatedPose pose;
  pose.com = {0.01, 0.02, 0.7};
  pose.body_rotation = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.sole[0].translation() = Eigen::Vector3d(0.03, -0.1, 0.001);
  pose.sole[1].translation() = Eigen::Vector3d(-0.01, 0.11, 0.002);
  return pose;
}

/// m: a COM there is ahead of every move to the left, which does not wait.
const Eigen::Vector3d kAhead(0, 1, 0.7);

Phase ParsePhase(const std::string& text) {
  Phase phase;
  ParseTextProto(text, "phase", &phase);
  return phase;
}

TEST(ReferenceGenerator, MovesAlongTheMinimumJerkLine) {
  ReferenceGenerator references;
  references.BeginPhase(
      ParsePhase("com { target: OVER_RIGHT x: 0.005 z: -0.03 duration: 2 delay: 0.5 }"), Pose(), 0);
  Eigen::Vector3d com = Pose().com;
  const Eigen::Vector3d from = com, to(0.03 + 0.005, -0.1, 0.7 - 0.03);
  for (double t = 0; t < 3; t += 0.01) {
    const PointMotion motion = references.Update(t, com).com;
    com = motion.position;  // it follows, so that the move does not wait
    // Flash and Hogan's polynomial.
    const double s = std::clamp((t - 0.5) / 2, 0.0, 1.0);
    const double p = 10 * std::pow(s, 3) - 15 * std::pow(s, 4) + 6 * std::pow(s, 5);
    EXPECT_LT((motion.position - from - p * (to - from)).norm(), 1e-14);
    const double v = 30 * s * s * (1 - s) * (1 - s) / 2;
    EXPECT_LT((motion.velocity - v * (to - from)).norm(), 1e-13);
    const double a = 60 * s * (1 - s) * (1 - 2 * s) / 4;
    EXPECT_LT((motion.acceleration - a * (to - from)).norm(), 1e-12);
  }
}

TEST(ReferenceGenerator, TargetsOfThePhases) {
  const Eigen::Vector3d middle(0.01, 0.005, 0.7), left(-0.01, 0.11, 0.7), com = Pose().com;
  const auto end = [](const std::string& target) {
    ReferenceGenerator references;
    references.BeginPhase(ParsePhase("com { target: " + target + " duration: 1 }"), Pose(), 0);
    return references.Update(1.5, Pose().com).com.position;
  };
  EXPECT_LT((end("OVER_LEFT y: -0.02") - left - Eigen::Vector3d(0, -0.02, 0)).norm(), 1e-15);
  EXPECT_LT((end("OVER_MIDDLE") - middle).norm(), 1e-15);
  EXPECT_LT((end("SHIFT y: 0.1 z: 0.02") - com - Eigen::Vector3d(0, 0.1, 0.02)).norm(), 1e-15);
  EXPECT_LT((end("HOLD x: 3") - com).norm(), 1e-15);
}

TEST(ReferenceGenerator, PhasesJoinInPositionVelocityAndAcceleration) {
  ReferenceGenerator references;
  references.BeginPhase(ParsePhase("com { target: SHIFT y: 0.2 duration: 2 }"), Pose(), 0);
  EstimatedPose moved = Pose();
  moved.com += Eigen::Vector3d(0.05, 0, 0);  // the estimate must not matter any more
  const PointMotion before = references.Update(0.7, kAhead).com;
  references.BeginPhase(ParsePhase("com { target: OVER_LEFT duration: 1 }"), moved, 0.7);
  const PointMotion after = references.Update(0.7, kAhead).com;
  EXPECT_LT((after.position - before.position).norm(), 1e-14);
  EXPECT_LT((after.velocity - before.velocity).norm(), 1e-14);
  EXPECT_LT((after.acceleration - before.acceleration).norm(), 1e-12);
  EXPECT_GT(before.velocity.norm(), 0.05);
  const PointMotion end = references.Update(1.7, Pose().com).com;
  EXPECT_LT((end.position.head<2>() - moved.sole[1].translation().head<2>()).norm(), 1e-14);
  EXPECT_EQ(end.velocity.norm(), 0);
  // Velocity is the derivative of position, acceleration of velocity.
  const double h = 1e-5;
  for (double t = 0.75; t < 1.65; t += 0.05) {
    ReferenceGenerator again;
    again.BeginPhase(ParsePhase("com { target: SHIFT y: 0.2 duration: 2 }"), Pose(), 0);
    Eigen::Vector3d com = again.Update(0.7, kAhead).com.position;
    again.BeginPhase(ParsePhase("com { target: OVER_LEFT duration: 1 }"), moved, 0.7);
    for (double s = 0.71; s < t - h; s += 0.01) com = again.Update(s, com).com.position;
    const PointMotion low = again.Update(t - h, com).com, mid = again.Update(t, com).com,
                      high = again.Update(t + h, com).com;
    EXPECT_LT(((high.position - low.position) / (2 * h) - mid.velocity).norm(), 1e-8);
    EXPECT_LT(((high.velocity - low.velocity) / (2 * h) - mid.acceleration).norm(), 1e-7);
  }
}

constexpr double kLag = ReferenceGenerator::kComLag, kPeriod = 0.002;  // m, s

ReferenceGenerator ShiftBegun() {
  ReferenceGenerator references;
  references.BeginPhase(ParsePhase("com { target: SHIFT y: 0.1 duration: 2 }"), Pose(), 0);
  return references;
}

TEST(ReferenceGenerator, WaitsForAComThatStandsAndEndsWhenItFollows) {
  ReferenceGenerator references = ShiftBegun();
  const Eigen::Vector3d start = Pose().com;
  double t = 0, last = 0;
  for (; t < 10; t += kPeriod) {
    const double ahead = (references.Update(t, start).com.position - start).y();
    EXPECT_GE(ahead, last);
    EXPECT_LT(ahead, kLag);
    last = ahead;
  }
  EXPECT_GT(last, 0.95 * kLag);
  EXPECT_LT(references.Update(t, start).com.velocity.norm(), 1e-3);
  EXPECT_LT(references.Update(t, start).com.acceleration.norm(), 1e-3);
  Eigen::Vector3d com = start;
  for (; t < 13; t += kPeriod) com = references.Update(t, com).com.position;
  EXPECT_LT((com - start - Eigen::Vector3d(0, 0.1, 0)).norm(), 1e-14);
}

TEST(ReferenceGenerator, SlowsDownByTheComsLag) {
  // Behind by three quarters of the lag at which it stands still: half the speed, twice the time.
  ReferenceGenerator references = ShiftBegun();
  double ended = 0;
  Eigen::Vector3d at = Pose().com;
  const Eigen::Vector3d behind(0, 0.75 * kLag, 0);
  for (double t = 0; t < 6; t += kPeriod) {
    const Eigen::Vector3d before = at;
    const PointMotion motion = references.Update(t, at - behind).com;
    at = motion.position;
    if (t > 0.5 && t < 3.5) {
      EXPECT_NEAR((at - before).y() / kPeriod, motion.velocity.y(), 2e-3);
    }
    if (motion.velocity.norm() > 0) ended = t;
  }
  EXPECT_NEAR(ended, 4, 0.08);  // the COM is behind the tick before
}

TEST(ReferenceGenerator, NeitherAComAheadNorOneBesideTheMoveSlowsItDown) {
  for (const Eigen::Vector3d& beside :
       {Eigen::Vector3d(0, 0.05, 0), Eigen::Vector3d(0.05, 0, 0.05)}) {
    ReferenceGenerator references = ShiftBegun(), on_time = ShiftBegun();
    Eigen::Vector3d at = Pose().com;
    for (double t = 0; t < 3; t += kPeriod) {
      const Eigen::Vector3d expected = on_time.Update(t, at).com.position;
      at = references.Update(t, at + beside).com.position;
      EXPECT_EQ(at, expected);
    }
  }
}

TEST(ReferenceGenerator, APhaseWithoutComReferenceLetsTheMotionEnd) {
  ReferenceGenerator references;
  references.BeginPhase(ParsePhase("com { target: SHIFT y: 0.2 duration: 2 }"), Pose(), 0);
  references.Update(0.7, kAhead);
  references.BeginPhase(ParsePhase(""), Pose(), 0.7);
  EXPECT_NEAR(references.Update(2.5, Pose().com).com.position.y(), 0.22, 1e-14);
}

TEST(ReferenceGenerator, TheFreeFootStartsWhereItIsWhenItLeavesTheGround) {
  ReferenceGenerator references;
  references.BeginPhase(ParsePhase(""), Pose(), 0);
  EstimatedPose later = Pose();
  later.sole[1].translation() = Eigen::Vector3d(0.07, 0.13, 0.004);
  later.sole[1].linear() = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()).toRotationMatrix();
  references.BeginPhase(ParsePhase("support: RIGHT foot { foot: LEFT_FOOT x: 0.05 "
                                   "height_above_support: 0.12 duration: 2 delay: 0.1 }"),
                        later, 1);
  const References at_lift = references.Update(1.0, Pose().com);
  EXPECT_EQ(at_lift.foot[1].position, later.sole[1].translation());
  EXPECT_EQ(at_lift.foot_rotation[1].rotation, later.sole[1].linear());
  const References end = references.Update(3.2, Pose().com);
  EXPECT_LT((end.foot[1].position - Eigen::Vector3d(0.12, 0.13, 0.121)).norm(), 1e-14);
  EXPECT_EQ(end.foot_rotation[1].rotation, later.sole[1].linear());
  // A second phase in the air goes on from the reference, not from the estimate.
  references.BeginPhase(ParsePhase("support: RIGHT foot { foot: LEFT_FOOT z: -0.05 duration: 1 }"),
                        later, 4);
  EXPECT_LT((references.Update(5, Pose().com).foot[1].position - Eigen::Vector3d(0.12, 0.13, 0.071))
                .norm(),
            1e-14);
}

TEST(ReferenceGenerator, AHeldFootRestsAndLaterMovesStartThere) {
  ReferenceGenerator references;
  references.BeginPhase(ParsePhase("support: RIGHT foot { foot: LEFT_FOOT z: 0.1 "
                                   "duration: 1 }"),
                        Pose(), 0);
  EXPECT_NEAR(references.foot(robot::Foot::kLeft).target().z(), 0.102, 1e-15);
  EXPECT_NEAR(references.foot(robot::Foot::kLeft).end(), 1, 1e-15);
  references.Update(0.5, Pose().com);
  const Eigen::Vector3d place(0.01, 0.12, 0.07);
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()).toRotationMatrix();
  references.HoldFoot(robot::Foot::kLeft, place, rotation);
  for (const double time : {0.5, 0.7, 2.0}) {
    const References& held = references.Update(time, Pose().com);
    EXPECT_EQ(held.foot[1].position, place);
    EXPECT_EQ(held.foot[1].velocity.norm(), 0);
    EXPECT_EQ(held.foot_rotation[1].rotation, rotation);
  }
  references.BeginPhase(ParsePhase("support: RIGHT foot { foot: LEFT_FOOT z: 0.03 }"), Pose(), 2);
  EXPECT_LT(
      (references.Update(2.1, Pose().com).foot[1].position - place - Eigen::Vector3d(0, 0, 0.03))
          .norm(),
      1e-15);
}

// The rotation is the exponential of the rotation vector, the angular velocity and acceleration are
// the derivatives of the rotation, whatever axis it turns about and when one turn goes over into
// another.
TEST(ReferenceTurn, VelocityAndAccelerationAreThoseOfTheRotation) {
  const Eigen::Matrix3d origin = Pose().body_rotation;
  const auto turn = [&] {
    ReferenceTurn made;
    made.Hold(origin);
    made.Schedule({0.3, -0.5, 0.2}, 0.1, 1);
    return made;
  };
  const Eigen::Vector3d second(-0.4, 0.1, 0.9);
  const auto at = [&](double time) {
    ReferenceTurn made = turn();
    if (time < 0.6) return made.At(time);
    made.At(0.6);
    made.Schedule(second, 0.6, 0.8);
    return made.At(time);
  };
  EXPECT_EQ(at(0.05).rotation, origin);
  EXPECT_EQ(at(0.05).angular_velocity.norm(), 0);
  const double h = 1e-5;
  double largest = 0;
  for (double time = 0.0995; time < 1.5; time += 0.0123) {
    if (std::abs(time - 0.6) < 2 * h || std::abs(time - 1.4) < 2 * h) continue;
    const RotationMotion before = at(time - h), now = at(time), after = at(time + h);
    const Eigen::AngleAxisd step(after.rotation * before.rotation.transpose());
    const Eigen::Vector3d velocity = step.angle() * step.axis() / (2 * h);
    EXPECT_LT((now.angular_velocity - velocity).norm(), 1e-7) << time;
    const Eigen::Vector3d acceleration =
        (after.angular_velocity - before.angular_velocity) / (2 * h);
    EXPECT_LT((now.angular_acceleration - acceleration).norm(), 1e-6) << time;
    EXPECT_LT((now.rotation * now.rotation.transpose() - Eigen::Matrix3d::Identity()).norm(),
              1e-14);
    largest = std::max(largest, now.angular_velocity.norm());
  }
  EXPECT_GT(largest, 1);
  const Eigen::Matrix3d end =
      Eigen::AngleAxisd(second.norm(), second.normalized()).toRotationMatrix() * origin;
  EXPECT_LT((at(1.5).rotation - end).norm(), 1e-14);
  EXPECT_EQ(at(1.5).angular_velocity.norm(), 0);
}

TEST(ReferenceGenerator, BodyAndFreeFootTurn) {
  ReferenceGenerator references;
  references.BeginPhase(
      ParsePhase("support: RIGHT body { z: 0.4 duration: 1 } foot { foot: LEFT_FOOT z: 0.1 "
                 "duration: 1 turn { y: -0.2 duration: 0.5 delay: 0.5 } }"),
      Pose(), 0);
  References at = references.Update(0.5, Pose().com);
  EXPECT_NEAR(at.body.angular_velocity.z(), 15.0 / 8 * 0.4, 1e-12);  // minimum jerk's middle
  EXPECT_EQ(at.foot_rotation[1].rotation, Pose().sole[1].linear());
  at = references.Update(1, Pose().com);
  const auto turned = [](double angle, const Eigen::Vector3d& axis, const Eigen::Matrix3d& from) {
    return Eigen::Matrix3d(Eigen::AngleAxisd(angle, axis).toRotationMatrix() * from);
  };
  EXPECT_LT((at.body.rotation - turned(0.4, Eigen::Vector3d::UnitZ(), Pose().body_rotation)).norm(),
            1e-14);
  const Eigen::Matrix3d foot = turned(-0.2, Eigen::Vector3d::UnitY(), Pose().sole[1].linear());
  EXPECT_LT((at.foot_rotation[1].rotation - foot).norm(), 1e-14);
  // Held, it turns no more, and later turns count from there.
  references.HoldFoot(robot::Foot::kLeft, Pose().sole[1].translation(), foot);
  references.BeginPhase(ParsePhase("support: RIGHT foot { foot: LEFT_FOOT turn { y: 0.3 } }"),
                        Pose(), 2);
  EXPECT_LT((references.Update(2.1, Pose().com).foot_rotation[1].rotation -
             turned(0.3, Eigen::Vector3d::UnitY(), foot))
                .norm(),
            1e-14);
}

TEST(ReferenceGenerator, AfterGravityCompensationTheRobotHoldsWhereItWasLeft) {
  ReferenceGenerator references;
  references.BeginPhase(ParsePhase("gravity_compensation: true"), Pose(), 0);
  EstimatedPose left = Pose();
  left.com += Eigen::Vector3d(0.02, -0.03, -0.05);
  left.body_rotation = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()).toRotationMatrix();
  references.BeginPhase(ParsePhase(""), left, 5);
  EXPECT_EQ(references.Update(5, Pose().com).com.position, left.com);
  EXPECT_EQ(references.Update(5, Pose().com).body.rotation, left.body_rotation);
}

}  // namespace
}  // namespace poise
