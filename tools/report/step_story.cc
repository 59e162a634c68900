#include "tools/report/step_story.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "fmt/format.h"
#include "logging/metrics/analysis.h"
#include "logging/metrics/contact_history.h"
#include "logging/metrics/metrics.h"
#include "logging/metrics/planner_steps.h"
#include "logging/metrics/true_contacts.h"
#include "tools/cli/text_table.h"

namespace poise {
namespace {

using logging::kMilli;
using logging::PlannerStep;

constexpr double kToppling = 0.5;  // s in which a robot goes from its last support to the ground
constexpr size_t kStepsTold = 2;   // steps that are told one by one

std::optional<double> Figure(const logging::RunRecord& run, const char* metric) {
  return logging::FindMetric(metric)->compute(run);
}

bool IsOfWalk(const PlannerStep& step) { return step.reason == planner_status_t::REASON_WALK; }

/// The last step of a walk in which the robot falls may not land.
bool IsWalked(const PlannerStep& step) { return IsOfWalk(step) && step.landing; }

/// "The left foot stepped 281 mm, decided at 0.442 s (why) and down at 0.746 s, 1 mm from its
/// foothold."
std::string TellStep(const logging::RunRecord& run, const PlannerStep& step) {
  const auto seconds = [&](int64_t tick) { return fmt::format("{:.3f} s", run.time(tick)); };
  const std::string why =
      fmt::format("The {} was told to step at {} ({})", logging::FootName(run, step.foot),
                  seconds(step.begin), logging::StepReason(step.reason));
  if (!step.landing) return fmt::format("{}; it did not come down.", why);
  return fmt::format("{} and came down at {}, {:.0f} mm on, {:.0f} mm from its foothold.", why,
                     seconds(*step.landing), kMilli * (step.landed - step.from).norm(),
                     kMilli * (step.landed - step.foothold).norm());
}

std::string TellWalk(const logging::RunRecord& run, std::ptrdiff_t steps) {
  const std::optional<double> way = Figure(run, "walk_way");
  std::string text =
      fmt::format("It {} {} step{}", way ? "walked" : "made", steps, steps == 1 ? "" : "s");
  const std::optional<double> fastest = Figure(run, "walk_speed_max");
  const std::optional<double> error = Figure(run, "walk_velocity_error_rms");
  if (way) text += fmt::format(", a way of {} between touch-downs", FormatNumber(*way, "m"));
  if (fastest) text += fmt::format(", at up to {}", FormatNumber(*fastest, "m/s"));
  if (error) {
    text += fmt::format(" and {} off the commanded velocity (of two steps each; RMS)",
                        FormatNumber(*error, "mm/s"));
  }
  return text + ".";
}

/// Steps that no planner planned: of a controller that moves its feet by itself. A foot that comes
/// off as the robot topples makes none.
std::ptrdiff_t UnplannedSteps(const logging::RunRecord& run) {
  const std::optional<int64_t> down = logging::DownTick(run);
  return std::ranges::count_if(logging::TrueSteps(run), [&](const logging::TrueStep& step) {
    if (down && static_cast<double>(*down - step.landed) * run.spec.tick_period() < kToppling) {
      return false;
    }
    const support_plan_t* const plan = run.plan.at((step.lifted + step.landed) / 2);
    return plan == nullptr || plan->in_contact[step.foot] != 0;
  });
}

}  // namespace

bool MadeSteps(const logging::RunRecord& run) {
  return !logging::PlannerSteps(run).empty() || UnplannedSteps(run) > 0;
}

std::string TellSteps(const logging::RunRecord& run) {
  const std::vector<PlannerStep> steps = logging::PlannerSteps(run);
  if (steps.empty()) {
    const std::ptrdiff_t made = UnplannedSteps(run);
    return made == 0 ? "" : TellWalk(run, made);
  }
  std::vector<std::string> sentences;
  const bool stood = !run.truth.empty() && logging::TrueSteps(run).empty();
  const auto walked = stood ? 0 : std::ranges::count_if(steps, IsWalked);
  if (walked > 0) sentences.push_back(TellWalk(run, walked));
  size_t told = 0;
  for (const PlannerStep& step : steps) {
    if (IsOfWalk(step)) continue;
    if (++told <= kStepsTold) sentences.push_back(TellStep(run, step));
  }
  if (told > kStepsTold) {
    sentences.push_back(fmt::format("{} more step{} followed.", told - kStepsTold,
                                    told == kStepsTold + 1 ? "" : "s"));
  }
  if (walked == 0) {
    if (const std::optional<double> motion = Figure(run, "com_motion_max")) {
      sentences.push_back(
          fmt::format("Its centre of mass moved by up to {}.", FormatNumber(*motion, "mm")));
    }
  }
  return Joined(sentences, " ");
}

}  // namespace poise
