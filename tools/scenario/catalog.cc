#include "tools/scenario/catalog.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <set>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/suggest.h"
#include "components/framework/modules.h"
#include "fmt/format.h"
#include "tools/cli/lists.h"
#include "tools/cli/text_table.h"

namespace poise {
namespace fs = std::filesystem;

namespace {

constexpr char kEnding[] = ".pbtxt";

// Folders by kind, and the message that their files hold.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kKinds{
    {{"scenarios", "Scenario"}, {"graphs", "Graph"}, {"sweeps", "Sweep"}, {"robots", "Robot"}}};

/// The kind of files that hold this message; empty: one of several, or of none here.
std::string_view KindOf(std::string_view message) {
  for (const auto& [kind, name] : kKinds) {
    if (message == name) return kind;
  }
  return "";
}

/// True of a file that says itself, or whose folder says, to be of another kind: a scenario of a
/// graph's name.
bool IsOtherKind(const std::string& kind, const fs::path& file) {
  if (kind == "drives") return false;
  const std::string_view own = KindOf(MessageNamedIn(file));
  if (!own.empty()) return own != kind;
  const fs::path folder = file.parent_path().filename();
  return folder != kind &&
         std::ranges::any_of(kKinds, [&](const auto& each) { return folder == each.first; });
}

/// True for "base/NAME".
bool IsBase(const fs::path& name) {
  const fs::path folder = name.parent_path();
  return IsAmong("base", folder);
}

/// The text of a robot's folder: that of the folder's name, or the only one.
fs::path TextIn(const fs::path& folder) {
  const fs::path dir = folder.has_filename() ? folder : folder.parent_path();
  const fs::path same = dir / (dir.filename().string() + kEnding);
  std::error_code error;
  if (fs::is_regular_file(same, error)) return same;
  std::vector<fs::path> texts;
  for (const auto& entry : fs::directory_iterator(dir, error)) {
    if (entry.path().extension() == kEnding) texts.push_back(entry.path());
  }
  return texts.size() == 1 ? texts.front() : same;
}

/// The files that `name` may mean, the first that exists is meant.
std::vector<fs::path> Candidates(const std::string& kind, const std::string& name,
                                 const fs::path& beside) {
  const bool with_ending = name.ends_with(kEnding);
  std::vector<fs::path> folders = {beside};
  if (fs::path(name).is_absolute()) {
    folders = {fs::path()};
  } else {
    for (const fs::path& folder : DataFolders()) folders.push_back(folder / kind);
  }
  std::vector<fs::path> candidates;
  std::error_code error;
  for (const fs::path& folder : folders) {
    candidates.push_back((folder / (with_ending ? name : name + kEnding)).lexically_normal());
    if (kind == "robots" && !with_ending && fs::is_directory(folder / name, error)) {
      candidates.push_back(TextIn((folder / name).lexically_normal()));
    }
  }
  return candidates;
}

/// Names of the files in the folders of `candidates`, as `name` could have been written.
std::set<std::string> NamesThere(const std::vector<fs::path>& candidates, const std::string& name) {
  const bool with_ending = name.ends_with(kEnding);
  std::set<std::string> names;
  for (const fs::path& candidate : candidates) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(candidate.parent_path(), error)) {
      if (entry.path().extension() != kEnding) continue;
      const fs::path file = with_ending ? entry.path().filename() : entry.path().stem();
      names.insert((fs::path(name).parent_path() / file).string());
    }
  }
  return names;
}

}  // namespace

std::string MessageNamedIn(const fs::path& file) {
  std::ifstream text(file);
  for (std::string line; std::getline(text, line) && line.starts_with('#');) {
    constexpr std::string_view kMark = "proto-message:";
    const size_t mark = line.find(kMark);
    if (mark == std::string::npos) continue;
    const size_t begin = line.find_first_not_of(' ', mark + kMark.size());
    if (begin == std::string::npos) return "";
    const std::string name = line.substr(begin, line.find_first_of(" \r", begin) - begin);
    return name.substr(name.rfind('.') + 1);  // with a package or without: rfind's npos + 1 is 0
  }
  return "";
}

fs::path DeployDir() {
  const char* const dir = std::getenv("POISE_DEPLOY_DIR");
  if (dir != nullptr && *dir != '\0') return dir;
  const fs::path prefix = InstalledPrefix();
  return prefix.empty() ? fs::path(POISE_SOURCE_DIR) / "deploy" : prefix / "share" / "poise";
}

std::vector<fs::path> DataFolders() {
  std::vector<fs::path> folders;
  const fs::path own = DeployDir();
  for (const fs::path& prefix : PoisePath()) {
    if (prefix != InstalledPrefix()) folders.push_back(prefix / "share" / "poise");
  }
  folders.push_back(own);
  return folders;
}

std::optional<fs::path> LookForFile(const std::string& kind, const std::string& name,
                                    const fs::path& beside, BaseFiles bases) {
  const bool with_ending = name.ends_with(kEnding);
  const bool refused = bases == BaseFiles::kRefused && !with_ending && IsBase(name);
  if (name.empty() || refused) return {};
  std::error_code error;
  // A path with its ending says that this very file is meant.
  for (const fs::path& file : Candidates(kind, name, beside)) {
    if (fs::is_regular_file(file, error) && (with_ending || !IsOtherKind(kind, file))) return file;
  }
  return {};
}

namespace {

/// "scenario or sweep"
std::string KindNames(const std::vector<std::string>& kinds) {
  std::vector<std::string> names;
  for (const std::string& kind : kinds) {
    names.push_back(kind == "drives" ? kind : kind.substr(0, kind.size() - 1));
  }
  return Joined(names, " or ");
}

/// Names of `kinds` that `name` may have meant by their last part: "heron/heron" of "hero".
std::vector<std::string> NearestLast(const std::string& name, const std::set<std::string>& names) {
  std::vector<std::string> last, found;
  for (const std::string& each : names) last.push_back(fs::path(each).filename().string());
  for (const std::string& near : Nearest(fs::path(name).filename().string(), last)) {
    for (const std::string& each : names) {
      const bool meant = fs::path(each).filename() == near;
      if (meant && !IsAmong(each, found)) found.push_back(each);
    }
  }
  return found;
}

[[noreturn]] void FailToFind(const std::vector<std::string>& kinds, const std::string& name,
                             const fs::path& beside, BaseFiles bases) {
  if (name.empty()) throw ConfigError(fmt::format("no {} is named", KindNames(kinds)));
  const std::string ending = fs::path(name).extension();
  if (kinds == std::vector<std::string>{"robots"} && (ending == ".urdf" || ending == ".xml")) {
    throw ConfigError(
        fmt::format("{}: is a maker's file: `poise robot import {}` writes the robot's folder, and "
                    "that is named here",
                    name, name));
  }
  std::error_code error;
  if (const fs::path folder = beside / name; fs::is_directory(folder, error)) {
    std::vector<std::string> texts;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      if (entry.path().extension() != kEnding) continue;
      texts.push_back((fs::path(name) / entry.path().filename()).lexically_normal().string());
    }
    std::ranges::sort(texts);
    throw ConfigError(fmt::format("{} is a folder, no {}; {}", name, KindNames(kinds),
                                  texts.empty() ? "it holds no .pbtxt file"
                                                : "name one of its files: " + Joined(texts, ", ")));
  }
  std::vector<std::string> searched;
  std::set<std::string> names, listed;
  for (const std::string& kind : kinds) {
    const std::vector<fs::path> candidates = Candidates(kind, name, beside);
    for (const fs::path& file : candidates) {
      std::error_code error;
      const bool there = fs::is_regular_file(file, error);
      const bool other = there && IsOtherKind(kind, file);
      std::string place = file.string();
      if (other) {
        place += fmt::format(" (which says that it is a {})", MessageNamedIn(file));
      } else if (there && bases == BaseFiles::kRefused && IsBase(name)) {
        place += " (which others build on: name the file itself to run it)";
      }
      if (!IsAmong(place, searched)) searched.push_back(place);
    }
    // A file beside may be of any kind: it is named where its name is near alone.
    names.merge(NamesThere(candidates, name));
    if (name.ends_with(kEnding)) continue;
    for (const std::string& each : ListNames(kind)) listed.insert(each);
  }
  std::set<std::string> all = names;
  all.insert(listed.begin(), listed.end());
  all.erase(name);  // a file of that name is of another kind
  if (bases == BaseFiles::kRefused) {
    std::erase_if(all, IsBase);
    std::erase_if(listed, IsBase);
  }
  std::vector<std::string> meant = Nearest(name, {all.begin(), all.end()});
  if (meant.empty()) meant = NearestLast(name, all);
  const std::set<std::string>& has = name.ends_with(kEnding) ? all : listed;
  const std::string near = !meant.empty() ? fmt::format("did you mean {}?; ", Joined(meant, " or "))
                           : has.empty()  ? ""
                                          : Suggest(name, {has.begin(), has.end()}) + "; ";
  throw ConfigError(fmt::format("no {} named '{}'; {}searched: {}", KindNames(kinds), name, near,
                                Joined(searched, ", ")));
}

}  // namespace

fs::path FindFile(const std::string& kind, const std::string& name, const fs::path& beside,
                  BaseFiles bases) {
  if (auto file = LookForFile(kind, name, beside, bases)) return *file;
  FailToFind({kind}, name, beside, bases);
}

fs::path FindFileOfKinds(const std::vector<std::string>& kinds, const std::string& name,
                         const fs::path& beside) {
  for (const std::string& kind : kinds) {
    if (auto file = LookForFile(kind, name, beside)) return *file;
  }
  FailToFind(kinds, name, beside, BaseFiles::kRefused);
}

std::vector<std::string> ListNames(const std::string& kind) {
  std::set<std::string> names;
  for (const fs::path& folder : DataFolders()) {
    const fs::path dir = folder / kind;
    std::error_code error;
    if (!fs::is_directory(dir, error)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(dir, error)) {
      if (entry.path().extension() != kEnding) continue;
      const std::string name = fs::relative(entry.path(), dir).replace_extension().string();
      if (!IsBase(name)) names.insert(name);
    }
    if (error) throw ConfigError(fmt::format("{}: {}", dir.string(), error.message()));
  }
  return {names.begin(), names.end()};
}

fs::path InstalledFile(const std::string& kind, const std::string& name) {
  std::error_code error;
  for (const fs::path& folder : DataFolders()) {
    const fs::path file = folder / kind / (name + kEnding);
    if (fs::is_regular_file(file, error)) return file;
  }
  return DeployDir() / kind / (name + kEnding);
}

}  // namespace poise
