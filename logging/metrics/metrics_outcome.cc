#include "logging/metrics/metric_groups.h"
#include "logging/metrics/true_contacts.h"

namespace poise::logging {

void AddOutcome(MetricList* list) {
  const auto duration = [](const RunRecord& run) { return Answer(run.time(run.num_ticks)); };
  list->Add("duration_reached", "s", "simulated time of the run", duration);
  list->Add("duration_reached_reference", "s", "simulated time of the reference run",
            OfReference(duration));
  list->Add(
      "fallen", "",
      "ticks in which the robot was down, in truth: as the simulator says, tilted by more than 1 "
      "rad from its stance at time 0, or with less than half of its COM's height above the soles",
      TicksOf(IsDown));
  const auto count_all = [&](const char* name, const char* text, auto series, auto holds) {
    list->Add(name, "", text, [series, holds](const RunRecord& run) {
      Answer count;
      for (const auto& [tick, message] : Messages(run.*series, 0, run.num_ticks)) {
        count = count.value_or(0) + (holds(*message) ? 1 : 0);
      }
      return count;
    });
  };
  count_all("task_not_ok_ticks", "ticks of the whole run without a task torque", &RunRecord::task,
            [](const task_torque_t& task) { return task.status != task_torque_t::STATUS_OK; });
  count_all("balance_not_ok_ticks",
            "ticks of the whole run without balance torque for want of state or task torque",
            &RunRecord::balance, [](const balance_torque_t& balance) {
              return balance.status == balance_torque_t::STATUS_SINGULAR ||
                     balance.status == balance_torque_t::STATUS_INVALID_STATE ||
                     balance.status == balance_torque_t::STATUS_HELD;
            });
  count_all("command_not_ok_ticks", "ticks of the whole run with a command of invalid input",
            &RunRecord::command, [](const joint_command_t& command) {
              return command.status == joint_command_t::STATUS_INVALID_INPUT;
            });
  count_all("waiting_ticks", "ticks of the whole run in which the schedule was held back",
            &RunRecord::plan, [](const support_plan_t& plan) {
              return plan.status == support_plan_t::STATUS_WAITING;
            });
  list->Add("waiting_time", "s", "time of the whole run in which the schedule was held back",
            [ticks = list->back().compute](const RunRecord& run) {
              return Scaled(ticks(run), run.spec.tick_period());
            });
  list->Add("last_phase", "", "index of the scenario's phase at the end, from 0",
            AtEnd(Of(&RunRecord::planner, [](const auto& planner) { return planner.phase; })));
  list->Add("real_time_factor", "", "simulated time over wall time (informs only)",
            [](const RunRecord& run) { return run.real_time_factor; });
}

void AddLog(MetricList* list) {
  const auto add = [&](const char* name, const char* text, auto of_channel) {
    list->Add(name, "", text, [of_channel](const RunRecord& run) -> Answer {
      int64_t sum = 0;
      for (const ChannelCompleteness& channel : run.channels) sum += channel.*of_channel;
      return static_cast<double>(sum);
    });
  };
  add("log_messages", "messages of the graph's channels in the log",
      &ChannelCompleteness::messages);
  add("log_missing", "messages that the log lacks", &ChannelCompleteness::missing);
  add("log_duplicate", "messages that the log holds twice", &ChannelCompleteness::duplicate);
  add("log_out_of_order", "messages in the log before an earlier one",
      &ChannelCompleteness::out_of_order);
  list->Add("log_defects", "",
            "messages missing (in real time components skip ticks: not counted there), twice, "
            "out of order or unreadable, and damaged places",
            [](const RunRecord& run) -> Answer {
              int64_t sum = run.damages;
              for (const ChannelCompleteness& c : run.channels) {
                sum += (run.spec.realtime() ? 0 : c.missing) + c.duplicate + c.out_of_order +
                       c.refused;
              }
              return static_cast<double>(sum);
            });
  const auto health = [&](const char* name, const char* text, int64_t health_t::*field) {
    list->Add(name, "", text, [field](const RunRecord& run) -> Answer {
      if (run.health.empty()) return {};
      int64_t sum = 0;
      for (const auto& [component, health] : run.health) sum += health.*field;
      return static_cast<double>(sum);
    });
  };
  health("packets_refused", "packets that the processes refused", &health_t::messages_refused);
  health("gaps", "messages that the processes had to ask for again", &health_t::gaps);
  health("messages_dropped", "messages dropped on purpose", &health_t::messages_dropped);
  health("publish_errors", "messages that could not be sent", &health_t::publish_errors);
}

}  // namespace poise::logging
