// When a foot's load says that it stands: for the planner that waits for it, and for who judges
// that.
#pragma once

#include "components/messages/contact_confirmation.pb.h"

namespace poise {

/// s that a load must last, or its loss: ten periods of 500 Hz, longer than the sensor's noise.
inline constexpr double kTouchTime = 0.02;

/// N below which contact is lost: a share of touch_load, so that it does not flicker.
inline double ReleaseLoad(const ContactConfirmation& config) { return 0.4 * config.touch_load(); }

}  // namespace poise
