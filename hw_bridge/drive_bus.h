// DriveBus: the drives and sensors of a robot, simulated or real, one control cycle at a time.
#pragma once

#include "poise/drive_command_t.hpp"
#include "poise/drive_feedback_t.hpp"

namespace poise {

/// Neither call may block, allocate or throw.
class DriveBus {
 public:
  virtual ~DriveBus() = default;

  /// What drives and sensors report in this cycle; nullptr when nothing arrived. Valid until the
  /// next call.
  virtual const drive_feedback_t* Receive() = 0;
  /// Sends currents and enables for this cycle (sizes as in the feedback).
  virtual void Send(const drive_command_t& command) = 0;
};

}  // namespace poise
