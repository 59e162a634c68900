// A fixed set of disturbances, made ready for one robot and one controller.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/benchmark/benchmark.pb.h"
#include "tools/scenario/scenario_loading.h"
#include "tools/sweep/sweep_definition.h"

namespace poise {

/// Who is measured: what a user may change of a benchmark.
struct BenchmarkSubject {
  std::string graph;  ///< name or file; empty: the controller's file's, or Poise's own
  std::string
      controller;  ///< a scenario's text with `graph` and its components' fields; empty: none
  /// A subject sets robot, world (empty: the graph's engine) and drives, and changes the controller
  /// by set, without and variant. All else stays as it is: the benchmark says it.
  RunChanges changes;

  BenchmarkSubject() { changes.robot = "dyros/dyros_legs"; }
};

/// A robot as it stands at the start, for a set's expressions.
struct BenchmarkRobot {
  std::string name;
  std::string file;                        ///< its text
  std::string maker_file;                  ///< URDF or MJCF
  double mass = 0;                         ///< kg
  double height = 0;                       ///< m, COM above the soles
  double left_x = 0, left_y = 0;           ///< m, world, of the left sole's middle
  double sole_length = 0, sole_width = 0;  ///< m, of the left sole's extent

  std::vector<Constant> constants() const;
};

class BenchmarkSet {
 public:
  /// `name`: of deploy/benchmarks, or a file. Throws RobotError, or ConfigError: no such file, a
  /// base or a change of it that cannot be, a part that is not whole, a controller that changes
  /// what is the benchmark's.
  BenchmarkSet(const std::string& name, const BenchmarkSubject& subject);

  const Benchmark& benchmark() const { return benchmark_; }
  /// The set's text: the same for the same set.
  const std::string& text() const { return text_; }
  const BenchmarkRobot& robot() const { return robot_; }
  const std::string& graph_text() const { return graph_text_; }
  const BenchmarkSubject& subject() const { return subject_; }
  const std::string& engine() const { return engine_; }  ///< that the robot is simulated in

  /// Writes each part's scenario and sweep, and the graph, into `folder`: all that the parts are
  /// run from. Throws ConfigError.
  void Write(const std::filesystem::path& folder) const;
  /// The sweep of part `i`, read from `folder`, where Write left it. Throws as SweepDefinition.
  SweepDefinition Definition(int i, const std::filesystem::path& folder) const;

 private:
  void ReadController();

  Benchmark benchmark_;
  std::string text_;
  BenchmarkSubject subject_;
  BenchmarkRobot robot_;
  Scenario controller_;  // nothing but what is the controller's
  std::string graph_text_;
  std::string engine_;
};

/// Points of a part: all of them, or with `quick` those that --quick takes.
std::vector<int64_t> BenchmarkPoints(const BenchmarkPart& part, int64_t size, bool quick);

}  // namespace poise
