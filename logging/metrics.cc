#include "logging/metrics.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "components/messages/conversions.h"
#include "fmt/format.h"

namespace poise::logging {
namespace {

constexpr const char* kAxis[] = {"x", "y", "z"};
constexpr const char* kFoot[] = {"right", "left"};
constexpr double kMilli = 1e3;  // m to mm, rad to mrad

using List = std::vector<Metric>;

Answer Scaled(Answer value, double factor) {
  if (value) *value *= factor;
  return value;
}

void AddOutcome(List* list) {
  list->push_back({"duration_reached", "s", "simulated time of the run",
                   [](const RunRecord& run) { return Answer(run.time(run.num_ticks)); }});
  list->push_back({"fallen", "", "ticks in which the robot lay fallen (ground truth)",
                   [](const RunRecord& run) {
                     return CountTicks(run, [&](int64_t t) -> std::optional<bool> {
                       const ground_truth_t* truth = run.truth.at(t);
                       if (truth == nullptr) return {};
                       return truth->fallen != 0;
                     });
                   }});
  const auto count_all = [&](const char* name, const char* text, auto holds) {
    list->push_back({name, "", text, [holds](const RunRecord& run) -> Answer {
                       Answer count;
                       for (int64_t t = 0; t < run.num_ticks; ++t) {
                         const std::optional<bool> held = holds(run, t);
                         if (held) count = count.value_or(0) + (*held ? 1 : 0);
                       }
                       return count;
                     }});
  };
  count_all("task_not_ok_ticks", "ticks of the whole run without a task torque",
            [](const RunRecord& run, int64_t t) -> std::optional<bool> {
              const task_torque_t* task = run.task.at(t);
              if (task == nullptr) return {};
              return task->status != task_torque_t::STATUS_OK &&
                     task->status != task_torque_t::STATUS_WAITING;
            });
  count_all("balance_not_ok_ticks",
            "ticks of the whole run without balance torque for want of state",
            [](const RunRecord& run, int64_t t) -> std::optional<bool> {
              const balance_torque_t* balance = run.balance.at(t);
              if (balance == nullptr) return {};
              return balance->status == balance_torque_t::STATUS_SINGULAR ||
                     balance->status == balance_torque_t::STATUS_INVALID_STATE;
            });
  count_all("command_not_ok_ticks", "ticks of the whole run with a command of invalid input",
            [](const RunRecord& run, int64_t t) -> std::optional<bool> {
              const joint_command_t* command = run.command.at(t);
              if (command == nullptr) return {};
              return command->status == joint_command_t::STATUS_INVALID_INPUT;
            });
  count_all("waiting_ticks", "ticks of the whole run in which a phase's unloading was held back",
            [](const RunRecord& run, int64_t t) -> std::optional<bool> {
              const task_torque_t* task = run.task.at(t);
              if (task == nullptr) return {};
              return task->status == task_torque_t::STATUS_WAITING;
            });
  list->push_back({"last_phase", "", "index of the scenario's phase at the end, from 0",
                   [](const RunRecord& run) -> Answer {
                     const task_torque_t* task = run.task.at(run.num_ticks - 1);
                     if (task == nullptr) return {};
                     return task->phase;
                   }});
  list->push_back({"real_time_factor", "", "simulated time over wall time (informs only)",
                   [](const RunRecord& run) { return run.real_time_factor; }});
}

void AddCom(List* list) {
  for (int axis = 0; axis < 3; ++axis) {
    list->push_back(
        {fmt::format("com_error_max_{}", kAxis[axis]), "mm",
         fmt::format("largest distance of the estimated COM from its reference, {}", kAxis[axis]),
         [axis](const RunRecord& run) {
           return Scaled(
               Maximum(run,
                       [&](int64_t t) -> Answer {
                         const task_torque_t* task = run.task.at(t);
                         if (task == nullptr) return {};
                         return std::abs(task->com_position[axis] - task->com_desired[axis]);
                       }),
               kMilli);
         }});
  }
  for (int axis = 0; axis < 3; ++axis) {
    list->push_back(
        {fmt::format("com_error_true_max_{}", kAxis[axis]), "mm",
         fmt::format("largest distance of the true COM from its reference, {}", kAxis[axis]),
         [axis](const RunRecord& run) {
           return Scaled(
               Maximum(run,
                       [&](int64_t t) -> Answer {
                         const task_torque_t* task = run.task.at(t);
                         const ground_truth_t* truth = run.truth.at(t);
                         if (task == nullptr || truth == nullptr) return {};
                         return std::abs(truth->com_position[axis] - task->com_desired[axis]);
                       }),
               kMilli);
         }});
  }
  list->push_back(
      {"com_error_end", "mm", "distance of the true COM from its reference at the end",
       [](const RunRecord& run) -> Answer {
         const task_torque_t* task = run.task.at(run.num_ticks - 1);
         const ground_truth_t* truth = run.truth.at(run.num_ticks - 1);
         if (task == nullptr || truth == nullptr) return {};
         return kMilli * (GetVector3(truth->com_position) - GetVector3(task->com_desired)).norm();
       }});
  list->push_back({"orientation_error_max", "mrad", "largest error of the body's orientation",
                   [](const RunRecord& run) {
                     return Scaled(Maximum(run,
                                           [&](int64_t t) -> Answer {
                                             const task_torque_t* task = run.task.at(t);
                                             if (task == nullptr) return {};
                                             return GetVector3(task->body_orientation_error).norm();
                                           }),
                                   kMilli);
                   }});
  for (int foot = 0; foot < 2; ++foot) {
    for (int axis = 0; axis < 3; ++axis) {
      list->push_back(
          {fmt::format("{}_foot_error_max_{}", kFoot[foot], kAxis[axis]), "mm",
           fmt::format("largest distance of the {} foot from its reference while off the ground, "
                       "{}",
                       kFoot[foot], kAxis[axis]),
           [foot, axis](const RunRecord& run) {
             return Scaled(Maximum(run,
                                   [&](int64_t t) -> Answer {
                                     const auto f = static_cast<size_t>(foot);
                                     const task_torque_t* task = run.task.at(t);
                                     if (task == nullptr || task->in_contact[f] != 0) return {};
                                     return std::abs(task->foot_pose[f].position[axis] -
                                                     task->foot_desired[f].position[axis]);
                                   }),
                           kMilli);
           }});
    }
  }
}

void AddBalancing(List* list) {
  const auto add = [&](const char* name, const char* unit, const char* text, auto field) {
    list->push_back({name, unit, text, [field](const RunRecord& run) -> Answer {
                       const auto balancing = Balancing(run);
                       if (!balancing) return {};
                       return field(*balancing);
                     }});
  };
  const auto if_on = [](auto field) {
    return [field](const BalancingIntervals& b) -> Answer {
      if (b.activations == 0) return {};
      return b.*field;
    };
  };
  add("balancing_first", "s", "balancing first on", if_on(&BalancingIntervals::first));
  add("balancing_last", "s", "balancing last on", if_on(&BalancingIntervals::last));
  add("balancing_active", "s", "time with balancing on, in sum",
      [](const BalancingIntervals& b) -> Answer { return b.active; });
  add("balancing_activations", "", "times that balancing was switched on",
      [](const BalancingIntervals& b) -> Answer { return b.activations; });
}

void AddCop(List* list) {
  const auto add = [&](const char* name, const char* text, auto value) {
    for (int axis = 0; axis < 2; ++axis) {
      list->push_back({fmt::format("{}_{}", name, kAxis[axis]), "mm",
                       fmt::format("{}, {} in frame O", text, kAxis[axis]),
                       [axis, value](const RunRecord& run) {
                         return Scaled(Maximum(run, [&](int64_t t) { return value(run, t, axis); }),
                                       kMilli);
                       }});
    }
  };
  using Field = double(balance_torque_t::*)[2];
  const auto of = [](Field field) {
    return [field](const RunRecord& run, int64_t t, int axis) -> Answer {
      const balance_torque_t* balance = run.balance.at(t);
      if (balance == nullptr) return {};
      return std::abs((balance->*field)[axis]);
    };
  };
  add("cop_task_max", "largest CoP that the task torque alone would give",
      of(&balance_torque_t::cop_task));
  add("cop_max", "largest CoP of the computed resultant", of(&balance_torque_t::cop));
  add("cop_limit", "limit of the CoP, (37), (38)", of(&balance_torque_t::cop_limit));
  add("cop_excess", "largest computed CoP beyond its limit (negative: inside)",
      [](const RunRecord& run, int64_t t, int axis) -> Answer {
        const balance_torque_t* balance = run.balance.at(t);
        if (balance == nullptr) return {};
        return std::abs(balance->cop[axis]) - balance->cop_limit[axis];
      });
  add("cop_measured_max", "largest CoP of the measured resultant",
      [](const RunRecord& run, int64_t t, int axis) -> Answer {
        const auto cop = MeasuredCop(run, t);
        if (!cop) return {};
        return std::abs((*cop)(axis));
      });
}

void AddContacts(List* list) {
  list->push_back({"violated_ticks", "", "ticks in which a computed wrench breaks a condition",
                   [](const RunRecord& run) {
                     return CountTicks(run, [&](int64_t t) { return Violated(run, t); });
                   }});
  list->push_back({"eta_infeasible_ticks", "", "ticks in which no ratio eta met all conditions",
                   [](const RunRecord& run) {
                     return CountTicks(run, [&](int64_t t) -> std::optional<bool> {
                       const joint_command_t* command = run.command.at(t);
                       if (command == nullptr) return {};
                       return command->eta_feasible == 0;
                     });
                   }});
  const auto eta = [](const RunRecord& run) {
    return [&run](int64_t t) -> Answer {
      const joint_command_t* command = run.command.at(t);
      if (command == nullptr) return {};
      return command->eta;
    };
  };
  list->push_back({"eta_lowest", "", "smallest ratio eta, (61)",
                   [eta](const RunRecord& run) { return Minimum(run, eta(run)); }});
  list->push_back({"eta_highest", "", "largest ratio eta, (61)",
                   [eta](const RunRecord& run) { return Maximum(run, eta(run)); }});
  constexpr const char* kMargin[] = {"normal", "friction", "yaw", "roll", "pitch"};
  for (int foot = 0; foot < 2; ++foot) {
    for (int margin = 0; margin < 5; ++margin) {
      list->push_back(
          {fmt::format("{}_foot_{}_margin", kFoot[foot], kMargin[margin]), margin < 2 ? "N" : "N·m",
           fmt::format("smallest margin of the {} foot's computed wrench, ({})", kFoot[foot],
                       29 + margin),
           [foot, margin](const RunRecord& run) {
             return Minimum(run, [&](int64_t t) { return FootMargin(run, foot, margin, t); });
           }});
    }
  }
  const auto error = [&](const char* name, const char* unit, const char* text, int first) {
    list->push_back({name, unit, text, [first](const RunRecord& run) {
                       double sum = 0;
                       int64_t count = 0;
                       for (int64_t t = run.first_tick; t < run.num_ticks; ++t) {
                         for (int foot = 0; foot < 2; ++foot) {
                           if (const auto e = WrenchError(run, foot, t)) {
                             sum += e->segment<3>(first).squaredNorm();
                             ++count;
                           }
                         }
                       }
                       if (count == 0) return Answer();
                       return Answer(std::sqrt(sum / static_cast<double>(count)));
                     }});
  };
  error("foot_force_error_rms", "N", "measured less computed foot force, RMS", 0);
  error("foot_moment_error_rms", "N·m", "measured less computed foot moment, RMS", 3);
}

/// Over ticks and joints.
Answer MaximumOverJoints(const RunRecord& run,
                         const std::function<Answer(int64_t tick, size_t joint)>& value) {
  return Maximum(run, [&](int64_t tick) {
    Answer largest;
    for (size_t joint = 0; joint < run.robot.joints().size(); ++joint) {
      const Answer v = value(tick, joint);
      if (v && (!largest || *v > *largest)) largest = v;
    }
    return largest;
  });
}

void AddTorques(List* list) {
  list->push_back(
      {"joint_torque_max", "N·m", "largest commanded joint torque", [](const RunRecord& run) {
         return MaximumOverJoints(run, [&](int64_t t, size_t joint) -> Answer {
           const joint_command_t* command = run.command.at(t);
           if (command == nullptr) return {};
           return std::abs(command->torque[joint]);
         });
       }});
  list->push_back({"joint_torque_share", "%", "largest commanded joint torque, of its limit",
                   [](const RunRecord& run) {
                     return MaximumOverJoints(run, [&](int64_t t, size_t joint) -> Answer {
                       const joint_command_t* command = run.command.at(t);
                       if (command == nullptr) return {};
                       return 100 * std::abs(command->torque[joint]) / JointTorqueLimit(run, joint);
                     });
                   }});
  list->push_back({"torque_step_max", "N·m", "largest change of a joint's command in one tick",
                   [](const RunRecord& run) {
                     return MaximumOverJoints(run, [&](int64_t t, size_t joint) -> Answer {
                       const joint_command_t* now = run.command.at(t);
                       const joint_command_t* before = run.command.at(t - 1);
                       if (now == nullptr || before == nullptr) return {};
                       return std::abs(now->torque[joint] - before->torque[joint]);
                     });
                   }});
  list->push_back({"saturations", "", "joint-ticks in which the bridge limited the torque",
                   [](const RunRecord& run) {
                     return Maximum(run, [&](int64_t t) -> Answer {
                       const bridge_status_t* bridge = run.bridge.at(t);
                       if (bridge == nullptr) return {};
                       return static_cast<double>(bridge->saturations);
                     });
                   }});
  list->push_back({"bridge_not_running_ticks", "",
                   "ticks in which the bridge was damping, stopping or stopped",
                   [](const RunRecord& run) {
                     return CountTicks(run, [&](int64_t t) -> std::optional<bool> {
                       const bridge_status_t* bridge = run.bridge.at(t);
                       if (bridge == nullptr) return {};
                       return bridge->state > bridge_status_t::STATE_RUNNING;
                     });
                   }});
}

void AddPush(List* list) {
  list->push_back({"push_peak", "N", "largest push, measured", [](const RunRecord& run) {
                     return Maximum(run, [&](int64_t t) -> Answer {
                       const external_push_t* push = run.push.at(t);
                       if (push == nullptr) return {};
                       return GetVector3(push->force).norm();
                     });
                   }});
  list->push_back({"push_impulse", "N·s", "size of the sum of the measured push over time",
                   [](const RunRecord& run) -> Answer {
                     if (run.push.empty()) return {};
                     Eigen::Vector3d sum = Eigen::Vector3d::Zero();
                     for (int64_t t = run.first_tick; t < run.num_ticks; ++t) {
                       if (const external_push_t* push = run.push.at(t)) {
                         sum += GetVector3(push->force) * run.spec.tick_period();
                       }
                     }
                     return sum.norm();
                   }});
}

void AddEstimator(List* list) {
  const auto add = [&](const char* name, const char* unit, const char* text,
                       double EstimatorError::*field, double scale) {
    const auto value = [field](const RunRecord& run) {
      return [&run, field](int64_t t) -> Answer {
        const auto error = BaseError(run, t);
        if (!error) return {};
        return (*error).*field;
      };
    };
    list->push_back(
        {fmt::format("estimator_{}_max", name), unit,
         fmt::format("estimate less truth of the base's {}, largest", text),
         [=](const RunRecord& run) { return Scaled(Maximum(run, value(run)), scale); }});
    list->push_back(
        {fmt::format("estimator_{}_rms", name), unit,
         fmt::format("estimate less truth of the base's {}, RMS", text),
         [=](const RunRecord& run) { return Scaled(RootMeanSquare(run, value(run)), scale); }});
  };
  add("position", "mm", "position", &EstimatorError::position, kMilli);
  add("velocity", "mm/s", "velocity", &EstimatorError::velocity, kMilli);
  add("tilt", "mrad", "tilt", &EstimatorError::tilt, kMilli);
  add("rotation", "mrad", "rotation", &EstimatorError::rotation, kMilli);
}

void AddLog(List* list) {
  const auto add = [&](const char* name, const char* text, int64_t ChannelCompleteness::*field) {
    list->push_back({name, "", text, [field](const RunRecord& run) -> Answer {
                       int64_t sum = 0;
                       for (const ChannelCompleteness& channel : run.channels) {
                         sum += channel.*field;
                       }
                       return static_cast<double>(sum);
                     }});
  };
  add("log_messages", "messages of the graph's channels in the log",
      &ChannelCompleteness::messages);
  add("log_missing", "messages that the log lacks", &ChannelCompleteness::missing);
  add("log_duplicate", "messages that the log holds twice", &ChannelCompleteness::duplicate);
  add("log_out_of_order", "messages in the log before an earlier one",
      &ChannelCompleteness::out_of_order);
  list->push_back({"log_defects", "",
                   "messages missing, twice, out of order or unreadable, and damaged places",
                   [](const RunRecord& run) -> Answer {
                     int64_t sum = run.damages;
                     for (const ChannelCompleteness& c : run.channels) {
                       sum += c.missing + c.duplicate + c.out_of_order + c.refused;
                     }
                     return static_cast<double>(sum);
                   }});
  const auto health = [&](const char* name, const char* text, int64_t health_t::*field) {
    list->push_back({name, "", text, [field](const RunRecord& run) -> Answer {
                       if (run.health.empty()) return {};
                       int64_t sum = 0;
                       for (const auto& [component, health] : run.health) sum += health.*field;
                       return static_cast<double>(sum);
                     }});
  };
  health("packets_refused", "packets that the processes refused", &health_t::messages_refused);
  health("gaps", "messages that the processes had to ask for again", &health_t::gaps);
  health("messages_dropped", "messages dropped on purpose", &health_t::messages_dropped);
  health("publish_errors", "messages that could not be sent", &health_t::publish_errors);
}

List MakeMetrics() {
  List list;
  AddOutcome(&list);
  AddCom(&list);
  AddBalancing(&list);
  AddCop(&list);
  AddContacts(&list);
  AddTorques(&list);
  AddPush(&list);
  AddEstimator(&list);
  AddLog(&list);
  return list;
}

}  // namespace

std::span<const Metric> Metrics() {
  static const List list = MakeMetrics();
  return list;
}

const Metric* FindMetric(std::string_view name) {
  const auto metrics = Metrics();
  const auto metric =
      std::find_if(metrics.begin(), metrics.end(), [&](const Metric& m) { return m.name == name; });
  return metric == metrics.end() ? nullptr : &*metric;
}

}  // namespace poise::logging
