#include "tools/robot_import/robot_import.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "components/balance/contact_dynamics.h"
#include "components/framework/configuration/configuration.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "tools/robot/standing_loads.h"
#include "tools/robot_import/body_shapes.h"
#include "tools/robot_import/feet_import.h"
#include "tools/robot_import/file_defects.h"
#include "tools/robot_import/maker_file.h"
#include "tools/robot_import/motor_guess.h"
#include "tools/robot_import/robot_fields.h"
#include "tools/robot_import/sole_finder.h"
#include "tools/robot_import/stance_finder.h"

namespace poise {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using robot::LinkTree;
using robot::RobotError;

constexpr double kSameTurn = 1e-4;  // rad: a frame that is off by less counts as upright
// m, from hip to ankle: Atlas has 0.8, OP3 0.2.
constexpr double kLongestLeg = 5, kShortestLeg = 0.03;
// kg/m³, a robot's mass over the cube of its leg's length: a person has 100, OP3 300.
constexpr double kMostDensity = 5000;
constexpr double kStraight = 0.01;  // rad: a joint that is nearer to zero is left there
// Common sensors have these errors where the file has none: the paper's robot's.
constexpr double kGyroNoise = 2e-4, kGyroBias = 7.5e-6;                   // rad/s
constexpr double kAccelerometerNoise = 1.7e-2, kAccelerometerBias = 0.1;  // m/s²

class Import {
 public:
  explicit Import(const ImportOptions& options)
      : options_(options),
        maker_(ReadMakerFile(options.file, options.srdf)),
        shapes_(options, maker_) {}

  RobotImport Run() {
    NameIt();
    for (const std::string& line : maker_.left_out) result_.defects.push_back({line, "left out"});
    RepairDefects(options_.lock, &maker_, &result_, &rotor_);
    FindLegs();
    FindFeet();
    FindImu();
    BodyLink();
    Motors();
    FindStanding();
    FaceImu();
    robot::MakeRobot(robot(), maker_.text);  // what is written loads
    return std::move(result_);
  }

 private:
  Robot& robot() { return result_.robot; }
  void Say(std::string what, std::string value, std::string from, Sureness sureness) {
    result_.findings.push_back({std::move(what), std::move(value), std::move(from), sureness});
  }
  LinkTree Tree() { return robot::MakeTree(robot(), maker_.text); }

  void NameIt() {
    std::string name = options_.name.empty() ? maker_.source.name : options_.name;
    if (name.empty()) name = options_.file.stem().string();
    std::string clean;
    for (const char c : Lower(name)) {
      clean += std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-' ? c : '_';
    }
    robot().set_name(clean.empty() ? "robot" : clean);
    const std::string file = options_.file.filename().string();
    maker_.is_mjcf ? robot().set_mjcf(file) : robot().set_urdf(file);
    Say("name", robot().name(), options_.name.empty() ? "the file" : "as told", Sureness::kSure);
  }

  /// The posture of the file in which feet and soles are looked for.
  const robot::MjcfKey* FilePosture() {
    for (const char* wanted : {"half_sitting", "half_sit", "stand", "home", "ready", "default"}) {
      for (const robot::MjcfKey& key : maker_.postures) {
        if (options_.stance.empty() ? Contains(key.name, wanted) : key.name == options_.stance) {
          return &key;
        }
      }
    }
    if (options_.stance.empty()) return nullptr;
    std::string names;
    for (const robot::MjcfKey& key : maker_.postures) {
      names += (names.empty() ? "" : ", ") + key.name;
    }
    throw ConfigError(fmt::format("--stance {}: the file names no such posture; it has {}",
                                  options_.stance, names.empty() ? "none" : names));
  }

  Eigen::VectorXd Posture(const LinkTree& tree) {
    Eigen::VectorXd joints = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(tree.joints.size()));
    const robot::MjcfKey* const key = FilePosture();
    for (size_t j = 0; key != nullptr && j < tree.joints.size(); ++j) {
      const auto known = key->joint.find(tree.joints[j].name);
      if (known != key->joint.end()) joints[static_cast<Eigen::Index>(j)] = known->second;
    }
    return joints;
  }

  void FindLegs() {
    const LinkTree tree = Tree();
    if (tree.joints.size() > static_cast<size_t>(balance::kMaxJoints)) {
      throw RobotError(
          fmt::format("{}: {} joints move, and Poise takes {} at most: --lock those "
                      "that need not",
                      tree.format, tree.joints.size(), balance::kMaxJoints));
    }
    const std::vector<Isometry3d> poses = BodyPoses(tree, Posture(tree));
    Vector3d up = maker_.root_orientation.inverse() * Vector3d::UnitZ();
    if (up.z() > std::cos(kSameTurn)) up = Vector3d::UnitZ();
    std::vector<double> low;
    for (size_t b = 0; b < poses.size(); ++b) {
      double deepest = 0;
      const auto reach = [&](const Vector3d& p) {
        deepest = std::max(deepest, -(poses[b].linear() * p).dot(up));
      };
      reach(tree.bodies[b].com);
      for (const auto& [link, place] : tree.links) {
        if (place.body == static_cast<int>(b)) reach(place.pose.translation());
      }
      const Vector3d down = poses[b].linear().transpose() * -up;
      for (const bool collides : {true, false}) {
        for (const Vector3d& p : LowPoints(shapes_.Of(tree, static_cast<int>(b), collides), down)) {
          reach(p);
        }
      }
      low.push_back(deepest);
    }
    anatomy_ = FindAnatomy(tree, poses, up, low, options_.foot,
                           [&](const std::string& link) { return LockedOnTheWay(tree, link); });
    CheckUnits(tree, poses);
    for (size_t f = 0; f < 2; ++f) {
      std::string joints;
      for (const int j : anatomy_.leg[f].joints) {
        joints += (joints.empty() ? "" : ", ") + tree.joints[static_cast<size_t>(j)].name;
      }
      Say(f == 0 ? "right leg" : "left leg", joints,
          options_.foot[f].empty() ? "reaches lowest; side: " + anatomy_.sides_from : "as told",
          anatomy_.sides);
    }
    if (!anatomy_.facing.isIdentity(kSameTurn)) {
      const double yaw = std::atan2(anatomy_.facing(1, 0), anatomy_.facing(0, 0));
      result_.defects.push_back(
          {fmt::format(
               "the root link '{}' does not face along its x axis (turned by {:.4g} degrees "
               "about z)",
               tree.root_link, yaw * 180 / std::numbers::pi),
           "facing: its frame is turned, x forward, z up"});
      AddFacing(tree.root_link, anatomy_.facing);
    }
    Say("forward",
        fmt::format("({:.3g}, {:.3g}, {:.3g}) of {}", anatomy_.facing(0, 0) + 0.0,
                    anatomy_.facing(1, 0) + 0.0, anatomy_.facing(2, 0) + 0.0, tree.root_link),
        anatomy_.forward_from, anatomy_.forward);
  }

  /// Names the file's joints from the root to the links of a body that stand still, with why.
  std::string LockedOnTheWay(const LinkTree& tree, const std::string& body) {
    std::map<std::string, const robot::SourceJoint*> above;  // by child link
    for (const robot::SourceJoint& joint : maker_.source.joints) above[joint.child] = &joint;
    std::set<std::string> locked;
    for (const auto& [link, place] : tree.links) {
      if (place.body != tree.links.at(body).body) continue;
      for (auto up = above.find(link); up != above.end(); up = above.find(up->second->parent)) {
        if (up->second->locked) locked.insert(up->second->name);
      }
    }
    std::string text;
    for (const std::string& joint : locked) {
      const std::string begin = fmt::format("joint '{}' ", joint);
      for (const Defect& defect : result_.defects) {
        if (defect.what.starts_with(begin)) text += (text.empty() ? "" : ", ") + defect.what;
      }
    }
    if (text.empty()) return "";
    const bool tendons = std::ranges::any_of(
        maker_.left_out, [](const std::string& line) { return Contains(line, "<tendon>"); });
    return fmt::format("; on its way {}{}", text,
                       tendons ? ", and what <tendon> moves is left out" : "");
  }

  /// Lengths and masses in another unit are no robot's.
  void CheckUnits(const LinkTree& tree, const std::vector<Isometry3d>& poses) {
    double mass = 0;
    for (const robot::Body& body : tree.bodies) mass += body.mass;
    const Leg& leg = anatomy_.leg[0];
    const auto hip = static_cast<size_t>(tree.joints[static_cast<size_t>(leg.joints[0])].body);
    const double length =
        (poses[static_cast<size_t>(leg.body)].translation() - poses[hip].translation()).norm();
    if (length > kLongestLeg || length < kShortestLeg) {
      result_.defects.push_back({fmt::format("the legs are {:.3g} m long: are lengths in {}?",
                                             length, length > kLongestLeg ? "mm" : "another unit"),
                                 "kept, and nothing can be right before the file has them in m"});
    } else if (mass > kMostDensity * std::pow(length, 3)) {
      result_.defects.push_back(
          {fmt::format("the robot has {:.3g} kg on legs of {:.3g} m: are masses in g?", mass,
                       length),
           "kept, and nothing can be right before the file has them in kg"});
    }
  }

  void AddFacing(const std::string& link, const Matrix3d& turn) {
    Isometry3d pose = Isometry3d::Identity();
    pose.linear() = turn;
    Pose rpy;
    SetPose(pose, &rpy);
    Facing* const facing = robot().add_facing();
    facing->set_link(link);
    if (rpy.has_roll()) facing->set_roll(rpy.roll());
    if (rpy.has_pitch()) facing->set_pitch(rpy.pitch());
    if (rpy.has_yaw()) facing->set_yaw(rpy.yaw());
  }

  void FindFeet() {
    const LinkTree tree = Tree();  // its root faces forward now
    AddFeet(options_, maker_, tree, BodyPoses(tree, Posture(tree)), anatomy_, &shapes_, &result_);
  }

  void FindImu() {
    const LinkTree tree = Tree();
    std::string best = options_.imu;
    std::string from = "as told";
    Sureness sureness = Sureness::kSure;
    if (!best.empty() && !tree.links.contains(best)) {
      throw ConfigError(fmt::format("--imu {}: the file has no such link", best));
    }
    size_t nearest = SIZE_MAX;
    const auto offer = [&](const std::string& link, const std::string& why, Sureness sure) {
      const auto place = tree.links.find(link);
      if (!options_.imu.empty() || place == tree.links.end()) return;
      size_t depth = 0;
      for (int b = place->second.body; b > 0; b = tree.bodies[static_cast<size_t>(b)].parent)
        ++depth;
      if (depth >= nearest) return;
      nearest = depth;
      best = link;
      from = why;
      sureness = sure;
    };
    for (const robot::MjcfSensor& sensor : maker_.sensors) {
      if (sensor.kind == "imu" || sensor.kind == "gyro") {
        offer(sensor.site, "sensor '" + sensor.kind + "'", Sureness::kSure);
      }
    }
    for (const char* word : {"imu", "gsensor", "gyro", "accelerometer"}) {
      if (!best.empty()) break;
      for (const auto& [link, place] : tree.links) {
        if (Contains(link, word)) offer(link, "its name", Sureness::kLikely);
      }
    }
    if (best.empty()) offer(tree.root_link, "the file shows none: the root link", Sureness::kGuess);
    Imu* const imu = robot().mutable_imu();
    imu->set_link(best);
    imu->set_gyro_noise(kGyroNoise);
    imu->set_gyro_bias(kGyroBias);
    imu->set_accelerometer_noise(kAccelerometerNoise);
    imu->set_accelerometer_bias(kAccelerometerBias);
    for (const robot::MjcfSensor& sensor : maker_.sensors) {
      if (sensor.site != best || !(sensor.noise > 0)) continue;
      if (sensor.kind == "gyro") imu->set_gyro_noise(sensor.noise);
      if (sensor.kind == "accelerometer") imu->set_accelerometer_noise(sensor.noise);
    }
    Say("IMU", best, from, sureness);
  }

  void BodyLink() {
    const LinkTree tree = Tree();
    if (!options_.body.empty() && !tree.links.contains(options_.body)) {
      throw ConfigError(fmt::format("--body {}: the file has no such link", options_.body));
    }
    robot().set_body_link(options_.body.empty() ? tree.root_link : options_.body);
    Say("body", robot().body_link(),
        !options_.body.empty() ? "as told"
        : anatomy_.hips == 0   ? "the link that carries both legs"
                               : fmt::format("the root link; the legs part below it, at '{}'",
                                             tree.bodies[static_cast<size_t>(anatomy_.hips)].name),
        Sureness::kSure);
  }

  void Motors() {
    const LinkTree tree = Tree();
    const MotorSources sources = AddMotors(tree, maker_, rotor_, &robot());
    double torque = 0;
    for (const Leg& leg : anatomy_.leg) {
      for (const int j : leg.joints) {
        torque = std::max(torque, tree.joints[static_cast<size_t>(j)].effort);
      }
    }
    AddDriveTrain(torque, &robot());
    Say("motors",
        fmt::format("{} joints, {} kind{}", tree.joints.size(), robot().motor_size(),
                    robot().motor_size() == 1 ? "" : "s"),
        "torques and velocities of the file; gears and encoders by class; rated: half of the peak, "
        "or more where one foot takes it",
        Sureness::kGuess);
    Say("rotor inertia",
        fmt::format("{} from links, the rest {}", rotor_.size(),
                    sources.armature ? "armature" : "by class"),
        sources.armature || !rotor_.empty() ? "the file" : "5 ms from rest to full velocity",
        sources.armature ? Sureness::kSure
        : rotor_.empty() ? Sureness::kGuess
                         : Sureness::kLikely);
    Say("friction", sources.friction || sources.damping ? "as given, else by class" : "by class",
        sources.friction || sources.damping ? "the file" : "1 % of the torque, 0.3 % at 1 rad/s",
        sources.friction || sources.damping ? Sureness::kLikely : Sureness::kGuess);
    Say("drive train", fmt::format("{:g} N·m/rad, 2 ms", robot().drive_train().gear_stiffness()),
        "the largest torque of a leg", Sureness::kGuess);
    if (sources.effort_placeholder) {
      result_.defects.push_back({fmt::format("all {} joints have one torque limit, {:g} N·m",
                                             tree.joints.size(), tree.joints[0].effort),
                                 "kept, but no robot has one motor for legs and wrists"});
    }
  }

  void FindStanding() {
    const robot::RobotModel model = robot::MakeRobot(robot(), maker_.text);
    const LinkTree tree = Tree();
    const robot::MjcfKey* const key = FilePosture();
    FoundStance stance;
    std::string from = "inverse kinematics from bent knees";
    Sureness sureness = Sureness::kLikely;
    bool solved = false;
    if (key != nullptr) {
      // The maker's posture, where it bends the knees.
      try {
        stance = FindStance(model, anatomy_, WithinLimits(model, Posture(tree)), false);
        from = fmt::format("{} '{}'", maker_.postures_from, key->name);
        sureness = Sureness::kSure;
        solved = true;
      } catch (const RobotError&) {
        from += fmt::format(" ({} '{}' cannot stand level)", maker_.postures_from, key->name);
      }
    }
    try {
      if (!solved) stance = FindStance(model, anatomy_, WithinLimits(model, Posture(tree)), true);
    } catch (const RobotError& error) {
      throw RobotError(fmt::format(
          "{}; taken for feet were '{}' on the right and '{}' on the left: if others are, name "
          "both with --right-foot and --left-foot",
          error.what(), robot().foot(0).link(), robot().foot(1).link()));
    }
    if (stance.wider_spacing > 0) {
      const std::string& joint =
          model.joints()[static_cast<size_t>(std::max(0, stance.strained))].name;
      from += fmt::format("; nearer than {:.3f} m, where {}", stance.wider_spacing,
                          stance.strained < 0 ? "no posture is on one foot"
                                              : fmt::format("one foot takes {:.0f} % of {}",
                                                            100 * stance.strain, joint));
      sureness = Sureness::kLikely;
    }
    Stance* const written = robot().mutable_stance();
    written->set_com_height(stance.com_height);
    written->set_foot_spacing(stance.foot_spacing);
    for (int j = 0; j < model.num_joints(); ++j) {
      if (std::abs(stance.joint_position[j]) < kStraight) continue;
      JointPosition* const joint = written->add_joint();
      joint->set_joint(model.joints()[static_cast<size_t>(j)].name);
      joint->set_position(stance.joint_position[j]);
    }
    RateMotors(tree, OneFootTorque(model, stance.state), &robot());
    Say("stance",
        fmt::format("COM {:.3f} m high, feet {:.3f} m apart", stance.com_height,
                    stance.foot_spacing),
        from, sureness);
  }

  /// The body that carries the IMU faces forward as well: the bridge reads its tilt.
  void FaceImu() {
    const LinkTree tree = Tree();
    const std::vector<Isometry3d> poses = BodyPoses(tree, Posture(tree));
    std::set<int> done = {0};
    for (const std::string& link : {robot().imu().link(), robot().body_link()}) {
      const int body = tree.links.at(link).body;
      const Matrix3d turn = poses[static_cast<size_t>(body)].linear().transpose();
      if (!done.insert(body).second || turn.isIdentity(kSameTurn)) continue;
      const std::string& name = tree.bodies[static_cast<size_t>(body)].name;
      AddFacing(name, turn);
      Say("facing", name, "upright with all joints at zero", Sureness::kLikely);
    }
  }

  const ImportOptions& options_;
  MakerFile maker_;
  BodyShapes shapes_;
  RobotImport result_;
  std::map<std::string, double> rotor_;  // kg·m² by joint
  Anatomy anatomy_;
};

}  // namespace

RobotImport ImportRobot(const ImportOptions& options) { return Import(options).Run(); }

}  // namespace poise
