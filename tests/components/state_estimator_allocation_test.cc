// The estimator's tick must not touch the heap: malloc itself is counted.
#include <gtest/gtest.h>

#include <vector>

#include "components/state_estimator/calibrator.h"
#include "components/state_estimator/foot_wrenches.h"
#include "components/state_estimator/invariant_estimator.h"
#include "tests/allocation_counter.h"
#include "tests/components/base_motion.h"

namespace poise {
namespace {

TEST(InvariantEstimator, AllocatesNothingPerTick) {
  for (const char* path :
       {"/deploy/robots/dyros/dyros_legs.pbtxt", "/tests/robot/data/mantis.pbtxt"}) {
    BaseMotion motion(POISE_SOURCE_DIR + std::string(path));
    const long before_construction = allocations;
    InvariantEstimator estimator(motion.model(), {}, BaseMotion::kPeriod);
    EXPECT_GT(allocations - before_construction, 0);  // the counter counts
    // Loaded, one foot light, in flight.
    motion.script().load[0] = [](double t) { return t < 0.02 ? 0.5 : t < 0.04 ? 1.0 : 0.0; };
    motion.script().load[1] = [](double t) { return t < 0.02 ? 0.5 : 0.0; };
    for (int i = 0; i < 30; ++i) {
      motion.Next();
      const BaseSensors sensors = motion.sensors();
      const long before = allocations;
      estimator.Update(sensors, BaseMotion::kPeriod);
      ASSERT_EQ(allocations - before, 0) << i;
    }
  }
}

TEST(FootWrenchesAndCalibrator, AllocateNothingPerTick) {
  BaseMotion motion(POISE_SOURCE_DIR + std::string("/deploy/robots/dyros/dyros_legs.pbtxt"));
  FootWrenches wrenches(motion.model());
  Calibrator calibrator(motion.model(), true, BaseMotion::kPeriod);
  const Eigen::VectorXd torque = Eigen::VectorXd::LinSpaced(motion.model()->num_joints(), -9, 9);
  for (int i = 0; i < 30; ++i) {
    motion.Next();
    const BaseSensors read = motion.sensors();
    const BaseSensors sensors = {
        read.joint_position,           read.angular_velocity, read.acceleration, {}, {},
        {torque.data(), torque.size()}};
    const long before = allocations;
    wrenches.Update(i, BaseMotion::kPeriod, sensors, {}, {});
    calibrator.Track({wrenches.wrench(robot::Foot::kRight), wrenches.wrench(robot::Foot::kLeft)},
                     BaseMotion::kPeriod);
    calibrator.Update(wrenches.observer(), true);
    ASSERT_EQ(allocations - before, 0) << i;
  }
}

}  // namespace
}  // namespace poise
