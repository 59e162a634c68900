#include "sim/foot_sensors.h"

#include <fmt/format.h>

#include <limits>

#include "components/framework/configuration/configuration.h"
#include "poise/drive_feedback_t.hpp"

namespace poise {

using robot::kFeet;

FootSensors::FootSensors(const robot::RobotModel& model, const SimConfig& config) {
  last_.fill(robot::Vector6d::Zero());
  for (const robot::Foot f : kFeet) {
    present_[f] = config.foot_sensors() && model.feet()[f].force_sensor;
  }
  for (int i = 0; i < config.foot_sensor_fault_size(); ++i) {
    const FootSensorFault& in = config.foot_sensor_fault(i);
    const std::string field = fmt::format("foot_sensor_fault[{}]", i);
    Fault fault;
    for (const robot::Foot f : kFeet) {
      fault.foot[f] = !in.has_foot() || in.foot() == model.feet()[f].name;
    }
    if (Count(fault.foot) == 0) {
      throw ConfigError(field + ".foot",
                        fmt::format("robot '{}' has no foot '{}'; it has '{}' and '{}'",
                                    model.name(), in.foot(), model.feet()[robot::Foot::kRight].name,
                                    model.feet()[robot::Foot::kLeft].name));
    }
    fault.start = in.start();
    fault.end = in.has_end() ? in.end() : std::numeric_limits<double>::infinity();
    if (!(fault.end > fault.start)) throw ConfigError(field + ".end", "must be after its start");
    fault.kind = in.kind();
    fault.bias << in.force_x(), in.force_y(), in.force_z(), in.moment_x(), in.moment_y(),
        in.moment_z();
    faults_.push_back(fault);
  }
}

void FootSensors::Apply(double time, SensorReadings* readings) {
  for (const robot::Foot f : kFeet) {
    robot::Vector6d& wrench = readings->foot_wrench[f];
    int8_t& state = readings->foot_sensor[f];
    state = present_[f] ? drive_feedback_t::SENSOR_OK : drive_feedback_t::SENSOR_ABSENT;
    for (const Fault& fault : faults_) {
      if (!fault.foot[f] || time < fault.start || time >= fault.end) continue;
      switch (fault.kind) {
        case FootSensorFault::DEAD:
          wrench.setZero();
          break;
        case FootSensorFault::INVALID:
          state = drive_feedback_t::SENSOR_INVALID;
          break;
        case FootSensorFault::FROZEN:
          wrench = last_[f];
          break;
        case FootSensorFault::BIASED:
          wrench += fault.bias;
          break;
      }
    }
    if (!present_[f]) state = drive_feedback_t::SENSOR_ABSENT;
    if (state != drive_feedback_t::SENSOR_OK) wrench.setZero();
    last_[f] = wrench;
  }
}

}  // namespace poise
