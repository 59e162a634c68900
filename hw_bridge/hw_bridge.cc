#include "hw_bridge/hw_bridge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "components/framework/optional_ports.h"
#include "components/messages/robot_resource.h"
#include "hw_bridge/drive/units.h"
#include "hw_bridge/ethercat/ethercat_drive_bus.h"
#include "hw_bridge/ethercat/links/socket_link.h"
#include "hw_bridge/hw_bridge_type.h"
#include "hw_bridge/robot_thresholds.h"
#include "hw_bridge/simulated_drive_bus.h"
#include "hw_bridge/unitree/dds_link.h"
#include "hw_bridge/unitree/unitree_drive_bus.h"

namespace poise {

std::string_view hw_bridge_proto_schema();  // generated
namespace {

// s: by then a torque beyond friction has moved a joint by a count, with the readings' delay and a
// rotor of 0.5 kg·m² on the coarsest encoder at the joint.
constexpr double kResponseTime = 0.02;

void Require(bool condition, const char* field, const char* problem) {
  if (!condition) throw ConfigError(field, problem);
}

void Validate(const HwBridgeConfig& config) {
  Require(!(config.has_ethercat() && config.has_unitree()), "unitree",
          "must be left out with ethercat: a robot has one bus");
  Require(config.command_deadline() >= config.sense_deadline(), "command_deadline",
          "must be sense_deadline or more");
}

/// Cycles of a time, at least the time.
int Cycles(double seconds, double period) {
  return static_cast<int>(std::ceil(seconds / period - 1e-9));
}

/// `value` for every joint where it is given.
std::vector<double> ByJoint(bool given, double value, const std::vector<double>& derived) {
  return given ? std::vector<double>(derived.size(), value) : derived;
}

FeedbackMonitorConfig MakeMonitorConfig(const HwBridgeConfig& config,
                                        const robot::RobotModel& model,
                                        const RobotThresholds& derived, double period) {
  FeedbackMonitorConfig result;
  for (const robot::Joint& joint : model.joints()) {
    result.velocity_limit.push_back(joint.velocity_limit);
  }
  result.velocity_cutoff = config.velocity_cutoff();
  result.num_feet = static_cast<int>(model.feet().size());
  result.period = period;
  result.frozen_cycles = std::max(1, Cycles(config.frozen_time(), period));
  result.frozen_torque =
      config.has_frozen_torque() ? config.frozen_torque() : derived.frozen_torque;
  result.response_cycles = std::max(1, Cycles(kResponseTime, period));
  result.torque_error_cycles = config.torque_error_cycles();
  // What was commanded a cycle ago is read as old as the readings are, and settles in a cycle more.
  const double delay = model.drive_train().sensor_delay;
  result.current_cycles = delay > 0 ? 2 + Cycles(delay, period) : 1;
  result.torque_error = config.has_torque_error() ? config.torque_error() : derived.torque_error;
  return result;
}

SupervisorConfig MakeSupervisorConfig(const HwBridgeConfig& config, const robot::RobotModel& model,
                                      double period) {
  SupervisorConfig result;
  result.motors = model.motors();
  for (int j = 0; j < model.num_joints(); ++j) {
    const robot::Joint& joint = model.joints()[static_cast<size_t>(j)];
    const robot::MotorModel& motor = model.motors()[static_cast<size_t>(j)];
    const double limit = std::min(
        joint.effort, config.torque_limit_share() * JointTorque(motor, motor.peak_current));
    if (!(limit > 0) || !std::isfinite(limit)) {
      throw ConfigError(
          fmt::format("joint \"{}\": its torque limit is {} N·m; give the URDF's joint an effort "
                      "and its motor a "
                      "torque_constant and a peak_current above 0",
                      joint.name, limit));
    }
    if (motor.encoder_counts <= 0) {
      throw ConfigError(fmt::format(
          "joint \"{}\": its motor has no encoder_counts; give counts per motor revolution above 0",
          joint.name));
    }
    result.torque_limit.push_back(limit);
    result.lower.push_back(joint.lower);
    result.upper.push_back(joint.upper);
  }
  const RobotThresholds derived = DeriveThresholds(model);
  result.monitor = MakeMonitorConfig(config, model, derived, period);
  result.soft_range = config.soft_range();
  result.position_margin = config.position_margin();
  result.velocity_trip = config.velocity_trip();
  result.tilt_limit = config.tilt_limit();
  result.tilt_time = config.tilt_time();
  result.upright = model.imu().pose.linear().transpose() * Eigen::Vector3d::UnitZ();
  result.start_velocity = config.start_velocity();
  result.enable_cycles = config.enable_cycles();
  result.first_command_ramp = Cycles(config.first_command_ramp(), period);
  result.damping_after_cycles = config.damping_after_cycles();
  result.stop_after_cycles = config.stop_after_cycles();
  result.damping = ByJoint(config.has_damping(), config.damping(), derived.damping);
  result.stop_ramp = config.stop_ramp();
  if (config.on_lost_command() == HwBridgeConfig::HOLD) {
    result.hold_cycles = Cycles(config.hold_time(), period);
  }
  result.hold_before_command = config.hold_before_command();
  result.hold_stiffness =
      ByJoint(config.has_hold_stiffness(), config.hold_stiffness(), derived.hold_stiffness);
  result.hold_damping =
      ByJoint(config.has_hold_damping(), config.hold_damping(), derived.hold_damping);
  result.resume_cycles = Cycles(config.resume_time(), period);
  result.drives_hold = config.drives_hold();
  result.stiffness_limit = derived.stiffness_limit;
  result.damping_limit = derived.damping_limit;
  result.slew_limit = config.has_slew_limit() ? config.slew_limit() : derived.slew_limit;
  result.overload_time = config.overload_time();
  result.overrun_lateness = config.overrun_lateness() * period;
  result.overruns_in_a_row = config.overruns_in_a_row();
  result.overruns_in_100 = config.overruns_in_100();
  return result;
}

/// A link that no frame passes, for checking a configuration without the bus.
class NoLink final : public ethercat::Link {
 public:
  int64_t Now() const override { return 0; }
  bool Send(std::span<const uint8_t>) override { return false; }
  size_t Receive(std::span<uint8_t>, int64_t) override { return 0; }
};

}  // namespace

/// The EtherCAT bus's configuration and, once it is open, its link and capture.
class HwBridge::Ethercat {
 public:
  Ethercat(const ethercat::EthercatBusConfig& config, const robot::RobotModel& model, double period)
      : config_(config) {
    const auto cycle = static_cast<uint32_t>(std::llround(period * 1e9));
    if (config.master().has_cycle() && config.master().cycle() != cycle) {
      throw ConfigError("ethercat.master.cycle",
                        fmt::format("must be the run's period, {} ns, or be left out", cycle));
    }
    config_.mutable_master()->set_cycle(cycle);
    try {
      NoLink none;
      const ethercat::EthercatDriveBus checked(&none, config_, model);
    } catch (const ethercat::EthercatError& error) {
      throw ConfigError("ethercat", error.what());
    }
  }

  std::unique_ptr<DriveBus> Open(const LinkOpener& open_link, const robot::RobotModel& model) {
    link_ = open_link(config_.link());
    ethercat::Link* link = link_.get();
    if (config_.has_capture()) {
      using Carrier = ethercat::PcapWriter::Carrier;
      writer_ = std::make_unique<ethercat::PcapWriter>(
          config_.capture(), config_.link().has_udp() ? Carrier::kUdp : Carrier::kEthernet);
      capture_ = std::make_unique<ethercat::CaptureLink>(link, writer_.get());
      link = capture_.get();
    }
    return std::make_unique<ethercat::EthercatDriveBus>(link, config_, model);
  }

  /// Empty: done; else what could not be written.
  std::string CloseCapture() {
    if (!writer_) return {};
    try {
      writer_->Close();
    } catch (const ethercat::EthercatError& error) {
      return error.what();
    }
    return {};
  }

  const ethercat::EthercatBusConfig& config() const { return config_; }

 private:
  ethercat::EthercatBusConfig config_;
  std::unique_ptr<ethercat::Link> link_;
  std::unique_ptr<ethercat::PcapWriter> writer_;
  std::unique_ptr<ethercat::CaptureLink> capture_;
};

/// A Unitree robot's configuration and, once it is open, its link.
class HwBridge::Unitree {
 public:
  Unitree(const unitree::UnitreeBusConfig& config, const robot::RobotModel& model, double period)
      : config_(config), period_(period) {
    try {
      const unitree::UnitreeDriveBus checked(nullptr, config_, model, period_);
    } catch (const unitree::UnitreeError& error) {
      throw ConfigError("unitree", error.what());
    }
  }

  std::unique_ptr<DriveBus> Open(const RobotLinkOpener& open_robot,
                                 const robot::RobotModel& model) {
    link_ = open_robot(config_.link());
    return std::make_unique<unitree::UnitreeDriveBus>(link_.get(), config_, model, period_);
  }

 private:
  unitree::UnitreeBusConfig config_;
  double period_;
  std::unique_ptr<unitree::RobotLink> link_;
};

HwBridge::HwBridge(volatile std::sig_atomic_t* stop_signal)
    : HwBridge(stop_signal, ethercat::OpenLink) {}
HwBridge::HwBridge(volatile std::sig_atomic_t* stop_signal, LinkOpener open_link,
                   RobotLinkOpener open_robot)
    : stop_signal_(stop_signal),
      open_link_(std::move(open_link)),
      open_robot_(open_robot ? std::move(open_robot) : [](const unitree::DdsLink& link) {
        return std::make_unique<unitree::DdsRobotLink>(link);
      }) {}
HwBridge::~HwBridge() = default;

void HwBridge::Configure(const ComponentContext& context, Wiring* wiring) {
  const auto config = context.config<HwBridgeConfig>();
  Validate(config);
  model_ = LoadRobot(context);
  const int n = model_->num_joints();
  const int feet = static_cast<int>(model_->feet().size());

  AddPorts(config, wiring);
  SupervisorConfig supervisor = MakeSupervisorConfig(config, *model_, context.tick_period);
  supervisor.drive_impedance = !config.has_ethercat();  // cyclic synchronous torque alone
  supervisor_ = std::make_unique<Supervisor>(supervisor);
  enable_at_start_ = config.enable_at_start();
  enable_cycles_ = config.enable_cycles();
  if (config.has_ethercat()) {
    ethercat_ = std::make_unique<Ethercat>(config.ethercat(), *model_, context.tick_period);
    simulated_time_ = config.ethercat().simulated_time();
  } else if (config.has_unitree()) {
    unitree_ = std::make_unique<Unitree>(config.unitree(), *model_, context.tick_period);
    simulated_time_ = config.unitree().simulated_time();
  } else {
    bus_ = std::make_unique<SimulatedDriveBus>(&drive_feedback_);
  }
  MessageTraits<drive_command_t>::Resize(command_, MessageCounts{n});
  MessageTraits<drive_feedback_t>::Resize(feedback_, MessageCounts{n, feet});
}

void HwBridge::AddPorts(const HwBridgeConfig& config, Wiring* wiring) {
  const int n = model_->num_joints();
  const int feet = static_cast<int>(model_->feet().size());
  // A real robot's states bring all that is sensed; an emulated one's tick comes with the port.
  const bool fed = !config.has_unitree() || !config.unitree().follow_robot();
  if (fed) wiring->AddInput(&drive_feedback_, "drive_feedback", {n, feet});
  wiring->AddInput(&joint_command_, "joint_command", {n, feet});
  wiring->AddInput(&emergency_stop_, "emergency_stop", {}, InputKind::kLatest);
  wiring->AddOutput(&robot_sensors_, "robot_sensors", {n, feet});
  wiring->AddOutput(&drive_command_, "drive_command", {n});
  wiring->AddOutput(&bridge_status_, "bridge_status", {n});
  const ethercat::MasterConfig& master = config.ethercat().master();
  const int drives = master.drive_size() > 0 ? master.drive_size() : n;
  const bool diagnosed = config.has_ethercat() || config.has_unitree();
  if (diagnosed) wiring->AddOutput(&bus_status_, "bus_status", {drives + master.other_size()});
  std::vector<InputPort*> senses;
  if (fed) senses.push_back(&drive_feedback_);
  wiring->AddStage(
      "sense", std::move(senses), {&robot_sensors_}, [this](const Tick& tick) { Sense(tick); },
      config.sense_deadline());
  std::vector<OutputPort*> acts = {&drive_command_, &bridge_status_};
  if (diagnosed) acts.push_back(&bus_status_);
  wiring->AddStage(
      "actuate", {&joint_command_, &emergency_stop_}, std::move(acts),
      [this](const Tick& tick) { Actuate(tick); }, config.command_deadline());
}

void HwBridge::Open() {
  if (ethercat_) bus_ = ethercat_->Open(open_link_, *model_);
  if (unitree_) bus_ = unitree_->Open(open_robot_, *model_);
  try {
    bus_->Start();
    if (has_bus() && enable_at_start_) EnableDrives();
  } catch (...) {
    bus_->Stop();  // what went wrong is said already
    throw;
  }
  open_ = true;
}

void HwBridge::EnableDrives() {
  const auto waiting = [this] {
    const std::span<const DriveReport> reports = bus_->reports();
    return static_cast<size_t>(std::find_if(reports.begin(), reports.end(),
                                            [](const DriveReport& report) {
                                              return report.state != bridge_status_t::DRIVE_ENABLED;
                                            }) -
                               reports.begin());
  };
  const auto num_joints = static_cast<size_t>(model_->num_joints());
  for (int cycle = 0; waiting() < num_joints; ++cycle) {
    if (cycle > enable_cycles_) {
      throw std::runtime_error(
          fmt::format("the drive of joint \"{}\" is not enabled after {} cycles; is it powered, "
                      "without a fault "
                      "and safe torque off?",
                      model_->joints()[waiting()].name, enable_cycles_));
    }
    bus_->Idle(true);
    bus_->AwaitNextCycle();
  }
}

void HwBridge::Idle() {
  if (!open_) return;
  if (last_cycle_ < 0) {
    bus_->Idle(enable_at_start_);
  } else if (!simulated_time_) {  // which stands still now, and the last tick is still at work
    supervisor_->Shutdown();
    RunDown();
  }
}

std::string HwBridge::Close() {
  if (!open_) return {};
  supervisor_->Shutdown();
  if (has_bus()) {
    // One cycle more than the ramp: it tells the drives to stop.
    for (bool last = false; !last;) {
      last = supervisor_->at_rest() || !bus_->health().usable;
      RunDown();
      bus_->AwaitNextCycle();
    }
  }
  std::string problem = bus_->Stop();
  if (ethercat_) {
    const std::string capture = ethercat_->CloseCapture();
    if (!capture.empty()) problem += (problem.empty() ? "" : "; ") + capture;
  }
  open_ = false;
  return problem;
}

void HwBridge::RunDown() {
  if (const drive_feedback_t* drives = bus_->Receive()) {
    supervisor_->Read(*drives, bus_->reports());
  }
  bridge_status_t& status = *bridge_status_;
  supervisor_->Cycle(++last_cycle_, nullptr, &command_, &status);
  bus_->Send(command_);
}

const drive_feedback_t* HwBridge::ReadFeedback() {
  if (!bus_) return nullptr;  // that nobody has opened: a replay
  const drive_feedback_t* drives = bus_->Receive();
  if (drives == nullptr || !has_bus()) return drives;
  feedback_.position_counts = drives->position_counts;
  feedback_.velocity = drives->velocity;
  feedback_.current = drives->current;
  feedback_.drive_status = drives->drive_status;
  // Sensors from the bus where it has them, else from the port.
  const auto take_imu = [this](const drive_feedback_t& from) {
    std::copy(std::begin(from.imu_angular_velocity), std::end(from.imu_angular_velocity),
              feedback_.imu_angular_velocity);
    std::copy(std::begin(from.imu_acceleration), std::end(from.imu_acceleration),
              feedback_.imu_acceleration);
    std::copy(std::begin(from.imu_orientation), std::end(from.imu_orientation),
              feedback_.imu_orientation);
  };
  const SensorsOfBus own = bus_->sensors();
  if (own.imu) {
    take_imu(*drives);
  } else if (drive_feedback_.present()) {
    take_imu(*drive_feedback_);
  }
  if (own.feet) {
    feedback_.foot_wrench = drives->foot_wrench;
    feedback_.foot_sensor = drives->foot_sensor;
  } else if (drive_feedback_.present()) {
    feedback_.foot_wrench = drive_feedback_->foot_wrench;
    feedback_.foot_sensor = drive_feedback_->foot_sensor;
  }
  return &feedback_;
}

void HwBridge::Sense(const Tick& tick) {
  supervisor_->CountLateness(tick.lateness);
  const drive_feedback_t* feedback = ReadFeedback();
  // In lockstep readers wait for the message, which then keeps the readings of the cycle before.
  const SensorsOfBus own = bus_ ? bus_->sensors() : SensorsOfBus{};
  const bool sensed = drive_feedback_.present() || (own.imu && own.feet);
  if (!sensed || (feedback == nullptr && !simulated_time_)) {
    robot_sensors_.Withhold();
  }
  if (bus_) supervisor_->ReadBus(bus_->health());
  if (feedback == nullptr) return;
  const auto reports = bus_->reports();
  if (!supervisor_->Read(*feedback, reports)) return;  // likewise; the bridge has stopped

  robot_sensors_t& sensors = *robot_sensors_;
  const std::vector<robot::MotorModel>& motors = model_->motors();
  for (size_t j = 0; j < motors.size(); ++j) {
    sensors.joint_position[j] = JointPositionOf(motors[j], feedback->position_counts[j]);
    sensors.joint_velocity[j] =
        own.velocity ? feedback->velocity[j] : supervisor_->raw_joint_velocity()[j];
    // What was ordered a cycle ago, where the drive does not say what flows.
    sensors.joint_torque[j] = motors[j].current_sensor
                                  ? JointTorque(motors[j], feedback->current[j])
                                  : supervisor_->OrderedTorque(j, command_);
  }
  std::copy(std::begin(feedback->imu_angular_velocity), std::end(feedback->imu_angular_velocity),
            sensors.imu_angular_velocity);
  std::copy(std::begin(feedback->imu_acceleration), std::end(feedback->imu_acceleration),
            sensors.imu_acceleration);
  // Poise does not rest on it: what is no orientation is none, and stops nothing.
  const Eigen::Map<const Eigen::Vector4d> orientation(feedback->imu_orientation);
  const bool unit = std::abs(orientation.norm() - 1) < 0.01;  // false for NaN
  Eigen::Map<Eigen::Vector4d>(sensors.imu_orientation) =
      unit ? orientation.normalized() : Eigen::Vector4d::Zero().eval();
  ReadFootSensors(*feedback);
}

void HwBridge::ReadFootSensors(const drive_feedback_t& feedback) {
  robot_sensors_t& sensors = *robot_sensors_;
  for (size_t f = 0; f < sensors.foot_wrench.size(); ++f) {
    int8_t& state = sensors.foot_sensor[f];
    state = feedback.foot_sensor[f];
    if (!model_->feet()[f].force_sensor) state = drive_feedback_t::SENSOR_ABSENT;
    if (state == drive_feedback_t::SENSOR_OK && !Plausible(feedback.foot_wrench[f])) {
      state = drive_feedback_t::SENSOR_INVALID;
    }
    sensors.foot_wrench[f] = wrench_t{};
    if (state != drive_feedback_t::SENSOR_OK) continue;
    for (int i = 0; i < 3; ++i) {
      // The sensor reports the environment on the robot.
      sensors.foot_wrench[f].force[i] = -feedback.foot_wrench[f].force[i];
      sensors.foot_wrench[f].moment[i] = -feedback.foot_wrench[f].moment[i];
    }
  }
}

void HwBridge::CheckOperator() {
  if (stop_signal_ != nullptr && *stop_signal_ != 0) {
    *stop_signal_ = 0;
    supervisor_->EmergencyStop(bridge_status_t::REASON_SIGNAL);
  }
  if (!emergency_stop_.present()) return;
  if (emergency_stop_->stop != 0) supervisor_->EmergencyStop();
  const bool reset = emergency_stop_->reset != 0;
  if (reset && !reset_before_ && emergency_stop_->stop == 0) supervisor_->RequestReset();
  reset_before_ = reset;
}

void HwBridge::Actuate(const Tick& tick) {
  // The runner stamps every output with the run that this process belongs to.
  supervisor_->SetRun(bridge_status_->run_id);
  CheckOperator();
  supervisor_->Cycle(tick.index, joint_command_.present() ? &*joint_command_ : nullptr, &command_,
                     &*bridge_status_);
  last_cycle_ = tick.index;
  drive_command_->current = command_.current;
  drive_command_->enabled = command_.enabled;
  drive_command_->position = command_.position;
  drive_command_->velocity = command_.velocity;
  drive_command_->stiffness = command_.stiffness;
  drive_command_->damping = command_.damping;
  if (!bus_) return;
  if (bus_->num_slaves() > 0) {
    bus_->Diagnose(&*bus_status_);
    // In lockstep the emulated clocks follow the wall's time, which differs from run to run.
    if (simulated_time_) {
      std::fill_n(bus_status_->clock_difference.begin(), bus_status_->num_slaves, 0);
    }
  }
  bus_->Send(command_);
  if (supervisor_->TakeReset()) bus_->RequestFaultReset();
}

ComponentType HwBridgeType(volatile std::sig_atomic_t* stop_signal) {
  // AddPorts says why.
  AddOptionalPort({.component = "hw_bridge",
                   .port = "drive_feedback",
                   .type = MessageTraits<drive_feedback_t>::kName,
                   .unless = {"hw_bridge.unitree.follow_robot"},
                   .input = true});
  AddOptionalPort({.component = "hw_bridge",
                   .port = "bus_status",
                   .type = MessageTraits<bus_status_t>::kName,
                   .when = {"hw_bridge.ethercat", "hw_bridge.unitree"}});
  return {"hw_bridge",
          "drives and sensors: units, limits, safety states, e-stop",
          [stop_signal] { return std::make_unique<HwBridge>(stop_signal); },
          {.realtime =
               {// A process that dies is replaced: worth waiting for.
                {"hw_bridge.on_lost_command", "hw_bridge.on_lost_command=HOLD"},
                // Until the controller follows, the robot's joints are held.
                {"hw_bridge.hold_before_command", "hw_bridge.hold_before_command=true"}},
           .drive_links = {{.group = "hw_bridge.ethercat",
                            .link = "hw_bridge.ethercat.link",
                            .simulated_time = "hw_bridge.ethercat.simulated_time",
                            .profile = "hw_bridge.ethercat.master.profile",
                            .capture = "hw_bridge.ethercat.capture"},
                           {.group = "hw_bridge.unitree",
                            .simulated_time = "hw_bridge.unitree.simulated_time",
                            .tag = "hw_bridge.unitree.link.tag"}}},
          {Reads<joint_command_t>("joint_command"),
           Reads<emergency_stop_t>("emergency_stop", InputKind::kLatest),
           Writes<robot_sensors_t>("robot_sensors"), Writes<drive_command_t>("drive_command"),
           Writes<bridge_status_t>("bridge_status")},
          HwBridgeConfig::descriptor(),
          hw_bridge_proto_schema};
}

}  // namespace poise
