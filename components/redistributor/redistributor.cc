#include "components/redistributor/redistributor.h"

#include <algorithm>
#include <cmath>

#include "components/balance/contact_transition.h"
#include "components/balance/minimum_jerk.h"
#include "components/balance/redistribution.h"
#include "components/messages/archive_message.h"
#include "components/messages/conversions.h"
#include "components/messages/robot_resource.h"
#include "components/redistributor/redistributor.pb.h"
#include "components/robot/sole.h"

namespace poise {

std::string_view redistributor_proto_schema();  // generated
namespace {

using balance::Vector6d;
using robot::Foot;
using robot::FootArray;
using robot::kFeet;

constexpr FootArray<bool> kBoth(true);
// What an operator may ask of the lighter foot at most; at a half nothing would be left to choose.
constexpr double kMostLightShare = 0.45;
// s that an operator's change takes, so that the torque makes no step.
constexpr double kRatioRamp = 0.5;
// 1/s: half of what shakes a foot on something soft (redistributor.proto).
constexpr double kMostIntegral = 40;
// s until readings count again after the answer was let go: the sole comes down.
constexpr double kFeedbackPause = 0.2;
// Share of a joint's torque that stays free, so that no motor cuts what rounding adds. StepBalance
// leaves more free, so that its torques keep this limit.
constexpr double kTorqueRounding = 1e-6;

bool AllFinite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

/// η of wrenches in the sole frames: the right foot's share of the resultant's F_z.
double RightShare(const FootArray<Vector6d>& wrench, const FootArray<Eigen::Isometry3d>& sole_in_o,
                  const Vector6d& resultant) {
  return (sole_in_o[Foot::kRight].linear() * wrench[Foot::kRight].head<3>()).z() / resultant[2];
}

}  // namespace

void Redistributor::Configure(const ComponentContext& context, Wiring* wiring) {
  const auto config = context.config<RedistributorConfig>();
  redistribution_ = config.redistribution();
  transition_ = config.transition();
  model_ = LoadRobot(context);
  const double margin = SoleMargin(*model_);
  double_support_ = ReadSoleLimits(config.double_support(), *model_, margin, "double_support");
  single_support_ = ReadSoleLimits(config.single_support(), *model_, margin, "single_support");
  for (const Foot f : kFeet) sole_[f] = balance::CornersOf(double_support_[f].edges);
  eta_min_ = config.eta_min();
  eta_max_ = config.eta_max();
  if (eta_min_ >= eta_max_) throw ConfigError("eta_min", "must be less than eta_max");
  landed_share_ = config.landed_share();
  ratio_moves_ = RatioMoves(config);
  const FeedbackLimits limits = LimitsOfFeedback(*model_);
  feedback_ = InternalFeedback(config.feedback(), limits);
  feedback_edge_ = limits.edge;
  if (feedback_.enabled() && !redistribution_) {
    throw ConfigError("feedback.enabled", "needs redistribution: true");
  }

  impedance_ = PlannedImpedance(config.impedance(), *model_, context.tick_period);
  if (config.yielding_legs()) yielding_legs_ = YieldingLegs(*model_, context.tick_period);
  swing_friction_ = SwingFriction(config.friction_compensation(), *model_, context.tick_period);
  whole_body_ = context.shared->Get<balance::WholeBody>(
      "estimated", [&] { return std::make_shared<balance::WholeBody>(model_); });
  state_ = robot::RobotState(model_->num_joints());
  contact_jacobian_ = Eigen::MatrixXd::Zero(12, model_->num_velocities());
  torque_ = Eigen::VectorXd::Zero(model_->num_joints());
  peak_torque_ = (1 - kTorqueRounding) * robot::PeakTorques(*model_);
  acceleration_ = Eigen::VectorXd::Zero(model_->num_velocities());

  AddSettings(context.tick_period);
  const MessageCounts counts = JointAndFootCounts(*model_);
  wiring->AddInput(&robot_state_, "robot_state", counts);
  wiring->AddInput(&support_plan_, "support_plan", FootCounts(*model_));
  wiring->AddInput(&balance_torque_, "balance_torque", counts);
  wiring->AddInput(&operator_, "operator", {}, InputKind::kLatest);
  wiring->AddOutput(&joint_command_, "joint_command", counts);
  wiring->AddStage("prepare", {&robot_state_}, {}, [this](const Tick&) { Prepare(); });
  wiring->AddStage("redistribute", {&robot_state_, &support_plan_, &balance_torque_, &operator_},
                   {&joint_command_}, [this](const Tick& tick) {
                     operator_.TakeSettings(tick);
                     Redistribute(tick);
                   });
}

void Redistributor::AddSettings(double tick_period) {
  LiveSettings& settings = operator_.settings() = LiveSettings(tick_period);
  settings.Add("eta_min", &eta_min_, 0, kMostLightShare, kRatioRamp);
  settings.Add("eta_max", &eta_max_, 1 - kMostLightShare, 1, kRatioRamp);
  settings.Add("landed_share", &landed_share_, 0, kMostLightShare, kRatioRamp);
  if (!feedback_.enabled()) return;
  settings.Add("feedback.integral", feedback_.integral_rate(), 0, kMostIntegral, kRatioRamp);
}

bool Redistributor::Archive(StateArchive* archive) {
  operator_.Archive(archive);
  feedback_.Archive(archive);
  yielding_legs_.Archive(archive);
  swing_friction_.Archive(archive);
  archive->Show(last_index_, last_time_, last_eta_, learn_from_, landed_foot_);
  ArchiveMessage(&*joint_command_, archive);
  return true;
}

void Redistributor::Prepare() {
  state_valid_ = ReadState(*robot_state_, &state_);
  if (!state_valid_) return;
  whole_body_->UpdateKinematics(state_);
  whole_body_->ContactJacobian(kBoth, &contact_jacobian_);
}

void Redistributor::Redistribute(const Tick& tick) {
  const balance_torque_t& balance = *balance_torque_;
  joint_command_t& out = *joint_command_;
  const bool held = balance.status == balance_torque_t::STATUS_HELD ||
                    balance.status == balance_torque_t::STATUS_INVALID_STATE;
  const FootArray<bool> in_contact{support_plan_->in_contact[0] != 0,
                                   support_plan_->in_contact[1] != 0};
  if (held || !state_valid_ || !AllFinite(balance.torque) || Count(in_contact) == 0) {
    ClearImpedance(&out);  // its target is of another tick
    out.status = joint_command_t::STATUS_INVALID_INPUT;
    return;
  }
  for (const Foot f : kFeet) out.in_contact[Index(f)] = in_contact[f] ? 1 : 0;
  if (balance.status == balance_torque_t::STATUS_SINGULAR) {
    PassTorqueThrough();
    ClearImpedance(&out);
    out.status = joint_command_t::STATUS_INVALID_INPUT;
    return;
  }
  out.status = Count(in_contact) == 2 ? ComputeDouble(tick) : ComputeSingle(in_contact);
  const bool ramped = support_plan_->transition != support_plan_t::TRANSITION_NONE;
  swing_friction_.Ramp(in_contact, ramped, out.eta);
  if (impedance_.enabled() || swing_friction_.acts()) FollowMotion(in_contact);
  // Last: the motion above is planned on feet that the ground bears.
  yielding_legs_.Yield(in_contact, *robot_state_, &out);
}

void Redistributor::FollowMotion(const FootArray<bool>& in_contact) {
  joint_command_t& out = *joint_command_;
  if (!whole_body_->Update(state_, in_contact)) return ClearImpedance(&out);
  const int num_joints = model_->num_joints();
  torque_ = Eigen::Map<const Eigen::VectorXd>(out.torque.data(), num_joints);
  whole_body_->contact().Acceleration(torque_, acceleration_);
  if (!acceleration_.allFinite()) return ClearImpedance(&out);
  const auto joint_acceleration = acceleration_.tail(num_joints);
  if (impedance_.enabled()) impedance_.Plan(state_, joint_acceleration, &out);
  // Last: the model's joints have no friction, so that this torque causes none of the motion.
  swing_friction_.Add(state_.joint_velocity, joint_acceleration, out.torque);
}

int8_t Redistributor::ComputeSingle(const FootArray<bool>& in_contact) {
  joint_command_t& out = *joint_command_;
  PassTorqueThrough();
  ForgetDistribution();
  landed_foot_.reset();
  out.eta = out.eta_optimal = in_contact[Foot::kRight] ? 1.0 : 0.0;
  out.eta_min = out.eta_max = out.eta;
  out.eta_feasible = 1;
  Report({GetWrench(balance_torque_->foot_wrench[0]), GetWrench(balance_torque_->foot_wrench[1])},
         single_support_, in_contact);
  return joint_command_t::STATUS_OK;
}

int8_t Redistributor::ComputeDouble(const Tick& tick) {
  joint_command_t& out = *joint_command_;
  const Vector6d resultant = GetWrench(balance_torque_->resultant);
  const Eigen::Isometry3d frame_o = GetPose(balance_torque_->frame_o);
  FootArray<Eigen::Isometry3d> sole_in_o;
  Wrenches wrench;
  for (const Foot f : kFeet) {
    sole_in_o[f] = frame_o.inverse() * whole_body_->data().foot_pose[f];
    wrench[f] = GetWrench(balance_torque_->foot_wrench[Index(f)]);
  }
  const bool own_soles = sole_[Foot::kRight].num_corners > 0 && sole_[Foot::kLeft].num_corners > 0;
  const auto allowed = [&](double least, double most) {
    return own_soles ? balance::FreeRatio(resultant, sole_in_o, double_support_, sole_, least, most)
                     : balance::FeasibleRatio(resultant, sole_in_o, double_support_, least, most);
  };
  balance::RatioInterval interval = allowed(eta_min_, eta_max_);
  // The least share holds outside a ramp: on one a foot may carry nothing.
  const bool ramped = transition_ && support_plan_->transition != support_plan_t::TRANSITION_NONE;
  const balance::RatioInterval any_share = ramped ? allowed(0, 1) : interval;
  if (!interval.feasible) interval = any_share;
  interval = KeepLanded(interval);
  const bool pressed = resultant[2] < 0;
  out.eta_feasible = interval.feasible && pressed ? 1 : 0;
  out.eta_min = interval.feasible ? interval.min : 0.0;
  out.eta_max = interval.feasible ? interval.max : 1.0;
  out.eta_optimal = interval.optimal;
  if (redistribution_ && pressed) {
    const double free_ratio =
        balance::SelectRatio(interval, resultant, sole_in_o, double_support_, eta_min_, eta_max_);
    out.eta = RampedRatio(ratio_moves_.Ratio(tick.time, interval, free_ratio), any_share, resultant,
                          sole_in_o);
    Wrenches desired = balance::DistributeResultant(resultant, sole_in_o, out.eta);
    if (own_soles) balance::MoveIntoSoles(sole_in_o, sole_, &desired);
    Eigen::Matrix<double, 12, 1> change;
    change << desired[Foot::kRight] - wrench[Foot::kRight],
        desired[Foot::kLeft] - wrench[Foot::kLeft];
    balance::RedistributionTorque(contact_jacobian_, change, torque_);
    const Eigen::Map<const Eigen::VectorXd> balance_torque(balance_torque_->torque.data(),
                                                           torque_.size());
    const double share = balance::ShareWithin(peak_torque_, balance_torque, torque_);
    if (share < 1) {
      torque_ *= share;
      for (const Foot f : kFeet) desired[f] = wrench[f] + share * (desired[f] - wrench[f]);
      out.eta = RightShare(desired, sole_in_o, resultant);
    }
    for (size_t i = 0; i < out.torque.size(); ++i) {
      out.redistribution_torque[i] = torque_[static_cast<Eigen::Index>(i)];
      out.torque[i] = balance_torque_->torque[i] + out.redistribution_torque[i];
    }
    wrench = desired;
    if (feedback_.enabled()) AddFeedback(tick, sole_in_o, desired);
  } else {
    PassTorqueThrough();
    ForgetDistribution();
    out.eta = pressed ? RightShare(wrench, sole_in_o, resultant) : 0.5;
  }
  Report(wrench, double_support_, kBoth);
  return out.eta_feasible != 0 ? joint_command_t::STATUS_OK : joint_command_t::STATUS_INFEASIBLE;
}

balance::RatioInterval Redistributor::KeepLanded(balance::RatioInterval interval) {
  const support_plan_t& plan = *support_plan_;
  if (plan.transition == support_plan_t::TRANSITION_LOADING)
    landed_foot_ = robot::FootAt(plan.transition_foot);
  if (landed_foot_ == Foot::kRight) {
    interval.min = std::clamp(landed_share_, interval.min, interval.max);
  } else if (landed_foot_ == Foot::kLeft) {
    interval.max = std::clamp(1 - landed_share_, interval.min, interval.max);
  }
  return interval;
}

double Redistributor::RampedRatio(double free_ratio, const balance::RatioInterval& both,
                                  const Vector6d& resultant,
                                  FootArray<Eigen::Isometry3d> sole_in_o) const {
  const support_plan_t& plan = *support_plan_;
  if (!transition_ || plan.transition == support_plan_t::TRANSITION_NONE) return free_ratio;
  const bool unloading = plan.transition == support_plan_t::TRANSITION_UNLOADING;
  const Foot light = robot::FootAt(plan.transition_foot);
  const double ramped =
      balance::TransitionRatio(free_ratio, light, unloading, plan.transition_progress);
  if (both.feasible) return std::clamp(ramped, both.min, both.max);
  // Then only the loaded foot's conditions count: with both soles turned like it, the other's are
  // the same.
  sole_in_o[light].linear() = sole_in_o[Other(light)].linear();
  const balance::RatioInterval allowed =
      balance::FeasibleRatio(resultant, sole_in_o, double_support_[Other(light)], 0.0, 1.0);
  return allowed.feasible ? std::clamp(ramped, allowed.min, allowed.max) : ramped;
}

double Redistributor::FeedbackShare(double eta) const {
  const support_plan_t& plan = *support_plan_;
  const double loaded = feedback_.LoadShare(eta);
  if (plan.transition == support_plan_t::TRANSITION_NONE) return loaded;
  const double progress = balance::SmoothStep(plan.transition_progress);
  return loaded *
         (plan.transition == support_plan_t::TRANSITION_UNLOADING ? 1 - progress : progress);
}

bool Redistributor::AboutToTip(const Wrenches& desired) const {
  for (const Foot f : kFeet) {
    const Eigen::Vector2d cop = balance::CenterOfPressure(desired[f]);
    if (!(robot::DistanceInside(model_->feet()[f], cop) >= feedback_edge_)) return true;
  }
  return false;
}

void Redistributor::AddFeedback(const Tick& tick, const FootArray<Eigen::Isometry3d>& sole_in_o,
                                const Wrenches& desired) {
  joint_command_t& out = *joint_command_;
  InternalWrench answer = InternalWrench::Zero();
  const double share = FeedbackShare(out.eta);
  // Soles about to tip, and legs that yield, share their load as they can, not as commanded.
  const bool tipping = AboutToTip(desired) || yielding_legs_.any();
  if (tipping) {
    learn_from_ = tick.time + kFeedbackPause;
    if (last_index_ >= 0) feedback_.Release(tick.time - last_time_);
  }
  // A reading shows the command of the tick before; after skipped ticks it may show any.
  if (!tipping && tick.time >= learn_from_ && last_index_ >= 0 && last_index_ == tick.index - 1) {
    const Wrenches measured{GetWrench(robot_state_->foot_wrench[0]),
                            GetWrench(robot_state_->foot_wrench[1])};
    answer = feedback_.Update(DistributionError(measured, sole_in_o, last_eta_),
                              tick.time - last_time_, share);
  } else if (last_index_ >= 0) {
    answer = feedback_.Hold(share);
  }
  balance::RedistributionTorque(contact_jacobian_, WrenchChange(answer, sole_in_o), torque_);
  for (size_t i = 0; i < out.torque.size(); ++i) {
    out.feedback_torque[i] = torque_[static_cast<Eigen::Index>(i)];
    out.redistribution_torque[i] += out.feedback_torque[i];
    out.torque[i] = balance_torque_->torque[i] + out.redistribution_torque[i];
  }
  last_index_ = tick.index;
  last_time_ = tick.time;
  last_eta_ = out.eta;
}

void Redistributor::ForgetDistribution() {
  feedback_.Reset();
  last_index_ = -1;
}

void Redistributor::PassTorqueThrough() {
  joint_command_t& out = *joint_command_;
  out.torque = balance_torque_->torque;
  std::fill(out.redistribution_torque.begin(), out.redistribution_torque.end(), 0.0);
  std::fill(out.feedback_torque.begin(), out.feedback_torque.end(), 0.0);
}

void Redistributor::Report(const Wrenches& wrench, const balance::SoleLimits& limits,
                           const FootArray<bool>& in_contact) {
  joint_command_t& out = *joint_command_;
  for (const Foot f : kFeet) {
    const size_t i = Index(f);
    const Vector6d value = in_contact[f] ? wrench[f] : Vector6d(Vector6d::Zero());
    const balance::ContactMargins margins =
        in_contact[f] ? balance::CheckContact(value, limits[f]) : balance::ContactMargins{};
    SetWrench(value, &out.foot_wrench[i]);
    SetMargins(margins, &out.margins[i]);
    out.conditions_met[i] = !in_contact[f] || margins.Met() ? 1 : 0;
  }
}

ComponentType RedistributorType() {
  return {"redistributor",
          "ratio eta, contact transitions and the joint torque (53)",
          [] { return std::make_unique<Redistributor>(); },
          {.parts = {{"redistribution", "redistributor.redistribution"},
                     {"transition", "redistributor.transition"}},
           // The ideal robot's joints have no friction.
           .ideal = {"redistributor.friction_compensation.share=0"}},
          {Reads<robot_state_t>("robot_state"), Reads<support_plan_t>("support_plan"),
           Reads<balance_torque_t>("balance_torque"),
           Reads<operate::act_t>("operator", InputKind::kLatest),
           Writes<joint_command_t>("joint_command")},
          RedistributorConfig::descriptor(),
          redistributor_proto_schema};
}

}  // namespace poise
