#include "tools/sweep/sweep_results.h"

#include <fcntl.h>
#include <google/protobuf/text_format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/cli/output_place.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr int kVersion = 1;

std::string HeaderText(const SweepHeader& header) {
  std::string sweep;
  google::protobuf::TextFormat::PrintToString(header.sweep, &sweep);
  const nlohmann::ordered_json json = {{"poise_sweep", kVersion},   {"kind", header.kind},
                                       {"digest", header.digest},   {"program", header.program},
                                       {"columns", header.columns}, {"sweep", sweep}};
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

SweepHeader ParseHeader(const std::string& text, const std::string& source) {
  const nlohmann::json json = nlohmann::json::parse(text);
  if (json.at("poise_sweep").get<int>() != kVersion) {
    throw ConfigError(fmt::format("{}: is of another version of poise", source));
  }
  SweepHeader header;
  header.kind = json.at("kind").get<std::string>();
  header.digest = json.at("digest").get<std::string>();
  header.program = json.at("program").get<std::string>();
  header.columns = json.at("columns").get<std::vector<std::string>>();
  ParseTextProto(json.at("sweep").get<std::string>(), source, &header.sweep);
  return header;
}

}  // namespace

void AddRow(const SweepRow& row, const std::string& source, SweepRows* rows) {
  const auto [there, added] = rows->try_emplace({row.run, row.limit.value_or(0)}, row);
  if (added || there->second == row) return;
  if (!there->second.survived() || !row.survived()) {
    if (!there->second.survived()) there->second = row;
    return;
  }
  throw ConfigError(fmt::format("{}: run {} has other results here than before", source, row.run));
}

std::optional<SweepResults> ReadResults(const fs::path& folder) {
  const fs::path path = folder / kResultsFile;
  if (!fs::exists(path)) return {};
  const std::string text = ReadFile(path.string());
  SweepResults results;
  size_t begin = 0;
  for (int line = 1;; ++line) {
    const size_t end = text.find('\n', begin);
    if (end == std::string::npos) break;
    const std::string source = fmt::format("{}:{}", path.string(), line);
    const std::string content = text.substr(begin, end - begin);
    try {
      if (line == 1) {
        results.header = ParseHeader(content, source);
      } else {
        AddRow(SweepRow::Parse(content), source, &results.rows);
      }
    } catch (const ConfigError&) {
      throw;
    } catch (const std::exception& error) {
      throw ConfigError(fmt::format("{}: is no result of a run: {}", source, error.what()));
    }
    begin = results.size = end + 1;
  }
  if (results.size == 0) return {};
  return results;
}

SweepResultsWriter::SweepResultsWriter(const fs::path& folder, const SweepHeader& header,
                                       const std::optional<SweepResults>& found)
    : path_((folder / kResultsFile).string()),
      fd_(open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644)) {
  const auto size = static_cast<off_t>(found ? found->size : 0);
  if (fd_ < 0 || ftruncate(fd_, size) != 0 || lseek(fd_, size, SEEK_SET) != size) {
    throw ConfigError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
  }
  if (found) return;
  Write(HeaderText(header));
  const FileDescriptor dir = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  fsync(dir);  // the file's name, too
}

void SweepResultsWriter::Append(const SweepRow& row) { Write(SweepRow::RowText(row)); }

void SweepResultsWriter::Write(const std::string& line) {
  if (!WriteAll(fd_, line + '\n') || fdatasync(fd_) != 0) {
    throw std::runtime_error(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
  }
}

}  // namespace poise
