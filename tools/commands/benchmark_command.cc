// `poise benchmark`: how well a controller balances, by a fixed set of disturbances.
#include <cstdio>
#include <filesystem>
#include <optional>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/suggest.h"
#include "fmt/format.h"
#include "tools/benchmark/benchmark_folder.h"
#include "tools/charts/sweep_output.h"
#include "tools/cli/command_line.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_place.h"
#include "tools/cli/temporary_dir.h"
#include "tools/commands/commands.h"
#include "tools/report/html_report.h"
#include "tools/run/run_dir.h"
#include "tools/scenario/ablations.h"
#include "tools/sweep/sweep_session.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

struct BenchmarkArguments {
  std::string set = "balance_4";
  BenchmarkSubject subject;
  std::vector<std::string> parts;  // empty: all
  SessionOptions session;
  bool quick = false;
};

/// What was typed.
std::string CommandLine() {
  const std::vector<std::string> words = Split(ReadFile("/proc/self/cmdline"), '\0');
  std::string command = "poise";
  // The program's path comes first; nothing comes behind the last zero.
  for (size_t i = 1; i + 1 < words.size(); ++i) command += " " + ShellWord(words[i]);
  return command;
}

void CheckParts(const Benchmark& benchmark, const std::vector<std::string>& wanted) {
  const std::vector<std::string> names = NamesOf(benchmark.part());
  for (const std::string& name : wanted) {
    if (IsAmong(name, names)) continue;
    throw ConfigError(fmt::format("--part {}: the set {} has no such part; {}", name,
                                  benchmark.name(), Suggest(name, names)));
  }
}

/// The folder of the results: new, empty, or with --resume that of a benchmark.
fs::path MakeFolder(const BenchmarkArguments& arguments, const std::string& name) {
  const SessionOptions& session = arguments.session;
  if (session.out.empty()) return MakeRunDir("", "benchmark-" + name, false).path();
  if (!session.resume) CheckFolderFree("--out", session.out, session.force);
  const fs::path folder = MakeOutFolder(session.out);
  if (session.force && !session.resume) {
    for (const char* old :
         {"parts", "set", kBenchmarkCsv, kChartsFile, kChartsPage, kBenchmarkJson}) {
      fs::remove_all(folder / old);
    }
  }
  return folder;
}

/// Throws ConfigError where `place` has results of another robot, controller or program.
void CheckSame(const SweepDefinition& definition, const fs::path& place) {
  const std::optional<SweepResults> found = ReadResults(place);
  if (!found) return;
  const SweepHeader header{found->header.kind, definition.sweep(), definition.columns(),
                           definition.digest(), ProgramDigest()};
  const std::string problem = HeaderProblem(header, found->header);
  if (problem.empty()) return;
  throw ConfigError(fmt::format("{}: {}; choose another folder with --out",
                                (place / kResultsFile).string(), problem));
}

int RunBenchmark(const BenchmarkArguments& arguments) {
  const std::string command_line = CommandLine();  // what fails here loses no hour's work
  const BenchmarkSet set(arguments.set, arguments.subject);
  const Benchmark& benchmark = set.benchmark();
  CheckParts(benchmark, arguments.parts);
  std::vector<int> indexes;
  for (int i = 0; i < benchmark.part_size(); ++i) {
    const std::vector<std::string>& wanted = arguments.parts;
    const std::string& name = benchmark.part(i).name();
    if (wanted.empty() || IsAmong(name, wanted)) indexes.push_back(i);
  }
  // All parts are checked before an hour's work begins, and before anything is written.
  {
    const TemporaryDir tried("poise-benchmark");
    set.Write(tried.path());
    for (int i = 0; i < benchmark.part_size(); ++i) {
      const bool wanted = IsAmong(i, indexes);
      const fs::path place = PartFolder(arguments.session.out, benchmark.part(i));
      const bool there = arguments.session.resume && fs::exists(place / kResultsFile);
      if (!wanted && !there) continue;
      const SweepDefinition definition = set.Definition(i, tried.path());
      if (there) CheckSame(definition, place);
    }
  }
  const fs::path folder = MakeFolder(arguments, benchmark.name());
  set.Write(SetFolder(folder));
  std::vector<SweepDefinition> definitions;
  std::vector<BenchmarkPart> parts;
  for (const int i : indexes) {
    definitions.push_back(set.Definition(i, SetFolder(folder)));
    parts.push_back(benchmark.part(i));
  }
  fmt::print("{}: {} ({:.1f} kg, COM at {:.3f} m) in {}{}; {}\n", benchmark.name(),
             set.robot().name, set.robot().mass, set.robot().height, set.engine(),
             arguments.quick ? ", quick" : "", folder.string());
  std::vector<BenchmarkResult> results;
  bool all_ran = true;
  for (size_t i = 0; i < parts.size(); ++i) {
    const bool limit = parts[i].sweep().has_limit();
    SessionOptions options = arguments.session;
    options.out = PartFolder(folder, parts[i]).string();
    SweepSession session(definitions[i], limit ? kKindLimit : kKindSweep, options);
    const std::vector<int64_t> points =
        BenchmarkPoints(parts[i], definitions[i].points().size(), arguments.quick);
    fmt::print("{} of {}, {}: {} points{}\n", i + 1, parts.size(), parts[i].name(), points.size(),
               session.found() > 0 ? fmt::format(", {} runs done before", session.found()) : "");
    std::fflush(stdout);
    if (!(limit ? RunLimits(points, &session) : RunPoints(points, &session))) {
      fmt::print(stderr, "poise: interrupted; the same command with --resume --out {} goes on\n",
                 folder.string());
      return kExitFailed;
    }
    // With --resume more points than these may be there.
    SweepRows rows;
    for (const auto& [key, row] : session.rows()) {
      if (IsAmong(row.run, points)) rows[key] = row;
    }
    WriteSweepFiles(session.folder(), session.header(), rows);
    all_ran = AllRan(rows) && all_ran;
    results.push_back({parts[i], session.header(), std::move(rows)});
  }
  const std::string sha1 = WriteBenchmark(folder, set, results, arguments.quick, command_line);
  fmt::print("\n{}\n", FormatBenchmark(results));
  for (const char* file : {kBenchmarkCsv, kChartsPage, kBenchmarkJson}) {
    fmt::print("{}\n", (folder / file).string());
  }
  fmt::print("{} has the SHA-1 {}\n", kBenchmarkCsv, sha1);
  return all_ran ? kExitOk : kExitFailed;
}

}  // namespace

void AddBenchmarkCommand(CLI::App* app, Command* command) {
  const auto [benchmark, arguments] = AddCommand<BenchmarkArguments>(
      app, command, "benchmark",
      "measure how well a controller balances, by a fixed set of disturbances", RunBenchmark);
  BenchmarkSubject* const subject = &arguments->subject;
  RunChanges* const changes = &subject->changes;
  SessionOptions* const session = &arguments->session;
  benchmark->add_option("benchmark", arguments->set, "of deploy/benchmarks, or a .pbtxt file")
      ->capture_default_str();
  benchmark
      ->add_option("--robot", changes->robot,
                   "a name (poise list robots), a robot's folder or its .pbtxt file")
      ->capture_default_str();
  AddWorld(benchmark, &changes->world, "the graph's");
  CLI::Option* const graph = benchmark->add_option(
      "--graph", subject->graph,
      "the controller's graph (poise list graphs) or a .pbtxt file; default: balance, Poise's own");
  benchmark->add_option(
      "--controller", subject->controller,
      "a scenario's .pbtxt file with nothing but `graph` and the fields of its components");
  benchmark->add_option("--variant", changes->variant, "of the controller's file");
  AddList(benchmark, "--set", &changes->set, "change a field of a component (poise list fields)",
          "FIELD=VALUE");
  AddList(benchmark, "--without", &changes->without, "leave out a part of Poise's controller",
          "PART")
      ->check(CLI::IsMember(RemovableParts()));
  AddDrives(benchmark, &changes->drives)->excludes(graph);
  AddList(benchmark, "--part", &arguments->parts, "only this part of the set, repeatable", "PART");
  benchmark->add_flag("--quick", arguments->quick,
                      "a few of the same points: minutes; --resume without it goes on to all");
  benchmark->add_option("--out", session->out,
                        "folder of the results, new or empty; default: a dated one under runs/");
  AddJobs(benchmark, &session->jobs, "runs at a time");
  CLI::Option* const resume =
      benchmark->add_flag("--resume", session->resume, "go on with the benchmark in --out");
  resume->needs(benchmark->get_option("--out"));
  benchmark->add_flag("--force", session->force, "replace what --out holds")->excludes(resume);
  benchmark->add_flag("--quiet", session->quiet, "no progress");
  benchmark->footer(
      "The controller is any graph of components that speaks Poise's messages: Poise's own, "
      "modules and programs on POISE_PATH; one that has a program of its own runs as processes, in "
      "lockstep. Robot, engine and controller are yours, everything else is the set's. OUT has "
      "benchmark.csv (a row a point; its SHA-1 is the same for one build, as seen on one machine "
      "so far), charts.json and charts.html (table and charts), benchmark.json (what is needed to "
      "repeat it), set/ (what was run) and parts/ (every run). docs/reference/benchmark.md says "
      "what is measured and why.\nExit code: 0 measured, whatever fell; 1 interrupted, or a run "
      "could not be made; 2 wrong usage or configuration.\nExample: poise benchmark --quick --part "
      "push_double");
}

}  // namespace poise
