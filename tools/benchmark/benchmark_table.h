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

/// A row a measured point, and for each part one of its sum ("mean", "least", "stand"): part,
/// point, value, unit, and of pushes N·s, N·s per kg, and the share of both bounds (push_bound.h).
/// The same rows give the same bytes: its digest tells whether two machines measured the same.
std::string BenchmarkCsv(const std::vector<BenchmarkResult>& results);

/// The same for people, in aligned columns.
std::string FormatBenchmark(const std::vector<BenchmarkResult>& results);

/// SHA-1 of `text` as 40 hexadecimal digits, as sha1sum prints it.
std::string Sha1(const std::string& text);

}  // namespace poise
