#include "components/balance/gains/closed_loop_poles.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "components/balance/task_hierarchy.h"
#include "components/balance/whole_body.h"
#include "components/robot/posture.h"

namespace poise::balance {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLeastLag = 0.02;    // of a tick: a loop without lag would need a direct path
constexpr double kLeastRotor = 1e-3;  // of a joint's own inertia, behind a gear that gives
constexpr double kStep = 1e-6;        // rad, m, of the difference quotients
constexpr double kForgotten = 1e-3;   // |z|, gone in a tick: delays and filters

/// e^A by scaling, Taylor's series and squaring.
MatrixXd Exponential(const MatrixXd& a) {
  const double norm = a.cwiseAbs().rowwise().sum().maxCoeff();
  const int squarings = norm > 0.25 ? static_cast<int>(std::ceil(std::log2(norm / 0.25))) : 0;
  const MatrixXd x = a / std::ldexp(1.0, squarings);
  MatrixXd sum = MatrixXd::Identity(a.rows(), a.cols()), term = sum;
  for (int i = 1; i <= 12; ++i) {
    term = (term * x / i).eval();
    sum += term;
  }
  for (int i = 0; i < squarings; ++i) sum = (sum * sum).eval();
  return sum;
}

robot::RobotState Moved(const robot::RobotState& at, const VectorXd& step) {
  robot::RobotState state = at;
  state.base_position += step.head<3>();
  const Eigen::Vector3d turn = step.segment<3>(3);
  if (turn.norm() > 0) {
    state.base_orientation = Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())) *
                             state.base_orientation;
  }
  state.joint_position += step.tail(step.size() - 6);
  return state;
}

robot::RobotState WithVelocity(const robot::RobotState& at, const VectorXd& velocity) {
  robot::RobotState state = at;
  state.base_linear_velocity = velocity.head<3>();
  state.base_angular_velocity = velocity.segment<3>(3);
  state.joint_velocity = velocity.tail(velocity.size() - 6);
  return state;
}

/// The task controller's torque without a list of tasks: COM, body and free foot by the legs, all
/// other joints by their posture.
class StandingLaw {
 public:
  StandingLaw(const std::shared_ptr<const robot::RobotModel>& model, const StandingGains& gains,
              const FootArray<bool>& in_contact, const robot::RobotState& stance)
      : model_(model),
        body_(model),
        in_contact_(in_contact),
        posture_(gains.posture),
        stance_(stance),
        hierarchy_(model->num_joints(), 18, 1) {
    const auto add = [&](const char* type, std::optional<Foot> foot, const TaskGains& with) {
      TaskSpec spec;
      spec.type = type;
      spec.foot = foot;
      tasks_.push_back(CreateTask(spec, *model));
      tasks_.back()->set_gains(with);
    };
    add("com", {}, gains.com);
    add("orientation", {}, gains.orientation);
    for (const Foot foot : kFeet) {
      if (!in_contact[foot]) add("frame", foot, gains.foot);
    }
    body_.UpdateDynamics(stance);
    targets_.resize(tasks_.size());
    const TaskState state{*model_, stance, body_.data()};
    for (size_t i = 0; i < tasks_.size(); ++i) tasks_[i]->Hold(state, &targets_[i]);
  }

  VectorXd Torque(const robot::RobotState& estimate) {
    if (!body_.Update(estimate, in_contact_)) {
      throw robot::RobotError("stance: its contacts are singular: bend the knees");
    }
    const TaskState state{*model_, estimate, body_.data()};
    Index rows = 0;
    for (const auto& task : tasks_) rows += task->num_rows();
    MatrixXd jacobian = MatrixXd::Zero(rows, model_->num_velocities());
    VectorXd bias = VectorXd::Zero(rows), wanted = VectorXd::Zero(rows);
    Index row = 0;
    for (size_t i = 0; i < tasks_.size(); ++i) {
      const Index t = tasks_[i]->num_rows();
      TaskRows out{jacobian.middleRows(row, t), bias.segment(row, t), wanted.segment(row, t)};
      tasks_[i]->Write(state, targets_[i], &out);
      row += t;
    }
    const VectorXd posture = posture_.kp * (stance_.joint_position - estimate.joint_position) -
                             posture_.kd * estimate.joint_velocity;
    const int level[] = {static_cast<int>(rows)};
    const bool others = body_.contact().reduced().num_others() > 0;
    if (!hierarchy_.Compute(body_.contact(), jacobian, bias, wanted, level,
                            others ? &posture : nullptr)) {
      throw robot::RobotError("stance: its tasks cannot be met together: bend the knees");
    }
    VectorXd torque = hierarchy_.torque();
    if (hierarchy_.num_free() > 0) {
      const Index k = torque.size();
      VectorXd free(k);
      GravityCompensation(body_.contact(), free);
      free += body_.data().mass_matrix.bottomRightCorner(k, k) * posture;
      hierarchy_.ProjectIntoNullSpace(free);
      torque += free;
    }
    return torque;
  }
  WholeBody& body() { return body_; }

 private:
  std::shared_ptr<const robot::RobotModel> model_;
  WholeBody body_;
  FootArray<bool> in_contact_;
  TaskGains posture_;
  robot::RobotState stance_;
  std::vector<std::unique_ptr<Task>> tasks_;
  std::vector<TaskTarget> targets_;
  TaskHierarchy hierarchy_;
};

/// ẋ = A x + B u; what the sensors read of x: [encoders; base pose; its velocity; its
/// acceleration].
struct Plant {
  MatrixXd a, b, sensors;
  VectorXd wrench;
};

/// Standing on contacts that hold: links move by N z, rotors by θ, u is the torque that is asked
/// for.
Plant MakePlant(const std::shared_ptr<const robot::RobotModel>& model,
                const robot::RobotState& stance, const FootArray<bool>& in_contact,
                StandingLaw* law, double period, const LoopChange& change) {
  const Index k = model->num_joints(), n = k + 6;
  const VectorXd torque = law->Torque(stance);
  WholeBody& body = law->body();
  const Index m = body.contact().num_contact_rows();
  VectorXd wrench(m);
  body.contact().ExpectedWrench(torque, wrench);
  const MatrixXd contact = body.contact().contact_jacobian();
  const MatrixXd null =
      Eigen::FullPivHouseholderQR<MatrixXd>(contact.transpose()).matrixQ();  // n×n
  const MatrixXd motions = null.rightCols(n - m);                            // N
  const MatrixXd joints = motions.bottomRows(k);                             // S N

  // The stiffness of gravity and of the contacts' forces on it.
  MatrixXd force(n, n - m);
  MatrixXd moved;
  for (Index i = 0; i < n - m; ++i) {
    VectorXd side[2];
    for (const int s : {0, 1}) {
      body.UpdateDynamics(Moved(stance, (s == 0 ? kStep : -kStep) * motions.col(i)));
      body.ContactJacobian(in_contact, &moved);
      side[s] = body.data().gravity + moved.transpose() * wrench;
    }
    force.col(i) = (side[0] - side[1]) / (2 * kStep);
  }
  const MatrixXd stiffness = motions.transpose() * force;

  body.UpdateDynamics(stance);
  MatrixXd mass = body.data().mass_matrix;
  VectorXd rotor(k), friction(k);
  for (Index j = 0; j < k; ++j) {
    const robot::MotorModel& motor = model->motors()[static_cast<size_t>(j)];
    mass(6 + j, 6 + j) -= motor.reflected_inertia;
    rotor[j] = change.rotor_inertia * motor.reflected_inertia;
    friction[j] = motor.viscous_friction;
  }
  const robot::DriveTrainModel& drive = model->drive_train();
  const double gear = change.gear_stiffness * drive.gear_stiffness;
  const bool gives = gear > 0;
  const double lag = std::max(drive.torque_lag, kLeastLag * period);

  // Positions: z, and θ where gears give; then their velocities, then the motors' torques.
  const Index z = n - m, p = gives ? z + k : z, x = 2 * p + k;
  MatrixXd inertia = MatrixXd::Zero(p, p), damp = inertia, stiff = inertia;
  MatrixXd input = MatrixXd::Zero(p, k);
  stiff.topLeftCorner(z, z) = stiffness;
  if (gives) {
    inertia.topLeftCorner(z, z) = motions.transpose() * mass * motions;
    const MatrixXd own = MatrixXd::Identity(k, k);
    for (Index j = 0; j < k; ++j) {
      inertia(z + j, z + j) = std::max(rotor[j], kLeastRotor * mass(6 + j, 6 + j));
    }
    MatrixXd wind(k, p);  // θ − S N z
    wind << -joints, own;
    stiff += gear * wind.transpose() * wind;
    damp += drive.gear_damping * wind.transpose() * wind;
    damp.bottomRightCorner(k, k) += friction.asDiagonal();
    input.bottomRows(k) = own;
  } else {
    MatrixXd whole = mass;
    whole.bottomRightCorner(k, k) += rotor.asDiagonal();
    inertia = motions.transpose() * whole * motions;
    damp = joints.transpose() * friction.asDiagonal() * joints;
    input = joints.transpose();
  }
  const Eigen::LDLT<MatrixXd> solve(inertia);
  Plant plant;
  plant.a.setZero(x, x);
  plant.a.block(0, p, p, p).setIdentity();
  plant.a.block(p, 0, p, p) = -solve.solve(stiff);
  plant.a.block(p, p, p, p) = -solve.solve(damp);
  plant.a.block(p, 2 * p, p, k) = solve.solve(input);
  plant.a.block(2 * p, 2 * p, k, k) = -MatrixXd::Identity(k, k) / lag;
  plant.b.setZero(x, k);
  plant.b.bottomRows(k).setIdentity();
  plant.b /= lag;
  plant.sensors.setZero(k + 18, x);
  if (gives && !drive.link_encoder) {
    plant.sensors.block(0, z, k, k).setIdentity();
  } else {
    plant.sensors.block(0, 0, k, z) = joints;
  }
  const MatrixXd base = motions.topRows(6);
  plant.sensors.block(k, 0, 6, z) = base;
  plant.sensors.block(k + 6, p, 6, z) = base;
  plant.sensors.block(k + 12, 0, 6, x) = base * plant.a.middleRows(p, z);
  plant.wrench = wrench;
  return plant;
}

/// The law's derivatives by the estimated positions and velocities, k×n each.
void Linearise(const robot::RobotState& stance, StandingLaw* law, MatrixXd* by_position,
               MatrixXd* by_velocity) {
  const Index k = stance.joint_position.size(), n = k + 6;
  by_position->resize(k, n);
  by_velocity->resize(k, n);
  for (Index i = 0; i < n; ++i) {
    const VectorXd step = kStep * VectorXd::Unit(n, i);
    by_position->col(i) =
        (law->Torque(Moved(stance, step)) - law->Torque(Moved(stance, -step))) / (2 * kStep);
    by_velocity->col(i) =
        (law->Torque(WithVelocity(stance, step)) - law->Torque(WithVelocity(stance, -step))) /
        (2 * kStep);
  }
}

/// One tick of everything.
class TickMap {
 public:
  TickMap(const Plant& plant, MatrixXd by_position, MatrixXd by_velocity, double cutoff,
          double base_cutoff, double delay, double predicted, double period)
      : by_position_(std::move(by_position)),
        by_velocity_(std::move(by_velocity)),
        predicted_(predicted),
        period_(period),
        omega_(2 * std::numbers::pi * cutoff),
        base_share_(BaseVelocityShare(base_cutoff, period)),
        sensors_(plant.sensors),
        x_(plant.a.rows()),
        k_(plant.b.cols()),
        y_(plant.sensors.rows()) {
    const auto over = [&](double time) {
      MatrixXd whole = MatrixXd::Zero(x_ + k_, x_ + k_);
      whole.topRows(x_) << plant.a, plant.b;
      return MatrixXd(Exponential(whole * time).topRows(x_));
    };
    step_ = over(period);
    // Readings are taken `rest` before a tick's end, `queue` of them are under way.
    const double ticks = delay / period;
    const double whole = std::floor(ticks + 1e-9);
    const double rest = std::max(0.0, ticks - whole) * period;
    queue_ = static_cast<Index>(whole) + (rest > 1e-9 * period ? 1 : 0);
    if (queue_ > 0) sample_ = plant.sensors * over(period - (rest > 1e-9 * period ? rest : 0));
  }

  Index size() const { return x_ + queue_ * y_ + 3 * k_ + 6; }

  VectorXd Apply(const VectorXd& state) const {
    VectorXd next = VectorXd::Zero(size());
    const VectorXd x = state.head(x_);
    const VectorXd y =
        queue_ > 0 ? VectorXd(state.segment(x_ + (queue_ - 1) * y_, y_)) : VectorXd(sensors_ * x);
    const Index own = x_ + queue_ * y_;
    const VectorXd last = state.segment(own, k_), value = state.segment(own + k_, k_),
                   rate = state.segment(own + 2 * k_, k_);
    // LowPass::Step
    const VectorXd read = (y.head(k_) - last) / period_;
    const double h = period_ / 2, damping = h * std::numbers::sqrt2 * omega_,
                 stiffness = h * h * omega_ * omega_;
    const VectorXd next_rate =
        ((1 - damping - stiffness) * rate + 2 * h * omega_ * omega_ * (read - value)) /
        (1 + damping + stiffness);
    const VectorXd next_value = value + h * (rate + next_rate);
    // InvariantEstimator::Publish
    const double d = predicted_;
    VectorXd position(k_ + 6), velocity(k_ + 6);
    const auto pose = y.segment(k_, 6), speed = y.segment(k_ + 6, 6),
               acceleration = y.segment(k_ + 12, 6);
    position.head(3) = pose.head(3) + d * speed.head(3) + 0.5 * d * d * acceleration.head(3);
    position.segment(3, 3) = pose.tail(3) + d * speed.tail(3);
    position.tail(k_) = y.head(k_) + d * next_value;
    velocity.head(3) = speed.head(3) + d * acceleration.head(3);
    velocity.segment(3, 3) = speed.tail(3);
    velocity.tail(k_) = next_value;
    const VectorXd base = state.tail(6) + base_share_ * (velocity.head(6) - state.tail(6));
    velocity.head(6) = next.tail(6) = base;
    const VectorXd u = by_position_ * position + by_velocity_ * velocity;
    VectorXd driven(x_ + k_);
    driven << x, u;
    next.head(x_) = step_ * driven;
    if (queue_ > 0) {
      next.segment(x_, y_) = sample_ * driven;
      next.segment(x_ + y_, (queue_ - 1) * y_) = state.segment(x_, (queue_ - 1) * y_);
    }
    next.segment(own, k_) = y.head(k_);
    next.segment(own + k_, k_) = next_value;
    next.segment(own + 2 * k_, k_) = next_rate;
    return next;
  }

  MatrixXd Matrix() const {
    MatrixXd result(size(), size());
    for (Index i = 0; i < size(); ++i) result.col(i) = Apply(VectorXd::Unit(size(), i));
    return result;
  }

 private:
  MatrixXd by_position_, by_velocity_;
  double predicted_, period_, omega_, base_share_;
  MatrixXd sensors_, step_, sample_;
  Index x_, k_, y_, queue_ = 0;
};

/// A robot at its stance, ready for poles with changes to its loop.
class Loop {
 public:
  Loop(const robot::RobotModel& model, const StandingGains& gains,
       const FootArray<bool>& in_contact, double period)
      : model_(std::make_shared<robot::RobotModel>(model)),
        in_contact_(in_contact),
        gains_(gains),
        period_(period),
        stance_(StandingState(model, in_contact)),
        law_(model_, gains, in_contact, stance_) {
    Linearise(stance_, &law_, &by_position_, &by_velocity_);
  }

  Eigen::VectorXcd Poles(const LoopChange& change) {
    const Plant plant = MakePlant(model_, stance_, in_contact_, &law_, period_, change);
    const double delay = model_->drive_train().sensor_delay;
    const TickMap map(plant, change.feedback * by_position_, change.feedback * by_velocity_,
                      gains_.velocity_cutoff, gains_.base_velocity_cutoff,
                      delay + change.extra_delay, delay, period_);
    return Eigen::EigenSolver<MatrixXd>(map.Matrix(), false).eigenvalues();
  }

 private:
  std::shared_ptr<const robot::RobotModel> model_;
  FootArray<bool> in_contact_;
  StandingGains gains_;
  double period_;
  robot::RobotState stance_;
  StandingLaw law_;
  MatrixXd by_position_, by_velocity_;
};

}  // namespace

robot::RobotState StandingState(const robot::RobotModel& model, const FootArray<bool>& in_contact,
                                double lift) {
  robot::PostureGoal goal = robot::StandingGoal(model);
  const bool both = Count(in_contact) == 2;
  for (const Foot foot : kFeet) {
    if (!in_contact[foot]) goal.foot[foot].translation().z() = lift;
    if (!both && in_contact[foot]) goal.com_xy = goal.foot[foot].translation().head<2>();
  }
  return robot::SolvePosture(model, goal);
}

double BaseVelocityShare(double cutoff, double period) {
  return cutoff > 0 ? 1 - std::exp(-2 * std::numbers::pi * cutoff * period) : 1;
}

double ClosedLoopPoles::LeastDamping(double frequency) const {
  double least = 1;
  for (const Mode& mode : modes) {
    if (mode.frequency < frequency) least = std::min(least, mode.damping);
  }
  return least;
}

ClosedLoopPoles ComputeClosedLoopPoles(const robot::RobotModel& model, const StandingGains& gains,
                                       const FootArray<bool>& in_contact, double period,
                                       const LoopChange& change) {
  const Eigen::VectorXcd poles = Loop(model, gains, in_contact, period).Poles(change);
  ClosedLoopPoles result;
  for (const std::complex<double>& z : poles) {
    result.spectral_radius = std::max(result.spectral_radius, std::abs(z));
    if (z.imag() < 0 || std::abs(z) < kForgotten) continue;
    ClosedLoopPoles::Mode mode{.z = z, .s = std::log(z) / period};
    mode.frequency = std::abs(mode.s) / (2 * std::numbers::pi);
    mode.damping = std::abs(mode.s) > 0 ? -mode.s.real() / std::abs(mode.s) : 0;
    result.modes.push_back(mode);
  }
  std::ranges::sort(result.modes,
                    [](const auto& a, const auto& b) { return std::abs(a.z) > std::abs(b.z); });
  return result;
}

double GainMargin(const robot::RobotModel& model, const StandingGains& gains,
                  const FootArray<bool>& in_contact, double period, double most) {
  Loop loop(model, gains, in_contact, period);
  const auto stands = [&](double feedback) {
    return loop.Poles({.feedback = feedback}).cwiseAbs().maxCoeff() < 1;
  };
  if (!stands(1)) return 0;
  if (stands(most)) return most;
  double low = 1, high = most;
  while (high - low > 0.05 * low) {
    const double middle = std::sqrt(low * high);
    (stands(middle) ? low : high) = middle;
  }
  return low;
}

int DelayMargin(const robot::RobotModel& model, const StandingGains& gains,
                const FootArray<bool>& in_contact, double period, int most) {
  Loop loop(model, gains, in_contact, period);
  for (int ticks = 0; ticks <= most; ++ticks) {
    if (!(loop.Poles({.extra_delay = ticks * period}).cwiseAbs().maxCoeff() < 1)) return ticks - 1;
  }
  return most;
}

}  // namespace poise::balance
