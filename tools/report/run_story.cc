#include "tools/report/run_story.h"

#include <algorithm>
#include <cmath>

#include "components/messages/conversions.h"
#include "fmt/format.h"
#include "logging/metrics/contact_history.h"
#include "logging/metrics/metrics.h"
#include "logging/metrics/true_contacts.h"
#include "logging/recording/inline_recorder.h"
#include "tools/cli/text_table.h"
#include "tools/report/fall_story.h"
#include "tools/report/step_story.h"

namespace poise {
namespace {

using logging::Event;
using logging::RunRecord;

constexpr size_t kFigures = 3;            // in the second sentence
constexpr size_t kSupports = 5;           // named one by one
constexpr double kFalls = 1;              // s before a fall that belong to it
constexpr double kStands = 0.3;           // s, on both feet after a step
constexpr double kReferenceMoved = 5e-3;  // m, of a reference that is none to stand at

struct Words {
  std::string_view name;
  std::string_view words;  // {} stands for the figure
};

constexpr Words kFigure[] = {
    {"com_error_max_x", "its centre of mass strayed up to {} to the front or back"},
    {"com_error_max_y", "its centre of mass strayed up to {} to the side"},
    {"com_error_true_max_y", "its centre of mass strayed up to {} to the side"},
    {"com_motion_max", "its centre of mass moved by up to {}"},
    {"left_foot_error_max_y", "the left foot strayed up to {} to the side"},
    {"right_foot_error_max_y", "the right foot strayed up to {} to the side"},
    {"balancing_first", "balancing set in at {}"},
    {"balancing_last", "balancing was last on at {}"},
    {"balancing_active", "balancing was on for {}"},
    {"joint_torque_share", "its joints used at most {} of their torque"},
    {"foot_tangential_force_computed_max", "a foot pulled sideways with at most {}"},
    {"foot_yaw_moment_computed_max", "a foot twisted with at most {}"},
    {"torque_step_at_switch", "the torques jumped by at most {} as the support changed"},
    {"torque_step_at_switch_reference", "without the ramp by {}"},
    {"foot_lift_motion_z", "the unloaded foot moved by {}"},
};

std::string Seconds(double time) { return fmt::format("{:.3f} s", time); }

/// "from the right", "from behind and the left", of a force in the robot's frame.
std::string Direction(const Eigen::Vector3d& force) {
  constexpr double kAside = 0.38;  // of the force: within 22 degrees of the other axis
  const double size = force.norm();
  std::vector<std::string> sides;
  if (std::abs(force.x()) > kAside * size) {
    sides.emplace_back(force.x() > 0 ? "behind" : "the front");
  }
  if (std::abs(force.y()) > kAside * size) {
    sides.emplace_back(force.y() > 0 ? "the right" : "the left");
  }
  if (sides.empty()) sides.emplace_back(force.z() > 0 ? "below" : "above");
  return fmt::format("from {}", Joined(sides, " and "));
}

/// "pushed from the right with up to 188.9 N, at 0.404 s"; empty without a push.
std::string Pushes(const RunRecord& run, const std::vector<Event>& events) {
  int count = 0;
  int64_t at = 0;
  double largest = -1;
  for (const Event& event : events) {
    if (event.name != "push_peak") continue;
    ++count;
    const int64_t tick = std::llround(event.time / run.spec.tick_period()) + run.spec.lead_ticks();
    const external_push_t* push = run.push.at(tick);
    if (push == nullptr) continue;
    const double size = GetVector3(push->force).norm();
    if (size > largest) largest = size, at = tick;
  }
  if (largest < 0) return "";
  Eigen::Vector3d force = GetVector3(run.push.at(at)->force);
  if (const robot_state_t* state = run.state.at(at)) {
    const Eigen::Quaterniond body(state->base_orientation[0], state->base_orientation[1],
                                  state->base_orientation[2], state->base_orientation[3]);
    const Eigen::Vector3d ahead = body * Eigen::Vector3d::UnitX();
    const double heading = std::atan2(ahead.y(), ahead.x());
    force = Eigen::AngleAxisd(-heading, Eigen::Vector3d::UnitZ()) * force;
  }
  const std::string push = fmt::format("{} with up to {:.1f} N, at {}", Direction(force), largest,
                                       Seconds(run.time(at)));
  return count == 1 ? fmt::format("pushed {}", push)
                    : fmt::format("pushed {} times, hardest {}", count, push);
}

/// "on both feet", "went from both feet to the left foot and".
struct SupportStory {
  std::string moves;  ///< empty: it never changed
  std::string last;   ///< empty: not known
};

/// What the feet carried: in truth; of a real robot as its controller says, if it does.
SupportStory Supports(const RunRecord& run) {
  std::vector<std::array<bool, 2>> supports;
  if (!run.truth.empty()) {
    // What a falling robot's feet do is the fall.
    const std::optional<int64_t> down = logging::DownTick(run);
    for (const logging::TrueSupport& support : logging::TrueSupports(run)) {
      if (!supports.empty() && down && run.duration(*down - support.tick) < kFalls) break;
      supports.push_back(support.carries);
    }
  } else {
    for (const logging::SupportChange& change : logging::SupportChanges(run)) {
      if (supports.empty()) supports.push_back(change.before);
      supports.push_back(change.after);
    }
    for (int64_t tick = 0; tick < run.num_ticks && supports.empty(); ++tick) {
      const joint_command_t* command = run.command.at(tick);
      if (command == nullptr || command->num_feet < 2) continue;
      supports.push_back({command->in_contact[0] != 0, command->in_contact[1] != 0});
    }
    if (supports.size() == 1 && !supports[0][0] && !supports[0][1]) return {};  // it does not say
  }
  if (supports.empty()) return {};
  const auto name = [&](const std::array<bool, 2>& contacts) {
    const std::string support = logging::SupportName(run, contacts);
    return support == "both feet" || support == "no foot" ? support
                                                          : fmt::format("the {}", support);
  };
  std::string moves;
  if (supports.size() > kSupports) {
    moves = fmt::format("changed its support {} times", supports.size() - 1);
  } else if (supports.size() > 1) {
    moves = fmt::format("went from {}", name(supports[0]));
    for (size_t i = 1; i < supports.size(); ++i) moves += fmt::format(" to {}", name(supports[i]));
  }
  return {moves, name(supports.back())};
}

/// What the simulator says of a fall in brackets: "(body tilt 0.71 rad)".
std::string HowItFell(const RunRecord& run) {
  const std::optional<int64_t> down = logging::DownTick(run);
  if (!down) return "";
  const std::string reason = EndReason(run);
  const size_t fell = reason.find("the robot fell"), begin = reason.find('(');
  const bool told = fell != std::string::npos && begin != std::string::npos;
  if (run.truth.at(*down)->fallen != 0) return told ? fmt::format(" {}", reason.substr(begin)) : "";
  // The simulator went on.
  const auto height = [&](int64_t tick) {
    const ground_truth_t* const truth = run.truth.at(tick);
    return truth == nullptr ? 0 : logging::ComHeight(*truth);
  };
  return fmt::format(
      " (at the end its centre of mass was {:.2f} m above its lower sole, at first {:.2f} m; the "
      "simulator {})",
      height(run.num_ticks - 1), height(run.spec.lead_ticks()),
      told ? fmt::format("says: {}", reason.substr(fell)) : "did not call it fallen");
}

std::string Capital(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] += 'A' - 'a';
  return text;
}

/// The COM was to go somewhere: what its error is of is then said.
bool ComWasMoved(const RunRecord& run) {
  std::array<double, 2> least{}, most{};
  bool known = false;
  for (int64_t tick = run.first_tick; tick < run.num_ticks; ++tick) {
    const support_plan_t* const plan = run.plan.at(tick);
    // In steps, which a centre of pressure leads, the COM has no reference.
    if (plan == nullptr || plan->com_follows != support_plan_t::FOLLOWS_REFERENCE) continue;
    for (size_t i = 0; i < 2; ++i) {
      const double x = plan->com_reference.position[i];
      least[i] = known ? std::min(least[i], x) : x;
      most[i] = known ? std::max(most[i], x) : x;
    }
    known = true;
  }
  return most[0] - least[0] > kReferenceMoved || most[1] - least[1] > kReferenceMoved;
}

std::string Figure(const CheckResult& check, bool moved) {
  const auto words = std::ranges::find(kFigure, check.name, &Words::name);
  const std::string measured = FormatMeasured(check);
  const std::string paper = check.paper.empty() ? "" : fmt::format("paper: {}", check.paper);
  std::string text = words != std::end(kFigure) ? fmt::format(fmt::runtime(words->words), measured)
                                                : fmt::format("{}: {}", check.label, measured);
  if (moved && check.name.starts_with("com_error_")) text += " of its reference";
  return paper.empty() ? text : fmt::format("{} ({})", text, paper);
}

/// True when the bridge followed as the run ended, or nobody says so.
bool BridgeFollows(const RunRecord& run) {
  for (int64_t tick = run.num_ticks - 1; tick >= 0; --tick) {
    const bridge_status_t* const bridge = run.bridge.at(tick);
    if (bridge != nullptr) return bridge->state <= bridge_status_t::STATE_RUNNING;
  }
  return true;
}

/// Tells that the bridge no longer followed though the robot did not fall, as after an emergency
/// stop.
std::string BridgeTrouble(const std::vector<Event>& events) {
  for (const Event& event : events) {
    if (event.name != "bridge_state" || !event.detail.starts_with("running")) continue;
    return fmt::format("; at {} the bridge went from {}", Seconds(event.time), event.detail);
  }
  return "";
}

/// True when a step is on its way as the run ends, or the last has only just come down.
bool WalksAtTheEnd(const RunRecord& run) {
  const std::vector<logging::TrueStep> steps = logging::TrueSteps(run);
  const std::vector<logging::TrueSupport> supports = logging::TrueSupports(run);
  if (steps.empty() || supports.empty()) return false;
  const std::array<bool, 2>& carries = supports.back().carries;
  return !carries[0] || !carries[1] || run.duration(run.num_ticks - steps.back().landed) < kStands;
}

/// Figures beside the paper's; those of any run where the scenario has none.
std::string Figures(const RunRecord& run, const std::vector<CheckResult>& checks) {
  std::vector<std::string> parts;
  const bool stepped = MadeSteps(run), moved = ComWasMoved(run);
  const auto tells = [&](std::string_view name) {
    // While it steps the COM leads its reference: the error is not how far it went.
    return !stepped || !name.starts_with("com_error_");
  };
  for (const CheckResult& check : checks) {
    const bool beside = !check.paper.empty() && check.measured && !check.unit.empty();
    // What was done to the robot is in the first sentence.
    if (!beside || check.name.starts_with("push_") || parts.size() == kFigures ||
        !tells(check.name)) {
      continue;
    }
    parts.push_back(Figure(check, moved));
  }
  if (!parts.empty()) return Capital(Joined(parts, "; ")) + ".";
  for (const char* name :
       {"com_error_max_x", "com_error_max_y", "balancing_active", "joint_torque_share"}) {
    if (!tells(name)) continue;
    const logging::Metric* const metric = logging::FindMetric(name);
    CheckResult figure;
    figure.name = name;
    figure.unit = metric->unit;
    figure.measured = metric->compute(run);
    // Balancing that was never on has no time to tell of.
    const bool nothing = figure.name == "balancing_active" && figure.measured == 0.0;
    if (figure.measured && !nothing && parts.size() < kFigures) {
      parts.push_back(Figure(figure, moved));
    }
  }
  return parts.empty() ? "" : Capital(Joined(parts, "; ")) + ".";
}

}  // namespace

std::string EndReason(const RunRecord& run) {
  std::string reason;
  // Within one process each component tells of the one that ended the run.
  const auto named = [&](const std::string& detail) {
    return std::ranges::any_of(run.spec.graph().component(), [&](const auto& component) {
      return detail.starts_with(component.name() + ": ");
    });
  };
  for (const auto& [component, health] : run.health) {
    if (health.detail.empty() || health.state < health_t::STATE_FINISHED) continue;
    if (reason.empty() || health.state == health_t::STATE_FAILED) {
      reason = health.detail == logging::kEndedByHand || named(health.detail)
                   ? health.detail
                   : fmt::format("{}: {}", component, health.detail);
    }
  }
  return reason;
}

std::string TellRun(const RunRecord& run, const std::vector<CheckResult>& checks,
                    const std::vector<Event>& events, const std::string& end) {
  const auto fall = std::ranges::find(events, std::string("fall"), &Event::name);
  const double planned = run.time(run.spec.num_ticks());
  const double reached = run.time(run.num_ticks);
  const bool early = run.spec.num_ticks() > run.num_ticks;
  const std::string pushes = Pushes(run, events);
  const SupportStory support = Supports(run);
  std::string first = pushes.empty() ? "the robot" : pushes + ", the robot";
  if (!support.moves.empty()) first += fmt::format(" {},", support.moves);
  const std::string and_ = support.moves.empty() ? "" : " and";
  // Whether it fell nobody saw; or it is held up without its motors, or walks on.
  const char* const stood = run.truth.empty()                           ? "ran"
                            : !BridgeFollows(run) || WalksAtTheEnd(run) ? "did not fall"
                                                                        : "stood";
  if (run.spec.has_cut()) {
    const double begin = run.time(run.spec.cut().first_tick());
    return Capital(fmt::format("{} {}. The log is a part of a run: {} to {} of {}.", first,
                               fall != events.end() ? "fell" : stood, Seconds(begin),
                               Seconds(reached), Seconds(planned)));
  }
  if (fall != events.end()) {
    const bool ends = run.spec.num_ticks() > 0;
    first += fmt::format("{} fell at {}{}{}", and_, Seconds(fall->time),
                         ends ? " of " + FormatNumber(planned, "s") : "", HowItFell(run));
    const std::string steps = TellSteps(run);
    return fmt::format("{}. {}{}{}", Capital(first), steps, steps.empty() ? "" : " ",
                       TellFall(run, fall->time, events));
  }
  const std::string reason = end.empty() ? EndReason(run) : end;
  const bool stands = stood == std::string_view("stood") || run.truth.empty();
  const std::string on = stands && support.moves.empty() && !support.last.empty()
                             ? fmt::format(" on {}", support.last)
                             : "";
  if (early) {
    first +=
        fmt::format("{} {}{} until the run ended at {} of {}{}", and_, stood, on, Seconds(reached),
                    FormatNumber(planned, "s"), reason.empty() ? "" : fmt::format(": {}", reason));
  } else {
    first += fmt::format("{} {}{} to the end, {}", and_, stood, on, FormatNumber(reached, "s"));
  }
  first += BridgeTrouble(events);
  const std::string figures = Figures(run, checks);
  std::string text = Capital(first) + ".";
  for (const std::string& more : {TellSteps(run), figures}) {
    if (!more.empty()) text += " " + more;
  }
  return text;
}

}  // namespace poise
