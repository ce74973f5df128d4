#include "clients/cli/failure.h"

#include <cerrno>
#include <system_error>

#include "server/text.h"

namespace relit::cli {

std::string part_of_line(std::string_view sentence) {
    if (sentence.ends_with('.')) sentence.remove_suffix(1);
    std::string words(sentence);
    const auto is_capital = [](char c) { return c >= 'A' && c <= 'Z'; };
    if (words.size() > 1 && is_capital(words[0]) && !is_capital(words[1]))
        words[0] = server::lower(words[0]);
    return words;
}

void fail_with_errno(const std::string& name, const std::string& doing) {
    const int error = errno;
    throw Failure(Exit::unreachable, name + ": cannot " + doing + ": " +
                                         part_of_line(std::generic_category().message(error)));
}

}  // namespace relit::cli
