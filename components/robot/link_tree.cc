#include "components/robot/link_tree.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace poise::robot {
namespace {

constexpr double kMinAxisNorm = 1e-6;

const char* TypeName(JointKind kind) {
  return kind == JointKind::kPrismatic  ? "prismatic"
         : kind == JointKind::kFloating ? "floating"
                                        : "planar or unknown";
}

// Returns the child link's pose in the parent link.
Eigen::Isometry3d JointPose(const SourceJoint& joint) {
  Eigen::Isometry3d pose = joint.origin;
  if (!joint.locked || joint.kind == JointKind::kFixed) return pose;
  const double norm = joint.axis.norm();
  if (!(norm > kMinAxisNorm)) return pose;
  if (joint.kind == JointKind::kPrismatic) {
    pose.translate(joint.axis / norm * *joint.locked);
  } else {
    pose.rotate(Eigen::AngleAxisd(*joint.locked, joint.axis / norm));
  }
  return pose;
}

class TreeBuilder {
 public:
  TreeBuilder(const RobotSource& source, LinkTree* tree) : source_(source), tree_(tree) {
    for (const SourceLink& link : source.links) links_[link.name] = &link;
    for (const SourceJoint& joint : source.joints) children_[joint.parent].push_back(&joint);
  }

  void Build() {
    tree_->format = source_.format;
    tree_->name = source_.name;
    tree_->root_link = source_.root;
    StartBody(source_.root, -1, -1);
    Visit(source_.root, 0, Eigen::Isometry3d::Identity());
    for (size_t i = 0; i < tree_->bodies.size(); ++i) Finish(&tree_->bodies[i], parts_[i]);
  }

 private:
  template <typename... Args>
  [[noreturn]] void Fail(fmt::format_string<Args...> text, Args&&... args) const {
    throw RobotError(source_.format + ": " + fmt::format(text, std::forward<Args>(args)...));
  }

  void StartBody(const std::string& name, int parent, int joint) {
    Body body;
    body.name = name;
    body.parent = parent;
    body.joint = joint;
    tree_->bodies.push_back(body);
    parts_.emplace_back();
  }

  void Visit(const std::string& link, int body, const Eigen::Isometry3d& pose) {
    const MassProperties& mass = links_.at(link)->mass;
    if (const std::string why = WhyImpossible(mass); !why.empty()) {
      Fail("link '{}': {}: correct its <inertial>, or let `poise robot import` write a repair",
           link, why);
    }
    tree_->links[link] = {body, pose};
    parts_[static_cast<size_t>(body)].push_back(Transformed(mass, pose));
    for (const SourceJoint* joint : children_[link]) {
      const Eigen::Isometry3d origin = JointPose(*joint);
      if (!origin.matrix().allFinite() || origin.translation().norm() > kMaxLength) {
        Fail("joint '{}' has an origin that is not finite or over {} m away: correct its origin",
             joint->name, kMaxLength);
      }
      if (joint->kind == JointKind::kFixed || joint->locked) {
        tree_->fixed_joints.insert(joint->name);
        Visit(joint->child, body, pose * origin);
      } else {
        Joint moving = ToJoint(*joint, pose);
        moving.body = static_cast<int>(tree_->bodies.size());
        StartBody(joint->child, body, static_cast<int>(tree_->joints.size()));
        tree_->joints.push_back(moving);
        Visit(joint->child, moving.body, Eigen::Isometry3d::Identity());
      }
    }
  }

  Joint ToJoint(const SourceJoint& source, const Eigen::Isometry3d& parent_pose) const {
    const std::string& name = source.name;
    const bool continuous = source.kind == JointKind::kContinuous;
    if (source.kind == JointKind::kFloating) {
      Fail("joint '{}' is floating: remove it and its parent link, the root link floats already",
           name);
    }
    if (source.kind != JointKind::kRevolute && !continuous) {
      Fail(
          "joint '{}' is {}: only revolute and continuous joints are controlled, make it fixed or "
          "lock it in the robot's text: lock {{ joint: \"{}\" }}",
          name, TypeName(source.kind), name);
    }
    if (source.mimic) {
      Fail(
          "joint '{}' mimics joint '{}': coupled joints are not supported, lock it in the robot's "
          "text: lock {{ joint: \"{}\" }}",
          name, source.mimic->joint, name);
    }
    Joint joint;
    joint.name = name;
    joint.origin = parent_pose * source.origin;
    const double norm = source.axis.norm();
    if (!(norm > kMinAxisNorm) || !std::isfinite(norm)) {
      Fail("joint '{}' has an axis of length {:.3g}: give it a direction, e.g. xyz=\"0 0 1\"", name,
           norm);
    }
    joint.axis = source.axis / norm;
    if (!source.has_limits) {
      Fail(
          "joint '{}' has no limits: add <limit{} effort=\"...\" velocity=\"...\"/>, or a limit in "
          "the robot's text",
          name, continuous ? "" : " lower=\"...\" upper=\"...\"");
    }
    joint.lower = continuous ? -std::numeric_limits<double>::infinity() : source.lower;
    joint.upper = continuous ? std::numeric_limits<double>::infinity() : source.upper;
    joint.effort = source.effort;
    joint.velocity_limit = source.velocity;
    if (!(joint.lower < joint.upper)) {
      Fail("joint '{}' has limits {} to {} rad: lower must be below upper", name, joint.lower,
           joint.upper);
    }
    if (!(joint.effort > 0) || !std::isfinite(joint.effort)) {
      Fail("joint '{}' has effort limit {} N m: give its motor's, above 0", name, joint.effort);
    }
    if (!(joint.velocity_limit > 0) || !std::isfinite(joint.velocity_limit)) {
      Fail("joint '{}' has velocity limit {} rad/s: it must be above 0", name,
           joint.velocity_limit);
    }
    return joint;
  }

  void Finish(Body* body, const std::vector<MassProperties>& parts) const {
    const MassProperties merged = Merged(parts);
    if (const std::string why = WhyImmovable(merged); !why.empty()) {
      const std::string moved_by =
          body->joint < 0
              ? "the floating base"
              : "moved by joint '" + tree_->joints[static_cast<size_t>(body->joint)].name + "'";
      Fail(
          "link '{}' ({}) with the links fixed to it: {}: give it a physical <inertial>, or let "
          "`poise robot import` write a repair",
          body->name, moved_by, why);
    }
    body->mass = merged.mass;
    body->com = merged.com;
    body->inertia = 0.5 * (merged.inertia + merged.inertia.transpose());
  }

  const RobotSource& source_;
  LinkTree* tree_;
  std::map<std::string, const SourceLink*> links_;
  std::map<std::string, std::vector<const SourceJoint*>> children_;
  std::vector<std::vector<MassProperties>> parts_;  // by body
};

}  // namespace

LinkTree BuildLinkTree(const RobotSource& source) {
  LinkTree tree;
  TreeBuilder(source, &tree).Build();
  return tree;
}

void TurnBody(int body, const Eigen::Matrix3d& facing, LinkTree* tree) {
  Eigen::Isometry3d back = Eigen::Isometry3d::Identity();
  back.linear() = facing.transpose();
  Body& turned = tree->bodies[static_cast<size_t>(body)];
  turned.com = facing.transpose() * turned.com;
  const Eigen::Matrix3d inertia = facing.transpose() * turned.inertia * facing;
  turned.inertia = 0.5 * (inertia + inertia.transpose());
  for (Joint& joint : tree->joints) {
    if (joint.body == body) {
      joint.origin.linear() = joint.origin.linear() * facing;
      joint.axis = (facing.transpose() * joint.axis).normalized();
    }
    if (tree->bodies[static_cast<size_t>(joint.body)].parent == body) {
      joint.origin = back * joint.origin;
    }
  }
  for (auto& [name, place] : tree->links) {
    if (place.body == body) place.pose = back * place.pose;
  }
}

}  // namespace poise::robot
