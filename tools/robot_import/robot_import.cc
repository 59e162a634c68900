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
#include "tools/robot/maker_shapes.h"
#include "tools/robot/mesh_file.h"
#include "tools/robot/standing_loads.h"
#include "tools/robot_import/file_defects.h"
#include "tools/robot_import/maker_file.h"
#include "tools/robot_import/motor_guess.h"
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
// A sole is taken to have this share of the leg's length from hip to sole where nothing shows it:
// G1 has 0.26, Talos 0.26, TOCABI 0.35, the paper's robot 0.36. Its width over its length is 0.35,
// 0.62, 0.57, 0.5.
constexpr double kSoleOfLeg = 0.28, kWidthOfSole = 0.45;
// m, from hip to ankle: Atlas has 0.8, OP3 0.2.
constexpr double kLongestLeg = 5, kShortestLeg = 0.03;
// kg/m³, a robot's mass over the cube of its leg's length: a person has 100, OP3 300.
constexpr double kMostDensity = 5000;
constexpr double kStraight = 0.01;   // rad: a joint that is nearer to zero is left there
constexpr double kRectangle = 5e-4;  // m: a polygon that differs by less is one
constexpr double kSameSole = 0.01;   // m: soles whose sizes differ by more are no mirror images
// Common sensors have these errors where the file has none: the paper's robot's.
constexpr double kGyroNoise = 2e-4, kGyroBias = 7.5e-6;                   // rad/s
constexpr double kAccelerometerNoise = 1.7e-2, kAccelerometerBias = 0.1;  // m/s²
constexpr double kForceNoise = 1, kMomentNoise = 0.05;                    // N, N·m

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool Contains(const std::string& text, const char* word) {
  return Lower(text).find(word) != std::string::npos;
}

double Clean(double value) { return std::round(value * 1e6) / 1e6 + 0.0; }

void SetPose(const Isometry3d& pose, Pose* result) {
  const Vector3d& p = pose.translation();
  if (Clean(p.x()) != 0) result->set_x(Clean(p.x()));
  if (Clean(p.y()) != 0) result->set_y(Clean(p.y()));
  if (Clean(p.z()) != 0) result->set_z(Clean(p.z()));
  const Matrix3d& r = pose.linear();
  const double pitch = std::asin(std::clamp(-r(2, 0), -1.0, 1.0));
  const double roll = std::atan2(r(2, 1), r(2, 2)), yaw = std::atan2(r(1, 0), r(0, 0));
  const auto angle = [](double a) { return std::round(a * 1e10) / 1e10; };
  if (std::abs(roll) > 1e-9) result->set_roll(angle(roll));
  if (std::abs(pitch) > 1e-9) result->set_pitch(angle(pitch));
  if (std::abs(yaw) > 1e-9) result->set_yaw(angle(yaw));
}

class Import {
 public:
  explicit Import(const ImportOptions& options)
      : options_(options), maker_(ReadMakerFile(options.file, options.srdf)) {}

  RobotImport Run() {
    NameIt();
    for (const std::string& line : maker_.left_out) result_.defects.push_back({line, "left out"});
    RepairDefects(options_.lock, &maker_, &result_, &rotor_);
    FindLegs();
    FindSoles();
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

  /// Shapes of a body's links, in its frame.
  std::vector<FootShape> ShapesOf(const LinkTree& tree, int body, bool collides) {
    std::vector<FootShape> shapes;
    for (const robot::SourceShape& source : maker_.shapes) {
      const auto place = tree.links.find(source.link);
      if (place == tree.links.end() || place->second.body != body || source.collides != collides) {
        continue;
      }
      FootShape shape{source.kind, place->second.pose * source.pose, source.size, {}};
      if (source.kind == robot::SourceShape::Kind::kMesh) {
        const std::filesystem::path file =
            FindMesh({options_.file, maker_.mesh_folder, options_.meshes}, source.mesh);
        if (file.empty()) {
          missing_[source.mesh] = "it is not there";
          continue;
        }
        const auto [known, is_new] = meshes_.try_emplace(file.string());
        Mesh& mesh = known->second;
        if (is_new) mesh.points = MeshPoints(file, &mesh.problem);
        if (!mesh.problem.empty()) {
          missing_[source.mesh] = mesh.problem;
          continue;
        }
        for (const Vector3d& p : mesh.points) {
          shape.points.push_back(shape.pose * source.size.cwiseProduct(p));
        }
      }
      shapes.push_back(std::move(shape));
    }
    return shapes;
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
        for (const Vector3d& p : LowPoints(ShapesOf(tree, static_cast<int>(b), collides), down)) {
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

  void FindSoles() {
    const LinkTree tree = Tree();  // its root faces forward now
    const std::vector<Isometry3d> poses = BodyPoses(tree, Posture(tree));
    std::array<FootSole, 2> soles = {SoleOf(tree, poses, 0), SoleOf(tree, poses, 1)};
    Compare(poses, &soles);
    for (size_t f = 0; f < 2; ++f) {
      FootSole& sole = soles[f];
      const Leg& leg = anatomy_.leg[f];
      if (options_.sole) {
        SetRectangle((*options_.sole)[0], (*options_.sole)[1], &sole.found);
        sole.from = "as told";
        sole.sureness = Sureness::kSure;
      }
      Foot* const foot = robot().add_foot();
      foot->set_name(f == 0 ? "right" : "left");
      WriteSole(tree, leg.body, options_.foot[f].empty() ? sole.link : options_.foot[f], sole.found,
                foot);
      Say(fmt::format("{} sole", foot->name()), SoleValue(*foot), sole.from, sole.sureness);
      const auto [sensor, why] = ForceSensor(tree, leg);
      foot->set_force_sensor(sensor);
      Say(fmt::format("{} force sensor", foot->name()), sensor ? "yes" : "none", why,
          sensor ? Sureness::kLikely : Sureness::kGuess);
    }
    robot().set_force_noise(kForceNoise);
    robot().set_moment_noise(kMomentNoise);
  }

  struct FootSole {
    FoundSole found;
    std::string from, link;  ///< a link that is named for it, or none
    Sureness sureness = Sureness::kSure;
  };

  FootSole SoleOf(const LinkTree& tree, const std::vector<Isometry3d>& poses, size_t f) {
    const Leg& leg = anatomy_.leg[f];
    const Matrix3d in_body = poses[static_cast<size_t>(leg.body)].linear().transpose();
    const Vector3d down = in_body * -Vector3d::UnitZ(), forward = in_body * Vector3d::UnitX();
    missing_.clear();
    FootSole sole;
    sole.found = FindSole(ShapesOf(tree, leg.body, true), down, forward);
    sole.from = "collision shapes";
    if (!sole.found.polygon.empty()) return sole;
    sole.found = FindSole(ShapesOf(tree, leg.body, false), down, forward);
    sole.from = "visual shapes";
    sole.sureness = Sureness::kLikely;
    if (!sole.found.polygon.empty()) return sole;
    sole.link = SoleFrame(tree, leg.body);
    sole.from = "share of the leg's length";
    sole.sureness = Sureness::kGuess;
    if (!missing_.empty()) TellMissing(*missing_.begin());
    sole.found = GuessedSole(tree, poses, leg, sole.link, down, forward);
    return sole;
  }

  /// Right and left soles are mirror images: where they are of two kinds, the better founded one
  /// serves for both.
  void Compare(const std::vector<Isometry3d>& poses, std::array<FootSole, 2>* soles) {
    const auto size = [&](size_t f) -> Eigen::Vector2d {
      Eigen::AlignedBox2d box;
      for (const Eigen::Vector2d& p : (*soles)[f].found.polygon) box.extend(p);
      return box.sizes();
    };
    const auto told = [&](size_t f) {
      return fmt::format("{:.3g} x {:.3g} m of {}", size(f).x(), size(f).y(), (*soles)[f].from);
    };
    const bool alike = (*soles)[0].sureness == (*soles)[1].sureness;
    if ((alike && (size(0) - size(1)).cwiseAbs().maxCoeff() < kSameSole) || options_.sole) return;
    const std::string what = fmt::format("the soles differ: right {}, left {}", told(0), told(1));
    if (alike) {
      result_.defects.push_back({what, "kept; --sole LENGTH WIDTH says what both are"});
      return;
    }
    const size_t good = (*soles)[0].sureness < (*soles)[1].sureness ? 0 : 1;
    result_.defects.push_back(
        {what, fmt::format("both that of the {} foot's {}, mirrored; --sole says better",
                           good == 0 ? "right" : "left", (*soles)[good].from)});
    // Across the sagittal plane, each about its foot's own frame.
    const Isometry3d& from = poses[static_cast<size_t>(anatomy_.leg[good].body)];
    const Isometry3d& to = poses[static_cast<size_t>(anatomy_.leg[1 - good].body)];
    const Eigen::DiagonalMatrix<double, 3> mirror(1, -1, 1);
    const Isometry3d sole = from * (*soles)[good].found.frame;
    Isometry3d mirrored = Isometry3d::Identity();
    mirrored.linear() = mirror * sole.linear() * mirror;
    mirrored.translation() = to.translation() + mirror * (sole.translation() - from.translation());
    FootSole& other = (*soles)[1 - good];
    other = (*soles)[good];
    other.link.clear();
    other.found.frame = to.inverse() * mirrored;
    std::ranges::reverse(other.found.polygon);
    for (Eigen::Vector2d& p : other.found.polygon) p.y() = -p.y();
    other.from += " of the other foot, mirrored";
    other.sureness = Sureness::kLikely;
  }

  void TellMissing(const std::pair<std::string, std::string>& mesh) {
    if (std::exchange(told_missing_, true) || options_.sole) return;
    result_.defects.push_back(
        {fmt::format("the soles are meshes, and '{}' cannot be read: {}", mesh.first, mesh.second),
         "guess: a share of the leg's length; --meshes FOLDER or --sole LENGTH WIDTH say better"});
  }

  static void SetRectangle(double length, double width, FoundSole* sole) {
    const double x = length / 2, y = width / 2;
    sole->polygon = {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
  }

  /// A link of the foot that is named for its sole.
  static std::string SoleFrame(const LinkTree& tree, int body) {
    for (const auto& [link, place] : tree.links) {
      if (place.body == body && Contains(link, "sole")) return link;
    }
    return "";
  }

  FoundSole GuessedSole(const LinkTree& tree, const std::vector<Isometry3d>& poses, const Leg& leg,
                        const std::string& frame, const Vector3d& down, const Vector3d& forward) {
    FoundSole sole;
    sole.frame.linear().col(0) = forward;
    sole.frame.linear().col(1) = -down.cross(forward);
    sole.frame.linear().col(2) = -down;
    Vector3d place = Vector3d::Zero();
    for (const auto& [link, at] : tree.links) {
      if (at.body != leg.body) continue;
      if (frame.empty() ? at.pose.translation().dot(down) > place.dot(down) : link == frame) {
        place = at.pose.translation();
      }
    }
    sole.frame.translation() = place;
    const auto hip = static_cast<size_t>(tree.joints[static_cast<size_t>(leg.joints[0])].body);
    const double length =
        kSoleOfLeg *
        (poses[static_cast<size_t>(leg.body)] * place - poses[hip].translation()).norm();
    SetRectangle(std::round(length * 1e3) / 1e3, std::round(kWidthOfSole * length * 1e3) / 1e3,
                 &sole);
    return sole;
  }

  /// The link of the body that has most shapes, or its own.
  std::string FootLink(const LinkTree& tree, int body) {
    std::string best = tree.bodies[static_cast<size_t>(body)].name;
    int most = 0;
    for (const auto& [link, place] : tree.links) {
      if (place.body != body) continue;
      const auto count =
          static_cast<int>(std::ranges::count_if(maker_.shapes, [&, &name = link](const auto& s) {
            return s.link == name && s.collides;
          }));
      if (count > most) most = count, best = link;
    }
    return best;
  }

  void WriteSole(const LinkTree& tree, int body, const std::string& wanted, const FoundSole& sole,
                 Foot* foot) {
    const std::string link = wanted.empty() ? FootLink(tree, body) : wanted;
    foot->set_link(link);
    SetPose(tree.links.at(link).pose.inverse() * sole.frame, foot->mutable_sole());
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& p : sole.polygon) box.extend(p);
    bool rectangle = true;
    for (const Eigen::Vector2d& p : sole.polygon) {
      rectangle = rectangle && (p.cwiseAbs() - box.sizes() / 2).cwiseAbs().maxCoeff() < kRectangle;
    }
    if (rectangle) {
      foot->set_length(Clean(box.sizes().x()));
      foot->set_width(Clean(box.sizes().y()));
      return;
    }
    for (const Eigen::Vector2d& p : sole.polygon) {
      SoleVertex* const vertex = foot->add_vertex();
      vertex->set_x(Clean(p.x()));
      vertex->set_y(Clean(p.y()));
    }
  }

  static std::string SoleValue(const Foot& foot) {
    if (foot.vertex().empty()) {
      return fmt::format("{:.3g} x {:.3g} m, at {}", foot.length(), foot.width(), foot.link());
    }
    Eigen::AlignedBox2d box;
    for (const SoleVertex& v : foot.vertex()) box.extend(Eigen::Vector2d(v.x(), v.y()));
    return fmt::format("polygon of {} corners within {:.3g} x {:.3g} m, at {}", foot.vertex_size(),
                       box.sizes().x(), box.sizes().y(), foot.link());
  }

  std::pair<bool, std::string> ForceSensor(const LinkTree& tree, const Leg& leg) {
    const auto at_foot = [&](const std::string& place) {
      if (const auto link = tree.links.find(place); link != tree.links.end()) {
        return link->second.body == leg.body;
      }
      for (const robot::SourceJoint& joint : maker_.source.joints) {
        const auto child = tree.links.find(joint.child);
        if (joint.name == place && child != tree.links.end()) return child->second.body == leg.body;
      }
      return false;
    };
    std::vector<std::string> places;
    std::string kind;
    for (const robot::MjcfSensor& sensor : maker_.sensors) {
      const bool force = Contains(sensor.kind, "force") || sensor.kind == "feedback";
      const bool known = std::ranges::find(places, sensor.site) != places.end();
      if (!force || known || !at_foot(sensor.site)) continue;
      if (kind.empty()) kind = sensor.kind;
      places.push_back(sensor.site);
    }
    if (places.size() == 1) return {true, fmt::format("sensor '{}' at {}", kind, places[0])};
    if (places.size() > 1) {
      return {true, fmt::format("the sum of {} sensors, at {}", places.size(),
                                fmt::join(places, " and "))};
    }
    for (const auto& [link, place] : tree.links) {
      if (place.body == leg.body && (Contains(link, "ft_sensor") || Contains(link, "force") ||
                                     Contains(link, "_ft_") || Lower(link).ends_with("_ft"))) {
        places.push_back(link);
      }
    }
    if (places.empty()) return {false, "the file shows none"};
    return {true, fmt::format("link {}", fmt::join(places, ", "))};
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
  RobotImport result_;
  std::map<std::string, double> rotor_;  // kg·m² by joint
  Anatomy anatomy_;
  struct Mesh {
    std::vector<Vector3d> points;  // in the file's unit
    std::string problem;
  };
  std::map<std::string, Mesh> meshes_;          // by file
  std::map<std::string, std::string> missing_;  // a foot's meshes that are not known, and why
  bool told_missing_ = false;
};

}  // namespace

RobotImport ImportRobot(const ImportOptions& options) { return Import(options).Run(); }

}  // namespace poise
