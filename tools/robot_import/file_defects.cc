#include "tools/robot_import/file_defects.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>

#include "components/framework/configuration/configuration.h"
#include "components/robot/inertia.h"
#include "components/robot/robot_model.h"
#include "fmt/format.h"
#include "tools/robot_import/inertia_repair.h"
#include "tools/robot_import/motor_guess.h"

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

double Largest(const Matrix3d& inertia) { return inertia.cwiseAbs().maxCoeff(); }

bool IsPoint(const MassProperties& mass) {
  return mass.inertia.allFinite() && Largest(mass.inertia) <= kPoint * mass.mass;
}

/// Fingers and grippers: they carry nothing, and their motors hold nothing.
bool IsFinger(const std::string& name) {
  std::string lower;
  for (const char c : name) lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const char* word : {"finger", "gripper", "thumb", "index", "pinky", "knuckle"}) {
    if (lower.find(word) != std::string::npos) return true;
  }
  return false;
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
    std::map<std::string, int> followers;
    for (const SourceJoint& joint : source_.joints) {
      if (joint.mimic) ++followers[joint.mimic->joint];
    }
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
      } else if (followers.contains(joint.name) || IsFinger(joint.name)) {
        Lock(&joint, RestOf(joint.name), fmt::format("joint '{}' moves a finger", joint.name),
             "locked: it takes no part in balance");
      } else if (maker_.is_mjcf && !maker_.actuated.empty() &&
                 !maker_.actuated.contains(joint.name)) {
        Lock(&joint, RestOf(joint.name), fmt::format("joint '{}' has no actuator", joint.name),
             "locked");
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
    std::map<std::pair<double, double>, JointLimit*> same;
    int no_effort = 0, no_velocity = 0, no_range = 0;
    for (SourceJoint& joint : source_.joints) {
      if (joint.kind == JointKind::kFixed || joint.locked) continue;
      const bool effort = !(joint.effort > 0) || !std::isfinite(joint.effort);
      const bool velocity = !(joint.velocity > 0) || !std::isfinite(joint.velocity);
      if (joint.kind == JointKind::kRevolute && !(joint.lower < joint.upper)) {
        // Half a turn to either side, which no leg's joint leaves.
        JointLimit* const limit = result_.robot.add_limit();
        limit->add_joint(joint.name);
        limit->set_lower(-M_PI);
        limit->set_upper(M_PI);
        joint.lower = -M_PI, joint.upper = M_PI;
        ++no_range;
      }
      if (!effort && !velocity && joint.has_limits) continue;
      no_effort += effort;
      no_velocity += velocity;
      if (effort) joint.effort = GuessedEffort(mass, IsLeg(joint.name));
      if (velocity) joint.velocity = kGuessedVelocity;
      joint.has_limits = true;
      JointLimit*& limit = same[{effort ? joint.effort : 0, velocity ? joint.velocity : 0}];
      if (limit == nullptr) {
        limit = result_.robot.add_limit();
        if (effort) limit->set_effort(joint.effort);
        if (velocity) limit->set_velocity(joint.velocity);
      }
      limit->add_joint(joint.name);
    }
    const auto tell = [&](int count, const char* what, const char* done) {
      if (count > 0) Tell(fmt::format("{} joints have no {}", count, what), done);
    };
    tell(no_range, "range", "guess: half a turn to either side");
    tell(no_effort, "torque limit", "guess: by the robot's mass");
    tell(no_velocity, "velocity limit", "guess: 20 rad/s");
  }

  void Inertias() {
    for (SourceLink& link : source_.links) RepairLink(&link);
    for (const auto& [main, parts] : MovingBodies()) RepairBody(main, parts);
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
    for (const SourceJoint& joint : source_.joints) {
      if (joint.name == name && joint.lower < joint.upper) {
        return std::clamp(0.0, joint.lower, joint.upper);
      }
    }
    return 0;
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
    std::string lower;
    for (const char c : name)
      lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    for (const char* word : {"hip", "knee", "ankle", "leg"}) {
      if (lower.find(word) != std::string::npos) return true;
    }
    return false;
  }

  const SourceJoint* JointOf(const std::string& link) const {
    for (const SourceJoint& joint : source_.joints) {
      if (joint.child == link) return &joint;
    }
    return nullptr;
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

  /// By the link that a joint moves, or the root.
  std::vector<std::pair<SourceLink*, std::vector<Part>>> MovingBodies() {
    std::vector<std::pair<SourceLink*, std::vector<Part>>> bodies;
    std::map<std::string, std::vector<const SourceJoint*>> children;
    for (const SourceJoint& joint : source_.joints) children[joint.parent].push_back(&joint);
    std::vector<std::pair<std::string, std::pair<size_t, Isometry3d>>> open;
    const auto begin = [&](const std::string& link) {
      open.push_back({link, {bodies.size(), Isometry3d::Identity()}});
      bodies.push_back({source_.FindLink(link), {}});
    };
    begin(source_.root);
    while (!open.empty()) {
      const auto [name, place] = open.back();
      open.pop_back();
      SourceLink* const link = source_.FindLink(name);
      bodies[place.first].second.push_back({link, robot::Transformed(link->mass, place.second)});
      for (const SourceJoint* joint : children[name]) {
        if (joint->kind == JointKind::kFixed || joint->locked) {
          open.push_back({joint->child, {place.first, place.second * joint->origin}});
        } else {
          begin(joint->child);
        }
      }
    }
    return bodies;
  }

  void RepairBody(SourceLink* main, const std::vector<Part>& parts) {
    std::vector<MassProperties> masses;
    for (const Part& part : parts) masses.push_back(part.mass);
    const MassProperties merged = robot::Merged(masses);
    if (robot::WhyImmovable(merged).empty() && !IsPoint(merged)) return;
    SourceLink* heaviest = main;
    for (const Part& part : parts) {
      if (part.mass.mass > heaviest->mass.mass) heaviest = part.link;
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
      std::string lower;
      for (const char c : name) {
        lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      }
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
  repairer.Limits();
  repairer.Inertias();
}

}  // namespace poise
