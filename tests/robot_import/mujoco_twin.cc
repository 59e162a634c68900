#include "tests/robot_import/mujoco_twin.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <map>
#include <regex>
#include <sstream>
#include <stdexcept>

#include "components/robot_files/robot_files.h"
#include "tests/robot/robot_test_support.h"
#include "tests/robot_import/import_support.h"

namespace poise {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

std::string ForMujoco(std::string text, const std::string& root) {
  if (text.find("<robot") == std::string::npos) {
    // What this version does not know, and meshes; a range limits without being said to since
    // MuJoCo 3, for which the file is written.
    text = std::regex_replace(text, std::regex("<compiler "), "<compiler autolimits=\"true\" ");
    text = std::regex_replace(text, std::regex(" actuatorfrc\\w+=\"[^\"]*\""), "");
    text = std::regex_replace(text, std::regex("<geom[^>]*mesh[^>]*/>"), "");
    text = std::regex_replace(text, std::regex("<mesh[^>]*/>"), "");
    return text;
  }
  for (const char* element : {"visual", "collision", "mujoco", "gazebo", "transmission"}) {
    const std::string name = element;
    text = std::regex_replace(text,
                              std::regex("<" + name + "(>|\\s[^>]*[^/]>)[^]*?</" + name + ">"), "");
  }
  text.insert(text.rfind("</robot>"),
              "<mujoco><compiler fusestatic=\"false\" balanceinertia=\"true\" boundmass=\"1e-9\" "
              "boundinertia=\"1e-12\"/></mujoco><link name=\"world\"/><joint name=\"floating\" "
              "type=\"floating\"><parent link=\"world\"/><child link=\"" +
                  root + "\"/></joint>");
  return text;
}

Vector3d Three(const tinyxml2::XMLElement* element, const char* name) {
  Vector3d numbers = Vector3d::Zero();
  const char* const text = element ? element->Attribute(name) : nullptr;
  std::istringstream in(text ? text : "");
  in >> numbers[0] >> numbers[1] >> numbers[2];
  return numbers;
}

Matrix3d FromRpy(const Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
      .toRotationMatrix();
}

}  // namespace

MujocoTwin::MujocoTwin(const std::filesystem::path& file) {
  const std::string text = robot::ReadWhole(file);
  ImportOptions options;
  options.file = file;
  const Robot robot = ImportRobot(options).robot;
  model_ = robot::MakeRobot(robot, text);
  const std::string root = robot::MakeTree(robot, text).root_link;
  const auto path = WriteMaker("mujoco_" + file.stem().string(), ForMujoco(text, root));
  char error[1000] = "";
  m_.reset(mj_loadXML(path.c_str(), nullptr, error, sizeof error));
  if (!m_) throw std::runtime_error(error);
  TakeInertias(robot, text);
  m_->opt.gravity[0] = m_->opt.gravity[1] = 0;
  m_->opt.gravity[2] = -robot::kGravity;
  m_->opt.disableflags |= mjDSBL_CONTACT | mjDSBL_LIMIT | mjDSBL_EQUALITY | mjDSBL_PASSIVE;
  d_.reset(mj_makeData(m_.get()));
  root_ = mj_name2id(m_.get(), mjOBJ_BODY, root.c_str());
  for (const Facing& facing : robot.facing()) {
    if (facing.link() == root) facing_ = FromRpy({facing.roll(), facing.pitch(), facing.yaw()});
  }
  // Joints that stand still here stand there likewise, and their columns are left out.
  for (const Lock& lock : robot.lock()) {
    for (const std::string& name : lock.joint()) {
      const int id = mj_name2id(m_.get(), mjOBJ_JOINT, name.c_str());
      if (id >= 0) d_->qpos[m_->jnt_qposadr[id]] = lock.position();
    }
  }
  for (int j = 0; j < model_.num_joints(); ++j) {
    const auto index = static_cast<size_t>(j);
    const int id = mj_name2id(m_.get(), mjOBJ_JOINT, model_.joints()[index].name.c_str());
    if (id < 0) throw std::runtime_error("MuJoCo has no joint " + model_.joints()[index].name);
    position_.push_back(m_->jnt_qposadr[id]);
    velocity_.push_back(m_->jnt_dofadr[id]);
    m_->dof_armature[velocity_.back()] = model_.motors()[index].reflected_inertia;
  }
}

/// MuJoCo keeps principal axes to some 1e-8: each link's inertia is put in as the file writes it,
/// or as the importer repaired it.
void MujocoTwin::TakeInertias(const Robot& robot, const std::string& text) {
  std::map<std::string, const Repair*> repairs;
  for (const Repair& repair : robot.repair()) repairs[repair.link()] = &repair;
  const auto put = [&](const std::string& link, double mass, const Vector3d& com,
                       Matrix3d inertia) {
    const int body = mj_name2id(m_.get(), mjOBJ_BODY, link.c_str());
    if (body < 0) throw std::runtime_error("MuJoCo has no body " + link);
    if (const auto known = repairs.find(link); known != repairs.end()) {
      const Repair& repair = *known->second;
      if (repair.has_mass()) mass = repair.mass();
      if (repair.has_inertia()) {
        const Inertia& i = repair.inertia();
        inertia << i.ixx(), i.ixy(), i.ixz(), i.ixy(), i.iyy(), i.iyz(), i.ixz(), i.iyz(), i.izz();
      }
      if (repair.has_rotor()) {
        const Vector3d axis = Vector3d::Map(m_->jnt_axis + 3 * m_->body_jntadr[body]);
        inertia -= repair.rotor() * axis * axis.transpose();
      }
    }
    const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(inertia);
    Matrix3d axes = principal.eigenvectors();
    if (axes.determinant() < 0) axes.col(0) *= -1;
    const Eigen::Quaterniond q(axes);
    m_->body_mass[body] = mass;
    Vector3d::Map(m_->body_ipos + 3 * body) = com;
    Vector3d::Map(m_->body_inertia + 3 * body) = principal.eigenvalues();
    const mjtNum quaternion[4] = {q.w(), q.x(), q.y(), q.z()};
    std::copy_n(quaternion, 4, m_->body_iquat + 4 * body);
    m_->body_sameframe[body] = 0;  // the axes may not be the body's any more
  };
  tinyxml2::XMLDocument document;
  document.Parse(text.data(), text.size());
  const tinyxml2::XMLElement* const root = document.RootElement();
  if (std::string_view(root->Value()) != "robot") {
    if (!repairs.empty()) throw std::runtime_error("repairs of MJCF are not put into MuJoCo");
    const mjtNum total = mj_getTotalmass(m_.get());
    if (std::abs(total - model_.total_mass()) > 1e-9 * total) throw std::runtime_error("mass");
    return;
  }
  for (const tinyxml2::XMLElement* link = root->FirstChildElement("link"); link;
       link = link->NextSiblingElement("link")) {
    const tinyxml2::XMLElement* const inertial = link->FirstChildElement("inertial");
    if (inertial == nullptr) {
      put(link->Attribute("name"), 0, Vector3d::Zero(), Matrix3d::Zero());
      continue;
    }
    const tinyxml2::XMLElement* const origin = inertial->FirstChildElement("origin");
    const tinyxml2::XMLElement* const moments = inertial->FirstChildElement("inertia");
    const auto number = [&](const char* name) { return std::stod(moments->Attribute(name)); };
    Matrix3d inertia;
    inertia << number("ixx"), number("ixy"), number("ixz"), number("ixy"), number("iyy"),
        number("iyz"), number("ixz"), number("iyz"), number("izz");
    const Matrix3d turn = FromRpy(Three(origin, "rpy"));
    put(link->Attribute("name"), std::stod(inertial->FirstChildElement("mass")->Attribute("value")),
        Three(origin, "xyz"), turn * inertia * turn.transpose());
  }
  mj_setConst(
      m_.get(),
      std::unique_ptr<mjData, void (*)(mjData*)>(mj_makeData(m_.get()), mj_deleteData).get());
}

void MujocoTwin::SetState(const robot::RobotState& state) const {
  const Eigen::Quaterniond q(state.base_orientation * Eigen::Quaterniond(facing_.transpose()));
  Vector3d::Map(d_->qpos) = state.base_position;
  const double turn[4] = {q.w(), q.x(), q.y(), q.z()};
  std::copy_n(turn, 4, d_->qpos + 3);
  for (size_t j = 0; j < position_.size(); ++j) {
    d_->qpos[position_[j]] = state.joint_position[static_cast<Eigen::Index>(j)];
  }
}

MujocoTwin::Dynamics MujocoTwin::At(const robot::RobotState& state) const {
  SetState(state);
  const Eigen::Index n = model_.num_velocities();
  MatrixXd t = MatrixXd::Zero(m_->nv, n);  // to MuJoCo's order, angular velocity in its root's axes
  t.topLeftCorner<3, 3>().setIdentity();
  t.block<3, 3>(3, 3) =
      (state.base_orientation.toRotationMatrix() * facing_.transpose()).transpose();
  for (size_t j = 0; j < velocity_.size(); ++j)
    t(velocity_[j], 6 + static_cast<Eigen::Index>(j)) = 1;
  Dynamics result;
  VectorXd::Map(d_->qvel, m_->nv).setZero();
  mj_forward(m_.get(), d_.get());
  result.gravity = t.transpose() * VectorXd::Map(d_->qfrc_bias, m_->nv);
  VectorXd::Map(d_->qvel, m_->nv) = t * robot::Velocity(state);
  mj_forward(m_.get(), d_.get());
  RowMajor mass(m_->nv, m_->nv), com(3, m_->nv);
  mj_fullM(m_.get(), mass.data(), d_->qM);
  result.mass = t.transpose() * mass * t;
  result.bias = t.transpose() * VectorXd::Map(d_->qfrc_bias, m_->nv) - result.gravity;
  result.com = Vector3d::Map(d_->subtree_com + 3 * root_);
  mj_jacSubtreeCom(m_.get(), d_.get(), com.data(), root_);
  result.com_jacobian = com * t;
  // What the bodies accelerate by where no joint does: J̇ v, in MuJoCo's velocities. Its angular
  // base velocity is in base axes, whose derivative is that of the world's: nothing is added.
  VectorXd::Map(d_->qacc, m_->nv).setZero();
  mj_rnePostConstraint(m_.get(), d_.get());
  for (size_t f = 0; f < 2; ++f) {
    const robot::FootModel& foot = model_.feet()[f];
    const std::string& name = model_.bodies()[static_cast<size_t>(foot.body)].name;
    const int body = mj_name2id(m_.get(), mjOBJ_BODY, name.c_str());
    if (body < 0) throw std::runtime_error("MuJoCo has no body " + name);
    Dynamics::Foot& found = result.foot[f];
    const Matrix3d turn =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(d_->xmat + 9 * body);
    const Vector3d at = Vector3d::Map(d_->xpos + 3 * body);
    found.sole = Eigen::Isometry3d::Identity();
    found.sole.linear() = turn;
    found.sole.translation() = at;
    found.sole = found.sole * foot.sole;
    const Vector3d point = found.sole.translation();
    RowMajor linear(3, m_->nv), angular(3, m_->nv);
    mj_jac(m_.get(), d_.get(), linear.data(), angular.data(), point.data(), body);
    found.jacobian.resize(6, n);
    found.jacobian << linear * t, angular * t;
    double a[6], v[6];  // angular before linear
    mj_objectAcceleration(m_.get(), d_.get(), mjOBJ_XBODY, body, a, 0);
    mj_objectVelocity(m_.get(), d_.get(), mjOBJ_XBODY, body, v, 0);
    const Vector3d alpha = Vector3d::Map(a), omega = Vector3d::Map(v), arm = point - at;
    // MuJoCo lets gravity be an acceleration of the world upwards.
    const Vector3d of_body = Vector3d::Map(a + 3) - Vector3d(0, 0, robot::kGravity);
    found.acceleration.resize(6);
    found.acceleration << of_body + alpha.cross(arm) + omega.cross(omega.cross(arm)), alpha;
  }
  return result;
}

}  // namespace poise
