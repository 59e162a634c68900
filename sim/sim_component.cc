#include "sim/sim_component.h"

#include <fmt/format.h>

#include <cmath>

#include "components/messages/conversions.h"
#include "components/messages/robot_resource.h"

namespace poise {
namespace {

// Apart from those of terrain and sensors.
constexpr uint64_t kLossStream = 0x6c6f7373;
// What an operator may ask for: far beyond what any robot here stands, within what engines bear.
constexpr double kMostForce = 1e5;                  // N
constexpr double kFarthestPoint = 10;               // m from the body's origin
constexpr int64_t kLongestPush = int64_t{1} << 40;  // ticks

}  // namespace

ComponentType SimType(const std::string& engine, std::string summary, SimReader read,
                      const google::protobuf::Descriptor* config, std::string_view (*schema)()) {
  return {"sim_" + engine,
          std::move(summary),
          [read = std::move(read)] { return std::make_unique<SimComponent>(read); },
          {.sections = {"sim", engine},
           .engine = engine,
           .ideal = {"sim.joint_friction=false", "sim.sensor_noise=false", "sim.rotor_inertia=true",
                     "sim.push_sensor_noise=0", "sim.robot_drive_train=false",
                     "sim.drive_train=", "sim.model_error=", "sim.motor_change="},
           // Until the controller follows, the robot hangs.
           .realtime = {{"sim.crane", "sim.crane.release_time=1"}},
           // In lockstep no command is late.
           .lockstep = {"sim.crane="}},
          {Reads<drive_command_t>("drive_command", InputKind::kPreviousTick),
           Reads<bridge_status_t>("bridge_status", InputKind::kPreviousTick),
           Reads<operate::act_t>("operator", InputKind::kLatest),
           Writes<drive_feedback_t>("drive_feedback"), Writes<external_push_t>("external_push"),
           Writes<ground_truth_t>("ground_truth")},
          config,
          schema};
}

SimComponent::SimComponent(SimReader read) : read_(std::move(read)) {}

SimComponent::~SimComponent() = default;

void SimComponent::Configure(const ComponentContext& context, Wiring* wiring) {
  const SimSetup setup = read_(context);
  const std::shared_ptr<const robot::RobotModel> model = LoadRobot(context);
  try {
    simulation_ = std::make_unique<Simulation>(*model, setup.sim, setup.worlds, context.tick_period,
                                               context.seed, context.lead_ticks);
    sensors_ = std::make_unique<Sensors>(*model, SimulatedNoise(*model, setup.sim), context.seed);
    foot_sensors_ = std::make_unique<FootSensors>(*model, setup.sim);
    command_loss_ = setup.sim.command_loss();
  } catch (const ConfigError& error) {
    if (error.field().empty()) throw;
    throw ConfigError("sim." + error.field(), error.problem());
  }
  const int64_t ticks = context.num_ticks - context.lead_ticks;  // of the scenario's own time
  for (int i = 0; i < setup.sim.push_size() && context.num_ticks > 0; ++i) {
    const double start = setup.sim.push(i).start();
    if (std::llround(start / context.tick_period) < ticks) continue;
    wiring->AddWarning(
        fmt::format("sim.push[{}].start: {:g} s is after the run's end, {:g} s: it does not push",
                    i, start, static_cast<double>(ticks) * context.tick_period));
  }
  readings_ = std::make_unique<SensorReadings>(model->num_joints());
  for (const robot::MotorModel& motor : model->motors()) {
    current_sensor_.push_back(motor.current_sensor ? 1 : 0);
  }

  losses_.emplace(context.seed, kLossStream);
  push_until_.assign(model->bodies().size(), -1);
  impedance_.resize(model->motors().size());

  const MessageCounts counts = JointAndFootCounts(*model);
  wiring->AddInput(&drive_command_, "drive_command", {model->num_joints()},
                   InputKind::kPreviousTick);
  wiring->AddInput(&bridge_status_, "bridge_status", {model->num_joints()},
                   InputKind::kPreviousTick);
  wiring->AddInput(&operator_, "operator", {}, InputKind::kLatest);
  wiring->AddOutput(&drive_feedback_, "drive_feedback", counts);
  wiring->AddOutput(&external_push_, "external_push", {});
  wiring->AddOutput(&ground_truth_, "ground_truth", counts);
  wiring->AddStage("step", {&drive_command_, &bridge_status_, &operator_},
                   {&drive_feedback_, &external_push_, &ground_truth_},
                   [this](const Tick& tick) { Step(tick); });
}

std::string_view SimComponent::finished() const {
  return simulation_ ? simulation_->end_reason() : std::string_view{};
}

void SimComponent::TakeActs(const Tick& tick) {
  using operate::answer_t;
  for (size_t body = 0; body < push_until_.size(); ++body) {
    if (push_until_[body] < 0 || tick.index < push_until_[body]) continue;
    push_until_[body] = -1;
    simulation_->SetForce(static_cast<int>(body), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  }
  while (const operate::act_t* const act = operator_.Next(tick)) {
    const bool known = act->kind == operate::act_t::KIND_PUSH && act->body >= 0 &&
                       act->body < static_cast<int32_t>(push_until_.size());
    if (!known) {
      operator_.Answer(answer_t::VERDICT_UNKNOWN);
      continue;
    }
    const Eigen::Map<const Eigen::Vector3d> force(act->force), point(act->point);
    if (!(force.norm() <= kMostForce && point.norm() <= kFarthestPoint &&
          act->duration <= kLongestPush)) {
      operator_.Answer(answer_t::VERDICT_RANGE);
      continue;
    }
    simulation_->SetForce(act->body, force, point);
    push_until_[static_cast<size_t>(act->body)] =
        act->duration < 0 ? -1 : tick.index + act->duration;
  }
}

void SimComponent::Step(const Tick& tick) {
  TakeActs(tick);
  if (tick.index > 0) {
    if (command_loss_ > 0 && losses_->Uniform() < command_loss_) {
      // The drives hold what they have.
    } else if (drive_command_.present()) {
      simulation_->SetCurrents(drive_command_->current, drive_command_->enabled);
      for (size_t j = 0; j < impedance_.size(); ++j) {
        impedance_[j] = {.stiffness = drive_command_->stiffness[j],
                         .damping = drive_command_->damping[j],
                         .position = drive_command_->position[j],
                         .velocity = drive_command_->velocity[j]};
      }
      simulation_->SetImpedance(impedance_);
    } else {
      simulation_->SetCurrents({}, {});
    }
    simulation_->Follow(bridge_status_.present() &&
                        bridge_status_->state == bridge_status_t::STATE_RUNNING);
    simulation_->Advance();
  }
  sensors_->Measure(simulation_->measured(), readings_.get());
  foot_sensors_->Apply(tick.time, readings_.get());
  PublishFeedback();
  PublishPush();
  PublishTruth();
}

void SimComponent::PublishFeedback() {
  drive_feedback_t& message = *drive_feedback_;
  for (size_t j = 0; j < message.current.size(); ++j) {
    message.position_counts[j] = readings_->position_counts[j];
    message.velocity[j] = readings_->velocity[static_cast<Eigen::Index>(j)];
    // A drive that reports no current reports zero.
    message.current[j] = current_sensor_[j] != 0
                             ? simulation_->measured().motor_current[static_cast<Eigen::Index>(j)]
                             : 0.0;
    message.drive_status[j] = drive_feedback_t::DRIVE_ENABLED;  // simulated drives have no faults
  }
  SetVector3(readings_->imu_angular_velocity, message.imu_angular_velocity);
  SetVector3(readings_->imu_acceleration, message.imu_acceleration);
  SetQuaternion(readings_->imu_orientation, message.imu_orientation);
  for (const robot::Foot f : robot::kFeet) {
    SetWrench(readings_->foot_wrench[f], &message.foot_wrench[Index(f)]);
    message.foot_sensor[Index(f)] = readings_->foot_sensor[f];
  }
}

void SimComponent::PublishPush() {
  SetVector3(readings_->push_force, external_push_->force);
  SetVector3(simulation_->truth().push_point, external_push_->point);
}

void SimComponent::PublishTruth() {
  ground_truth_t& message = *ground_truth_;
  const SimulationTruth& truth = simulation_->truth();
  const robot::RobotState& state = truth.state;
  SetVector3(state.base_position, message.base_position);
  SetQuaternion(state.base_orientation, message.base_orientation);
  SetVector3(state.base_linear_velocity, message.base_linear_velocity);
  SetVector3(state.base_angular_velocity, message.base_angular_velocity);
  for (size_t j = 0; j < message.joint_position.size(); ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    message.joint_position[j] = state.joint_position[i];
    message.joint_velocity[j] = state.joint_velocity[i];
    message.joint_torque[j] = truth.motor_torque[i];
    message.friction_torque[j] = truth.friction_torque[i];
  }
  SetVector3(truth.com, message.com_position);
  SetVector3(truth.com_velocity, message.com_velocity);
  for (const robot::Foot f : robot::kFeet) {
    const size_t i = Index(f);
    SetPose(truth.foot_pose[f], &message.foot_pose[i]);
    SetWrench(-truth.foot_wrench[f], &message.foot_wrench[i]);  // robot on environment
    message.foot_contact_points[i] = truth.contact_points[f];
  }
  SetVector3(truth.push_force, message.push_force);
  message.fallen = simulation_->fallen() ? 1 : 0;
  SetVector3(truth.crane_point, message.crane_point);
  SetVector3(truth.crane_force, message.crane_force);
  message.crane_share = truth.crane_share;
}

}  // namespace poise
