#include "deploy/poise/catalog.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "components/framework/configuration.h"
#include "fmt/format.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 0; i < a.size(); ++i) {
    size_t diagonal = row[0]++;
    for (size_t j = 0; j < b.size(); ++j) {
      const size_t change = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({change, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
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
  if (fs::is_regular_file(path)) return path;
  throw ConfigError(fmt::format("no {} named '{}'; there is {}, or give the path of a .pbtxt file",
                                what, name, Suggest(name, ListNames(kind))));
}

std::vector<std::string> ListNames(const std::string& kind) {
  std::vector<std::string> names;
  const fs::path dir = DeployDir() / kind;
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(dir, error)) {
    if (entry.path().extension() != ".pbtxt") continue;
    names.push_back(fs::relative(entry.path(), dir).replace_extension().string());
  }
  if (error) throw ConfigError(fmt::format("{}: {}", dir.string(), error.message()));
  std::sort(names.begin(), names.end());
  return names;
}

std::string Suggest(const std::string& name, const std::vector<std::string>& candidates) {
  std::vector<std::string> near;
  for (const std::string& candidate : candidates) {
    if (candidate.find(name) != std::string::npos ||
        EditDistance(name, candidate) <= 1 + name.size() / 4) {
      near.push_back(candidate);
    }
  }
  const std::vector<std::string>& shown = near.empty() ? candidates : near;
  if (shown.empty()) return "none";
  std::string text = shown[0];
  for (size_t i = 1; i < shown.size(); ++i) {
    text += (i + 1 == shown.size() ? " or " : ", ") + shown[i];
  }
  return text;
}

}  // namespace poise
