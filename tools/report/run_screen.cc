#include "tools/report/run_screen.h"

#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <string_view>

#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/cli/lists.h"
#include "tools/cli/text_table.h"
#include "tools/report/event_list.h"
#include "tools/report/run_story.h"
#include "tools/scenario/registry.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr size_t kFailures = 5;         // named in lines of their own
constexpr size_t kFailuresInALine = 3;  // named in one line

std::string Paragraph(const std::string& text) {
  return text.empty() ? "" : ScreenLines(0, "{}", logging::LinesForTerminal(text));
}

std::string Sentences(const ShownRun& run) {
  return Paragraph(TellRun(run.record, run.checks, run.events, run.end));
}

struct Count {
  size_t limited = 0;  // of those that are known
  size_t unknown = 0;
  bool judged = false;  // ChecksPass, but for those that failed
  std::vector<const CheckResult*> failed;
};

Count CountChecks(const std::vector<CheckResult>& checks) {
  Count count;
  for (const CheckResult& check : checks) {
    if (!check.limited()) continue;
    ++(check.known() ? count.limited : count.unknown);
    if (!check.passed) count.failed.push_back(&check);
  }
  count.judged = !count.failed.empty() || ChecksPass(checks);
  return count;
}

std::string Failure(const CheckResult& check) {
  return logging::ForTerminal(fmt::format("{} ({}) measured {}, limit {}", check.label, check.name,
                                          FormatMeasured(check), FormatLimit(check)));
}

std::string Unknown(const Count& count) {
  return count.unknown == 0 ? "" : fmt::format(", {} not known", count.unknown);
}

std::string Hold(const Count& count) {
  return fmt::format("{} of {} checks hold{}", count.limited - count.failed.size(), count.limited,
                     Unknown(count));
}

std::string ProblemOf(const std::string& problem, const Count& count) {
  if (!problem.empty() || count.judged) return problem;
  return "none of the scenario's own checks is known";
}

/// The run has rows of the paper's, and so its short table has them.
bool ShowsPaper(const Scenario& scenario, const std::vector<CheckResult>& checks) {
  return scenario.has_paper_section() &&
         std::ranges::any_of(checks, [](const CheckResult& check) { return !check.paper.empty(); });
}

bool InShortTable(const CheckResult& check, bool paper) {
  return paper ? !check.paper.empty() : check.limited() && !check.of_every_run;
}

/// What this run has of the paper, or of its scenario.
std::string ShortTable(const Scenario& scenario, const std::vector<CheckResult>& checks) {
  const bool paper = ShowsPaper(scenario, checks);
  std::vector<TableRow> rows = {{"what", "measured", "limit", ""}};
  if (paper) rows[0].insert(rows[0].begin() + 2, "paper");
  for (const CheckResult& check : checks) {
    if (!InShortTable(check, paper)) continue;
    rows.push_back({check.label, FormatMeasured(check), FormatLimit(check), VerdictCell(check)});
    if (paper) rows.back().insert(rows.back().begin() + 2, check.paper);
  }
  return rows.size() == 1 ? "" : FormatColumns(rows);
}

/// ", 9 of them above", of checks that a short table leaves out.
std::string Above(const Scenario& scenario, const std::vector<CheckResult>& checks) {
  const bool paper = ShowsPaper(scenario, checks);
  const auto of_limited = [&](bool all) {
    return std::ranges::count_if(checks, [&](const CheckResult& check) {
      return check.limited() && check.known() && (all || InShortTable(check, paper));
    });
  };
  const auto shown = of_limited(false);
  return shown == of_limited(true) ? "" : fmt::format(", {} of them above", shown);
}

/// Whose checks they are, where they are not the scenario's.
std::string ChecksOfVariant(const Scenario& scenario) {
  const auto& variants = scenario.variant();
  const auto found = std::ranges::find_if(variants, [&](const Variant& variant) {
    return scenario.applied().has_variant() && variant.name() == scenario.applied().variant();
  });
  if (found == variants.end() || found->check_size() == 0) return "";
  return Paragraph(fmt::format(
      "The checks are those of the variant {}, in place of the scenario's.", found->name()));
}

/// How this program is called from here: "poise" when $PATH has it, else its shortest path.
std::string ProgramName() {
  std::error_code error;
  fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (error) return "poise";
  if (self.filename() == "first_run") self.replace_filename("poise");  // which is built next
  const char* const path = std::getenv("PATH");
  const std::string_view folders = path == nullptr ? "" : path;
  for (size_t begin = 0; begin < folders.size();) {
    const size_t end = std::min(folders.find(':', begin), folders.size());
    const fs::path candidate = fs::path(folders.substr(begin, end - begin)) / "poise";
    begin = end + 1;
    if (!fs::exists(candidate, error)) continue;
    if (fs::equivalent(candidate, self, error) && !error) return "poise";
    break;  // another one is called by that name
  }
  const std::string near = fs::proximate(self, error).string();
  return error || near.starts_with("..") ? self.string() : near;
}

}  // namespace

std::string FormatEngine(const Scenario& scenario, const Graph& graph) {
  const std::string engine = EngineOf(graph);
  const auto* section = Scenario::descriptor()->FindFieldByName(engine);
  if (engine.empty() || section == nullptr || section->is_repeated() ||
      section->cpp_type() != google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE) {
    return "";
  }
  const google::protobuf::Message& told = scenario.GetReflection()->GetMessage(scenario, section);
  std::string text = fmt::format("engine {}:", engine);
  for (int i = 0; i < told.GetDescriptor()->field_count(); ++i) {
    const auto* field = told.GetDescriptor()->field(i);
    if (field->is_repeated()) continue;
    std::string value;
    google::protobuf::TextFormat::PrintFieldValueToString(told, field, -1, &value);
    text += fmt::format(" {} {},", field->name(), value);
  }
  return fmt::format("{} step {} s, ground friction {}", text, scenario.sim().step(),
                     scenario.sim().ground().friction());
}

std::string FormatScreen(const ShownRun& run) {
  const std::string table = ShortTable(run.scenario, run.checks);
  return Sentences(run) + (table.empty() ? table : fmt::format("\n{}", table)) +
         ChecksOfVariant(run.scenario);
}

std::string FormatFullScreen(const ShownRun& run) {
  return fmt::format("{}\n{}{}{}\n{}{}", Sentences(run), FormatTable(run.checks),
                     FormatUnknown(run.checks, /*all=*/true), ChecksOfVariant(run.scenario),
                     logging::LinesForTerminal(FormatEvents(run.events)),
                     logging::LinesForTerminal(FormatAssumptions(run.scenario)) +
                         Paragraph(FormatEngine(run.scenario, run.record.spec.graph())));
}

std::string FormatVerdict(const std::vector<CheckResult>& checks, const std::string& of_run) {
  const Count count = CountChecks(checks);
  const std::string problem = ProblemOf(of_run, count);
  if (problem.empty() && count.failed.empty()) {
    return count.limited + count.unknown == 0 ? "passed" : fmt::format("passed: {}", Hold(count));
  }
  std::vector<std::string> parts;
  if (!problem.empty()) parts.push_back(problem);
  if (count.failed.empty() && count.limited > 0) parts.push_back(Hold(count));
  for (size_t i = 0; i < std::min(count.failed.size(), kFailuresInALine); ++i) {
    const std::string of =
        i == 0 ? fmt::format("{} of {}: ", count.failed.size(), count.limited) : "";
    parts.push_back(of + Failure(*count.failed[i]));
  }
  if (count.failed.size() > kFailuresInALine) {
    parts.push_back(fmt::format("and {} more", count.failed.size() - kFailuresInALine));
  }
  return fmt::format("FAILED: {}", Joined(parts, "; "));
}

std::string FormatVerdictLines(const Scenario& scenario, const std::vector<CheckResult>& checks,
                               const std::string& of_run, bool below_full_table) {
  const Count count = CountChecks(checks);
  const std::string problem = ProblemOf(of_run, count);
  const int width = ScreenStyle().columns;
  const std::string above = below_full_table ? "" : Above(scenario, checks);
  std::string text;
  if (problem.empty() && count.failed.empty()) {
    text = Toned(Wrapped(FormatVerdict(checks, problem) + above, width, 2), Tone::kGood) + "\n";
  } else {
    if (!problem.empty()) {
      text += Toned(Wrapped(fmt::format("FAILED: {}", problem), width, 2), Tone::kBad) + "\n";
    }
    if (!count.failed.empty()) {
      const std::string failed = fmt::format("{} of {} checks", count.failed.size(), count.limited);
      text += (problem.empty() ? Toned(fmt::format("FAILED: {}", failed), Tone::kBad)
                               : fmt::format("{} failed", failed)) +
              Unknown(count) + "\n";
    } else if (count.limited > 0) {
      text += Hold(count) + above + "\n";
    }
  }
  for (size_t i = 0; i < std::min(count.failed.size(), kFailures); ++i) {
    text += ScreenLines(4, "  {}", Failure(*count.failed[i]));
  }
  if (count.failed.size() > kFailures) {
    text += fmt::format("  and {} more, in the {}\n", count.failed.size() - kFailures,
                        below_full_table ? "table above" : "full table (--full)");
  }
  return text + (below_full_table ? "" : FormatUnknown(checks, /*all=*/false));
}

std::string FormatNext(const Scenario& scenario, const std::vector<CheckResult>& checks,
                       const fs::path& dir, bool latest, const std::string& matrix) {
  const std::string program = ProgramName();
  const std::string whole = fs::absolute(dir).lexically_normal().string();
  const std::string near = fs::proximate(dir).string();
  const std::string run =
      latest ? "" : fmt::format(" {}", ShellWord(near.size() < whole.size() ? near : whole));
  std::string text = "\nLook further:\n";
  const auto add = [&](const std::string& command, const std::string& what) {
    text += fmt::format("  {} {}\n", program, Toned(command, Tone::kStrong));
    text += ScreenLines(6, "      {}", what);
  };
  add(fmt::format("report{}", run), "draws the run, step by step, as a page for a browser");
  const int assumptions = scenario.assumption_size();
  add(fmt::format("report{} --full", run),
      fmt::format(
          "all {} checks with their limits, every figure and event{}", CountChecks(checks).limited,
          assumptions == 0 ? ""
          : !scenario.has_paper_section()
              ? fmt::format(", and {} assumed values", assumptions)
              : fmt::format(", and the {} values that the paper does not give", assumptions)));
  if (!matrix.empty()) {
    add(fmt::format("matrix {}", ShellWord(matrix)),
        "the same without each part of the controller");
  }
  return text;
}

std::string FileAddress(const fs::path& file) {
  std::string address = "file://";
  for (const char c : fs::absolute(file).lexically_normal().string()) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain =
        std::isalnum(byte) != 0 || std::string_view("/-_.~+,=@").find(c) != std::string_view::npos;
    address += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return address;
}

}  // namespace poise
