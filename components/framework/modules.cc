#include "components/framework/modules.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <set>

#include "components/framework/build_info.h"
#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "lcmtypes/field_table.h"

namespace poise {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kBuildMark = "poise-module-build:";

std::vector<ComponentType>& Added() {
  static std::vector<ComponentType> added;
  return added;
}

/// The folder of the library or program that holds this function.
fs::path OwnFolder() {
  Dl_info info{};
  std::error_code error;
  if (dladdr(reinterpret_cast<void*>(&InstalledPrefix), &info) != 0 && info.dli_fname != nullptr) {
    const fs::path file = fs::canonical(info.dli_fname, error);
    if (!error) return file.parent_path();
  }
  return fs::read_symlink("/proc/self/exe", error).parent_path();
}

/// Throws when the module was made for another Poise: it would crash, or give wrong numbers.
void CheckBuild(const fs::path& file) {
  const std::string bytes = ReadFile(file.string());
  const size_t at = bytes.find(kBuildMark);
  if (at == std::string::npos) {
    throw ConfigError(fmt::format(
        "{}: is no module of Poise: it has no POISE_MODULE; take it out of lib/poise/modules",
        file.string()));
  }
  const std::string build = bytes.c_str() + at + kBuildMark.size();
  const std::string own = PoiseCommit();
  if (build == own) return;
  throw ConfigError(fmt::format(
      "{}: was built against Poise {}, this is {}; build it anew, or take its folder out of "
      "POISE_PATH",
      file.string(), build.empty() ? "(no commit)" : build, own.empty() ? "(no commit)" : own));
}

void Load(const fs::path& file) {
  CheckBuild(file);
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    throw ConfigError(fmt::format("the module cannot be loaded: {}", dlerror()));
  }
  auto* const enter = reinterpret_cast<void (*)()>(dlsym(library, "poise_module"));
  if (enter == nullptr) {
    throw ConfigError(fmt::format("{}: has no POISE_MODULE", file.string()));
  }
  try {
    enter();
  } catch (const std::exception& error) {
    throw ConfigError(fmt::format("{}: {}", file.string(), error.what()));
  }
  if (!MessageProblems().empty()) {
    throw ConfigError(fmt::format("{}: {}", file.string(), MessageProblems().front()));
  }
}

}  // namespace

void AddComponent(ComponentType type) {
  const auto same = [&](const ComponentType& other) { return other.name == type.name; };
  if (std::any_of(Added().begin(), Added().end(), same)) {
    throw ConfigError(fmt::format("component type {} is there twice", type.name));
  }
  Added().push_back(std::move(type));
}

const std::vector<ComponentType>& AddedComponents() { return Added(); }

fs::path InstalledPrefix() {
  const fs::path folder = OwnFolder();  // PREFIX/lib, PREFIX/bin or PREFIX/lib/poise/bin
  std::error_code error;
  for (const fs::path& prefix : {folder.parent_path(), folder.parent_path().parent_path(),
                                 folder.parent_path().parent_path().parent_path()}) {
    if (fs::is_directory(prefix / "share" / "poise" / "scenarios", error)) return prefix;
  }
  return {};
}

std::vector<fs::path> PoisePath() {
  std::vector<fs::path> folders;
  const char* const path = std::getenv("POISE_PATH");
  std::string_view rest = path == nullptr ? "" : path;
  while (!rest.empty()) {
    const size_t end = std::min(rest.find(':'), rest.size());
    if (end > 0) folders.emplace_back(fs::absolute(rest.substr(0, end)).lexically_normal());
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  if (const fs::path own = InstalledPrefix(); !own.empty()) folders.push_back(own);
  return folders;
}

fs::path FindProgram(const std::string& name) {
  std::error_code error;
  std::vector<fs::path> places;
  for (const fs::path& folder : PoisePath()) places.push_back(folder / "lib" / "poise" / "bin");
  places.push_back(fs::read_symlink("/proc/self/exe", error).parent_path());
  std::string searched;
  for (const fs::path& place : places) {
    if (fs::is_regular_file(place / name, error)) return place / name;
    searched += (searched.empty() ? "" : ", ") + place.string();
  }
  throw ConfigError(fmt::format("there is no program '{}'; searched: {}", name, searched));
}

void LoadModules() {
  static bool done = false;
  if (done) return;
  done = true;
  for (const fs::path& folder : PoisePath()) {
    std::error_code error;
    if (!fs::is_directory(folder, error)) {
      throw ConfigError(fmt::format("POISE_PATH: {}: there is no such folder", folder.string()));
    }
    std::set<fs::path> files;  // in one order everywhere
    for (const auto& entry : fs::directory_iterator(folder / "lib" / "poise" / "modules", error)) {
      if (entry.path().extension() == ".so") files.insert(entry.path());
    }
    for (const fs::path& file : files) Load(file);
  }
}

std::string ModulesSearched() {
  std::vector<std::string> folders;
  for (const fs::path& folder : PoisePath()) {
    folders.push_back((folder / "lib" / "poise" / "modules").string());
  }
  return folders.empty()
             ? "modules with others are looked for in the folders of POISE_PATH, which "
               "is not set"
             : fmt::format("modules with others are looked for in {}", fmt::join(folders, ", "));
}

}  // namespace poise
