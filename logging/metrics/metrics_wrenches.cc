#include <algorithm>
#include <cmath>
#include <vector>

#include "components/messages/conversions.h"
#include "fmt/format.h"
#include "logging/metrics/metric_groups.h"

namespace poise::logging {
namespace {

/// Root of the mean square of measured less computed wrenches of `feet`, `square` of each.
template <class Square>
Compute WrenchErrorRms(std::vector<size_t> feet, Square square) {
  return [=](const RunRecord& run) {
    Mean squares;
    for (int64_t t = run.first_tick; t < run.num_ticks; ++t) {
      for (const size_t foot : feet) {
        if (const auto e = WrenchError(run, foot, t)) squares.Add(square(*e));
      }
    }
    return squares.Root();
  };
}

/// The force errors of both feet in the world's axes, and the ratio they were computed for.
struct ForceErrors {
  Eigen::Vector3d right, left;
  double eta;
};

std::optional<ForceErrors> BothForceErrors(const RunRecord& run, int64_t tick) {
  const auto right = WrenchError(run, 0, tick), left = WrenchError(run, 1, tick);
  const planner_status_t* const planner = run.planner.at(tick - 1);
  if (!right || !left || planner == nullptr) return {};
  return ForceErrors{GetPose(planner->foot_pose[0]).linear() * right->head<3>(),
                     GetPose(planner->foot_pose[1]).linear() * left->head<3>(),
                     run.command.at(tick - 1)->eta};
}

/// With e = measured less computed and E = e_r + e_l: e_r = eta E + i, e_l = (1 - eta) E - i.
void AddInternalError(MetricList* list) {
  const auto add = [&](const char* name, const char* text, auto square) {
    list->Add(name, "N", text, [square](const RunRecord& run) {
      Mean squares;
      for (int64_t t = run.first_tick; t < run.num_ticks; ++t) {
        if (const auto e = BothForceErrors(run, t)) squares.Add(square(*e));
      }
      return squares.Root();
    });
  };
  add("foot_force_error_internal_rms",
      "the same while on both feet, of the part with opposite signs that moves nothing, RMS",
      [](const ForceErrors& e) { return ((1 - e.eta) * e.right - e.eta * e.left).squaredNorm(); });
  add("foot_force_error_resultant_rms",
      "the same while on both feet, of a foot's share of the resultant's error, RMS",
      [](const ForceErrors& e) {
        return 0.5 * (e.eta * e.eta + (1 - e.eta) * (1 - e.eta)) * (e.right + e.left).squaredNorm();
      });
}

void AddWrenchErrors(MetricList* list) {
  using W = balance::Vector6d;
  list->Add("foot_force_error_rms", "N", "measured less computed foot force, RMS",
            WrenchErrorRms({0, 1}, [](const W& e) { return e.head<3>().squaredNorm(); }));
  list->Add("foot_moment_error_rms", "N·m", "measured less computed foot moment, RMS",
            WrenchErrorRms({0, 1}, [](const W& e) { return e.tail<3>().squaredNorm(); }));
  AddInternalError(list);
  const auto add = [&](const char* name, const char* unit, const char* text, auto square) {
    for (size_t foot = 0; foot < 2; ++foot) {
      list->Add(fmt::format("{}_foot_{}_error_rms", kFoot[foot], name), unit,
                fmt::format("measured less computed {} of the {} foot, RMS", text, kFoot[foot]),
                WrenchErrorRms({foot}, square));
    }
  };
  add("force_z", "N", "F_z", [](const W& e) { return e[2] * e[2]; });
  add("force_xy", "N", "(F_x, F_y)", [](const W& e) { return e.head<2>().squaredNorm(); });
  add("moment_xy", "N·m", "(M_x, M_y)", [](const W& e) { return e.segment<2>(3).squaredNorm(); });
  add("moment_z", "N·m", "M_z", [](const W& e) { return e[5] * e[5]; });
}

/// N, 0 - F_z (never minus zero) of a foot in contact: computed at a tick, or read there for the
/// command before.
void AddFootLoads(MetricList* list) {
  for (size_t foot = 0; foot < 2; ++foot) {
    for (const bool measured : {false, true}) {
      const char* kind = measured ? "measured" : "computed";
      const auto load = [foot, measured](const RunRecord& run, int64_t tick) -> Answer {
        auto wrench = ComputedWrench(run, foot, measured ? tick - 1 : tick);
        if (wrench && measured) wrench = KnownWrench(run, foot, tick);
        return wrench ? Answer(0.0 - (*wrench)[2]) : Answer();
      };
      list->Add(fmt::format("{}_foot_load_{}_min", kFoot[foot], kind), "N",
                fmt::format("smallest {} load of the {} foot in contact", kind, kFoot[foot]),
                Smallest(load));
      list->Add(fmt::format("{}_foot_load_{}_max", kFoot[foot], kind), "N",
                fmt::format("largest {} load of the {} foot in contact", kind, kFoot[foot]),
                Largest(load));
    }
  }
}

void AddTangential(MetricList* list) {
  const auto add = [&](const char* name, const char* unit, const char* text, auto size) {
    list->Add(name, unit, text, Largest([size](const RunRecord& run, int64_t t) {
                Answer largest;
                for (size_t foot = 0; foot < 2; ++foot) {
                  const auto wrench = ComputedWrench(run, foot, t);
                  if (wrench) largest = std::max(largest, Answer(size(*wrench)));
                }
                return largest;
              }));
  };
  add("foot_tangential_force_computed_max", "N", "largest computed (F_x, F_y) of a foot",
      [](const Wrench& w) { return std::hypot(w[0], w[1]); });
  add("foot_yaw_moment_computed_max", "N·m", "largest computed M_z of a foot",
      [](const Wrench& w) { return std::abs(w[5]); });
}

void AddRatio(MetricList* list) {
  list->Add("eta_infeasible_ticks", "", "ticks in which no ratio eta met all conditions",
            TicksOf(Of(&RunRecord::command, RatioIsInfeasible)));
  const auto eta = Of(&RunRecord::command, [](const auto& command) {
    return TellsRatio(command) ? Answer(command.eta) : Answer();
  });
  list->Add("eta_lowest", "", "smallest ratio eta, (61)", Smallest(eta));
  list->Add("eta_highest", "", "largest ratio eta, (61)", Largest(eta));
  const auto on_both = Of(&RunRecord::command, [](const auto& command) {
    const bool both = command.in_contact[0] != 0 && command.in_contact[1] != 0;
    return both && TellsRatio(command) ? Answer(command.eta) : Answer();
  });
  list->Add("eta_span", "", "largest less smallest ratio eta while on both feet",
            [lowest = Smallest(on_both), highest = Largest(on_both)](const RunRecord& run) {
              const Answer low = lowest(run), high = highest(run);
              return low && high ? Answer(*high - *low) : Answer();
            });
}

}  // namespace

void AddWrenches(MetricList* list) {
  list->Add("violated_ticks", "", "ticks in which a computed wrench breaks a condition",
            TicksOf(Violated));
  AddRatio(list);
  constexpr const char* kMargin[] = {"normal", "friction", "yaw", "roll", "pitch"};
  for (size_t foot = 0; foot < 2; ++foot) {
    for (size_t margin = 0; margin < 5; ++margin) {
      list->Add(fmt::format("{}_foot_{}_margin", kFoot[foot], kMargin[margin]),
                margin < 2 ? "N" : "N·m",
                fmt::format("smallest margin of the {} foot's computed wrench, ({})", kFoot[foot],
                            29 + margin),
                Smallest([foot, margin](const RunRecord& run, int64_t t) {
                  return FootMargin(run, foot, margin, t);
                }));
    }
  }
  AddWrenchErrors(list);
  AddFootLoads(list);
  AddTangential(list);
}

}  // namespace poise::logging
