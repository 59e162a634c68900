#include "components/framework/configuration/configuration.h"

#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "components/framework/configuration/added_fields.h"
#include "components/framework/configuration/suggest.h"
#include "components/framework/configuration/text_pattern.h"
#include "fmt/format.h"

namespace poise {
namespace {

/// Keeps the first error: later ones are mostly its consequences.
class FirstError final : public google::protobuf::io::ErrorCollector {
 public:
  explicit FirstError(bool (*passes_over)(std::string_view)) : passes_over_(passes_over) {}
  void AddError(int line, google::protobuf::io::ColumnNumber column,
                const std::string& message) override {
    if (any_) return;
    any_ = true;
    line_ = line;
    column_ = column;
    message_ = message;
  }
  /// The parser warns of a field that there is not where it may pass it over.
  void AddWarning(int line, google::protobuf::io::ColumnNumber column,
                  const std::string& message) override {
    if (passes_over_ != nullptr && !passes_over_(message)) AddError(line, column, message);
  }
  bool any() const { return any_; }
  std::string Describe(std::string_view source) const {
    std::string text = message_;
    for (char& c : text) {
      if (c == '\n') c = ' ';
    }
    text += Meant(text);
    if (line_ < 0) return fmt::format("{}: {}", source, text);
    return fmt::format("{}:{}:{}: {}", source, line_ + 1, column_ + 1, text);
  }

 private:
  /// What the parser does not say of a field that there is not: which one is near.
  static std::string Meant(const std::string& problem) {
    const std::vector<PatternMatch> matches =
        Matches(problem, R"re("([\w.]+)" has no field named "(\w+)")re");
    if (matches.empty()) return "";
    const PatternMatch& parts = matches.front();
    const auto* const type =
        google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(parts[1].text);
    if (type == nullptr) return "";
    std::vector<std::string> names;
    for (int i = 0; i < type->field_count(); ++i) names.push_back(type->field(i)->name());
    const std::vector<std::string> near = Nearest(parts[2].text, names);
    std::string text;
    for (const std::string& name : near) text += (text.empty() ? "" : " or ") + name;
    return text.empty() ? "" : fmt::format(" Did you mean {}?", text);
  }

  bool (*passes_over_)(std::string_view);
  bool any_ = false;
  int line_ = -1;
  int column_ = 0;
  std::string message_;
};

}  // namespace

void ParseTextProto(std::string_view text, std::string_view source,
                    google::protobuf::Message* message,
                    bool (*passes_over)(std::string_view complaint)) {
  FirstError errors(passes_over);
  google::protobuf::TextFormat::Parser parser;
  parser.RecordErrorsTo(&errors);
  parser.SetFinder(AddedFieldFinder());
  parser.AllowUnknownField(passes_over != nullptr);
  const std::string prepared = WithBrackets(text, *message->GetDescriptor());
  google::protobuf::io::ArrayInputStream stream(prepared.data(), static_cast<int>(prepared.size()));
  if (!parser.Parse(&stream, message) || errors.any()) throw ConfigError(errors.Describe(source));
}

void ReadTextProto(const std::string& path, google::protobuf::Message* message) {
  ParseTextProto(ReadFile(path), path, message);
}

std::string ReadFile(const std::string& path) {
  if (std::filesystem::is_directory(path)) {
    throw ConfigError(fmt::format("{}: is a folder, not a file", path));
  }
  std::ifstream in(path, std::ios::binary);
  if (!in) throw ConfigError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (in.bad()) throw ConfigError(fmt::format("{}: cannot be read", path));
  return text;
}

}  // namespace poise
