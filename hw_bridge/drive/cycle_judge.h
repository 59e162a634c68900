// CycleJudge: when a bus has failed too often to be used.
#pragma once

#include <bitset>

#include "hw_bridge/drive/drive_bus.h"

namespace poise {

/// Counts a bus's cycles. Never allocates.
class CycleJudge {
 public:
  /// Cycles without usable inputs, in a row and of the last hundred, that make a bus unusable.
  static constexpr int kMostInARow = 5, kMostIn100 = 20;

  /// A cycle: its inputs are `usable`; `silent`: nothing came back at all.
  void Count(bool usable, bool silent, BusHealth* health) {
    bad_[static_cast<size_t>(health->cycles % 100)] = !usable;
    ++health->cycles;
    health->bad_cycles += usable ? 0 : 1;
    health->bad_in_a_row = usable ? 0 : health->bad_in_a_row + 1;
    health->bad_in_100 = static_cast<int>(bad_.count());
    silent_in_a_row_ = silent ? silent_in_a_row_ + 1 : 0;
    if (health->usable &&
        (health->bad_in_a_row >= kMostInARow || health->bad_in_100 >= kMostIn100)) {
      health->usable = false;
      health->link_lost = silent_in_a_row_ >= kMostInARow;
    }
  }
  /// Forgets bad cycles: the bus is usable again.
  void Reset(BusHealth* health) {
    health->usable = true;
    health->link_lost = false;
    health->bad_in_a_row = silent_in_a_row_ = 0;
    bad_.reset();
  }

 private:
  int silent_in_a_row_ = 0;
  std::bitset<100> bad_;  // by cycle, modulo 100
};

}  // namespace poise
