// A robot as its maker's file describes it, whatever the format: links, joints and shapes, not yet
// checked.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "components/robot/inertia.h"

namespace poise::robot {

/// m, between two links: beyond it, a mistaken unit and lost digits.
inline constexpr double kMaxLength = 1e3;

struct SourceLink {
  std::string name;
  MassProperties mass;  ///< in the link frame
};

enum class JointKind { kFixed, kRevolute, kContinuous, kPrismatic, kFloating, kOther };

/// This joint's position = offset + multiplier * position of `joint`.
struct Mimic {
  std::string joint;
  double multiplier = 1, offset = 0;
};

struct SourceJoint {
  std::string name;
  JointKind kind = JointKind::kFixed;
  std::string parent, child;  ///< links
  Eigen::Isometry3d origin =
      Eigen::Isometry3d::Identity();                ///< child link in the parent link at position 0
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< in the child link, any length
  bool has_limits = false;                          ///< the four below are given
  double lower = 0, upper = 0;                      ///< rad or m
  double effort = 0, velocity = 0;                  ///< N·m, rad/s
  std::optional<Mimic> mimic;
  std::optional<double> damping, friction, armature;  ///< N·m·s/rad, N·m, kg·m²
  std::optional<double> locked;                       ///< rad or m: does not move, stands there
};

/// A solid that belongs to a link.
struct SourceShape {
  enum class Kind { kBox, kSphere, kCylinder, kCapsule, kMesh };
  Kind kind = Kind::kBox;
  std::string link;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< in the link; long axis: z
  /// m; box: edges; sphere: radius; cylinder, capsule: radius, length without caps; mesh: scale.
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  std::string mesh;  ///< file as the maker's file names it
  bool collides = true;
};

struct RobotSource {
  std::string format;  ///< "URDF" or "MJCF", the first word of errors
  std::string name;
  std::string root;  ///< link
  std::vector<SourceLink> links;
  std::vector<SourceJoint> joints;  ///< in order of the text

  /// nullptr where there is none of the name, as below.
  SourceLink* FindLink(std::string_view link) { return Find(link, &links); }
  SourceJoint* FindJoint(std::string_view joint) { return Find(joint, &joints); }

 private:
  template <class Part>
  static Part* Find(std::string_view name, std::vector<Part>* parts) {
    const auto found = std::ranges::find(*parts, name, &Part::name);
    return found == parts->end() ? nullptr : &*found;
  }
};

}  // namespace poise::robot
