#include "components/framework/build_info.h"

#include <unistd.h>

#include <cstring>
#include <string>

#include "poise_commit.h"

// This file is compiled for the oldest processor: the check below must run where the rest cannot.
namespace poise {
namespace {

#if defined(__x86_64__)
/// Ends a program that the processor cannot run, before any code that would end it by SIGILL.
[[gnu::constructor(101)]] void CheckProcessor() {
  if (std::strcmp(POISE_BITS, "x86-64-v3") != 0) return;
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return;
  static constexpr char kText[] =
      "poise: this program was built for x86-64-v3 (AVX2, FMA), which this processor lacks; build "
      "it here (deploy/setup), or with -DPOISE_INSTRUCTION_SET=x86-64\n";
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, kText, sizeof(kText) - 1);
  _exit(2);
}
#endif

}  // namespace

const char* PoiseVersion() { return POISE_VERSION; }
const char* PoiseCommit() { return POISE_COMMIT; }
const char* InstructionSet() { return POISE_BITS; }

std::string VersionText(const std::string& program) {
  std::string text = program + " " + PoiseVersion() + " (";
  if (*PoiseCommit() != '\0') text += std::string("commit ") + PoiseCommit() + ", ";
  return text + InstructionSet() + ", " POISE_COMPILER ")";
}

}  // namespace poise
