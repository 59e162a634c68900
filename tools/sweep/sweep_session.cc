#include "tools/sweep/sweep_session.h"

#include <algorithm>
#include <deque>
#include <filesystem>
#include <map>
#include <numeric>
#include <stdexcept>
#include <thread>

#include "components/framework/clock.h"
#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/cli/command_line.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_place.h"
#include "tools/cli/progress.h"
#include "tools/cli/signals.h"
#include "tools/scenario/ablations.h"
#include "tools/scenario/scenario_loading.h"
#include "tools/sweep/limit_search.h"
#include "tools/sweep/sweep_workers.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr int kPoll = 50;  // ms

/// The two numbers around `at`.
std::optional<std::pair<int64_t, int64_t>> Pair(std::string_view text, char at) {
  const size_t middle = text.find(at);
  if (middle == std::string_view::npos) return {};
  const auto first = NumberIn<int64_t>(text.substr(0, middle));
  const auto second = NumberIn<int64_t>(text.substr(middle + 1));
  if (!first || !second) return {};
  return std::pair{*first, *second};
}

/// `out`, made if need be, or a dated one.
RunDir MakeSweepDir(const SessionOptions& options, const std::string& kind,
                    const std::string& name) {
  const std::string& out = options.out;
  if (out.empty()) return MakeRunDir("", kind + "-" + name, false);
  const fs::path path = MakeOutFolder(out);
  // Results are refused with a word of --resume.
  if (!options.resume && !fs::exists(path / kResultsFile)) {
    CheckFolderFree("--out", out, options.force);
  }
  return RunDir(path);
}

/// Rows and what was made of them: tables of an earlier sweep beside rows of this one would tell of
/// another.
void RemoveResults(const fs::path& folder) {
  for (const char* made : {kResultsFile, "table.csv", "limits.csv", "charts.json", "charts.html"}) {
    if (fs::is_regular_file(folder / made)) fs::remove(folder / made);
  }
}

std::string Duration(double seconds) {
  const auto s = static_cast<int64_t>(seconds + 0.5);
  if (s < 100) return fmt::format("{} s", s);
  if (s < 6000) return fmt::format("{} min {} s", s / 60, s % 60);
  return fmt::format("{} h {} min", s / 3600, s / 60 % 60);
}

}  // namespace

void AddSweepOptions(CLI::App* app, SweepOptions* options) {
  SweepArguments* const arguments = &options->arguments;
  SessionOptions* const session = &options->session;
  RunChanges* const changes = &arguments->changes;
  // It is not marked as required: CLI11 would take a subcommand's name for it.
  app->add_option("sweep", arguments->what,
                  "name of deploy/sweeps, or a .pbtxt file; or a scenario with --vary");
  AddList(
      app, "--vary", &arguments->vary,
      "a field of the scenario, or a name for --expression, and its values: FROM:TO:STEPS, then "
      ":log, :angle (degrees), :whole; or VALUE,VALUE,...; with --random FROM:TO",
      "NAME=VALUES");
  AddList(app, "--expression", &arguments->expression,
          "a field that follows from the variables, e.g. "
          "'sim.push[0].direction_x=cos(direction*deg)'",
          "FIELD=EXPRESSION");
  app->add_option("--random", arguments->random,
                  "this many runs with every variable drawn at random, in place of the grid");
  app->add_option("--seed", arguments->seed, "of what is drawn at random")->check(Whole());
  AddList(app, "--column", &arguments->column,
          "metric of the table (poise list metrics), repeatable, or all; default: those of the "
          "scenario's checks",
          "METRIC");
  AddChangeOptions(app, changes, "change a field of the scenario in every run (poise list fields)");
  AddWorld(app, &changes->world, "the scenario's");
  AddDrives(app, &changes->drives);
  app->add_option("--out", session->out, "folder of the results; default: a dated one under runs/");
  AddJobs(app, &session->jobs, "runs at a time");
  CLI::Option* const resume = app->add_flag(
      "--resume", session->resume, "go on with the sweep in --out; an empty folder begins one");
  resume->needs(app->get_option("--out"));
  app->add_flag("--force", session->force, "replace what --out holds")->excludes(resume);
  CLI::Option* const range =
      app->add_option("--range", session->range, "only points A to B - 1")->type_name("A:B");
  app->add_option("--part", session->part, "only the K-th of N shares, K from 1")
      ->type_name("K/N")
      ->excludes(range);
  app->add_flag("--logs", session->logs, "keep each run's log and files in OUT/logs/POINT");
  app->add_flag("--quiet", session->quiet, "no progress");
}

void AddChangeOptions(CLI::App* app, RunChanges* changes, const std::string& set) {
  app->add_option("--variant", changes->variant,
                  "run this variant of the scenario (poise list scenarios)");
  AddList(app, "--without", &changes->without, "leave out a part of the controller", "PART")
      ->check(CLI::IsMember(RemovableParts()));
  app->add_flag("--ideal", changes->ideal,
                "a robot without joint friction, sensor noise, drive train and model error");
  AddList(app, "--set", &changes->set, set.c_str(), "FIELD=VALUE");
  app->add_option("--duration", changes->duration, "simulated time, s");
}

void AddWorld(CLI::App* app, std::string* world, const std::string& default_of) {
  app->add_option("--world", *world,
                  "engine of the simulated robot: ode or mujoco; default: " + default_of);
}

CLI::Option* AddDrives(CLI::App* app, std::string* drives) {
  return app
      ->add_option("--drives", *drives,
                   "emulated drives between bridge and robot, as of poise run; runs as processes")
      ->check(CLI::IsMember(EmulatedDrives()));
}

void AddJobs(CLI::App* app, int* jobs, const std::string& text) {
  *jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  app->add_option("--jobs", *jobs, text + "; default: the processor's cores")
      ->check(CLI::Range(1, 1024));
}

std::pair<int64_t, int64_t> SelectedRuns(const SessionOptions& options, int64_t size) {
  if (!options.range.empty()) {
    const auto range = Pair(options.range, ':');
    if (!range || range->first < 0 || range->second <= range->first || range->second > size) {
      throw ConfigError(
          fmt::format("--range {}: must be A:B with 0 <= A < B <= {}, the number of "
                      "points",
                      options.range, size));
    }
    return *range;
  }
  if (!options.part.empty()) {
    const auto part = Pair(options.part, '/');
    if (!part || part->first < 1 || part->second < part->first || part->second > kMaxSweepRuns) {
      throw ConfigError(fmt::format("--part {}: must be K/N with 1 <= K <= N", options.part));
    }
    const auto [k, n] = *part;
    return {size * (k - 1) / n, size * k / n};
  }
  return {0, size};
}

std::string HeaderProblem(const SweepHeader& header, const SweepHeader& found) {
  if (header.kind != found.kind) return fmt::format("is of poise {}", found.kind);
  if (header.digest != found.digest) {
    return "is of another sweep: its definition, scenario, robot or graph differs";
  }
  if (header.program != found.program) {
    return "was made by another build of poise, whose figures may differ";
  }
  return "";
}

int64_t CountDone(int64_t first, int64_t end, const SweepRows& rows) {
  return std::ranges::count_if(
      rows, [&](const auto& row) { return row.second.run >= first && row.second.run < end; });
}

std::vector<int64_t> PointRange(int64_t first, int64_t end) {
  std::vector<int64_t> points(static_cast<size_t>(end - first));
  std::iota(points.begin(), points.end(), first);
  return points;
}

bool RunPoints(const std::vector<int64_t>& points, SweepSession* session) {
  auto done = std::count_if(points.begin(), points.end(), [&](int64_t point) {
    return session->rows().contains({point, 0});
  });
  auto next = points.begin();
  return session->Run(
      [&]() -> std::optional<SweepSession::Request> {
        while (next != points.end() && session->rows().contains({*next, 0})) ++next;
        if (next == points.end()) return {};
        return SweepSession::Request{*next++, {}};
      },
      [&](const SweepRow&) { ++done; },
      [&] {
        return SweepSession::Progress{static_cast<double>(done), static_cast<double>(points.size()),
                                      fmt::format("{} of {} runs done", done, points.size())};
      });
}

namespace {

/// The search at one point, and what of it is going on.
struct PointSearch {
  int64_t run;
  LimitSearch search;
  std::vector<double> asked;  // not answered yet

  /// The next value that is wanted and not asked for.
  std::optional<double> Next() {
    for (const double value : search.Wanted()) {
      if (IsAmong(value, asked)) continue;
      asked.push_back(value);
      return value;
    }
    return {};
  }
};

}  // namespace

bool RunLimits(const std::vector<int64_t>& points, SweepSession* session) {
  const Limit& limit = session->header().sweep.limit();
  std::vector<PointSearch> searches;
  for (const int64_t run : points) searches.push_back({run, LimitSearch(limit), {}});
  const auto add = [&](const SweepRow& row) {
    const auto found = std::ranges::find(searches, row.run, &PointSearch::run);
    if (found != searches.end()) found->search.Add(*row.limit, row.survived());
  };
  for (const auto& [key, row] : session->rows()) add(row);
  size_t open = 0;  // first search that is not finished
  return session->Run(
      [&]() -> std::optional<SweepSession::Request> {
        while (open < searches.size() && searches[open].search.Wanted().empty()) ++open;
        for (size_t i = open; i < searches.size(); ++i) {
          if (const std::optional<double> value = searches[i].Next()) {
            return SweepSession::Request{searches[i].run, value};
          }
        }
        return {};
      },
      add,
      [&, per_point = LimitSearch::ExpectedRuns(limit)] {
        SweepSession::Progress progress{0, 0, ""};
        size_t finished = 0;
        for (const PointSearch& point : searches) {
          const bool is_finished = point.search.Wanted().empty();
          finished += is_finished ? 1 : 0;
          progress.done += point.search.tried();
          progress.total +=
              is_finished ? point.search.tried() : std::max(per_point, point.search.tried() + 1);
        }
        progress.text =
            fmt::format("{} of {} point{} known, {} runs done", finished, searches.size(),
                        searches.size() == 1 ? "" : "s", static_cast<int64_t>(progress.done));
        return progress;
      });
}

SweepSession::SweepSession(const SweepDefinition& definition, const std::string& kind,
                           const SessionOptions& options)
    : definition_(definition),
      options_(options),
      header_{kind, definition.sweep(), definition.columns(), definition.digest(), ProgramDigest()},
      dir_(MakeSweepDir(options, kind, definition.name())) {
  if (options_.force && !options_.resume) RemoveResults(folder());
  std::optional<SweepResults> results = ReadResults(folder());
  if (results) {
    const std::string where = (folder() / kResultsFile).string();
    if (!options_.resume) {
      throw ConfigError(
          fmt::format("{}: is there already; --resume goes on with it, --force "
                      "replaces it; or choose another folder with --out",
                      where));
    }
    const std::string problem = HeaderProblem(header_, results->header);
    if (!problem.empty()) {
      throw ConfigError(fmt::format("{}: {}; choose another folder with --out", where, problem));
    }
    rows_ = results->rows;
    // What did not tell is tried again; what cannot be run stays so.
    std::erase_if(rows_, [](const auto& row) {
      return !row.second.survived() && row.second.outcome != kInvalid;
    });
    found_ = rows_.size();
  }
  on_disk_ = std::move(results);
}

std::string SweepSession::RoomForLogs(double runs) const {
  const int64_t one = definition_.log_size();
  const LogSizes sizes{static_cast<int64_t>(runs * static_cast<double>(one)), one};
  return CheckSpace(folder(), sizes, options_.force);
}

SweepRow SweepSession::RowOf(const Request& request, const ForkedTasks::Result& result) {
  if (result.answer) return SweepRow::Parse(*result.answer);
  SweepRow row;
  row.run = request.run;
  row.limit = request.limit;
  row.outcome = result.hung ? kHung : kCrashed;
  row.component = result.place.component;
  row.stage = result.place.stage;
  row.ended_at = result.place.time;
  row.reason = result.problem;
  return row;
}

bool SweepSession::Run(const std::function<std::optional<Request>()>& next,
                       const std::function<void(const SweepRow&)>& done,
                       const std::function<Progress()>& progress) {
  CatchStopSignals();
  StatusLine status(options_.quiet);
  ForkedTasks tasks(options_.jobs);
  std::map<int64_t, Request> requests;
  std::deque<Request> again;
  int64_t id = 0;
  bool exhausted = false;
  std::string failure;
  const int64_t start = NowNanoseconds();
  const Progress first = progress();
  const double before = first.done;
  if (options_.logs) {
    const std::string room = RoomForLogs(first.total - first.done);
    if (!room.empty() && !options_.quiet) fmt::print("{}\n", room);
  }
  if (!writer_) {
    writer_.emplace(folder(), header_, on_disk_);
    for (const std::string& warning : definition_.warnings()) {
      fmt::print(stderr, "warning: run 0: {}\n", warning);
    }
  }
  while (StopSignal() == 0) {
    while (!tasks.full() && failure.empty()) {
      std::optional<Request> request;
      if (again.empty()) {
        request = next();
        exhausted = !request;
        if (!request) break;
      } else {
        request = again.front();
        again.pop_front();
      }
      requests[id] = *request;
      tasks.Start(id++, [this, request](TaskStatus* shown) {
        std::string logs;
        if (options_.logs) {
          logs = (folder() / "logs" / std::to_string(request->run)).string();
          if (request->limit) logs += fmt::format("/{}", *request->limit);
        }
        SweepRow row;
        row.run = request->run;
        row.limit = request->limit;
        row = RunPoint(definition_.scenario(), definition_.ChangesOf(request->run, request->limit),
                       definition_.columns(), definition_.required(), logs, std::move(row), shown);
        return SweepRow::RowText(row);
      });
    }
    if (tasks.running() == 0 && ((exhausted && again.empty()) || !failure.empty())) break;
    for (const ForkedTasks::Result& result : tasks.Wait(kPoll)) {
      const Request request = requests.extract(result.id).mapped();
      if (!result.answer && !result.crashed && !result.hung) {
        failure = fmt::format("run {}: {}", request.run, result.problem);
        continue;
      }
      const SweepRow row = RowOf(request, result);
      if (!row.survived() && row.outcome != kInvalid && !request.again) {
        again.push_back({request.run, request.limit, /*again=*/true});
        status.Clear();
        fmt::print(stderr, "poise: run {}{}: {}; it is made once more\n", row.run,
                   row.limit ? fmt::format(" at {}", *row.limit) : "",
                   logging::LinesForTerminal(row.Ending()));
        continue;
      }
      writer_->Append(row);
      AddRow(row, kResultsFile, &rows_);
      done(row);
    }
    const double wall = static_cast<double>(NowNanoseconds() - start) * 1e-9;
    if (status.Due(wall)) {
      const Progress now = progress();
      const double gained = now.done - before;
      const std::string left =
          gained > 0 ? ", about " + Duration(wall * (now.total - now.done) / gained) + " left" : "";
      status.Show(now.text + left, wall);
    }
  }
  status.Clear();
  if (!failure.empty()) {
    throw std::runtime_error(fmt::format("{}; --resume --out {} goes on after the {} runs done",
                                         failure, folder().string(), rows_.size()));
  }
  return StopSignal() == 0;
}

}  // namespace poise
