#include <filesystem>

#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/cli/command_line.h"
#include "tools/cli/output_place.h"
#include "tools/cli/progress.h"
#include "tools/commands/commands.h"
#include "tools/report/html_report.h"
#include "tools/report/report.h"
#include "tools/report/run_screen.h"
#include "tools/run/run_dir.h"
#include "tools/run/scenario_run.h"

namespace poise {
namespace {

struct ReportOptions {
  std::string run;
  std::vector<std::string> others;
  std::string html;
  bool no_html = false;
  bool full = false;
  bool force = false;
  double page_size = kPageSize;  // MB
};

/// report.html in a run's folder; beside any other log, under the log's name.
std::filesystem::path DefaultHtml(const std::string& log) {
  const std::filesystem::path path = log;
  if (path.filename() == "run.lcm") return path.parent_path() / "report.html";
  return std::filesystem::path(path).replace_extension(".html");
}

/// The page of one set of charts, or of several laid over each other.
int ReportCharts(const ReportOptions& options) {
  std::vector<std::filesystem::path> folders = {options.run};
  folders.insert(folders.end(), options.others.begin(), options.others.end());
  const std::filesystem::path html =
      options.html.empty() ? folders.front() / "report.html" : std::filesystem::path(options.html);
  WriteChartsPage(html, folders);
  fmt::print("The charts: {}\n", FileAddress(html));
  return kExitOk;
}

int Report(const ReportOptions& options) {
  if (!options.html.empty()) CheckFileFree("--html", options.html, options.force);
  const std::filesystem::path charts = std::filesystem::path(options.run) / kChartsFile;
  if (!options.run.empty() && std::filesystem::exists(charts)) return ReportCharts(options);
  StageLine line(/*quiet=*/false);
  std::vector<ReportedRun> runs;
  runs.push_back(ReadReportedRun(FindEndedLog(options.run), &line));
  for (const std::string& other : options.others) {
    runs.push_back(ReadReportedRun(FindEndedLog(other), &line));
  }
  const ReportedRun& run = runs.front();
  const std::string commit = run.record.spec.poise_commit().empty()
                                 ? ""
                                 : fmt::format(" ({})", run.record.spec.poise_commit());
  std::string text = Wrapped(
      logging::LinesForTerminal(fmt::format(
          "{} of {}, poise {}{}\n{}", run.record.spec.scenario(), run.record.info.started_at,
          run.record.spec.poise_version(), commit, FormatChanges(run.scenario))),
      ScreenStyle().columns, 2);
  line.Begin("events");
  const std::vector<logging::Event> events = logging::Events(run.record);
  const ShownRun shown{run.scenario, run.record, run.checks, events, ""};
  text += fmt::format("\n{}\n", options.full ? FormatFullScreen(shown) : FormatScreen(shown));
  line.End();
  fmt::print("{}", text);
  if (run.record.spec.has_cut()) {
    fmt::print("{}", ScreenLines(0,
                                 "part of a run: the scenario's checks are of the whole one and "
                                 "are not judged here"));
  } else {
    fmt::print("{}", FormatVerdictLines(run.scenario, run.checks, "", options.full));
  }
  if (!options.no_html) {
    const std::filesystem::path html =
        options.html.empty() ? DefaultHtml(run.log) : std::filesystem::path(options.html);
    line.Begin("the page");
    WriteHtmlReport(html, runs, options.page_size);
    line.End();
    fmt::print("\nThe run, step by step: {}\n", FileAddress(html));
  }
  return ChecksPass(run.checks) ? kExitOk : kExitFailed;
}

}  // namespace

void AddReportCommand(CLI::App* app, Command* command) {
  const auto [report, options] = AddCommand<ReportOptions>(
      app, command, "report", "the table of a run from its log, and the run as a page to look at",
      Report);
  report->add_option("run", options->run,
                     "folder of a run or a log, or of charts: a sweep's, limit's, matrix' or "
                     "benchmark's; default: the latest run");
  report->add_option("others", options->others,
                     "more of the kind, drawn over the first in the page");
  CLI::Option* html = report->add_option(
      "--html,-o", options->html, "file of the page; default: report.html in the run's folder");
  CLI::Option* no_html =
      report->add_flag("--no-html", options->no_html, "the table alone")->excludes(html);
  report
      ->add_option("--page-size", options->page_size,
                   "MB that the page's numbers may take: of a run too long for that it shows every "
                   "tick at its ends and events, elsewhere rows with least and largest values")
      ->check(Within("a size of 0.1 to 1000 MB", [](double mb) { return mb >= 0.1 && mb <= 1000; }))
      ->capture_default_str()
      ->excludes(no_html);
  report->add_flag("--force", options->force, "replace the file of --html");
  report->add_flag("--full", options->full, "every figure, the events and the assumptions");
  SetExample(report, "poise report runs/latest --full");
}

}  // namespace poise
