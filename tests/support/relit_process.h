// The real relitd as a child process, on a free port and (unless told otherwise) with a data folder
// of its own.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace relit::test {

class RelitProcess {
public:
    struct Settings {
        std::vector<std::string> flags = {};
        std::filesystem::path data_dir = {};        ///< empty: a new one
        std::vector<std::string> environment = {};  ///< "NAME=value", added to the test's own
        bool with_usual_flags = true;               ///< --host, --port 0, --data-dir
    };

    /// Starts it and waits until it listens or has ended.
    RelitProcess() : RelitProcess(Settings{}) {}
    explicit RelitProcess(Settings settings);
    ~RelitProcess();  ///< kills what still runs
    RelitProcess(const RelitProcess&) = delete;
    RelitProcess& operator=(const RelitProcess&) = delete;

    [[nodiscard]] int port() const { return port_; }  ///< 0 when it ended instead of listening
    [[nodiscard]] pid_t pid() const { return pid_; }
    void signal(int number) const;

    /// The exit status, 128 + n after signal n; nothing when it still runs after `patience`.
    std::optional<int> exit_status(std::chrono::milliseconds patience = std::chrono::seconds(10));

    [[nodiscard]] std::string output() const {
        return output_;
    }                                            ///< what it printed until it listened
    [[nodiscard]] std::string log() const;       ///< what it wrote to stderr so far
    [[nodiscard]] long peak_memory_mib() const;  ///< VmHWM
    [[nodiscard]] const std::filesystem::path& data_dir() const { return settings_.data_dir; }

private:
    void start();
    void wait_until_listening(int output);

    TemporaryFolder folder_;
    Settings settings_;
    pid_t pid_ = -1;
    std::optional<int> exit_status_;
    int port_ = 0;
    std::string output_;
};

}  // namespace relit::test
