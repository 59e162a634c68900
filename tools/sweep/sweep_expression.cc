#include "tools/sweep/sweep_expression.h"

#include <muParser.h>

#include <cctype>
#include <cmath>
#include <numbers>
#include <vector>

#include "components/framework/configuration/suggest.h"
#include "fmt/format.h"

namespace poise {
namespace {

const std::map<std::string, double>& Constants() {
  static const std::map<std::string, double> constants = {{"pi", std::numbers::pi},
                                                          {"deg", std::numbers::pi / 180}};
  return constants;
}

bool IsFunction(const std::string& name) {
  const mu::Parser parser;
  return parser.GetFunDef().contains(name);
}

}  // namespace

double Evaluate(const std::string& expression, const std::map<std::string, double>& values) {
  if (expression.find_first_not_of(" \t\r\n") == std::string::npos) {
    throw ExpressionError("is empty");
  }
  // Constants, not variables: an expression cannot assign to them.
  mu::Parser parser;
  std::vector<std::string> names;
  double value = 0;
  try {
    for (const auto& all : {Constants(), values}) {
      for (const auto& [name, number] : all) {
        parser.DefineConst(name, number);
        names.push_back(name);
      }
    }
    parser.SetExpr(expression);
    int results = 0;
    const double* const stack = parser.Eval(results);
    if (results != 1) throw ExpressionError("has several values; write one");
    value = stack[0];
  } catch (const mu::Parser::exception_type& error) {
    if (error.GetCode() == mu::ecUNASSIGNABLE_TOKEN && IsExpressionName(error.GetToken())) {
      throw ExpressionError(fmt::format("there is no variable '{}'; {}", error.GetToken(),
                                        Suggest(error.GetToken(), names)));
    }
    std::string problem = error.GetMsg();
    while (!problem.empty() && (problem.back() == '.' || problem.back() == '\n')) {
      problem.pop_back();
    }
    throw ExpressionError(problem);
  }
  if (!std::isfinite(value)) throw ExpressionError(fmt::format("is {}", value));
  return value;
}

bool HasVariable(const std::string& expression, const std::string& name) {
  mu::Parser parser;
  parser.SetExpr(expression);
  return parser.GetUsedVar().contains(name);
}

bool IsExpressionName(const std::string& name) {
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0]))) return false;
  for (const unsigned char c : name) {
    if (!std::isalnum(c) && c != '_') return false;
  }
  return name[0] != '_' && !Constants().contains(name) && !IsFunction(name);
}

}  // namespace poise
