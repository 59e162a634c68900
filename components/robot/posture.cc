#include "components/robot/posture.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace poise::robot {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kTolerance = 1e-8;   // m and rad, of the goal
constexpr double kConverged = 1e-13;  // m and rad: no step can improve on it
constexpr double kStationary = 1e-9;  // rad, of the motion towards the nominal posture
constexpr int kMaxIterations = 200;
constexpr int kMaxNullSteps = 100;
constexpr double kMaxStep = 0.3;  // rad: keeps the linearisation honest
constexpr double kMaxDamping = 1e6;
constexpr double kMinDamping = 1e-14;
constexpr double kAtLimit = 1e-12;  // rad
constexpr int kRows = 18;           // two feet of six, body orientation, COM

using Error = Eigen::Matrix<double, kRows, 1>;

Vector3d RotationError(const Matrix3d& actual, const Matrix3d& wanted) {
  const Eigen::AngleAxisd difference(actual * wanted.transpose());
  return difference.angle() * difference.axis();
}

class PostureSolver {
 public:
  PostureSolver(const RobotModel& model, const PostureGoal& goal)
      : model_(model),
        goal_(goal),
        data_(model),
        jacobian_(kRows, model.num_velocities()),
        point_jacobian_(6, model.num_velocities()),
        nominal_(goal.nominal) {
    for (int j = 0; j < model.num_joints(); ++j) {
      nominal_[j] = std::clamp(nominal_[j], joint(j).lower, joint(j).upper);
    }
  }

  // From the nominal posture moved by `blend` of the way to the middle of the joint ranges:
  // straight knees are singular.
  bool Solve(double blend) {
    state_ = RobotState(model_.num_joints());
    for (int j = 0; j < model_.num_joints(); ++j) {
      const double middle = 0.5 * (joint(j).lower + joint(j).upper);
      state_.joint_position[j] =
          std::isfinite(middle) ? nominal_[j] + blend * (middle - nominal_[j]) : nominal_[j];
    }
    Evaluate();
    Vector3d shift = Vector3d::Zero();
    for (const Foot f : kFeet) {
      shift += 0.5 * (goal_.foot[f].translation() - data_.foot_pose[f].translation());
    }
    state_.base_position += shift;
    Evaluate();
    if (!ReachGoal()) return false;
    ApproachNominal();
    return true;
  }

  const RobotState& state() const { return state_; }
  double worst() const { return error_.lpNorm<Eigen::Infinity>(); }

  std::string Shortfall() const {
    Error::Index row = 0;
    error_.cwiseAbs().maxCoeff(&row);
    static constexpr std::array kParts = {"right foot position", "right foot orientation",
                                          "left foot position",  "left foot orientation",
                                          "body orientation",    "COM position"};
    const Error::Index part = row / 3;
    const bool is_angle = part == 1 || part == 3 || part == 4;
    const std::string text =
        fmt::format("{} misses by {:.4g} {}", kParts[static_cast<size_t>(part)],
                    error_.segment<3>(3 * part).norm(), is_angle ? "rad" : "m");
    std::string at_limit;
    for (int j = 0; j < model_.num_joints(); ++j) {
      const double q = state_.joint_position[j];
      if (q <= joint(j).lower + kAtLimit || q >= joint(j).upper - kAtLimit) {
        at_limit += (at_limit.empty() ? "" : ", ") + joint(j).name;
      }
    }
    return at_limit.empty() ? text : text + " with joints at their limits: " + at_limit;
  }

 private:
  const Joint& joint(int j) const { return model_.joints()[static_cast<size_t>(j)]; }

  void Evaluate() {
    ComputeKinematics(model_, state_, &data_);
    ComputeFeet(model_, &data_);
    ComputeDynamics(model_, state_, &data_);
    for (const Foot f : kFeet) {
      const Eigen::Index row = 6 * static_cast<Eigen::Index>(f);
      error_.segment<3>(row) = data_.foot_pose[f].translation() - goal_.foot[f].translation();
      error_.segment<3>(row + 3) =
          RotationError(data_.foot_pose[f].linear(), goal_.foot[f].linear());
      jacobian_.middleRows<6>(row) = data_.foot_jacobian[f];
    }
    const int body = model_.body_task_body();
    ComputePointJacobian(model_, data_, body, Vector3d::Zero(), point_jacobian_);
    error_.segment<3>(12) =
        RotationError(data_.body_rotation[static_cast<size_t>(body)], Matrix3d::Identity());
    jacobian_.middleRows<3>(12) = point_jacobian_.bottomRows<3>();
    error_.segment<3>(15) =
        data_.com - Vector3d(goal_.com_xy.x(), goal_.com_xy.y(), goal_.com_height);
    jacobian_.middleRows<3>(15) = data_.com_jacobian;
  }

  void Move(const VectorXd& step) {
    const double largest = step.tail(model_.num_joints()).lpNorm<Eigen::Infinity>();
    const double scale = largest > kMaxStep ? kMaxStep / largest : 1;
    state_.base_position += scale * step.head<3>();
    const Vector3d turn = scale * step.segment<3>(3);
    if (const double angle = turn.norm(); angle > 0) {
      state_.base_orientation =
          (Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle)) * state_.base_orientation)
              .normalized();
    }
    for (int j = 0; j < model_.num_joints(); ++j) {
      state_.joint_position[j] = std::clamp(state_.joint_position[j] + scale * step[6 + j],
                                            joint(j).lower, joint(j).upper);
    }
    Evaluate();
  }

  // Smallest damped step, with joints that would leave their range held.
  VectorXd Step(double damping) const {
    MatrixXd free = jacobian_;
    for (;;) {
      const Eigen::Matrix<double, kRows, kRows> normal =
          free * free.transpose() + damping * Eigen::Matrix<double, kRows, kRows>::Identity();
      const VectorXd step = -free.transpose() * normal.ldlt().solve(error_);
      bool held = false;
      for (int j = 0; j < model_.num_joints(); ++j) {
        const double q = state_.joint_position[j];
        if ((step[6 + j] < 0 && q <= joint(j).lower + kAtLimit) ||
            (step[6 + j] > 0 && q >= joint(j).upper - kAtLimit)) {
          free.col(6 + j).setZero();
          held = true;
        }
      }
      if (!held) return step;
    }
  }

  // Levenberg–Marquardt on the goal alone.
  bool ReachGoal() {
    double damping = 1e-3;
    for (int i = 0; i < kMaxIterations && worst() > kConverged && damping < kMaxDamping; ++i) {
      const RobotState before = state_;
      const double cost = error_.squaredNorm();
      Move(Step(damping));
      if (error_.squaredNorm() < cost) {
        damping = std::max(kMinDamping, 0.1 * damping);
      } else {
        state_ = before;
        Evaluate();
        if (worst() < kTolerance && damping > 1) break;
        damping *= 10;
      }
    }
    return worst() <= kTolerance;
  }

  // Joints the goal leaves free move towards the nominal posture.
  void ApproachNominal() {
    double gain = 1;
    for (int i = 0; i < kMaxNullSteps && gain > 1e-3; ++i) {
      VectorXd wish = VectorXd::Zero(model_.num_velocities());
      wish.tail(model_.num_joints()) = nominal_ - state_.joint_position;
      MatrixXd normal = jacobian_ * jacobian_.transpose();
      normal.diagonal().array() += 1e-12 * normal.trace();
      const VectorXd step = wish - jacobian_.transpose() * normal.ldlt().solve(jacobian_ * wish);
      if (step.tail(model_.num_joints()).lpNorm<Eigen::Infinity>() < kStationary) return;
      const RobotState before = state_;
      Move(gain * step);
      if (!ReachGoal() ||
          (nominal_ - state_.joint_position).norm() >= (nominal_ - before.joint_position).norm()) {
        state_ = before;
        Evaluate();
        gain *= 0.5;
      }
    }
  }

  const RobotModel& model_;
  const PostureGoal& goal_;
  RobotData data_;
  MatrixXd jacobian_;
  Matrix6X point_jacobian_;
  VectorXd nominal_;
  RobotState state_;
  Error error_;
};

}  // namespace

RobotState SolvePosture(const RobotModel& model, const PostureGoal& goal) {
  if (goal.nominal.size() != model.num_joints()) {
    throw RobotError(fmt::format("posture: nominal has {} joints, the robot {}: give one each",
                                 goal.nominal.size(), model.num_joints()));
  }
  if (!goal.nominal.allFinite() || !goal.com_xy.allFinite() || !std::isfinite(goal.com_height) ||
      !goal.foot[0].matrix().allFinite() || !goal.foot[1].matrix().allFinite()) {
    throw RobotError("posture: a number of the goal is not finite: correct it");
  }
  PostureSolver solver(model, goal);
  double best = std::numeric_limits<double>::infinity();
  std::string shortfall;
  for (const double blend : {0.0, 0.1, 0.3}) {
    if (solver.Solve(blend)) return solver.state();
    if (solver.worst() < best) {
      best = solver.worst();
      shortfall = solver.Shortfall();
    }
  }
  throw RobotError("posture cannot be reached: " + shortfall +
                   ": move the COM or the feet, or start from another nominal posture");
}

double StandingHeight(const RobotModel& model) {
  if (model.stance().com_height) return *model.stance().com_height;
  const RobotData data = Evaluate(model, model.stance().joint_position);
  return data.com.z() - data.foot_pose[Foot::kRight].translation().z();
}

double StandingSpacing(const RobotModel& model) {
  if (model.stance().foot_spacing) return *model.stance().foot_spacing;
  RobotData data(model);
  ComputeKinematics(model, RobotState(model.num_joints()), &data);
  ComputeFeet(model, &data);
  return std::abs(data.foot_pose[Foot::kLeft].translation().y() -
                  data.foot_pose[Foot::kRight].translation().y());
}

PostureGoal StandingGoal(const RobotModel& model) {
  PostureGoal goal;
  const double side = 0.5 * StandingSpacing(model);
  goal.foot[Foot::kRight] = Eigen::Isometry3d(Eigen::Translation3d(0, -side, 0));
  goal.foot[Foot::kLeft] = Eigen::Isometry3d(Eigen::Translation3d(0, side, 0));
  goal.com_height = StandingHeight(model);
  goal.nominal = model.stance().joint_position;
  return goal;
}

int Knee(const RobotModel& model, const RobotData& data, Foot foot) {
  const auto joints = model.supporting_joints(model.feet()[foot].body);
  // A joint's frame is that of the body that it carries.
  const auto at = [&](int joint) { return data.body_position[static_cast<size_t>(joint) + 1]; };
  int knee = -1;
  double most = -1;
  for (const int joint : joints) {
    const double least =
        std::min((at(joint) - at(joints.front())).norm(), (at(joint) - at(joints.back())).norm());
    if (least <= most) continue;
    most = least;
    knee = joint;
  }
  return knee;
}

}  // namespace poise::robot
