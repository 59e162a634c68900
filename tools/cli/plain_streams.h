// Output in plain characters, and the exception to it.
#pragma once

namespace poise {

/// What this program prints is for a file: it stays UTF-8 where UsePlainStreams would change it.
void KeepUnicode();

}  // namespace poise
