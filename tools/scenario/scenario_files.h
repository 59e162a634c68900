// A scenario's file and the files it is based on.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/scenario/based_files.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {

/// Where a field of the merged scenario was written.
struct FieldPlace {
  std::string file;
  int line = 0;       ///< from 1
  std::string field;  ///< its path in that file: list indexes count that file's own elements
};

/// Scenario.base followed to its end. Immutable.
class ScenarioFiles {
 public:
  /// Reads `file`, its base (FindFile), and so on. Throws ConfigError "file:line: base: problem":
  /// no such file, bases that form a loop; and ParseTextProto's. `overlay`: a file of the same kind
  /// without a base, whose fields come last, but for `graph` (other than the default) and
  /// `drive_profile` where the scenario has its own; empty: none.
  explicit ScenarioFiles(const std::filesystem::path& file,
                         const std::filesystem::path& overlay = {});

  /// All fields: the furthest base's first, single values replaced, lists appended, what a file
  /// removes left out. `base` and `remove` are gone. Throws ConfigError "file:line: remove[i]:
  /// problem": the base does not set it.
  Scenario Merged() const;
  const std::string& file() const { return files_[own_].name; }
  /// The place of `field`, a path in the merged scenario, or of the nearest enclosing field that
  /// any file sets; of several files, of the one that counts. `line` 0 and the scenario's own file
  /// when there is none.
  FieldPlace Locate(std::string_view field) const;
  /// Folder to which a file name in `field`, a path in the merged scenario, is relative.
  std::filesystem::path FolderOf(std::string_view field) const;

 private:
  using File = BasedFile<Scenario>;
  /// The file that Locate finds, and the field's path in it; nullptr: there is none.
  std::pair<const File*, std::string> Find(std::string_view field) const;

  std::vector<File> files_;  // the furthest base first, the overlay last
  size_t own_ = 0;           // the scenario's
};

}  // namespace poise
