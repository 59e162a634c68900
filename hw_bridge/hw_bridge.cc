#include "hw_bridge/hw_bridge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "components/framework/configuration/added_fields.h"
#include "components/framework/optional_ports.h"
#include "components/messages/robot_resource.h"
#include "hw_bridge/drive/units.h"
#include "hw_bridge/robot_thresholds.h"

namespace poise {

std::string_view hw_bridge_proto_schema();  // generated
namespace {

// Shares of the period after a cycle's start at which, in real time, sensing begins with what has
// come, since sensors are there at once, and at which acting begins: the controller takes most of
// it, and frames want a tenth.
constexpr double kSenseDeadline = 0.25, kCommandDeadline = 0.9;

/// `value` for every joint, where it is given, in place of what follows from the robot.
void Replace(bool given, double value, std::vector<double>* derived) {
  if (given) derived->assign(derived->size(), value);
}

SupervisorConfig MakeSupervisorConfig(const HwBridgeConfig& config, const robot::RobotModel& model,
                                      double period) {
  SupervisorConfig result;
  result.settings = config;
  result.period = period;
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
    result.torque_limit.push_back(limit);
    result.lower.push_back(joint.lower);
    result.upper.push_back(joint.upper);
    result.velocity_limit.push_back(joint.velocity_limit);
  }
  result.num_feet = static_cast<int>(model.feet().size());
  result.upright = model.imu().pose.linear().transpose() * Eigen::Vector3d::UnitZ();
  // What was commanded a cycle ago is read as old as the readings are, and settles in a cycle more.
  const double delay = model.drive_train().sensor_delay;
  result.current_cycles = delay > 0 ? 2 + result.Cycles(delay) : 1;
  RobotThresholds& thresholds = result.thresholds;
  thresholds = DeriveThresholds(model);
  Replace(config.has_damping(), config.damping(), &thresholds.damping);
  Replace(config.has_hold_stiffness(), config.hold_stiffness(), &thresholds.hold_stiffness);
  Replace(config.has_hold_damping(), config.hold_damping(), &thresholds.hold_damping);
  if (config.has_slew_limit()) thresholds.slew_limit = config.slew_limit();
  if (config.has_frozen_torque()) thresholds.frozen_torque = config.frozen_torque();
  if (config.has_torque_error()) thresholds.torque_error = config.torque_error();
  return result;
}

/// Whether a setting of a bus's group, if it has that one, is true.
bool IsSet(const google::protobuf::Message& group, const std::string& setting) {
  const auto* const field = group.GetDescriptor()->FindFieldByName(setting);
  return field != nullptr && group.GetReflection()->GetBool(group, field);
}

}  // namespace

void HwBridge::MakeBus(double period) {
  const google::protobuf::Reflection& reflection = *config_.GetReflection();
  const DriveBusType* asked = nullptr;
  for (const DriveBusType& type : buses_) {
    const auto* const field = FindField(*HwBridgeConfig::descriptor(), type.name);
    if (field == nullptr || !reflection.HasField(config_, field)) continue;
    if (asked != nullptr) {
      throw ConfigError(type.name,
                        fmt::format("must be left out with {}: a robot has one bus", asked->name));
    }
    asked = &type;
  }
  if (asked == nullptr) {
    bus_ = &simulated_bus_;
    return;
  }
  const google::protobuf::Message& group =
      reflection.GetMessage(config_, FindField(*HwBridgeConfig::descriptor(), asked->name));
  try {
    own_bus_ = asked->make(group, *model_, period);
  } catch (const ConfigError& error) {
    if (error.field().empty()) throw ConfigError(asked->name, error.what());
    throw ConfigError(asked->name + "." + error.field(), error.problem());
  } catch (const std::runtime_error& error) {
    throw ConfigError(asked->name, error.what());
  }
  simulated_time_ = IsSet(group, asked->link.simulated_time);
  all_sensors_ = IsSet(group, asked->all_sensors);
}

void HwBridge::Configure(const ComponentContext& context, Wiring* wiring) {
  config_ = context.config<HwBridgeConfig>();
  model_ = LoadRobot(context);
  SupervisorConfig supervisor = MakeSupervisorConfig(config_, *model_, context.tick_period);
  MakeBus(context.tick_period);
  supervisor.drive_impedance = (own_bus_ ? *own_bus_ : simulated_bus_).impedance();
  supervisor_ = std::make_unique<Supervisor>(supervisor);
  AddPorts(wiring);
  MessageTraits<drive_feedback_t>::Resize(feedback_, JointAndFootCounts(*model_));
}

void HwBridge::AddPorts(Wiring* wiring) {
  const int n = model_->num_joints();
  const MessageCounts counts = JointAndFootCounts(*model_);
  std::vector<InputPort*> senses;
  if (!all_sensors_) {
    wiring->AddInput(&drive_feedback_, "drive_feedback", counts);
    senses.push_back(&drive_feedback_);
  }
  wiring->AddInput(&joint_command_, "joint_command", counts);
  wiring->AddInput(&emergency_stop_, "emergency_stop", {}, InputKind::kLatest);
  wiring->AddOutput(&robot_sensors_, "robot_sensors", counts);
  wiring->AddOutput(&drive_command_, "drive_command", {n});
  wiring->AddOutput(&bridge_status_, "bridge_status", {n});
  std::vector<OutputPort*> acts = {&drive_command_, &bridge_status_};
  if (own_bus_) {
    wiring->AddOutput(&bus_status_, "bus_status", {own_bus_->num_slaves()});
    acts.push_back(&bus_status_);
  }
  wiring->AddStage(
      "sense", std::move(senses), {&robot_sensors_}, [this](const Tick& tick) { Sense(tick); },
      kSenseDeadline);
  wiring->AddStage(
      "actuate", {&joint_command_, &emergency_stop_}, std::move(acts),
      [this](const Tick& tick) { Actuate(tick); }, kCommandDeadline);
}

void HwBridge::Open() {
  if (own_bus_) bus_ = own_bus_.get();
  try {
    bus_->Start();
    if (own_bus_ && config_.enable_at_start()) EnableDrives();
  } catch (...) {
    bus_->Stop();  // what went wrong is said already
    throw;
  }
  open_ = true;
}

void HwBridge::EnableDrives() {
  const auto disabled = [](const DriveReport& report) {
    return report.state != bridge_status_t::DRIVE_ENABLED;
  };
  const auto waiting = [this, &disabled] {
    const std::span<const DriveReport> reports = bus_->reports();
    return static_cast<size_t>(std::ranges::find_if(reports, disabled) - reports.begin());
  };
  const auto num_joints = static_cast<size_t>(model_->num_joints());
  for (int cycle = 0; waiting() < num_joints; ++cycle) {
    if (cycle > config_.enable_cycles()) {
      throw std::runtime_error(
          fmt::format("the drive of joint \"{}\" is not enabled after {} cycles; is it powered, "
                      "without a fault "
                      "and safe torque off?",
                      model_->joints()[waiting()].name, config_.enable_cycles()));
    }
    bus_->Idle(true);
    bus_->AwaitNextCycle();
  }
}

void HwBridge::Idle() {
  if (!open_) return;
  if (last_cycle_ < 0) {
    bus_->Idle(config_.enable_at_start());
  } else if (!simulated_time_) {  // which stands still now, and the last tick is still at work
    supervisor_->Shutdown();
    RunDown();
  }
}

std::string HwBridge::Close() {
  if (!open_) return {};
  supervisor_->Shutdown();
  if (own_bus_) {
    // One cycle more than the ramp: it tells the drives to stop.
    for (bool last = false; !last;) {
      last = supervisor_->at_rest() || !bus_->health().usable;
      RunDown();
      bus_->AwaitNextCycle();
    }
  }
  open_ = false;
  return bus_->Stop();
}

void HwBridge::RunDown() {
  if (const drive_feedback_t* drives = bus_->Receive()) {
    supervisor_->Read(*drives, bus_->reports());
  }
  supervisor_->Cycle(++last_cycle_, nullptr, &*drive_command_, &*bridge_status_);
  bus_->Send(*drive_command_);
}

const drive_feedback_t* HwBridge::ReadFeedback() {
  if (!bus_) return nullptr;  // that nobody has opened: a replay
  const drive_feedback_t* drives = bus_->Receive();
  if (drives == nullptr || !own_bus_) return drives;
  feedback_.position_counts = drives->position_counts;
  feedback_.velocity = drives->velocity;
  feedback_.current = drives->current;
  feedback_.drive_status = drives->drive_status;
  // Sensors from the bus where it has them, else from the port.
  const SensorsOfBus own = bus_->sensors();
  const drive_feedback_t* const port = drive_feedback_.present() ? &*drive_feedback_ : nullptr;
  if (const drive_feedback_t* const imu = own.imu ? drives : port) {
    std::ranges::copy(imu->imu_angular_velocity, feedback_.imu_angular_velocity);
    std::ranges::copy(imu->imu_acceleration, feedback_.imu_acceleration);
    std::ranges::copy(imu->imu_orientation, feedback_.imu_orientation);
  }
  if (const drive_feedback_t* const feet = own.feet ? drives : port) {
    feedback_.foot_wrench = feet->foot_wrench;
    feedback_.foot_sensor = feet->foot_sensor;
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
                                  : supervisor_->OrderedTorque(j, *drive_command_);
  }
  std::ranges::copy(feedback->imu_angular_velocity, sensors.imu_angular_velocity);
  std::ranges::copy(feedback->imu_acceleration, sensors.imu_acceleration);
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
  supervisor_->Cycle(tick.index, joint_command_.present() ? &*joint_command_ : nullptr,
                     &*drive_command_, &*bridge_status_);
  last_cycle_ = tick.index;
  if (!bus_) return;
  if (bus_->num_slaves() > 0) {
    bus_->Diagnose(&*bus_status_);
    // In lockstep the emulated clocks follow the wall's time, which differs from run to run.
    if (simulated_time_) {
      std::fill_n(bus_status_->clock_difference.begin(), bus_status_->num_slaves, 0);
    }
  }
  bus_->Send(*drive_command_);
  if (supervisor_->TakeReset()) bus_->RequestFaultReset();
}

ComponentType HwBridgeType(volatile std::sig_atomic_t* stop_signal) {
  std::vector<std::string> groups, all_sensors;
  std::vector<DriveLink> links;
  for (const DriveBusType& bus : DriveBuses()) {
    const std::string group = "hw_bridge." + bus.name;
    const auto at = [&](const std::string& field) {
      return field.empty() ? field : group + "." + field;
    };
    groups.push_back(group);
    if (!bus.all_sensors.empty()) all_sensors.push_back(at(bus.all_sensors));
    links.push_back({.group = group,
                     .link = at(bus.link.link),
                     .simulated_time = at(bus.link.simulated_time),
                     .profile = at(bus.link.profile),
                     .capture = at(bus.link.capture),
                     .tag = at(bus.link.tag)});
  }
  AddOptionalPort({.component = "hw_bridge",
                   .port = "drive_feedback",
                   .type = MessageTraits<drive_feedback_t>::kName,
                   .unless = all_sensors,
                   .input = true});
  AddOptionalPort({.component = "hw_bridge",
                   .port = "bus_status",
                   .type = MessageTraits<bus_status_t>::kName,
                   .when = groups});
  return {"hw_bridge",
          "drives and sensors: units, limits, safety states, e-stop",
          [stop_signal] { return std::make_unique<HwBridge>(stop_signal); },
          {.realtime =
               {// A process that dies is replaced: worth waiting for.
                {"hw_bridge.on_lost_command", "hw_bridge.on_lost_command=HOLD"},
                // Until the controller follows, the robot's joints are held.
                {"hw_bridge.hold_before_command", "hw_bridge.hold_before_command=true"}},
           .drive_links = links},
          {Reads<joint_command_t>("joint_command"),
           Reads<emergency_stop_t>("emergency_stop", InputKind::kLatest),
           Writes<robot_sensors_t>("robot_sensors"), Writes<drive_command_t>("drive_command"),
           Writes<bridge_status_t>("bridge_status")},
          HwBridgeConfig::descriptor(),
          hw_bridge_proto_schema};
}

}  // namespace poise
