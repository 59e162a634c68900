// The folder that a benchmark leaves: what it came to, and all that is needed to repeat it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/benchmark/benchmark_set.h"
#include "tools/benchmark/benchmark_table.h"

namespace poise {

inline constexpr char kBenchmarkCsv[] = "benchmark.csv";
inline constexpr char kBenchmarkJson[] = "benchmark.json";

/// Where the parts are run from, and where each leaves its runs.
std::filesystem::path SetFolder(const std::filesystem::path& folder);
std::filesystem::path PartFolder(const std::filesystem::path& folder, const BenchmarkPart& part);

/// Writes benchmark.csv, benchmark.json (set, program, libraries, robot, controller and results,
/// each with a hash; `command`: as it was typed), charts.json and charts.html of all parts. Returns
/// the SHA-1 of benchmark.csv. Throws ConfigError.
std::string WriteBenchmark(const std::filesystem::path& folder, const BenchmarkSet& set,
                           const std::vector<BenchmarkResult>& results, bool quick,
                           const std::string& command);

}  // namespace poise
