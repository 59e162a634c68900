#include "tools/report/wrench_difference.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "fmt/format.h"
#include "tools/cli/text_table.h"

namespace poise {
namespace {

/// A tick of it; `rms` holds the sum of squares until End.
void Add(const double (&first)[3], const double (&second)[3], double time, VectorDifference* sum) {
  double square = 0;
  for (int i = 0; i < 3; ++i) square += (first[i] - second[i]) * (first[i] - second[i]);
  sum->rms += square;
  if (sum->ticks++ == 0 || std::sqrt(square) > sum->largest) {
    sum->largest = std::sqrt(square);
    sum->time = time;
  }
}

void End(VectorDifference* sum) {
  if (sum->ticks > 0) sum->rms = std::sqrt(sum->rms / static_cast<double>(sum->ticks));
}

}  // namespace

std::array<WrenchDifference, 2> CompareFootWrenches(const logging::RunRecord& first,
                                                    const logging::RunRecord& second) {
  std::array<WrenchDifference, 2> feet;
  for (int64_t tick = 0; tick < first.num_ticks; ++tick) {
    const robot_sensors_t* const a = first.sensors.at(tick);
    const robot_sensors_t* const b = second.sensors.at(second.TickOf(first, tick));
    if (a == nullptr || b == nullptr) continue;
    const size_t count = std::min({feet.size(), a->foot_wrench.size(), b->foot_wrench.size()});
    for (size_t f = 0; f < count; ++f) {
      Add(a->foot_wrench[f].force, b->foot_wrench[f].force, first.time(tick), &feet[f].force);
      Add(a->foot_wrench[f].moment, b->foot_wrench[f].moment, first.time(tick), &feet[f].moment);
    }
  }
  for (WrenchDifference& foot : feet) {
    End(&foot.force);
    End(&foot.moment);
  }
  return feet;
}

std::string FormatWrenchDifferences(const std::array<WrenchDifference, 2>& feet) {
  std::vector<TableRow> rows = {{"measured wrenches, difference", "RMS", "largest", "at"}};
  for (size_t f = 0; f < feet.size(); ++f) {
    for (const bool force : {true, false}) {
      const VectorDifference& one = force ? feet[f].force : feet[f].moment;
      if (one.ticks == 0) continue;
      const char* const unit = force ? "N" : "N·m";
      rows.push_back(
          {fmt::format("{} foot, {}", f == 0 ? "right" : "left", force ? "force" : "moment"),
           fmt::format("{:.3g} {}", one.rms, unit), fmt::format("{:.3g} {}", one.largest, unit),
           fmt::format("{:.3f} s", one.time)});
    }
  }
  return rows.size() == 1 ? "" : FormatColumns(rows);
}

}  // namespace poise
