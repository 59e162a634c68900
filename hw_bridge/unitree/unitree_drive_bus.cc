#include "hw_bridge/unitree/unitree_drive_bus.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "hw_bridge/drive/units.h"
#include "hw_bridge/unitree/crc.h"
#include "hw_bridge/unitree/dds_link.h"
#include "hw_bridge/unitree/motor_slots.h"
#include "hw_bridge/unitree/remote.h"
#include "poise/message_traits.hpp"

namespace poise::unitree {
namespace {

constexpr int64_t kMillisecond = 1'000'000, kSecond = 1'000'000'000;  // ns
constexpr double kMostPosition = 1e3;  // rad, beyond which a reading is none
// ns a cycle. Cycles creep towards the robot's until they wait for its states, then fall back by
// what they have waited and a little: a state is then never older than some ten microseconds.
constexpr int64_t kCreep = 1000, kFallBack = 20'000, kMostFallBack = 100'000;

const UnitreeBusConfig& Checked(const UnitreeBusConfig& config, double period) {
  if (!config.simulated_time() && config.input_wait() * 1e-6 >= period) {
    throw UnitreeError("input_wait must be less than a cycle");
  }
  return config;
}

std::vector<std::string> StopButtons(const UnitreeBusConfig& config) {
  if (config.stop_button().empty()) return {"select", "B"};
  return {config.stop_button().begin(), config.stop_button().end()};
}

/// 0 for what is no number.
float Finite(double value) {
  const auto result = static_cast<float>(value);
  return std::isfinite(result) ? result : 0.0F;
}

}  // namespace

UnitreeDriveBus::UnitreeDriveBus(RobotLinkOpener open_link, const UnitreeBusConfig& config,
                                 const robot::RobotModel& model, double period)
    : open_link_(std::move(open_link)),
      config_(Checked(config, period)),
      period_(std::llround(period * 1e9)),
      stop_buttons_(ButtonsOf(StopButtons(config))) {
  const std::vector<size_t> slots = MotorSlots(model, config.layout(), config.slot());
  for (size_t j = 0; j < slots.size(); ++j) {
    const robot::MotorModel& motor = model.motors()[j];
    if (!(motor.torque_per_ampere() > 0) || motor.encoder_counts <= 0) {
      throw UnitreeError(
          "joint \"{}\": its motor needs a torque_constant and encoder_counts above 0 in the "
          "robot's description",
          model.joints()[j].name);
    }
    motors_.push_back({slots[j], motor});
  }
  reports_.resize(motors_.size());
  const int32_t counts[] = {model.num_joints(), static_cast<int32_t>(model.feet().size())};
  MessageTraits<drive_feedback_t>::Resize(feedback_, counts);
  std::fill(feedback_.foot_sensor.begin(), feedback_.foot_sensor.end(),
            drive_feedback_t::SENSOR_ABSENT);
}

void UnitreeDriveBus::Start() {
  link_ = open_link_(config_.link());
  const auto limit = static_cast<int64_t>(config_.start_timeout() * static_cast<double>(kSecond));
  const int64_t deadline = link_->Now() + limit;
  if (!ReceiveState(deadline)) {
    const DdsLink& link = config_.link();
    throw UnitreeError(
        damaged_ > 0
            ? fmt::format("{} speaks another language: all its states have a wrong check sum",
                          kStateTopic)
            : fmt::format(
                  "no {} on DDS domain {}, interface {}, in {} s; is the robot on, the cable "
                  "in, and the interface's address in the robot's network (192.168.123.x)?",
                  kStateTopic, link.domain(), link.interface(), config_.start_timeout()));
  }
  Release(deadline);
  ours_ = true;
  mode_machine_ = state_.mode_machine;
  health_ = {};
  judge_.Reset(&health_);
}

void UnitreeDriveBus::Release(int64_t deadline) {
  while (true) {
    const std::optional<std::string> mode = link_->ActiveMode(deadline);
    if (!mode) {
      throw UnitreeError(
          "the robot's motion switcher does not answer, so its maker's controller may still move "
          "it; is the robot's software up to date, and start_timeout long enough?");
    }
    if (mode->empty()) return;
    if (!config_.release()) {
      throw UnitreeError(
          "the maker's controller \"{}\" still moves the robot; let it hang and release it with "
          "the remote, or set release: true",
          *mode);
    }
    if (!link_->Release(deadline)) {
      throw UnitreeError("the robot does not let go of the maker's controller \"{}\"", *mode);
    }
  }
}

std::string UnitreeDriveBus::Stop() {
  if (ours_) SendMotors(nullptr);  // else the maker's controller may move the robot
  return {};
}

bool UnitreeDriveBus::ReceiveState(int64_t deadline, bool in_run) {
  bool taken = false;
  // All states that have come are read: another's damaged state does not hide a good one.
  for (int i = 0; i < kMostStates && link_->Receive(&incoming_, taken ? 0 : deadline); ++i) {
    if (incoming_.crc != CrcOf(incoming_)) {
      ++damaged_;
      continue;
    }
    // A state again, or one that others have overtaken, is none.
    if (known_ && static_cast<int32_t>(incoming_.tick - last_tick_) <= 0) continue;
    known_ = true;
    last_tick_ = incoming_.tick;
    // An emulated robot numbers the states of the run's cycles; those before are none of it.
    if (in_run && config_.simulated_time() && incoming_.reserve[0] == 0) continue;
    state_ = incoming_;
    taken = true;
  }
  return taken;
}

void UnitreeDriveBus::TakeMotors() {
  for (size_t j = 0; j < motors_.size(); ++j) {
    const Motor& motor = motors_[j];
    const MotorState& state = state_.motor_state[motor.slot];
    const auto position = static_cast<double>(state.q);
    const bool readable = std::abs(position) <= kMostPosition;
    if (readable) feedback_.position_counts[j] = EncoderCounts(motor.model, position);
    feedback_.velocity[j] = static_cast<double>(state.dq);
    // What is no position is no reading: the supervisor stops at a current that is no number.
    feedback_.current[j] = readable ? MotorCurrent(motor.model, static_cast<double>(state.tau_est))
                                    : std::numeric_limits<double>::quiet_NaN();
    int32_t& status = feedback_.drive_status[j];
    status = drive_feedback_t::DRIVE_DISABLED;
    if (state.mode == kMotorEnabled) status = drive_feedback_t::DRIVE_ENABLED;
    if (state.motorstate != 0) status = drive_feedback_t::DRIVE_FAULT;
    DriveReport& report = reports_[j];
    report.state = DriveStateOf(status);
    const int hottest = std::max<int>(state.temperature[0], state.temperature[1]);
    const auto voltage = static_cast<double>(state.vol);
    report.stop = bridge_status_t::REASON_NONE;
    if (hottest > config_.temperature_limit()) {
      report.stop = bridge_status_t::REASON_MOTOR_TEMPERATURE;
    } else if (voltage > 0 && voltage < config_.least_voltage()) {
      report.stop = bridge_status_t::REASON_SUPPLY_VOLTAGE;
    }
  }
}

void UnitreeDriveBus::TakeImu() {
  const bool torso = config_.imu() == UnitreeBusConfig::TORSO;
  if (torso) torso_missed_ = link_->ReceiveTorsoImu(&torso_imu_) ? 0 : torso_missed_ + 1;
  const ImuState& imu = torso ? torso_imu_ : state_.imu_state;
  // An old reading is none: the supervisor stops at what is no number.
  const bool old = torso && torso_missed_ >= CycleJudge::kMostInARow;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  for (size_t i = 0; i < 3; ++i) {
    feedback_.imu_angular_velocity[i] = old ? kNone : static_cast<double>(imu.gyroscope[i]);
    feedback_.imu_acceleration[i] = old ? kNone : static_cast<double>(imu.accelerometer[i]);
  }
  std::copy(std::begin(imu.quaternion), std::end(imu.quaternion), feedback_.imu_orientation);
}

void UnitreeDriveBus::TakeState() {
  TakeMotors();
  TakeImu();
  if ((Buttons(state_.wireless_remote) & stop_buttons_) != 0) {
    health_.stop = bridge_status_t::REASON_REMOTE_STOP;
  } else if (state_.mode_machine != mode_machine_) {
    health_.stop = bridge_status_t::REASON_ROBOT_MODE;
  } else {
    health_.stop = bridge_status_t::REASON_NONE;
  }
}

const drive_feedback_t* UnitreeDriveBus::Receive() {
  cycle_start_ = link_->Now();
  const int64_t damaged_before = damaged_;
  int64_t wait = config_.simulated_time() ? int64_t{config_.state_timeout()} * kMillisecond
                                          : int64_t{config_.input_wait()} * 1000;
  if (!health_.usable) wait = 0;  // given up: nobody waits for it
  fresh_ = early_ || ReceiveState(cycle_start_ + wait, true);
  early_ = false;
  judge_.Count(fresh_, !fresh_ && damaged_ == damaged_before, &health_);
  health_.frames_lost += fresh_ ? 0 : 1;
  health_.working_counter_errors = damaged_;
  cycle_correction_ = 0;
  if (config_.follow_robot() && !config_.simulated_time()) {
    const int64_t waited = link_->Now() - cycle_start_;
    const bool had_to_wait = waited > kFallBack;
    cycle_correction_ = had_to_wait ? std::min(waited, kMostFallBack) + kFallBack : -kCreep;
  }
  if (!fresh_) return nullptr;
  TakeState();
  return &feedback_;
}

MotorCmd UnitreeDriveBus::CommandOf(size_t joint, const drive_command_t& command) {
  const Motor& motor = motors_[joint];
  MotorCmd result{};
  result.mode = kMotorEnabled;
  const double torque = JointTorque(motor.model, command.current[joint]);
  // Stiffness and damping may take from the torque as much as they add.
  const double limit = 2 * JointTorque(motor.model, motor.model.peak_current);
  const bool finite = std::isfinite(torque + command.position[joint] + command.velocity[joint] +
                                    command.stiffness[joint] + command.damping[joint]);
  if (!finite) {
    ++health_.refused_currents;
    result.kd = Finite(config_.rest_damping());
    return result;
  }
  result.tau = Finite(std::clamp(torque, -limit, limit));
  result.q = Finite(command.position[joint]);
  result.dq = Finite(command.velocity[joint]);
  result.kp = Finite(std::max(0.0, command.stiffness[joint]));
  result.kd = Finite(std::max(0.0, command.damping[joint]));
  return result;
}

void UnitreeDriveBus::SendMotors(const drive_command_t* command, bool enable) {
  command_ = {};
  command_.mode_machine = state_.mode_machine;
  const bool sized =
      command != nullptr && command->current.size() == motors_.size() &&
      command->enabled.size() == motors_.size() && command->position.size() == motors_.size() &&
      command->velocity.size() == motors_.size() && command->stiffness.size() == motors_.size() &&
      command->damping.size() == motors_.size();
  for (size_t j = 0; j < motors_.size(); ++j) {
    MotorCmd& motor = command_.motor_cmd[motors_[j].slot];
    if (feedback_.drive_status[j] == drive_feedback_t::DRIVE_FAULT) continue;  // free
    if (sized && command->enabled[j] != 0) {
      motor = CommandOf(j, *command);
    } else if (enable || config_.rest_damping() > 0) {
      motor.mode = kMotorEnabled;
      motor.kd = Finite(config_.rest_damping());
    }
  }
  // Says which state it answers where both ends wait for each other; a robot's are zero.
  if (config_.simulated_time()) command_.reserve[0] = state_.reserve[0];
  command_.crc = CrcOf(command_);
  // In lockstep the run's cycles alone count: how often both ends idle before depends on the
  // machine.
  const bool counts = command != nullptr || !config_.simulated_time();
  health_.frames_sent += counts ? 1 : 0;
  if (!link_->Send(command_) && counts) ++health_.frames_lost;
}

void UnitreeDriveBus::Idle(bool enable) {
  cycle_start_ = link_->Now();
  if (early_) return;
  fresh_ = ReceiveState(cycle_start_);
  if (fresh_) TakeState();
  // In lockstep the robot may begin the run first: its first cycle's state is answered in the run.
  early_ = fresh_ && config_.simulated_time() && health_.cycles == 0 && state_.reserve[0] != 0;
  if (!early_) SendMotors(nullptr, enable);
}

void UnitreeDriveBus::AwaitNextCycle() {
  const int64_t left = cycle_start_ + period_ - link_->Now();
  if (left > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(left));
}

void UnitreeDriveBus::RequestFaultReset() {
  judge_.Reset(&health_);
  mode_machine_ = state_.mode_machine;
}

void UnitreeDriveBus::Diagnose(bus_status_t* status) const {
  for (size_t j = 0; j < motors_.size(); ++j) {
    const MotorState& state = state_.motor_state[motors_[j].slot];
    status->online[j] = fresh_ ? 1 : 0;
    status->error_code[j] = static_cast<int32_t>(state.motorstate);
    status->receive_errors[j] =
        static_cast<int32_t>(std::min<int64_t>(damaged_, std::numeric_limits<int32_t>::max()));
    status->temperature[j] = std::max<int>(state.temperature[0], state.temperature[1]);
    status->voltage[j] = std::isfinite(state.vol) ? static_cast<double>(state.vol) : 0.0;
  }
}

DriveBusType UnitreeBusType(RobotLinkOpener open_link) {
  if (!open_link) {
    open_link = [](const DdsLink& link) { return std::make_unique<DdsRobotLink>(link); };
  }
  const auto make = [open_link = std::move(open_link)](const UnitreeBusConfig& config,
                                                       const robot::RobotModel& model,
                                                       double period) {
    return std::make_unique<UnitreeDriveBus>(open_link, config, model, period);
  };
  return {.name = "unitree",
          .config = UnitreeBusConfig::descriptor(),
          .make = MakerOf<UnitreeBusConfig>(make),
          .all_sensors = "follow_robot",
          .link = {.simulated_time = "simulated_time", .tag = "link.tag"}};
}

}  // namespace poise::unitree
