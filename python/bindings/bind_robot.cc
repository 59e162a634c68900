// A robot's dynamics on arrays.
#include <algorithm>
#include <limits>

#include "components/balance/tasks/centroidal_momentum.h"
#include "components/balance/whole_body.h"
#include "components/robot/dynamics.h"
#include "components/robot/posture.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "python/bindings/bindings.h"
#include "python/bindings/states.h"
#include "tools/scenario/catalog.h"

namespace poise::python {
namespace {

using balance::WholeBody;
using robot::RobotData;
using robot::RobotModel;

/// What a state's evaluation needs.
enum class Needs { kFeet, kDynamics, kContacts, kTorque };

/// What a quantity is computed from.
struct Now {
  const WholeBody& body;
  const robot::RobotState& state;
  const Eigen::VectorXd& torque;
};

// Sizes that depend on the robot and its contacts: joints, velocities, rows of the contacts.
constexpr py::ssize_t kJoints = -1, kVelocities = -2, kContactRows = -3;

struct Quantity {
  const char* name;
  Needs needs;
  Shape shape;
  double* (*write)(const Now& now, double* to);  ///< as Put
};

template <auto kMember>
double* OfData(const Now& now, double* to) {
  return Put(now.body.data().*kMember, to);
}
template <auto kGetter>
double* OfContact(const Now& now, double* to) {
  return Put((now.body.contact().*kGetter)(), to);
}

/// Writes a part of the momentum whose linear one is the mass times `linear`, and whose angular one
/// are the rows (or, where `bias`, their bias) of the angular momentum about the COM.
double* PutMomentum(const Now& now, const Eigen::Ref<const Eigen::MatrixXd>& linear, bool bias,
                    double* to) {
  Eigen::MatrixXd rows(3, now.body.model().num_velocities());
  Eigen::Vector3d bias_of_rows;
  balance::ComputeAngularMomentumRows(now.body.data(), rows, &bias_of_rows);
  to = Put(now.body.data().total_mass * linear, to);
  return bias ? Put(bias_of_rows, to) : Put(rows, to);
}

const std::vector<Quantity>& Quantities() {
  using balance::ContactDynamics;
  constexpr auto k = kJoints, n = kVelocities, m = kContactRows;
  static const std::vector<Quantity> all = {
      {"foot_pose", Needs::kFeet, {2, 4, 4}, OfData<&RobotData::foot_pose>},
      {"foot_jacobian", Needs::kFeet, {2, 6, n}, OfData<&RobotData::foot_jacobian>},
      {"foot_velocity", Needs::kFeet, {2, 6}, OfData<&RobotData::foot_velocity>},
      {"foot_bias_acceleration", Needs::kFeet, {2, 6}, OfData<&RobotData::foot_bias_acceleration>},
      {"mass_matrix", Needs::kDynamics, {n, n}, OfData<&RobotData::mass_matrix>},
      {"bias", Needs::kDynamics, {n}, OfData<&RobotData::bias>},
      {"gravity", Needs::kDynamics, {n}, OfData<&RobotData::gravity>},
      {"com", Needs::kDynamics, {3}, OfData<&RobotData::com>},
      {"com_velocity", Needs::kDynamics, {3}, OfData<&RobotData::com_velocity>},
      {"com_jacobian", Needs::kDynamics, {3, n}, OfData<&RobotData::com_jacobian>},
      {"com_bias_acceleration", Needs::kDynamics, {3}, OfData<&RobotData::com_bias_acceleration>},
      {"momentum",
       Needs::kDynamics,
       {6},
       [](const Now& now, double* to) {
         to = Put(now.body.data().total_mass * now.body.data().com_velocity, to);
         return Put(balance::AngularMomentum(now.state, now.body.data()), to);
       }},
      {"momentum_matrix",
       Needs::kDynamics,
       {6, n},
       [](const Now& now, double* to) {
         return PutMomentum(now, now.body.data().com_jacobian, /*bias=*/false, to);
       }},
      {"momentum_bias",
       Needs::kDynamics,
       {6},
       [](const Now& now, double* to) {
         return PutMomentum(now, now.body.data().com_bias_acceleration, /*bias=*/true, to);
       }},
      {"contact_jacobian", Needs::kContacts, {m, n}, OfContact<&ContactDynamics::contact_jacobian>},
      {"lambda_c", Needs::kContacts, {m, m}, OfContact<&ContactDynamics::lambda_c>},
      {"mu_c", Needs::kContacts, {m}, OfContact<&ContactDynamics::mu_c>},
      {"p_c", Needs::kContacts, {m}, OfContact<&ContactDynamics::p_c>},
      {"jc_bar_transpose", Needs::kContacts, {m, n}, OfContact<&ContactDynamics::jc_bar_transpose>},
      {"w", Needs::kContacts, {k, k}, OfContact<&ContactDynamics::w>},
      {"w_pinv", Needs::kContacts, {k, k}, OfContact<&ContactDynamics::w_pinv>},
      {"gravity_torque",
       Needs::kContacts,
       {k},
       [](const Now& now, double* to) {
         Eigen::VectorXd torque(now.body.model().num_joints());
         balance::GravityCompensation(now.body.contact(), torque);
         return Put(torque, to);
       }},
      {"wrench",
       Needs::kTorque,
       {m},
       [](const Now& now, double* to) {
         Eigen::VectorXd wrench(now.body.contact().num_contact_rows());
         now.body.contact().ExpectedWrench(now.torque, wrench);
         return Put(wrench, to);
       }},
      {"acceleration",
       Needs::kTorque,
       {n},
       [](const Now& now, double* to) {
         Eigen::VectorXd acceleration(now.body.model().num_velocities());
         now.body.contact().Acceleration(now.torque, acceleration);
         return Put(acceleration, to);
       }},
  };
  return all;
}

py::dict Evaluate(const RobotHandle& robot, const std::vector<std::string>& names,
                  const StateArrays& states, const std::array<bool, 2>& in_contact,
                  const std::optional<Array>& torque) {
  const py::ssize_t count = states.Check(robot.model());
  const py::ssize_t k = robot.model().num_joints();
  const py::ssize_t m = 6 * (int{in_contact[0]} + int{in_contact[1]});
  if (torque) CheckShape(*torque, "torque", count, {k});
  struct Wanted {
    const Quantity* quantity;
    double* to;
    py::ssize_t size;
  };
  std::vector<Wanted> wanted;
  py::dict results;
  auto most = Needs::kFeet;
  for (const std::string& name : names) {
    if (results.contains(name)) continue;  // its array would be freed, and written to
    const auto found = std::ranges::find(Quantities(), name, &Quantity::name);
    if (found == Quantities().end()) {
      throw py::key_error(fmt::format("there is no quantity '{}'", name));
    }
    if (found->needs == Needs::kTorque && !torque) {
      throw py::value_error(fmt::format("{}: needs torque", name));
    }
    most = std::max(most, found->needs);
    Shape shape = found->shape;
    for (py::ssize_t& size : shape) {
      size = size == kJoints ? k : size == kVelocities ? k + 6 : size == kContactRows ? m : size;
    }
    const py::ssize_t size = SizeOf(shape);
    shape.insert(shape.begin(), count);
    py::array_t<double> array(shape);
    wanted.push_back({&*found, array.mutable_data(), size});
    results[py::str(name)] = array;
  }
  if (most >= Needs::kContacts && m == 0) {
    throw py::value_error("in_contact: a foot must be in contact");
  }
  const double* const torques = torque ? torque->data() : nullptr;
  const py::gil_scoped_release released;
  WholeBody body(robot.shared());
  robot::RobotState state(robot.model().num_joints());
  Eigen::VectorXd now = Eigen::VectorXd::Zero(k);
  for (py::ssize_t i = 0; i < count; ++i) {
    bool good = states.Read(i, &state);
    if (torques != nullptr) now = Eigen::Map<const Eigen::VectorXd>(torques + i * k, k);
    if (good && most >= Needs::kContacts) {
      good = body.Update(state, in_contact);
    } else if (good && most == Needs::kDynamics) {
      body.UpdateDynamics(state);
    } else if (good) {
      body.UpdateKinematics(state);
    }
    for (const Wanted& each : wanted) {
      double* const to = each.to + i * each.size;
      if (good) {
        each.quantity->write({body, state, now}, to);
      } else {
        std::fill_n(to, each.size, std::numeric_limits<double>::quiet_NaN());
      }
    }
  }
  return results;
}

const robot::Frame& FrameNamed(const RobotHandle& robot, const std::string& name) {
  const robot::Frame* const found = robot.model().FindFrame(name);
  if (found == nullptr) throw ConfigError(fmt::format("the robot has no link '{}'", name));
  return *found;
}

py::array_t<double> PointJacobian(const RobotHandle& robot, const StateArrays& states,
                                  const std::string& name, const std::array<double, 3>& point) {
  const robot::Frame& frame = FrameNamed(robot, name);
  RobotData data(robot.model());
  robot::Matrix6X jacobian(6, robot.model().num_velocities());
  const Eigen::Vector3d at = frame.pose * Eigen::Vector3d(point.data());
  return EachState(robot.model(), states, {}, {6, jacobian.cols()},
                   [&](const robot::RobotState& state, Row, double* to) {
                     robot::ComputeKinematics(robot.model(), state, &data);
                     robot::ComputePointJacobian(robot.model(), data, frame.body, at, jacobian);
                     return Put(jacobian, to);
                   });
}

py::array_t<double> FramePose(const RobotHandle& robot, const StateArrays& states,
                              const std::string& name) {
  const robot::Frame& frame = FrameNamed(robot, name);
  RobotData data(robot.model());
  return EachState(robot.model(), states, {}, {4, 4},
                   [&](const robot::RobotState& state, Row, double* to) {
                     robot::ComputeKinematics(robot.model(), state, &data);
                     const auto b = static_cast<size_t>(frame.body);
                     Eigen::Isometry3d body = Eigen::Isometry3d::Identity();
                     body.linear() = data.body_rotation[b];
                     body.translation() = data.base_position + data.body_position[b];
                     return Put(body * frame.pose, to);
                   });
}

py::array_t<double> InverseDynamicsOf(const RobotHandle& robot, const StateArrays& states,
                                      const Array& acceleration) {
  const py::ssize_t n = robot.model().num_velocities();
  RobotData data(robot.model());
  Eigen::VectorXd force(n), wanted(n);
  return EachState(robot.model(), states, {{acceleration, "acceleration", {n}}}, {n},
                   [&](const robot::RobotState& state, Row from, double* to) {
                     wanted = Eigen::Map<const Eigen::VectorXd>(from[0], n);
                     robot::ComputeKinematics(robot.model(), state, &data);
                     robot::InverseDynamics(robot.model(), state, data, wanted, force);
                     return Put(force, to);
                   });
}

/// The robot standing on level ground in its stance, soles about the world's origin.
py::dict Stance(const RobotHandle& robot) {
  const RobotModel& model = robot.model();
  const robot::RobotState state = robot::SolvePosture(model, robot::StandingGoal(model));
  py::dict result;
  const Eigen::Quaterniond& q = state.base_orientation;
  const std::array<double, 4> orientation = {q.w(), q.x(), q.y(), q.z()};
  result["q"] = py::array_t<double>(state.joint_position.size(), state.joint_position.data());
  result["base_position"] = py::array_t<double>(3, state.base_position.data());
  result["base_orientation"] = py::array_t<double>(4, orientation.data());
  return result;
}

/// A property of a robot: what `of` gives of each element of `list`, a getter of RobotModel.
template <class List, class Of>
auto Each(List list, Of of) {
  return [list, of](const RobotHandle& robot) {
    const auto& elements = (robot.model().*list)();
    std::vector<std::decay_t<std::invoke_result_t<Of, decltype(*elements.begin())>>> all;
    for (const auto& element : elements) all.push_back(std::invoke(of, element));
    return all;
  };
}

}  // namespace

void BindRobot(py::module_* module) {
  const auto name = [](const auto& element) { return element.name; };
  const auto limit = [](double robot::Joint::*of) {
    return [each = Each(&RobotModel::joints, of)](const RobotHandle& robot) {
      return py::array_t<double>(py::cast(each(robot)));
    };
  };
  py::class_<RobotHandle>(*module, "Robot")
      .def_static("named",
                  [](const std::string& name) {
                    const py::gil_scoped_release released;
                    return RobotHandle(robot::LoadRobotFiles(
                        FindFile("robots", name, std::filesystem::current_path()).string()));
                  })
      .def_static("of_texts",
                  [](const std::string& robot, const std::string& maker) {
                    return RobotHandle(robot::LoadRobotTexts(robot, maker));
                  })
      .def("evaluate", &Evaluate, py::arg("names"), py::arg("states"), py::arg("in_contact"),
           py::arg("torque"))
      .def("point_jacobian", &PointJacobian)
      .def("frame_pose", &FramePose)
      .def("inverse_dynamics", &InverseDynamicsOf)
      .def("stance", &Stance)
      .def_property_readonly("name", [](const RobotHandle& r) { return r.model().name(); })
      .def_property_readonly("total_mass",
                             [](const RobotHandle& r) { return r.model().total_mass(); })
      .def_property_readonly("joint_names", Each(&RobotModel::joints, name))
      .def_property_readonly("body_names", Each(&RobotModel::bodies, name))
      .def_property_readonly("frame_names", Each(&RobotModel::frames, name))
      .def_property_readonly("foot_names", Each(&RobotModel::feet, name))
      .def_property_readonly(
          "sole_size", Each(&RobotModel::feet,
                            [](const auto& foot) { return std::pair(foot.length, foot.width); }))
      .def_property_readonly("joint_lower", limit(&robot::Joint::lower))
      .def_property_readonly("joint_upper", limit(&robot::Joint::upper))
      .def_property_readonly("joint_effort", limit(&robot::Joint::effort));
  py::class_<StateArrays>(*module, "States")
      .def(py::init<Array, Array, Array, Array>(), py::arg("q"), py::arg("v"),
           py::arg("base_position"), py::arg("base_orientation"));
  module->def("quantities", [] {
    std::vector<std::string> names;
    for (const Quantity& quantity : Quantities()) names.emplace_back(quantity.name);
    return names;
  });
}

}  // namespace poise::python
