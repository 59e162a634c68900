// A run as the topics that Foxglove and PlotJuggler know without being told anything.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "logging/derived/tick_messages.h"
#include "logging/events/events.h"
#include "logging/run_record.h"
#include "tools/foxglove/contact_scene.h"
#include "tools/foxglove/ground_scene.h"
#include "tools/foxglove/robot_frames.h"

namespace poise {

struct SceneTopic {
  std::string name;             ///< "/tf"
  std::string encoding;         ///< of the messages
  std::string schema;           ///< its name
  std::string schema_encoding;  ///< "protobuf", "ros2msg"
  std::string schema_data;
  bool kept = false;  ///< its last message is for whoever comes later, too
};

/// /tf, /tf_static, /robot, /ground, /forces, /support, /events, /joint_states, /robot_description
/// of docs/reference/foxglove.md. `Emit` gets the topic's index in topics(), ns of the run, and a
/// message.
class SceneTopics {
 public:
  using Emit = std::function<void(size_t topic, uint64_t time, std::string message)>;

  /// Takes a run's info, spec and robot alone; `run` must outlive it. Meshes are read where the run
  /// found them. DERIVED may come `late` ticks behind the others.
  SceneTopics(const logging::RunRecord& run, const Scenario& scenario, Emit emit, size_t late = 0);

  const std::vector<SceneTopic>& topics() const { return topics_; }
  /// What does not change: frames, robot and description.
  void Begin();
  /// A message of the run, well formed, and of DERIVED (logging::DerivedMessages).
  void Add(std::string_view channel, const MessageType& type, std::span<const uint8_t> data);
  /// What has happened. `time` in s of the scenario.
  void AddEvent(double time, std::string_view name, std::string_view detail);
  void End();

 private:
  enum Topic : size_t {
    kFrames,
    kFixedFrames,
    kRobot,
    kGround,
    kForces,
    kSupport,
    kEvents,
    kJointStates,
    kDescription
  };

  template <class Message>
  void Publish(Topic topic, int64_t utime, const Message& message);
  void AddTick(const logging::TickMessages& tick);
  void AddJointStates(const logging::TickMessages& tick);
  /// us of the run at a time (s) of the scenario.
  int64_t Utime(double time) const;

  const logging::RunRecord& run_;
  Emit emit_;
  std::vector<SceneTopic> topics_;
  RobotFrames frames_;
  ContactScene contacts_;
  GroundScene ground_;
  logging::TickGatherer gatherer_;
  robot::RobotState state_;
  bool truth_came_ = false;
  std::vector<std::string> joint_names_;
};

}  // namespace poise
