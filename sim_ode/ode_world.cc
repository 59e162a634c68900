#include "sim_ode/ode_world.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>
#include <mutex>
#include <numbers>
#include <stdexcept>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "components/robot/dynamics.h"

namespace poise {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using std::numbers::pi;

constexpr double kErp = 0.2;   // of the hinges: share of their drift removed per step
constexpr double kCfm = 1e-9;  // m/(N·s), of the hinges
static_assert(sizeof(dReal) == sizeof(double), "ODE's headers must be set for double precision");

class OdeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// ODE reports through process-wide handlers. It goes on after a message, but exits or aborts when
// the handler of an error returns: throwing through it is the only way to keep the process. The
// world is then never stepped again.
thread_local char ode_message[160];

void KeepMessage(int, const char* format, va_list arguments) {
  if (ode_message[0] == '\0') std::vsnprintf(ode_message, sizeof ode_message, format, arguments);
}

void ThrowError(int number, const char* format, va_list arguments) {
  ode_message[0] = '\0';
  KeepMessage(number, format, arguments);
  throw OdeError(ode_message);
}

void StartOde() {
  static std::once_flag once;
  std::call_once(once, [] {
    dInitODE2(0);
    dSetErrorHandler(ThrowError);
    dSetDebugHandler(ThrowError);
    dSetMessageHandler(KeepMessage);
  });
  if (dCheckConfiguration("ODE_double_precision") == 0) {
    throw ConfigError("ode: the ODE library is built in single precision; install libode-dev");
  }
}

Vector3d ToEigen(const dReal* v) { return {v[0], v[1], v[2]}; }

void Turn(dBodyID body, const Matrix3d& r) {
  const dMatrix3 rotation = {r(0, 0), r(0, 1), r(0, 2), 0,       r(1, 0), r(1, 1),
                             r(1, 2), 0,       r(2, 0), r(2, 1), r(2, 2), 0};
  dBodySetRotation(body, rotation);
}

// The robot's tree in the zero posture, in which ODE's hinges are made.
std::vector<TreeStep::Body> Tree(const robot::RobotModel& model) {
  const robot::RobotState zero(model.num_joints());
  robot::RobotData data(model);
  robot::ComputeKinematics(model, zero, &data);
  std::vector<TreeStep::Body> bodies;
  for (size_t b = 0; b < model.bodies().size(); ++b) {
    const robot::Body& body = model.bodies()[b];
    TreeStep::Body& made = bodies.emplace_back();
    made.parent = body.parent;
    made.mass = body.mass;
    made.inertia = body.inertia;
    if (body.parent < 0) continue;
    const auto p = static_cast<size_t>(body.parent);
    const Vector3d& axis = data.joint_axis[static_cast<size_t>(body.joint)];
    made.anchor = -body.com;  // the body's frame is the joint's
    made.axis = data.body_rotation[b].transpose() * axis;
    made.parent_anchor =
        data.body_rotation[p].transpose() * (data.body_position[b] - data.body_position[p]) -
        model.bodies()[p].com;
    made.parent_axis = data.body_rotation[p].transpose() * axis;
  }
  return bodies;
}

}  // namespace

Softness SpringDamper(double k, double d, double h) {
  return {h * k / (h * k + d), 1 / (h * k + d)};
}

WorldFactory OdeWorlds(const OdeConfig& config) {
  CheckFields(config);
  return [config](const robot::RobotModel& model, int max_contacts, double step) {
    return std::make_unique<OdeWorld>(config, model, max_contacts, step);
  };
}

OdeWorld::OdeWorld(const OdeConfig& config, const robot::RobotModel& model, int max_contacts,
                   double step)
    : model_(model),
      step_(step),
      ground_{config.contact_erp(), config.contact_cfm()},
      tree_(Tree(model), max_contacts, step, kErp, kCfm),
      dense_(config.solver() == OdeConfig::DENSE),
      room_(static_cast<size_t>(max_contacts)),
      feedback_(room_),
      force_(room_, Vector3d::Zero()),
      moment_(room_, Vector3d::Zero()) {
  StartOde();
  points_.reserve(room_);
  rows_.reserve(room_);
  world_ = dWorldCreate();
  contacts_ = dJointGroupCreate(0);
  dWorldSetGravity(world_, 0, 0, -robot::kGravity);
  dWorldSetERP(world_, kErp);
  dWorldSetCFM(world_, kCfm);

  // ODE's hinge angles are relative to where the hinge was made: make them in the zero posture.
  const robot::RobotState zero(model.num_joints());
  robot::RobotData data(model);
  robot::ComputeKinematics(model, zero, &data);
  for (const robot::Body& body : model.bodies()) {
    const dBodyID id = dBodyCreate(world_);
    dMass mass;
    const Matrix3d& inertia = body.inertia;
    dMassSetParameters(&mass, body.mass, 0, 0, 0, inertia(0, 0), inertia(1, 1), inertia(2, 2),
                       inertia(0, 1), inertia(0, 2), inertia(1, 2));
    dBodySetMass(id, &mass);
    const Matrix3d& r = data.body_rotation[bodies_.size()];
    const Vector3d com = data.body_position[bodies_.size()] + r * body.com;
    Turn(id, r);
    dBodySetPosition(id, com.x(), com.y(), com.z());
    bodies_.push_back(id);
  }
  for (size_t j = 0; j < model.joints().size(); ++j) {
    const auto child = static_cast<size_t>(model.joints()[j].body);
    const auto parent = static_cast<size_t>(model.bodies()[child].parent);
    const dJointID hinge = dJointCreateHinge(world_, nullptr);
    dJointAttach(hinge, bodies_[child], bodies_[parent]);
    const Vector3d& anchor = data.body_position[child];
    const Vector3d& axis = data.joint_axis[j];
    dJointSetHingeAnchor(hinge, anchor.x(), anchor.y(), anchor.z());
    dJointSetHingeAxis(hinge, axis.x(), axis.y(), axis.z());
    hinges_.push_back(hinge);
  }
  turns_.assign(hinges_.size(), 0);
  last_angle_.assign(hinges_.size(), 0);
}

OdeWorld::~OdeWorld() {
  dJointGroupDestroy(contacts_);
  dWorldDestroy(world_);
}

void OdeWorld::SetState(const robot::RobotState& state) {
  tree_.Forget();
  robot::RobotData data(model_);
  robot::ComputeKinematics(model_, state, &data);
  for (size_t b = 0; b < bodies_.size(); ++b) {
    const Matrix3d& r = data.body_rotation[b];
    const Vector3d arm = r * model_.bodies()[b].com;
    const Vector3d com = data.base_position + data.body_position[b] + arm;
    const Vector3d& w = data.body_angular_velocity[b];
    const Vector3d v = data.body_linear_velocity[b] + w.cross(arm);
    Turn(bodies_[b], r);
    dBodySetPosition(bodies_[b], com.x(), com.y(), com.z());
    dBodySetLinearVel(bodies_[b], v.x(), v.y(), v.z());
    dBodySetAngularVel(bodies_[b], w.x(), w.y(), w.z());
  }
  for (size_t j = 0; j < hinges_.size(); ++j) {
    last_angle_[j] = dJointGetHingeAngle(hinges_[j]);
    const double q = state.joint_position[static_cast<Eigen::Index>(j)];
    turns_[j] = 2 * pi * std::round((q - last_angle_[j]) / (2 * pi));
  }
}

void OdeWorld::GetState(robot::RobotState* state) const {
  const Isometry3d base = pose(0);
  state->base_position = base.translation();
  const dReal* q = dBodyGetQuaternion(bodies_[0]);
  state->base_orientation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  state->base_angular_velocity = angular_velocity(0);
  state->base_linear_velocity =
      com_velocity(0) + angular_velocity(0).cross(base.translation() - com_position(0));
  for (int j = 0; j < model_.num_joints(); ++j) {
    state->joint_position[j] = joint_position(j);
    state->joint_velocity[j] = joint_velocity(j);
  }
}

double OdeWorld::joint_position(int joint) const {
  const auto j = static_cast<size_t>(joint);
  return last_angle_[j] + turns_[j];
}

double OdeWorld::joint_velocity(int joint) const {
  return dJointGetHingeAngleRate(hinges_[static_cast<size_t>(joint)]);
}

Vector3d OdeWorld::com_position(int body) const {
  return ToEigen(dBodyGetPosition(bodies_[static_cast<size_t>(body)]));
}

Vector3d OdeWorld::com_velocity(int body) const {
  return ToEigen(dBodyGetLinearVel(bodies_[static_cast<size_t>(body)]));
}

Vector3d OdeWorld::angular_velocity(int body) const {
  return ToEigen(dBodyGetAngularVel(bodies_[static_cast<size_t>(body)]));
}

Matrix3d OdeWorld::rotation(int body) const {
  const dReal* r = dBodyGetRotation(bodies_[static_cast<size_t>(body)]);
  Matrix3d rotation;
  rotation << r[0], r[1], r[2], r[4], r[5], r[6], r[8], r[9], r[10];
  return rotation;
}

Isometry3d OdeWorld::pose(int body) const {
  Isometry3d pose;
  pose.linear() = rotation(body);
  pose.translation() =
      com_position(body) - pose.linear() * model_.bodies()[static_cast<size_t>(body)].com;
  pose.makeAffine();
  return pose;
}

bool OdeWorld::Finite() const {
  double sum = 0;  // inf and nan survive every addition
  for (const dBodyID body : bodies_) {
    const dReal* position = dBodyGetPosition(body);
    const dReal* rotation = dBodyGetQuaternion(body);
    const dReal* linear = dBodyGetLinearVel(body);
    const dReal* angular = dBodyGetAngularVel(body);
    for (int i = 0; i < 3; ++i) sum += position[i] + linear[i] + angular[i];
    for (int i = 0; i < 4; ++i) sum += rotation[i];
  }
  return std::isfinite(sum);
}

void OdeWorld::SetJoint(int joint, const JointRow& row) {
  const dJointID hinge = hinges_[static_cast<size_t>(joint)];
  TreeStep::Body& child =
      tree_.body(static_cast<size_t>(model_.joints()[static_cast<size_t>(joint)].body));
  child.motor = row.active;
  child.motor_velocity = row.velocity;
  child.motor_cfm = row.cfm;
  dJointAddHingeTorque(hinge, row.torque);
  // ODE divides cfm by the step, so the row it solves is J v' + cfm lambda = velocity.
  dJointSetHingeParam(hinge, dParamFMax, row.active ? dInfinity : 0);
  dJointSetHingeParam(hinge, dParamVel, row.velocity);
  dJointSetHingeParam(hinge, dParamCFM, row.cfm);
}

void OdeWorld::AddForce(int body, const Vector3d& force, const Vector3d& point) {
  dBodyAddForceAtPos(bodies_[static_cast<size_t>(body)], force.x(), force.y(), force.z(), point.x(),
                     point.y(), point.z());
}

void OdeWorld::AddContact(const TerrainContact& contact) {
  if (points_.size() < room_) points_.push_back(contact);
}

Softness OdeWorld::SoftnessOf(const ContactMaterial& material) const {
  return material.stiffness > 0 ? SpringDamper(material.stiffness, material.damping, step_)
                                : ground_;
}

bool OdeWorld::StepTree() {
  for (size_t b = 0; b < bodies_.size(); ++b) {
    TreeStep::Body& body = tree_.body(b);
    body.position = ToEigen(dBodyGetPosition(bodies_[b]));
    body.rotation = rotation(static_cast<int>(b));
    body.linear = ToEigen(dBodyGetLinearVel(bodies_[b]));
    body.angular = ToEigen(dBodyGetAngularVel(bodies_[b]));
    body.force =
        ToEigen(dBodyGetForce(bodies_[b])) - body.mass * robot::kGravity * Vector3d::UnitZ();
    body.torque = ToEigen(dBodyGetTorque(bodies_[b]));
  }
  rows_.clear();
  for (const TerrainContact& point : points_) {
    const Softness softness = SoftnessOf(point.material);
    const dVector3 normal = {point.normal.x(), point.normal.y(), point.normal.z()};
    dVector3 first, second;
    dPlaneSpace(normal, first, second);
    rows_.push_back({point.body,
                     point.position,
                     {point.normal, ToEigen(first), ToEigen(second)},
                     softness.erp / step_ * std::max(point.depth, 0.0) + point.velocity,
                     softness.cfm,
                     point.material.friction});
  }
  if (!tree_.Solve(rows_)) return false;
  for (size_t b = 0; b < bodies_.size(); ++b) {
    const dBodyID id = bodies_[b];
    const TreeStep::Body& body = tree_.body(b);
    const Vector3d position = body.position + step_ * body.linear;
    dBodySetPosition(id, position.x(), position.y(), position.z());
    dBodySetLinearVel(id, body.linear.x(), body.linear.y(), body.linear.z());
    dBodySetAngularVel(id, body.angular.x(), body.angular.y(), body.angular.z());
    // ODE integrates a rotation so when it is not told to do it to higher order.
    const dReal* q = dBodyGetQuaternion(id);
    dVector4 rate;
    dWtoDQ(dBodyGetAngularVel(id), q, rate);
    const dQuaternion turned = {q[0] + step_ * rate[0], q[1] + step_ * rate[1],
                                q[2] + step_ * rate[2], q[3] + step_ * rate[3]};
    dBodySetQuaternion(id, turned);
    dBodySetForce(id, 0, 0, 0);
    dBodySetTorque(id, 0, 0, 0);
  }
  for (size_t c = 0; c < points_.size(); ++c) {
    force_[c] = tree_.force(c);
    moment_[c] = (rows_[c].position - tree_.body(static_cast<size_t>(rows_[c].body)).position)
                     .cross(force_[c]);
  }
  return true;
}

void OdeWorld::StepDense() {
  for (size_t c = 0; c < points_.size(); ++c) {
    const TerrainContact& at = points_[c];
    const Softness softness = SoftnessOf(at.material);
    dContact contact{};
    contact.surface.mode = dContactApprox1 | dContactSoftERP | dContactSoftCFM | dContactMotionN;
    contact.surface.motionN = at.velocity;
    contact.surface.mu = at.material.friction;
    contact.surface.soft_erp = softness.erp;
    contact.surface.soft_cfm = softness.cfm;
    for (int i = 0; i < 3; ++i) {
      contact.geom.pos[i] = at.position[i];
      contact.geom.normal[i] = at.normal[i];
    }
    contact.geom.depth = std::max(at.depth, 0.0);
    const dJointID joint = dJointCreateContact(world_, contacts_, &contact);
    dJointAttach(joint, bodies_[static_cast<size_t>(at.body)], nullptr);
    dJointSetFeedback(joint, &feedback_[c]);
  }
  if (dWorldStep(world_, step_) == 0) std::snprintf(message_, sizeof message_, "out of memory");
  dJointGroupEmpty(contacts_);
  for (size_t c = 0; c < points_.size(); ++c) {
    force_[c] = ToEigen(feedback_[c].f1);
    moment_[c] = ToEigen(feedback_[c].t1);
  }
}

bool OdeWorld::Step() {
  ode_message[0] = '\0';
  try {
    if (dense_) {
      StepDense();
    } else if (!StepTree()) {
      ++given_up_steps_;
      StepDense();
    }
  } catch (const OdeError& error) {
    std::snprintf(message_, sizeof message_, "%s", error.what());
    return false;
  }
  points_.clear();
  for (size_t j = 0; j < hinges_.size(); ++j) {
    const double angle = dJointGetHingeAngle(hinges_[j]);
    if (angle - last_angle_[j] > pi) turns_[j] -= 2 * pi;
    if (angle - last_angle_[j] < -pi) turns_[j] += 2 * pi;
    last_angle_[j] = angle;
  }
  if (message_[0] == '\0') std::memcpy(message_, ode_message, sizeof message_);
  return message_[0] == '\0';
}

Vector3d OdeWorld::contact_force(int index) const { return force_[static_cast<size_t>(index)]; }

Vector3d OdeWorld::contact_moment(int index) const { return moment_[static_cast<size_t>(index)]; }

}  // namespace poise
