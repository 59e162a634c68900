#include "tools/ros2/ros2_publisher.h"

#include <algorithm>
#include <cmath>

#include "components/messages/conversions.h"
#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/foxglove/event_level.h"
#include "tools/ros2/ros2.h"

namespace poise {
namespace {

using logging::TickMessages;

// What stands still, as ROS 2's REP 105 names it for a pose that drifts and never jumps.
constexpr const char* kOdometryFrame = "odom";
constexpr const char* kNode = "poise";
constexpr int32_t kDefaultDepth = 10;    // of ROS 2's default quality of service
constexpr int32_t kRosoutDepth = 1'000;  // of its rosout
// A reliable reader that acknowledges nothing may hold a write for so long; then the sample counts
// as written for the others and is lost to it.
constexpr dds_duration_t kMostBlocking = DDS_MSECS(1);
constexpr uint8_t kLevels[] = {20, 30, 40};  // INFO, WARN, ERROR of rcl_interfaces, by EventLevel

int64_t EveryTick(const RunSpec& spec, double rate) {
  return std::max<int64_t>(1, std::llround(1 / (rate * spec.tick_period())));
}

/// The C types hold pointers that they do not write through.
char* Text(const std::string& text) { return const_cast<char*>(text.c_str()); }
char* Text(const char* text) { return const_cast<char*>(text); }

builtin_interfaces_msg_dds__Time_ Stamp(int64_t utime) {
  return {static_cast<int32_t>(utime / 1'000'000),
          static_cast<uint32_t>(utime % 1'000'000) * 1'000};
}
std_msgs_msg_dds__Header_ Header(int64_t utime, char* frame) { return {Stamp(utime), frame}; }

geometry_msgs_msg_dds__Vector3_ Vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

dds_sequence_double Numbers(std::span<const double> values) {
  const auto size = static_cast<uint32_t>(values.size());
  return {size, size, const_cast<double*>(values.data()), false};
}

}  // namespace

Ros2Writer::Ros2Writer(const unitree::Participant& participant, const dds_topic_descriptor_t& type,
                       const std::string& name, Keeping keeping) {
  const std::string dds_name = "rt/" + name;
  const auto check = [&](dds_entity_t entity) {
    if (entity >= 0) return entity;
    if (topic_ > 0) dds_delete(topic_);
    throw unitree::UnitreeError(
        fmt::format("DDS topic {} cannot be opened ({})", dds_name, dds_strretcode(entity)));
  };
  topic_ = check(dds_create_topic(participant.entity(), &type, dds_name.c_str(), nullptr, nullptr));
  dds_qos_t* const qos = dds_create_qos();
  const int32_t depth = keeping == Keeping::kNone   ? kDefaultDepth
                        : keeping == Keeping::kLast ? 1
                                                    : kRosoutDepth;
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, kMostBlocking);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
  if (keeping != Keeping::kNone) {
    dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
    dds_qset_durability_service(qos, 0, DDS_HISTORY_KEEP_LAST, depth, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  }
  writer_ = dds_create_writer(participant.entity(), topic_, qos, nullptr);
  dds_delete_qos(qos);
  check(writer_);
}

Ros2Writer::~Ros2Writer() {
  dds_delete(writer_);
  dds_delete(topic_);
}

bool Ros2Writer::Write(const void* message) {
  return dds_write(writer_, message) == DDS_RETCODE_OK;
}

Ros2Publisher::Ros2Publisher(const unitree::DdsLink& link, const logging::RunRecord& run,
                             double rate)
    : run_(run),
      frames_(run.robot),
      gatherer_(run.spec, EveryTick(run.spec, rate)),
      state_(run.robot.num_joints()),
      participant_(link),
      clock_(participant_, rosgraph_msgs_msg_dds__Clock__desc, "clock", Keeping::kNone),
      joints_(participant_, sensor_msgs_msg_dds__JointState__desc, "joint_states", Keeping::kNone),
      odometry_(participant_, nav_msgs_msg_dds__Odometry__desc, "odom", Keeping::kNone),
      tf_(participant_, tf2_msgs_msg_dds__TFMessage__desc, "tf", Keeping::kNone),
      tf_static_(participant_, tf2_msgs_msg_dds__TFMessage__desc, "tf_static", Keeping::kLast),
      description_(participant_, std_msgs_msg_dds__String__desc, "robot_description",
                   Keeping::kLast),
      rosout_(participant_, rcl_interfaces_msg_dds__Log__desc, "rosout", Keeping::kAll) {
  for (const robot::Joint& joint : run.robot.joints()) joint_names_.push_back(joint.name);
  for (const robot::FootModel& foot : run.robot.feet()) {
    sole_frames_.push_back(foot.name + "_sole");
    wrenches_.push_back(std::make_unique<Ros2Writer>(participant_,
                                                     geometry_msgs_msg_dds__WrenchStamped__desc,
                                                     foot.name + "_foot_wrench", Keeping::kNone));
  }
  PublishStatic();
}

void Ros2Publisher::Write(Ros2Writer* writer, const void* message) {
  ++(writer->Write(message) ? written_ : failed_);
}

void Ros2Publisher::PublishStatic() {
  foxglove::FrameTransforms frames = frames_.Fixed(0);
  for (size_t f = 0; f < sole_frames_.size(); ++f) {
    frames_.AddFixed(run_.robot.feet()[f].body, sole_frames_[f], run_.robot.feet()[f].sole,
                     &frames);
  }
  PublishFrames(frames, &tf_static_);
  if (run_.info.urdf.find("<robot") == std::string::npos) return;  // MJCF, which ROS 2 has not
  const std_msgs_msg_dds__String_ description{Text(run_.info.urdf)};
  Write(&description_, &description);
}

void Ros2Publisher::Add(std::string_view channel, const MessageType& type,
                        std::span<const uint8_t> data) {
  gatherer_.Add(channel, type, data);
  while (const std::optional<TickMessages> tick = gatherer_.Take(false)) Publish(*tick);
}

void Ros2Publisher::Finish() {
  while (const std::optional<TickMessages> tick = gatherer_.Take(true)) Publish(*tick);
}

void Ros2Publisher::Publish(const TickMessages& tick) {
  // A stamp has 31 bits of seconds.
  if (tick.utime < 0 || tick.utime / 1'000'000 > INT32_MAX) return;
  const rosgraph_msgs_msg_dds__Clock_ clock{Stamp(tick.utime)};
  Write(&clock_, &clock);
  PublishJoints(tick);
  PublishWrenches(tick);
  if (!tick.state || !ReadState(*tick.state, &state_)) return;
  foxglove::FrameTransforms frames = frames_.Moving(state_, tick.utime);
  frames.mutable_transforms(0)->set_parent_frame_id(kOdometryFrame);
  PublishFrames(frames, &tf_);
  PublishBase(*tick.state, frames, tick.utime);
}

void Ros2Publisher::PublishJoints(const TickMessages& tick) {
  if (!tick.state || tick.state->joint_position.size() != joint_names_.size()) return;
  std::vector<char*> names;
  for (const std::string& name : joint_names_) names.push_back(Text(name));
  const auto size = static_cast<uint32_t>(names.size());
  sensor_msgs_msg_dds__JointState_ message{};
  message.header = Header(tick.utime, Text(""));
  message.name = {size, size, names.data(), false};
  message.position = Numbers(tick.state->joint_position);
  message.velocity = Numbers(tick.state->joint_velocity);
  if (tick.sensors && tick.sensors->joint_torque.size() == names.size()) {
    message.effort = Numbers(tick.sensors->joint_torque);
  }
  Write(&joints_, &message);
}

void Ros2Publisher::PublishBase(const robot_state_t& state, const foxglove::FrameTransforms& frames,
                                int64_t utime) {
  const foxglove::FrameTransform& base = frames.transforms(0);
  const auto& p = base.translation();
  const auto& q = base.rotation();
  nav_msgs_msg_dds__Odometry_ message{};
  message.header = Header(utime, Text(kOdometryFrame));
  message.child_frame_id = Text(frames_.link(0));
  message.pose.pose = {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
  // A twist is told in the child's axes.
  const Eigen::Quaterniond to_world(q.w(), q.x(), q.y(), q.z());
  message.twist.twist = {Vector(to_world.conjugate() * GetVector3(state.base_linear_velocity)),
                         Vector(to_world.conjugate() * GetVector3(state.base_angular_velocity))};
  Write(&odometry_, &message);
}

void Ros2Publisher::PublishWrenches(const TickMessages& tick) {
  if (!tick.state) return;
  const std::vector<wrench_t>& wrenches = tick.state->foot_wrench;
  for (size_t f = 0; f < std::min(wrenches.size(), wrenches_.size()); ++f) {
    // The bus tells what the robot does to the ground; here it is the other way round.
    const geometry_msgs_msg_dds__WrenchStamped_ message{
        Header(tick.utime, Text(sole_frames_[f])),
        {Vector(-GetVector3(wrenches[f].force)), Vector(-GetVector3(wrenches[f].moment))}};
    Write(wrenches_[f].get(), &message);
  }
}

void Ros2Publisher::PublishFrames(const foxglove::FrameTransforms& frames, Ros2Writer* writer) {
  std::vector<geometry_msgs_msg_dds__TransformStamped_> transforms;
  for (const foxglove::FrameTransform& frame : frames.transforms()) {
    const auto& p = frame.translation();
    const auto& q = frame.rotation();
    transforms.push_back({{{static_cast<int32_t>(frame.timestamp().seconds()),
                            static_cast<uint32_t>(frame.timestamp().nanos())},
                           Text(frame.parent_frame_id())},
                          Text(frame.child_frame_id()),
                          {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}}});
  }
  const auto size = static_cast<uint32_t>(transforms.size());
  const tf2_msgs_msg_dds__TFMessage_ message{{size, size, transforms.data(), false}};
  Write(writer, &message);
}

void Ros2Publisher::AddEvent(double time, const std::string& name, const std::string& detail) {
  const double at = time + run_.duration(run_.spec.lead_ticks());
  if (!(at >= 0 && at < INT32_MAX)) return;
  const std::string text = logging::ForTerminal(detail.empty() ? name : detail);
  const std::string event = logging::ForTerminal(name);
  const rcl_interfaces_msg_dds__Log_ message{Stamp(std::llround(1e6 * at)),
                                             kLevels[static_cast<size_t>(LevelOfEvent(name))],
                                             Text(kNode),
                                             Text(text),
                                             Text(""),
                                             Text(event),
                                             0};
  Write(&rosout_, &message);
}

}  // namespace poise
