#include "components/contact_wrench_monitor/contact_wrench_monitor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "components/balance/gains/gain_rule.h"
#include "components/balance/support_polygon.h"
#include "components/contact_wrench_monitor/contact_wrench_monitor.pb.h"
#include "components/messages/archive_message.h"
#include "components/messages/conversions.h"
#include "components/messages/robot_resource.h"
#include "components/robot/sole.h"

namespace poise {

std::string_view contact_wrench_monitor_proto_schema();  // generated
namespace {

using robot::Foot;
using robot::FootArray;
using robot::kFeet;

// Shares of the start's region that an operator may go to: a quarter still lets the robot stand; at
// one and a half it ends beyond the soles, and nothing is kept. Chosen.
constexpr double kLeastRegion = 0.25, kMostRegion = 1.5;
// s that a change takes, so that the torque makes no step.
constexpr double kRegionRamp = 0.5;

// The bound is reached to rounding: the centre of pressure is metres, its error some 1e-12.
constexpr double kCopTolerance = 1e-6;

// Room in the message.
constexpr int kMostCorners = std::extent_v<decltype(balance_torque_t::corner_x)>;
// Joints at their limits that balancing leaves alone, at most: of the legs' six motions some must
// remain.
constexpr int kMostKept = 3;
// A step holds the COM's height and the six of a foot in the air. The weight says how much more a
// change of them counts than another motion of the same energy: G1 stood a mean of 20.7 N·s with 3
// and 10, 19.2 with 100, 15.4 with 1000 (five directions, MuJoCo).
constexpr int kStepRows = 7;
constexpr double kHeldWeight = 10;
// The roll and pitch of a foot in the air count more: they cost next to no energy, so that a hip at
// its torque limit gave them up first, and G1's foot came down on its heel, tilted by 17 degrees
// and 25 mm above the ground. G1 stands as many pushes with 100.
constexpr double kLevelWeight = 1000;
// Share of the weight that a sole keeps in a step, at least: alone, and with the other one.
constexpr double kLeastAlone = 0.2, kLeastShared = 0.02;

bool Inside(const Eigen::Vector2d& cop, const balance::ConvexPolygon& region) {
  return balance::SignedDistance(region, cop) >= -kCopTolerance;
}

}  // namespace

void ContactWrenchMonitor::Configure(const ComponentContext& context, Wiring* wiring) {
  const auto config = context.config<ContactWrenchMonitorConfig>();
  balancing_ = config.balancing();
  ContactLimitsConfig double_support = config.double_support();
  ContactLimitsConfig single_support = config.single_support();
  polygon_ = config.region() == ContactWrenchMonitorConfig::POLYGON;
  if (polygon_) {
    if (config.has_half_width_beyond_soles()) {
      throw ConfigError("half_width_beyond_soles", "belongs to region RECTANGLE; remove it");
    }
    // The polygon stands in their place.
    for (ContactLimitsConfig* limits : {&double_support, &single_support}) {
      limits->set_half_length(1);
      limits->set_half_width(1);
    }
  }
  if (config.has_half_width_beyond_soles()) {
    beyond_soles_ = config.half_width_beyond_soles();
    // Replaced in every tick.
    if (!double_support.has_half_width()) double_support.set_half_width(1);
  }
  model_ = LoadRobot(context);
  const double margin = HullMargin(*model_);
  double_support_ = ReadLimits(WithinSoles(double_support, *model_, margin), "double_support");
  single_support_ = ReadLimits(WithinSoles(single_support, *model_, margin), "single_support");
  // One foot needs no reserve for what the other one carries.
  const bool given = config.has_sole_margin();
  const double alone = given ? config.sole_margin() : SoleMargin(*model_);
  const double side = config.has_side_margin() ? config.side_margin() : alone;
  CutSoles({alone, side}, &sole_);
  CutSoles(Eigen::Vector2d::Constant(given ? config.sole_margin() : margin), &shared_sole_);
  whole_body_ = context.shared->Get<balance::WholeBody>(
      "estimated", [&] { return std::make_shared<balance::WholeBody>(model_); });
  const int num_joints = model_->num_joints();
  com_height_.emplace(num_joints, 1);
  all_joints_ = config.movers() == ContactWrenchMonitorConfig::ALL_JOINTS;
  if (config.joint_limits()) {
    limits_.emplace(*model_, balance::LimitHorizon(*model_, context.tick_period));
  }
  const int most_rows = std::min(1 + kMostKept, num_joints);
  protected_.emplace(num_joints, most_rows);
  protected_jacobian_ = Eigen::MatrixXd::Zero(most_rows, model_->num_velocities());
  protected_bias_ = Eigen::VectorXd::Zero(most_rows);
  task_acceleration_ = acceleration_ = Eigen::VectorXd::Zero(model_->num_velocities());
  other_torque_ = Eigen::VectorXd::Zero(num_joints);
  step_balance_.emplace(num_joints, kStepRows);
  step_jacobian_ = Eigen::MatrixXd::Zero(kStepRows, model_->num_velocities());
  step_weight_ = Eigen::VectorXd::Constant(kStepRows, kHeldWeight);
  step_weight_.segment<2>(4).setConstant(kLevelWeight);  // after height, x, y and z
  peak_torque_ = robot::PeakTorques(*model_);
  balance_control_.emplace(num_joints, most_rows);
  state_ = robot::RobotState(num_joints);
  height_jacobian_ = Eigen::MatrixXd::Zero(1, model_->num_velocities());
  height_bias_ = Eigen::VectorXd::Zero(1);
  torque_ = Eigen::VectorXd::Zero(num_joints);
  foot_wrench_ = Eigen::VectorXd::Zero(12);

  AddSettings(context.tick_period);
  const MessageCounts counts = JointAndFootCounts(*model_);
  wiring->AddInput(&robot_state_, "robot_state", counts);
  wiring->AddInput(&support_plan_, "support_plan", FootCounts(*model_));
  wiring->AddInput(&task_torque_, "task_torque", JointCounts(*model_));
  wiring->AddInput(&operator_, "operator", {}, InputKind::kLatest);
  wiring->AddOutput(&balance_torque_, "balance_torque", counts);
  wiring->AddStage("prepare", {&robot_state_}, {}, [this](const Tick&) { Prepare(); });
  wiring->AddStage("balance", {&robot_state_, &support_plan_, &task_torque_, &operator_},
                   {&balance_torque_}, [this](const Tick& tick) {
                     operator_.TakeSettings(tick);
                     Balance();
                   });
  SetPose(Eigen::Isometry3d::Identity(), &balance_torque_->frame_o);
}

void ContactWrenchMonitor::AddSettings(double tick_period) {
  LiveSettings& settings = operator_.settings() = LiveSettings(tick_period);
  const auto add = [&](const char* field, double* length) {
    settings.Add(field, length, kLeastRegion * *length, kMostRegion * *length, kRegionRamp);
  };
  if (!polygon_) {
    add("double_support.half_length", &double_support_.half_length);
    if (!beyond_soles_) add("double_support.half_width", &double_support_.half_width);
    add("single_support.half_length", &single_support_.half_length);
    add("single_support.half_width", &single_support_.half_width);
  }
}

bool ContactWrenchMonitor::Archive(StateArchive* archive) {
  operator_.Archive(archive);
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
  const FootArray<bool> in_contact{support_plan_->in_contact[0] != 0,
                                   support_plan_->in_contact[1] != 0};
  std::copy(task.torque.begin(), task.torque.end(), torque_.data());
  if (task.status != task_torque_t::STATUS_OK) {
    out.status = balance_torque_t::STATUS_HELD;
  } else if (!state_valid_ || !torque_.allFinite() || Count(in_contact) == 0) {
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

int8_t ContactWrenchMonitor::ComputeDynamics(const FootArray<bool>& in_contact) {
  if (!whole_body_->Update(state_, in_contact)) return balance_torque_t::STATUS_SINGULAR;
  const robot::RobotData& data = whole_body_->data();
  height_jacobian_ = data.com_jacobian.row(2);
  height_bias_[0] = data.com_bias_acceleration.z();
  return com_height_->Compute(whole_body_->contact(), height_jacobian_, height_bias_)
             ? balance_torque_t::STATUS_OK
             : balance_torque_t::STATUS_SINGULAR;
}

int8_t ContactWrenchMonitor::ComputeBalance(const FootArray<bool>& in_contact) {
  if (const int8_t status = ComputeDynamics(in_contact); status != balance_torque_t::STATUS_OK) {
    return status;
  }
  const balance::ContactGeometry geometry = whole_body_->geometry();
  Eigen::Isometry3d frame_o;
  if (!balance::FrameO(geometry.sole, geometry.in_contact, &frame_o)) {
    return balance_torque_t::STATUS_SINGULAR;
  }
  const balance::ContactLimits limits = Limits(in_contact);
  const balance::ConvexPolygon region =
      polygon_ ? Soles(frame_o) : balance::Rectangle({limits.half_length, limits.half_width});
  if (region.num_corners == 0) return balance_torque_t::STATUS_SINGULAR;
  // The COM follows a centre of pressure in the planner's steps alone.
  const bool steps = balancing_ && support_plan_->com_follows == support_plan_t::FOLLOWS_COP;
  balance::BalanceResult result;
  balance::BalanceStatus status = balance::BalanceStatus::kOk;
  if (!steps || !MoveForStep(geometry, region, &result)) {
    status = polygon_ ? Move(geometry, region, &result) : Move(geometry, limits, &result);
  }
  if (status == balance::BalanceStatus::kSingular || !torque_.allFinite()) {
    return balance_torque_t::STATUS_SINGULAR;
  }
  Report(result, limits, region, in_contact);
  const bool achieved = status == balance::BalanceStatus::kOk && Inside(result.cop, region);
  return achieved || !balancing_ ? balance_torque_t::STATUS_OK
                                 : balance_torque_t::STATUS_NOT_ACHIEVED;
}

template <class Bounds>
balance::BalanceStatus ContactWrenchMonitor::Move(const balance::ContactGeometry& geometry,
                                                  const Bounds& bounds,
                                                  balance::BalanceResult* result) {
  const balance::BalanceStatus status =
      balance_control_->Compute(whole_body_->contact(), *com_height_, geometry, bounds, balancing_,
                                torque_, result, balance::Movers::kLegs);
  if (!balancing_ || !(result->active_x || result->active_y)) return status;
  if (status == balance::BalanceStatus::kOk && limits_) KeepLimits(geometry, bounds, result);
  if (all_joints_) MoveOthers(geometry, bounds, result);
  return status;
}

template <class Bounds>
void ContactWrenchMonitor::MoveOthers(const balance::ContactGeometry& geometry,
                                      const Bounds& bounds, balance::BalanceResult* result) {
  const balance::ContactDynamics& contact = whole_body_->contact();
  std::copy(task_torque_->torque.begin(), task_torque_->torque.end(), other_torque_.data());
  balance::BalanceResult other;
  if (balance_control_->Compute(contact, *com_height_, geometry, bounds, true, other_torque_,
                                &other) != balance::BalanceStatus::kOk) {
    return;
  }
  double share = 1;
  if (limits_) {
    contact.Acceleration(torque_, task_acceleration_);
    contact.Acceleration(other_torque_, acceleration_);
    for (int j = 0; j < model_->num_joints(); ++j) {
      const double from = task_acceleration_[6 + j], change = acceleration_[6 + j] - from;
      const balance::AccelerationRange range =
          limits_->Accelerations(j, state_.joint_position[j], state_.joint_velocity[j]);
      const double room = change > 0 ? range.upper - from : range.lower - from;
      // A joint beyond its range already, by the tasks, takes part in nothing that makes it worse.
      if (share * std::abs(change) > std::max(0.0, change > 0 ? room : -room)) {
        share = std::max(0.0, room / change);
      }
    }
  }
  torque_ += share * (other_torque_ - torque_);
  result->resultant += share * (other.resultant - result->resultant);
  result->cop = balance::CenterOfPressure(result->resultant);
}

template <class Bounds>
bool ContactWrenchMonitor::KeepLimits(const balance::ContactGeometry& geometry,
                                      const Bounds& bounds, balance::BalanceResult* result) {
  const balance::ContactDynamics& contact = whole_body_->contact();
  Eigen::Index rows = 0;
  for (const int j : contact.legs()) {
    const double position = state_.joint_position[j], velocity = state_.joint_velocity[j];
    if (!limits_->Near(j, position, velocity)) continue;
    if (rows == 0) {
      std::copy(task_torque_->torque.begin(), task_torque_->torque.end(), other_torque_.data());
      contact.Acceleration(torque_, acceleration_);
      contact.Acceleration(other_torque_, task_acceleration_);
      protected_jacobian_.setZero();
      protected_bias_.setZero();
      protected_jacobian_.row(0) = height_jacobian_.row(0);
      protected_bias_[0] = height_bias_[0];
      rows = 1;
    }
    const balance::AccelerationRange range = limits_->Accelerations(j, position, velocity);
    const double most = limits_->range(j).acceleration, now = acceleration_[6 + j];
    const double before = task_acceleration_[6 + j];
    const bool above = range.upper < most && now > range.upper && now > before;
    const bool below = range.lower > -most && now < range.lower && now < before;
    if ((!above && !below) || rows >= protected_jacobian_.rows()) continue;
    protected_jacobian_(rows++, 6 + j) = 1;
  }
  if (rows < 2 || !protected_->Compute(contact, protected_jacobian_.topRows(rows),
                                       protected_bias_.head(rows))) {
    return false;
  }
  balance::BalanceResult kept;
  if (balance_control_->Compute(contact, *protected_, geometry, bounds, true, other_torque_, &kept,
                                balance::Movers::kLegs) != balance::BalanceStatus::kOk) {
    return false;
  }
  torque_ = other_torque_;
  *result = kept;
  return true;
}

bool ContactWrenchMonitor::MoveForStep(const balance::ContactGeometry& geometry,
                                       const balance::ConvexPolygon& region,
                                       balance::BalanceResult* result) {
  const bool both = Count(geometry.in_contact) == 2;
  balance::StepBounds& bounds = step_bounds_;
  if (!balance::FrameO(geometry.sole, geometry.in_contact, &bounds.frame_o)) return false;
  bounds.in_contact = geometry.in_contact;
  bounds.sole = geometry.sole;
  bounds.region = region;
  const double weight = model_->total_mass() * robot::kGravity;
  for (const Foot f : kFeet) {
    bounds.foot[Index(f)] = {both ? shared_sole_[f] : sole_[f],
                             (both ? double_support_ : single_support_).friction,
                             (both ? kLeastShared : kLeastAlone) * weight};
  }
  step_jacobian_.row(0) = height_jacobian_.row(0);
  if (!both) {
    const Foot free = geometry.in_contact[Foot::kRight] ? Foot::kLeft : Foot::kRight;
    step_jacobian_.bottomRows<6>() = whole_body_->data().foot_jacobian[free];
  }
  const Eigen::Index held = both ? 1 : kStepRows;
  balance::StepBalance::Result step;
  if (!step_balance_->Compute(whole_body_->contact(), bounds,
                              {step_jacobian_.topRows(held), step_weight_.head(held)}, peak_torque_,
                              all_joints_ ? balance::Movers::kAllJoints : balance::Movers::kLegs,
                              torque_, &step)) {
    return false;
  }
  result->frame_o = bounds.frame_o;
  result->resultant_task.setZero();
  result->resultant.setZero();
  for (const Foot f : kFeet) {
    if (!geometry.in_contact[f]) continue;
    const balance::Matrix6d transfer = balance::WrenchTransform(bounds.frame_o, geometry.sole[f]);
    result->resultant_task += transfer * step.task[Index(f)];
    result->resultant += transfer * step.wrench[Index(f)];
  }
  result->cop_task = balance::CenterOfPressure(result->resultant_task);
  result->cop = result->cop_desired = balance::CenterOfPressure(result->resultant);
  result->active_x = result->active_y = step.changed;
  return true;
}

void ContactWrenchMonitor::CutSoles(const Eigen::Vector2d& margin,
                                    FootArray<balance::ConvexPolygon>* soles) const {
  const bool side = margin.y() > margin.x();
  for (const Foot f : kFeet) {
    const robot::FootModel& foot = model_->feet()[f];
    if (margin.maxCoeff() >= robot::InnerRadius(foot)) {
      throw ConfigError(side ? "side_margin" : "sole_margin",
                        fmt::format("is {} m and leaves nothing of the {} foot's sole, {} x {} m",
                                    margin.maxCoeff(), foot.name, foot.length, foot.width));
    }
    (*soles)[f] = balance::SolePolygon(foot, margin.x(), margin.y());
  }
}

balance::ConvexPolygon ContactWrenchMonitor::Soles(const Eigen::Isometry3d& frame_o) const {
  const balance::ContactGeometry& geometry = whole_body_->geometry();
  const bool both = Count(geometry.in_contact) == 2;
  return balance::WithFewerCorners(
      balance::SupportPolygon(frame_o, geometry, both ? shared_sole_ : sole_), kMostCorners);
}

balance::ContactLimits ContactWrenchMonitor::Limits(const FootArray<bool>& in_contact) const {
  if (Count(in_contact) < 2) return single_support_;
  balance::ContactLimits limits = double_support_;
  if (beyond_soles_) {
    const auto& sole = whole_body_->geometry().sole;
    limits.half_width =
        0.5 * (sole[Foot::kRight].translation() - sole[Foot::kLeft].translation()).norm() +
        *beyond_soles_;
  }
  return limits;
}

void ContactWrenchMonitor::Report(const balance::BalanceResult& result,
                                  const balance::ContactLimits& limits,
                                  const balance::ConvexPolygon& region,
                                  const FootArray<bool>& in_contact) {
  balance_torque_t& out = *balance_torque_;
  for (size_t i = 0; i < out.torque.size(); ++i) {
    out.torque[i] = torque_[static_cast<Eigen::Index>(i)];
    out.balance_torque[i] = out.torque[i] - task_torque_->torque[i];
  }
  const balance::ContactDynamics& contact = whole_body_->contact();
  auto wrench = foot_wrench_.head(contact.num_contact_rows());
  contact.ExpectedWrench(torque_, wrench);
  Eigen::Index row = 0;
  for (const Foot f : kFeet) {
    const size_t i = Index(f);
    out.in_contact[i] = in_contact[f] ? 1 : 0;
    if (in_contact[f]) {
      SetWrench(wrench.segment<6>(row), &out.foot_wrench[i]);
      row += 6;
    } else {
      SetWrench(balance::Vector6d::Zero(), &out.foot_wrench[i]);
    }
  }
  out.active_x = balancing_ && result.active_x ? 1 : 0;
  out.active_y = balancing_ && result.active_y ? 1 : 0;
  SetPose(result.frame_o, &out.frame_o);
  out.region = polygon_ ? balance_torque_t::REGION_POLYGON : balance_torque_t::REGION_RECTANGLE;
  out.num_corners = static_cast<int8_t>(region.num_corners);
  std::fill(std::begin(out.corner_x), std::end(out.corner_x), 0.0);
  std::fill(std::begin(out.corner_y), std::end(out.corner_y), 0.0);
  out.cop_limit[0] = out.cop_limit[1] = 0;
  for (size_t i = 0; i < region.corners().size(); ++i) {
    const Eigen::Vector2d& corner = region.corners()[i];
    out.corner_x[i] = corner.x();
    out.corner_y[i] = corner.y();
    out.cop_limit[0] = std::max(out.cop_limit[0], std::abs(corner.x()));
    out.cop_limit[1] = std::max(out.cop_limit[1], std::abs(corner.y()));
  }
  for (int i = 0; i < 2; ++i) {
    out.cop_task[i] = result.cop_task[i];
    out.cop[i] = result.cop[i];
  }
  SetWrench(result.resultant_task, &out.resultant_task);
  SetWrench(result.resultant, &out.resultant);
  balance::ContactMargins margins = balance::CheckContact(result.resultant, limits);
  if (polygon_) {
    // What the moments lack until the centre of pressure is on the edge.
    margins.roll = margins.pitch =
        std::abs(result.resultant(2)) * balance::SignedDistance(region, result.cop);
  }
  SetMargins(margins, &out.resultant_margins);
}

ComponentType ContactWrenchMonitorType() {
  return {
      "contact_wrench_monitor",
      "expected wrenches and CoP control in the null space (39)",
      [] { return std::make_unique<ContactWrenchMonitor>(); },
      {.parts = {{"balancing", "contact_wrench_monitor.balancing"}}},
      {Reads<robot_state_t>("robot_state"), Reads<support_plan_t>("support_plan"),
       Reads<task_torque_t>("task_torque"), Reads<operate::act_t>("operator", InputKind::kLatest),
       Writes<balance_torque_t>("balance_torque")},
      ContactWrenchMonitorConfig::descriptor(),
      contact_wrench_monitor_proto_schema};
}

}  // namespace poise
