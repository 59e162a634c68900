// What the files of the extension module _poise share.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <string>
#include <vector>

#include "components/messages/foreign_component.h"
#include "python/message_layout.h"

namespace poise::python {

namespace py = pybind11;

/// Numbers in C order; anything that numpy can turn into it is taken.
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

using Shape = std::vector<py::ssize_t>;

/// Throws ValueError unless `array` is `count` × `shape`.
void CheckShape(const Array& array, const char* name, py::ssize_t count, const Shape& shape);

/// An array of a leaf's kind, `rows` × the leaf's shape; rows < 0: the leaf's shape alone. Owns its
/// memory, which is not set.
py::array NewArray(const Leaf& leaf, py::ssize_t rows);

/// One message, by itself.
struct Message {
  std::vector<uint8_t> bytes;
  std::shared_ptr<const MessageLayout> layout;
  std::string type;
};

/// The functions of a Python object with `_configure(context, ports)` and `_step(tick, inputs,
/// outputs)`.
std::shared_ptr<ForeignFunctions> FunctionsOf(py::object component);

void BindRun(py::module_* module);
void BindSession(py::module_* module);
void BindRobot(py::module_* module);
void BindBalance(py::module_* module);
void BindComponent(py::module_* module);

}  // namespace poise::python
