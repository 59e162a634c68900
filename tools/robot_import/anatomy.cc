#include "tools/robot_import/anatomy.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "fmt/format.h"
#include "tools/robot_import/robot_fields.h"

namespace poise {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr size_t kLeastJoints = 6;
// rad: where the feet stand beside each other to within this, the base faces along its axis; a zero
// posture need not be symmetric.
constexpr double kSnap = 0.175;
// A foot may be higher than the other by this share of the lower one's depth below the hips with
// all joints at zero: a hand is higher.
constexpr double kMostAbove = 0.3;

std::vector<int> PathTo(const robot::LinkTree& tree, int body) {
  std::vector<int> joints;
  for (int b = body; b > 0; b = tree.bodies[static_cast<size_t>(b)].parent) {
    joints.push_back(tree.bodies[static_cast<size_t>(b)].joint);
  }
  std::ranges::reverse(joints);
  return joints;
}

/// Number of joints from the base on that both paths have.
size_t Shared(const std::vector<int>& a, const std::vector<int>& b) {
  return static_cast<size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
}

/// Two legs have more joints of their own than they share above them: two toes have not, and a foot
/// and its shank share all.
bool AreLegs(const std::vector<int>& a, const std::vector<int>& b) {
  const size_t shared = Shared(a, b);
  return std::min(a.size(), b.size()) > 2 * shared;
}

int SideOfBody(const robot::LinkTree& tree, int body) {
  int side = 0;
  for (const auto& [link, place] : tree.links) {
    if (place.body == body && side == 0) side = SideOfName(link);
  }
  if (side != 0) return side;
  return SideOfName(
      tree.joints[static_cast<size_t>(tree.bodies[static_cast<size_t>(body)].joint)].name);
}

void CheckLeg(const robot::LinkTree& tree, const Leg& leg, const std::string& locked) {
  if (leg.joints.size() >= kLeastJoints) return;
  std::string names;
  for (const int j : leg.joints) {
    names += (names.empty() ? "" : ", ") + tree.joints[static_cast<size_t>(j)].name;
  }
  throw robot::RobotError(fmt::format(
      "{}: the leg to '{}' has {} joint{} ({}): its foot cannot make a six-dimensional "
      "contact, a leg that balances needs six{}; if another link is the foot, name both "
      "with --right-foot and --left-foot",
      tree.format, tree.bodies[static_cast<size_t>(leg.body)].name, leg.joints.size(),
      leg.joints.size() == 1 ? "" : "s", names.empty() ? "none" : names, locked));
}

/// `height`: m, of the feet's lowest points along up; `hips`: m, of the body where the legs part.
void CheckLevel(const robot::LinkTree& tree, const std::array<Leg, 2>& legs,
                const std::array<double, 2>& height, double hips, bool given) {
  const size_t upper = height[0] > height[1] ? 0 : 1;
  const double above = height[upper] - height[1 - upper];
  if (given || !(above > kMostAbove * (hips - height[1 - upper]))) return;
  const auto name = [&](size_t f) -> const std::string& {
    return tree.bodies[static_cast<size_t>(legs[f].body)].name;
  };
  throw robot::RobotError(
      fmt::format("{}: the branches that reach lowest end at '{}' and, {:.2f} m higher, at '{}', "
                  "which is no second foot: Poise balances on two; if both are feet, name them "
                  "with --right-foot and --left-foot",
                  tree.format, name(1 - upper), above, name(upper)));
}

}  // namespace

const char* SurenessName(Sureness sureness) {
  constexpr const char* kNames[] = {"sure", "likely", "guess"};
  return kNames[static_cast<size_t>(sureness)];
}

int SideOfName(const std::string& name) {
  const std::string lower = Lower(name);
  const auto has = [&](const char* word) { return lower.find(word) != std::string::npos; };
  if (has("left") != has("right")) return has("left") ? 1 : -1;
  // A letter that stands alone between separators, or a capital before a word: L_Foot, leg_l,
  // LAnkle.
  for (size_t i = 0; i < lower.size(); ++i) {
    if (lower[i] != 'l' && lower[i] != 'r') continue;
    const bool begins = i == 0 || !std::isalpha(static_cast<unsigned char>(lower[i - 1]));
    const bool ends = i + 1 == lower.size() ||
                      !std::isalpha(static_cast<unsigned char>(lower[i + 1])) ||
                      (std::isupper(static_cast<unsigned char>(name[i])) && i == 0 &&
                       std::isupper(static_cast<unsigned char>(name[i + 1])));
    if (begins && ends) return lower[i] == 'l' ? 1 : -1;
  }
  return 0;
}

std::vector<Isometry3d> BodyPoses(const robot::LinkTree& tree,
                                  const Eigen::VectorXd& joint_position) {
  std::vector<Isometry3d> poses(tree.bodies.size(), Isometry3d::Identity());
  for (size_t b = 1; b < tree.bodies.size(); ++b) {
    const robot::Joint& joint = tree.joints[b - 1];
    poses[b] = poses[static_cast<size_t>(tree.bodies[b].parent)] * joint.origin *
               Eigen::AngleAxisd(joint_position[static_cast<Eigen::Index>(b) - 1], joint.axis);
  }
  return poses;
}

Anatomy FindAnatomy(const robot::LinkTree& tree, const std::vector<Isometry3d>& poses,
                    const Vector3d& up, const std::vector<double>& low,
                    const std::array<std::string, 2>& feet,
                    const std::function<std::string(const std::string&)>& locked) {
  std::array<Leg, 2> legs;
  for (size_t f = 0; f < 2; ++f) {
    if (feet[f].empty()) continue;
    const auto place = tree.links.find(feet[f]);
    if (place == tree.links.end()) {
      throw robot::RobotError(
          fmt::format("{}: there is no link '{}' that could be a foot: correct "
                      "the name",
                      tree.format, feet[f]));
    }
    legs[f] = {place->second.body, PathTo(tree, place->second.body)};
  }
  std::vector<int> by_height;
  for (size_t b = 1; b < poses.size(); ++b) by_height.push_back(static_cast<int>(b));
  const auto height = [&](int b) {
    const auto i = static_cast<size_t>(b);
    return poses[i].translation().dot(up) - low[i];
  };
  std::ranges::stable_sort(by_height, {}, height);
  for (size_t f = 0; f < 2; ++f) {
    for (const int b : by_height) {
      if (legs[f].body >= 0) break;
      const std::vector<int> path = PathTo(tree, b);
      if (legs[1 - f].body >= 0 && !AreLegs(path, legs[1 - f].joints)) continue;
      legs[f] = {b, path};
    }
    if (legs[f].body < 0) {
      throw robot::RobotError(tree.format +
                              ": there are no two legs: no two branches part above more joints "
                              "than lie above them, and Poise balances on two feet");
    }
  }
  const size_t shared = Shared(legs[0].joints, legs[1].joints);
  Anatomy found;
  if (shared > 0) found.hips = tree.joints[static_cast<size_t>(legs[0].joints[shared - 1])].body;
  CheckLevel(tree, legs, {height(legs[0].body), height(legs[1].body)},
             poses[static_cast<size_t>(found.hips)].translation().dot(up),
             !feet[0].empty() && !feet[1].empty());
  for (Leg& leg : legs) {
    leg.joints.erase(leg.joints.begin(), leg.joints.begin() + static_cast<std::ptrdiff_t>(shared));
    CheckLeg(tree, leg, locked(tree.bodies[static_cast<size_t>(leg.body)].name));
  }
  const std::array side = {SideOfBody(tree, legs[0].body), SideOfBody(tree, legs[1].body)};
  const auto place = [&](const Leg& leg) {
    return poses[static_cast<size_t>(leg.body)].translation();
  };
  const bool named = side[0] * side[1] < 0;
  const bool given = !feet[0].empty() && !feet[1].empty();
  bool swap = false;  // legs[0] is the left one
  if (given) {
    found.sides = Sureness::kSure;
    found.sides_from = "as told";
  } else if (named) {
    swap = side[0] > 0;
    found.sides = Sureness::kSure;
    found.sides_from = "names";
  } else {
    swap = place(legs[0]).y() > place(legs[1]).y();
    found.sides_from = "y of the root link";
  }
  if (swap) std::swap(legs[0], legs[1]);
  found.leg = legs;
  Vector3d left = place(legs[1]) - place(legs[0]);
  left -= left.dot(up) * up;
  if (!(left.norm() > 1e-3)) {
    throw robot::RobotError(tree.format +
                            ": the feet stand in line with all joints at zero: name them with "
                            "--right-foot and --left-foot of a file with another zero");
  }
  left.normalize();
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)}) {
    for (const double sign : {1.0, -1.0}) {
      if (left.dot(sign * axis) > std::cos(kSnap)) left = sign * axis;
    }
  }
  found.facing.col(0) = left.cross(up).normalized();
  found.facing.col(1) = left;
  found.facing.col(2) = up;
  const bool usual = found.facing.isIdentity(1e-9);
  found.forward = usual ? Sureness::kSure : found.sides;
  if (!usual && named) found.forward = Sureness::kLikely;
  found.forward_from = usual ? "x of the root link, feet to its sides"
                             : "right and left foot (" + found.sides_from + ")";
  return found;
}

}  // namespace poise
