#include "logging/derived/derived_signals.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <type_traits>
#include <utility>

#include "components/messages/conversions.h"
#include "derived/message_traits.hpp"
#include "logging/channel_ticks.h"
#include "logging/element_names.h"
#include "poise/message_traits.hpp"
#include "steps/message_traits.hpp"

namespace poise::logging {
namespace {

using derived::signals_t;

/// What a tick's signals are computed from.
struct Inputs {
  const robot::RobotModel& robot;
  const RunMessages& run;
  TickView before, now;  ///< nothing before a tick whose predecessor is missing
  const std::optional<Eigen::Vector3d>&first_com, &first_true_com;
  double time;  ///< s, of the scenario
  std::array<Footprint, 2>& prints;
};

/// Bits of message types, in TickView's order.
enum Source : uint32_t {
  kSensors = 1,
  kState = 2,
  kEstimator = 4,
  kPlan = 8,
  kPlanner = 16,
  kBalance = 32,
  kCommand = 64,
  kBridge = 128,
  kPush = 256,
  kTruth = 512,
  kFootsteps = 1024,
};

void Put(const std::optional<double>& from, double* to) {
  if (from) *to = *from;
}
void Put(const std::optional<Eigen::Vector2d>& from, double (&to)[2]) {
  if (from) std::copy_n(from->data(), 2, to);
}
void Put(const std::optional<Eigen::Vector4d>& from, derived::ratios_t* to) {
  if (from) *to = {(*from)(0), (*from)(1), (*from)(2), (*from)(3)};
}

std::optional<Eigen::Vector2d> Absolute(std::optional<Eigen::Vector2d> value) {
  if (value) *value = value->cwiseAbs();
  return value;
}

/// m, in the sole's frame.
std::optional<Eigen::Vector2d> SoleCop(const robot::RobotModel& robot,
                                       const std::optional<Wrench>& wrench) {
  if (!wrench || !(std::abs((*wrench)(2)) > LightLoad(robot))) return {};
  return balance::CenterOfPressure(*wrench);
}

/// Three standard deviations of the norm of those errors of the estimate.
double ThreeDeviations(const estimator_status_t& status, std::initializer_list<int> errors) {
  double sum = 0;
  for (const int i : errors) sum += status.covariance[9 * i - i * (i - 1) / 2];
  return 3 * std::sqrt(sum);
}

/// Fills the parts of one kind (load, centre of pressure, ratios) of each foot.
template <class WrenchOf>
void PutFeet(const Inputs& in, const WrenchOf& wrench_of, double derived::foot_t::*load,
             double (derived::foot_t::*cop)[2], derived::ratios_t derived::foot_t::*ratios,
             double least_of_ratios, signals_t* out) {
  for (size_t f = 0; f < out->foot.size(); ++f) {
    const std::optional<Wrench> wrench = wrench_of(f);
    if (!wrench) continue;
    out->foot[f].*load = 0.0 - (*wrench)(2);  // never minus zero
    Put(SoleCop(in.robot, wrench), out->foot[f].*cop);
    if (ratios != nullptr) Put(ContactRatios(*wrench, least_of_ratios), &(out->foot[f].*ratios));
  }
}

/// One or more fields of signals_t that are computed together.
struct Definition {
  std::vector<std::string_view> fields;  ///< "foot.load_true" of each foot
  std::vector<uint32_t> sources;         ///< any of these sets of messages tells them
  void (*compute)(const Inputs&, signals_t*);
};

/// Units and meanings of the fields stand in lcmtypes/derived/.
const std::vector<Definition>& Definitions() {
  static const std::vector<Definition> definitions = {
      {{"com_motion"},
       {kPlanner},
       [](const Inputs& in, signals_t* out) {
         SetVector3(GetVector3(in.now.planner->com_position) - *in.first_com, out->com_motion);
       }},
      {{"com_motion_true"},
       {kTruth},
       [](const Inputs& in, signals_t* out) {
         SetVector3(GetVector3(in.now.truth->com_position) - *in.first_true_com,
                    out->com_motion_true);
       }},
      {{"com_motion_desired"},
       {kPlan | kPlanner},
       [](const Inputs& in, signals_t* out) {
         for (int i = 0; i < 3; ++i) {
           if (!HasComReference(*in.now.plan, i)) continue;
           out->com_motion_desired[i] = in.now.plan->com_reference.position[i] - (*in.first_com)(i);
         }
       }},
      {{"com_error"},
       {kPlan | kPlanner},
       [](const Inputs& in, signals_t* out) {
         for (int i = 0; i < 3; ++i) {
           Put(ComError(*in.now.plan, in.now.planner->com_position, i), &out->com_error[i]);
         }
       }},
      {{"com_error_true"},
       {kPlan | kTruth},
       [](const Inputs& in, signals_t* out) {
         for (int i = 0; i < 3; ++i) {
           Put(ComError(*in.now.plan, in.now.truth->com_position, i), &out->com_error_true[i]);
         }
       }},
      {{"cop_measured", "cop_measured_abs", "cop_measured_place"},
       {kSensors | kPlanner, kSensors | kTruth, kState | kPlanner, kState | kTruth},
       [](const Inputs& in, signals_t* out) {
         const auto measured = MeasuredCop(in.robot, in.run, in.before, in.now);
         if (!measured) return;
         const std::optional<Eigen::Vector2d> cop = measured->cop;
         Put(cop, out->cop_measured);
         Put(Absolute(cop), out->cop_measured_abs);
         SetVector3(measured->frame * Eigen::Vector3d(cop->x(), cop->y(), 0),
                    out->cop_measured_place);
       }},
      {{"cop_computed", "cop_computed_abs"},
       {kBalance, kCommand | kPlanner, kCommand | kTruth},
       [](const Inputs& in, signals_t* out) {
         const auto cop = ComputedCop(in.robot, in.run, in.now);
         Put(cop, out->cop_computed);
         Put(Absolute(cop), out->cop_computed_abs);
       }},
      {{"cop_desired"},
       {kBalance},
       [](const Inputs& in, signals_t* out) {
         const balance_torque_t& balance = *in.now.balance;
         const bool active[2] = {balance.active_x != 0, balance.active_y != 0};
         for (int i = 0; i < 2; ++i) {
           // In a polygon the bound of one axis depends on the other: the computed one is on it.
           out->cop_desired[i] = !active[i] ? balance.cop_task[i]
                                 : balance.region != balance_torque_t::REGION_RECTANGLE
                                     ? balance.cop[i]
                                     : std::copysign(balance.cop_limit[i], balance.cop_task[i]);
         }
       }},
      {{"capture_steps"},
       {kPlanner | kFootsteps},
       [](const Inputs& in, signals_t* out) {
         Put(StepsThatCatch(*in.now.planner, *in.now.footsteps), &out->capture_steps);
       }},
      {{"share_commanded", "share_least", "share_most"},
       {kCommand},
       [](const Inputs& in, signals_t* out) {
         const joint_command_t& command = *in.now.command;
         if (!TellsRatio(command)) return;
         out->share_commanded = command.eta;
         if (command.eta_feasible == 0) return;
         out->share_least = command.eta_min;
         out->share_most = command.eta_max;
       }},
      {{"share_true"},
       {kTruth},
       [](const Inputs& in, signals_t* out) {
         const double right = in.now.truth->foot_wrench[0].force[2];
         const double both = right + in.now.truth->foot_wrench[1].force[2];
         if (std::abs(both) > LightLoad(in.robot)) out->share_true = right / both;
       }},
      {{"base_position_error", "base_velocity_error", "base_tilt_error"},
       {kState | kTruth},
       [](const Inputs& in, signals_t* out) {
         const EstimatorError error = BaseError(*in.now.state, *in.now.truth);
         SetVector3(
             GetVector3(in.now.state->base_position) - GetVector3(in.now.truth->base_position),
             out->base_position_error);
         out->base_velocity_error = error.velocity;
         out->base_tilt_error = error.tilt;
       }},
      {{"base_position_bound", "base_velocity_bound", "base_tilt_bound"},
       {kEstimator},
       [](const Inputs& in, signals_t* out) {
         const estimator_status_t& status = *in.now.estimator;
         if (status.has_covariance == 0) return;
         out->base_position_bound = ThreeDeviations(status, {6, 7, 8});
         out->base_velocity_bound = ThreeDeviations(status, {3, 4, 5});
         out->base_tilt_bound = ThreeDeviations(status, {0, 1});
       }},
      {{"push_magnitude"},
       {kPush},
       [](const Inputs& in, signals_t* out) {
         out->push_magnitude = GetVector3(in.now.push->force).norm();
       }},
      {{"torque_share"},
       {kTruth, kBridge, kCommand},
       [](const Inputs& in, signals_t* out) {
         for (size_t joint = 0; joint < out->torque_share.size(); ++joint) {
           const auto torque = MotorTorque(in.run, in.now, joint);
           if (torque)
             out->torque_share[joint] = 100 * *torque / robot::PeakTorque(in.robot, joint);
         }
       }},
      {{"foot.load_computed", "foot.cop_computed", "foot.ratio_computed", "foot.limit"},
       {kCommand},
       [](const Inputs& in, signals_t* out) {
         PutFeet(
             in, [&](size_t f) { return ComputedWrench(in.now, f); },
             &derived::foot_t::load_computed, &derived::foot_t::cop_computed,
             &derived::foot_t::ratio_computed, LightLoad(in.robot), out);
         const joint_command_t& command = *in.now.command;
         const bool tells = TellsFoot(command, 0) || TellsFoot(command, 1);
         for (size_t f = 0; f < out->foot.size(); ++f) {
           Put(ContactLimits(in.robot, in.now, f), &out->foot[f].limit);
           // A foot in the air bears nothing, which is told as well.
           if (tells) out->foot[f].load_computed = 0.0 - command.foot_wrench[f].force[2];
         }
       }},
      {{"foot.load_measured", "foot.cop_measured", "foot.ratio_measured"},
       {kSensors, kState},
       [](const Inputs& in, signals_t* out) {
         PutFeet(
             in, [&](size_t f) { return KnownWrench(in.robot, in.now, f); },
             &derived::foot_t::load_measured, &derived::foot_t::cop_measured,
             &derived::foot_t::ratio_measured,
             kLoadedShare * in.robot.total_mass() * robot::kGravity, out);
       }},
      {{"foot.load_true", "foot.cop_true"},
       {kTruth},
       [](const Inputs& in, signals_t* out) {
         PutFeet(
             in, [&](size_t f) { return std::optional(GetWrench(in.now.truth->foot_wrench[f])); },
             &derived::foot_t::load_true, &derived::foot_t::cop_true, nullptr, 0, out);
       }},
      {{"foot.print_time", "foot.print_position", "foot.print_orientation"},
       {kPlan | kState | kTruth, kPlan | kState | kPlanner},
       [](const Inputs& in, signals_t* out) {
         const bool soles = in.run.truth ? in.now.truth != nullptr : in.now.planner != nullptr;
         for (size_t f = 0; f < out->foot.size(); ++f) {
           if (soles) {
             in.prints[f].Update(
                 in.time, in.now.plan->in_contact[f] != 0, -in.now.state->foot_wrench[f].force[2],
                 in.run.truth ? in.now.truth->foot_pose[f] : in.now.planner->foot_pose[f],
                 in.robot.total_mass() * robot::kGravity);
           }
           if (!in.prints[f].last()) continue;
           const auto& [since, sole] = *in.prints[f].last();
           out->foot[f].print_time = since;
           std::ranges::copy(sole.position, out->foot[f].print_position);
           std::ranges::copy(sole.orientation, out->foot[f].print_orientation);
         }
       }},
      {{"foot.position_error"},
       {kPlan | kPlanner},
       [](const Inputs& in, signals_t* out) {
         for (size_t f = 0; f < out->foot.size(); ++f) {
           for (int i = 0; i < 3; ++i) {
             Put(FootError(*in.now.plan, *in.now.planner, f, i), &out->foot[f].position_error[i]);
           }
         }
       }},
  };
  return definitions;
}

bool IsTold(const Definition& definition, uint32_t types) {
  return std::ranges::any_of(definition.sources,
                             [&](uint32_t needed) { return (needed & types) == needed; });
}

/// Calls visit(double*) for each real of a message.
template <class F, class Visit>
void VisitReals(F* field, const Visit& visit) {
  if constexpr (std::is_same_v<F, double>) {
    visit(field);
  } else if constexpr (std::is_array_v<F> || message_internal::IsVector<F>::value) {
    for (auto& element : *field) VisitReals(&element, visit);
  } else if constexpr (std::is_class_v<F>) {
    MessageTraits<F>::VisitFields(*field,
                                  [&](const char*, auto& member) { VisitReals(&member, visit); });
  }
}

}  // namespace

DerivedSignals::DerivedSignals(const RunSpec& spec, const robot::RobotModel& robot)
    : robot_(robot),
      run_id_(spec.run_id()),
      lead_ticks_(spec.lead_ticks()),
      period_(spec.tick_period()),
      counts_{robot.num_joints(), static_cast<int32_t>(robot.feet().size())} {
  bool fits = true;
  for (const Channel& channel : spec.graph().channel()) {
    fits = fits && channel.name() != kDerivedChannel;
    if (!IsKept(spec, channel.name())) continue;
    const MessageType& type = ChannelType(channel);
    uint32_t bit = 1;
    TickView().VisitMessages([&]<class T>(const T*&) {
      // Signals follow from the others, not from themselves.
      if (!std::is_same_v<T, signals_t> && std::string_view(type.name) == MessageTraits<T>::kName) {
        types_ |= bit;
        for (size_t i = 0; i < type.count_names.size(); ++i) {
          const size_t of = std::string_view(type.count_names[i]) == "num_feet" ? 1 : 0;
          fits = fits && channel.count(static_cast<int>(i)) == counts_[of];
        }
      }
      bit <<= 1;
    });
  }
  if (!fits) types_ = 0;
  any_ = std::ranges::any_of(Definitions(),
                             [&](const Definition& each) { return IsTold(each, types_); });
  const auto has = [&](Source source) { return (types_ & source) != 0; };
  run_ = {has(kPlan), has(kPlanner), has(kBalance), has(kBridge), has(kTruth)};
}

bool DerivedSignals::Tells(std::string_view path) const {
  const std::string field = WithoutIndexes(path);
  return std::ranges::any_of(Definitions(), [&](const Definition& each) {
    return IsTold(each, types_) && std::ranges::any_of(each.fields, [&](std::string_view name) {
             return field == name || field.starts_with(std::string(name) + '.');
           });
  });
}

const signals_t& DerivedSignals::Next(TickMessages now) {
  MessageTraits<signals_t>::Resize(signals_, counts_);
  VisitReals(&signals_, [](double* value) { *value = std::nan(""); });
  signals_.run_id = run_id_;
  signals_.tick = now.tick;
  signals_.utime = now.utime;
  if (now.planner && !first_com_) first_com_ = GetVector3(now.planner->com_position);
  if (now.truth && !first_true_com_) first_true_com_ = GetVector3(now.truth->com_position);
  const bool follows = before_.tick == now.tick - 1;
  const double time = static_cast<double>(now.tick - lead_ticks_) * period_;
  const Inputs inputs{robot_,     run_,       follows ? before_.view() : TickView(),
                      now.view(), first_com_, first_true_com_,
                      time,       prints_};
  uint32_t types = 0, bit = 1;
  now.view().VisitMessages([&](const auto* message) {
    if (message != nullptr) types |= bit;
    bit <<= 1;
  });
  for (const Definition& definition : Definitions()) {
    if (IsTold(definition, types & types_)) definition.compute(inputs, &signals_);
  }
  VisitReals(&signals_, [](double* value) {
    if (!std::isfinite(*value)) *value = std::nan("");
  });
  before_ = std::move(now);
  return signals_;
}

DerivedMessages::DerivedMessages(const RunSpec& spec, const robot::RobotModel& robot, size_t most)
    : signals_(spec, robot), gatherer_(spec, 1, most) {}

void DerivedMessages::Encode(TickMessages messages, std::span<const uint8_t>* data) {
  const signals_t& signals = signals_.Next(std::move(messages));
  bytes_.resize(static_cast<size_t>(signals.getEncodedSize()));
  signals.encode(bytes_.data(), 0, static_cast<int>(bytes_.size()));
  *data = bytes_;
}

bool DerivedMessages::Take(bool end, int64_t* utime, std::span<const uint8_t>* data) {
  std::optional<TickMessages> messages = gatherer_.Take(end);
  if (!messages) return false;
  *utime = messages->utime;
  Encode(std::move(*messages), data);
  return true;
}

bool DerivedMessages::TakeTick(int64_t tick, std::span<const uint8_t>* data) {
  std::optional<TickMessages> messages = gatherer_.TakeTick(tick);
  if (!messages) return false;
  Encode(std::move(*messages), data);
  return true;
}

}  // namespace poise::logging
