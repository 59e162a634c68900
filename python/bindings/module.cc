// The extension module _poise: the C++ half of the Python module poise.
#include "components/framework/build_info.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/modules.h"
#include "components/robot/robot_model.h"
#include "fmt/format.h"
#include "logging/run_log_writer.h"
#include "python/bindings/bindings.h"
#include "tools/scenario/catalog.h"
#include "tools/scenario/described_components.h"
#include "tools/scenario/registry.h"

namespace poise::python {

void CheckShape(const Array& array, const char* name, py::ssize_t count, const Shape& shape) {
  bool right =
      array.ndim() == 1 + static_cast<py::ssize_t>(shape.size()) && array.shape(0) == count;
  std::string wanted = fmt::format("{}", count);
  py::ssize_t i = 1;
  for (const py::ssize_t size : shape) {
    right = right && array.shape(i++) == size;
    wanted += fmt::format(" × {}", size);
  }
  if (right) return;
  std::string is;
  for (py::ssize_t d = 0; d < array.ndim(); ++d) {
    is += fmt::format("{}{}", d == 0 ? "" : " × ", array.shape(d));
  }
  throw py::value_error(
      fmt::format("{}: is {}, must be {}", name, is.empty() ? "a number" : is, wanted));
}

py::array NewArray(const Leaf& leaf, py::ssize_t rows) {
  std::vector<py::ssize_t> shape;
  if (rows >= 0) shape.push_back(rows);
  for (const int64_t size : leaf.shape) shape.push_back(static_cast<py::ssize_t>(size));
  const auto make = [&](auto number) { return py::array_t<decltype(number)>(shape); };
  switch (leaf.number) {
    case Number::kInt8:
      return make(int8_t{});
    case Number::kUint8:
      return make(uint8_t{});
    case Number::kInt16:
      return make(int16_t{});
    case Number::kInt32:
      return make(int32_t{});
    case Number::kInt64:
      return make(int64_t{});
    case Number::kFloat:
      return make(float{});
    case Number::kDouble:
      break;
  }
  return make(double{});
}

PYBIND11_MODULE(_poise, m) {
  m.doc() = "The C++ half of the module poise.";
  static const py::exception<std::runtime_error> error(m, "Error", PyExc_ValueError);
  py::register_exception<robot::RobotError>(m, "RobotError", error);
  py::register_exception<ConfigError>(m, "ConfigError", error);
  py::register_exception<logging::LogError>(m, "LogError", error);
  m.def("version", [] { return VersionText("poise"); });
  m.attr("__version__") = PoiseVersion();
  m.def("names", &ListNames,
        "names of the files of a kind: scenarios, robots, graphs, sweeps, drives");
  LoadModules();
  LoadDescriptions();
  Components();
  BindRun(&m);
  BindComponent(&m);
  BindSession(&m);
  BindRobot(&m);
  BindBalance(&m);
}

}  // namespace poise::python
