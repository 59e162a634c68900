// How the feet's simulated sensors fail.
#pragma once

#include <vector>

#include "components/robot/robot_model.h"
#include "sim/sensors.h"
#include "sim/sim.pb.h"

namespace poise {

class FootSensors {
 public:
  /// Throws ConfigError (paths inside SimConfig): no such foot, a number that is not finite, a
  /// fault that ends before it starts.
  FootSensors(const robot::RobotModel& model, const SimConfig& config);

  /// Makes of right readings at `time`, s, what the sensors report. Once a tick. Does not allocate.
  void Apply(double time, SensorReadings* readings);

 private:
  struct Fault {
    robot::FootArray<bool> foot{};
    double start = 0, end = 0;  // s
    FootSensorFault::Kind kind = FootSensorFault::DEAD;
    robot::Vector6d bias = robot::Vector6d::Zero();
  };
  robot::FootArray<bool> present_{};
  std::vector<Fault> faults_;
  robot::FootArray<robot::Vector6d> last_;  // reported
};

}  // namespace poise
