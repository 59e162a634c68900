// `poise matrix`: experiments with and without each part of the controller.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <set>
#include <thread>

#include "components/framework/clock.h"
#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/cli/child_process.h"
#include "tools/cli/command_line.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_place.h"
#include "tools/cli/output_style.h"
#include "tools/cli/progress.h"
#include "tools/cli/signals.h"
#include "tools/commands/commands.h"
#include "tools/report/html_report.h"
#include "tools/report/matrix_table.h"
#include "tools/run/run_dir.h"
#include "tools/run/several_runs.h"
#include "tools/scenario/ablations.h"
#include "tools/scenario/run_setup.h"
#include "tools/sweep/sweep_session.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr auto kPoll = std::chrono::milliseconds(20);
constexpr int64_t kMatrixStopPatience = 3'000'000'000;  // ns between SIGTERM and SIGKILL

struct MatrixOptions {
  std::vector<std::string> scenarios = {kAllScenarios};
  std::vector<std::string> ablations;
  std::string world;  ///< see RunChanges
  std::string out;
  bool force = false;
  int jobs = 1;
};

struct Job {
  MatrixCell cell;
  std::vector<std::string> arguments;  ///< of `poise run`, the folder aside
  double work = 0;                     ///< s to be simulated
  int64_t log_size = 0;                ///< bytes, expected
  std::unique_ptr<ChildProcess> process;
  bool done = false;
};

/// Checks a cell's configuration. Throws ConfigError.
Job MakeJob(const std::string& scenario, const std::string& unique_name, const std::string& variant,
            const Ablation& ablation, const std::string& world) {
  RunChanges changes;
  changes.world = world;
  changes.variant = variant;
  changes.ideal = ablation.ideal;
  changes.without = ablation.without;
  const RunSetup setup = SetUpRun(scenario, changes);
  const LoadedScenario& loaded = setup.loaded;
  Job job;
  job.cell.scenario = unique_name;
  job.cell.description = loaded.scenario.description();
  job.cell.paper_section = loaded.scenario.paper_section();
  job.cell.variant = variant;
  job.cell.ablation = ablation.name;
  const bool own_checks = loaded.variant() == nullptr || loaded.variant()->check_size() > 0;
  job.cell.must_pass = own_checks && ablation.flags().empty();
  job.arguments = {"run", scenario, "--inline", "--quiet"};
  if (!variant.empty()) job.arguments.insert(job.arguments.end(), {"--variant", variant});
  if (!world.empty()) job.arguments.insert(job.arguments.end(), {"--world", world});
  for (const std::string& flag : ablation.flags()) job.arguments.push_back(flag);
  job.cell.folder = fmt::format("{}/{}", unique_name, variant.empty() ? ablation.name : variant);
  job.cell.command = "poise";
  for (const std::string& word : job.arguments) {
    if (word != "--quiet") job.cell.command += " " + ShellWord(word);
  }
  job.log_size = ExpectedLogSize(setup.spec) * (loaded.scenario.has_reference() ? 2 : 1);
  job.work = loaded.scenario.duration() * (loaded.scenario.has_reference() ? 2 : 1);
  return job;
}

/// Scenario by scenario: the ablations, then the variants as they are.
std::vector<Job> MakeJobs(const MatrixOptions& options) {
  const std::vector<std::string>& wanted = options.ablations;
  std::vector<Job> jobs;
  std::set<std::string> taken;
  for (const std::string& scenario : ExpandScenarios(options.scenarios)) {
    const LoadedScenario loaded = LoadScenario(scenario, {});
    const std::string name = UniqueName(NameOf(loaded), &taken);
    std::set<std::string> columns;
    for (const Ablation& ablation : Ablations()) {
      columns.insert(ablation.name);
      if (wanted.empty() || IsAmong(ablation.name, wanted)) {
        jobs.push_back(MakeJob(scenario, name, "", ablation, options.world));
      }
    }
    for (const Variant& variant : loaded.scenario.variant()) {
      jobs.push_back(MakeJob(scenario, name, variant.name(), Ablations().front(), options.world));
      jobs.back().cell.folder = fmt::format("{}/{}", name, UniqueName(variant.name(), &columns));
    }
  }
  return jobs;
}

void StartJob(const std::string& program, const fs::path& folder, Job* job) {
  const fs::path dir = folder / job->cell.folder;
  fs::create_directories(dir.parent_path());
  // An earlier matrix wrote it, and a run that cannot start would leave it.
  if (fs::exists(dir / "summary.json")) fs::remove(dir / "summary.json");
  std::vector<std::string> command = {program};
  command.insert(command.end(), job->arguments.begin(), job->arguments.end());
  command.insert(command.end(), {"--force", "--out", dir.string()});
  job->process = std::make_unique<ChildProcess>(job->cell.folder, command, dir.string() + ".log");
}

void FinishJob(const fs::path& folder, Job* job) {
  job->done = true;
  try {
    ReadCellSummary(folder / job->cell.folder / "summary.json", &job->cell);
  } catch (const std::exception&) {
    // Whatever it says of the missing summary, the process's own words say why.
    std::string problem = job->process->HowItEnded();
    for (const std::string& line : LastLines(job->process->log_path(), 1)) problem += ": " + line;
    job->cell.problem = problem;
  }
  job->process.reset();
}

/// Ends the running ones and removes what they have written.
void StopJobs(const fs::path& folder, std::vector<Job>* jobs) {
  for (Job& job : *jobs) {
    if (job.process && job.process->ended()) FinishJob(folder, &job);
    if (job.process) job.process->Signal(SIGTERM);
  }
  const int64_t deadline = NowNanoseconds() + kMatrixStopPatience;
  const auto running = [](const Job& job) { return job.process && !job.process->ended(); };
  while (std::any_of(jobs->begin(), jobs->end(), running) && NowNanoseconds() < deadline) {
    std::this_thread::sleep_for(kPoll);
  }
  std::error_code error;
  for (Job& job : *jobs) {
    if (!job.process) continue;
    job.process.reset();
    fs::remove_all(folder / job.cell.folder, error);
    fs::remove((folder / job.cell.folder).string() + ".log", error);
  }
}

/// False when a signal ended it.
bool RunJobs(const fs::path& folder, int at_once, std::vector<Job>* jobs) {
  const std::string program = fs::read_symlink("/proc/self/exe").string();
  double work = 0;
  for (const Job& job : *jobs) work += job.work;
  StatusLine status(/*quiet=*/false);
  const int64_t start = NowNanoseconds();
  while (true) {
    int running = 0;
    size_t done = 0;
    double work_done = 0;
    bool waiting = false;
    for (Job& job : *jobs) {
      if (job.process && job.process->ended()) FinishJob(folder, &job);
      if (!job.done && !job.process) {
        if (running < at_once && StopSignal() == 0) {
          StartJob(program, folder, &job);
        } else {
          waiting = true;
        }
      }
      if (job.process) ++running;
      if (job.done) ++done, work_done += job.work;
    }
    if (StopSignal() != 0) {
      status.Clear();
      StopJobs(folder, jobs);
      return false;
    }
    if (running == 0 && !waiting) break;
    const double wall = static_cast<double>(NowNanoseconds() - start) * 1e-9;
    if (status.Due(wall)) {
      const std::string left = work_done > 0 ? fmt::format(", about {:.0f} s left",
                                                           wall * (work - work_done) / work_done)
                                             : "";
      status.Show(
          fmt::format("{} of {} runs done, {} running{}", done, jobs->size(), running, left), wall);
    }
    std::this_thread::sleep_for(kPoll);
  }
  status.Clear();
  return true;
}

int Matrix(const MatrixOptions& options) {
  std::vector<Job> jobs = MakeJobs(options);
  LogSizes sizes;
  for (const Job& job : jobs) sizes.Add(job.log_size);
  const std::string space =
      CheckSpace(options.out.empty() ? RunsDir() : fs::path(options.out), sizes, options.force);
  if (!space.empty()) fmt::print("{}", ScreenLines(2, "{}", space));
  const RunDir matrix = MakeRunDir(options.out, "matrix", options.force);
  const fs::path& folder = matrix.path();
  CatchStopSignals();
  fmt::print("{} runs, {} at a time\n", jobs.size(), options.jobs);
  std::fflush(stdout);
  const int64_t start = NowNanoseconds();
  const bool complete = RunJobs(folder, options.jobs, &jobs);
  const double wall = static_cast<double>(NowNanoseconds() - start) * 1e-9;
  if (!complete) {
    const auto done = std::count_if(jobs.begin(), jobs.end(), [](const Job& j) { return j.done; });
    fmt::print(stderr, "poise: interrupted; {} of {} runs were done, in {}\n", done, jobs.size(),
               folder.string());
    return kExitFailed;
  }
  std::vector<MatrixCell> cells;
  bool good = true;
  for (Job& job : jobs) cells.push_back(std::move(job.cell));
  fmt::print("\n{}\n", FormatMatrix(cells));
  for (const MatrixCell& cell : cells) {
    if (cell.problem) {
      fmt::print(stderr, "poise: {} could not be run: {}\n", cell.folder, *cell.problem);
    } else if (cell.must_pass && !cell.passed) {
      fmt::print(stderr, "poise: {} failed; see poise report {}\n", cell.folder,
                 (folder / cell.folder).string());
    }
    good = good && !cell.problem && (cell.passed || !cell.must_pass);
  }
  WriteFile(folder / "matrix.csv", MatrixCsv(cells));
  WriteCharts(folder, MatrixCharts(cells));
  const auto ran = std::ranges::find_if(cells, [](const auto& cell) { return !cell.problem; });
  if (ran != cells.end()) PointLatestTo(folder / ran->folder);
  fmt::print("{} runs in {:.1f} s; {}, {}\n", jobs.size(), wall, (folder / "matrix.csv").string(),
             kChartsPage);
  return good ? kExitOk : kExitFailed;
}

}  // namespace

void AddMatrixCommand(CLI::App* app, Command* command) {
  std::vector<std::string> names;
  for (const Ablation& ablation : Ablations()) names.push_back(ablation.name);
  const auto [matrix, options] = AddCommand<MatrixOptions>(
      app, command, "matrix",
      "run experiments with and without each part of the controller, and compare", Matrix);
  matrix
      ->add_option("scenario", options->scenarios,
                   "names or .pbtxt files; all: every experiment of the paper")
      ->capture_default_str();
  AddList(matrix, "--ablation", &options->ablations,
          "column to run, repeatable; default: all; variants run as they are")
      ->check(CLI::IsMember(names));
  AddWorld(matrix, &options->world, "the scenarios'");
  AddJobs(matrix, &options->jobs, "runs at a time");
  matrix->add_option("--out", options->out,
                     "folder for a run's folder each, matrix.csv and charts.html; default: a dated "
                     "one under runs/");
  matrix->add_flag(
      "--force", options->force,
      "replace the matrix that --out holds; start though the logs may not fit the disk");
  matrix->footer(
      "Each run is `poise run --inline` with the flags of its column. matrix.csv has a line for "
      "each check of each run: scenario, paper_section, variant, ablation, outcome, fell_at [s], "
      "simulated_time [s], passed, metric, label, unit, measured, at_least, at_most, check_passed, "
      "paper, paper_value. charts.html draws charts.json: docs/reference/charts.md.\nExit code: 0 "
      "when everything ran; a fall in an ablation is a result. 1 when a run could not be made, or "
      "an experiment (or a variant that has checks of its own) fails without ablation. 2 wrong "
      "usage or configuration.\nExample: poise matrix push_double_support --ablation "
      "without_balancing");
}

}  // namespace poise
