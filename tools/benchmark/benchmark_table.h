// What a benchmark came to, as figures.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/benchmark/benchmark.pb.h"
#include "tools/sweep/sweep_results.h"

namespace poise {

/// A part's results; rows may lack points.
struct BenchmarkResult {
  BenchmarkPart part;
  SweepHeader header;
  SweepRows rows;
};

/// A line of the results. Empty: not known, or not of this part.
struct BenchmarkFigure {
  std::string point;  ///< "direction 90°"; or the sum's: "mean", "least", "stand, of 12"
  std::string unit;
  std::optional<double> value = {};
  /// What `value` is to what was sought: empty: it, within the tolerance; "at least": all up to the
  /// cap was survived; "below": not even the smallest that was tried.
  std::string bound = {};
  /// A push has N·s, N·s per kg, and its share of both bounds (push_bound.h).
  std::optional<double> impulse = {}, per_mass = {}, of_pendulum = {}, of_duration = {};
  const SweepRow* untold = nullptr;  ///< the run of the point does not tell, and counts for nothing
};

/// A figure a measured point, then the sum of a part: mean and least, or how many stand; then the
/// runs that do not tell. A mean or least is known where every point is. Pointers are into
/// `result`.
std::vector<BenchmarkFigure> BenchmarkFigures(const BenchmarkResult& result);

/// The figures of all parts: part, point, value, unit, bound, those of pushes, and the outcome,
/// component, stage and reason of a run that does not tell. The same rows give the same bytes: its
/// digest tells whether two machines measured the same.
std::string BenchmarkCsv(const std::vector<BenchmarkResult>& results);

/// BenchmarkCsv for people, in aligned columns.
std::string FormatBenchmark(const std::vector<BenchmarkResult>& results);

/// SHA-1 of `text` as 40 hexadecimal digits, as sha1sum prints it.
std::string Sha1(const std::string& text);

}  // namespace poise
