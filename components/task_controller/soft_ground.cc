#include "components/task_controller/soft_ground.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "components/balance/gains/gain_rule.h"
#include "components/robot/dynamics.h"

namespace poise {
namespace {

using robot::Foot;
using robot::kFeet;

// The COM's frequency is this share of the foot's own. Chosen, as the next, on blocks that three
// robots fell from; others judge it (docs/reference/gains.md).
constexpr double kShare = 0.5;
// Times ω = √(g/h): with less the COM does not come back from where it falls.
constexpr double kLeast = 1.4;
constexpr double kLoadShare = 0.05;  // of the weight, that makes a foot sink measurably
constexpr double kFilterTime = 0.2;  // s, of the compliance: no step of the gains

}  // namespace

SoftGround::SoftGround(const robot::RobotModel& model, double period)
    : inertia_{LegInertia(model, Foot::kRight), LegInertia(model, Foot::kLeft)},
      share_(period / (kFilterTime + period)),
      least_load_(kLoadShare * model.total_mass() * robot::kGravity),
      least_frequency_(kLeast * balance::PendulumFrequency(model)) {}

double SoftGround::LegInertia(const robot::RobotModel& model, Foot foot) {
  const robot::RobotData data = robot::Evaluate(model, model.stance().joint_position);
  const auto joints = model.supporting_joints(model.feet()[foot].body);
  const auto count = static_cast<Eigen::Index>(joints.size());
  Eigen::MatrixXd mass(count, count), jacobian(6, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const int a = 6 + joints[static_cast<size_t>(i)];
    jacobian.col(i) = data.foot_jacobian[foot].col(a);
    for (Eigen::Index j = 0; j < count; ++j) {
      mass(i, j) = data.mass_matrix(a, 6 + joints[static_cast<size_t>(j)]);
    }
  }
  const Eigen::Matrix<double, 6, 6> mobility = jacobian * mass.llt().solve(jacobian.transpose());
  return mobility.llt().solve(Eigen::Matrix<double, 6, 1>::Unit(2))[2];
}

void SoftGround::Update(const robot::FootArray<FootState>& feet) {
  for (const Foot f : kFeet) {
    Trace& trace = trace_[f];
    const FootState& foot = feet[f];
    if (!foot.put_down) {
      trace = {.stands = false};
      continue;
    }
    if (!trace.stands) trace = {true, true, foot.height, foot.load, 0};
    const double more = foot.load - trace.load;
    if (!trace.known || !(more > least_load_)) continue;
    const double compliance = std::max(trace.height - foot.height, 0.0) / more;
    trace.compliance += share_ * (compliance - trace.compliance);
  }
}

balance::TaskGains SoftGround::Limited(balance::TaskGains gains) const {
  double most = HUGE_VAL;  // rad/s
  for (const Foot f : kFeet) {
    if (trace_[f].compliance > 0) {
      most = std::min(most, kShare / std::sqrt(trace_[f].compliance * inertia_[f]));
    }
  }
  most = std::max(most, least_frequency_);
  const double frequency = std::sqrt(gains.kp);
  if (!(most < frequency)) return gains;
  return {most * most, gains.kd * most / frequency};
}

void SoftGround::Archive(StateArchive* archive) {
  for (Trace& trace : trace_) {
    archive->Show(trace.known, trace.stands, trace.height, trace.load, trace.compliance);
  }
}

}  // namespace poise
