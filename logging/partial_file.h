// Files that are there whole or not at all.
#pragma once

#include <string>

namespace poise::logging {

/// A file under way: written as part(), which becomes the file at Keep and is removed otherwise, by
/// SIGINT, SIGTERM, SIGHUP and SIGPIPE too where they would end the process. What is no file (a
/// device, a pipe) is written itself.
class PartialFile {
 public:
  /// Throws LogError: `path` is an event log, which nothing replaces; the part cannot be made or
  /// exists.
  explicit PartialFile(const std::string& path);
  ~PartialFile();
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  /// Path to write to.
  const std::string& part() const { return part_; }
  /// To be called when all is written and closed. Throws LogError.
  void Keep();

 private:
  static void OnSignal(int signal);
  void Enlist();
  void Delist();

  std::string path_;
  std::string part_;
  bool pending_ = false;         // the part is there and is not the file itself
  PartialFile* next_ = nullptr;  // of the list that the signal handler goes through
};

}  // namespace poise::logging
