// relitd with batches on it, for end-to-end tests: killed and started again, filled with work, asked how
// far it is.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/batch_client.h"
#include "tests/support/http_client.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {

/// A server on one data folder, through as many processes as it takes.
class Restarting {
public:
    explicit Restarting(std::vector<std::string> flags) : flags_(std::move(flags)) { start(); }

    void start() {
        process_ = std::make_unique<RelitProcess>(
            RelitProcess::Settings{.flags = flags_, .data_dir = folder_.path() / "data"});
        if (process_->port() == 0) throw std::runtime_error("it did not start: " + process_->log());
        port_ = process_->port();
    }
    void kill() {
        process_->signal(SIGKILL);
        process_->exit_status();
        ++kills_;
    }
    [[nodiscard]] CurrentPort port() const {
        return [this] { return port_.load(); };
    }
    [[nodiscard]] RelitProcess& process() { return *process_; }
    [[nodiscard]] std::filesystem::path batches() const {
        return folder_.path() / "data" / "batches";
    }
    [[nodiscard]] int kills() const { return kills_; }

private:
    TemporaryFolder folder_;
    std::vector<std::string> flags_;
    std::unique_ptr<RelitProcess> process_;
    std::atomic<int> port_{0};
    int kills_ = 0;
};

/// What is known of a batch.
inline nlohmann::json batch_at(int port, const std::string& id) {
    return nlohmann::json::parse(http(port, "GET", "/v1/batches/" + id).body);
}

/// The id of a new image of `side` x `side` texels.
inline std::string uploaded(int port, int seed, int side) {
    return nlohmann::json::parse(
        http(port, "POST", "/v1/images", small_png(seed, side, side)).body)["id"];
}

/// A material whose pictures take longer than a test.
inline constexpr const char* endless = R"({"illumination": "count", "steps": 10000})";

class BatchServer : public testing::Test {
protected:
    [[nodiscard]] static std::string orbit(const std::string& image, int count,
                                           const std::string& material = "{}") {
        return R"({"scene": {"height": {"image": ")" + image + R"("}, "material": )" + material +
               R"(}, "sweep": {"path": "orbit", "count": )" + std::to_string(count) + "}}";
    }
    static bool comes_true(const std::function<bool()>& condition,
                           std::chrono::milliseconds patience = std::chrono::seconds(20)) {
        const auto deadline = std::chrono::steady_clock::now() + patience;
        while (!condition()) {
            if (std::chrono::steady_clock::now() > deadline) return false;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        return true;
    }
    /// The id of a finished batch of two pictures in a data folder, whose server has ended.
    static std::string left_finished_in(const std::filesystem::path& folder) {
        RelitProcess relitd({.data_dir = folder});
        const std::string id = submit_until_accepted([&] { return relitd.port(); },
                                                     orbit(uploaded(relitd.port(), 1, 32), 2), "k");
        EXPECT_TRUE(comes_true([&] { return batch_at(relitd.port(), id)["status"] == "done"; }));
        relitd.signal(SIGTERM);
        EXPECT_EQ(relitd.exit_status(), 0);
        return id;
    }
};

}  // namespace relit::test
