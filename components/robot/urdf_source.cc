#include "components/robot/urdf_source.h"

#include <fmt/format.h>
#include <urdf_model/model.h>

#include "components/robot/robot_model.h"
#include "components/robot/urdf_document.h"

namespace poise::robot {
namespace {

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
  return Transformed(part, ToEigen(i.origin, fmt::format("inertial of link '{}'", link.name)));
}

JointKind ToKind(int type) {
  switch (type) {
    case urdf::Joint::FIXED:
      return JointKind::kFixed;
    case urdf::Joint::REVOLUTE:
      return JointKind::kRevolute;
    case urdf::Joint::CONTINUOUS:
      return JointKind::kContinuous;
    case urdf::Joint::PRISMATIC:
      return JointKind::kPrismatic;
    case urdf::Joint::FLOATING:
      return JointKind::kFloating;
    default:
      return JointKind::kOther;
  }
}

}  // namespace

RobotSource ReadUrdf(std::string_view xml, std::vector<std::string>* warnings) {
  const UrdfDocument document = ParseUrdf(xml, warnings);
  const urdf::ModelInterface& model = *document.model;
  RobotSource source;
  source.format = "URDF";
  source.name = model.getName();
  source.root = model.getRoot()->name;
  for (const auto& [name, link] : model.links_) source.links.push_back({name, LinkMass(*link)});
  for (const std::string& name : document.joint_order) {
    const auto found = model.joints_.find(name);
    if (found == model.joints_.end()) {
      throw RobotError(fmt::format("URDF: joint '{}' was not read: rename it", name));
    }
    const urdf::Joint& joint = *found->second;
    SourceJoint& result = source.joints.emplace_back();
    result.name = name;
    result.kind = ToKind(joint.type);
    result.parent = joint.parent_link_name;
    result.child = joint.child_link_name;
    result.origin = ToEigen(joint.parent_to_joint_origin_transform, "joint '" + name + "'");
    result.axis = ToEigen(joint.axis);
    if (joint.limits) {
      result.has_limits = true;
      result.lower = joint.limits->lower;
      result.upper = joint.limits->upper;
      result.effort = joint.limits->effort;
      result.velocity = joint.limits->velocity;
    }
    if (joint.dynamics) {
      result.damping = joint.dynamics->damping;
      result.friction = joint.dynamics->friction;
    }
    if (const auto mimic = document.mimics.find(name);
        mimic != document.mimics.end() && result.kind != JointKind::kFixed) {
      result.mimic = mimic->second;
    }
  }
  return source;
}

}  // namespace poise::robot
