#include "lcmtypes/lcm_parser.h"

#include <cctype>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

namespace poise {
namespace {

struct Token {
  std::string text;
  int line = 0;
};

class Parser {
 public:
  explicit Parser(const std::string& path) : path_(path) {
    std::ifstream in(path);
    if (!in) throw std::runtime_error(path + ": cannot be read");
    std::stringstream text;
    text << in.rdbuf();
    Tokenize(text.str());
  }

  LcmStruct Parse() {
    LcmStruct result;
    result.file = path_;
    Expect("package");
    result.package = Name();
    Expect(";");
    result.line = Peek().line;
    Expect("struct");
    result.name = Name();
    Expect("{");
    while (Peek().text != "}") {
      if (Peek().text == "const") {
        while (Next().text != ";") {
        }
        continue;
      }
      ParseFields(&result);
    }
    Expect("}");
    if (at_ != tokens_.size() - 1)
      Fail(Peek(), "one struct to a file; found '" + Peek().text + "'");
    const std::string stem = path_.substr(path_.find_last_of('/') + 1);
    if (stem != result.name + ".lcm") {
      throw std::runtime_error(path_ + ":" + std::to_string(result.line) + ": struct " +
                               result.name + " must stand in " + result.name + ".lcm");
    }
    return result;
  }

 private:
  void ParseFields(LcmStruct* result) {
    LcmField field;
    const size_t first = result->fields.size();
    field.type = Name();
    do {
      field.line = Peek().line;
      field.name = Name();
      field.dimension.clear();
      if (Peek().text == "[") {
        Next();
        field.dimension = Name();
        Expect("]");
        if (Peek().text == "[") Fail(Peek(), "field " + field.name + ": one dimension only");
      }
      result->fields.push_back(field);
    } while (Next().text == "," || (Back(), false));
    const int line = Peek().line;
    Expect(";");
    const auto comment = comments_.find(line);
    if (comment == comments_.end()) return;
    for (size_t i = first; i < result->fields.size(); ++i) {
      result->fields[i].comment = comment->second;
    }
  }

  void Tokenize(const std::string& text) {
    int line = 1;
    for (size_t i = 0; i < text.size();) {
      const auto c = static_cast<unsigned char>(text[i]);
      if (c == '\n') ++line;
      if (std::isspace(c)) {
        ++i;
      } else if (text.compare(i, 2, "//") == 0) {
        const size_t begin = text.find_first_not_of(" \t", i + 2);
        i = text.find('\n', i);
        if (begin < i) comments_[line] = text.substr(begin, i - begin);
        if (i == std::string::npos) break;
      } else if (text.compare(i, 2, "/*") == 0) {
        for (i += 2; i < text.size() && text.compare(i, 2, "*/") != 0; ++i) line += text[i] == '\n';
        i += 2;
      } else if (std::isalnum(c) || c == '_') {
        size_t end = i;
        while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) ||
                                     text[end] == '_' || text[end] == '.')) {
          ++end;
        }
        tokens_.push_back({text.substr(i, end - i), line});
        i = end;
      } else {
        tokens_.push_back({std::string(1, text[i++]), line});
      }
    }
    tokens_.push_back({"end of file", line});
  }

  [[noreturn]] void Fail(const Token& token, const std::string& problem) const {
    throw std::runtime_error(path_ + ":" + std::to_string(token.line) + ": " + problem);
  }
  const Token& Peek() const { return tokens_[at_]; }
  const Token& Next() {
    if (at_ + 1 >= tokens_.size()) Fail(Peek(), "unexpected end of file");
    return tokens_[at_++];
  }
  void Back() { --at_; }
  void Expect(const std::string& text) {
    const Token token = Next();
    if (token.text != text) Fail(token, "expected '" + text + "', found '" + token.text + "'");
  }
  std::string Name() {
    const Token token = Next();
    const auto c = static_cast<unsigned char>(token.text[0]);
    if (!std::isalnum(c) && c != '_') Fail(token, "expected a name, found '" + token.text + "'");
    return token.text;
  }

  std::string path_;
  std::vector<Token> tokens_;
  std::map<int, std::string> comments_;  // by line
  size_t at_ = 0;
};

}  // namespace

LcmStruct ParseLcmFile(const std::string& path) { return Parser(path).Parse(); }

}  // namespace poise
