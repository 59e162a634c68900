#include "components/task_controller/phase_schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "components/framework/configuration.h"

namespace poise {
namespace {

// Ticks are whole microseconds: far below any, far above rounding.
constexpr double kTimeTolerance = 1e-9;

const char* Name(int foot) { return foot == RIGHT_FOOT ? "right" : "left"; }
Support SupportOn(int foot) { return foot == RIGHT_FOOT ? RIGHT : LEFT; }
int Other(int foot) { return 1 - foot; }

void CheckFinite(double value, const std::string& field) {
  if (!std::isfinite(value)) throw ConfigError(field, "is not a finite number");
}

void CheckNotNegative(double value, const std::string& field) {
  CheckFinite(value, field);
  if (value < 0) throw ConfigError(field, "is negative; give seconds from 0 up");
}

void CheckGains(bool present, const Gains& gains, const std::string& field, const char* why) {
  if (!present) throw ConfigError(field, fmt::format("is missing; {}", why));
  const auto check = [&](bool has, double value, const char* name) {
    if (!has || !(value > 0) || !std::isfinite(value)) {
      throw ConfigError(fmt::format("{}.{}", field, name), "must be a positive number");
    }
  };
  check(gains.has_kp(), gains.kp(), "kp");
  check(gains.has_kd(), gains.kd(), "kd");
}

void CheckCom(const ComReference& com, const std::string& field) {
  CheckFinite(com.x(), field + ".x");
  CheckFinite(com.y(), field + ".y");
  CheckFinite(com.z(), field + ".z");
  CheckNotNegative(com.duration(), field + ".duration");
  CheckNotNegative(com.delay(), field + ".delay");
}

void CheckFoot(const Phase& phase, const std::string& field) {
  const FootReference& foot = phase.foot();
  if (!foot.has_foot()) throw ConfigError(field + ".foot", "is missing; name the foot that moves");
  if (phase.support() != SupportOn(Other(foot.foot()))) {
    throw ConfigError(field + ".foot",
                      fmt::format("moves the {0} foot, which is in contact; the phase's support "
                                  "must be {1}",
                                  Name(foot.foot()), Support_Name(SupportOn(Other(foot.foot())))));
  }
  CheckFinite(foot.x(), field + ".x");
  CheckFinite(foot.y(), field + ".y");
  CheckFinite(foot.z(), field + ".z");
  CheckFinite(foot.height_above_support(), field + ".height_above_support");
  CheckNotNegative(foot.duration(), field + ".duration");
  CheckNotNegative(foot.delay(), field + ".delay");
}

void CheckTransition(const TaskControllerConfig& config, int index, const std::string& field) {
  const Phase& phase = config.phase(index);
  const ContactTransition& transition = phase.transition();
  if (!transition.has_kind()) throw ConfigError(field + ".kind", "is missing; UNLOAD or LOAD");
  if (!transition.has_foot()) throw ConfigError(field + ".foot", "is missing; name the foot");
  CheckNotNegative(transition.delay(), field + ".delay");
  CheckNotNegative(transition.duration(), field + ".duration");
  if (phase.support() != DOUBLE) {
    throw ConfigError(field, "needs both feet in contact; the phase's support must be DOUBLE");
  }
  const int foot = transition.foot();
  const Support single = SupportOn(Other(foot));
  if (transition.kind() == ContactTransition::UNLOAD) {
    if (index + 1 >= config.phase_size() || config.phase(index + 1).support() != single) {
      throw ConfigError(field, fmt::format("unloads the {} foot; the next phase's support must be "
                                           "{}",
                                           Name(foot), Support_Name(single)));
    }
  } else if (index == 0 || config.phase(index - 1).support() != single) {
    throw ConfigError(field, fmt::format("loads the {} foot; the phase before must have support {}",
                                         Name(foot), Support_Name(single)));
  }
  // A ramp that a phase cuts short would make a step of the load.
  const double end = phase.start() + transition.delay() + transition.duration();
  if (index + 1 < config.phase_size() && end > config.phase(index + 1).start() + kTimeTolerance) {
    throw ConfigError(field + ".duration",
                      fmt::format("ends at {} s, after the next phase's start at {} s; shorten "
                                  "it or its delay",
                                  end, config.phase(index + 1).start()));
  }
}

void CheckContact(const ContactConfirmation& contact) {
  const auto positive = [](double value, const char* name, const char* unit) {
    if (!(value > 0) || !std::isfinite(value)) {
      throw ConfigError(fmt::format("contact.{}", name),
                        fmt::format("is {}; must be a positive number of {}", value, unit));
    }
  };
  positive(contact.touch_load(), "touch_load", "N");
  positive(contact.release_load(), "release_load", "N");
  positive(contact.press_load(), "press_load", "N");
  positive(contact.search_speed(), "search_speed", "m/s");
  positive(contact.search_depth(), "search_depth", "m");
  positive(contact.retract_height(), "retract_height", "m");
  positive(contact.expected_within(), "expected_within", "m");
  CheckNotNegative(contact.touch_duration(), "contact.touch_duration");
  CheckNotNegative(contact.settle_duration(), "contact.settle_duration");
  if (contact.release_load() >= contact.touch_load()) {
    throw ConfigError("contact.release_load",
                      fmt::format("is {} N; must be below touch_load, {} N, or contact flickers",
                                  contact.release_load(), contact.touch_load()));
  }
  if (contact.press_load() <= contact.touch_load()) {
    throw ConfigError("contact.press_load",
                      fmt::format("is {} N; must be above touch_load, {} N, or the search comes to "
                                  "a stand before contact counts",
                                  contact.press_load(), contact.touch_load()));
  }
}

}  // namespace

void CheckTaskControllerConfig(const TaskControllerConfig& config) {
  CheckGains(config.has_com(), config.com(), "com", "give kp and kd of the COM's position");
  CheckGains(config.has_orientation(), config.orientation(), "orientation",
             "give kp and kd of the body's orientation");
  if (config.has_posture()) CheckGains(true, config.posture(), "posture", "");
  if (!(config.com_lag() > 0) || !std::isfinite(config.com_lag())) {
    throw ConfigError("com_lag", "must be a positive number of m");
  }
  CheckContact(config.contact());
  if (config.phase_size() == 0) throw ConfigError("phase", "is missing; give at least one phase");
  for (int i = 0; i < config.phase_size(); ++i) {
    const Phase& phase = config.phase(i);
    const std::string field = fmt::format("phase[{}]", i);
    if (!phase.has_start()) throw ConfigError(field + ".start", "is missing; give its time in s");
    CheckFinite(phase.start(), field + ".start");
    if (i == 0 && phase.start() != 0) {
      throw ConfigError(field + ".start", "is not 0; the first phase starts the run");
    }
    if (i > 0 && phase.start() <= config.phase(i - 1).start()) {
      throw ConfigError(field + ".start", "is not after the phase before; put phases in order");
    }
    if (i > 0 && phase.support() != DOUBLE && config.phase(i - 1).support() != DOUBLE &&
        phase.support() != config.phase(i - 1).support()) {
      throw ConfigError(field + ".support",
                        "exchanges the stance foot at once; put a DOUBLE phase between");
    }
    if (phase.gravity_compensation() && (phase.has_com() || phase.has_foot())) {
      throw ConfigError(field + ".gravity_compensation",
                        "has no task; remove the phase's com and foot references");
    }
    if (phase.support() != DOUBLE && !phase.gravity_compensation()) {
      CheckGains(config.has_foot(), config.foot(), "foot",
                 "give kp and kd of the pose of the foot out of contact");
    }
    if (phase.support() == DOUBLE && i > 0 && config.phase(i - 1).support() != DOUBLE &&
        config.phase(i - 1).gravity_compensation() && config.contact().required()) {
      throw ConfigError(fmt::format("phase[{}].gravity_compensation", i - 1),
                        "lowers no foot, but the next phase waits for one to touch down; set "
                        "contact.required: false, or a phase with tasks between");
    }
    if (phase.has_com()) CheckCom(phase.com(), field + ".com");
    if (phase.has_foot()) CheckFoot(phase, field + ".foot");
    if (phase.has_transition()) CheckTransition(config, i, field + ".transition");
  }
}

std::array<bool, 2> ContactsOf(Support support) { return {support != LEFT, support != RIGHT}; }

const ScheduleState& PhaseSchedule::Advance(double time, const std::array<bool, 2>& com_over_foot,
                                            const std::array<bool, 2>& foot_confirmed) {
  state_.phase_began = false;
  const int next = state_.phase + 1;
  WaitingFor hindrance = WaitingFor::kNothing;
  if (!began_) {
    began_ = true;
    state_.phase_began = true;
    state_.phase_start = time;
  } else if (next < config_.phase_size() && !(Unloads() && !transition_began_) &&
             time - shift_ >= config_.phase(next).start() - kTimeTolerance) {
    hindrance = Hindrance(com_over_foot, foot_confirmed);
    if (hindrance != WaitingFor::kNothing) {
      shift_ = std::max(shift_, time - config_.phase(next).start());
    } else {
      state_.phase = next;
      state_.phase_began = true;
      state_.phase_start = time;
      transition_began_ = false;
    }
  }
  AdvanceTransition(time, com_over_foot);
  if (hindrance != WaitingFor::kNothing) state_.waiting_for = hindrance;
  return state_;
}

bool PhaseSchedule::BeforeTouchDown() const {
  const int next = state_.phase + 1;
  return phase().support() != DOUBLE && next < config_.phase_size() &&
         config_.phase(next).support() == DOUBLE;
}

bool PhaseSchedule::Unloads() const {
  return phase().has_transition() && phase().transition().kind() == ContactTransition::UNLOAD;
}

WaitingFor PhaseSchedule::Hindrance(const std::array<bool, 2>& com_over_foot,
                                    const std::array<bool, 2>& foot_confirmed) const {
  // The ramp has ended by then: CheckTaskControllerConfig sees to that.
  if (Unloads() && !com_over_foot[static_cast<size_t>(Other(phase().transition().foot()))]) {
    return WaitingFor::kCom;
  }
  if (config_.contact().required() && BeforeTouchDown()) {
    const int foot = phase().support() == RIGHT ? LEFT_FOOT : RIGHT_FOOT;
    if (!foot_confirmed[static_cast<size_t>(foot)]) return WaitingFor::kContact;
  }
  return WaitingFor::kNothing;
}

void PhaseSchedule::AdvanceTransition(double time, const std::array<bool, 2>& com_over_foot) {
  state_.waiting_for = WaitingFor::kNothing;
  state_.transition = TransitionKind::kNone;
  state_.transition_foot = -1;
  state_.progress = 0;
  if (!phase().has_transition()) return;

  const ContactTransition& transition = phase().transition();
  const bool unloading = transition.kind() == ContactTransition::UNLOAD;
  const double due = phase().start() + transition.delay() + shift_;
  if (!transition_began_) {
    const bool is_due = time >= due - kTimeTolerance;
    if (is_due && unloading && !com_over_foot[static_cast<size_t>(Other(transition.foot()))]) {
      state_.waiting_for = WaitingFor::kCom;
      shift_ += time - due;
      return;
    }
    if (is_due) {
      transition_began_ = true;
      transition_start_ = due;
    } else if (unloading) {
      return;
    }
  }
  // A foot that is to be loaded carries nothing from the phase's start until the ramp begins.
  if (transition_began_) {
    const double elapsed = std::max(0.0, time - transition_start_);
    state_.progress = transition.duration() > kTimeTolerance
                          ? std::min(1.0, elapsed / transition.duration() + kTimeTolerance)
                          : 1.0;
  }
  if (!unloading && state_.progress >= 1.0) {
    state_.progress = 0;
    return;
  }
  state_.transition = unloading ? TransitionKind::kUnloading : TransitionKind::kLoading;
  state_.transition_foot = transition.foot();
}

}  // namespace poise
