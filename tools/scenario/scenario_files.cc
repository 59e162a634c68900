#include "tools/scenario/scenario_files.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include "components/framework/configuration/field_path.h"
#include "fmt/format.h"
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

ScenarioFiles::ScenarioFiles(const fs::path& file, const fs::path& overlay)
    : files_(ReadWithBases<Scenario>(file, "scenarios", BaseFiles::kTaken, ParseScenario)),
      own_(files_.size() - 1) {
  if (overlay.empty()) return;
  const Scenario own = Merged();
  File read = ReadWithBases<Scenario>(overlay, "drives", BaseFiles::kRefused, ParseScenario).back();
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
      file.Fail(
          fmt::format("remove[{}]", i),
          &file == &files_.front()
              ? "there is no base to remove from; name one with base"
              : fmt::format("the base sets no field '{}'; name a list, a group or a value, whole",
                            path));
    }
    merged.MergeFrom(file.fields);
  }
  merged.clear_base();
  merged.clear_remove();
  return merged;
}

std::pair<const ScenarioFiles::File*, std::string> ScenarioFiles::Find(
    std::string_view field) const {
  const std::string_view list = field.substr(0, field.find('['));
  for (std::string_view path = field; !path.empty();) {
    const bool indexed = path.size() > list.size();
    const File* found = nullptr;
    std::string place;
    int before = 0;  // elements of the list in earlier files
    for (const File& file : files_) {
      if (Removes(file.fields, indexed ? list : path)) {
        found = nullptr;
        before = 0;
      }
      const auto own = indexed ? ShiftFirstIndex(path, before) : std::string(path);
      if (own && HasField(file.fields, *own)) {
        found = &file;
        place = *own + std::string(field.substr(path.size()));
      }
      before += CountField(file.fields, list);
    }
    if (found != nullptr) return {found, place};
    const size_t dot = path.rfind('.');
    path = path.substr(0, dot == std::string_view::npos ? 0 : dot);
  }
  return {nullptr, std::string(field)};
}

FieldPlace ScenarioFiles::Locate(std::string_view field) const {
  const auto [found, place] = Find(field);
  if (found == nullptr) return {file(), 0, place};
  return {found->name, found->Line(place), place};
}

fs::path ScenarioFiles::FolderOf(std::string_view field) const {
  const File* const found = Find(field).first;
  return fs::path(found == nullptr ? file() : found->name).parent_path();
}

}  // namespace poise
