// A robot's dynamics on arrays.
#include <algorithm>
#include <limits>
#include <set>

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

struct Quantity {
  const char* name;
  Needs needs;
  /// Shape for k joints, m contact rows.
  std::vector<py::ssize_t> (*shape)(py::ssize_t k, py::ssize_t m);
  /// Writes the numbers in C order.
  void (*write)(const WholeBody& body, const robot::RobotState& state,
                const Eigen::Ref<const Eigen::VectorXd>& torque, double* to);
};

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

double* Put(const Eigen::Ref<const Eigen::MatrixXd>& matrix, double* to) {
  Eigen::Map<RowMajor>(to, matrix.rows(), matrix.cols()) = matrix;
  return to + matrix.size();
}

using Shape = std::vector<py::ssize_t>;
using State = const robot::RobotState&;
using Torque = const Eigen::Ref<const Eigen::VectorXd>&;

const std::vector<Quantity>& Quantities() {
  static const std::vector<Quantity> all = {
      {"foot_pose", Needs::kFeet,
       [](auto, auto) {
         return Shape{2, 4, 4};
       },
       [](const WholeBody& body, State, Torque, double* to) {
         for (const Eigen::Isometry3d& pose : body.data().foot_pose) to = Put(pose.matrix(), to);
       }},
      {"foot_jacobian", Needs::kFeet,
       [](auto k, auto) {
         return Shape{2, 6, k + 6};
       },
       [](const WholeBody& body, State, Torque, double* to) {
         for (const auto& jacobian : body.data().foot_jacobian) to = Put(jacobian, to);
       }},
      {"foot_velocity", Needs::kFeet,
       [](auto, auto) {
         return Shape{2, 6};
       },
       [](const WholeBody& body, State, Torque, double* to) {
         for (const auto& velocity : body.data().foot_velocity) to = Put(velocity, to);
       }},
      {"foot_bias_acceleration", Needs::kFeet,
       [](auto, auto) {
         return Shape{2, 6};
       },
       [](const WholeBody& body, State, Torque, double* to) {
         for (const auto& bias : body.data().foot_bias_acceleration) to = Put(bias, to);
       }},
      {"mass_matrix", Needs::kDynamics,
       [](auto k, auto) {
         return Shape{k + 6, k + 6};
       },
       [](const WholeBody& body, State, Torque, double* to) { Put(body.data().mass_matrix, to); }},
      {"bias", Needs::kDynamics, [](auto k, auto) { return Shape{k + 6}; },
       [](const WholeBody& body, State, Torque, double* to) { Put(body.data().bias, to); }},
      {"gravity", Needs::kDynamics, [](auto k, auto) { return Shape{k + 6}; },
       [](const WholeBody& body, State, Torque, double* to) { Put(body.data().gravity, to); }},
      {"com", Needs::kDynamics, [](auto, auto) { return Shape{3}; },
       [](const WholeBody& body, State, Torque, double* to) { Put(body.data().com, to); }},
      {"com_velocity", Needs::kDynamics, [](auto, auto) { return Shape{3}; },
       [](const WholeBody& body, State, Torque, double* to) { Put(body.data().com_velocity, to); }},
      {"com_jacobian", Needs::kDynamics,
       [](auto k, auto) {
         return Shape{3, k + 6};
       },
       [](const WholeBody& body, State, Torque, double* to) { Put(body.data().com_jacobian, to); }},
      {"com_bias_acceleration", Needs::kDynamics, [](auto, auto) { return Shape{3}; },
       [](const WholeBody& body, State, Torque, double* to) {
         Put(body.data().com_bias_acceleration, to);
       }},
      {"momentum", Needs::kDynamics, [](auto, auto) { return Shape{6}; },
       [](const WholeBody& body, State state, Torque, double* to) {
         to = Put(body.data().total_mass * body.data().com_velocity, to);
         Put(balance::AngularMomentum(state, body.data()), to);
       }},
      {"momentum_matrix", Needs::kDynamics,
       [](auto k, auto) {
         return Shape{6, k + 6};
       },
       [](const WholeBody& body, State, Torque, double* to) {
         to = Put(body.data().total_mass * body.data().com_jacobian, to);
         Eigen::MatrixXd rows(3, body.model().num_velocities());
         Eigen::Vector3d bias;
         balance::ComputeAngularMomentumRows(body.data(), rows, &bias);
         Put(rows, to);
       }},
      {"momentum_bias", Needs::kDynamics, [](auto, auto) { return Shape{6}; },
       [](const WholeBody& body, State, Torque, double* to) {
         to = Put(body.data().total_mass * body.data().com_bias_acceleration, to);
         Eigen::MatrixXd rows(3, body.model().num_velocities());
         Eigen::Vector3d bias;
         balance::ComputeAngularMomentumRows(body.data(), rows, &bias);
         Put(bias, to);
       }},
      {"contact_jacobian", Needs::kContacts,
       [](auto k, auto m) {
         return Shape{m, k + 6};
       },
       [](const WholeBody& body, State, Torque, double* to) {
         Put(body.contact().contact_jacobian(), to);
       }},
      {"lambda_c", Needs::kContacts,
       [](auto, auto m) {
         return Shape{m, m};
       },
       [](const WholeBody& body, State, Torque, double* to) {
         Put(body.contact().lambda_c(), to);
       }},
      {"mu_c", Needs::kContacts, [](auto, auto m) { return Shape{m}; },
       [](const WholeBody& body, State, Torque, double* to) { Put(body.contact().mu_c(), to); }},
      {"p_c", Needs::kContacts, [](auto, auto m) { return Shape{m}; },
       [](const WholeBody& body, State, Torque, double* to) { Put(body.contact().p_c(), to); }},
      {"jc_bar_transpose", Needs::kContacts,
       [](auto k, auto m) {
         return Shape{m, k + 6};
       },
       [](const WholeBody& body, State, Torque, double* to) {
         Put(body.contact().jc_bar_transpose(), to);
       }},
      {"w", Needs::kContacts,
       [](auto k, auto) {
         return Shape{k, k};
       },
       [](const WholeBody& body, State, Torque, double* to) { Put(body.contact().w(), to); }},
      {"w_pinv", Needs::kContacts,
       [](auto k, auto) {
         return Shape{k, k};
       },
       [](const WholeBody& body, State, Torque, double* to) { Put(body.contact().w_pinv(), to); }},
      {"gravity_torque", Needs::kContacts, [](auto k, auto) { return Shape{k}; },
       [](const WholeBody& body, State, Torque, double* to) {
         Eigen::VectorXd torque(body.model().num_joints());
         balance::GravityCompensation(body.contact(), torque);
         Put(torque, to);
       }},
      {"wrench", Needs::kTorque, [](auto, auto m) { return Shape{m}; },
       [](const WholeBody& body, State, Torque torque, double* to) {
         Eigen::VectorXd wrench(body.contact().num_contact_rows());
         body.contact().ExpectedWrench(torque, wrench);
         Put(wrench, to);
       }},
      {"acceleration", Needs::kTorque, [](auto k, auto) { return Shape{k + 6}; },
       [](const WholeBody& body, State, Torque torque, double* to) {
         Eigen::VectorXd acceleration(body.model().num_velocities());
         body.contact().Acceleration(torque, acceleration);
         Put(acceleration, to);
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
    std::vector<py::ssize_t> shape = found->shape(k, m);
    py::ssize_t size = 1;
    for (const py::ssize_t n : shape) size *= n;
    shape.insert(shape.begin(), count);
    py::array_t<double> array(shape);
    wanted.push_back({&*found, array.mutable_data(), size});
    results[py::str(name)] = array;
  }
  if (most >= Needs::kContacts && m == 0) {
    throw py::value_error("in_contact: a foot must be in contact");
  }
  const double* const torques = torque ? torque->data() : nullptr;
  const StatePointers pointers = states.Pointers();
  const py::gil_scoped_release released;
  WholeBody body(robot.shared());
  robot::RobotState state(robot.model().num_joints());
  Eigen::VectorXd now = Eigen::VectorXd::Zero(k);
  for (py::ssize_t i = 0; i < count; ++i) {
    bool good = pointers.Read(i, &state);
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
        each.quantity->write(body, state, now, to);
      } else {
        std::fill_n(to, each.size, std::numeric_limits<double>::quiet_NaN());
      }
    }
  }
  return results;
}

py::array_t<double> PointJacobian(const RobotHandle& robot, const StateArrays& states,
                                  const std::string& frame, const std::array<double, 3>& point) {
  const py::ssize_t count = states.Check(robot.model());
  const robot::Frame* const found = robot.model().FindFrame(frame);
  if (found == nullptr) throw ConfigError(fmt::format("the robot has no link '{}'", frame));
  const py::ssize_t n = robot.model().num_velocities();
  py::array_t<double> result({count, py::ssize_t{6}, n});
  double* const to = result.mutable_data();
  const StatePointers pointers = states.Pointers();
  const py::gil_scoped_release released;
  RobotData data(robot.model());
  robot::RobotState state(robot.model().num_joints());
  robot::Matrix6X jacobian(6, n);
  const Eigen::Vector3d at = found->pose * Eigen::Vector3d(point[0], point[1], point[2]);
  for (py::ssize_t i = 0; i < count; ++i) {
    if (pointers.Read(i, &state)) {
      robot::ComputeKinematics(robot.model(), state, &data);
      robot::ComputePointJacobian(robot.model(), data, found->body, at, jacobian);
    } else {
      jacobian.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    Put(jacobian, to + i * 6 * n);
  }
  return result;
}

py::array_t<double> FramePose(const RobotHandle& robot, const StateArrays& states,
                              const std::string& frame) {
  const py::ssize_t count = states.Check(robot.model());
  const robot::Frame* const found = robot.model().FindFrame(frame);
  if (found == nullptr) throw ConfigError(fmt::format("the robot has no link '{}'", frame));
  py::array_t<double> result({count, py::ssize_t{4}, py::ssize_t{4}});
  double* const to = result.mutable_data();
  const StatePointers pointers = states.Pointers();
  const py::gil_scoped_release released;
  RobotData data(robot.model());
  robot::RobotState state(robot.model().num_joints());
  for (py::ssize_t i = 0; i < count; ++i) {
    Eigen::Matrix4d pose = Eigen::Matrix4d::Constant(std::numeric_limits<double>::quiet_NaN());
    if (pointers.Read(i, &state)) {
      robot::ComputeKinematics(robot.model(), state, &data);
      const auto b = static_cast<size_t>(found->body);
      Eigen::Isometry3d body = Eigen::Isometry3d::Identity();
      body.linear() = data.body_rotation[b];
      body.translation() = data.base_position + data.body_position[b];
      pose = (body * found->pose).matrix();
    }
    Put(pose, to + 16 * i);
  }
  return result;
}

py::array_t<double> InverseDynamicsOf(const RobotHandle& robot, const StateArrays& states,
                                      const Array& acceleration) {
  const py::ssize_t count = states.Check(robot.model());
  const py::ssize_t n = robot.model().num_velocities();
  CheckShape(acceleration, "acceleration", count, {n});
  py::array_t<double> result({count, n});
  double* const to = result.mutable_data();
  const double* const from = acceleration.data();
  const StatePointers pointers = states.Pointers();
  const py::gil_scoped_release released;
  RobotData data(robot.model());
  robot::RobotState state(robot.model().num_joints());
  Eigen::VectorXd force(n), wanted(n);
  for (py::ssize_t i = 0; i < count; ++i) {
    if (pointers.Read(i, &state)) {
      wanted = Eigen::Map<const Eigen::VectorXd>(from + i * n, n);
      robot::ComputeKinematics(robot.model(), state, &data);
      robot::InverseDynamics(robot.model(), state, data, wanted, force);
    } else {
      force.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    Put(force, to + i * n);
  }
  return result;
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

template <class Of>
auto ByJoint(const RobotHandle& robot, const Of& of) {
  py::array_t<double> array(robot.model().num_joints());
  for (int j = 0; j < robot.model().num_joints(); ++j) {
    array.mutable_at(j) = of(robot.model().joints()[static_cast<size_t>(j)]);
  }
  return array;
}

}  // namespace

void BindRobot(py::module_* module) {
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
      .def_property_readonly("joint_names",
                             [](const RobotHandle& r) {
                               std::vector<std::string> names;
                               for (const auto& joint : r.model().joints()) {
                                 names.push_back(joint.name);
                               }
                               return names;
                             })
      .def_property_readonly("body_names",
                             [](const RobotHandle& r) {
                               std::vector<std::string> names;
                               for (const auto& body : r.model().bodies()) {
                                 names.push_back(body.name);
                               }
                               return names;
                             })
      .def_property_readonly("frame_names",
                             [](const RobotHandle& r) {
                               std::vector<std::string> names;
                               for (const auto& frame : r.model().frames()) {
                                 names.push_back(frame.name);
                               }
                               return names;
                             })
      .def_property_readonly("foot_names",
                             [](const RobotHandle& r) {
                               std::vector<std::string> names;
                               for (const auto& foot : r.model().feet()) names.push_back(foot.name);
                               return names;
                             })
      .def_property_readonly("sole_size",
                             [](const RobotHandle& r) {
                               std::vector<std::pair<double, double>> sizes;
                               for (const auto& foot : r.model().feet())
                                 sizes.emplace_back(foot.length, foot.width);
                               return sizes;
                             })
      .def_property_readonly("joint_lower",
                             [](const RobotHandle& r) {
                               return ByJoint(r, [](const auto& joint) { return joint.lower; });
                             })
      .def_property_readonly("joint_upper",
                             [](const RobotHandle& r) {
                               return ByJoint(r, [](const auto& joint) { return joint.upper; });
                             })
      .def_property_readonly("joint_effort", [](const RobotHandle& r) {
        return ByJoint(r, [](const auto& joint) { return joint.effort; });
      });
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
