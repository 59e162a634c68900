// The file that keeps a sweep's finished runs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "components/framework/file_descriptor.h"
#include "tools/sweep/sweep.pb.h"
#include "tools/sweep/sweep_run.h"

namespace poise {

inline constexpr char kResultsFile[] = "results.jsonl";

/// What tells one sweep's results from another's: the file's first line.
struct SweepHeader {
  std::string kind;  ///< "sweep" or "limit"
  Sweep sweep;
  std::vector<std::string> columns;
  std::string digest;   ///< SweepDefinition::digest
  std::string program;  ///< ProgramDigest
};

/// Rows by run, and by value of the quantity whose limit is sought.
using SweepRows = std::map<std::pair<int64_t, double>, SweepRow>;

/// A results file as it was found.
struct SweepResults {
  SweepHeader header;
  SweepRows rows;
  uint64_t size = 0;  ///< bytes of whole lines: what comes after was being written at the end
};

/// Reads `folder`'s results; empty when there are none, or not even a whole first line. Throws
/// ConfigError naming the line: unreadable, or a run twice with different results.
std::optional<SweepResults> ReadResults(const std::filesystem::path& folder);

/// Adds `row`; one that is there already must be the same, or one of the two does not tell
/// (SweepRow::survived) and makes room. Throws ConfigError naming `source`.
void AddRow(const SweepRow& row, const std::string& source, SweepRows* rows);

/// Appends rows. A row is on the disk before Append returns.
class SweepResultsWriter {
 public:
  /// `found`: the file's results so far, of the same sweep; empty: begins the file anew. Throws
  /// ConfigError.
  SweepResultsWriter(const std::filesystem::path& folder, const SweepHeader& header,
                     const std::optional<SweepResults>& found);

  /// Throws std::runtime_error: the disk is full, say.
  void Append(const SweepRow& row);

 private:
  void Write(const std::string& line);

  std::string path_;
  FileDescriptor fd_;
};

}  // namespace poise
