// A run's state and events as ROS 2's standard messages on DDS.
#pragma once

#include <dds/dds.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hw_bridge/unitree/dds.h"
#include "logging/derived/tick_messages.h"
#include "logging/run_record.h"
#include "tools/foxglove/robot_frames.h"

namespace poise {

/// How long a topic's messages are kept for readers that come later.
enum class Keeping {
  kNone,  ///< ROS 2's default: reliable, volatile, the last 10
  kLast,  ///< "transient local", the last one: robot_description, tf_static
  kAll    ///< "transient local", the last 1,000: rosout
};

/// One topic: NAME of ROS 2 is rt/NAME in DDS. A reader that takes nothing holds nobody: beyond its
/// history the oldest messages are gone.
class Ros2Writer {
 public:
  /// Throws unitree::UnitreeError.
  Ros2Writer(const unitree::Participant& participant, const dds_topic_descriptor_t& type,
             const std::string& name, Keeping keeping);
  ~Ros2Writer();
  Ros2Writer(const Ros2Writer&) = delete;
  Ros2Writer& operator=(const Ros2Writer&) = delete;

  /// A message of the type's C struct. False when DDS did not take it.
  bool Write(const void* message);

 private:
  dds_entity_t topic_ = 0, writer_ = 0;
};

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
