#include "tools/foxglove/scene_topics.h"

#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <set>

#include "components/framework/run.h"
#include "components/messages/conversions.h"
#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/foxglove/event_level.h"
#include "tools/foxglove/scene_parts.h"

namespace poise {
namespace {

namespace pb = google::protobuf;
using logging::TickMessages;

constexpr double kPictures = 100;  // Hz: beyond what a screen shows
constexpr size_t kSceneTriangles = 40'000;

// Definitions as a .msg file has them, with those they use: the schema "ros2msg" of MCAP.
constexpr std::string_view kStringDefinition = "string data\n";
constexpr std::string_view kJointStateDefinition =
    "std_msgs/Header header\n"
    "string[] name\n"
    "float64[] position\n"
    "float64[] velocity\n"
    "float64[] effort\n"
    "================================================================================\n"
    "MSG: std_msgs/Header\n"
    "builtin_interfaces/Time stamp\n"
    "string frame_id\n"
    "================================================================================\n"
    "MSG: builtin_interfaces/Time\n"
    "int32 sec\n"
    "uint32 nanosec\n";

/// OMG's Common Data Representation, plain, little-endian: each number aligned to its size from the
/// end of the four-byte header on.
class Cdr {
 public:
  Cdr() : bytes_("\0\1\0\0", kHeader) {}

  template <class Number>
  void Add(Number value) {
    static_assert(std::endian::native == std::endian::little);
    while ((bytes_.size() - kHeader) % sizeof(Number) != 0) bytes_ += '\0';
    char raw[sizeof(Number)];
    std::memcpy(raw, &value, sizeof(Number));
    bytes_.append(raw, sizeof(Number));
  }
  /// Its length counts the zero at its end.
  void AddText(std::string_view text) {
    Add(static_cast<uint32_t>(text.size() + 1));
    bytes_.append(text);
    bytes_ += '\0';
  }
  void AddNumbers(std::span<const double> values) {
    Add(static_cast<uint32_t>(values.size()));
    for (const double value : values) Add(value);
  }
  std::string Take() { return std::move(bytes_); }

 private:
  static constexpr size_t kHeader = 4;
  std::string bytes_;
};

/// std_msgs/msg/String.
std::string StringCdr(std::string_view text) {
  Cdr cdr;
  cdr.AddText(text);
  return cdr.Take();
}

/// sensor_msgs/msg/JointState, of as many joints as names: rad, rad/s, N·m; empty where unknown.
std::string JointStateCdr(int64_t utime, std::span<const std::string> names,
                          std::span<const double> position, std::span<const double> velocity,
                          std::span<const double> effort) {
  Cdr cdr;
  cdr.Add(static_cast<int32_t>(utime / 1'000'000));
  cdr.Add(static_cast<uint32_t>(utime % 1'000'000) * 1'000);
  cdr.AddText("");
  cdr.Add(static_cast<uint32_t>(names.size()));
  for (const std::string& name : names) cdr.AddText(name);
  cdr.AddNumbers(position);
  cdr.AddNumbers(velocity);
  cdr.AddNumbers(effort);
  return cdr.Take();
}

/// A schema with all that it imports, serialised.
std::string FileSet(const pb::Descriptor& type) {
  pb::FileDescriptorSet set;
  std::set<const pb::FileDescriptor*> done;
  const auto add = [&](const auto& self, const pb::FileDescriptor* file) -> void {
    if (!done.insert(file).second) return;
    for (int i = 0; i < file->dependency_count(); ++i) self(self, file->dependency(i));
    file->CopyTo(set.add_file());
  };
  add(add, type.file());
  return set.SerializeAsString();
}

template <class Message>
SceneTopic ProtobufTopic(const char* name, bool kept) {
  const pb::Descriptor& type = *Message::descriptor();
  return {name, "protobuf", type.full_name(), "protobuf", FileSet(type), kept};
}

SceneTopic RosTopic(const char* name, const char* schema, std::string_view definition, bool kept) {
  return {name, "cdr", schema, "ros2msg", std::string(definition), kept};
}

int64_t PictureTicks(const RunSpec& spec) {
  return std::max<int64_t>(1, std::llround(1 / (kPictures * spec.tick_period())));
}

// Foxglove's levels stand in the order of EventLevel.
constexpr foxglove::Log::Level kLevels[] = {foxglove::Log::INFO, foxglove::Log::WARNING,
                                            foxglove::Log::ERROR};

/// Texts of a log may hold any bytes.
std::string Utf8(std::string_view text) {
  return logging::IsUtf8(text) ? std::string(text) : logging::LinesForTerminal(text);
}

bool IsUrdf(const std::string& maker_text) {
  return maker_text.find("<robot") != std::string::npos;
}

bool ReadTruth(const ground_truth_t& truth, robot::RobotState* state) {
  robot_state_t message;
  MessageTraits<robot_state_t>::Resize(message, std::array{truth.num_joints, truth.num_feet});
  std::ranges::copy(truth.base_position, message.base_position);
  std::ranges::copy(truth.base_orientation, message.base_orientation);
  message.joint_position = truth.joint_position;
  return ReadState(message, state);
}

}  // namespace

SceneTopics::SceneTopics(const logging::RunRecord& run, const Scenario& scenario, Emit emit,
                         size_t late)
    : run_(run),
      emit_(std::move(emit)),
      topics_{ProtobufTopic<foxglove::FrameTransforms>("/tf", false),
              ProtobufTopic<foxglove::FrameTransforms>("/tf_static", true),
              ProtobufTopic<foxglove::SceneUpdate>("/robot", true),
              ProtobufTopic<foxglove::SceneUpdate>("/ground", true),
              ProtobufTopic<foxglove::SceneUpdate>("/forces", false),
              ProtobufTopic<foxglove::SceneUpdate>("/support", false),
              ProtobufTopic<foxglove::Log>("/events", false),
              RosTopic("/joint_states", "sensor_msgs/msg/JointState", kJointStateDefinition, false),
              RosTopic("/robot_description", "std_msgs/msg/String", kStringDefinition, true)},
      frames_(run.robot),
      contacts_(run.robot),
      ground_(scenario),
      gatherer_(
          run.spec, PictureTicks(run.spec),
          logging::TickGatherer::kFewTicks + late / static_cast<size_t>(PictureTicks(run.spec))),
      state_(run.robot.num_joints()) {
  for (const robot::Joint& joint : run.robot.joints()) joint_names_.push_back(joint.name);
}

template <class Message>
void SceneTopics::Publish(Topic topic, int64_t utime, const Message& message) {
  emit_(topic, static_cast<uint64_t>(utime) * 1'000, message.SerializeAsString());
}

int64_t SceneTopics::Utime(double time) const {
  const double ticks =
      std::round(time / run_.spec.tick_period()) + static_cast<double>(run_.spec.lead_ticks());
  return std::max<int64_t>(0, std::llround(1e6 * ticks * run_.spec.tick_period()));
}

void SceneTopics::Begin() {
  MeshPlaces places;  // those of the machine that the run was on, if it is this one
  places.maker_file = ResourceOf(run_.spec, "urdf").file();
  const RobotDrawing drawing = DrawRobot(run_.robot, run_.info.urdf, places, kSceneTriangles);
  Publish(kFixedFrames, 0, frames_.Fixed(0));
  Publish(kRobot, 0, frames_.Picture(drawing, 0));
  if (IsUrdf(run_.info.urdf)) {
    emit_(kDescription, 0, StringCdr(Utf8(run_.info.urdf)));
  }
  if (const auto ground = ground_.Update(-run_.duration(run_.spec.lead_ticks()), 0)) {
    Publish(kGround, 0, *ground);
  }
}

void SceneTopics::Add(std::string_view channel, const MessageType& type,
                      std::span<const uint8_t> data) {
  gatherer_.Add(channel, type, data);
  while (const std::optional<TickMessages> tick = gatherer_.Take(false)) AddTick(*tick);
}

void SceneTopics::End() {
  while (const std::optional<TickMessages> tick = gatherer_.Take(true)) AddTick(*tick);
}

void SceneTopics::AddTick(const TickMessages& tick) {
  if (tick.utime < 0 || tick.utime >= INT64_MAX / 1'000) return;
  truth_came_ = truth_came_ || tick.truth;
  // Where the truth is lost now and then, the estimate would make the robot jump.
  const bool posed = truth_came_ ? tick.truth && ReadTruth(*tick.truth, &state_)
                                 : tick.state && ReadState(*tick.state, &state_);
  if (posed) Publish(kFrames, tick.utime, frames_.Moving(state_, tick.utime));
  Publish(kForces, tick.utime, contacts_.Forces(tick));
  Publish(kSupport, tick.utime, contacts_.Support(tick));
  AddJointStates(tick);
  const double time =
      1e-6 * static_cast<double>(tick.utime) - run_.duration(run_.spec.lead_ticks());
  if (const auto ground = ground_.Update(time, tick.utime)) Publish(kGround, tick.utime, *ground);
}

void SceneTopics::AddJointStates(const TickMessages& tick) {
  if (!tick.state || tick.state->joint_position.size() != joint_names_.size()) return;
  std::span<const double> effort;
  if (tick.sensors && tick.sensors->joint_torque.size() == joint_names_.size()) {
    effort = tick.sensors->joint_torque;
  }
  emit_(kJointStates, static_cast<uint64_t>(tick.utime) * 1'000,
        JointStateCdr(tick.utime, joint_names_, tick.state->joint_position,
                      tick.state->joint_velocity, effort));
}

void SceneTopics::AddEvent(double time, std::string_view name, std::string_view detail) {
  if (!std::isfinite(time)) return;
  foxglove::Log log;
  const int64_t utime = Utime(time);
  *log.mutable_timestamp() = SceneTime(utime);
  log.set_level(kLevels[static_cast<size_t>(LevelOfEvent(name))]);
  log.set_name(Utf8(name));
  log.set_message(Utf8(detail.empty() ? name : detail));
  Publish(kEvents, utime, log);
}

}  // namespace poise
