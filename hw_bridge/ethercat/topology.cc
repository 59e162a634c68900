#include "hw_bridge/ethercat/topology.h"

#include <algorithm>

#include "hw_bridge/ethercat/links/link.h"

namespace poise::ethercat {
namespace {

std::vector<int> ActivePorts(const SlavePorts& slave) {
  std::vector<int> ports;
  for (const int port : kFrameOrder) {
    if (slave.active(port)) ports.push_back(port);
  }
  return ports;
}

/// The port that the frame came to first.
int EntryPort(const SlavePorts& slave) {
  const std::vector<int> ports = ActivePorts(slave);
  if (ports.empty()) return 0;
  if (ports.size() == 1 || !slave.has_times) return ports.front();
  return *std::min_element(ports.begin(), ports.end(), [&](int a, int b) {
    return static_cast<int32_t>(slave.times[static_cast<size_t>(a)] -
                                slave.times[static_cast<size_t>(b)]) < 0;
  });
}

uint32_t Between(const SlavePorts& slave, int from, int to) {
  return slave.times[static_cast<size_t>(to)] - slave.times[static_cast<size_t>(from)];
}

int PortBefore(const SlavePorts& slave, int port) {
  const std::vector<int> ports = ActivePorts(slave);
  const auto at = std::find(ports.begin(), ports.end(), port);
  return at == ports.begin() || at == ports.end() ? 0 : *(at - 1);
}

int32_t Delay(std::span<const SlavePorts> slaves, std::span<const SlavePlace> places, size_t i) {
  // The nearest slave above that has a clock, and the port that leads from it here.
  int parent = places[i].parent, port = places[i].parent_port;
  while (parent >= 0 && !slaves[static_cast<size_t>(parent)].has_times) {
    port = places[static_cast<size_t>(parent)].parent_port;
    parent = places[static_cast<size_t>(parent)].parent;
  }
  if (parent < 0 || !slaves[i].has_times) return 0;
  const SlavePorts& above = slaves[static_cast<size_t>(parent)];
  const int before = PortBefore(above, port);
  const uint32_t branch = Between(above, before, port);
  const uint32_t own = Between(slaves[i], 0, ActivePorts(slaves[i]).back());
  return places[static_cast<size_t>(parent)].delay +
         static_cast<int32_t>(Between(above, 0, before)) + static_cast<int32_t>(branch - own) / 2;
}

/// The slave before `swapped` on the cable, which frames enter at port `entry`; -1: none known. It
/// answers after all that hang behind it, and so its place among the answers does not tell.
int BeforeOnCable(std::span<const SlavePorts> slaves, size_t swapped, int entry, int open) {
  const std::vector<int> ports = ActivePorts(slaves[swapped]);
  if (ports.size() < 2 || !slaves[swapped].has_times) return open;
  const auto round_trip = [&](const SlavePorts& slave, int from) {
    uint32_t longest = 0;
    for (const int port : ActivePorts(slave))
      longest = std::max(longest, Between(slave, from, port));
    return longest;
  };
  // The slave to find is, of those whose frames are longer on their way, the one whose way is the
  // least longer.
  const uint32_t own = round_trip(slaves[swapped], entry);
  int before = -1;
  uint32_t least = UINT32_MAX;
  for (size_t i = 0; i < swapped; ++i) {
    const uint32_t way = slaves[i].has_times ? round_trip(slaves[i], 0) : 0;
    if (way <= own || way > least) continue;
    least = way;
    before = static_cast<int>(i);
  }
  return before;
}

}  // namespace

std::vector<SlavePlace> FindTopology(std::span<const SlavePorts> slaves,
                                     const std::function<std::string(int)>& describe) {
  struct Open {
    int slave, port;
  };
  std::vector<Open> open;  // ports at which a slave has still to be found, the next one last
  std::vector<SlavePlace> places(slaves.size());
  for (size_t i = 0; i < slaves.size(); ++i) {
    const int position = static_cast<int>(i);
    if (const int entry = EntryPort(slaves[i]); entry != 0) {
      const int before = BeforeOnCable(slaves, i, entry, open.empty() ? -1 : open.back().slave);
      throw EthercatError(
          "{}: frames enter it at port {} instead of port 0: its IN and OUT are swapped, and every "
          "slave behind it is out of its place; plug the cable that comes from the master into IN",
          before >= 0 ? "the slave behind " + describe(before) : "the first slave", entry);
    }
    if (i > 0) {
      if (open.empty()) {
        throw EthercatError(
            "{}: no slave before it has an open port for it; are IN and OUT of a slave swapped?",
            describe(position));
      }
      places[i].parent = open.back().slave;
      places[i].parent_port = open.back().port;
      open.pop_back();
    }
    const std::vector<int> ports = ActivePorts(slaves[i]);
    for (auto port = ports.rbegin(); port != ports.rend(); ++port) {
      if (*port != 0) open.push_back({position, *port});
    }
    places[i].delay = Delay(slaves, places, i);
  }
  if (!open.empty()) {
    throw EthercatError(
        "{}: its port {} is open, but no slave answers behind it; is something else plugged in?",
        describe(open.back().slave), open.back().port);
  }
  return places;
}

}  // namespace poise::ethercat
