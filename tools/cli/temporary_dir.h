// A folder that goes with what is done in it.
#pragma once

#include <filesystem>
#include <string>

namespace poise {

class TemporaryDir {
 public:
  /// PREFIX-XXXXXX in the system's folder for such. Throws std::system_error.
  explicit TemporaryDir(const std::string& prefix);
  ~TemporaryDir();
  TemporaryDir(const TemporaryDir&) = delete;
  TemporaryDir& operator=(const TemporaryDir&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace poise
