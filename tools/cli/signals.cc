#include "tools/cli/signals.h"

#include <csignal>
#include <initializer_list>

namespace poise {
namespace {

volatile std::sig_atomic_t last_signal = 0;
volatile std::sig_atomic_t signal_count = 0;

void OnSignal(int signal) {
  last_signal = signal;
  signal_count = signal_count + 1;
}

}  // namespace

void CatchStopSignals(bool interrupt) {
  struct sigaction action {};
  action.sa_handler = OnSignal;
  action.sa_flags = interrupt ? 0 : SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
}

int StopSignal() { return last_signal; }
int StopSignalCount() { return signal_count; }

}  // namespace poise
