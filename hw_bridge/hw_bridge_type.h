#pragma once

#include <csignal>

#include "components/framework/component_type.h"

namespace poise {

/// `stop_signal` (may be nullptr): once it is not 0, the bridge stops as on EMERGENCY_STOP.
ComponentType HwBridgeType(volatile std::sig_atomic_t* stop_signal = nullptr);

}  // namespace poise
