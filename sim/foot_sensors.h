// How the feet's simulated sensors fail.
#pragma once

#include <array>
#include <string>
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
    std::array<bool, 2> foot{};
    double start = 0, end = 0;  // s
    FootSensorFault::Kind kind = FootSensorFault::DEAD;
    robot::Vector6d bias = robot::Vector6d::Zero();
  };
  std::array<bool, 2> present_{};
  std::vector<Fault> faults_;
  std::array<robot::Vector6d, 2> last_;  // reported
};

}  // namespace poise
