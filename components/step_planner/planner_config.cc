#include "components/step_planner/planner_config.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <string>

#include "components/balance/support_polygon.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/tick_time.h"
#include "components/robot/sole.h"
#include "components/step_planner/phase_graph.h"
#include "components/step_planner/walk_config.h"

namespace poise {
namespace {

using robot::Foot;

const char* Name(Foot foot) { return foot == Foot::kRight ? "right" : "left"; }
Support SupportOn(Foot foot) { return foot == Foot::kRight ? RIGHT : LEFT; }

void CheckTurn(const Turn& turn, const std::string& field) {
  const double angle = Eigen::Vector3d(turn.x(), turn.y(), turn.z()).norm();
  if (angle >= EIGEN_PI) {
    throw ConfigError(field,
                      fmt::format("turns by {:.3f} rad; must be less than half a turn", angle));
  }
}

void CheckFoot(const Phase& phase, const std::string& field) {
  const FootReference& foot = phase.foot();
  if (!foot.has_foot()) throw ConfigError(field + ".foot", "is missing; name the foot that moves");
  const Foot moves = robot::FootAt(foot.foot());
  if (phase.support() != SupportOn(Other(moves))) {
    throw ConfigError(field + ".foot",
                      fmt::format("moves the {0} foot, which is in contact; the phase's support "
                                  "must be {1}",
                                  Name(moves), Support_Name(SupportOn(Other(moves)))));
  }
  if (foot.has_turn()) CheckTurn(foot.turn(), field + ".turn");
}

void CheckRamp(const Phase& phase, const std::string& field) {
  const ContactTransition& transition = phase.transition();
  if (!transition.has_kind()) throw ConfigError(field + ".kind", "is missing; UNLOAD or LOAD");
  if (!transition.has_foot()) throw ConfigError(field + ".foot", "is missing; name the foot");
  if (phase.support() != DOUBLE) {
    throw ConfigError(field, "needs both feet in contact; the phase's support must be DOUBLE");
  }
  // A ramp that a phase cuts short would make a step of the load.
  const double end = transition.delay() + transition.duration();
  if (phase.has_duration() && end > phase.duration() + kTimeTolerance) {
    throw ConfigError(field + ".duration",
                      fmt::format("ends {} s after the phase's start, which lasts {} s; shorten it "
                                  "or its delay",
                                  end, phase.duration()));
  }
}

/// What lies before and behind a phase's ramp.
void CheckTransition(const StepPlannerConfig& config, const PhaseGraph& graph, int index) {
  const std::string field = PhaseField(index) + ".transition";
  const ContactTransition& transition = config.phase(index).transition();
  const Foot foot = robot::FootAt(transition.foot());
  const Support single = SupportOn(Other(foot));
  if (transition.kind() == ContactTransition::UNLOAD) {
    const int next = graph.Follower(index, DONE);
    if (next == PhaseGraph::kNone || config.phase(next).support() != single) {
      throw ConfigError(field, fmt::format("unloads the {} foot; the next phase's support must be "
                                           "{}",
                                           Name(foot), Support_Name(single)));
    }
    return;
  }
  bool entered = index != 0;
  for (const PhaseGraph::Arrow& arrow : graph.arrows()) {
    if (arrow.to == index && config.phase(arrow.from).support() != single) entered = false;
  }
  if (!entered) {
    throw ConfigError(field, fmt::format("loads the {} foot; the phase before must have support {}",
                                         Name(foot), Support_Name(single)));
  }
}

/// True when the phase may have to wait for something that does not come.
bool Waits(const StepPlannerConfig& config, const PhaseGraph& graph, int index) {
  const Phase& phase = config.phase(index);
  const int next = graph.Follower(index, DONE);
  const bool unloads =
      phase.has_transition() && phase.transition().kind() == ContactTransition::UNLOAD;
  const bool touches = phase.support() != DOUBLE && next != PhaseGraph::kNone &&
                       config.phase(next).support() == DOUBLE;
  return unloads || touches;
}

void CheckTimeout(const StepPlannerConfig& config, const PhaseGraph& graph, int index) {
  const Phase& phase = config.phase(index);
  const bool follows = graph.Follower(index, TIMEOUT) != PhaseGraph::kNone;
  const std::string field = PhaseField(index) + ".timeout";
  if (!phase.has_timeout()) {
    if (follows) throw ConfigError(field, "is missing; give the s that the phase may be held back");
    return;
  }
  if (!follows) throw ConfigError(field, "leads nowhere; give next { on: TIMEOUT to: ... }");
  if (!Waits(config, graph, index)) {
    throw ConfigError(field, "never comes: the phase waits for nothing");
  }
}

/// An arrow may not do to the feet what no robot can.
void CheckArrow(const StepPlannerConfig& config, const PhaseGraph& graph,
                const PhaseGraph::Arrow& arrow) {
  const Phase &from = config.phase(arrow.from), &to = config.phase(arrow.to);
  const std::string next = fmt::format("{}.next[{}]", PhaseField(arrow.from), arrow.next);
  const bool listed = arrow.next == PhaseGraph::kNone;
  if (from.support() != DOUBLE && to.support() != DOUBLE && from.support() != to.support()) {
    throw ConfigError(listed ? PhaseField(arrow.to) + ".support" : next + ".to",
                      "exchanges the stance foot at once; put a DOUBLE phase between");
  }
  if (from.support() != DOUBLE && to.support() == DOUBLE) {
    if (from.gravity_compensation()) {
      throw ConfigError(PhaseField(arrow.from) + ".gravity_compensation",
                        "lowers no foot, but the next phase waits for one to touch down; put a "
                        "phase with tasks between");
    }
    if (arrow.outcome != DONE) {
      throw ConfigError(next + ".to", fmt::format("stands on both feet, but after {} no contact "
                                                  "is confirmed; only DONE waits for it",
                                                  Outcome_Name(arrow.outcome)));
    }
  }
  if (arrow.outcome == NO_SURFACE) {
    const int done = graph.Follower(arrow.from, DONE);
    const bool lowers = from.support() != DOUBLE && done != PhaseGraph::kNone &&
                        config.phase(done).support() == DOUBLE;
    if (!lowers) {
      throw ConfigError(next + ".on",
                        "NO_SURFACE never comes: the phase lowers no foot, as it is "
                        "not followed by a DOUBLE one");
    }
  }
  const bool lifts = from.support() == DOUBLE && to.support() != DOUBLE;
  if (arrow.outcome == CONTACT_LOST && lifts && to.support() == SupportOn(arrow.foot)) {
    throw ConfigError(next + ".foot",
                      fmt::format("must be {}: the phase that follows stands on the other one",
                                  FootName_Name(static_cast<FootName>(Other(arrow.foot)))));
  }
}

// m, the paper's distance of the limits from the edges of its sole: estimate and soft ground may be
// off by as much.
constexpr double kLengthMargin = 0.03, kWidthMargin = 0.025;

// Share of touch_load at which a search comes to a stand: above a touch by a reserve, below what
// tips the robot.
constexpr double kStandstillShare = 2;

}  // namespace

balance::ConvexPolygon StanceSole(const robot::FootModel& foot) {
  if (!foot.rectangular()) {
    return balance::SolePolygon(foot, std::min(kWidthMargin, 0.5 * robot::InnerRadius(foot)));
  }
  const auto half = [](double size, double reserve) {
    return std::max(0.5 * size - reserve, 0.25 * size);
  };
  return balance::Rectangle({half(foot.length, kLengthMargin), half(foot.width, kWidthMargin)});
}

LandingSpec MakeLandingSpec(const ContactConfirmation& config) {
  LandingSpec spec;
  spec.touch_load = config.touch_load();
  spec.release_load = ReleaseLoad(config);
  spec.press_load = kStandstillShare * config.touch_load();
  spec.search_depth = config.search_depth();
  return spec;
}

void CheckStepPlannerConfig(const StepPlannerConfig& config) {
  CheckWalkConfig(config.walk());
  for (int i = 0; i < config.phase_size(); ++i) {
    const Phase& phase = config.phase(i);
    if (phase.gravity_compensation() && (phase.has_com() || phase.has_foot() || phase.has_body())) {
      throw ConfigError(PhaseField(i) + ".gravity_compensation",
                        "has no task; remove the phase's com, foot and body references");
    }
    if (phase.has_body()) CheckTurn(phase.body(), PhaseField(i) + ".body");
    if (phase.has_foot()) CheckFoot(phase, PhaseField(i) + ".foot");
    if (phase.has_transition()) CheckRamp(phase, PhaseField(i) + ".transition");
  }
  const PhaseGraph graph(config);
  for (const PhaseGraph::Arrow& arrow : graph.arrows()) CheckArrow(config, graph, arrow);
  for (int i = 0; i < config.phase_size(); ++i) {
    if (config.phase(i).has_transition()) CheckTransition(config, graph, i);
    CheckTimeout(config, graph, i);
  }
}

}  // namespace poise
