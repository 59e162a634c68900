#include "tools/foxglove/mcap_scene.h"

#include <cstdio>
#include <utility>
#include <vector>

#include "fmt/format.h"
#include "logging/derived/derived_reader.h"
#include "logging/events/events.h"
#include "logging/printable.h"
#include "logging/run_record.h"
#include "tools/foxglove/scene_topics.h"
#include "tools/scenario/former_fields.h"

namespace poise {
namespace {

class Scene : public logging::McapTopics {
 public:
  Scene(logging::RunRecord run, Scenario scenario)
      : run_(std::move(run)),
        scenario_(std::move(scenario)),
        topics_(
            run_, scenario_,
            [this](size_t topic, uint64_t time, const std::string& message) {
              writer_->AddMessage(channels_[topic], counts_[topic]++, time, message);
            },
            logging::DerivedReader::kMostTicks) {}

  void Begin(logging::McapWriter* writer) override {
    writer_ = writer;
    writer->AddAttachment(
        run_.info.urdf.find("<mujoco") == std::string::npos ? "robot.urdf" : "robot.xml",
        "application/xml", run_.info.urdf);
    writer->AddAttachment("robot.pbtxt", "text/plain", run_.info.robot);
    writer->AddAttachment("scenario.pbtxt", "text/plain", run_.info.scenario);
    for (const SceneTopic& topic : topics_.topics()) {
      const uint16_t schema =
          writer->AddSchema(topic.schema, topic.schema_encoding, topic.schema_data);
      channels_.push_back(writer->AddChannel(schema, topic.name, topic.encoding, {}));
    }
    counts_.resize(channels_.size());
    topics_.Begin();
    events_ = logging::Events(run_);
  }
  void Add(const MessageType& type, const logging::LogEvent& event,
           logging::McapWriter* /*writer*/) override {
    AddEvents(1e-6 * static_cast<double>(event.utime) - run_.duration(run_.spec.lead_ticks()));
    topics_.Add(event.channel, type, event.data);
  }
  void End(logging::McapWriter* /*writer*/) override {
    AddEvents(HUGE_VAL);
    topics_.End();
  }

 private:
  /// Up to a time (s of the scenario), so that chunks stay in order.
  void AddEvents(double time) {
    for (; next_event_ < events_.size() && events_[next_event_].time <= time; ++next_event_) {
      const logging::Event& event = events_[next_event_];
      topics_.AddEvent(event.time, event.name, event.detail);
    }
  }

  logging::RunRecord run_;
  Scenario scenario_;
  logging::McapWriter* writer_ = nullptr;
  std::vector<uint16_t> channels_;
  std::vector<uint32_t> counts_;
  std::vector<logging::Event> events_;
  size_t next_event_ = 0;
  SceneTopics topics_;
};

}  // namespace

std::unique_ptr<logging::McapTopics> McapScene(const std::string& log) {
  try {
    logging::RunRecord run = logging::ReadRun(log);
    Scenario scenario = LoggedScenario(run.info.scenario, log + ": RUN_INFO.scenario");
    return std::make_unique<Scene>(std::move(run), std::move(scenario));
  } catch (const std::runtime_error& error) {
    fmt::print(stderr, "warning: {}; the file has the messages, and no robot to be seen\n",
               logging::ForTerminal(error.what()));
    return nullptr;
  }
}

}  // namespace poise
