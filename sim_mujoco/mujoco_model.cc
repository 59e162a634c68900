#include "sim_mujoco/mujoco_model.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstdio>
#include <mutex>

#include "components/framework/configuration/configuration.h"
#include "components/robot_files/mujoco_xml.h"

namespace poise {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

thread_local char mujoco_warning[160];

void KeepWarning(const char* text) {
  if (mujoco_warning[0] == '\0') {
    std::snprintf(mujoco_warning, sizeof mujoco_warning, "%s", text);
  }
}

// MuJoCo goes on with whatever was wrong when this returns: throwing through it is the only way to
// stop. The world is then never stepped again.
void ThrowError(const char* text) { throw MujocoError(text); }

void Copy(const Vector3d& from, mjtNum* to) { std::copy_n(from.data(), 3, to); }

void Copy(const Quaterniond& from, mjtNum* to) {
  const mjtNum numbers[4] = {from.w(), from.x(), from.y(), from.z()};
  std::copy_n(numbers, 4, to);
}

// The tree alone: its compiler checks and sorts it, its numbers are filled in afterwards, so that
// no number goes through text and MuJoCo's own thresholds refuse no robot that poise has accepted.
void WriteBody(const robot::RobotModel& model, size_t index, std::string* xml) {
  const robot::Body& body = model.bodies()[index];
  *xml +=
      fmt::format("<body name='b{}'><inertial pos='0 0 0.1' mass='1' diaginertia='1 1 1'/>", index);
  *xml += body.parent < 0 ? std::string("<freejoint name='base'/>")
                          : fmt::format("<joint name='j{}' type='hinge'/>", body.joint);
  *xml += fmt::format("<geom name='g{}' type='sphere' size='0.01'/>", index);
  for (size_t child = index + 1; child < model.bodies().size(); ++child) {
    if (model.bodies()[child].parent == static_cast<int>(index)) WriteBody(model, child, xml);
  }
  *xml += "</body>";
}

std::string Mjcf(const robot::RobotModel& model, int max_contacts, double step) {
  std::string xml = fmt::format(
      "<mujoco><compiler angle='radian' inertiafromgeom='false'/>"
      "<option timestep='{:.17g}' gravity='0 0 {:.17g}' solver='Newton' cone='elliptic' "
      "jacobian='dense' iterations='100' tolerance='1e-14'/>"
      "<size njmax='{}' nconmax='{}'/>"
      "<default><geom contype='0' conaffinity='0' mass='0'/></default>"
      "<worldbody><geom name='world' type='sphere' size='0.01'/>",
      step, -robot::kGravity, 3 * std::max(max_contacts, 1), std::max(max_contacts, 1));
  WriteBody(model, 0, &xml);
  return xml + "</worldbody></mujoco>";
}

void FillBody(const robot::RobotModel& model, size_t index, const MujocoRobot& robot) {
  mjModel* m = robot.model.get();
  const robot::Body& body = model.bodies()[index];
  const int id = robot.body[index];
  m->body_mass[id] = body.mass;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(body.inertia);
  Matrix3d axes = principal.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  Copy(Vector3d(principal.eigenvalues()), m->body_inertia + 3 * id);
  Copy(Quaterniond(axes).normalized(), m->body_iquat + 4 * id);
  Copy(body.com, m->body_ipos + 3 * id);
  m->body_sameframe[id] = 0;
  if (body.joint < 0) return;
  const robot::Joint& joint = model.joints()[static_cast<size_t>(body.joint)];
  Copy(Vector3d(joint.origin.translation()), m->body_pos + 3 * id);
  Copy(Quaterniond(joint.origin.linear()).normalized(), m->body_quat + 4 * id);
  Copy(joint.axis, m->jnt_axis + 3 * m->body_jntadr[id]);
}

}  // namespace

MujocoReports::MujocoReports() {
  static std::once_flag once;
  std::call_once(once, [] {
    mju_user_error = ThrowError;
    mju_user_warning = KeepWarning;
  });
  mujoco_warning[0] = '\0';
}

const char* MujocoReports::warning() const { return mujoco_warning; }

MujocoRobot BuildMujocoRobot(const robot::RobotModel& model, int max_contacts, double step) {
  if (mj_version() != mjVERSION_HEADER) {
    throw ConfigError(fmt::format("mujoco: built for version {}, but the library is {}; build anew",
                                  mjVERSION_HEADER, mj_versionString()));
  }
  const MujocoReports reports;
  MujocoRobot robot;
  std::string problem;
  robot.model.reset(robot::CompileMjcf(Mjcf(model, max_contacts, step), &problem).release());
  if (!robot.model) {
    throw ConfigError(fmt::format("mujoco: refuses the robot {}: {}", model.name(), problem));
  }
  const mjModel* m = robot.model.get();
  const auto find = [m](mjtObj kind, const std::string& name) {
    return mj_name2id(m, kind, name.c_str());
  };
  robot.world_geom = find(mjOBJ_GEOM, "world");
  for (size_t b = 0; b < model.bodies().size(); ++b) {
    robot.body.push_back(find(mjOBJ_BODY, fmt::format("b{}", b)));
    robot.geom.push_back(find(mjOBJ_GEOM, fmt::format("g{}", b)));
    FillBody(model, b, robot);
  }
  for (size_t j = 0; j < model.joints().size(); ++j) {
    const int joint = find(mjOBJ_JOINT, fmt::format("j{}", j));
    robot.joint_position.push_back(m->jnt_qposadr[joint]);
    robot.joint_velocity.push_back(m->jnt_dofadr[joint]);
  }
  return robot;
}

}  // namespace poise
