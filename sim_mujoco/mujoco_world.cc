#include "sim_mujoco/mujoco_world.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"

namespace poise {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using VectorMap = Eigen::Map<Eigen::VectorXd>;
using ConstVectorMap = Eigen::Map<const Eigen::VectorXd>;

// A joint row that is stiffer is taken as this stiff: a mass matrix has 16 digits.
constexpr double kLeastCfm = 1e-12;  // rad/s per N·m
// Where MuJoCo's cone ends: a point with less friction has none.
constexpr double kLeastFriction = mjMINMU;
// Coulomb's law is solved when no point's slip changes by more than this and this share of it; it
// takes one to three solutions, and some more where a sole starts or stops sliding.
constexpr double kSlipTolerance = 1e-8;  // m/s
constexpr double kSlipShare = 1e-7;
constexpr int kMostSolutions = 60;
// m/(N·s), at which a point of a sole that sticks creeps sideways, on ground and block.
constexpr double kFrictionSoftness = 1e-9;
constexpr double kLeastPace = 0.05, kMostPace = 20;

static_assert(sizeof(mjtNum) == sizeof(double),
              "MuJoCo's headers must be set for double precision");

Vector3d ToEigen(const mjtNum* v) { return {v[0], v[1], v[2]}; }

}  // namespace

ContactLaw SpringDamperLaw(double k, double d, double depth, double h) {
  const double gain = h * k + d;
  return {k * depth / gain, 1 / gain};
}

WorldFactory MujocoWorlds(const MujocoConfig& config) {
  CheckFields(config);
  return [config](const robot::RobotModel& model, int max_contacts, double step) {
    if (config.contact_time_constant() < step) {
      throw ConfigError(
          fmt::format("mujoco.contact_time_constant: {} s is less than a step of {} "
                      "s: the ground would throw the robot off",
                      config.contact_time_constant(), step));
    }
    return std::make_unique<MujocoWorld>(config, model, max_contacts, step);
  };
}

MujocoWorld::MujocoWorld(const MujocoConfig& config, const robot::RobotModel& model,
                         int max_contacts, double step)
    : model_(model),
      step_(step),
      time_constant_(config.contact_time_constant()),
      softness_(config.contact_softness()),
      robot_(BuildMujocoRobot(model, max_contacts, step)),
      contacts_(static_cast<size_t>(max_contacts)) {
  const MujocoReports reports;
  data_.reset(mj_makeData(robot_.model.get()));
  mj_setConst(robot_.model.get(), data_.get());
  SetState(robot::RobotState(model.num_joints()));
}

void MujocoWorld::SetState(const robot::RobotState& state) {
  mjData* d = data_.get();
  const Quaterniond& q = state.base_orientation;
  const Vector3d spin = q.conjugate() * state.base_angular_velocity;  // MuJoCo's is the body's own
  const double position[7] = {state.base_position.x(),
                              state.base_position.y(),
                              state.base_position.z(),
                              q.w(),
                              q.x(),
                              q.y(),
                              q.z()};
  std::copy_n(position, 7, d->qpos);
  std::copy_n(state.base_linear_velocity.data(), 3, d->qvel);
  std::copy_n(spin.data(), 3, d->qvel + 3);
  for (int j = 0; j < model_.num_joints(); ++j) {
    const auto i = static_cast<size_t>(j);
    d->qpos[robot_.joint_position[i]] = state.joint_position[j];
    d->qvel[robot_.joint_velocity[i]] = state.joint_velocity[j];
  }
  std::fill_n(d->qacc_warmstart, robot_.model->nv, 0.0);
  UpdateKinematics();
}

void MujocoWorld::UpdateKinematics() {
  mj_kinematics(robot_.model.get(), data_.get());
  mj_comPos(robot_.model.get(), data_.get());
  mj_comVel(robot_.model.get(), data_.get());
}

void MujocoWorld::GetState(robot::RobotState* state) const {
  const mjData* d = data_.get();
  state->base_position = ToEigen(d->qpos);
  state->base_orientation = Quaterniond(d->qpos[3], d->qpos[4], d->qpos[5], d->qpos[6]);
  state->base_linear_velocity = ToEigen(d->qvel);
  state->base_angular_velocity = angular_velocity(0);
  for (int j = 0; j < model_.num_joints(); ++j) {
    state->joint_position[j] = joint_position(j);
    state->joint_velocity[j] = joint_velocity(j);
  }
}

double MujocoWorld::joint_position(int joint) const {
  return data_->qpos[robot_.joint_position[static_cast<size_t>(joint)]];
}

double MujocoWorld::joint_velocity(int joint) const {
  return data_->qvel[robot_.joint_velocity[static_cast<size_t>(joint)]];
}

Vector3d MujocoWorld::com_position(int body) const {
  return ToEigen(data_->xipos + 3 * robot_.body[static_cast<size_t>(body)]);
}

Vector3d MujocoWorld::com_velocity(int body) const {
  const int id = robot_.body[static_cast<size_t>(body)];
  // MuJoCo's are of the body's point at the whole robot's COM.
  const Vector3d at = ToEigen(data_->subtree_com + 3 * robot_.model->body_rootid[id]);
  const mjtNum* velocity = data_->cvel + 6 * id;
  return ToEigen(velocity + 3) + ToEigen(velocity).cross(com_position(body) - at);
}

Vector3d MujocoWorld::angular_velocity(int body) const {
  return ToEigen(data_->cvel + 6 * robot_.body[static_cast<size_t>(body)]);
}

Matrix3d MujocoWorld::rotation(int body) const {
  const mjtNum* r = data_->xmat + 9 * robot_.body[static_cast<size_t>(body)];
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r);
}

Isometry3d MujocoWorld::pose(int body) const {
  Isometry3d pose;
  pose.linear() = rotation(body);
  pose.translation() = ToEigen(data_->xpos + 3 * robot_.body[static_cast<size_t>(body)]);
  pose.makeAffine();
  return pose;
}

bool MujocoWorld::Finite() const {
  // inf and nan survive every addition
  const double sum = ConstVectorMap(data_->qpos, robot_.model->nq).sum() +
                     ConstVectorMap(data_->qvel, robot_.model->nv).sum() +
                     ConstVectorMap(data_->cvel, 6 * robot_.model->nbody).sum();
  return std::isfinite(sum);
}

// M (qd' - qd) / h + D qd' = torque + D v, with D = 1 / cfm, is
// (M + h D) (qd' - qd) / h = torque + D (v - qd).
void MujocoWorld::SetJoint(int joint, const JointRow& row) {
  const int dof = robot_.joint_velocity[static_cast<size_t>(joint)];
  const double gain = row.active ? 1 / std::max(row.cfm, kLeastCfm) : 0;
  robot_.model->dof_armature[dof] = step_ * gain;
  data_->qfrc_applied[dof] = row.torque + gain * (row.velocity - data_->qvel[dof]);
}

void MujocoWorld::AddForce(int body, const Vector3d& force, const Vector3d& point) {
  Eigen::Map<Eigen::Matrix<double, 6, 1>> wrench(data_->xfrc_applied +
                                                 6 * robot_.body[static_cast<size_t>(body)]);
  wrench.head<3>() += force;
  wrench.tail<3>() += (point - com_position(body)).cross(force);
  applied_force_ += force;
}

void MujocoWorld::AddContact(const TerrainContact& at) {
  if (stepped_) num_contacts_ = 0;
  stepped_ = false;
  if (num_contacts_ == contacts_.size()) return;
  Contact& contact = contacts_[num_contacts_++];
  contact.at = at;
  const ContactMaterial& material = at.material;
  if (material.stiffness > 0) {
    contact.law = SpringDamperLaw(material.stiffness, material.damping, at.depth, step_);
  } else {
    // A gap may close within the step.
    contact.law = {at.depth / (at.depth < 0 ? step_ : time_constant_), softness_};
  }
  contact.law.target += at.velocity;
  contact.slip = contact.slip_change = 0;
  contact.com = com_position(at.body);
}

bool MujocoWorld::Step() {
  if (stepped_) num_contacts_ = 0;
  stepped_ = true;
  const MujocoReports reports;
  try {
    Advance();
  } catch (const MujocoError& error) {
    std::snprintf(message_, sizeof message_, "%s", error.what());
    return false;
  }
  if (message_[0] == '\0') std::snprintf(message_, sizeof message_, "%s", reports.warning());
  return message_[0] == '\0';
}

void MujocoWorld::Advance() {
  const mjModel* m = robot_.model.get();
  mjData* d = data_.get();
  mj_crb(m, d);
  mj_factorM(m, d);
  AddContacts();
  mj_makeConstraint(m, d);
  mj_rne(m, d, 0, d->qfrc_bias);
  mj_fwdAcceleration(m, d);
  SetLaws();
  SolveContacts();
  ReadContacts();
  Integrate();
  std::fill_n(d->xfrc_applied, 6 * m->nbody, 0.0);
  std::fill_n(d->qfrc_applied, m->nv, 0.0);
  std::fill_n(robot_.model->dof_armature, m->nv, 0.0);
  applied_force_.setZero();
}

void MujocoWorld::AddContacts() {
  mjData* d = data_.get();
  d->ncon = 0;
  for (size_t i = 0; i < num_contacts_; ++i) {
    const TerrainContact& at = contacts_[i].at;
    mjContact contact{};
    std::copy_n(at.position.data(), 3, contact.pos);
    const Vector3d tangent = at.normal.unitOrthogonal();
    Eigen::Map<Matrix3d>(contact.frame) << at.normal, tangent, at.normal.cross(tangent);
    std::fill_n(contact.friction, 5, std::max(at.material.friction, kLeastFriction));
    mj_defaultSolRefImp(contact.solref, contact.solimp);
    contact.dim = at.material.friction < kLeastFriction ? 1 : 3;
    contact.geom1 = robot_.world_geom;
    contact.geom2 = robot_.geom[static_cast<size_t>(at.body)];
    mj_addContact(robot_.model.get(), d, &contact);
  }
}

// m/s², acceleration of the contact's point at constant qvel. In a step the point goes
// h J v' + h² / 2 of this: J v' alone would leave a gap under a foot while the robot turns above
// it.
Vector3d MujocoWorld::PointBias(const TerrainContact& at) const {
  const mjModel* m = robot_.model.get();
  const mjData* d = data_.get();
  const int body = robot_.body[static_cast<size_t>(at.body)];
  Vector3d angular = Vector3d::Zero(), linear = Vector3d::Zero();
  for (int dof = m->body_dofadr[body] + m->body_dofnum[body] - 1; dof >= 0;
       dof = m->dof_parentid[dof]) {
    angular += d->qvel[dof] * ToEigen(d->cdof_dot + 6 * dof);
    linear += d->qvel[dof] * ToEigen(d->cdof_dot + 6 * dof + 3);
  }
  const Vector3d arm = at.position - ToEigen(d->subtree_com + 3 * m->body_rootid[body]);
  const Vector3d spin = ToEigen(d->cvel + 6 * body);
  const Vector3d velocity = ToEigen(d->cvel + 6 * body + 3) + spin.cross(arm);
  return linear + angular.cross(arm) + spin.cross(velocity);
}

// Rows in MuJoCo's form: R force = aref - a, with a = (v' - v) / h.
void MujocoWorld::SetLaws() {
  mjData* d = data_.get();
  mj_mulJacVec(robot_.model.get(), d, d->efc_vel, d->qvel);
  // What the integration adds to a point's way, see Integrate and PointBias.
  const Vector3d com_bias =
      ToEigen(d->qfrc_bias) / model_.total_mass() - robot::kGravity * Vector3d::UnitZ();
  for (int i = 0; i < d->ncon; ++i) {
    Contact& contact = contacts_[static_cast<size_t>(i)];
    mjContact& cone = d->contact[i];
    const int row = cone.efc_address;
    const Vector3d bias = PointBias(contact.at) + com_bias;
    for (int k = 0; k < cone.dim; ++k) {
      d->efc_vel[row + k] += step_ / 2 * ToEigen(cone.frame + 3 * k).dot(bias);
    }
    d->efc_R[row] = contact.law.softness / step_;
    d->efc_D[row] = 1 / d->efc_R[row];
    for (int k = row + 1; k < row + cone.dim; ++k) {
      d->efc_R[k] = kFrictionSoftness / step_;
      d->efc_D[k] = 1 / d->efc_R[k];
      d->efc_aref[k] = -d->efc_vel[k] / step_;
    }
    if (cone.dim == 3) {
      // The cone in the metric of R, as MuJoCo's elliptic cones want it.
      cone.mu = cone.friction[0] * std::sqrt(d->efc_R[row + 1] / d->efc_R[row]);
      contact.slip = std::hypot(d->efc_vel[row + 1], d->efc_vel[row + 2]);
    }
    SetNormalReference(contact, row);
  }
}

// MuJoCo's cone lets a point leave the ground at friction times its slip. Asking for so much less
// leaves Coulomb's law: the force along the normal does not know of the slip.
void MujocoWorld::SetNormalReference(const Contact& contact, int row) {
  mjData* d = data_.get();
  const double target = contact.law.target - contact.at.material.friction * contact.slip;
  d->efc_aref[row] = (target - d->efc_vel[row]) / step_;
}

void MujocoWorld::SolveContacts() {
  double pace = 1;
  for (solutions_ = 1;; ++solutions_) {
    mj_fwdConstraint(robot_.model.get(), data_.get());
    const SlipChange change = FindSlipChange();
    if (change.largest <= 1) return;
    if (solutions_ == kMostSolutions) break;
    // Aitken's: what the last two changes say of the way to their end (Irons and Tuck, 1969).
    if (solutions_ > 1 && change.difference > 0) {
      pace = std::clamp(-pace * change.along / change.difference, kLeastPace, kMostPace);
    }
    CorrectSlip(pace);
  }
  ++unsolved_steps_;
}

MujocoWorld::SlipChange MujocoWorld::FindSlipChange() {
  mjData* d = data_.get();
  SlipChange all;
  mj_mulJacVec(robot_.model.get(), d, d->efc_b, d->qacc);
  for (int i = 0; i < d->ncon; ++i) {
    const mjContact& cone = d->contact[i];
    if (cone.dim == 1) continue;
    const int row = cone.efc_address;
    Contact& contact = contacts_[static_cast<size_t>(i)];
    const double speed = std::hypot(d->efc_vel[row + 1] + step_ * d->efc_b[row + 1],
                                    d->efc_vel[row + 2] + step_ * d->efc_b[row + 2]);
    // A point that sticks creeps: only what is beyond that counts as slip.
    const double creep = kFrictionSoftness * cone.friction[0] * d->efc_force[row];
    const double change = std::max(0.0, speed - creep) - contact.slip;
    all.largest = std::max(all.largest, std::abs(change) / (kSlipTolerance + kSlipShare * speed));
    const double difference = change - contact.slip_change;
    all.along += contact.slip_change * difference;
    all.difference += difference * difference;
    contact.slip_change = change;
  }
  return all;
}

// Pace 1 is exact for a mass that does not turn.
void MujocoWorld::CorrectSlip(double pace) {
  const mjData* d = data_.get();
  for (int i = 0; i < d->ncon; ++i) {
    const mjContact& cone = d->contact[i];
    if (cone.dim == 1) continue;
    Contact& contact = contacts_[static_cast<size_t>(i)];
    const double gain = pace * (1 + cone.friction[0] * cone.friction[0]);
    contact.slip = std::max(0.0, contact.slip + gain * contact.slip_change);
    SetNormalReference(contact, cone.efc_address);
  }
}

void MujocoWorld::ReadContacts() {
  const mjData* d = data_.get();
  for (int i = 0; i < d->ncon; ++i) {
    const mjContact& cone = d->contact[i];
    Contact& contact = contacts_[static_cast<size_t>(i)];
    contact.force.setZero();
    for (int k = 0; k < cone.dim; ++k) {
      contact.force += d->efc_force[cone.efc_address + k] * ToEigen(cone.frame + 3 * k);
    }
    contact.moment = (contact.at.position - contact.com).cross(contact.force);
  }
}

Vector3d MujocoWorld::RobotVelocity() const {
  Vector3d momentum = Vector3d::Zero();
  for (int b = 0; b < static_cast<int>(model_.bodies().size()); ++b) {
    momentum += model_.bodies()[static_cast<size_t>(b)].mass * com_velocity(b);
  }
  return momentum / model_.total_mass();
}

void MujocoWorld::Integrate() {
  const mjModel* m = robot_.model.get();
  mjData* d = data_.get();
  Vector3d force = applied_force_;
  for (size_t i = 0; i < num_contacts_; ++i) force += contacts_[i].force;
  const mjtNum* const robot_com = d->subtree_com + 3 * robot_.body[0];
  const Vector3d velocity =
      RobotVelocity() + step_ * (force / model_.total_mass() - robot::kGravity * Vector3d::UnitZ());
  const Vector3d com = ToEigen(robot_com) + step_ * velocity;
  VectorMap(d->qvel, m->nv) += step_ * ConstVectorMap(d->qacc, m->nv);
  mj_integratePos(m, d->qpos, d->qvel, step_);
  d->time += step_;
  UpdateKinematics();
  // The step's forces were balanced before the bodies turned, which leaves the robot's COM wrong by
  // terms of second order. The base takes them up; the joints keep their law.
  MoveRobot(com - ToEigen(robot_com), velocity - RobotVelocity());
}

// All bodies alike.
void MujocoWorld::MoveRobot(const Vector3d& distance, const Vector3d& velocity) {
  const mjModel* m = robot_.model.get();
  mjData* d = data_.get();
  const auto add = [](const Vector3d& v, mjtNum* to) { Eigen::Map<Vector3d>(to) += v; };
  add(distance, d->qpos);
  add(velocity, d->qvel);
  for (const int body : robot_.body) {
    add(distance, d->xpos + 3 * body);
    add(distance, d->xipos + 3 * body);
    add(distance, d->subtree_com + 3 * body);
  }
  for (const int geom : robot_.geom) add(distance, d->geom_xpos + 3 * geom);
  for (int joint = 0; joint < m->njnt; ++joint) add(distance, d->xanchor + 3 * joint);
  mj_comVel(m, d);
}

Vector3d MujocoWorld::contact_force(int index) const {
  return contacts_[static_cast<size_t>(index)].force;
}

Vector3d MujocoWorld::contact_moment(int index) const {
  return contacts_[static_cast<size_t>(index)].moment;
}

}  // namespace poise
