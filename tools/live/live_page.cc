#include "tools/live/live_page.h"

#include <algorithm>
#include <cmath>

#include "components/robot_files/robot_files.h"
#include "logging/log_reader.h"

namespace poise {

nlohmann::ordered_json ChannelsJson(const TickRing& ring) {
  using Json = nlohmann::ordered_json;
  Json json = Json::array();
  for (const TickRing::Lane& lane : ring.lanes()) {
    Json item = {{"name", lane.name}, {"type", lane.type->name}, {"count", 0}};
    if (lane.external) item["ticks"] = {{"value", nullptr}};
    item["signals"] = Json::array();
    for (const TickRing::Signal& signal : lane.signals) {
      item["signals"].push_back({{"field", signal.field}, {"integer", signal.integer}});
    }
    json.push_back(std::move(item));
  }
  return json;
}

logging::RunRecord ReadRunStart(const std::string& log) {
  logging::LogReader reader(log);
  logging::RunRecord record;
  record.info = logging::ReadRunInfo(&reader, log, &record.spec);
  record.robot = robot::LoadRobotTexts(record.info.robot, record.info.urdf);
  return record;
}

int64_t TicksOf(double seconds, double period) {
  return std::max<int64_t>(1, std::llround(seconds / period));
}

}  // namespace poise
