#include "tools/cli/temporary_dir.h"

#include <cerrno>
#include <cstdlib>
#include <system_error>

namespace poise {

namespace fs = std::filesystem;

TemporaryDir::TemporaryDir(const std::string& prefix) {
  std::string name = (fs::temp_directory_path() / (prefix + "-XXXXXX")).string();
  if (mkdtemp(name.data()) == nullptr) {
    throw std::system_error(errno, std::generic_category(), name);
  }
  path_ = name;
}

TemporaryDir::~TemporaryDir() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace poise
