// Signals that end a run.
#pragma once

namespace poise {

/// From now on SIGINT, SIGTERM and SIGHUP are noted instead of ending this process.
void CatchStopSignals();
/// The last one that came, 0 for none.
int StopSignal();
/// How many have come: a second one means hurry.
int StopSignalCount();

}  // namespace poise
