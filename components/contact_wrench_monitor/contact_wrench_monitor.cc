#include "components/contact_wrench_monitor/contact_wrench_monitor.h"

#include <algorithm>
#include <cmath>

#include "components/contact_wrench_monitor/contact_wrench_monitor.pb.h"
#include "components/messages/archive_message.h"
#include "components/messages/conversions.h"
#include "components/messages/robot_resource.h"

namespace poise {
namespace {

// The bound is reached to rounding: the centre of pressure is metres, its error some 1e-12.
constexpr double kCopTolerance = 1e-6;

bool Inside(const Eigen::Vector2d& cop, const balance::ContactLimits& limits) {
  return std::abs(cop.x()) <= limits.half_length + kCopTolerance &&
         std::abs(cop.y()) <= limits.half_width + kCopTolerance;
}

}  // namespace

void ContactWrenchMonitor::Configure(const ComponentContext& context, Wiring* wiring) {
  const auto config = context.config<ContactWrenchMonitorConfig>();
  balancing_ = config.balancing();
  ContactLimitsConfig double_support = config.double_support();
  if (config.has_half_width_beyond_soles()) {
    beyond_soles_ = config.half_width_beyond_soles();
    if (!(*beyond_soles_ >= 0) || !std::isfinite(*beyond_soles_)) {
      throw ConfigError("half_width_beyond_soles", "must be a number of m, 0 or more");
    }
    // Replaced in every tick.
    if (!double_support.has_half_width()) double_support.set_half_width(1);
  }
  double_support_ = ReadLimits(double_support, "double_support");
  single_support_ = ReadLimits(config.single_support(), "single_support");
  model_ = LoadRobot(context);
  whole_body_ = context.shared->Get<balance::WholeBody>(
      "estimated", [&] { return std::make_shared<balance::WholeBody>(model_); });
  const int num_joints = model_->num_joints();
  com_height_.emplace(num_joints, 1);
  balance_control_.emplace(num_joints, 1);
  state_ = robot::RobotState(num_joints);
  height_jacobian_ = Eigen::MatrixXd::Zero(1, model_->num_velocities());
  height_bias_ = Eigen::VectorXd::Zero(1);
  torque_ = Eigen::VectorXd::Zero(num_joints);
  foot_wrench_ = Eigen::VectorXd::Zero(12);

  const MessageCounts counts = JointAndFootCounts(*model_);
  wiring->AddInput(&robot_state_, "robot_state", counts);
  wiring->AddInput(&task_torque_, "task_torque", counts);
  wiring->AddOutput(&balance_torque_, "balance_torque", counts);
  wiring->AddStage("prepare", {&robot_state_}, {}, [this](const Tick&) { Prepare(); });
  wiring->AddStage("balance", {&robot_state_, &task_torque_}, {&balance_torque_},
                   [this](const Tick&) { Balance(); });
  SetPose(Eigen::Isometry3d::Identity(), &balance_torque_->frame_o);
}

bool ContactWrenchMonitor::Archive(StateArchive* archive) {
  archive->Show(in_contact_);
  ArchiveMessage(&*balance_torque_, archive);
  return true;
}

void ContactWrenchMonitor::Prepare() {
  state_valid_ = ReadState(*robot_state_, &state_);
  // Contacts seldom change: with last tick's, the work is done before the task torque arrives.
  if (state_valid_) whole_body_->Update(state_, in_contact_);
}

void ContactWrenchMonitor::Balance() {
  const task_torque_t& task = *task_torque_;
  balance_torque_t& out = *balance_torque_;
  const std::array<bool, 2> in_contact{task.in_contact[0] != 0, task.in_contact[1] != 0};
  std::copy(task.torque.begin(), task.torque.end(), torque_.data());
  if (task.status == task_torque_t::STATUS_SINGULAR) {
    out.status = balance_torque_t::STATUS_SINGULAR;
  } else if (task.status == task_torque_t::STATUS_INVALID_STATE || !state_valid_ ||
             !torque_.allFinite() || !(in_contact[0] || in_contact[1])) {
    out.status = balance_torque_t::STATUS_INVALID_STATE;
  } else {
    in_contact_ = in_contact;
    out.status = ComputeBalance(in_contact);
  }
  if (out.status == balance_torque_t::STATUS_OK ||
      out.status == balance_torque_t::STATUS_NOT_ACHIEVED) {
    return;
  }
  out.torque = task.torque;
  std::fill(out.balance_torque.begin(), out.balance_torque.end(), 0.0);
  out.active_x = out.active_y = 0;
}

int8_t ContactWrenchMonitor::ComputeDynamics(const std::array<bool, 2>& in_contact) {
  if (!whole_body_->Update(state_, in_contact)) return balance_torque_t::STATUS_SINGULAR;
  const robot::RobotData& data = whole_body_->data();
  height_jacobian_ = data.com_jacobian.row(2);
  height_bias_[0] = data.com_bias_acceleration.z();
  return com_height_->Compute(whole_body_->contact(), height_jacobian_, height_bias_)
             ? balance_torque_t::STATUS_OK
             : balance_torque_t::STATUS_SINGULAR;
}

int8_t ContactWrenchMonitor::ComputeBalance(const std::array<bool, 2>& in_contact) {
  if (const int8_t status = ComputeDynamics(in_contact); status != balance_torque_t::STATUS_OK) {
    return status;
  }
  const balance::ContactLimits limits = Limits(in_contact);
  balance::BalanceResult result;
  const balance::BalanceStatus status =
      balance_control_->Compute(whole_body_->contact(), *com_height_, whole_body_->geometry(),
                                limits, balancing_, torque_, &result);
  if (status == balance::BalanceStatus::kSingular || !torque_.allFinite()) {
    return balance_torque_t::STATUS_SINGULAR;
  }
  Report(result, limits, in_contact);
  const bool achieved = status == balance::BalanceStatus::kOk && Inside(result.cop, limits);
  return achieved || !balancing_ ? balance_torque_t::STATUS_OK
                                 : balance_torque_t::STATUS_NOT_ACHIEVED;
}

balance::ContactLimits ContactWrenchMonitor::Limits(const std::array<bool, 2>& in_contact) const {
  if (!(in_contact[0] && in_contact[1])) return single_support_;
  balance::ContactLimits limits = double_support_;
  if (beyond_soles_) {
    const auto& sole = whole_body_->geometry().sole;
    limits.half_width =
        0.5 * (sole[0].translation() - sole[1].translation()).norm() + *beyond_soles_;
  }
  return limits;
}

void ContactWrenchMonitor::Report(const balance::BalanceResult& result,
                                  const balance::ContactLimits& limits,
                                  const std::array<bool, 2>& in_contact) {
  balance_torque_t& out = *balance_torque_;
  for (size_t i = 0; i < out.torque.size(); ++i) {
    out.torque[i] = torque_[static_cast<Eigen::Index>(i)];
    out.balance_torque[i] = out.torque[i] - task_torque_->torque[i];
  }
  const balance::ContactDynamics& contact = whole_body_->contact();
  auto wrench = foot_wrench_.head(contact.num_contact_rows());
  contact.ExpectedWrench(torque_, wrench);
  Eigen::Index row = 0;
  for (size_t i = 0; i < 2; ++i) {
    out.in_contact[i] = in_contact[i] ? 1 : 0;
    if (in_contact[i]) {
      SetWrench(wrench.segment<6>(row), &out.foot_wrench[i]);
      row += 6;
    } else {
      SetWrench(balance::Vector6d::Zero(), &out.foot_wrench[i]);
    }
  }
  out.active_x = balancing_ && result.active_x ? 1 : 0;
  out.active_y = balancing_ && result.active_y ? 1 : 0;
  SetPose(result.frame_o, &out.frame_o);
  out.cop_limit[0] = limits.half_length;
  out.cop_limit[1] = limits.half_width;
  for (int i = 0; i < 2; ++i) {
    out.cop_task[i] = result.cop_task[i];
    out.cop[i] = result.cop[i];
  }
  SetWrench(result.resultant_task, &out.resultant_task);
  SetWrench(result.resultant, &out.resultant);
  SetMargins(balance::CheckContact(result.resultant, limits), &out.resultant_margins);
}

}  // namespace poise
