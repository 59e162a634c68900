#include "tools/scenario/scenario_files.h"

#include <algorithm>
#include <charconv>
#include <optional>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_path.h"
#include "fmt/format.h"
#include "tools/scenario/catalog.h"
#include "tools/scenario/former_fields.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

/// Whether the field at `path`, without indexes, goes where `file` takes what its base has.
bool Removes(const Scenario& file, std::string_view path) {
  return std::ranges::any_of(file.remove(), [path](const std::string& removed) {
    return path.starts_with(removed) &&
           (path.size() == removed.size() || path[removed.size()] == '.');
  });
}

/// `field` with its first index less `shift`; nullopt when that is below 0. Elements of the lists
/// further down are all of one file.
std::optional<std::string> ShiftFirstIndex(std::string_view field, int shift) {
  const size_t bracket = field.find('[');
  if (bracket == std::string_view::npos) return std::string(field);
  int index = 0;
  const auto [end, error] =
      std::from_chars(field.data() + bracket + 1, field.data() + field.size(), index);
  if (error != std::errc() || index < shift) return std::nullopt;
  return fmt::format("{}[{}{}", field.substr(0, bracket), index - shift,
                     std::string_view(end, field.data() + field.size()));
}

}  // namespace

ScenarioFiles::ScenarioFiles(const fs::path& file, const fs::path& overlay) {
  fs::path next = file;
  while (true) {
    File read;
    read.name = next.string();
    read.text = ReadFile(read.name);
    ParseScenario(read.text, read.name, &read.fields);
    const bool has_base = read.fields.has_base();
    const std::string base = read.fields.base();
    files_.insert(files_.begin(), std::move(read));
    if (!has_base) break;
    const auto fail = [&](const std::string& problem) {
      throw ConfigError(fmt::format("{}:{}: base: {}", files_.front().name,
                                    LocateField(files_.front().text, "base", Scenario()), problem));
    };
    try {
      next = FindFile("scenarios", base, next.parent_path(), BaseFiles::kTaken);
    } catch (const ConfigError& error) {
      fail(error.what());
    }
    std::error_code error;
    for (const File& earlier : files_) {
      if (!fs::equivalent(earlier.name, next, error)) continue;
      fail(fmt::format("{} is based on this file itself; bases may not form a loop", base));
    }
  }
  own_ = files_.size() - 1;
  if (overlay.empty()) return;
  const Scenario own = Merged();
  File read;
  read.name = overlay.string();
  read.text = ReadFile(read.name);
  ParseScenario(read.text, read.name, &read.fields);
  // A graph or a type of drives of the scenario's own is not to be replaced.
  if (own.graph() != Scenario().graph()) read.fields.clear_graph();
  if (own.has_drive_profile()) read.fields.clear_drive_profile();
  files_.push_back(std::move(read));
}

Scenario ScenarioFiles::Merged() const {
  Scenario merged;
  for (const File& file : files_) {
    for (int i = 0; i < file.fields.remove_size(); ++i) {
      const std::string& path = file.fields.remove(i);
      if (ClearField(&merged, path)) continue;
      const std::string field = fmt::format("remove[{}]", i);
      throw ConfigError(fmt::format(
          "{}:{}: {}: {}", file.name, LocateField(file.text, field, file.fields), field,
          &file == &files_.front()
              ? "there is no base to remove from; name one with base"
              : fmt::format("the base sets no field '{}'; name a list, a group or a value, whole",
                            path)));
    }
    merged.MergeFrom(file.fields);
  }
  merged.clear_base();
  merged.clear_remove();
  return merged;
}

FieldPlace ScenarioFiles::Locate(std::string_view field) const {
  const std::string_view list = field.substr(0, field.find('['));
  for (std::string_view path = field; !path.empty();) {
    const bool indexed = path.size() > list.size();
    FieldPlace place;
    int before = 0;  // elements of the list in earlier files
    for (const File& file : files_) {
      if (Removes(file.fields, indexed ? list : path)) {
        place = {};
        before = 0;
      }
      const auto own = indexed ? ShiftFirstIndex(path, before) : std::string(path);
      if (own && HasField(file.fields, *own)) {
        place = {file.name, LocateField(file.text, *own, file.fields),
                 *own + std::string(field.substr(path.size()))};
      }
      before += CountField(file.fields, list);
    }
    if (place.line > 0) return place;
    const size_t dot = path.rfind('.');
    path = path.substr(0, dot == std::string_view::npos ? 0 : dot);
  }
  return {file(), 0, std::string(field)};
}

fs::path ScenarioFiles::FolderOf(std::string_view field) const {
  return fs::path(Locate(field).file).parent_path();
}

}  // namespace poise
