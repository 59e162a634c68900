#include "tests/balance/balance_test_support.h"

#include "components/robot_files/robot_files.h"
#include "tests/test_seed.h"

namespace poise::balance {

std::shared_ptr<const robot::RobotModel> Biped() {
  static const auto model = std::make_shared<const robot::RobotModel>(
      robot::LoadRobotFiles(POISE_SOURCE_DIR "/deploy/robots/dyros/dyros_legs.pbtxt"));
  return model;
}

std::shared_ptr<const robot::RobotModel> Humanoid() {
  static const auto model = std::make_shared<const robot::RobotModel>(
      robot::LoadRobotFiles(POISE_SOURCE_DIR "/tests/robot/data/mantis.pbtxt"));
  return model;
}

StateSampler::StateSampler(std::shared_ptr<const robot::RobotModel> model, unsigned seed)
    : model_(std::move(model)), random_(TestSeed(seed)) {}

double StateSampler::Uniform(double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random_);
}

Eigen::VectorXd StateSampler::Vector(Eigen::Index size, double magnitude) {
  Eigen::VectorXd v(size);
  for (double& x : v) x = Uniform(-magnitude, magnitude);
  return v;
}

robot::RobotState StateSampler::Draw() {
  const int k = model_->num_joints();
  robot::RobotData data(*model_);
  while (true) {
    robot::RobotState state(k);
    state.base_position = Vector(3, 5.0);
    state.base_orientation =
        Eigen::Quaterniond(Eigen::AngleAxisd(Uniform(-3, 3), Eigen::Vector3d::UnitZ()) *
                           Eigen::AngleAxisd(Uniform(-0.4, 0.4), Eigen::Vector3d::UnitY()) *
                           Eigen::AngleAxisd(Uniform(-0.4, 0.4), Eigen::Vector3d::UnitX()));
    state.base_orientation.normalize();
    state.base_linear_velocity = Vector(3, 1.0);
    state.base_angular_velocity = Vector(3, 1.0);
    for (int i = 0; i < k; ++i) {
      const robot::Joint& joint = model_->joints()[i];
      state.joint_position(i) = Uniform(std::max(joint.lower, -1.5), std::min(joint.upper, 1.5));
    }
    state.joint_velocity = Vector(k, 1.0);
    robot::ComputeKinematics(*model_, state, &data);
    robot::ComputeFeet(*model_, &data);
    bool straight = false;
    for (const robot::Matrix6X& jacobian : data.foot_jacobian) {
      const Eigen::MatrixXd joints = jacobian.rightCols(k);
      const Eigen::JacobiSVD<Eigen::MatrixXd> svd(joints);
      straight |= svd.singularValues()(5) < 0.03;
    }
    if (!straight) return state;
  }
}

StackedTask PaperTask(const WholeBody& body, const std::array<bool, 2>& in_contact) {
  const robot::RobotData& data = body.data();
  const Eigen::Index n = body.model().num_velocities();
  const bool single = in_contact[0] != in_contact[1];
  StackedTask task{Eigen::MatrixXd(single ? 12 : 6, n), Eigen::VectorXd(single ? 12 : 6)};
  const int torso = body.model().body_task_body();
  robot::Matrix6X jacobian(6, n);
  robot::ComputePointJacobian(body.model(), data, torso, Eigen::Vector3d::Zero(), jacobian);
  task.jacobian.topRows(3) = data.com_jacobian;
  task.jacobian.middleRows(3, 3) = jacobian.bottomRows(3);
  task.bias_acceleration.head(3) = data.com_bias_acceleration;
  task.bias_acceleration.segment(3, 3) = data.body_angular_bias[torso];
  if (single) {
    const int swing = in_contact[0] ? 1 : 0;
    task.jacobian.bottomRows(6) = data.foot_jacobian[swing];
    task.bias_acceleration.tail(6) = data.foot_bias_acceleration[swing];
  }
  return task;
}

StackedTask ComHeight(const WholeBody& body) {
  return {body.data().com_jacobian.bottomRows(1), body.data().com_bias_acceleration.tail(1)};
}

PaperContact::PaperContact(const WholeBody& body, const std::array<bool, 2>& in_contact) {
  const robot::RobotData& data = body.data();
  k = body.model().num_joints();
  n = k + 6;
  a = data.mass_matrix.cast<Real>();
  b = data.bias.cast<Real>();
  g = data.gravity.cast<Real>();
  m = 6 * (in_contact[0] + in_contact[1]);
  jc.resize(m, n);
  gamma.resize(m);
  Eigen::Index row = 0;
  for (int i = 0; i < 2; ++i) {
    if (!in_contact[i]) continue;
    MatrixL to_sole = MatrixL::Zero(6, 6);
    to_sole.topLeftCorner(3, 3) = to_sole.bottomRightCorner(3, 3) =
        data.foot_pose[i].linear().transpose().cast<Real>();
    jc.middleRows(row, 6) = to_sole * data.foot_jacobian[i].cast<Real>();
    gamma.segment(row, 6) = to_sole * data.foot_bias_acceleration[i].cast<Real>();
    row += 6;
  }
  const MatrixL identity = MatrixL::Identity(n, n);
  s = identity.bottomRows(k);  // (19)
  a_inverse = a.llt().solve(identity);
  lambda_c = MatrixL(jc * a_inverse * jc.transpose()).inverse();  // (4)
  mu_c = lambda_c * (jc * a_inverse * b - gamma);                 // (5)
  p_c = lambda_c * jc * a_inverse * g;                            // (6)
  jc_bar_t = lambda_c * jc * a_inverse;                           // (7)
  nc_t = identity - jc.transpose() * jc_bar_t;                    // (11)
  w = s * a_inverse * nc_t * s.transpose();                       // (22)
  w = ((w + w.transpose()) / 2).eval();
  const Eigen::SelfAdjointEigenSolver<MatrixL> eigen(w);  // (47)–(49), smallest first
  const Eigen::Index zeros = m - 6;
  null_basis = eigen.eigenvectors().leftCols(zeros);
  const MatrixL v1 = eigen.eigenvectors().rightCols(k - zeros);
  w_pinv = v1 * eigen.eigenvalues().tail(k - zeros).cwiseInverse().asDiagonal() * v1.transpose();
}

void PaperContact::Solve(const VectorL& torque, VectorL* acceleration, VectorL* wrench) const {
  MatrixL kkt = MatrixL::Zero(n + m, n + m);
  kkt << a, jc.transpose(), jc, MatrixL::Zero(m, m);
  VectorL right(n + m);
  right << s.transpose() * torque - b - g, -gamma;
  const VectorL solution = kkt.partialPivLu().solve(right);
  *acceleration = solution.head(n);
  *wrench = solution.tail(m);
}

PaperTaskSpace::PaperTaskSpace(const PaperContact& c, const StackedTask& task)
    : j(task.jacobian.cast<Real>()), bias_acceleration(task.bias_acceleration.cast<Real>()) {
  lambda = MatrixL(j * c.a_inverse * c.nc_t * j.transpose()).inverse();  // (14)
  j_bar_t = lambda * j * c.a_inverse * c.nc_t;                           // (15)
  mu = j_bar_t * c.b - lambda * bias_acceleration +
       lambda * j * c.a_inverse * c.jc.transpose() * c.lambda_c * c.gamma;                 // (16)
  p = j_bar_t * c.g;                                                                       // (17)
  q = j_bar_t * c.s.transpose();                                                           // (27)
  j_tilde_t = c.w_pinv * q.transpose() * MatrixL(q * c.w_pinv * q.transpose()).inverse();  // (23)
  n_tilde_t = MatrixL::Identity(c.k, c.k) - j_tilde_t * q;                                 // (26)
}

double MaxResidual(const MatrixL& x, const MatrixL& y) {
  if (x.size() == 0) return 0;
  const Real difference = (x - y).cwiseAbs().maxCoeff();
  const Real result = difference / (1 + y.cwiseAbs().maxCoeff());
  return std::isfinite(static_cast<double>(result)) ? static_cast<double>(result) : HUGE_VAL;
}

}  // namespace poise::balance
