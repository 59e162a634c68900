// A run's state and events as ROS 2's standard messages on DDS.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "logging/derived/tick_messages.h"
#include "logging/run_record.h"
#include "tools/foxglove/robot_frames.h"
#include "tools/ros2/ros2_writers.h"

namespace poise {

/// The topics of docs/reference/ros2.md. What is told is what the robot knows (ROBOT_STATE,
/// ROBOT_SENSORS), also where a simulation knows better. Stamps are the run's time.
class Ros2Publisher {
 public:
  /// Takes a run's info, spec and robot; `run` must outlive it. `rate` in Hz, at most the ticks'.
  /// Throws unitree::UnitreeError.
  Ros2Publisher(const unitree::DdsLink& link, const logging::RunRecord& run, double rate);

  /// A message of the run, well formed.
  void Add(std::string_view channel, const MessageType& type, std::span<const uint8_t> data);
  /// `time` in s of the scenario.
  void AddEvent(double time, const std::string& name, const std::string& detail);
  void Finish();
  /// Messages given to DDS, and those that it did not take.
  int64_t written() const { return written_; }
  int64_t failed() const { return failed_; }

 private:
  void PublishStatic();
  void Publish(const logging::TickMessages& tick);
  void PublishJoints(const logging::TickMessages& tick);
  void PublishBase(const robot_state_t& state, const foxglove::FrameTransforms& frames,
                   int64_t utime);
  void PublishWrenches(const logging::TickMessages& tick);
  void PublishFrames(const foxglove::FrameTransforms& frames, Ros2Writer* writer);
  void Write(Ros2Writer* writer, const void* message);

  const logging::RunRecord& run_;
  RobotFrames frames_;
  logging::TickGatherer gatherer_;
  robot::RobotState state_;
  std::vector<std::string> joint_names_, sole_frames_;
  unitree::Participant participant_;
  Ros2Writer clock_, joints_, odometry_, tf_, tf_static_, description_, rosout_;
  std::vector<std::unique_ptr<Ros2Writer>> wrenches_;  // by foot
  int64_t written_ = 0, failed_ = 0;
};

}  // namespace poise
