// A handler that is at work for as long as a test likes, and the fixture of tests of connections.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>

#include "server/error_codes.h"
#include "server/http/message.h"
#include "server/services.h"
#include "tests/support/http_client.h"
#include "tests/support/test_server.h"

namespace relit::server {

using namespace std::chrono_literals;
using test::http;
using test::http_request;
using test::RawConnection;
using test::TestServer;
using Clock = std::chrono::steady_clock;

/// Works until it is told to stop, or the test lets it finish.
struct Work {
    std::mutex mutex;
    std::condition_variable_any changed;
    int begun = 0;
    bool finish = false;
    std::atomic<int> abandoned{0};
    std::atomic<std::chrono::steady_clock::time_point> abandoned_at{};

    void wait_until_begun(int count) {
        std::unique_lock lock(mutex);
        ASSERT_TRUE(
            changed.wait_for(lock, std::chrono::seconds(10), [&] { return begun >= count; }));
    }
    void let_finish() {
        const std::scoped_lock lock(mutex);
        finish = true;
        changed.notify_all();
    }
};
inline Work* work = nullptr;  ///< of the test that runs

inline Reply work_long(const Request& request, Services&) {
    std::unique_lock lock(work->mutex);
    ++work->begun;
    work->changed.notify_all();
    if (work->changed.wait(lock, request.client_gone, [] { return work->finish; }))
        return {.body = "done"};
    work->abandoned_at = std::chrono::steady_clock::now();
    ++work->abandoned;
    throw Error(error_code::cancelled, "abandoned");
}

/// What work_long() does is done when the test ends.
class LongWork : public testing::Test {
protected:
    void SetUp() override { work = &work_; }
    void TearDown() override { work_.let_finish(); }
    Work work_;
};

}  // namespace relit::server
