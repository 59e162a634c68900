#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <tuple>
#include <vector>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_path.h"
#include "components/framework/configuration/text_pattern.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/cli/output_place.h"
#include "tools/commands/commands.h"
#include "tools/scenario/catalog.h"
#include "tools/scenario/former_fields.h"
#include "tools/scenario/run_setup.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

struct NewOptions {
  std::string name;
  std::string from;
};

std::string InQuotes(const std::string& text) {
  Scenario scenario;
  scenario.set_name(text);
  return ValueText(scenario, "name");
}

/// The lines of a file in which single fields of the whole scenario are written anew.
class ScenarioLines {
 public:
  explicit ScenarioLines(const std::string& text) {
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines_.push_back(line);
  }

  /// Replaces the value that `field` has at the line; its comment stays.
  void Replace(int line, const std::string& field, const std::string& value) {
    std::string& text = lines_.at(static_cast<size_t>(line) - 1);
    const std::vector<PatternMatch> matches =
        Matches(text, "(^|[\\s;,])" + field + "\\s*:\\s*(\"[^\"]*\"|'[^']*')");
    if (matches.empty()) {
      throw ConfigError(
          fmt::format("line {}: {} and its value must stand on one line", line, field));
    }
    const auto& [begin, old] = matches.front()[2];
    text.replace(begin, old.size(), InQuotes(value));
  }
  void InsertBefore(size_t line, const std::string& text) {
    lines_.insert(lines_.begin() + static_cast<std::ptrdiff_t>(line), text);
  }
  /// Lines of comment that the file begins with.
  size_t HeadSize() const {
    size_t size = 0;
    while (size < lines_.size() && lines_[size].starts_with('#')) ++size;
    return size;
  }
  std::string Text() const {
    std::string text;
    for (const std::string& line : lines_) text += line + "\n";
    return text;
  }

 private:
  std::vector<std::string> lines_;
};

/// The text of a new scenario `name` for a file in `folder`: `from`'s (LookForFile's rule, from
/// `folder`) with its comments; empty: a short one with a push, which says what may be changed.
/// Files that it names and that would not be found from `folder` are named by their whole path.
/// Throws ConfigError.
std::string NewScenarioText(const std::string& name, const std::string& from,
                            const fs::path& folder) {
  const fs::path source = from.empty() ? DeployDir() / "scenarios/base/template.pbtxt"
                                       : FindFile("scenarios", from, folder);
  const std::string text = ReadFile(source.string());
  Scenario fields;
  ParseScenario(text, source.string(), &fields);
  ScenarioLines lines(text);
  const auto line_of = [&](const char* field) { return LocateField(text, field, fields); };
  for (const auto& [field, kind, has, value] :
       {std::tuple{"base", "scenarios", fields.has_base(), fields.base()},
        std::tuple{"robot", "robots", fields.has_robot(), fields.robot()},
        std::tuple{"graph", "graphs", fields.has_graph(), fields.graph()},
        std::tuple{"drive_profile", "drives", fields.has_drive_profile(),
                   fields.drive_profile()}}) {
    if (!has) continue;
    const fs::path meant = FindFile(kind, value, source.parent_path(), BaseFiles::kTaken);
    const auto found = LookForFile(kind, value, folder, BaseFiles::kTaken);
    std::error_code error;
    if (found && fs::equivalent(*found, meant, error)) continue;
    lines.Replace(line_of(field), field, fs::absolute(meant).lexically_normal().string());
  }
  if (fields.has_name()) lines.Replace(line_of("name"), "name", name);
  const size_t head = lines.HeadSize();
  if (!fields.has_name()) lines.InsertBefore(head, fmt::format("name: {}", InQuotes(name)));
  if (!from.empty()) {
    lines.InsertBefore(head, fmt::format("# Made from {} by poise new scenario.", from));
  }
  return lines.Text();
}

/// Makes the file. Throws ConfigError when there is one of that name, or it cannot be made.
void WriteNewFile(const fs::path& file, const std::string& text) {
  const int fd = open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd < 0) {
    throw ConfigError(fmt::format(
        "{}: {}", file.string(),
        errno == EEXIST ? "is there already; choose another name" : std::strerror(errno)));
  }
  close(fd);
  WriteFile(file, text);
}

int NewScenario(const NewOptions& options) {
  std::string name = options.name;
  if (name.ends_with(".pbtxt")) name.resize(name.size() - 6);
  const auto in_name = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; };
  if (name.empty() || !std::all_of(name.begin(), name.end(), in_name)) {
    throw ConfigError(fmt::format(
        "new scenario: '{}' must consist of letters, digits, _ and -; the file is written into the "
        "current folder",
        options.name));
  }
  const fs::path file = fs::current_path() / (name + ".pbtxt");
  WriteNewFile(file, NewScenarioText(name, options.from, fs::current_path()));
  const LoadedScenario loaded = LoadScenario(file.string(), {});
  fmt::print(
      "{}: {}\n  to run it:    poise run {}\n  to check it:  poise graph check {}\n"
      "  the fields:   poise list fields [NAME]\n",
      file.filename().string(), loaded.scenario.description(), file.filename().string(),
      file.filename().string());
  return kExitOk;
}

}  // namespace

void AddNewCommand(CLI::App* app, Command* command) {
  CLI::App* const make = AddGroup(app, "new", "write a file of your own to begin with");
  const auto [scenario, options] =
      AddCommand<NewOptions>(make, command, "scenario",
                             "a commented scenario, NAME.pbtxt in the current folder", NewScenario);
  scenario->add_option("name", options->name, "letters, digits, _ and -")->required();
  scenario->add_option("--from", options->from,
                       "a copy of this scenario, a name or a .pbtxt file (poise list scenarios)");
  SetExample(scenario, "poise new scenario my_push --from push_double_support");
}

}  // namespace poise
