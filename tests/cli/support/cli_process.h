// The real relit, and shells that call it: as a child with pipes, or on a terminal of its own.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace relit::test {

struct Ran {
    int status = -1;  ///< exit status, or 128 + n after signal n
    std::string out;
    std::string err;
};

/// Runs a shell command in `folder` to its end, `relit` and `relitd` on its PATH.
[[nodiscard]] Ran shell(const std::string& command, const std::filesystem::path& folder,
                        const std::string& input = "");

/// A program on a terminal of its own (all three descriptors).
class OnTerminal {
public:
    using Duration = std::chrono::duration<double>;

    OnTerminal(const std::vector<std::string>& arguments, const std::filesystem::path& folder);
    ~OnTerminal();  ///< kills what still runs
    OnTerminal(const OnTerminal&) = delete;
    OnTerminal& operator=(const OnTerminal&) = delete;

    /// What keys do: "\x03" is Ctrl-C.
    void type(const std::string& keys) const;
    void signal(int number) const;

    /// Reads until `text` has come. @return whether it has, in time
    bool shows(const std::string& text, Duration patience = std::chrono::seconds(20));
    /// Everything that has come so far; forget() empties it.
    [[nodiscard]] const std::string& screen() const { return screen_; }
    void forget() { screen_.clear(); }

    /// As Ran::status; -1 when it still runs after `patience`.
    int exit_status(Duration patience = std::chrono::seconds(20));

private:
    bool read_some(Duration patience);
    int terminal_ = -1;
    pid_t pid_ = -1;
    std::string screen_;
};

}  // namespace relit::test
