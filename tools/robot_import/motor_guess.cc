#include "tools/robot_import/motor_guess.h"

#include <algorithm>
#include <cstdlib>
#include <set>
#include <tuple>

#include "components/robot/robot_model.h"
#include "fmt/format.h"

namespace poise {
namespace {

// A motor turns about as fast as this at its joint's largest velocity: 22.5 for the knee of a G1,
// whose gear is 22.5, and 50 for the paper's robot, whose gear is 50.
constexpr double kMotorVelocity = 450;  // rad/s
constexpr double kMostGear = 160;
// From rest to its largest velocity, with its largest torque and no load, a drive takes about this
// long: 3.6 to 5.3 ms for those of a G1, 6 ms for the paper's robot.
constexpr double kSpinUp = 0.005;  // s
// Share of the torque that Coulomb friction takes, and viscous friction at 1 rad/s: 1.3 % and 0.33
// % for the paper's robot, less for gears of small ratio.
constexpr double kCoulombShare = 0.01;
constexpr double kViscousShare = 0.003;
constexpr double kPeakCurrent = 30;     // A, as the paper's robot
constexpr double kRatedShare = 0.5;     // of the peak, as the paper's robot
constexpr double kRatedReserve = 1.25;  // on what a joint bears while the robot stands on one foot
constexpr double kCurrentSteps = 2000;  // in the peak current
constexpr int kEncoderCounts = 16384;   // 14 bits
// The paper's robot's harmonic drives have these, over their 150 N·m.
constexpr double kStiffnessShare = 7e4 / 150, kDampingShare = 8.0 / 150;
constexpr size_t kMostLegJoints = 14;   // of a robot without arms: its motors may be equal
constexpr double kEffortPerMass = 2.5;  // N·m/kg: 2.7 (the paper's robot) to 4.2 (G1) at the knee
// N·m/kg: an H1-2's knee has 5.4; no leg stands with an ankle of a fifth of Romeo's weakest joint.
constexpr double kMostEffortPerMass = 5 * kEffortPerMass, kLeastEffortPerMass = 0.05;

double Digits(double value, int digits) {
  return std::strtod(fmt::format("{:.{}g}", value, digits).c_str(), nullptr);
}

}  // namespace

double GuessedEffort(double mass, bool strong) {
  return Digits(kEffortPerMass * mass * (strong ? 1 : 0.25), 2);
}

bool IsPlaceholderEffort(double effort, double mass, bool leg) {
  return effort > kMostEffortPerMass * mass || (leg && effort < kLeastEffortPerMass * mass);
}

MotorSources AddMotors(const robot::LinkTree& tree, const MakerFile& maker,
                       const std::map<std::string, double>& rotor, Robot* robot) {
  MotorSources sources;
  std::set<double> efforts;
  for (const robot::Joint& joint : tree.joints) efforts.insert(joint.effort);
  sources.effort_placeholder = efforts.size() == 1 && tree.joints.size() > kMostLegJoints;
  std::map<std::tuple<double, double, double, double, double>, int> known;
  for (const robot::Joint& joint : tree.joints) {
    const auto source =
        std::ranges::find(maker.source.joints, joint.name, &robot::SourceJoint::name);
    const double velocity = joint.velocity_limit;
    const double gear = Digits(std::clamp(kMotorVelocity / velocity, 1.0, kMostGear), 3);
    double inertia = joint.effort * kSpinUp / velocity;
    if (const auto hidden = rotor.find(joint.name); hidden != rotor.end()) {
      inertia = hidden->second;
    } else if (source->armature.value_or(0) > 0) {
      inertia = *source->armature;
      sources.armature = true;
    }
    double coulomb = source->friction.value_or(0), viscous = source->damping.value_or(0);
    sources.friction = sources.friction || coulomb > 0;
    sources.damping = sources.damping || viscous > 0;
    // A file that gives neither knows none of them.
    if (!(coulomb > 0) && !(viscous > 0)) {
      coulomb = kCoulombShare * joint.effort;
      viscous = kViscousShare * joint.effort;
    }
    const auto key =
        std::make_tuple(gear, joint.effort, Digits(inertia, 4), Digits(std::max(0.0, coulomb), 3),
                        Digits(std::max(0.0, viscous), 3));
    const auto [entry, is_new] = known.emplace(key, robot->motor_size());
    Motor* const motor = is_new ? robot->add_motor() : robot->mutable_motor(entry->second);
    motor->add_joint(joint.name);
    if (!is_new) continue;
    motor->set_gear_ratio(gear);
    motor->set_torque_constant(Digits(joint.effort / (kPeakCurrent * gear), 6));
    motor->set_rated_current(kRatedShare * kPeakCurrent);
    motor->set_peak_current(kPeakCurrent);
    motor->set_rotor_inertia(Digits(std::get<2>(key) / (gear * gear), 6));
    motor->set_encoder_counts(kEncoderCounts);
    motor->set_coulomb_friction(std::get<3>(key));
    motor->set_viscous_friction(std::get<4>(key));
  }
  return sources;
}

void RateMotors(const robot::LinkTree& tree, const std::optional<Eigen::VectorXd>& torque,
                Robot* robot) {
  std::map<std::string, double> share;  // of the limit, by joint
  for (size_t j = 0; j < tree.joints.size(); ++j) {
    const robot::Joint& joint = tree.joints[j];
    share[joint.name] =
        torque ? kRatedReserve * (*torque)[static_cast<Eigen::Index>(j)] / joint.effort : 1;
  }
  for (Motor& motor : *robot->mutable_motor()) {
    double rated = kRatedShare;
    for (const std::string& joint : motor.joint()) rated = std::max(rated, share.at(joint));
    motor.set_rated_current(Digits(std::min(rated, 1.0) * kPeakCurrent, 2));
  }
}

void AddDriveTrain(double torque, Robot* robot) {
  DriveTrain* const drive = robot->mutable_drive_train();
  drive->set_torque_lag(0.0005);
  drive->set_current_resolution(Digits(kPeakCurrent / kCurrentSteps, 3));
  drive->set_gear_stiffness(Digits(kStiffnessShare * torque, 2));
  drive->set_gear_damping(Digits(kDampingShare * torque, 2));
  drive->set_sensor_delay(0.002);
}

}  // namespace poise
