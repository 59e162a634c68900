// Scenarios in this process.
#include <pybind11/eigen.h>

#include <algorithm>

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
    if (given.contains(name) && !given[name].is_none()) {
      *to = given[name].cast<std::remove_reference_t<decltype(*to)>>();
    }
  };
  get("set", &changes.set);
  get("without", &changes.without);
  get("ideal", &changes.ideal);
  get("variant", &changes.variant);
  get("robot", &changes.robot);
  get("engine", &changes.world);
  double duration = 0;
  if (given.contains("duration") && !given["duration"].is_none()) {
    get("duration", &duration);
    changes.duration = duration;
  }
  uint64_t seed = 0;
  if (given.contains("seed") && !given["seed"].is_none()) {
    get("seed", &seed);
    changes.seed = seed;
  }
  return changes;
}

std::unique_ptr<Session> Make(const std::string& scenario, const py::dict& changes,
                              const std::map<std::string, py::object>& components,
                              const std::shared_ptr<RunStore>& plant, bool record,
                              const std::string& out, bool force, bool endless) {
  SessionOptions options;
  options.scenario = scenario;
  options.changes = ChangesOf(changes);
  for (const auto& [name, object] : components) options.replaced[name] = FunctionsOf(object);
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

/// What `call` gives, without the interpreter's lock: another thread may be stepping.
template <class Call>
auto Unlocked(const Call& call) {
  const py::gil_scoped_release released;
  return call();
}

Message MessageOf(Session& session, const std::string& channel) {
  Message message;
  message.bytes = Unlocked([&] { return session.Message(channel); });
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
      .def("push",
           [](Session& session, const std::string& body, const std::array<double, 3>& force,
              const std::array<double, 3>& point, int64_t ticks) {
             Unlocked([&] {
               session.Push(body, {force[0], force[1], force[2]}, {point[0], point[1], point[2]},
                            ticks);
               return 0;
             });
           })
      .def("walk",
           [](Session& session, const std::optional<std::array<double, 3>>& velocity) {
             std::optional<Eigen::Vector3d> given;
             if (velocity) given.emplace((*velocity)[0], (*velocity)[1], (*velocity)[2]);
             Unlocked([&] {
               session.Walk(given);
               return 0;
             });
           })
      .def("move",
           [](Session& session, const std::string& joint, double angle, double duration) {
             Unlocked([&] {
               session.Move(joint, angle, duration);
               return 0;
             });
           })
      .def("override_torque",
           [](Session& session, int joint, std::optional<double> torque) {
             Unlocked([&] {
               session.OverrideTorque(joint, torque);
               return 0;
             });
           })
      .def("set_command",
           [](Session& session, const std::optional<std::array<std::vector<double>, 5>>& fields) {
             std::optional<Session::Command> command;
             if (fields) {
               const auto& [torque, position, velocity, stiffness, damping] = *fields;
               command = {torque, position, velocity, stiffness, damping};
             }
             Unlocked([&] {
               session.SetCommand(std::move(command));
               return 0;
             });
           })
      .def("inject",
           [](Session& session, const std::string& channel, const py::bytes& bytes) {
             const std::string text = bytes;
             const std::vector<uint8_t> data(text.begin(), text.end());
             Unlocked([&] {
               session.Inject(channel, data);
               return 0;
             });
           })
      .def("message", &MessageOf, py::keep_alive<0, 1>())
      .def("channels", [](const Session& session) { return session.Channels(); })
      .def("type", [](const Session& session,
                      const std::string& channel) { return session.Type(channel).name; })
      .def("fields",
           [](const Session& session, const std::string& channel) {
             std::vector<std::pair<std::string, std::vector<int64_t>>> fields;
             for (const Leaf& leaf : session.Layout(channel).leaves()) {
               fields.emplace_back(leaf.path, leaf.shape);
             }
             return fields;
           })
      .def("element_names",
           [](const Session& session, const std::string& channel, const std::string& path) {
             return session.names().Of(session.Type(channel).name, path.substr(0, path.find('.')));
           })
      .def("unit",
           [](const Session& session, const std::string& channel, const std::string& path) {
             return UnitOfLeaf(session.Type(channel).name, path);
           })
      .def("finish",
           [](Session& session) {
             return std::const_pointer_cast<RunStore>(Unlocked([&] { return session.Finish(); }));
           })
      .def_property_readonly("tick", [](Session& s) { return Unlocked([&] { return s.tick(); }); })
      .def_property_readonly("time", [](Session& s) { return Unlocked([&] { return s.time(); }); })
      .def_property_readonly("ended",
                             [](Session& s) { return Unlocked([&] { return s.ended(); }); })
      .def_property_readonly("failed",
                             [](Session& s) { return Unlocked([&] { return s.failed(); }); })
      .def_property_readonly("detail",
                             [](Session& s) { return Unlocked([&] { return s.detail(); }); })
      .def_property_readonly("tick_period", [](const Session& s) { return s.spec().tick_period(); })
      .def_property_readonly("num_ticks", [](const Session& s) { return s.spec().num_ticks(); })
      .def_property_readonly("scenario", [](const Session& s) { return s.spec().scenario(); })
      .def_property_readonly("warnings",
                             [](Session& s) { return Unlocked([&] { return s.warnings(); }); })
      .def("robot_texts", [](const Session& s) {
        std::pair<std::string, std::string> texts;
        for (const Resource& resource : s.spec().resource()) {
          if (resource.name() == "robot") texts.first = resource.text();
          if (resource.name() == "urdf") texts.second = resource.text();
        }
        return texts;
      });
}

}  // namespace poise::python
