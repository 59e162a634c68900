#include "hw_bridge/drive_emulator/drive_emulator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "components/framework/configuration/suggest.h"
#include "components/messages/robot_resource.h"

namespace poise {

std::string_view drive_emulator_proto_schema();  // generated
namespace {

using ethercat::kMillisecond;

// A cycle's outputs act until shortly before the next cycle's frames.
constexpr int64_t kBeforeNextTick = 1000;          // ns
constexpr int64_t kQuiet = 300 * kMillisecond;     // without frames: the master is gone
constexpr int64_t kClosing = 2000 * kMillisecond;  // at most
constexpr int kMostFrames = 64;                    // answered in one go
// Less than the drives' watchdog, more than anything they take to do.
constexpr int64_t kPatience = 20 * kMillisecond;

size_t FindJoint(const robot::RobotModel& model, const std::string& name,
                 const std::string& field) {
  const int joint = model.FindJoint(name);
  if (joint >= 0) return static_cast<size_t>(joint);
  std::vector<std::string> names;
  for (const robot::Joint& each : model.joints()) names.push_back(each.name);
  throw ConfigError(field, fmt::format("must be a joint of the robot, not \"{}\"; {}", name,
                                       Suggest(name, names)));
}

/// What the robot's file says of a motor, where the configuration does not.
void CompleteDrive(const robot::MotorModel& motor, ethercat::EmulatedDriveConfig* drive) {
  if (!drive->has_rated_current()) {
    drive->set_rated_current(static_cast<uint32_t>(std::lround(motor.rated_current * 1e3)));
  }
  if (!drive->has_rated_torque()) {
    drive->set_rated_torque(
        static_cast<uint32_t>(std::lround(motor.rated_current * motor.torque_constant * 1e3)));
  }
  if (!drive->has_peak_torque()) {
    drive->set_peak_torque(
        static_cast<uint32_t>(std::lround(motor.peak_current / motor.rated_current * 1e3)));
  }
  if (!drive->has_encoder_counts()) {
    drive->set_encoder_counts(static_cast<uint32_t>(motor.encoder_counts));
  }
}

}  // namespace

void DriveEmulator::Shaft::SetCounts(int64_t counts, double seconds) {
  // In the middle of a count, so that the drive shows this one.
  const double turns = (static_cast<double>(sign_ * counts + zero_) + 0.5) / motor_.encoder_counts;
  const double position = turns * 2 * std::numbers::pi;
  velocity_ = known_ ? (position - position_) / seconds : 0;
  position_ = position;
  known_ = true;
}

void DriveEmulator::Configure(const ComponentContext& context, Wiring* wiring) {
  config_ = context.config<DriveEmulatorConfig>();
  const std::shared_ptr<const robot::RobotModel> model = LoadRobot(context);
  ethercat::CheckLink(config_.link());
  period_seconds_ = context.tick_period;
  period_ = std::llround(context.tick_period * 1e9);

  auto drives = config_.wiring();
  if (drives.empty()) {
    for (const robot::Joint& joint : model->joints()) drives.Add()->set_joint(joint.name);
  }
  ethercat::EmulatedChainConfig chain;
  chain.set_hop(config_.hop());
  std::vector<ethercat::MotorLoad*> loads;
  for (int i = 0; i < drives.size(); ++i) {
    const size_t joint = FindJoint(*model, drives[i].joint(), fmt::format("wiring[{}].joint", i));
    if (std::find(joint_.begin(), joint_.end(), joint) != joint_.end()) {
      throw ConfigError(fmt::format("wiring[{}].joint", i), "must not have a drive already");
    }
    joint_.push_back(joint);
    const robot::MotorModel& motor = model->motors()[joint];
    ethercat::EmulatedDriveConfig& drive = *chain.add_drive();
    drive = config_.drive();
    drive.set_serial(static_cast<uint32_t>(i + 1));
    for (const DriveChange& change : config_.change()) {
      if (change.joint() == drives[i].joint()) drive.MergeFrom(change.drive());
    }
    CompleteDrive(motor, &drive);
    shafts_.push_back(
        std::make_unique<Shaft>(motor, drives[i].reversed(), drives[i].zero_counts()));
    loads.push_back(shafts_.back().get());
  }
  for (int i = 0; i < config_.change_size(); ++i) {
    FindJoint(*model, config_.change(i).joint(), fmt::format("change[{}].joint", i));
  }
  for (int i = 0; i < config_.trouble_size(); ++i) {
    const DriveTrouble& trouble = config_.trouble(i);
    Trouble& entry = troubles_.emplace_back();
    entry.config = trouble;
    if (trouble.kind() == DriveTrouble::FRAMES) continue;
    const size_t joint = FindJoint(*model, trouble.joint(), fmt::format("trouble[{}].joint", i));
    const auto place = std::find(joint_.begin(), joint_.end(), joint);
    if (place == joint_.end()) {
      throw ConfigError(fmt::format("trouble[{}].joint", i), "must have a drive in wiring");
    }
    entry.slave = static_cast<size_t>(place - joint_.begin());
  }
  chain_ = std::make_unique<ethercat::EmulatedChain>(chain, loads);
  memory_ = std::make_unique<ethercat::MemoryLink>(chain_.get(), 0);
  faulty_ = std::make_unique<ethercat::FaultyLink>(memory_.get(), context.seed);

  const MessageCounts counts = JointAndFootCounts(*model);
  wiring->AddInput(&drive_feedback_, "drive_feedback", counts);
  wiring->AddInput(&bridge_command_, "bridge_command", {model->num_joints()});
  wiring->AddOutput(&sensor_feedback_, "sensor_feedback", counts);
  wiring->AddOutput(&drive_command_, "drive_command", {model->num_joints()});
  wiring->AddStage("sense", {&drive_feedback_}, {&sensor_feedback_},
                   [this](const Tick& tick) { Sense(tick); });
  wiring->AddStage("act", {&bridge_command_}, {&drive_command_},
                   [this](const Tick& tick) { Act(tick); });
}

void DriveEmulator::Open() {
  socket_ = ethercat::OpenLink(config_.link(), ethercat::SocketLink::Side::kSlaves);
  clock_offset_ = -socket_->Now();
}

void DriveEmulator::Idle() {
  if (ticking_) {  // the run is over: the clock's time goes on from here
    ticking_ = false;
    if (socket_) clock_offset_ = tick_time_ - socket_->Now();
  }
  Serve();
}

std::string DriveEmulator::Close() {
  Idle();
  if (!socket_) return {};
  const int64_t end = socket_->Now() + kClosing;
  int64_t last_frame = socket_->Now();
  int64_t frames = chain_->frames();
  const auto at_rest = [this] {
    for (size_t i = 0; i < chain_->size(); ++i) {
      if (chain_->slave(i).al_state() != ethercat::AlState::kInit) return false;
    }
    return true;
  };
  while (!at_rest() && socket_->Now() < std::min(end, last_frame + kQuiet)) {
    Await(socket_->Now() + kMillisecond);
    if (chain_->frames() != frames) last_frame = socket_->Now();
    frames = chain_->frames();
  }
  // The frame that asked for the last state is waiting for others that look at it.
  const int64_t grace = socket_->Now() + 20 * kMillisecond;
  while (socket_->Now() < grace) Await(grace);
  socket_.reset();
  return {};
}

int64_t DriveEmulator::Now() {
  if (ticking_) return tick_time_;
  int64_t now = socket_->Now() + clock_offset_;
  if (config_.simulated_time() && now > last_frame_ + kPatience) {
    clock_offset_ -= now - (last_frame_ + kPatience);
    now = last_frame_ + kPatience;
  }
  return now;
}

void DriveEmulator::Await(int64_t deadline) {
  const size_t size = socket_->Receive(frame_, deadline);
  if (size > 0) {
    last_frame_ = Now();
    static_cast<void>(faulty_->Send(std::span(frame_).first(size)));
  }
  Serve();
}

void DriveEmulator::Answer(int64_t now) {
  size_t size = 0;
  while ((size = faulty_->Receive(frame_, now)) > 0) {
    static_cast<void>(socket_->Send(std::span(frame_).first(size)));
  }
}

void DriveEmulator::Serve() {
  if (!socket_) return;
  for (int i = 0; i < kMostFrames; ++i) {
    const int64_t now = std::max(Now(), memory_->Now());
    memory_->AdvanceTo(now);
    Answer(now);
    const size_t size = socket_->Receive(frame_, 0);
    if (size == 0) return;
    last_frame_ = now;
    static_cast<void>(faulty_->Send(std::span(frame_).first(size)));
    Answer(now);
  }
}

/// Puts tick 0 where SYNC0 comes half a period after it, as a steered master's frames do.
void DriveEmulator::StartSimulatedTime() {
  first_tick_time_ = std::max(Now(), memory_->Now());
  const ethercat::EmulatedEsc& clock = chain_->slave(0).esc();
  if (const std::optional<int64_t> next = clock.next_sync0()) {
    const int64_t early = (*next - clock.SystemTime() - period_ / 2) % period_;
    first_tick_time_ += early < 0 ? early + period_ : early;
  }
  tick_time_ = first_tick_time_;
  ticking_ = true;
}

void DriveEmulator::Apply(Trouble* trouble, bool active) {
  if (trouble->active == active) return;
  trouble->active = active;
  ethercat::EmulatedSlave& slave = chain_->slave(trouble->slave);
  switch (trouble->config.kind()) {
    case DriveTrouble::FRAMES: {
      const FrameFaults& frames = trouble->config.frames();
      faulty_->set_faults(active ? ethercat::LinkFaults{.lost_out = frames.lost_out(),
                                                        .lost_back = frames.lost_back(),
                                                        .corrupted = frames.corrupted(),
                                                        .truncated = frames.truncated(),
                                                        .late = frames.late()}
                                 : ethercat::LinkFaults{});
      break;
    }
    case DriveTrouble::SILENT_SLAVE:
      slave.SetSilent(active);
      break;
    case DriveTrouble::CUT_CABLE:
      chain_->CutAfter(active ? trouble->slave : chain_->size());
      break;
    case DriveTrouble::DRIVE_FAULT:
      if (active) slave.drive().TriggerFault(ethercat::kErrorOverCurrent);
      break;
    case DriveTrouble::STO:
      slave.drive().SetSto(active);
      break;
    case DriveTrouble::RESTART:
      active ? chain_->PowerOff(trouble->slave) : chain_->PowerOn(trouble->slave);
      break;
    case DriveTrouble::FROZEN_ENCODER:
      slave.drive().FreezeEncoder(active);
      break;
  }
}

void DriveEmulator::Sense(const Tick& tick) {
  for (Trouble& trouble : troubles_) {
    const DriveTrouble& config = trouble.config;
    Apply(&trouble,
          tick.time >= config.from() && !(config.has_until() && tick.time >= config.until()));
  }
  if (drive_feedback_.present()) {
    for (size_t i = 0; i < shafts_.size(); ++i) {
      shafts_[i]->SetCounts(drive_feedback_->position_counts[joint_[i]], period_seconds_);
      shafts_[i]->SetMeasuredCurrent(drive_feedback_->current[joint_[i]]);
    }
    *sensor_feedback_ = *drive_feedback_;
  } else {
    sensor_feedback_.Withhold();
  }
  if (config_.simulated_time() && socket_) {
    Serve();
    if (!ticking_) StartSimulatedTime();
    tick_time_ = first_tick_time_ + tick.index * period_;
  }
  Serve();
}

void DriveEmulator::Act(const Tick& tick) {
  Serve();
  if (ticking_) {
    tick_time_ = first_tick_time_ + (tick.index + 1) * period_ - kBeforeNextTick;
    memory_->AdvanceTo(tick_time_);
  }
  for (size_t i = 0; i < shafts_.size(); ++i) {
    const bool enabled =
        chain_->slave(i).drive().state() == ethercat::DriveState::kOperationEnabled;
    drive_command_->enabled[joint_[i]] = enabled ? 1 : 0;
    drive_command_->current[joint_[i]] = enabled ? shafts_[i]->current() : 0.0;
  }
}

ComponentType DriveEmulatorType() {
  return {"drive_emulator",
          "EtherCAT drives on the simulated robot's motors, with faults",
          [] { return std::make_unique<DriveEmulator>(); },
          {.drive_links = {{.group = "drive_emulator",
                            .drives = true,
                            .link = "drive_emulator.link",
                            .simulated_time = "drive_emulator.simulated_time"}}},
          {Reads<drive_feedback_t>("drive_feedback"), Reads<drive_command_t>("bridge_command"),
           Writes<drive_feedback_t>("sensor_feedback"), Writes<drive_command_t>("drive_command")},
          DriveEmulatorConfig::descriptor(),
          drive_emulator_proto_schema};
}

}  // namespace poise
