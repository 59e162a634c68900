// Scenarios in this process.
#include <pybind11/eigen.h>

#include <algorithm>

#include "components/framework/configuration/configuration.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "python/bindings/bindings.h"
#include "python/session.h"

namespace poise::python {
namespace {

/// Between looks at Ctrl-C. Some ms of a run.
constexpr int64_t kTicksAtOnce = 64;

RunChanges ChangesOf(const py::dict& given) {
  RunChanges changes;
  changes.reference = false;
  const auto get = [&](const char* name, auto* to) {
    if (!given.contains(name) || given[name].is_none()) return;
    try {
      *to = given[name].cast<std::remove_reference_t<decltype(*to)>>();
    } catch (const py::cast_error&) {
      throw ConfigError(fmt::format("{}: cannot be {}", name, std::string(py::repr(given[name]))));
    }
  };
  get("set", &changes.set);
  get("without", &changes.without);
  get("ideal", &changes.ideal);
  get("variant", &changes.variant);
  get("robot", &changes.robot);
  get("engine", &changes.world);
  get("duration", &changes.duration);
  get("seed", &changes.seed);
  return changes;
}

std::unique_ptr<Session> Make(const std::string& scenario, const py::dict& changes,
                              const std::map<std::string, py::object>& components,
                              const std::shared_ptr<RunStore>& plant, bool record,
                              const std::string& out, bool force, bool endless) {
  SessionOptions options;
  options.scenario = scenario;
  options.changes = ChangesOf(changes);
  for (const auto& [name, object] : components) {
    if (!py::hasattr(object, "_configure")) {
      throw ConfigError(fmt::format("components: '{}' is {}; derive it from poise.Component", name,
                                    std::string(py::repr(object))));
    }
    options.replaced[name] = FunctionsOf(object);
  }
  options.plant = plant;
  options.keep = !out.empty() ? SessionOptions::Keep::kFolder
                 : record     ? SessionOptions::Keep::kMemory
                              : SessionOptions::Keep::kNothing;
  options.out = out;
  options.force = force;
  options.endless = endless;
  const py::gil_scoped_release released;
  return std::make_unique<Session>(std::move(options));
}

int64_t Step(Session& session, int64_t ticks) {
  int64_t done = 0;
  if (ticks < 0) throw py::value_error("step: the number of ticks must not be negative");
  while (done < ticks) {
    const int64_t asked = std::min(ticks - done, kTicksAtOnce);
    int64_t now = 0;
    {
      const py::gil_scoped_release released;
      now = session.Step(asked);
    }
    done += now;
    if (now < asked) break;
    if (done < ticks && PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  return done;
}

/// Calls without the interpreter's lock: another thread may be stepping.
using Unlocked = py::call_guard<py::gil_scoped_release>;

template <class Of>
py::cpp_function UnlockedGetter(Of (Session::*get)()) {
  return py::cpp_function(get, Unlocked());
}

Message MessageOf(Session& session, const std::string& channel) {
  Message message;
  {
    const py::gil_scoped_release released;
    message.bytes = session.Message(channel);
  }
  // Not owned: the Python object keeps the session.
  message.layout = {std::shared_ptr<const void>(), &session.Layout(channel)};
  message.type = session.Type(channel).name;
  return message;
}

}  // namespace

void BindSession(py::module_* module) {
  py::class_<Session>(*module, "Session")
      .def(py::init(&Make), py::arg("scenario"), py::arg("changes"), py::arg("components"),
           py::arg("plant"), py::arg("record"), py::arg("out"), py::arg("force"),
           py::arg("endless"))
      .def("step", &Step)
      .def("push", &Session::Push, Unlocked())
      .def("walk", &Session::Walk, Unlocked())
      .def("move", &Session::Move, Unlocked())
      .def("override_torque", &Session::OverrideTorque, Unlocked())
      .def(
          "set_command",
          [](Session& session, const std::optional<std::array<std::vector<double>, 5>>& fields) {
            std::optional<Session::Command> command;
            if (fields) {
              const auto& [torque, position, velocity, stiffness, damping] = *fields;
              command = {torque, position, velocity, stiffness, damping};
            }
            session.SetCommand(std::move(command));
          },
          Unlocked())
      .def("message", &MessageOf, py::keep_alive<0, 1>())
      .def("channels", &Session::Channels)
      .def(
          "finish",
          [](Session& session) { return std::const_pointer_cast<RunStore>(session.Finish()); },
          Unlocked())
      .def_property_readonly("tick", UnlockedGetter(&Session::tick))
      .def_property_readonly("time", UnlockedGetter(&Session::time))
      .def_property_readonly("ended", UnlockedGetter(&Session::ended))
      .def_property_readonly("failed", UnlockedGetter(&Session::failed))
      .def_property_readonly("detail", UnlockedGetter(&Session::detail))
      .def_property_readonly("warnings", UnlockedGetter(&Session::warnings))
      .def_property_readonly("tick_period", [](const Session& s) { return s.spec().tick_period(); })
      .def_property_readonly("scenario", [](const Session& s) { return s.spec().scenario(); })
      .def("robot_texts", [](const Session& s) {
        return std::pair(ResourceOf(s.spec(), "robot").text(), ResourceOf(s.spec(), "urdf").text());
      });
}

}  // namespace poise::python
