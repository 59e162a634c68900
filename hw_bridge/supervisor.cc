#include "hw_bridge/supervisor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "hw_bridge/drive/units.h"

namespace poise {
namespace {

using Status = bridge_status_t;

// s, of the low-pass on the speed of a joint that stops the robot: a blow on an arm throws it
// faster than any motor, and is shorter. A robot that falls for it has lost more.
constexpr double kSpeedTime = 0.1;
// Cycles: a command older than this many is refused as stale; without a younger one it is no longer
// followed.
constexpr int kStaleCycles = 3;
constexpr double kStopRamp = 0.1;  // s over which the damping torque is ramped out in a stop
// s that a motor may carry its peak current: less than servo drives themselves allow (3 s), which
// then never limit.
constexpr double kOverloadTime = 2;
constexpr double kPositionMargin = 0.05;  // rad beyond a joint's limit at which the bridge trips
// s in which the tilt's gyro is corrected by the accelerometer: pushes are shorter.
constexpr double kTiltTime = 1;

constexpr int8_t kReasons[kNumRefusals] = {
    Status::REASON_NONE,          Status::REASON_COMMAND_RUN,
    Status::REASON_COMMAND_SIZE,  Status::REASON_COMMAND_SEQUENCE,
    Status::REASON_COMMAND_STALE, Status::REASON_COMMAND_NOT_FINITE};

}  // namespace

Supervisor::Supervisor(const SupervisorConfig& config)
    : config_(config),
      gate_(static_cast<int>(config.motors.size()), kStaleCycles),
      monitor_(config),
      tilt_(config.upright, kTiltTime),
      speed_gain_(1 - std::exp(-config.period / kSpeedTime)),
      stop_ramp_cycles_(config.Cycles(kStopRamp)),
      first_ramp_cycles_(config.Cycles(config.settings.first_command_ramp())),
      resume_cycles_(config.Cycles(config.resume_time)),
      hold_cycles_(config.settings.on_lost_command() == HwBridgeConfig::HOLD
                       ? config.Cycles(config.settings.hold_time())
                       : 0),
      torque_(config.motors.size(), 0.0),
      impedance_(config.motors.size()),
      current_(config.motors.size(), 0.0),
      applied_(config.motors.size(), 0.0),
      hold_torque_(config.motors.size(), 0.0),
      hold_counts_(config.motors.size(), 0),
      resume_from_(config.motors.size(), 0.0),
      faulted_(config.motors.size(), 0),
      enabled_(config.motors.size(), 0),
      mean_speed_(config.motors.size(), 0.0),
      drive_state_(config.motors.size(), Status::DRIVE_UNKNOWN) {
  for (size_t j = 0; j < config.motors.size(); ++j) {
    const robot::MotorModel& motor = config.motors[j];
    config_.torque_limit[j] =
        std::min(config.torque_limit[j], JointTorque(motor, motor.peak_current));
    thermal_.emplace_back(motor.rated_current, motor.peak_current, kOverloadTime);
  }
}

void Supervisor::Enter(int8_t state, int8_t reason, int joint) {
  state_ = state;
  reason_ = reason;
  reason_joint_ = joint;
}

void Supervisor::Latch(int8_t state, int8_t reason, int joint) {
  if (latched()) {
    if (state == Status::STATE_ESTOP) state_ = state;
    return;
  }
  // Motors that were never given torque are not given any in order to stop.
  const bool at_rest = state_ <= Status::STATE_ENABLING;
  ramp_left_ = at_rest ? 0 : stop_ramp_cycles_;
  Enter(state, reason, joint);
}

bool Supervisor::Read(const drive_feedback_t& feedback, std::span<const DriveReport> reports) {
  const FeedbackMonitor::Problem problem = monitor_.Update(feedback);
  if (problem.reason != Status::REASON_NONE) {
    Latch(Status::STATE_STOPPING, problem.reason, problem.joint);
    return false;
  }
  CheckDrives(feedback, reports);
  CheckMotion(feedback);
  return true;
}

void Supervisor::CheckDrives(const drive_feedback_t& feedback,
                             std::span<const DriveReport> reports) {
  for (size_t j = 0; j < faulted_.size(); ++j) {
    const int32_t status = feedback.drive_status[j];
    const bool reported = j < reports.size();
    drive_state_[j] = reported ? reports[j].state : DriveStateOf(status);
    enabled_[j] = status == drive_feedback_t::DRIVE_ENABLED ? 1 : 0;
    const bool sto = reported && reports[j].sto;
    if (reported && reports[j].stop != Status::REASON_NONE) {
      Latch(Status::STATE_STOPPING, reports[j].stop, static_cast<int>(j));
    }
    const bool known =
        status == drive_feedback_t::DRIVE_DISABLED || status == drive_feedback_t::DRIVE_ENABLED;
    // After the start a drive that is no longer enabled has dropped its torque by itself.
    const bool dropped = enabled_[j] == 0 && active() && state_ != Status::STATE_ENABLING;
    if (known && !dropped && !sto) continue;
    if (fault_grace_ > 0 && state_ == Status::STATE_INIT) continue;
    faulted_[j] = 1;
    if (sto) {
      Latch(Status::STATE_ESTOP, Status::REASON_DRIVE_STO, static_cast<int>(j));
    } else {
      Latch(Status::STATE_STOPPING, Status::REASON_DRIVE_FAULT, static_cast<int>(j));
    }
  }
}

void Supervisor::CheckMotion(const drive_feedback_t& feedback) {
  tilt_.Update(Eigen::Map<const Eigen::Vector3d>(feedback.imu_angular_velocity),
               Eigen::Map<const Eigen::Vector3d>(feedback.imu_acceleration), config_.period);
  for (size_t j = 0; j < faulted_.size(); ++j) {
    if (!active()) {
      mean_speed_[j] = 0;
      continue;
    }
    mean_speed_[j] += speed_gain_ * (std::abs(joint_velocity()[j]) - mean_speed_[j]);
    const auto joint = static_cast<int>(j);
    if (!Inside(j)) Latch(Status::STATE_STOPPING, Status::REASON_JOINT_POSITION, joint);
    if (mean_speed_[j] > TripSpeed(j)) {
      Latch(Status::STATE_STOPPING, Status::REASON_JOINT_VELOCITY, joint);
    }
  }
  if (!active()) return;
  if (tilt_.tilt() > config_.settings.tilt_limit())
    Latch(Status::STATE_STOPPING, Status::REASON_BODY_TILT);
}

void Supervisor::ReadBus(const BusHealth& health) {
  bus_ = health;
  if (health.stop != Status::REASON_NONE) {
    const bool pressed = health.stop == Status::REASON_REMOTE_STOP;
    Latch(pressed ? Status::STATE_ESTOP : Status::STATE_STOPPING, health.stop);
  }
  if (!health.usable) {
    Latch(Status::STATE_STOPPING,
          health.link_lost ? Status::REASON_BUS_LINK : Status::REASON_BUS_INPUTS);
  }
}

void Supervisor::CountLateness(double lateness) {
  lateness_ = lateness;
  const bool late = lateness > config_.overrun_lateness * config_.period;
  late_[static_cast<size_t>(cycles_++ % 100)] = late;
  overruns_ += late ? 1 : 0;
  overruns_in_a_row_ = late ? overruns_in_a_row_ + 1 : 0;
  if (overruns_in_a_row_ >= config_.overruns_in_a_row ||
      static_cast<int>(late_.count()) >= config_.overruns_in_100) {
    Latch(Status::STATE_STOPPING, Status::REASON_CYCLE_OVERRUN);
  }
}

double Supervisor::Position(size_t joint) const {
  return JointPositionOf(config_.motors[joint], monitor_.counts()[joint]);
}

bool Supervisor::Inside(size_t joint) const {
  return Position(joint) >= config_.lower[joint] - kPositionMargin &&
         Position(joint) <= config_.upper[joint] + kPositionMargin;
}

/// Motors at rest where they can be: else the reason says which is not.
bool Supervisor::MayStart() {
  if (!monitor_.known()) {
    Enter(Status::STATE_INIT, Status::REASON_START_POSITION);
    return false;
  }
  for (size_t j = 0; j < torque_.size(); ++j) {
    const bool inside = Inside(j);
    const bool at_rest = std::abs(joint_velocity()[j]) <= config_.start_velocity;
    if (inside && at_rest) continue;
    Enter(Status::STATE_INIT,
          inside ? Status::REASON_START_VELOCITY : Status::REASON_START_POSITION,
          static_cast<int>(j));
    return false;
  }
  return true;
}

void Supervisor::Reset(const joint_command_t* command) {
  if (!std::exchange(reset_requested_, false) || !at_rest()) return;
  const auto none = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return value == 0; });
  };
  const bool asks_torque =
      command != nullptr &&
      !(none(command->torque) && none(command->stiffness) && none(command->damping));
  if (asks_torque) return;
  last_refusal_ = Status::REASON_NO_COMMAND;
  Enter(Status::STATE_INIT, last_refusal_);
  std::fill(faulted_.begin(), faulted_.end(), 0);
  monitor_.Reset();
  bus_ = {};
  late_.reset();
  overruns_in_a_row_ = 0;
  fault_grace_ = config_.settings.enable_cycles();
  reset_ = true;
  ++resets_;
}

void Supervisor::UpdateState(int64_t cycle, const joint_command_t* command) {
  Reset(command);
  if (fault_grace_ > 0) --fault_grace_;
  bool accepted = false;
  if (command != nullptr) {
    const Refusal refusal = gate_.Check(*command, cycle);
    if (refusal != Refusal::kNone) {
      last_refusal_ = kReasons[static_cast<size_t>(refusal)];
    } else if (!latched()) {
      std::copy(command->torque.begin(), command->torque.end(), torque_.begin());
      for (size_t j = 0; j < impedance_.size(); ++j) {
        impedance_[j] = {.stiffness = command->stiffness[j],
                         .damping = command->damping[j],
                         .position = command->position[j],
                         .velocity = command->velocity[j]};
      }
      last_refusal_ = Status::REASON_NO_COMMAND;
      accepted = true;
    }
  }
  if (latched()) return;
  if (state_ == Status::STATE_INIT) {
    if (!accepted && !AwaitsFirst()) {
      Enter(Status::STATE_INIT, last_refusal_);
      return;
    }
    if (fault_grace_ > 0 || !MayStart()) return;
    Enter(Status::STATE_ENABLING, Status::REASON_DRIVE_NOT_ENABLED);
    enabling_cycles_ = start_ramp_ = resume_left_ = 0;
    slew_known_ = false;
  }
  Follow(gate_.Age(cycle));
}

/// The states of a bridge that has accepted a command, which is `age` cycles old.
void Supervisor::Follow(int64_t age) {
  const bool first = AwaitsFirst();
  const bool fresh = !first && age <= kStaleCycles;
  if (state_ == Status::STATE_ENABLING) {
    if (!fresh && !first) {  // nothing to follow: down again
      Enter(Status::STATE_INIT, last_refusal_);
      return;
    }
    const auto waiting = std::find(enabled_.begin(), enabled_.end(), 0);
    if (waiting != enabled_.end()) {
      reason_joint_ = static_cast<int>(waiting - enabled_.begin());
      if (++enabling_cycles_ > config_.settings.enable_cycles()) {
        faulted_[static_cast<size_t>(reason_joint_)] = 1;
        Latch(Status::STATE_STOPPING, Status::REASON_DRIVE_NOT_ENABLED, reason_joint_);
      }
      return;
    }
    std::fill(applied_.begin(), applied_.end(), 0.0);
  } else if (fresh && state_ != Status::STATE_RUNNING) {
    resume_from_ = applied_;
    resume_left_ = resume_cycles_;
  }
  if (first) {
    Hold();
  } else if (!fresh) {
    UpdateLoss(age);
  } else {
    Enter(Status::STATE_RUNNING, Status::REASON_NONE);
  }
}

void Supervisor::Hold() {
  if (state_ != Status::STATE_HOLDING) {
    hold_torque_ = applied_;  // none at the start
    hold_counts_ = monitor_.counts();
  }
  Enter(Status::STATE_HOLDING, last_refusal_);
}

void Supervisor::UpdateLoss(int64_t age) {
  const int64_t damping_after = int64_t{kStaleCycles} + hold_cycles_;
  if (age <= damping_after) {
    Hold();
  } else if (age <= damping_after + config_.stop_after_cycles) {
    Enter(Status::STATE_DAMPING, last_refusal_);
  } else {
    Latch(Status::STATE_STOPPING, last_refusal_);
  }
}

double Supervisor::DampingTorque(size_t joint, double share) const {
  return monitor_.updated() ? -share * config_.thresholds.damping[joint] * joint_velocity()[joint]
                            : 0.0;
}

double Supervisor::WantedTorque(size_t joint) const {
  switch (state_) {
    case Status::STATE_RUNNING: {
      double torque = torque_[joint];
      if (impedance_[joint].active()) {
        int8_t limits = 0;
        torque +=
            FollowedImpedance(joint, &limits).Torque(Position(joint), joint_velocity()[joint]);
      }
      if (start_ramp_ < first_ramp_cycles_) {
        torque *= static_cast<double>(start_ramp_ + 1) / (first_ramp_cycles_ + 1);
      }
      if (resume_left_ > 0) {
        const double old = static_cast<double>(resume_left_) / (resume_cycles_ + 1);
        torque += old * (resume_from_[joint] - torque);
      }
      return torque;
    }
    case Status::STATE_HOLDING: {
      const double error = (static_cast<double>(hold_counts_[joint]) -
                            static_cast<double>(monitor_.counts()[joint])) /
                           CountsPerRadian(config_.motors[joint]);
      const double rate = monitor_.updated() ? joint_velocity()[joint] : 0.0;
      return hold_torque_[joint] + config_.thresholds.hold_stiffness[joint] * error -
             config_.thresholds.hold_damping[joint] * rate;
    }
    case Status::STATE_DAMPING:
      return DampingTorque(joint, 1);
    case Status::STATE_STOPPING:
    case Status::STATE_ESTOP:
      return ramp_left_ > 0 ? DampingTorque(joint, static_cast<double>(ramp_left_) /
                                                       static_cast<double>(stop_ramp_cycles_))
                            : 0.0;
    default:
      return 0;
  }
}

/// Confined to what the robot bears.
Impedance Supervisor::FollowedImpedance(size_t joint, int8_t* limits) const {
  Impedance result = impedance_[joint];
  const double most = config_.velocity_limit[joint];
  bool confined = Confine(0, config_.thresholds.stiffness_limit[joint], &result.stiffness);
  confined |= Confine(0, config_.thresholds.damping_limit[joint], &result.damping);
  confined |= Confine(config_.lower[joint] - kPositionMargin,
                      config_.upper[joint] + kPositionMargin, &result.position);
  confined |= Confine(-most, most, &result.velocity);
  confined |=
      result.LimitTorque(Position(joint), joint_velocity()[joint], config_.torque_limit[joint]);
  if (confined) *limits = static_cast<int8_t>(*limits | Status::LIMIT_IMPEDANCE);
  return result;
}

double Supervisor::FadeIn() const {
  double share = 1;
  if (start_ramp_ < first_ramp_cycles_) {
    share = static_cast<double>(start_ramp_ + 1) / (first_ramp_cycles_ + 1);
  }
  if (resume_left_ > 0) {
    share *= 1 - static_cast<double>(resume_left_) / (resume_cycles_ + 1);
  }
  return share;
}

Impedance Supervisor::WantedImpedance(size_t joint, int8_t* limits) const {
  Impedance result;
  if (!config_.drive_impedance) return result;
  if (state_ == Status::STATE_RUNNING) {
    if (!impedance_[joint].active()) return result;
    result = FollowedImpedance(joint, limits);
    result.Scale(FadeIn());
    return result;
  }
  if (!config_.settings.drives_hold()) return result;
  switch (state_) {
    case Status::STATE_HOLDING:
      result.stiffness = config_.thresholds.hold_stiffness[joint];
      result.damping = config_.thresholds.hold_damping[joint];
      result.position = JointPositionOf(config_.motors[joint], hold_counts_[joint]);
      break;
    case Status::STATE_DAMPING:
      result.damping = config_.thresholds.damping[joint];
      break;
    case Status::STATE_STOPPING:
    case Status::STATE_ESTOP:
      if (ramp_left_ > 0) {
        result.damping = config_.thresholds.damping[joint] * static_cast<double>(ramp_left_) /
                         static_cast<double>(stop_ramp_cycles_);
      }
      break;
    default:
      break;
  }
  // A drive's stiffness and damping give no more torque than its current can take back.
  result.LimitTorque(Position(joint), monitor_.updated() ? joint_velocity()[joint] : 0,
                     config_.torque_limit[joint]);
  return result;
}

void Supervisor::Command(size_t joint, bool powered, drive_command_t* drives, int8_t* limits) {
  const robot::MotorModel& motor = config_.motors[joint];
  double torque = 0;
  Impedance impedance;
  if (powered) {
    torque = Limit(joint, WantedTorque(joint), limits);
    impedance = WantedImpedance(joint, limits);
  }
  applied_[joint] = torque;
  current_[joint] =
      std::clamp(MotorCurrent(motor, torque), -motor.peak_current, motor.peak_current);
  drives->current[joint] = current_[joint];
  if (impedance.active()) {
    // What the drive adds by itself is taken from its torque: together they give what is applied.
    // Holding and damping count a velocity that has been read in this cycle alone.
    const bool read = state_ == Status::STATE_RUNNING || monitor_.updated();
    const double own = impedance.Torque(Position(joint), read ? joint_velocity()[joint] : 0);
    drives->current[joint] = std::clamp(MotorCurrent(motor, torque - own), -2 * motor.peak_current,
                                        2 * motor.peak_current);
  }
  drives->position[joint] = impedance.position;
  drives->velocity[joint] = impedance.velocity;
  drives->stiffness[joint] = impedance.stiffness;
  drives->damping[joint] = impedance.damping;
  drives->enabled[joint] = powered ? 1 : 0;
}

double Supervisor::OrderedTorque(size_t joint, const drive_command_t& command) const {
  if (command.enabled[joint] == 0) return 0;
  const double torque = JointTorque(config_.motors[joint], command.current[joint]);
  const Impedance impedance{command.stiffness[joint], command.damping[joint],
                            command.position[joint], command.velocity[joint]};
  if (!impedance.active()) return torque;
  return torque + impedance.Torque(Position(joint), joint_velocity()[joint]);
}

/// Near a soft limit torque that leads further out fades to nothing at the limit.
double Supervisor::FadePosition(size_t joint, double torque) const {
  const double range = config_.soft_range;
  const double room =
      torque > 0 ? config_.upper[joint] - Position(joint) : Position(joint) - config_.lower[joint];
  return range <= 0 || room >= range ? torque : torque * std::max(0.0, room / range);
}

/// Beyond a joint's velocity limit torque that makes it faster fades to nothing where it trips.
double Supervisor::FadeVelocity(size_t joint, double torque) const {
  const double velocity = joint_velocity()[joint], speed = std::abs(velocity);
  const double limit = config_.velocity_limit[joint], trip = TripSpeed(joint);
  if (torque * velocity <= 0) return torque;
  if (speed >= trip) return 0;
  return speed <= limit ? torque : torque * (1 - (speed - limit) / (trip - limit));
}

double Supervisor::Limit(size_t joint, double wanted, int8_t* limits) const {
  const auto apply = [limits](double before, double after, int8_t bit) {
    if (after != before) *limits = static_cast<int8_t>(*limits | bit);
    return after;
  };
  const bool follows = state_ == Status::STATE_RUNNING || state_ == Status::STATE_HOLDING;
  double torque = wanted;
  if (follows) {
    torque = apply(torque, FadePosition(joint, torque), Status::LIMIT_POSITION);
    torque = apply(torque, FadeVelocity(joint, torque), Status::LIMIT_VELOCITY);
    if (slew_known_) {
      const double step = config_.thresholds.slew_limit * config_.period;
      torque = apply(torque, std::clamp(torque, applied_[joint] - step, applied_[joint] + step),
                     Status::LIMIT_SLEW);
    }
  }
  const double limit = config_.torque_limit[joint];
  torque = apply(torque, std::clamp(torque, -limit, limit), Status::LIMIT_TORQUE);
  const double thermal = JointTorque(config_.motors[joint], thermal_[joint].CurrentLimit());
  return apply(torque, std::clamp(torque, -thermal, thermal), Status::LIMIT_THERMAL);
}

void Supervisor::Cycle(int64_t cycle, const joint_command_t* command, drive_command_t* drives,
                       bridge_status_t* status) {
  UpdateState(cycle, command);
  if (state_ == Status::STATE_STOPPING && ramp_left_ == 0) state_ = Status::STATE_STOPPED;

  const bool enabled = active() || ramp_left_ > 0;
  const bool follows = state_ == Status::STATE_RUNNING || state_ == Status::STATE_HOLDING;
  for (size_t j = 0; j < torque_.size(); ++j) {
    int8_t limits = 0;
    Command(j, enabled && faulted_[j] == 0, drives, &limits);
    thermal_[j].Advance(current_[j], config_.period);
    status->applied_torque[j] = applied_[j];
    status->saturated[j] = follows ? limits : int8_t{0};
    saturations_ += status->saturated[j] != 0 ? 1 : 0;
    status->thermal_load[j] = thermal_[j].heat();
    status->drive_state[j] = drive_state_[j];
  }
  slew_known_ = follows;
  if (ramp_left_ > 0) --ramp_left_;
  if (state_ == Status::STATE_RUNNING) {
    start_ramp_ = std::min(start_ramp_ + 1, first_ramp_cycles_);
    if (resume_left_ > 0) --resume_left_;
  }
  monitor_.EndCycle(current_, drives->enabled);
  FillStatus(cycle, status);
}

void Supervisor::FillStatus(int64_t cycle, bridge_status_t* status) const {
  status->state = state_;
  status->reason = reason_;
  status->reason_joint = reason_joint_;
  status->command_age = gate_.any_accepted()
                            ? static_cast<int32_t>(std::min<int64_t>(
                                  gate_.Age(cycle), std::numeric_limits<int32_t>::max()))
                            : 0;
  status->refused_not_finite = gate_.refused(Refusal::kNotFinite);
  status->refused_stale = gate_.refused(Refusal::kStale);
  status->refused_sequence = gate_.refused(Refusal::kSequence);
  status->refused_size = gate_.refused(Refusal::kSize);
  status->refused_run = gate_.refused(Refusal::kRun);
  status->saturations = saturations_;
  status->resets = resets_;
  status->bus_usable = bus_.usable ? 1 : 0;
  status->al_status = bus_.al_status;
  status->frames_sent = bus_.frames_sent;
  status->frames_lost = bus_.frames_lost;
  status->working_counter_errors = bus_.working_counter_errors;
  status->lateness = lateness_;
  status->overruns = overruns_;
}

}  // namespace poise
