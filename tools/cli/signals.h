// Signals that end a run.
#pragma once

namespace poise {

/// From now on SIGINT, SIGTERM and SIGHUP are noted instead of ending this process. With
/// `interrupt` they end a system call that waits (EINTR), such as a write to a pipe that nobody
/// reads.
void CatchStopSignals(bool interrupt = false);
/// The last one that came, 0 for none.
int StopSignal();
/// How many have come: a second one means hurry.
int StopSignalCount();

}  // namespace poise
