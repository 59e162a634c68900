#include "components/robot/urdf_tree.h"

#include <fmt/format.h>
#include <urdf_model/model.h>

#include <cmath>
#include <limits>

#include "components/robot/inertia.h"
#include "components/robot/urdf_document.h"

namespace poise::robot {
namespace {

constexpr double kMinAxisNorm = 1e-6;
constexpr double kMaxLength = 1e3;  // m: beyond it, a mistaken unit and lost digits

Eigen::Vector3d ToEigen(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Eigen::Isometry3d ToEigen(const urdf::Pose& pose, const std::string& what) {
  Eigen::Quaterniond rotation;
  pose.rotation.getQuaternion(rotation.x(), rotation.y(), rotation.z(), rotation.w());
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.translation() = ToEigen(pose.position);
  result.linear() = rotation.normalized().toRotationMatrix();
  if (!result.matrix().allFinite() || result.translation().norm() > kMaxLength) {
    throw RobotError(fmt::format(
        "URDF: {} has an origin that is not finite or over {} m away: correct its <origin>", what,
        kMaxLength));
  }
  return result;
}

MassProperties LinkMass(const urdf::Link& link) {
  MassProperties part;
  if (!link.inertial) return part;
  const urdf::Inertial& i = *link.inertial;
  part.mass = i.mass;
  part.inertia << i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz;
  part = Transformed(part, ToEigen(i.origin, fmt::format("inertial of link '{}'", link.name)));
  if (const std::string why = WhyImpossible(part); !why.empty()) {
    throw RobotError(fmt::format("URDF: link '{}': {}: correct its <inertial>", link.name, why));
  }
  return part;
}

const char* TypeName(int type) {
  switch (type) {
    case urdf::Joint::PRISMATIC:
      return "prismatic";
    case urdf::Joint::FLOATING:
      return "floating";
    case urdf::Joint::PLANAR:
      return "planar";
    default:
      return "unknown";
  }
}

Joint ToJoint(const urdf::Joint& urdf_joint, const Eigen::Isometry3d& parent_pose) {
  const std::string& name = urdf_joint.name;
  const bool continuous = urdf_joint.type == urdf::Joint::CONTINUOUS;
  if (urdf_joint.type == urdf::Joint::FLOATING) {
    throw RobotError(fmt::format(
        "URDF: joint '{}' is floating: remove it and its parent link, the root link floats already",
        name));
  }
  if (urdf_joint.type != urdf::Joint::REVOLUTE && !continuous) {
    throw RobotError(fmt::format(
        "URDF: joint '{}' is {}: only revolute and continuous joints are controlled, make it fixed",
        name, TypeName(urdf_joint.type)));
  }
  Joint joint;
  joint.name = name;
  joint.origin =
      parent_pose * ToEigen(urdf_joint.parent_to_joint_origin_transform, "joint '" + name + "'");
  const Eigen::Vector3d axis = ToEigen(urdf_joint.axis);
  const double norm = axis.norm();
  if (!(norm > kMinAxisNorm) || !std::isfinite(norm)) {
    throw RobotError(fmt::format(
        "URDF: joint '{}' has an axis of length {:.3g}: give it a direction, e.g. xyz=\"0 0 1\"",
        name, norm));
  }
  joint.axis = axis / norm;
  if (!urdf_joint.limits) {
    throw RobotError(fmt::format(
        "URDF: joint '{}' has no limits: add <limit{} effort=\"...\" velocity=\"...\"/>", name,
        continuous ? "" : " lower=\"...\" upper=\"...\""));
  }
  const urdf::JointLimits& limits = *urdf_joint.limits;
  joint.lower = continuous ? -std::numeric_limits<double>::infinity() : limits.lower;
  joint.upper = continuous ? std::numeric_limits<double>::infinity() : limits.upper;
  joint.effort = limits.effort;
  joint.velocity_limit = limits.velocity;
  if (!(joint.lower < joint.upper)) {
    throw RobotError(
        fmt::format("URDF: joint '{}' has limits {} to {} rad: lower must be below "
                    "upper",
                    name, joint.lower, joint.upper));
  }
  if (!(joint.effort > 0) || !std::isfinite(joint.effort)) {
    throw RobotError(fmt::format(
        "URDF: joint '{}' has effort limit {} N m: give its motor's, above 0", name, joint.effort));
  }
  if (!(joint.velocity_limit > 0) || !std::isfinite(joint.velocity_limit)) {
    throw RobotError(fmt::format("URDF: joint '{}' has velocity limit {} rad/s: it must be above 0",
                                 name, joint.velocity_limit));
  }
  return joint;
}

class TreeBuilder {
 public:
  TreeBuilder(const UrdfDocument& document, UrdfTree* tree) : tree_(tree) {
    for (const std::string& name : document.joint_order) {
      const auto joint = document.model->joints_.find(name);
      if (joint == document.model->joints_.end()) {
        throw RobotError(fmt::format("URDF: joint '{}' was not read: rename it", name));
      }
      children_[joint->second->parent_link_name].push_back(joint->second.get());
    }
    model_ = document.model.get();
  }

  void Build() {
    const urdf::Link& root = *model_->getRoot();
    tree_->name = model_->getName();
    tree_->root_link = root.name;
    StartBody(root.name, -1, -1);
    Visit(root, 0, Eigen::Isometry3d::Identity());
    for (size_t i = 0; i < tree_->bodies.size(); ++i) Finish(&tree_->bodies[i], parts_[i]);
  }

 private:
  void StartBody(const std::string& name, int parent, int joint) {
    Body body;
    body.name = name;
    body.parent = parent;
    body.joint = joint;
    tree_->bodies.push_back(body);
    parts_.emplace_back();
  }

  void Visit(const urdf::Link& link, int body, const Eigen::Isometry3d& pose) {
    tree_->links[link.name] = {body, pose};
    parts_[static_cast<size_t>(body)].push_back(Transformed(LinkMass(link), pose));
    for (const urdf::Joint* urdf_joint : children_[link.name]) {
      const urdf::Link& child = *model_->getLink(urdf_joint->child_link_name);
      if (urdf_joint->type == urdf::Joint::FIXED) {
        tree_->fixed_joints.insert(urdf_joint->name);
        Visit(child, body,
              pose * ToEigen(urdf_joint->parent_to_joint_origin_transform,
                             "joint '" + urdf_joint->name + "'"));
      } else {
        Joint joint = ToJoint(*urdf_joint, pose);
        joint.body = static_cast<int>(tree_->bodies.size());
        StartBody(child.name, body, static_cast<int>(tree_->joints.size()));
        tree_->joints.push_back(joint);
        Visit(child, joint.body, Eigen::Isometry3d::Identity());
      }
    }
  }

  void Finish(Body* body, const std::vector<MassProperties>& parts) const {
    const MassProperties merged = Merged(parts);
    if (const std::string why = WhyImmovable(merged); !why.empty()) {
      const std::string moved_by =
          body->joint < 0
              ? "the floating base"
              : "moved by joint '" + tree_->joints[static_cast<size_t>(body->joint)].name + "'";
      throw RobotError(
          fmt::format("URDF: link '{}' ({}) with the links fixed to it: {}: give it a physical "
                      "<inertial>",
                      body->name, moved_by, why));
    }
    body->mass = merged.mass;
    body->com = merged.com;
    body->inertia = 0.5 * (merged.inertia + merged.inertia.transpose());
  }

  const urdf::ModelInterface* model_ = nullptr;
  UrdfTree* tree_;
  std::map<std::string, std::vector<const urdf::Joint*>> children_;
  std::vector<std::vector<MassProperties>> parts_;  // by body
};

}  // namespace

UrdfTree LoadUrdfTree(std::string_view xml, std::vector<std::string>* warnings) {
  UrdfTree tree;
  const UrdfDocument document = ParseUrdf(xml, warnings);
  TreeBuilder(document, &tree).Build();
  return tree;
}

}  // namespace poise::robot
