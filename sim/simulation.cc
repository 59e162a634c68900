#include "sim/simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "components/robot/sole.h"
#include "sim/simulated_robot.h"
#include "sim/start_posture.h"

namespace poise {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using robot::kFeet;
using robot::kGravity;
using robot::RobotModel;
using robot::RobotState;

namespace {

// A corner this far above the ground already rests on it: rounding of the start posture must not
// let the robot drop.
constexpr double kContactMargin = 1e-6;  // m
constexpr double kMaxStartDepth = 5e-3;  // m, of a sole in the block

int NumCorners(const RobotModel& model) {
  size_t count = 0;
  for (const robot::FootModel& foot : model.feet()) count += robot::SoleCorners(foot).size();
  return static_cast<int>(count);
}

const SimConfig& Checked(const SimConfig& config) {
  CheckFields(config);
  return config;
}

int StepsPerTick(const SimConfig& config, double tick_period) {
  const double steps = tick_period / config.step();
  const double whole = std::round(steps);
  if (whole < 1 || std::abs(steps - whole) > 1e-6 * whole) {
    throw ConfigError("step", fmt::format("{} s does not divide the control period of {} s into "
                                          "whole steps; use {} s divided by a whole number",
                                          config.step(), tick_period, tick_period));
  }
  return static_cast<int>(whole);
}

/// Writes a text and cuts it where there is no more room: a tick allocates nothing.
template <size_t room, typename... Values>
void WriteText(char (&to)[room], fmt::format_string<Values...> text, Values... values) {
  *fmt::vformat_to_n(&to[0], room - 1, fmt::string_view(text), fmt::make_format_args(values...))
       .out = '\0';
}

Drivetrain::Options DrivetrainOptions(const RobotModel& model,
                                      const std::vector<robot::MotorModel>& motors,
                                      const DriveTrain& drive, const SimConfig& config) {
  const Drivetrain::Options options{config.rotor_inertia(),      config.joint_friction(),
                                    config.friction_stiffness(), drive.backlash(),
                                    drive.gear_stiffness(),      drive.gear_damping()};
  if (!options.elastic()) return options;
  const std::string field =
      drive.gear_stiffness() > 0 ? "drive_train.gear_stiffness" : "drive_train.backlash";
  if (!options.inertia) {
    throw ConfigError(field, "needs the rotor as a body; set rotor_inertia: true or this to 0");
  }
  for (size_t j = 0; j < model.joints().size(); ++j) {
    if (motors[j].reflected_inertia > 0) continue;
    throw ConfigError(field, "needs the rotor as a body, but joint '" + model.joints()[j].name +
                                 "' has none; give its motor a rotor_inertia in the robot file");
  }
  return options;
}

size_t DelaySteps(const DriveTrain& drive, double step) {
  const double delay = drive.sensor_delay();
  const double whole = std::round(delay / step);
  if (std::abs(delay / step - whole) > 1e-6 * std::max(whole, 1.0) || whole > 1e4) {
    throw ConfigError(
        "drive_train.sensor_delay",
        fmt::format("{} s is not a whole number (at most 10000) of steps of {} s", delay, step));
  }
  return static_cast<size_t>(whole);
}

}  // namespace

SimulationTruth::SimulationTruth(int num_joints)
    : state(num_joints),
      com(Vector3d::Zero()),
      com_velocity(Vector3d::Zero()),
      contact_points{0, 0},
      encoder_position(Eigen::VectorXd::Zero(num_joints)),
      encoder_velocity(Eigen::VectorXd::Zero(num_joints)),
      motor_current(Eigen::VectorXd::Zero(num_joints)),
      motor_torque(Eigen::VectorXd::Zero(num_joints)),
      friction_torque(Eigen::VectorXd::Zero(num_joints)),
      imu_angular_velocity(Vector3d::Zero()),
      imu_specific_force(Vector3d::Zero()),
      imu_orientation(Eigen::Quaterniond::Identity()),
      push_force(Vector3d::Zero()),
      push_point(Vector3d::Zero()),
      crane_point(Vector3d::Zero()),
      crane_force(Vector3d::Zero()) {
  foot_pose.fill(Isometry3d::Identity());
  foot_wrench.fill(robot::Vector6d::Zero());
}

Simulation::Simulation(const RobotModel& model, const SimConfig& config, const WorldFactory& worlds,
                       double tick_period, uint64_t seed, int64_t lead_ticks)
    : model_(WithModelErrors(model, Checked(config))),
      motors_(SimulatedMotors(model, config)),
      steps_per_tick_(StepsPerTick(config, tick_period)),
      step_(tick_period / steps_per_tick_),
      torque_limits_(config.torque_limits()),
      fall_height_(config.fall_height()),
      fall_tilt_(config.fall_tilt()),
      terrain_(config, seed),
      // A corner in a block that is pressed down to the ground meets both.
      world_(worlds(model_, (config.has_block() ? 2 : 1) * NumCorners(model_), step_)),
      drive_train_(SimulatedDriveTrain(model_, config)),
      drivetrain_options_(DrivetrainOptions(model_, motors_, drive_train_, config)),
      current_loop_(drive_train_, step_),
      steps_(-lead_ticks * steps_per_tick_),
      command_(Eigen::VectorXd::Zero(model_.num_joints())),
      current_(Eigen::VectorXd::Zero(model_.num_joints())),
      mean_current_(Eigen::VectorXd::Zero(model_.num_joints())),
      torque_(Eigen::VectorXd::Zero(model_.num_joints())),
      impedance_(static_cast<size_t>(model_.num_joints())),
      enabled_(static_cast<size_t>(model_.num_joints()), 0),
      imu_velocity_(static_cast<size_t>(steps_per_tick_), Vector3d::Zero()),
      truth_(model_.num_joints()),
      measured_(truth_),
      delayed_(DelaySteps(drive_train_, step_), truth_) {
  const RobotState start = SolveStart(model_, config.start());
  const double scale = ImpulseScale(model_, start);
  for (int i = 0; i < config.push_size(); ++i) {
    pushes_.emplace_back(config.push(i), model_, scale, "push[" + std::to_string(i) + "]");
  }
  forces_.resize(model_.bodies().size());
  for (int i = 0; i < config.hand_size(); ++i) {
    hands_.emplace_back(config.hand(i), model_, step_, "hand[" + std::to_string(i) + "]");
  }
  for (const robot::Foot f : kFeet) {
    const robot::FootModel& foot = model_.feet()[f];
    for (const Eigen::Vector2d& corner : robot::SoleCorners(foot)) {
      corners_[f].push_back(foot.sole * Vector3d(corner.x(), corner.y(), 0));
    }
  }
  SetState(start);
  start_com_height_ = truth_.com.z();
  CheckStart();
  if (!config.has_crane()) return;
  crane_.emplace(config.crane(), model_, world_->pose(0), truth_.com, step_, tick_period);
  const double least = config.crane().follow_time() + config.crane().release_time();
  if (static_cast<double>(lead_ticks) * tick_period < least) {
    throw ConfigError(
        "crane", fmt::format("takes {} s at least to let go, before the scenario's time 0; give "
                             "the scenario a lead of more, or take the crane away",
                             least));
  }
  ReadCrane();
}

void Simulation::CheckStart() const {
  for (const robot::Foot f : kFeet) {
    const Isometry3d body = world_->pose(model_.feet()[f].body);
    for (const Vector3d& corner : corners_[f]) {
      const Vector3d p = body * corner;
      const Terrain::Surface surface = terrain_.At(p.x(), p.y(), 0);
      if (surface.block && surface.height - p.z() > kMaxStartDepth) {
        throw ConfigError("block", fmt::format("the {} sole starts {:.3f} m inside it; move it or "
                                               "set block.start to when it is put in place",
                                               model_.feet()[f].name, surface.height - p.z()));
      }
    }
  }
}

void Simulation::SetState(const RobotState& state) {
  world_->SetState(state);
  drivetrains_.clear();
  for (size_t j = 0; j < model_.joints().size(); ++j) {
    drivetrains_.emplace_back(model_.joints()[j], motors_[j], drivetrain_options_);
  }
  robot::FootArray<bool> in_contact{};
  for (const robot::Foot f : kFeet) {
    truth_.contact_points[f] = CollectContacts(f, false);
    in_contact[f] = truth_.contact_points[f] > 0;
  }
  truth_.foot_wrench = RestWrenches(model_, state, in_contact);
  std::ranges::fill(imu_velocity_, ImuVelocity());
  imu_acceleration_.setZero();
  if (current_loop_.lags() || drivetrain_options_.elastic()) {
    Eigen::VectorXd torque = RestTorques(model_, state, truth_.foot_wrench);
    if (Count(in_contact) == 0) torque.setZero();  // in flight nothing rests
    for (int j = 0; j < model_.num_joints(); ++j) {
      const auto i = static_cast<size_t>(j);
      drivetrains_[i].Place(state.joint_position[j], state.joint_velocity[j], torque[j]);
      if (!current_loop_.lags()) continue;
      current_[j] = mean_current_[j] = torque[j] / motors_[i].torque_per_ampere();
      torque_[j] = torque[j];
    }
  }
  ReadTruth();
  measured_ = truth_;
  for (SimulationTruth& past : delayed_) past = truth_;
}

double Simulation::CurrentLimit(size_t joint) const {
  if (!torque_limits_) return std::numeric_limits<double>::infinity();
  const robot::MotorModel& motor = motors_[joint];
  return std::min(motor.peak_current, model_.joints()[joint].effort / motor.torque_per_ampere());
}

void Simulation::SetCurrents(std::span<const double> current, std::span<const int8_t> enabled) {
  for (size_t j = 0; j < motors_.size(); ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    enabled_[j] = j < current.size() && j < enabled.size() && enabled[j] != 0 ? 1 : 0;
    impedance_[j] = {};
    const bool follows = enabled_[j] != 0 && std::isfinite(current[j]);
    double amperes = current_loop_.Quantise(follows ? current[j] : 0);
    if (torque_limits_) {
      const double limit = CurrentLimit(j);
      amperes = std::clamp(amperes, -limit, limit);
    }
    command_[i] = amperes;
  }
}

void Simulation::SetImpedance(std::span<const DriveImpedance> impedance) {
  for (size_t j = 0; j < std::min(impedance.size(), impedance_.size()); ++j) {
    const DriveImpedance& drive = impedance[j];
    if (enabled_[j] == 0 || !drive.active()) continue;
    if (!(drive.stiffness >= 0 && drive.damping >= 0) ||
        !std::isfinite(drive.stiffness + drive.damping + drive.position + drive.velocity)) {
      continue;
    }
    impedance_[j] = drive;
  }
}

DriveImpedance Simulation::Drive(size_t joint, double* torque) const {
  const DriveImpedance& drive = impedance_[joint];
  if (!drive.active()) return drive;
  const auto j = static_cast<int>(joint);
  const Drivetrain& drivetrain = drivetrains_[joint];
  const double sum = *torque + drive.Torque(drivetrain.motor_position(world_->joint_position(j)),
                                            drivetrain.motor_velocity(world_->joint_velocity(j)));
  const double limit = CurrentLimit(joint) * motors_[joint].torque_per_ampere();
  if (std::abs(sum) <= limit) return drive;
  *torque = std::clamp(sum, -limit, limit);
  return {};
}

void Simulation::Step() {
  StepOnce();
  if (broken_) return;
  ReadTruth();
  DetectFall();
}

void Simulation::Advance() {
  for (int i = 0; i < steps_per_tick_; ++i) StepOnce();
  if (broken_) return;
  ReadTruth();
  DetectFall();
  CheckCrane();
}

void Simulation::Delay() {
  ReadTruth();
  std::swap(measured_, delayed_[oldest_]);
  delayed_[oldest_] = truth_;
  oldest_ = (oldest_ + 1) % delayed_.size();
  measured_.push_force = truth_.push_force;
  measured_.push_point = truth_.push_point;
}

void Simulation::SetForce(int body, const Vector3d& force, const Vector3d& point) {
  forces_[static_cast<size_t>(body)] = {force, point};
}

void Simulation::StepOnce() {
  if (broken_) return;
  const double from = time();
  const double to = static_cast<double>(steps_ + 1) * step_;
  for (int j = 0; j < model_.num_joints(); ++j) {
    Drivetrain& drivetrain = drivetrains_[static_cast<size_t>(j)];
    const double gain = motors_[static_cast<size_t>(j)].torque_per_ampere();
    mean_current_[j] = current_loop_.Advance(command_[j], &current_[j]);
    torque_[j] = mean_current_[j] * gain;
    const DriveImpedance drive = Drive(static_cast<size_t>(j), &torque_[j]);
    world_->SetJoint(j, drivetrain.Begin(step_, world_->joint_position(j),
                                         world_->joint_velocity(j), torque_[j], drive));
  }
  for (const PushProfile& push : pushes_) {
    const Vector3d force = push.MeanForce(from, to);
    if (!force.isZero(0)) {
      world_->AddForce(push.body(), force, world_->pose(push.body()) * push.point());
    }
  }
  for (size_t b = 0; b < forces_.size(); ++b) {
    if (forces_[b].force.isZero(0)) continue;
    const int body = static_cast<int>(b);
    world_->AddForce(body, forces_[b].force, world_->pose(body) * forces_[b].point);
  }
  for (HandSpring& hand : hands_) {
    const Vector3d point = world_->pose(hand.body()) * hand.point();
    hand.Grip(from, point);
    const Vector3d force = hand.Force(from, point, PointVelocity(hand.body(), point));
    if (!force.isZero(0)) world_->AddForce(hand.body(), force, point);
  }
  if (crane_ && !crane_->let_go()) {
    const Vector3d point = world_->pose(0) * crane_->point();
    world_->AddForce(0, crane_->Force(point, PointVelocity(0, point)), point);
  }
  robot::FootArray<Isometry3d> sole;
  robot::FootArray<Vector3d> com;
  for (const robot::Foot f : kFeet) {
    const robot::FootModel& foot = model_.feet()[f];
    sole[f] = world_->pose(foot.body) * foot.sole;
    com[f] = world_->com_position(foot.body);
    truth_.contact_points[f] = CollectContacts(f, true);
  }

  const bool quiet = world_->Step();
  ++steps_;
  if (!quiet) return Break(world_->message());
  if (!world_->Finite()) return Break("the state is no longer finite");

  for (int j = 0; j < model_.num_joints(); ++j) {
    const auto i = static_cast<size_t>(j);
    drivetrains_[i].End(step_, world_->joint_velocity(j));
    if (!impedance_[i].active()) continue;
    torque_[j] += drivetrains_[i].drive_torque();
    mean_current_[j] = torque_[j] / motors_[i].torque_per_ampere();
  }
  ReadFootWrenches(sole, com);
  imu_step_ = (imu_step_ + 1) % imu_velocity_.size();
  const Vector3d before = std::exchange(imu_velocity_[imu_step_], ImuVelocity());
  imu_acceleration_ = (imu_velocity_[imu_step_] - before) / (steps_per_tick_ * step_);
  if (!delayed_.empty()) Delay();
}

int Simulation::CollectContacts(robot::Foot foot, bool add) {
  const int body = model_.feet()[foot].body;
  const Isometry3d pose = world_->pose(body);
  int count = 0;
  for (const Vector3d& corner : corners_[foot]) {
    const Vector3d p = pose * corner;
    const Terrain::Surface surface = terrain_.At(p.x(), p.y(), time());
    const double depth = (surface.height - p.z()) * surface.normal.z();
    if (depth < -kContactMargin) continue;
    ++count;
    if (add) {
      world_->AddContact({body, p, surface.normal, depth, surface.velocity * surface.normal.z(),
                          terrain_.material(surface, corners_[foot].size())});
    }
    const bool on_block = surface.block && surface.field < 0;
    if (!on_block || p.z() > kContactMargin) continue;
    ++count;
    if (add) {
      world_->AddContact(
          {body, p, Vector3d::UnitZ(), -p.z(), 0, terrain_.material(false, corners_[foot].size())});
    }
  }
  return count;
}

// An ideal six-axis sensor between the foot and a sole without mass: it reads exactly the contact
// forces. A plate on a fixed joint would measure its own weight too and cost six constraint rows
// per foot.
void Simulation::ReadFootWrenches(const robot::FootArray<Isometry3d>& sole,
                                  const robot::FootArray<Vector3d>& com) {
  int contact = 0;
  for (const robot::Foot f : kFeet) {
    Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();
    for (int c = 0; c < truth_.contact_points[f]; ++c, ++contact) {
      force += world_->contact_force(contact);
      moment += world_->contact_moment(contact);
    }
    // The world's moments are about the COM where the step began; so are the sole frames used here.
    const Matrix3d to_sole = sole[f].linear().transpose();
    truth_.foot_wrench[f] << to_sole * force,
        to_sole * (moment + (com[f] - sole[f].translation()).cross(force));
  }
}

Vector3d Simulation::ImuVelocity() const {
  const robot::ImuModel& imu = model_.imu();
  return PointVelocity(imu.body, world_->pose(imu.body) * imu.pose.translation());
}

Vector3d Simulation::PointVelocity(int body, const Vector3d& point) const {
  return world_->com_velocity(body) +
         world_->angular_velocity(body).cross(point - world_->com_position(body));
}

void Simulation::ReadTruth() {
  world_->GetState(&truth_.state);
  truth_.com.setZero();
  truth_.com_velocity.setZero();
  for (int b = 0; b < static_cast<int>(model_.bodies().size()); ++b) {
    const double share = model_.bodies()[static_cast<size_t>(b)].mass / model_.total_mass();
    truth_.com += share * world_->com_position(b);
    truth_.com_velocity += share * world_->com_velocity(b);
  }
  for (const robot::Foot f : kFeet) {
    truth_.foot_pose[f] = world_->pose(model_.feet()[f].body) * model_.feet()[f].sole;
  }
  truth_.motor_current = mean_current_;
  truth_.motor_torque = torque_;
  for (int j = 0; j < model_.num_joints(); ++j) {
    const Drivetrain& drivetrain = drivetrains_[static_cast<size_t>(j)];
    const bool rotor = drivetrain.elastic() && !drive_train_.link_encoder();
    truth_.encoder_position[j] =
        rotor ? drivetrain.rotor_position() : truth_.state.joint_position[j];
    truth_.encoder_velocity[j] =
        rotor ? drivetrain.rotor_velocity() : truth_.state.joint_velocity[j];
    truth_.friction_torque[j] = drivetrain.friction_torque();
  }
  const robot::ImuModel& imu = model_.imu();
  const Matrix3d from_imu = world_->rotation(imu.body) * imu.pose.linear();
  const Matrix3d to_imu = from_imu.transpose();
  truth_.imu_orientation = from_imu;
  truth_.imu_angular_velocity = to_imu * world_->angular_velocity(imu.body);
  truth_.imu_specific_force = to_imu * (imu_acceleration_ + kGravity * Vector3d::UnitZ());

  ReadPush();
  ReadCrane();
}

void Simulation::ReadCrane() {
  if (!crane_) return;
  const Vector3d point = world_->pose(0) * crane_->point();
  truth_.crane_point = point;
  truth_.crane_force = crane_->Force(point, PointVelocity(0, point));
  truth_.crane_share = crane_->share();
}

void Simulation::ReadPush() {
  truth_.push_force.setZero();
  truth_.push_point = truth_.state.base_position;
  double strongest = -1;
  for (const PushProfile& push : pushes_) {
    const Vector3d force = push.Force(time());
    truth_.push_force += force;
    if (force.norm() > strongest) {
      strongest = force.norm();
      truth_.push_point = world_->pose(push.body()) * push.point();
    }
  }
  for (size_t b = 0; b < forces_.size(); ++b) {
    const Vector3d& force = forces_[b].force;
    if (force.isZero(0)) continue;
    truth_.push_force += force;
    if (force.norm() > strongest) {
      strongest = force.norm();
      truth_.push_point = world_->pose(static_cast<int>(b)) * forces_[b].point;
    }
  }
  for (const HandSpring& hand : hands_) {
    const Vector3d point = world_->pose(hand.body()) * hand.point();
    const Vector3d force = hand.Force(time(), point, PointVelocity(hand.body(), point));
    truth_.push_force += force;
    if (force.norm() > strongest) {
      strongest = force.norm();
      truth_.push_point = point;
    }
  }
}

void Simulation::DetectFall() {
  if (fallen_) return;
  const double upright = world_->rotation(model_.body_task_body())(2, 2);
  const double tilt = std::acos(std::clamp(upright, -1.0, 1.0));
  // On blocks the height counts from the lower sole: they lie deeper than the ground, and give way.
  double ground = 0;
  if (terrain_.has_field()) {
    ground = std::min(truth_.foot_pose[0].translation().z(), truth_.foot_pose[1].translation().z());
  }
  const double share = (truth_.com.z() - ground) / start_com_height_;
  if (tilt > fall_tilt_) {
    fallen_ = true;
    WriteText(end_reason_, "the robot fell at {:.3f} s (body tilt {:.2f} rad)", time(), tilt);
  } else if (share < fall_height_) {
    fallen_ = true;
    WriteText(end_reason_, "the robot fell at {:.3f} s (centre of mass at {:.0f} % of its height)",
              time(), 100 * share);
  }
}

void Simulation::CheckCrane() {
  if (!crane_ || crane_->let_go() || steps_ < 0 || end_reason_[0] != '\0') return;
  WriteText(
      end_reason_,
      "the crane still holds the robot at {:.3f} s: the bridge has followed commands for {:.3f} s "
      "without a break; give the scenario a longer lead",
      time(), crane_->followed());
}

void Simulation::Break(std::string_view reason) {
  broken_ = true;
  if (fallen_) return;  // why the run ends is already said
  WriteText(end_reason_, "the simulation broke down at {:.3f} s: {}", time(), reason);
}

}  // namespace poise
