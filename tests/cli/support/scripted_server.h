// A server that answers what it is told to, one reply after the other, and remembers what it was
// asked: for what a real one does seldom.
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace relit::test {

class ScriptedServer {
public:
    /// @param replies  each a whole HTTP reply; after the last it listens and stays silent
    explicit ScriptedServer(std::vector<std::string> replies);
    ~ScriptedServer();
    ScriptedServer(const ScriptedServer&) = delete;
    ScriptedServer& operator=(const ScriptedServer&) = delete;

    [[nodiscard]] std::string url() const;
    /// "HEAD /v1/images/…", in order.
    [[nodiscard]] std::vector<std::string> requests() const;

private:
    void serve();
    void serve_connection(int connection);

    std::vector<std::string> replies_;
    std::size_t next_ = 0;
    int listener_ = -1;
    int port_ = 0;
    std::atomic<bool> stopping_ = false;
    mutable std::mutex mutex_;
    std::vector<std::string> requests_;
    std::thread thread_;
};

/// A reply with a body and a header line more ("Retry-After: 1"); `to_head`: only its length.
[[nodiscard]] std::string http_reply(const std::string& status, const std::string& body = "",
                                     const std::string& header = "");

}  // namespace relit::test
