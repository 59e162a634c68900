#include "hw_bridge/ethercat/ethercat_drive_bus.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "components/framework/configuration/config_error.h"
#include "components/framework/say_error.h"
#include "hw_bridge/ethercat/links/socket_link.h"
#include "poise/message_traits.hpp"

namespace poise::ethercat {
namespace {

EthercatBusConfig Completed(EthercatBusConfig config, const robot::RobotModel& model) {
  if (!config.simulated_time() && int64_t{config.input_wait()} * 1000 >= config.master().cycle()) {
    throw EthercatError("EtherCAT configuration: input_wait must be less than a cycle");
  }
  *config.mutable_master() = CompleteMasterConfig(config.master(), model);
  return config;
}

static_assert(static_cast<int>(DriveState::kUnknown) == bridge_status_t::DRIVE_UNKNOWN &&
              static_cast<int>(DriveState::kSwitchOnDisabled) ==
                  bridge_status_t::DRIVE_SWITCH_ON_DISABLED &&
              static_cast<int>(DriveState::kOperationEnabled) == bridge_status_t::DRIVE_ENABLED &&
              static_cast<int>(DriveState::kFault) == bridge_status_t::DRIVE_FAULT);

}  // namespace

MasterConfig CompleteMasterConfig(MasterConfig config, const robot::RobotModel& model) {
  if (config.drive().empty()) {
    for (const robot::Joint& joint : model.joints()) config.add_drive()->set_joint(joint.name);
  }
  std::vector<bool> has_drive(static_cast<size_t>(model.num_joints()), false);
  for (DriveConfig& drive : *config.mutable_drive()) {
    const int joint = model.FindJoint(drive.joint());
    if (joint < 0) {
      throw EthercatError(
          "EtherCAT configuration: drive \"{}\": robot \"{}\" has no joint of that name",
          drive.joint(), model.name());
    }
    if (has_drive[static_cast<size_t>(joint)]) {
      throw EthercatError("EtherCAT configuration: joint \"{}\" has two drives", drive.joint());
    }
    has_drive[static_cast<size_t>(joint)] = true;

    const robot::MotorModel& motor = model.motors()[static_cast<size_t>(joint)];
    const double current = motor.rated_current * 1e3;                         // mA
    const double torque = motor.torque_constant * motor.rated_current * 1e3;  // mN·m
    if (!(current >= 1) || !(torque >= 1)) {
      throw EthercatError(
          "joint \"{}\": its motor needs a rated_current of at least 1 mA, and a torque_constant "
          "that makes at least 1 mN·m of it, in the robot's description",
          drive.joint());
    }
    if (!drive.has_rated_current()) {
      drive.set_rated_current(static_cast<uint32_t>(std::lround(current)));
    }
    if (!drive.has_rated_torque()) {
      drive.set_rated_torque(static_cast<uint32_t>(std::lround(torque)));
    }
    if (!drive.has_max_torque()) {
      drive.set_max_torque(DriveScale(motor, drive).LimitPerMille(motor.peak_current));
    }
    if (std::abs(drive.rated_current() - current) > 0.01 * current ||
        std::abs(drive.rated_torque() - torque) > 0.01 * torque) {
      throw EthercatError(
          "EtherCAT configuration: drive \"{}\": rated for {} mN·m at {} mA, the robot's motor for "
          "{:.0f} mN·m at {:.0f} mA",
          drive.joint(), drive.rated_torque(), drive.rated_current(), torque, current);
    }
  }
  for (int j = 0; j < model.num_joints(); ++j) {
    if (!has_drive[static_cast<size_t>(j)]) {
      throw EthercatError("EtherCAT configuration: joint \"{}\" has no drive",
                          model.joints()[static_cast<size_t>(j)].name);
    }
  }
  return config;
}

EthercatDriveBus::EthercatDriveBus(LinkOpener open_link, const EthercatBusConfig& config,
                                   const robot::RobotModel& model)
    : open_link_(std::move(open_link)),
      config_(Completed(config, model)),
      master_(nullptr, config_.master()),
      steering_(config.master().cycle()) {
  const auto& drives = config_.master().drive();
  for (int j = 0; j < model.num_joints(); ++j) {
    const robot::MotorModel& motor = model.motors()[static_cast<size_t>(j)];
    const std::string& name = model.joints()[static_cast<size_t>(j)].name;
    const auto place = std::ranges::find(drives, name, &DriveConfig::joint);
    const DriveScale scale(motor, *place);
    drives_.push_back({.slave = static_cast<size_t>(place - drives.begin()),
                       .scale = scale,
                       .max_torque = scale.LimitPerMille(motor.peak_current)});
  }
  const int32_t counts[] = {model.num_joints(), static_cast<int32_t>(model.feet().size())};
  MessageTraits<drive_feedback_t>::Resize(feedback_, counts);
  MessageTraits<drive_command_t>::Resize(idle_, std::span(counts).first(1));
  reports_.resize(drives_.size());
  FindReadings(model.feet().size());
}

double* EthercatDriveBus::Target(const SensorReading& reading) {
  const size_t axis = reading.axis();
  switch (reading.quantity()) {
    case SensorReading::ANGULAR_VELOCITY:
      return &feedback_.imu_angular_velocity[axis];
    case SensorReading::ACCELERATION:
      return &feedback_.imu_acceleration[axis];
    case SensorReading::FORCE:
      return &feedback_.foot_wrench[reading.foot()].force[axis];
    case SensorReading::MOMENT:
      break;
  }
  return &feedback_.foot_wrench[reading.foot()].moment[axis];
}

void EthercatDriveBus::FindReadings(size_t num_feet) {
  const MasterConfig& config = config_.master();
  for (int i = 0; i < config.other_size(); ++i) {
    const auto slave = static_cast<size_t>(config.drive_size() + i);
    for (const SensorReading& reading : config.other(i).reading()) {
      const auto place = master_.image().FindInput(slave, static_cast<uint16_t>(reading.index()),
                                                   static_cast<uint8_t>(reading.subindex()));
      const bool of_foot =
          reading.quantity() == SensorReading::FORCE || reading.quantity() == SensorReading::MOMENT;
      if (!place || (of_foot && reading.foot() >= num_feet) ||
          (reading.is_float() && place->bits != 32)) {
        throw EthercatError(
            "EtherCAT configuration: other \"{}\": reading of {:04X}:{:02X}: give an object of its "
            "tx, and a foot of the robot; is_float takes 32 bits",
            config.other(i).name(), reading.index(), reading.subindex());
      }
      (of_foot ? sensors_.feet : sensors_.imu) = true;
      readings_.push_back({*place, reading});
    }
  }
}

void EthercatDriveBus::Diagnose(bus_status_t* status) const {
  const Attendant* attendant = master_.attendant();
  for (size_t i = 0; i < master_.num_slaves(); ++i) {
    static const SlaveDiagnosis kNone;  // of a chain that nobody looks after
    const SlaveDiagnosis& slave = attendant != nullptr ? attendant->diagnosis(i) : kNone;
    status->online[i] = slave.online ? 1 : 0;
    const SlaveDiagnosis::Al al = slave.al;
    status->al_status[i] = al.status;
    status->al_code[i] = al.code;
    status->error_code[i] = slave.error_code;
    status->emergency[i] = slave.emergency;
    status->emergencies[i] = slave.emergencies;
    status->clock_difference[i] = slave.clock_difference;
    status->receive_errors[i] = slave.receive_errors;
    status->lost_links[i] = slave.lost_links;
    status->recoveries[i] = slave.recoveries;
  }
}

void EthercatDriveBus::Start() {
  link_ = open_link_(config_.link());
  if (config_.has_capture()) {
    using Carrier = CaptureLink::Carrier;
    auto capture = std::make_unique<CaptureLink>(
        std::move(link_), config_.capture(),
        config_.link().has_udp() ? Carrier::kUdp : Carrier::kEthernet);
    capture_ = capture.get();
    link_ = std::move(capture);
  }
  master_.set_link(link_.get());
  const int64_t deadline =
      link_->Now() + static_cast<int64_t>(config_.start_timeout() * static_cast<double>(kSecond));
  while (!master_.CountSlaves() && link_->Now() < deadline) {
  }
  master_.Start();
  if (config_.attend()) {
    master_.Attend(config_.simulated_time(),
                   [](const std::string& line) { SayError("EtherCAT: " + line); });
  }
}

std::string EthercatDriveBus::Stop() {
  if (!link_) return {};
  released_ = sent_ = false;
  std::string problem;
  if (!master_.Stop()) {
    problem =
        "not all slaves of the EtherCAT bus have reached INIT; their watchdogs take the torque";
  }
  try {
    if (capture_ != nullptr) capture_->Close();
  } catch (const EthercatError& error) {
    problem += (problem.empty() ? "" : "; ") + std::string(error.what());
  }
  return problem;
}

CycleResult EthercatDriveBus::ReceiveFrames() {
  cycle_start_ = link_->Now();
  if (sent_ && !answer_) master_.Receive(cycle_start_);
  sent_ = false;
  answer_.reset();
  const int64_t wait = config_.simulated_time()
                           ? int64_t{config_.master().frame_timeout()} * kMillisecond
                           : int64_t{config_.input_wait()} * 1000;
  if (!master_.Send(Exchange::kRead)) return {};
  return master_.Receive(link_->Now() + wait);
}

int32_t EthercatDriveBus::Status(const Drive& drive, uint16_t statusword) const {
  const bool enabled = drive.state == DriveState::kOperationEnabled;
  const bool stopped = (statusword & kStatusVoltageEnabled) == 0;  // STO
  const bool fault = drive.state == DriveState::kFault ||
                     drive.state == DriveState::kFaultReactionActive ||
                     drive.state == DriveState::kUnknown ||
                     health_.al_status != static_cast<uint8_t>(AlState::kOp) ||
                     (stopped && drive.commanded) || (enabled && !drive.in_mode);
  if (fault) return drive_feedback_t::DRIVE_FAULT;
  if (enabled) return drive_feedback_t::DRIVE_ENABLED;
  return drive_feedback_t::DRIVE_DISABLED;
}

void EthercatDriveBus::TakeInputs() {
  for (size_t j = 0; j < drives_.size(); ++j) {
    Drive& drive = drives_[j];
    const DriveInputs& inputs = master_.inputs(drive.slave);
    drive.state = DecodeState(inputs.statusword);
    drive.in_mode = inputs.mode == kModeCyclicTorque;
    feedback_.position_counts[j] = drive.scale.JointCounts(drive.counter.Update(inputs.position));
    feedback_.current[j] = drive.scale.Current(inputs.torque);
    feedback_.drive_status[j] = Status(drive, inputs.statusword);
    reports_[j] = {.state = static_cast<int8_t>(drive.state),
                   .sto = drive.state != DriveState::kUnknown &&
                          (inputs.statusword & kStatusVoltageEnabled) == 0};
  }
  for (const Reading& reading : readings_) {
    const uint64_t raw = master_.input(reading.place);
    double value = 0;
    if (reading.config.is_float()) {
      value = std::bit_cast<float>(static_cast<uint32_t>(raw));
    } else {
      const int unused = 64 - reading.place.bits;  // the sign, to the top and back
      value = static_cast<double>(static_cast<int64_t>(raw << unused) >> unused);
    }
    *Target(reading.config) = value * reading.config.scale() + reading.config.offset();
  }
}

const drive_feedback_t* EthercatDriveBus::Receive() {
  if (health_.cycles == 0) {
    before_ = master_.counts();
    short_counters_before_ = master_.short_working_counters();
  }
  const CycleResult result = ReceiveFrames();
  if (result.returned) health_.al_status = result.al_status;
  judge_.Count(result.complete, !result.returned, &health_);
  const FrameCounts& counts = master_.counts();
  health_.frames_sent = counts.sent - before_.sent;
  health_.frames_lost = counts.lost - before_.lost;
  health_.working_counter_errors = master_.short_working_counters() - short_counters_before_;
  cycle_correction_ = result.system_time ? steering_.Update(*result.system_time) : 0;
  if (!result.complete) return nullptr;
  TakeInputs();
  return &feedback_;
}

void EthercatDriveBus::Idle(bool enable) {
  const CycleResult result = ReceiveFrames();
  if (result.returned) health_.al_status = result.al_status;
  if (result.complete) TakeInputs();
  std::fill(idle_.enabled.begin(), idle_.enabled.end(), static_cast<int8_t>(enable ? 1 : 0));
  Send(idle_);
}

void EthercatDriveBus::Send(const drive_command_t& command) {
  const bool sized =
      command.current.size() == drives_.size() && command.enabled.size() == drives_.size();
  bool any = false, all_enabled = true;
  for (size_t j = 0; j < drives_.size(); ++j) {
    Drive& drive = drives_[j];
    drive.commanded = sized && command.enabled[j] != 0;
    any = any || drive.commanded;
    all_enabled = all_enabled && (!drive.commanded ||
                                  feedback_.drive_status[j] == drive_feedback_t::DRIVE_ENABLED);
  }
  // Once all have been enabled together, one that fails does not take the others' torque: what
  // becomes of them is the supervisor's decision.
  released_ = any && (released_ || all_enabled);
  for (size_t j = 0; j < drives_.size(); ++j) {
    Drive& drive = drives_[j];
    DriveOutputs outputs;  // of this mode: the way up begins once the drive shows it
    const bool enable = drive.commanded && drive.in_mode;
    outputs.controlword = drive.control.Controlword(
        drive.state, enable ? DriveGoal::kEnabled : DriveGoal::kQuickStop);
    if (released_ && drive.commanded) {
      const double current = command.current[j];
      const bool finite = std::isfinite(current);
      health_.refused_currents += finite ? 0 : 1;
      const auto limit = static_cast<int>(drive.max_torque);
      const int torque = finite ? drive.scale.TorquePerMille(current) : 0;
      outputs.target_torque = static_cast<int16_t>(std::clamp(torque, -limit, limit));
      outputs.max_torque = drive.max_torque;
    }
    master_.set_outputs(drive.slave, outputs);
  }
  sent_ = master_.Send(Exchange::kWrite);
  // Simulated time goes on only once the drives have what was sent.
  if (sent_ && config_.simulated_time()) {
    answer_ =
        master_.Receive(link_->Now() + int64_t{config_.master().frame_timeout()} * kMillisecond);
  }
}

void EthercatDriveBus::AwaitNextCycle() {
  const int64_t next = cycle_start_ + config_.master().cycle();
  if (sent_ && !answer_) answer_ = master_.Receive(next);
  std::array<uint8_t, 1> ignored;
  while (link_->Receive(ignored, next) != 0) {
  }
}

void EthercatDriveBus::RequestFaultReset() {
  for (Drive& drive : drives_) {
    if (!drive.commanded) drive.control.RequestFaultReset();
  }
  judge_.Reset(&health_);
}

DriveBusType EthercatBusType(LinkOpener open_link) {
  if (!open_link) {
    open_link = [](const LinkConfig& link) { return OpenLink(link, SocketLink::Side::kMaster); };
  }
  const auto make = [open_link = std::move(open_link)](
                        EthercatBusConfig config, const robot::RobotModel& model, double period) {
    const auto cycle = static_cast<uint32_t>(std::llround(period * 1e9));
    if (config.master().has_cycle() && config.master().cycle() != cycle) {
      throw ConfigError("master.cycle",
                        fmt::format("must be the run's period, {} ns, or be left out", cycle));
    }
    config.mutable_master()->set_cycle(cycle);
    return std::make_unique<EthercatDriveBus>(open_link, config, model);
  };
  return {.name = "ethercat",
          .config = EthercatBusConfig::descriptor(),
          .make = MakerOf<EthercatBusConfig>(make),
          .link = {.link = "link",
                   .simulated_time = "simulated_time",
                   .profile = "master.profile",
                   .capture = "capture"}};
}

}  // namespace poise::ethercat
