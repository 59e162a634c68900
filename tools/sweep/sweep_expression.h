// Expressions of a sweep's variables.
#pragma once

#include <map>
#include <stdexcept>
#include <string>

namespace poise {

/// An expression that cannot be used. what() says why, without the expression.
class ExpressionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The value of `expression` (sweep.proto, Assignment.value) with the variables `values`. Throws
/// ExpressionError: what is no expression, an unknown name, a value that is not finite.
double Evaluate(const std::string& expression, const std::map<std::string, double>& values);

/// Whether `expression`, which Evaluate takes, has the variable `name` in it.
bool HasVariable(const std::string& expression, const std::string& name);

/// True for what can be a variable's name in an expression.
bool IsExpressionName(const std::string& name);

}  // namespace poise
