#include "components/step_planner/phase_graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/suggest.h"

namespace poise {
namespace {

using robot::Foot;

size_t Slot(Outcome outcome, Foot foot) {
  switch (outcome) {
    case DONE:
      return 0;
    case NO_SURFACE:
      return 1;
    case TIMEOUT:
      return 2;
    case CONTACT_LOST:
      break;
  }
  return 3 + Index(foot);
}

std::map<std::string, int> ReadNames(const StepPlannerConfig& config) {
  std::map<std::string, int> index;
  for (int i = 0; i < config.phase_size(); ++i) {
    const std::string& name = config.phase(i).name();
    if (name.empty()) continue;
    const auto [other, fresh] = index.emplace(name, i);
    if (!fresh) {
      throw ConfigError(PhaseField(i) + ".name", fmt::format("'{}' is the name of {}, too", name,
                                                             PhaseField(other->second)));
    }
  }
  return index;
}

int FindPhase(const StepPlannerConfig& config, const std::map<std::string, int>& names,
              const std::string& name, const std::string& field) {
  if (name.empty()) throw ConfigError(field, "is missing; name the phase that follows");
  const auto found = names.find(name);
  if (found != names.end()) return found->second;
  std::vector<std::string> known;
  for (const Phase& phase : config.phase()) {
    if (!phase.name().empty()) known.push_back(phase.name());
  }
  throw ConfigError(field, fmt::format("no phase is called '{}'; {}", name,
                                       known.empty() ? "none has a name" : Suggest(name, known)));
}

}  // namespace

std::string PhaseField(int phase) { return fmt::format("phase[{}]", phase); }

robot::FootArray<bool> ContactsOf(Support support) { return {support != LEFT, support != RIGHT}; }

PhaseGraph::PhaseGraph(const StepPlannerConfig& config) {
  if (config.phase_size() == 0) throw ConfigError("phase", "is missing; give at least one phase");
  Followers none;
  none.fill(kNone);
  follower_.assign(static_cast<size_t>(config.phase_size()), none);
  for (int i = 0; i < size(); ++i) AddArrows(config, i);
  CheckReached(config);
  CheckLoops(config);
}

int PhaseGraph::Follower(int phase, Outcome outcome, Foot foot) const {
  return follower_[static_cast<size_t>(phase)][Slot(outcome, foot)];
}

void PhaseGraph::AddArrows(const StepPlannerConfig& config, int phase) {
  const std::map<std::string, int> names = ReadNames(config);
  const Phase& from = config.phase(phase);
  Followers& followers = follower_[static_cast<size_t>(phase)];
  const auto add = [&](Outcome outcome, Foot foot, int to, int next) {
    int& follower = followers[Slot(outcome, foot)];
    if (follower != kNone) {
      throw ConfigError(fmt::format("{}.next[{}].on", PhaseField(phase), next),
                        fmt::format("names {} a second time", Outcome_Name(outcome)));
    }
    follower = to;
    arrows_.push_back({phase, to, outcome, foot, next});
  };
  for (int k = 0; k < from.next_size(); ++k) {
    const NextPhase& next = from.next(k);
    const std::string field = fmt::format("{}.next[{}]", PhaseField(phase), k);
    const int to = FindPhase(config, names, next.to(), field + ".to");
    if (next.on() == DONE && !from.has_duration()) {
      throw ConfigError(PhaseField(phase) + ".duration",
                        "is missing; without one the phase is never DONE");
    }
    if (next.on() != CONTACT_LOST) {
      if (next.has_foot()) throw ConfigError(field + ".foot", "belongs to CONTACT_LOST; remove it");
      add(next.on(), Foot::kRight, to, k);
      continue;
    }
    for (const Foot foot : robot::kFeet) {
      if (!next.has_foot() || robot::FootAt(next.foot()) == foot) add(CONTACT_LOST, foot, to, k);
    }
  }
  if (!from.has_duration() || followers[Slot(DONE, Foot::kRight)] != kNone) return;
  if (phase + 1 == size()) {
    throw ConfigError(PhaseField(phase) + ".duration",
                      "has no phase after it; remove it, or give next { on: DONE to: ... }");
  }
  add(DONE, Foot::kRight, phase + 1, kNone);
}

void PhaseGraph::CheckReached(const StepPlannerConfig& config) const {
  std::vector<bool> reached(follower_.size(), false);
  std::vector<int> open{0};
  reached[0] = true;
  while (!open.empty()) {
    const int from = open.back();
    open.pop_back();
    for (const int to : follower_[static_cast<size_t>(from)]) {
      if (to == kNone || reached[static_cast<size_t>(to)]) continue;
      reached[static_cast<size_t>(to)] = true;
      open.push_back(to);
    }
  }
  const auto lost = std::find(reached.begin(), reached.end(), false);
  if (lost == reached.end()) return;
  const auto i = static_cast<int>(lost - reached.begin());
  const bool ends = config.phase(i - 1).has_duration();
  throw ConfigError(
      PhaseField(i),
      fmt::format("is never reached: {}", ends ? "no phase leads to it"
                                               : fmt::format("the phase before it, '{}', has no "
                                                             "duration, and no other leads to it",
                                                             config.phase(i - 1).name())));
}

void PhaseGraph::CheckLoops(const StepPlannerConfig& config) const {
  for (int first = 0; first < size(); ++first) {
    int at = first;
    for (int steps = 0; steps < size(); ++steps) {
      const int to = Follower(at, DONE);
      if (to == kNone || config.phase(at).duration() > 0) break;
      at = to;
      if (at == first) {
        throw ConfigError(
            PhaseField(first) + ".duration",
            "is 0 in a loop of phases that take no time; give one of them a duration");
      }
    }
  }
}

}  // namespace poise
