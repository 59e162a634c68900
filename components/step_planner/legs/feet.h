// The feet's names, as steps use them.
#pragma once

#include "components/robot/foot.h"

namespace poise::stepping {

using robot::Foot;
using robot::FootArray;
using robot::kFeet;
using robot::Other;
using robot::Side;

}  // namespace poise::stepping
