// How a command ends when it cannot do what was asked: one sentence and an exit status. Errors of
// the core and of scenes (core/base/error.h) become one on the way out.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace relit::cli {

/// Exit statuses; after a signal it is 128 + its number.
enum class Exit {
    ok = 0,
    refused = 1,      ///< the work failed: an input or a value is refused, the server said no
    usage = 2,        ///< the command line is not understood
    unreachable = 3,  ///< a file cannot be read or written, the server cannot be reached
};

/// @param words  what goes after "relit: "; empty: nothing is to be said
class Failure : public std::runtime_error {
public:
    Failure(Exit exit_status, const std::string& words)
        : std::runtime_error(words), status(exit_status) {}
    Exit status;
};

/// A sentence as part of a line: its first word in lower case, unless it is a name like PNG, no
/// full stop. Servers write whole sentences, the core parts of lines.
[[nodiscard]] std::string part_of_line(std::string_view sentence);

/// @throws Failure unreachable, always: "`name`: cannot `doing`: " and what errno says
[[noreturn]] void fail_with_errno(const std::string& name, const std::string& doing);

}  // namespace relit::cli
