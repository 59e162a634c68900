#include "deploy/poise/catalog.h"

#include <algorithm>
#include <cstdlib>

#include "components/framework/configuration.h"
#include "components/framework/suggest.h"
#include "fmt/format.h"

namespace poise {
namespace fs = std::filesystem;

namespace {

/// True for "base/NAME": a file that others are based on, not to be used by itself.
bool IsBase(const fs::path& name) {
  const fs::path folder = name.parent_path();
  return std::find(folder.begin(), folder.end(), "base") != folder.end();
}

}  // namespace

fs::path DeployDir() {
  const char* const dir = std::getenv("POISE_DEPLOY_DIR");
  return dir != nullptr && *dir != '\0' ? fs::path(dir) : fs::path(POISE_SOURCE_DIR) / "deploy";
}

fs::path FindFile(const std::string& kind, const std::string& name, const fs::path& base) {
  const std::string what = kind.substr(0, kind.size() - 1);
  if (name.empty()) throw ConfigError(fmt::format("{}: no name given", what));
  if (name.ends_with(".pbtxt")) {
    const fs::path path = fs::path(name).is_absolute() ? fs::path(name) : base / name;
    if (fs::is_regular_file(path)) return path;
    throw ConfigError(fmt::format("{}: {} does not exist", path.string(), what));
  }
  const fs::path path = DeployDir() / kind / (name + ".pbtxt");
  if (fs::is_regular_file(path) && !IsBase(name)) return path;
  throw ConfigError(fmt::format("no {} named '{}'; {}; or give the path of a .pbtxt file",
                                what, name, Suggest(name, ListNames(kind))));
}

std::vector<std::string> ListNames(const std::string& kind) {
  std::vector<std::string> names;
  const fs::path dir = DeployDir() / kind;
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(dir, error)) {
    if (entry.path().extension() != ".pbtxt") continue;
    const std::string name = fs::relative(entry.path(), dir).replace_extension().string();
    if (!IsBase(name)) names.push_back(name);
  }
  if (error) throw ConfigError(fmt::format("{}: {}", dir.string(), error.message()));
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace poise
