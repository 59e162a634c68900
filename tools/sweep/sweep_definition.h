// From a sweep's file and the command line to runs that can be made.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/scenario/scenario_loading.h"
#include "tools/sweep/sweep.pb.h"
#include "tools/sweep/sweep_points.h"

namespace poise {

/// What the command line says of a sweep; it comes after what the file says.
struct SweepArguments {
  std::string what;                     ///< sweep or scenario: a name, or a .pbtxt file
  std::vector<std::string> vary;        ///< NAME=FROM:TO[:STEPS][:FLAG...] or NAME=VALUE,VALUE,...
  std::vector<std::string> expression;  ///< FIELD=EXPRESSION
  std::vector<std::string> column;
  std::optional<int64_t> random;
  std::optional<uint64_t> seed;    ///< of what is drawn
  RunChanges changes;              ///< of every run: variant, without, ideal, set, duration
  std::optional<Limit> limit;      ///< poise limit alone: fields that are given replace the file's
  std::vector<Constant> constant;  ///< after the file's
};

/// A sweep that has been checked as far as can be without running it.
class SweepDefinition {
 public:
  /// `limit`: for poise limit. Throws ConfigError or RobotError: "file:line: field: problem", or
  /// the flag; the first run's configuration is checked whole, all its components included.
  SweepDefinition(const SweepArguments& arguments, bool limit);

  const SweepPoints& points() const { return points_; }
  const Sweep& sweep() const { return points_.sweep(); }
  const std::string& name() const { return sweep().name(); }
  const std::string& scenario() const { return scenario_; }  ///< name or file, for LoadScenario
  /// Metrics of the table, by name.
  const std::vector<std::string>& columns() const { return columns_; }
  /// Metrics whose limits a run that stands must keep (Sweep.require).
  std::vector<std::string> required() const {
    return {sweep().require().begin(), sweep().require().end()};
  }
  /// What one run changes. Throws ConfigError.
  RunChanges ChangesOf(int64_t run, const std::optional<double>& limit) const;
  /// A digest of all that a run's figures depend on but the program: the same for the same sweep of
  /// the same scenario, robot and graph, wherever their files are.
  const std::string& digest() const { return digest_; }
  /// Bytes that the first run's log takes (ExpectedLogSize).
  int64_t log_size() const { return log_size_; }
  /// What is odd about the first run (MakeRunSpec).
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  struct Source;
  /// Checks of every field that varies, by itself, that the scenario has it and takes its value.
  void CheckFields(const Source& source, Scenario scenario,
                   const std::optional<double>& limit) const;
  void SetColumns(const Source& source, const Scenario& scenario);
  void CheckRequired(const Source& source, const Scenario& scenario) const;
  void CheckMaps(const Source& source) const;

  SweepPoints points_;
  std::string scenario_;
  RunChanges changes_;
  std::vector<std::string> columns_;
  std::string digest_;
  int64_t log_size_ = 0;
  std::vector<std::string> warnings_;
};

/// A digest of this program's file, Poise's library, the modules with the libraries they bring, the
/// programs of POISE_PATH, and the system's libraries' versions. What a program reads besides, such
/// as a policy's weights, is not part of it.
std::string ProgramDigest();

}  // namespace poise
