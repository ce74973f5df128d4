// The three descriptors that every program expects to be open, for main() of the programs.
#pragma once

namespace relit {

/// Sees to it that descriptors 0, 1 and 2 are taken, so that no file, socket or signal descriptor
/// of the program becomes its stdin, stdout or stderr where the caller closed one (`relit <&-`).
///
/// What is missing becomes /dev/null, opened the wrong way round: reading from stdin and writing to
/// stdout or stderr go on failing with EBADF, as they would without it, and nothing is mistaken
/// for an empty input or a successful output. What is open stays as it is.
///
/// Call it first in main(), before anything opens a file. POSIX only. Ends the program (abort)
/// where /dev/null cannot be opened.
void hold_standard_files();

}  // namespace relit
