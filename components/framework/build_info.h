// What this build is: its version, the commit that it was made from, and what its bits depend on.
#pragma once

#include <string>

namespace poise {

/// Poise's version, e.g. "0.1.0".
const char* PoiseVersion();

/// The commit that the build was configured or set up at, "+changes" after it when files were
/// changed then; "" when the sources were no git checkout.
const char* PoiseCommit();

/// The instruction set that decides the last bits of all results: "x86-64-v3", "x86-64", "native",
/// or another architecture's name. Builds of the same name give the same bits; two of "native" may
/// differ.
const char* InstructionSet();

/// "PROGRAM 0.1.0 (commit 0123456789ab, x86-64-v3, GNU 12.2.0)", for --version.
std::string VersionText(const std::string& program);

}  // namespace poise
