// MakeRobot: the maker's file and the Robot file brought together, and checked against each other.
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "components/framework/configuration/config_error.h"
#include "components/framework/configuration/field_rules.h"
#include "components/robot/link_tree.h"
#include "components/robot/sole.h"
#include "components/robot/urdf_source.h"
#include "components/robot_files/mjcf_source.h"
#include "components/robot_files/robot_files.h"

namespace poise::robot {
namespace {

constexpr int kContactDimension = 6;

Eigen::Isometry3d ToIsometry(const Pose& pose) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.translation() = Eigen::Vector3d(pose.x(), pose.y(), pose.z());
  result.linear() = (Eigen::AngleAxisd(pose.yaw(), Eigen::Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(pose.pitch(), Eigen::Vector3d::UnitY()) *
                     Eigen::AngleAxisd(pose.roll(), Eigen::Vector3d::UnitX()))
                        .toRotationMatrix();
  return result;
}

LinkTree::LinkPlace FindLink(const LinkTree& tree, const std::string& link,
                             const std::string& field) {
  if (link.empty()) throw RobotError(field + " is missing: name a link of the file");
  const auto place = tree.links.find(link);
  if (place == tree.links.end()) {
    throw RobotError(fmt::format("{}: the {} has no link '{}': name one of its links", field,
                                 tree.format, link));
  }
  return place->second;
}

/// Holds to the rules of robot.proto; what a robot cannot be used with is a RobotError.
void Check(const auto& rules) {
  try {
    rules();
  } catch (const ConfigError& error) {
    throw RobotError(error.what());
  }
}

MotorModel ToMotor(const Motor& motor, const std::string& field) {
  Check([&] {
    RequireFields(motor, {"torque_constant", "rated_current", "peak_current", "encoder_counts"},
                  field + ".");
  });
  MotorModel result;
  result.gear_ratio = motor.gear_ratio();
  result.torque_constant = motor.torque_constant();
  result.rated_current = motor.rated_current();
  result.peak_current = motor.peak_current();
  if (result.peak_current < result.rated_current) {
    throw RobotError(fmt::format("{}.peak_current {} A is below rated_current {} A: correct one",
                                 field, result.peak_current, result.rated_current));
  }
  result.reflected_inertia = motor.rotor_inertia() * motor.gear_ratio() * motor.gear_ratio();
  result.encoder_counts = motor.encoder_counts();
  result.current_sensor = motor.current_sensor();
  result.coulomb_friction = motor.coulomb_friction();
  result.viscous_friction = motor.viscous_friction();
  result.static_friction =
      motor.has_static_friction() ? motor.static_friction() : result.coulomb_friction;
  if (result.static_friction < result.coulomb_friction) {
    throw RobotError(fmt::format(
        "{}.static_friction {} N m is below coulomb_friction {} N m: raise it or leave it out",
        field, result.static_friction, result.coulomb_friction));
  }
  result.stribeck_velocity = motor.stribeck_velocity();
  if (!std::isfinite(result.reflected_inertia) || !std::isfinite(result.torque_per_ampere())) {
    throw RobotError(field + ": gear_ratio is too large to compute with: correct it");
  }
  return result;
}

std::vector<MotorModel> LoadMotors(const Robot& description, const LinkTree& tree) {
  std::vector<MotorModel> motors(tree.joints.size());
  std::vector<int> motor_of(tree.joints.size(), -1);
  for (int m = 0; m < description.motor_size(); ++m) {
    const std::string field = fmt::format("motor[{}]", m);
    const Motor& motor = description.motor(m);
    if (motor.joint_size() == 0) {
      throw RobotError(field + " names no joint: add joint: \"...\" or remove it");
    }
    const MotorModel loaded = ToMotor(motor, field);
    for (const std::string& name : motor.joint()) {
      if (tree.fixed_joints.contains(name)) {
        throw RobotError(fmt::format(
            "{}: joint '{}' is fixed in the {}: remove it here or make it revolute there", field,
            name, tree.format));
      }
      size_t j = 0;
      while (j < tree.joints.size() && tree.joints[j].name != name) ++j;
      if (j == tree.joints.size()) {
        throw RobotError(fmt::format("{}: the {} has no joint '{}': correct the name", field,
                                     tree.format, name));
      }
      if (motor_of[j] >= 0) {
        throw RobotError(fmt::format("{}: joint '{}' already has motor[{}]: remove one", field,
                                     name, motor_of[j]));
      }
      motor_of[j] = m;
      motors[j] = loaded;
    }
  }
  for (size_t j = 0; j < tree.joints.size(); ++j) {
    if (motor_of[j] < 0) {
      throw RobotError(
          fmt::format("joint '{}' of the {} has no motor: add it to a motor, lock it here or make "
                      "it fixed there",
                      tree.joints[j].name, tree.format));
    }
  }
  return motors;
}

void LoadSole(const poise::Foot& foot, const std::string& field, FootModel* result) {
  if (foot.vertex_size() == 0) {
    Check([&] { RequireFields(foot, {"length", "width"}, field + "."); });
    result->length = foot.length();
    result->width = foot.width();
    return;
  }
  if (foot.has_length() || foot.has_width()) {
    throw RobotError(field + " has both vertex and length or width: remove one of the two");
  }
  for (const SoleVertex& vertex : foot.vertex()) {
    result->vertices.emplace_back(vertex.x(), vertex.y());
  }
  if (const std::string problem = SoleProblem(result->vertices); !problem.empty()) {
    throw RobotError(
        fmt::format("{}.vertex{}{}", field, problem.front() == '[' ? "" : " ", problem));
  }
  const Eigen::Map<const Eigen::Matrix2Xd> corners(result->vertices.front().data(), 2,
                                                   foot.vertex_size());
  const Eigen::Vector2d extent = corners.rowwise().maxCoeff() - corners.rowwise().minCoeff();
  result->length = extent.x();
  result->width = extent.y();
}

FootModel LoadFoot(const poise::Foot& foot, const LinkTree& tree, const std::string& field) {
  FootModel result;
  result.name = foot.name();
  if (result.name.empty()) throw RobotError(field + ".name is missing: e.g. \"right\"");
  const LinkTree::LinkPlace place = FindLink(tree, foot.link(), field + ".link");
  result.body = place.body;
  result.sole = place.pose * ToIsometry(foot.sole());
  LoadSole(foot, field, &result);
  result.force_sensor = foot.force_sensor();
  int joints = 0;
  for (int b = place.body; b > 0; b = tree.bodies[static_cast<size_t>(b)].parent) ++joints;
  if (joints < kContactDimension) {
    throw RobotError(
        fmt::format("{} '{}': only {} joints lie between the base and link '{}': its foot cannot "
                    "make a six-dimensional contact, a leg needs six joints",
                    field, result.name, joints, foot.link()));
  }
  return result;
}

// Returns the sole's y in the base frame, all joints at zero.
double LateralPlace(const FootModel& foot, const LinkTree& tree) {
  Eigen::Vector3d point = foot.sole.translation();
  for (int b = foot.body; b > 0; b = tree.bodies[static_cast<size_t>(b)].parent) {
    point = tree.joints[static_cast<size_t>(b) - 1].origin * point;
  }
  return point.y();
}

FootArray<FootModel> LoadFeet(const Robot& description, const LinkTree& tree) {
  if (description.foot_size() != 2) {
    throw RobotError(fmt::format("foot: {} given, exactly two are needed, the right one first",
                                 description.foot_size()));
  }
  const FootModel right = LoadFoot(description.foot(0), tree, "foot[0]");
  const FootModel left = LoadFoot(description.foot(1), tree, "foot[1]");
  if (right.name == left.name) {
    throw RobotError(
        fmt::format("foot: both are named '{}': name them apart, right first", right.name));
  }
  if (right.body == left.body) {
    throw RobotError(
        fmt::format("foot: '{}' and '{}' are parts of one rigid body: name links of two legs",
                    right.name, left.name));
  }
  const double right_y = LateralPlace(right, tree), left_y = LateralPlace(left, tree);
  if (!(right_y < left_y)) {
    throw RobotError(fmt::format(
        "foot: with all joints at zero, foot[0] '{}' lies at y = {:.3g} m and foot[1] '{}' at y = "
        "{:.3g} m: list the right foot (smaller y) first",
        right.name, right_y, left.name, left_y));
  }
  return {right, left};
}

StanceModel LoadStance(const Stance& stance, const LinkTree& tree) {
  StanceModel result;
  result.joint_position = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(tree.joints.size()));
  for (int i = 0; i < stance.joint_size(); ++i) {
    const std::string field = fmt::format("stance.joint[{}]", i);
    const std::string& name = stance.joint(i).joint();
    size_t j = 0;
    while (j < tree.joints.size() && tree.joints[j].name != name) ++j;
    if (j == tree.joints.size()) {
      throw RobotError(fmt::format("{}: the {} has no joint '{}' that moves: correct the name",
                                   field, tree.format, name));
    }
    result.joint_position[static_cast<Eigen::Index>(j)] = stance.joint(i).position();
  }
  if (stance.has_com_height()) result.com_height = stance.com_height();
  if (stance.has_foot_spacing()) result.foot_spacing = stance.foot_spacing();
  return result;
}

DriveTrainModel LoadDriveTrain(const DriveTrain& drive) {
  return {.torque_lag = drive.torque_lag(),
          .current_resolution = drive.current_resolution(),
          .backlash = drive.backlash(),
          .gear_stiffness = drive.gear_stiffness(),
          .gear_damping = drive.gear_damping(),
          .link_encoder = drive.link_encoder(),
          .sensor_delay = drive.sensor_delay()};
}

[[noreturn]] void FailName(const RobotSource& source, const std::string& field, const char* kind,
                           const std::string& name) {
  throw RobotError(
      fmt::format("{}: the {} has no {} '{}': correct the name", field, source.format, kind, name));
}

SourceJoint& JointOf(RobotSource* source, const std::string& field, const std::string& name) {
  SourceJoint* const joint = source->FindJoint(name);
  if (joint == nullptr) FailName(*source, field, "joint", name);
  return *joint;
}

void ApplyRepair(const Repair& repair, const std::string& field, RobotSource* source) {
  SourceLink* const link = source->FindLink(repair.link());
  if (link == nullptr) FailName(*source, field, "link", repair.link());
  MassProperties& mass = link->mass;
  if (repair.has_mass()) mass.mass = repair.mass();
  if (repair.has_com()) mass.com = ToIsometry(repair.com()).translation();
  if (repair.has_inertia()) {
    const Inertia& i = repair.inertia();
    mass.inertia << i.ixx(), i.ixy(), i.ixz(), i.ixy(), i.iyy(), i.iyz(), i.ixz(), i.iyz(), i.izz();
  }
  if (!repair.has_rotor()) return;
  for (const SourceJoint& joint : source->joints) {
    if (joint.child != repair.link() || joint.kind == JointKind::kFixed) continue;
    const Eigen::Vector3d axis = joint.axis.normalized();
    mass.inertia -= repair.rotor() * axis * axis.transpose();
    return;
  }
  throw RobotError(
      fmt::format("{}.rotor: no joint moves link '{}': remove it", field, repair.link()));
}

// What the Robot file says of the maker's: repairs, limits, joints that stand still.
void Correct(const Robot& description, RobotSource* source) {
  for (int i = 0; i < description.repair_size(); ++i) {
    ApplyRepair(description.repair(i), fmt::format("repair[{}]", i), source);
  }
  for (int i = 0; i < description.limit_size(); ++i) {
    const JointLimit& limit = description.limit(i);
    const std::string field = fmt::format("limit[{}]", i);
    for (const std::string& name : limit.joint()) {
      SourceJoint& joint = JointOf(source, field, name);
      if (limit.has_lower()) joint.lower = limit.lower();
      if (limit.has_upper()) joint.upper = limit.upper();
      if (limit.has_effort()) joint.effort = limit.effort();
      if (limit.has_velocity()) joint.velocity = limit.velocity();
      joint.has_limits = true;
    }
  }
  for (int i = 0; i < description.lock_size(); ++i) {
    const std::string field = fmt::format("lock[{}]", i);
    for (const std::string& name : description.lock(i).joint()) {
      SourceJoint& joint = JointOf(source, field, name);
      if (joint.kind == JointKind::kFloating || joint.kind == JointKind::kOther) {
        throw RobotError(fmt::format(
            "{}: joint '{}' is neither revolute nor prismatic: it cannot be locked", field, name));
      }
      joint.locked = description.lock(i).position();
    }
  }
}

void Face(const Robot& description, LinkTree* tree) {
  for (int i = 0; i < description.facing_size(); ++i) {
    const Facing& facing = description.facing(i);
    const std::string field = fmt::format("facing[{}]", i);
    const LinkTree::LinkPlace place = FindLink(*tree, facing.link(), field + ".link");
    if (tree->bodies[static_cast<size_t>(place.body)].name != facing.link()) {
      throw RobotError(fmt::format("{}: link '{}' is fixed to '{}': name that one", field,
                                   facing.link(),
                                   tree->bodies[static_cast<size_t>(place.body)].name));
    }
    Pose pose;
    pose.set_roll(facing.roll());
    pose.set_pitch(facing.pitch());
    pose.set_yaw(facing.yaw());
    TurnBody(place.body, ToIsometry(pose).linear(), tree);
  }
}

}  // namespace

LinkTree MakeTree(const Robot& description, std::string_view maker_text,
                  std::vector<std::string>* warnings) {
  if (description.has_urdf() == description.has_mjcf() && description.has_urdf()) {
    throw RobotError("urdf and mjcf are both given: leave one out");
  }
  Check([&] { CheckFields(description); });
  RobotSource source = description.has_mjcf() ? ReadMjcf(maker_text, warnings).source
                                              : ReadUrdf(maker_text, warnings);
  Correct(description, &source);
  LinkTree tree = BuildLinkTree(source);
  Face(description, &tree);
  return tree;
}

RobotModel MakeRobot(const Robot& description, std::string_view maker_text,
                     std::vector<std::string>* warnings) {
  LinkTree tree = MakeTree(description, maker_text, warnings);
  RobotParts parts;
  parts.name = description.name().empty() ? tree.name : description.name();
  parts.motors = LoadMotors(description, tree);
  parts.feet = LoadFeet(description, tree);

  const Imu& imu = description.imu();
  const LinkTree::LinkPlace imu_place = FindLink(tree, imu.link(), "imu.link");
  parts.imu.body = imu_place.body;
  parts.imu.pose = imu_place.pose * ToIsometry(imu.pose());
  parts.imu.gyro_noise = imu.gyro_noise();
  parts.imu.gyro_bias = imu.gyro_bias();
  parts.imu.accelerometer_noise = imu.accelerometer_noise();
  parts.imu.accelerometer_bias = imu.accelerometer_bias();
  parts.force_noise = description.force_noise();
  parts.moment_noise = description.moment_noise();
  parts.body_task_body =
      FindLink(tree, description.has_body_link() ? description.body_link() : tree.root_link,
               "body_link")
          .body;

  parts.stance = LoadStance(description.stance(), tree);
  parts.drive_train = LoadDriveTrain(description.drive_train());

  for (const auto& [link, place] : tree.links) {
    parts.frames.push_back({link, place.body, place.pose});
  }
  parts.bodies = std::move(tree.bodies);
  parts.joints = std::move(tree.joints);
  return RobotModel(std::move(parts));
}

}  // namespace poise::robot
