#include "components/robot_files/mjcf_source.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>

#include "components/framework/configuration/text_pattern.h"
#include "components/robot/robot_model.h"
#include "components/robot/xml_text.h"
#include "components/robot_files/mjcf_cleaning.h"
#include "components/robot_files/mujoco_xml.h"

namespace poise::robot {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// What the compiler puts in place of no mass at all: boundmass of the cleaned text.
constexpr double kNoMass = 2e-9;  // kg

Vector3d ToVector(const mjtNum* v) { return {v[0], v[1], v[2]}; }

Isometry3d ToPose(const mjtNum* position, const mjtNum* quaternion) {
  Isometry3d pose = Isometry3d::Identity();
  pose.translation() = ToVector(position);
  pose.linear() = Quaterniond(quaternion[0], quaternion[1], quaternion[2], quaternion[3])
                      .normalized()
                      .toRotationMatrix();
  return pose;
}

class Assembler {
 public:
  Assembler(const CleanMjcf& clean, const mjModel& model, MjcfDocument* result)
      : clean_(clean), m_(model), result_(*result), anchor_(clean.bodies.size()) {}

  void Assemble() {
    result_.source.format = "MJCF";
    result_.source.name = clean_.model;
    result_.source.root = clean_.bodies[0].name;
    result_.mesh_folder = clean_.mesh_folder;
    result_.sensors = clean_.sensors;
    result_.keys = clean_.keys;
    const int root = Id(mjOBJ_BODY, 'b', 0);
    Isometry3d place = Isometry3d::Identity();  // in the world, through the frames around it
    for (int b = root; b > 0; b = m_.body_parentid[b]) {
      place = ToPose(m_.body_pos + 3 * b, m_.body_quat + 4 * b) * place;
    }
    result_.root_orientation = Quaterniond(place.linear());
    for (size_t b = 0; b < clean_.bodies.size(); ++b) Body(b);
    for (size_t s = 0; s < clean_.sites.size(); ++s) Site(s);
    for (size_t g = 0; g < clean_.geoms.size(); ++g) Geom(g);
    for (size_t a = 0; a < clean_.actuators.size(); ++a) Actuator(a);
  }

 private:
  int Id(mjtObj type, char letter, size_t index) const {
    const int id = mj_name2id(&m_, type, fmt::format("{}{}", letter, index).c_str());
    if (id < 0) throw RobotError("MJCF: MuJoCo lost an object of the file: simplify it");
    return id;
  }

  MassProperties Mass(size_t index, int id) {
    const CleanBody& body = clean_.bodies[index];
    const Isometry3d inertial = ToPose(m_.body_ipos + 3 * id, m_.body_iquat + 4 * id);
    MassProperties mass;
    mass.com = inertial.translation();
    Vector3d diagonal(body.diagonal[0], body.diagonal[1], body.diagonal[2]);
    if (body.has_inertial) {
      mass.mass = body.mass;
      if (body.full) {
        const auto& f = *body.full;
        mass.inertia << f[0], f[3], f[4], f[3], f[1], f[5], f[4], f[5], f[2];
        return mass;
      }
    } else {
      if (m_.body_mass[id] <= kNoMass) return MassProperties();
      mass.mass = m_.body_mass[id];
      diagonal = ToVector(m_.body_inertia + 3 * id);
      result_.from_shapes.insert(body.name);
    }
    mass.inertia = inertial.linear() * diagonal.asDiagonal() * inertial.linear().transpose();
    return mass;
  }

  // A link's frame lies where its joint does: `anchor` is the body's frame in it.
  void Body(size_t index) {
    const CleanBody& body = clean_.bodies[index];
    const int id = Id(mjOBJ_BODY, 'b', index);
    Isometry3d& anchor = anchor_[index] = Isometry3d::Identity();
    if (body.parent >= 0) {
      SourceJoint joint;
      joint.parent = clean_.bodies[static_cast<size_t>(body.parent)].name;
      joint.child = body.name;
      const Isometry3d parent = anchor_[static_cast<size_t>(body.parent)];
      joint.origin = parent * ToPose(m_.body_pos + 3 * id, m_.body_quat + 4 * id);
      if (body.joint >= 0) {
        Hinge(static_cast<size_t>(body.joint), &joint, &anchor);
      } else {
        joint.name = body.name + "_fixed";
        while (result_.source.FindJoint(joint.name) != nullptr) joint.name += "_";
      }
      result_.source.joints.push_back(joint);
    }
    result_.source.links.push_back({body.name, Transformed(Mass(index, id), anchor)});
  }

  void Hinge(size_t index, SourceJoint* joint, Isometry3d* anchor) {
    const CleanJoint& clean = clean_.joints[index];
    const int id = Id(mjOBJ_JOINT, 'j', index);
    joint->name = clean.name;
    const int type = m_.jnt_type[id];
    const bool limited = m_.jnt_limited[id] != 0;
    joint->kind = type == mjJNT_SLIDE   ? JointKind::kPrismatic
                  : type == mjJNT_HINGE ? (limited ? JointKind::kRevolute : JointKind::kContinuous)
                  : type == mjJNT_FREE  ? JointKind::kFloating
                                        : JointKind::kOther;
    joint->axis = ToVector(m_.jnt_axis + 3 * id);
    const Vector3d place = ToVector(m_.jnt_pos + 3 * id);
    joint->origin.translate(place);
    anchor->translation() = -place;
    // The file's posture is that of position `ref`, ours that of 0.
    const double reference = joint->kind == JointKind::kFloating ? 0 : m_.qpos0[m_.jnt_qposadr[id]];
    if (type == mjJNT_HINGE && reference != 0) {
      joint->origin.rotate(Eigen::AngleAxisd(-reference, joint->axis));
    } else if (type == mjJNT_SLIDE) {
      joint->origin.translate(-reference * joint->axis);
    }
    joint->has_limits = true;
    joint->lower = m_.jnt_range[2 * id];
    joint->upper = m_.jnt_range[2 * id + 1];
    if (clean.force_range) {
      joint->effort =
          std::max(std::abs((*clean.force_range)[0]), std::abs((*clean.force_range)[1]));
    }
    const int dof = m_.jnt_dofadr[id];
    joint->damping = m_.dof_damping[dof];
    joint->friction = m_.dof_frictionloss[dof];
    joint->armature = m_.dof_armature[dof];
    joint->mimic = clean.mimic;
  }

  void Site(size_t index) {
    const int id = Id(mjOBJ_SITE, 's', index);
    const auto body = static_cast<size_t>(clean_.sites[index].body);
    SourceJoint joint;
    joint.name = clean_.sites[index].name + "_fixed";
    while (result_.source.FindJoint(joint.name) != nullptr) joint.name += "_";
    joint.parent = clean_.bodies[body].name;
    joint.child = clean_.sites[index].name;
    joint.origin = anchor_[body] * ToPose(m_.site_pos + 3 * id, m_.site_quat + 4 * id);
    result_.source.joints.push_back(joint);
    result_.source.links.push_back({joint.child, MassProperties()});
  }

  void Geom(size_t index) {
    const CleanGeom& clean = clean_.geoms[index];
    const int id = Id(mjOBJ_GEOM, 'g', index);
    const auto body = static_cast<size_t>(clean.body);
    SourceShape shape;
    shape.link = clean_.bodies[body].name;
    shape.pose = anchor_[body] * ToPose(m_.geom_pos + 3 * id, m_.geom_quat + 4 * id);
    shape.collides = m_.geom_contype[id] != 0 || m_.geom_conaffinity[id] != 0;
    shape.size = ToVector(m_.geom_size + 3 * id);
    using Kind = SourceShape::Kind;
    if (!clean.mesh.empty()) {
      shape.kind = Kind::kMesh;
      shape.mesh = clean.mesh;
      shape.size = Vector3d(clean.scale[0], clean.scale[1], clean.scale[2]);
    } else if (m_.geom_type[id] == mjGEOM_BOX) {
      shape.size *= 2;
    } else if (m_.geom_type[id] == mjGEOM_SPHERE) {
      shape.kind = Kind::kSphere;
    } else if (m_.geom_type[id] == mjGEOM_CYLINDER || m_.geom_type[id] == mjGEOM_CAPSULE) {
      shape.kind = m_.geom_type[id] == mjGEOM_CYLINDER ? Kind::kCylinder : Kind::kCapsule;
      shape.size = Vector3d(shape.size.x(), 2 * shape.size.y(), 0);
    } else {
      return;
    }
    result_.shapes.push_back(shape);
  }

  void Actuator(size_t index) {
    const CleanActuator& clean = clean_.actuators[index];
    const int id = Id(mjOBJ_ACTUATOR, 'a', index);
    SourceJoint& joint =
        *result_.source.FindJoint(clean_.joints[static_cast<size_t>(clean.joint)].name);
    result_.actuated.insert(joint.name);
    const double gear = std::abs(m_.actuator_gear[6 * id]);
    const auto limit = [&](const mjtNum* range) {
      const double effort = gear * std::max(std::abs(range[0]), std::abs(range[1]));
      if (effort > 0) joint.effort = joint.effort > 0 ? std::min(joint.effort, effort) : effort;
    };
    if (m_.actuator_forcelimited[id]) limit(m_.actuator_forcerange + 2 * id);
    if (clean.is_torque && m_.actuator_ctrllimited[id]) limit(m_.actuator_ctrlrange + 2 * id);
  }

  const CleanMjcf& clean_;
  const mjModel& m_;
  MjcfDocument& result_;
  std::vector<Isometry3d> anchor_;
};

// A message of MuJoCo's with the file's names in place of those of the cleaned text.
std::string WithNames(const std::string& problem, const CleanMjcf& clean) {
  const auto name = [&](char kind, size_t i) -> std::string {
    const auto body_of = [&](int b) { return clean.bodies[static_cast<size_t>(b)].name; };
    if (kind == 'b' && i < clean.bodies.size()) return "'" + clean.bodies[i].name + "'";
    if (kind == 'j' && i < clean.joints.size()) return "'" + clean.joints[i].name + "'";
    if (kind == 's' && i < clean.sites.size()) return "'" + clean.sites[i].name + "'";
    if (kind == 'g' && i < clean.geoms.size()) {
      return "a geom of body '" + body_of(clean.geoms[i].body) + "'";
    }
    if (kind == 'a' && i < clean.actuators.size()) {
      return "the actuator of '" +
             clean.joints[static_cast<size_t>(clean.actuators[i].joint)].name + "'";
    }
    return "";
  };
  std::string text;
  size_t from = 0;
  for (const PatternMatch& match : Matches(problem, "\\b([bjsga])([0-9]{1,6})\\b")) {
    const auto& [begin, object] = match[0];
    const std::string known = name(match[1].text.front(), std::stoul(match[2].text));
    text.append(problem, from, begin - from).append(known.empty() ? object : known);
    from = begin + object.size();
  }
  return text.append(problem, from);
}

}  // namespace

MjcfDocument ReadMjcf(std::string_view xml, std::vector<std::string>* warnings) {
  const CleanMjcf clean = CleanedMjcf(xml, warnings);
  std::string problem;
  const MujocoModel model = CompileMjcf(clean.xml, &problem);
  if (!model) {
    throw RobotError("MJCF: MuJoCo refuses it: " + OneLine(WithNames(problem, clean)) +
                     ": correct that element");
  }
  MjcfDocument result;
  Assembler(clean, *model, &result).Assemble();
  return result;
}

}  // namespace poise::robot
