#include "tools/scenario/new_scenario.h"

#include <sstream>
#include <vector>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_path.h"
#include "components/framework/configuration/text_pattern.h"
#include "fmt/format.h"
#include "tools/scenario/catalog.h"
#include "tools/scenario/former_fields.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr char kTemplate[] = "template";

std::string Quoted(const std::string& text) {
  Scenario scenario;
  scenario.set_name(text);
  return ValueText(scenario, "name");
}

/// The lines of a file in which single fields of the whole scenario are written anew.
class Lines {
 public:
  explicit Lines(const std::string& text) {
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
    text.replace(begin, old.size(), Quoted(value));
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

}  // namespace

std::string NewScenarioText(const std::string& name, const std::string& from,
                            const fs::path& folder) {
  const fs::path source = from.empty()
                              ? DeployDir() / "scenarios/base" / (std::string(kTemplate) + ".pbtxt")
                              : FindFile("scenarios", from, folder);
  const std::string text = ReadFile(source.string());
  Scenario fields;
  ParseScenario(text, source.string(), &fields);
  Lines lines(text);
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
  if (!fields.has_name()) lines.InsertBefore(head, fmt::format("name: {}", Quoted(name)));
  if (!from.empty()) {
    lines.InsertBefore(head, fmt::format("# Made from {} by poise new scenario.", from));
  }
  return lines.Text();
}

}  // namespace poise
