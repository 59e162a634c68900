#include "tools/robot_import/file_defects.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <set>

#include "components/framework/configuration/configuration.h"
#include "components/robot/inertia.h"
#include "components/robot/robot_model.h"
#include "fmt/format.h"
#include "tools/robot_import/anatomy.h"
#include "tools/robot_import/inertia_repair.h"
#include "tools/robot_import/motor_guess.h"
#include "tools/robot_import/robot_fields.h"

namespace poise {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using robot::JointKind;
using robot::MassProperties;
using robot::SourceJoint;
using robot::SourceLink;

// m²: a body whose radius of gyration is below 1 mm everywhere is a point with noise.
constexpr double kPoint = 1e-6;
constexpr double kDummyMass = 0.02;  // kg, of a link that moves and weighs nothing: a bracket
constexpr double kMirror = 1e-3;     // share by which masses of both sides may differ
// A finger weighs at most this share of the robot's mass (a thumb of 150 g on a G1), and a limb at
// least this one.
constexpr double kFingerShare = 0.0075, kLimbShare = 0.03;
// A link below this share of the robot's height, with joints at zero, belongs to a foot and to no
// hand.
constexpr double kFootHeight = 0.2;
constexpr double kPelvisShare = 0.14;  // of a person's mass (Winter)
constexpr double kTrunkShare = 0.25;   // of the robot's mass: what moves more is no arm
// cosine: two links whose origins lie beside each other within this mirror each other along an
// axis.
constexpr double kBeside = 0.97;

double Largest(const Matrix3d& inertia) { return inertia.cwiseAbs().maxCoeff(); }

bool IsPoint(const MassProperties& mass) {
  return mass.inertia.allFinite() && Largest(mass.inertia) <= kPoint * mass.mass;
}

/// Fingers and grippers: they carry nothing, and their motors hold nothing.
bool IsFinger(const std::string& name) {
  return std::ranges::any_of(std::array{"finger", "gripper", "thumb", "index", "pinky", "knuckle"},
                             [&](const char* word) { return Contains(name, word); });
}

class Repairer {
 public:
  Repairer(MakerFile* maker, RobotImport* result, std::map<std::string, double>* rotor)
      : source_(maker->source), maker_(*maker), result_(*result), rotor_(*rotor) {}

  void Names() {
    std::string odd;
    int count = 0;
    const auto look = [&](const std::string& name) {
      const bool usual = std::ranges::all_of(name, [](unsigned char c) {
        return std::isalnum(c) || c == '_' || c == '-' || c == '.' || c == '/' || c == ':';
      });
      if (!usual && ++count <= 3) odd += (odd.empty() ? "" : ", ") + ("'" + name + "'");
    };
    for (const SourceLink& link : source_.links) look(link.name);
    for (const SourceJoint& joint : source_.joints) look(joint.name);
    if (count > 0) {
      Tell(fmt::format("{} names have odd characters: {}{}", count, odd, count > 3 ? ", ..." : ""),
           "kept; quote them on the command line");
    }
  }

  void Locks(const std::vector<std::string>& wanted) {
    for (const std::string& name : wanted) {
      SourceJoint* const joint = source_.FindJoint(name);
      if (joint == nullptr)
        throw ConfigError(fmt::format("--lock {}: the file has no such joint", name));
      Lock(joint, 0, "", "");
    }
    const std::set<std::string> fingers = Fingers();
    for (SourceJoint& joint : source_.joints) {
      if (joint.kind == JointKind::kFixed || joint.locked) continue;
      if (joint.kind == JointKind::kFloating || joint.kind == JointKind::kOther) {
        throw robot::RobotError(fmt::format(
            "{}: joint '{}' is {}: Poise moves hinges; split it into hinges or make it fixed",
            source_.format, joint.name,
            joint.kind == JointKind::kFloating ? "floating" : "a ball or planar joint"));
      }
      if (joint.mimic) {
        const double at =
            joint.mimic->offset + joint.mimic->multiplier * RestOf(joint.mimic->joint);
        Lock(&joint, at, fmt::format("joint '{}' mimics '{}'", joint.name, joint.mimic->joint),
             "locked where it stands then");
      } else if (joint.kind == JointKind::kPrismatic) {
        Lock(&joint, RestOf(joint.name), fmt::format("joint '{}' is prismatic", joint.name),
             "locked");
      } else if (IsFinger(joint.name) || fingers.contains(joint.name)) {
        Lock(&joint, RestOf(joint.name), fmt::format("joint '{}' moves a finger", joint.name),
             "locked: it takes no part in balance");
      } else if (maker_.is_mjcf && !maker_.actuated.empty() &&
                 !maker_.actuated.contains(joint.name)) {
        Lock(&joint, RestOf(joint.name),
             fmt::format("joint '{}' has no actuator of its own", joint.name), "locked");
      }
    }
  }

  /// A file for pictures alone is refused: with brackets for links a robot of 0.3 kg comes of it.
  void Masses() const {
    if (Mass() > 0) return;
    throw robot::RobotError(fmt::format(
        "{}: no link has a mass: what balances is forces on masses; import the maker's file for "
        "dynamics, whose links have an <inertial>",
        source_.format));
  }

  void Limits() {
    const double mass = Mass();
    std::map<std::string, double> beyond;  // kg that a joint moves
    for (const MovingBody& body : MovingBodies()) {
      if (body.joint != nullptr) beyond[body.joint->name] = body.beyond;
    }
    std::map<std::pair<double, double>, JointLimit*> same;
    int no_effort = 0, no_velocity = 0, no_range = 0, swapped_range = 0;
    std::vector<std::string> odd_effort, odd_velocity;
    for (SourceJoint& joint : source_.joints) {
      if (joint.kind == JointKind::kFixed || joint.locked) continue;
      const bool effort = !(joint.effort > 0) || !std::isfinite(joint.effort);
      const bool velocity = !(joint.velocity > 0) || !std::isfinite(joint.velocity);
      if (joint.kind == JointKind::kRevolute && !(joint.lower < joint.upper)) {
        const bool swapped = joint.lower > joint.upper;
        if (swapped) std::swap(joint.lower, joint.upper);
        // Without a range the joint gets half a turn to either side, which no leg's joint leaves.
        if (!swapped) joint.lower = -M_PI, joint.upper = M_PI;
        JointLimit* const limit = result_.robot.add_limit();
        limit->add_joint(joint.name);
        limit->set_lower(joint.lower);
        limit->set_upper(joint.upper);
        ++(swapped ? swapped_range : no_range);
      }
      const bool leg = IsLeg(joint.name);
      const bool no_motors = !effort && IsPlaceholderEffort(joint.effort, mass, leg);
      const bool no_drives = !velocity && joint.velocity > kMostVelocity;
      if (!effort && !velocity && !no_motors && !no_drives && joint.has_limits) continue;
      no_effort += effort;
      no_velocity += velocity;
      const auto number = [](double x) { return fmt::format("{:g}", x); };
      if (no_motors) odd_effort.push_back(number(joint.effort));
      if (no_drives) odd_velocity.push_back(number(joint.velocity));
      if (effort || no_motors) {
        joint.effort = GuessedEffort(mass, leg || beyond[joint.name] > kTrunkShare * mass);
      }
      if (velocity) joint.velocity = kGuessedVelocity;
      if (no_drives) joint.velocity = kUsualVelocity;
      joint.has_limits = true;
      const bool new_effort = effort || no_motors, new_velocity = velocity || no_drives;
      JointLimit*& limit = same[{new_effort ? joint.effort : 0, new_velocity ? joint.velocity : 0}];
      if (limit == nullptr) {
        limit = result_.robot.add_limit();
        if (new_effort) limit->set_effort(joint.effort);
        if (new_velocity) limit->set_velocity(joint.velocity);
      }
      limit->add_joint(joint.name);
    }
    const auto tell = [&](int count, const char* what, const char* done) {
      if (count == 0) return;
      Tell(fmt::format("{} joint{} no {}", count, count == 1 ? " has" : "s have", what), done);
    };
    const auto tell_odd = [&](const std::vector<std::string>& odd, const char* what,
                              const std::string& done) {
      if (odd.empty()) return;
      const std::set<std::string> kinds(odd.begin(), odd.end());
      Tell(fmt::format("{} joint{} {} of {}, a placeholder that no motor of such a robot has",
                       odd.size(), odd.size() == 1 ? " has" : "s have", what,
                       fmt::join(kinds, ", ")),
           done);
    };
    tell(no_range, "range", "guess: half a turn to either side");
    if (swapped_range > 0) {
      Tell(fmt::format("{} joint{} a lower limit above the upper one", swapped_range,
                       swapped_range == 1 ? " has" : "s have"),
           "guess: the two are swapped");
    }
    tell(no_effort, "torque limit", "guess: by the robot's mass");
    tell(no_velocity, "velocity limit", "guess: 20 rad/s");
    tell_odd(odd_effort, "a torque limit in N·m",
             "guess: by the robot's mass; friction, rotors and drive train follow from that");
    tell_odd(odd_velocity, "a velocity limit in rad/s",
             "guess: 15 rad/s; gears and rotors follow from that");
  }

  void Inertias() {
    MirrorMasses();
    for (SourceLink& link : source_.links) RepairLink(&link);
    for (const MovingBody& body : MovingBodies()) RepairBody(body);
    if (!maker_.from_shapes.empty()) {
      Tell(fmt::format("{} bodies have no <inertial>", maker_.from_shapes.size()),
           "their shapes give mass and inertia");
    }
  }

 private:
  /// kg, of all links.
  double Mass() const {
    double mass = 0;
    for (const SourceLink& link : source_.links) mass += std::max(0.0, link.mass.mass);
    return mass;
  }

  void Tell(std::string what, std::string done) {
    result_.defects.push_back({std::move(what), std::move(done)});
  }

  /// rad or m, of a joint that will be locked.
  double RestOf(const std::string& name) const {
    for (const robot::MjcfKey& key : maker_.postures) {
      const auto known = key.joint.find(name);
      if (known != key.joint.end()) return known->second;
    }
    const SourceJoint* const joint = source_.FindJoint(name);
    const bool ranged = joint != nullptr && joint->lower < joint->upper;
    return ranged ? std::clamp(0.0, joint->lower, joint->upper) : 0;
  }

  void Lock(SourceJoint* joint, double position, std::string what, std::string done) {
    joint->locked = position;
    poise::Lock* lock = nullptr;
    for (poise::Lock& known : *result_.robot.mutable_lock()) {
      if (known.position() == position) lock = &known;
    }
    if (lock == nullptr) {
      lock = result_.robot.add_lock();
      if (position != 0) lock->set_position(position);
    }
    lock->add_joint(joint->name);
    if (!what.empty()) Tell(std::move(what), fmt::format("{} at {:g}", done, position));
  }

  bool IsLeg(const std::string& name) const {
    return std::ranges::any_of(std::array{"hip", "knee", "ankle", "leg"},
                               [&](const char* word) { return Contains(name, word); });
  }

  const SourceJoint* JointOf(const std::string& link) const {
    const auto found = std::ranges::find(source_.joints, link, &SourceJoint::child);
    return found == source_.joints.end() ? nullptr : &*found;
  }

  Repair* RepairOf(const std::string& link) {
    for (Repair& repair : *result_.robot.mutable_repair()) {
      if (repair.link() == link) return &repair;
    }
    Repair* const repair = result_.robot.add_repair();
    repair->set_link(link);
    return repair;
  }

  void SetInertia(SourceLink* link, const Matrix3d& inertia) {
    const auto digits = [](double x) {
      return std::strtod(fmt::format("{:.10g}", x).c_str(), nullptr);
    };
    Inertia* const i = RepairOf(link->name)->mutable_inertia();
    i->Clear();
    const auto set = [&](double value, auto setter) {
      if (value != 0) (i->*setter)(digits(value));
    };
    set(inertia(0, 0), &Inertia::set_ixx);
    set(inertia(0, 1), &Inertia::set_ixy);
    set(inertia(0, 2), &Inertia::set_ixz);
    set(inertia(1, 1), &Inertia::set_iyy);
    set(inertia(1, 2), &Inertia::set_iyz);
    set(inertia(2, 2), &Inertia::set_izz);
    link->mass.inertia << i->ixx(), i->ixy(), i->ixz(), i->ixy(), i->iyy(), i->iyz(), i->ixz(),
        i->iyz(), i->izz();
  }

  void RepairLink(SourceLink* link) {
    MassProperties& mass = link->mass;
    if (!std::isfinite(mass.mass) || mass.mass < 0 || !mass.com.allFinite() ||
        !mass.inertia.allFinite()) {
      Tell(fmt::format("link '{}' has a mass of {} kg, or a centre of mass or inertia that is no "
                       "number",
                       link->name, mass.mass),
           "taken as weightless");
      mass = MassProperties();
      Repair* const repair = RepairOf(link->name);
      repair->set_mass(0);
      repair->mutable_com();
      repair->mutable_inertia();
      return;
    }
    const std::string why = robot::WhyImpossible(mass);
    if (why.empty()) return;
    if (IsPoint(mass)) {
      Tell(fmt::format("link '{}' has noise of {:.1g} kg m^2 for an inertia", link->name,
                       Largest(mass.inertia)),
           "taken as 0");
      SetInertia(link, Matrix3d::Zero());
      return;
    }
    const SourceJoint* const joint = JointOf(link->name);
    if (joint != nullptr && joint->kind != JointKind::kFixed && !joint->locked) {
      const Vector3d axis = joint->axis.normalized();
      if (const auto hidden = HiddenRotor(mass.inertia, axis)) {
        const double rotor = std::strtod(fmt::format("{:.6g}", *hidden).c_str(), nullptr);
        const Matrix3d rest = mass.inertia - rotor * axis * axis.transpose();
        MassProperties without = mass;
        without.inertia = rest;
        std::string done = fmt::format("given to the motor of '{}'", joint->name);
        if (robot::WhyImpossible(without).empty()) {
          RepairOf(link->name)->set_rotor(rotor);
          mass.inertia = rest;
        } else {
          SetInertia(link, NearestPhysical(rest));
          done += "; the rest moved to the nearest physical one";
        }
        rotor_[joint->name] = rotor;
        Tell(fmt::format("link '{}' hides a rotor of {:.3g} kg m^2 in its inertia", link->name,
                         rotor),
             done);
        return;
      }
    }
    const Matrix3d nearest = NearestPhysical(mass.inertia);
    const double change = (nearest - mass.inertia).norm() / mass.inertia.norm();
    Tell(fmt::format("link '{}': {}", link->name, why),
         fmt::format("nearest physical one, {:.2g} % away", 100 * change));
    SetInertia(link, nearest);
  }

  struct Part {
    SourceLink* link;
    MassProperties mass;  // in the body
  };

  /// Links that are fixed to each other.
  struct MovingBody {
    SourceLink* main;          ///< that the joint moves, or the root
    const SourceJoint* joint;  ///< null: the root
    size_t parent;             ///< body
    std::vector<Part> parts = {};
    double beyond = 0;               ///< kg, with all that it carries
    std::vector<size_t> limbs = {};  ///< bodies that it carries
    int heavy_limbs = 0;             ///< two of them: a pelvis or a trunk
  };

  /// Parents first.
  std::vector<MovingBody> MovingBodies() {
    std::vector<MovingBody> bodies;
    std::map<std::string, std::vector<const SourceJoint*>> children;
    for (const SourceJoint& joint : source_.joints) children[joint.parent].push_back(&joint);
    std::vector<std::pair<std::string, std::pair<size_t, Isometry3d>>> open;
    const auto begin = [&](const std::string& link, const SourceJoint* joint, size_t parent) {
      open.push_back({link, {bodies.size(), Isometry3d::Identity()}});
      if (joint != nullptr) bodies[parent].limbs.push_back(bodies.size());
      bodies.push_back({source_.FindLink(link), joint, parent, {}});
    };
    begin(source_.root, nullptr, 0);
    while (!open.empty()) {
      const auto [name, place] = open.back();
      open.pop_back();
      SourceLink* const link = source_.FindLink(name);
      bodies[place.first].parts.push_back({link, robot::Transformed(link->mass, place.second)});
      for (const SourceJoint* joint : children[name]) {
        if (joint->kind == JointKind::kFixed || joint->locked) {
          open.push_back({joint->child, {place.first, place.second * joint->origin}});
        } else {
          begin(joint->child, joint, place.first);
        }
      }
    }
    const double limb = kLimbShare * Mass();
    for (size_t b = bodies.size(); b-- > 0;) {
      for (const Part& part : bodies[b].parts) bodies[b].beyond += std::max(0.0, part.mass.mass);
      if (b == 0) break;
      bodies[bodies[b].parent].beyond += bodies[b].beyond;
      bodies[bodies[b].parent].heavy_limbs += bodies[b].beyond > limb;
    }
    return bodies;
  }

  /// Joints of hands, whatever they are called: of light chains that part at one body beyond the
  /// root, and those of less than a limb that others mimic. Eyes are such as well. What lies near
  /// the ground is a foot, whose ankle's joints may mimic each other.
  std::set<std::string> Fingers() {
    const std::vector<MovingBody> bodies = MovingBodies();
    const double most = kFingerShare * Mass();
    std::set<std::string> fingers, mimicked;
    for (const SourceJoint& joint : source_.joints) {
      if (joint.mimic) mimicked.insert(joint.mimic->joint);
    }
    const std::map<std::string, Isometry3d> poses = ZeroPoses();
    double lowest = 0, highest = 0;
    for (const auto& [name, pose] : poses) {
      lowest = std::min(lowest, pose.translation().z());
      highest = std::max(highest, pose.translation().z());
    }
    const double tall = std::max(highest - lowest, std::numeric_limits<double>::min());
    std::vector<bool> within(bodies.size(), false);
    for (size_t b = 1; b < bodies.size(); ++b) {
      const std::string& name = bodies[b].joint->name;
      const double height = (poses.at(bodies[b].joint->child).translation().z() - lowest) / tall;
      if (mimicked.contains(name) && bodies[b].beyond < kLimbShare * Mass() &&
          height > kFootHeight) {
        fingers.insert(name);
      }
      const std::vector<size_t>& limbs = bodies[b].limbs;
      const bool hand = limbs.size() > 1 && std::ranges::all_of(limbs, [&](size_t limb) {
                          return bodies[limb].beyond < most;
                        });
      for (const size_t limb : limbs) {
        within[limb] = within[b] || hand;
        if (within[limb]) fingers.insert(bodies[limb].joint->name);
      }
    }
    return fingers;
  }

  /// Returns the poses of all links in the root, with joints at zero.
  std::map<std::string, Isometry3d> ZeroPoses() const {
    std::map<std::string, std::vector<const SourceJoint*>> children;
    for (const SourceJoint& joint : source_.joints) children[joint.parent].push_back(&joint);
    std::map<std::string, Isometry3d> poses{{source_.root, Isometry3d::Identity()}};
    std::vector<std::string> open{source_.root};
    while (!open.empty()) {
      const std::string name = open.back();
      open.pop_back();
      for (const SourceJoint* joint : children[name]) {
        poses[joint->child] = poses.at(name) * joint->origin;
        open.push_back(joint->child);
      }
    }
    return poses;
  }

  /// A limb's link without a mass whose mirror image has one weighs as much.
  void MirrorMasses() {
    const double least = kFingerShare * Mass();
    const std::map<std::string, Isometry3d> poses = ZeroPoses();
    for (SourceLink& link : source_.links) {
      if (link.mass.mass > 0 && std::isfinite(link.mass.mass)) continue;
      const auto twin = std::ranges::find_if(source_.links, [&](const SourceLink& other) {
        return SideOfName(link.name) != 0 && SideOfName(other.name) == -SideOfName(link.name) &&
               SameBesideSide(link.name, other.name) && other.mass.mass > least &&
               !IsPoint(other.mass) && robot::WhyImpossible(other.mass).empty();
      });
      if (twin == source_.links.end()) continue;
      const Isometry3d &here = poses.at(link.name), &there = poses.at(twin->name);
      Vector3d across = here.translation() - there.translation();
      if (across.norm() < kPoint) across = Vector3d::UnitY();
      across.normalize();
      Eigen::Index axis = 0;
      if (across.cwiseAbs().maxCoeff(&axis) > kBeside) across = Vector3d::Unit(axis);
      const Matrix3d mirror = here.linear().transpose() *
                              (Matrix3d::Identity() - 2 * across * across.transpose()) *
                              there.linear();
      Tell(fmt::format("link '{}' has a mass of {:g} kg, and its mirror image '{}' {:g} kg",
                       link.name, link.mass.mass, twin->name, twin->mass.mass),
           "that of its mirror image, mirrored");
      Repair* const repair = RepairOf(link.name);
      repair->set_mass(twin->mass.mass);
      link.mass.mass = twin->mass.mass;
      const Vector3d com = mirror * twin->mass.com;
      const auto digits = [](double x) { return std::round(x * 1e9) / 1e9 + 0.0; };
      Pose* const place = repair->mutable_com();
      place->set_x(digits(com.x()));
      place->set_y(digits(com.y()));
      place->set_z(digits(com.z()));
      link.mass.com = {place->x(), place->y(), place->z()};
      SetInertia(&link, mirror * twin->mass.inertia * mirror.transpose());
    }
  }

  void RepairBody(const MovingBody& body) {
    SourceLink* const main = body.main;
    const std::vector<Part>& parts = body.parts;
    std::vector<MassProperties> masses;
    for (const Part& part : parts) masses.push_back(part.mass);
    const MassProperties merged = robot::Merged(masses);
    if (robot::WhyImmovable(merged).empty() && !IsPoint(merged)) return;
    SourceLink* heaviest = main;
    for (const Part& part : parts) {
      if (part.mass.mass > heaviest->mass.mass) heaviest = part.link;
    }
    if (!(heaviest->mass.mass > 0) && body.heavy_limbs > 1) {
      const double mass = std::round(kPelvisShare / (1 - kPelvisShare) * Mass() * 1e3) / 1e3;
      Tell(fmt::format("link '{}' weighs nothing and carries {} limbs", main->name,
                       body.heavy_limbs),
           fmt::format("guess: {:g} kg, {:g} % of the robot, as of a person", mass,
                       100 * kPelvisShare));
      RepairOf(main->name)->set_mass(mass);
      main->mass.mass = mass;
      SetInertia(main, SphereInertia(mass));
      return;
    }
    if (!(heaviest->mass.mass > 0)) {
      Tell(fmt::format("link '{}' moves and weighs nothing", heaviest->name),
           fmt::format("guess: a bracket of {:g} kg", kDummyMass));
      RepairOf(heaviest->name)->set_mass(kDummyMass);
      heaviest->mass.mass = kDummyMass;
      SetInertia(heaviest, SphereInertia(kDummyMass));
      return;
    }
    const std::string what =
        fmt::format("link '{}' has {:.3g} kg and no inertia", heaviest->name, heaviest->mass.mass);
    if (const SourceLink* const twin = Twin(*heaviest)) {
      SetInertia(heaviest, Mirrored(*twin, *heaviest));
      Tell(what, "that of its mirror image '" + twin->name + "'");
      return;
    }
    SetInertia(heaviest, SphereInertia(heaviest->mass.mass));
    Tell(what, "guess: that of a ball of water");
  }

  /// The other side's link of the same mass and the same distance of the COM, with an inertia.
  const SourceLink* Twin(const SourceLink& link) const {
    const int side = SideOfName(link.name);
    if (side == 0) return nullptr;
    for (const SourceLink& other : source_.links) {
      if (SideOfName(other.name) != -side || other.name.size() < 3) continue;
      if (!SameBesideSide(link.name, other.name)) continue;
      const bool same = std::abs(other.mass.mass - link.mass.mass) <= kMirror * link.mass.mass &&
                        (other.mass.com.cwiseAbs() - link.mass.com.cwiseAbs()).norm() < 1e-3;
      if (same && !IsPoint(other.mass) && robot::WhyImpossible(other.mass).empty()) return &other;
    }
    return nullptr;
  }

  static bool SameBesideSide(const std::string& a, const std::string& b) {
    const auto neutral = [](const std::string& name) {
      std::string lower = Lower(name);
      for (const char* word : {"right", "left"}) {
        if (const size_t at = lower.find(word); at != std::string::npos) {
          return lower.replace(at, std::string(word).size(), "*");
        }
      }
      for (size_t i = 0; i < lower.size(); ++i) {
        const bool letter = lower[i] == 'l' || lower[i] == 'r';
        const bool begins = i == 0 || !std::isalpha(static_cast<unsigned char>(lower[i - 1]));
        if (letter && begins) return lower.replace(i, 1, "*");
      }
      return lower;
    };
    return neutral(a) == neutral(b);
  }

  /// Coordinates of the COM that change their sign between the two mirror the products of inertia.
  static Matrix3d Mirrored(const SourceLink& from, const SourceLink& to) {
    Vector3d sign = Vector3d::Ones();
    for (int i = 0; i < 3; ++i) {
      if (std::abs(from.mass.com[i]) > 1e-5 && from.mass.com[i] * to.mass.com[i] < 0) sign[i] = -1;
    }
    return sign.asDiagonal() * from.mass.inertia * sign.asDiagonal();
  }

  robot::RobotSource& source_;
  MakerFile& maker_;
  RobotImport& result_;
  std::map<std::string, double>& rotor_;
};

}  // namespace

void RepairDefects(const std::vector<std::string>& lock, MakerFile* maker, RobotImport* result,
                   std::map<std::string, double>* rotor) {
  Repairer repairer(maker, result, rotor);
  repairer.Masses();
  repairer.Names();
  repairer.Locks(lock);
  repairer.Inertias();
  repairer.Limits();
}

}  // namespace poise
